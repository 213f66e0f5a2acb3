"""Envelopes of shapes: what a shape, with what it covers, stays in for a while. See `desk`."""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from ...math.vec import add, load3, norm, put3
from ..tables import AHEAD, AXES, MARGIN, SKIN
from .carried import rotated, velocity_there
from .desk import (
    AT,
    BALL,
    BOX_HALF,
    CENTRE,
    DRIFT,
    DRIFTS,
    FORM,
    FRAME,
    GOES,
    HALF_LINE,
    HELD,
    MIDDLE,
    ROUND,
    SHAPE,
    SIZE,
    SPIN,
    USUAL,
    WHOLE,
)

LARGE = 3.0  # in usual radii: larger shapes have no thicker skins
STEPS = 8.0  # an envelope reaches this many steps ahead
LEAD = 0.5  # but no further than this, in radii


@formula
def locate(M, B, i, m, ball, row, s):
    """Where the middle of shape i is and how it goes, into row s of ``row`` (as `Search.now`)."""
    c = load3(B.hold, i, CENTRE)
    w = (0.0, 0.0, 0.0)
    p, v = c, w
    if m >= 0:
        p, v, w = load3(M.pose, m, 0), load3(M.twist, m, 0), load3(M.twist, m, 3)
        if c[0] != 0.0 or c[1] != 0.0 or c[2] != 0.0:
            a = rotated(M, m, c)
            p, v = add(p, a), velocity_there(M, m, a)
    put3(row, s, AT, p)
    put3(row, s, GOES, v)
    row[s, SIZE] = B.hold[i, HELD]
    row[s, SPIN] = 0.0 if ball else B.hold[i, HELD] * norm(w)


@formula
def axes_now(G, M, B, s, i, m):
    """Axes of slot s, shape i of mover m, in the world."""
    for c in range(3):
        a = (G.shape_x[i, AXES + c], G.shape_x[i, AXES + 3 + c], G.shape_x[i, AXES + 6 + c])
        if m >= 0:
            a = rotated(M, m, a)
        B.axes[s, c], B.axes[s, 3 + c], B.axes[s, 6 + c] = a


@formula
def keep_axes(B, s):
    """Remember the axes with which an envelope is made."""
    for c in range(9):
        B.turn[s, c] = B.axes[s, c]


@formula
def chord(B, s):
    """How far the surface has turned since the envelope was made, as a part of the radius: 2 sin(angle / 2)."""
    total = 0.0
    for c in range(9):
        total += (B.axes[s, c] - B.turn[s, c]) ** 2
    return sqrt(0.5 * total)


@formula
def fatten(B, rows, s, at, still):
    """Make an envelope from row s (columns as `Search.now`), into columns from ``at`` on (as `Search.fat`).

    Returns the radius that the ball about it may have got when the shape has gained some speed.
    """
    r, spin = rows[s, SIZE], rows[s, SPIN]
    u = (
        rows[s, GOES] - B.real[DRIFT],
        rows[s, GOES + 1] - B.real[DRIFT + 1],
        rows[s, GOES + 2] - B.real[DRIFT + 2],
    )
    speed = sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
    size = min(r, LARGE * B.real[USUAL])
    skin = B.real[SKIN] * size
    if still and B.count[DRIFTS] == 0:
        skin = 0.0
    time = STEPS * B.real[AHEAD]
    if (speed + spin) * time > LEAD * size:
        time = LEAD * size / (speed + spin)
    time += B.real[AHEAD]
    half = 0.5 * time
    for c in range(3):
        rows[s, at + MIDDLE + c] = rows[s, AT + c] - B.real[FRAME + c] + half * u[c]
        rows[s, at + HALF_LINE + c] = half * u[c]
    rows[s, at + ROUND] = r + 0.5 * B.real[MARGIN] + skin + spin * time
    whole = rows[s, at + ROUND] + half * speed
    rows[s, at + WHOLE] = whole
    later = r + 0.5 * B.real[MARGIN] + skin + 0.6 * LEAD * size
    return whole if still or whole > later else later


