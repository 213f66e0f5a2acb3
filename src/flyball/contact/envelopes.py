"""Envelopes of shapes: what a shape, with what it covers, stays in for a while. See `desk`."""

from __future__ import annotations

from ..compiler.jit import formula
from ..math.scalar import sqrt
from .desk import (
    AT,
    BOX_HALF,
    CENTRE,
    DRIFT,
    DRIFTS,
    FRAME,
    GOES,
    HALF_LINE,
    HELD,
    MIDDLE,
    ROUND,
    SIZE,
    SPIN,
    USUAL,
    WHOLE,
)
from .tables import AHEAD, AXES, MARGIN, MOVER, SKIN

LARGE = 3.0  # in usual radii: larger shapes have no thicker skins
STEPS = 8.0  # an envelope reaches this many steps ahead
LEAD = 0.5  # but no further than this, in radii


@formula
def rotated(M, m, x, y, z):
    """A vector of mover m along the world's axes."""
    return (
        M.pose[m, 3] * x + M.pose[m, 4] * y + M.pose[m, 5] * z,
        M.pose[m, 6] * x + M.pose[m, 7] * y + M.pose[m, 8] * z,
        M.pose[m, 9] * x + M.pose[m, 10] * y + M.pose[m, 11] * z,
    )


@formula
def locate(M, B, i, m, ball, row, s):
    """Where the middle of shape i is and how it goes, into row s of ``row`` (as `Search.now`)."""
    c = (B.hold[i, CENTRE], B.hold[i, CENTRE + 1], B.hold[i, CENTRE + 2])
    w = (0.0, 0.0, 0.0)
    p, v = c, w
    if m >= 0:
        p = (M.pose[m, 0], M.pose[m, 1], M.pose[m, 2])
        v = (M.twist[m, 0], M.twist[m, 1], M.twist[m, 2])
        w = (M.twist[m, 3], M.twist[m, 4], M.twist[m, 5])
        if c[0] != 0.0 or c[1] != 0.0 or c[2] != 0.0:
            a = rotated(M, m, c[0], c[1], c[2])
            p = (p[0] + a[0], p[1] + a[1], p[2] + a[2])
            v = (
                v[0] + w[1] * a[2] - w[2] * a[1],
                v[1] + w[2] * a[0] - w[0] * a[2],
                v[2] + w[0] * a[1] - w[1] * a[0],
            )
    row[s, AT], row[s, AT + 1], row[s, AT + 2] = p
    row[s, SIZE] = B.hold[i, HELD]
    row[s, GOES], row[s, GOES + 1], row[s, GOES + 2] = v
    row[s, SPIN] = 0.0 if ball else B.hold[i, HELD] * sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])


@formula
def axes_now(G, M, i, out, s):
    """The shape's axes in the world, into row s: what is left of them when envelopes are looked at again."""
    m = G.shape_i[i, MOVER]
    for c in range(3):
        a = (G.shape_x[i, AXES + c], G.shape_x[i, AXES + 3 + c], G.shape_x[i, AXES + 6 + c])
        if m >= 0:
            a = rotated(M, m, a[0], a[1], a[2])
        out[s, c], out[s, 3 + c], out[s, 6 + c] = a


@formula
def chord(G, M, B, s, i):
    """How far the surface has turned since the envelope was made, as a part of the radius: 2 sin(angle / 2)."""
    m = G.shape_i[i, MOVER]
    if m < 0:
        return 0.0
    total = 0.0
    for c in range(3):
        a = rotated(M, m, G.shape_x[i, AXES + c], G.shape_x[i, AXES + 3 + c], G.shape_x[i, AXES + 6 + c])
        for r in range(3):
            e = a[r] - B.turn[s, 3 * r + c]
            total += e * e
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
def within(G, M, B, s, i, ball):
    """Whether a shape, with what it covers in `AHEAD` seconds, is still within its envelope."""
    now, fat, real = B.now, B.fat, B.real
    allowed = fat[s, ROUND] - now[s, SIZE] - 0.5 * real[MARGIN]
    if not ball:
        allowed -= now[s, SIZE] * chord(G, M, B, s, i)
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
def to_box(B, s, i, x, y, z):
    """Squared distance of a point, from the middle of the envelope of slot s (shape i), to the shape's box."""
    total = 0.0
    for c in range(3):
        a = abs(B.turn[s, c] * x + B.turn[s, 3 + c] * y + B.turn[s, 6 + c] * z) - B.hold[i, BOX_HALF + c]
        total += a * a if a > 0.0 else 0.0
    return total