@formula
def off(fat, s, x, y, z):
    """Squared distance of a point, from the middle of the capsule, to its line."""
    a, b, c = fat[s, HALF_LINE], fat[s, HALF_LINE + 1], fat[s, HALF_LINE + 2]
    e2 = a * a + b * b + c * c
    if e2 > 0.0:
        t = min(1.0, max(-1.0, (x * a + y * b + z * c) / e2))
        x, y, z = x - t * a, y - t * b, z - t * c
    return x * x + y * y + z * z


@formula
def within(B, s, ball):
    """Whether a shape, with what it covers in `AHEAD` seconds, is still within its envelope."""
    now, fat, real = B.now, B.fat, B.real
    allowed = fat[s, ROUND] - now[s, SIZE] - 0.5 * real[MARGIN]
    if not ball:
        allowed -= now[s, SIZE] * chord(B, s)
    x = now[s, AT] - real[FRAME] - fat[s, MIDDLE]
    y = now[s, AT + 1] - real[FRAME + 1] - fat[s, MIDDLE + 1]
    z = now[s, AT + 2] - real[FRAME + 2] - fat[s, MIDDLE + 2]
    tiny = 1e-12 * now[s, SIZE]
    if allowed < -tiny or off(fat, s, x, y, z) > (allowed + tiny) ** 2:
        return False
    x += (now[s, GOES] - real[DRIFT]) * real[AHEAD]
    y += (now[s, GOES + 1] - real[DRIFT + 1]) * real[AHEAD]
    z += (now[s, GOES + 2] - real[DRIFT + 2]) * real[AHEAD]
    allowed -= now[s, SPIN] * real[AHEAD]
    return allowed >= -tiny and off(fat, s, x, y, z) <= (allowed + tiny) ** 2


@formula
def to_box(B, axes, s, d):
    """Squared distance to the box of slot s, with these axes, of a point at d from its middle."""
    total, i = 0.0, B.slot[s, SHAPE]
    for c in range(3):
        a = abs(axes[s, c] * d[0] + axes[s, 3 + c] * d[1] + axes[s, 6 + c] * d[2]) - B.hold[i, BOX_HALF + c]
        total += a * a if a > 0.0 else 0.0
    return total


@formula
def depth(B, axes, s, n):
    """How far slot s reaches from its middle along a unit vector, and back."""
    if B.slot[s, FORM] == BALL:
        return B.now[s, SIZE]
    total, i = 0.0, B.slot[s, SHAPE]
    for c in range(3):
        a = axes[s, c] * n[0] + axes[s, 3 + c] * n[1] + axes[s, 6 + c] * n[2]
        total += B.hold[i, BOX_HALF + c] * abs(a)
    return min(total, B.now[s, SIZE])


@formula
def boxes_meet(B, axes, s, t, d, reach):
    """Whether boxes with these axes, the second's middle at d from the first's, come as near as this.

    Along the six axes of their faces; two that cross edge to edge may be further apart than this says.
    """
    i, j = B.slot[s, SHAPE], B.slot[t, SHAPE]
    for side in range(2):
        u, v, k, m = (s, t, i, j) if side == 0 else (t, s, j, i)
        for c in range(3):
            a = (axes[u, c], axes[u, 3 + c], axes[u, 6 + c])
            whole = B.hold[k, BOX_HALF + c] + reach
            for e in range(3):
                b = a[0] * axes[v, e] + a[1] * axes[v, 3 + e] + a[2] * axes[v, 6 + e]
                whole += B.hold[m, BOX_HALF + e] * abs(b)
            if abs(d[0] * a[0] + d[1] * a[1] + d[2] * a[2]) > whole:
                return False
    return True


@formula
def bodies_meet(B, axes, s, t, d, reach):
    """Whether the boxes of two slots come as near as this; of a sphere the sphere itself."""
    if B.slot[s, FORM] == BALL:
        if B.slot[t, FORM] == BALL:
            return True
        return to_box(B, axes, t, d) <= (reach + B.now[s, SIZE]) ** 2
    if B.slot[t, FORM] == BALL:
        return to_box(B, axes, s, d) <= (reach + B.now[t, SIZE]) ** 2
    return boxes_meet(B, axes, s, t, d, reach)
