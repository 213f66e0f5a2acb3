"""Contacts of the pairs on the list: balls and planes here, all others by the narrow phase."""

from __future__ import annotations

from ..compiler.door import enter
from ..compiler.jit import formula
from ..math.scalar import sqrt
from .desk import (
    ANY,
    ASKED_1,
    ASKED_2,
    AT,
    BALL_FLAT,
    BALLS,
    BOUNDED,
    FLAT,
    FORM,
    GOES,
    HALF,
    LISTED,
    MOVES,
    NARROW,
    ORIGIN,
    REACH,
    SHAPE,
    SIZE,
    SPEED,
    SPIN,
    TURNS,
    UP,
)
from .same import before
from .tables import AHEAD, BEFORE, FEATURE, GAP, MARGIN, NORMAL, POINT, SHAPE_1, SHAPE_2


@formula
def write(C, n, point, normal, gap):
    """Row n of the contacts, if there is one."""
    if n < C.x.shape[0]:
        C.x[n, POINT], C.x[n, POINT + 1], C.x[n, POINT + 2] = point
        C.x[n, NORMAL], C.x[n, NORMAL + 1], C.x[n, NORMAL + 2] = normal
        C.x[n, GAP] = gap


@formula
def sign(C, n, i, j, feature, first):
    """Say between which shapes contact n is, and which it was before."""
    if n < C.at.shape[0]:
        C.at[n, SHAPE_1], C.at[n, SHAPE_2], C.at[n, FEATURE], C.at[n, BEFORE] = i, j, feature, first


@formula
def balls(C, B, s, t, n):
    """The contact of two spheres, as row n: how many.

    Spheres whose surfaces come to within the margin in `AHEAD` seconds, as they go, touch already: along the normal
    at which they will (first) be nearest, with the gap between their tangent planes across it. A sphere that passes
    another has no contact with it.
    """
    now, far = B.now, 0.0
    x, y, z = now[t, AT] - now[s, AT], now[t, AT + 1] - now[s, AT + 1], now[t, AT + 2] - now[s, AT + 2]
    r = now[s, SIZE] + now[t, SIZE]
    reach = r + B.real[MARGIN]
    d2 = x * x + y * y + z * z
    a, b, c = x, y, z
    if d2 >= reach * reach:
        u = (now[t, GOES] - now[s, GOES], now[t, GOES + 1] - now[s, GOES + 1], now[t, GOES + 2] - now[s, GOES + 2])
        du = x * u[0] + y * u[1] + z * u[2]
        if du >= 0.0:
            return 0
        u2 = u[0] * u[0] + u[1] * u[1] + u[2] * u[2]
        time = min(B.real[AHEAD], -du / u2)
        if d2 + time * (2.0 * du + time * u2) >= reach * reach:
            return 0
        deep = du * du - u2 * (d2 - r * r)  # discriminant: when the surfaces meet
        if deep > 0.0:
            time = min(time, (d2 - r * r) / (sqrt(deep) - du))
        a, b, c = x + time * u[0], y + time * u[1], z + time * u[2]
        d2 = a * a + b * b + c * c
        far = 1.0
    d = sqrt(d2)
    if d > 1e-150:
        a, b, c = a / d, b / d, c / d
    else:
        a, b, c = 1.0, 0.0, 0.0
    gap = d - r if far == 0.0 else a * x + b * y + c * z - r
    p = now[s, SIZE] - 0.5 * r
    point = (
        now[s, AT] + 0.5 * x + p * a,
        now[s, AT + 1] + 0.5 * y + p * b,
        now[s, AT + 2] + 0.5 * z + p * c,
    )
    write(C, n, point, (a, b, c), gap)
    return 1


@formula
def flat_ball(C, B, w, s, side, n):
    """The contact of wide slot w, a plane, and slot s, a sphere; ``side`` is -1 where the sphere is shape 1."""
    k = w - B.count[BOUNDED]
    q = B.wide
    x = (B.now[s, AT] - q[k, ORIGIN], B.now[s, AT + 1] - q[k, ORIGIN + 1], B.now[s, AT + 2] - q[k, ORIGIN + 2])
    a, b, c = q[k, UP], q[k, UP + 1], q[k, UP + 2]
    gap = a * x[0] + b * x[1] + c * x[2] - B.now[s, SIZE]
    if gap >= B.real[MARGIN]:
        u = (q[k, TURNS], q[k, TURNS + 1], q[k, TURNS + 2])
        closing = a * (q[k, SPEED] + u[1] * x[2] - u[2] * x[1] - B.now[s, GOES])
        closing += b * (q[k, SPEED + 1] + u[2] * x[0] - u[0] * x[2] - B.now[s, GOES + 1])
        closing += c * (q[k, SPEED + 2] + u[0] * x[1] - u[1] * x[0] - B.now[s, GOES + 2])
        if gap >= B.real[MARGIN] + closing * B.real[AHEAD]:
            return 0
    p = B.now[s, SIZE] + 0.5 * gap
    point = (B.now[s, AT] - p * a, B.now[s, AT + 1] - p * b, B.now[s, AT + 2] - p * c)
    write(C, n, point, (side * a, side * b, side * c), gap)
    return 1


@formula
def velocity(M, m, p):
    """Velocity of mover m at a point."""
    if m < 0:
        return (0.0, 0.0, 0.0)
    x, y, z = p[0] - M.pose[m, 0], p[1] - M.pose[m, 1], p[2] - M.pose[m, 2]
    a, b, c = M.twist[m, 3], M.twist[m, 4], M.twist[m, 5]
    return (
        M.twist[m, 0] + b * z - c * y,
        M.twist[m, 1] + c * x - a * z,
        M.twist[m, 2] + a * y - b * x,
    )


@formula
def farthest(B, s, t):
    """The largest gap at which a pair of bounded slots may touch within `AHEAD` seconds; below 0 if it cannot."""
    now = B.now
    reach = B.real[MARGIN]
    if s >= B.count[BOUNDED] or t >= B.count[BOUNDED]:
        return reach
    u2, d2 = 0.0, 0.0
    for c in range(3):
        u = now[t, GOES + c] - now[s, GOES + c]
        d = now[t, AT + c] - now[s, AT + c]
        u2, d2 = u2 + u * u, d2 + d * d
    reach += B.real[AHEAD] * (sqrt(u2) + now[s, SPIN] + now[t, SPIN])
    whole = reach + now[s, SIZE] + now[t, SIZE]
    return reach if d2 < whole * whole else -1.0


@formula
def above(M, B, w, s):
    """As `farthest`, for wide slot w and slot s."""
    k = w - B.count[BOUNDED]
    q = B.wide
    p = (B.now[s, AT], B.now[s, AT + 1], B.now[s, AT + 2])
    v = velocity(M, B.slot[w, MOVES], p)
    gap, u2, t2 = -B.now[s, SIZE], 0.0, 0.0
    for c in range(3):
        gap += q[k, UP + c] * (p[c] - q[k, ORIGIN + c])
        u2 += (v[c] - B.now[s, GOES + c]) ** 2
        t2 += q[k, TURNS + c] ** 2
    reach = B.real[MARGIN] + B.real[AHEAD] * (sqrt(u2) + B.now[s, SPIN] + sqrt(t2) * B.now[s, SIZE])
    return -1.0 if B.slot[w, FORM] == FLAT and gap > reach else reach


@formula
def others(G, M, C, O, B, s, t, first, n):
    """Contacts of any pair, from row n on: how many."""
    bounded = B.count[BOUNDED]
    reach = farthest(B, s, t) if s < bounded and t < bounded else above(M, B, max(s, t), min(s, t))
    if reach < 0.0:
        return 0
    i, j = B.slot[s, SHAPE], B.slot[t, SHAPE]
    B.count[ASKED_1], B.count[ASKED_2], B.real[REACH] = i, j, reach
    found = enter(B.count[NARROW], G, M, B, B, B, 0)
    many, used = 0, 0
    a, b = B.slot[s, MOVES], B.slot[t, MOVES]
    size = min(B.now[s, SIZE], B.now[t, SIZE])
    for k in range(found):
        p = (B.room[k, 0], B.room[k, 1], B.room[k, 2])
        e = (B.room[k, 3], B.room[k, 4], B.room[k, 5])
        gap = B.room[k, 6]
        v, u = velocity(M, a, p), velocity(M, b, p)
        closing = e[0] * (v[0] - u[0]) + e[1] * (v[1] - u[1]) + e[2] * (v[2] - u[2])
        if gap < B.real[MARGIN] + B.real[AHEAD] * max(0.0, closing):
            h = B.real[AHEAD]
            was = (p[0] - h * v[0], p[1] - h * v[1], p[2] - h * v[2])
            feature = int(B.room[k, 7])
            c, bit = before(O, (i, j), first, feature, was, size, used)
            used |= bit
            write(C, n + many, p, e, gap)
            sign(C, n + many, i, j, feature, c)
            many += 1
    return many


@formula
def touch(G, M, C, O, B):
    """All contacts: how many there are, also where there is no room for them all."""
    n, half = 0, B.count[HALF]
    for k in range(B.count[LISTED]):
        s, t, way, first = B.pair[k, 0], B.pair[k, 1], B.pair[k, 2], B.seen[half, k]
        if way == ANY:
            found = others(G, M, C, O, B, s, t, first, n)
        else:
            if way == BALLS:
                found = balls(C, B, s, t, n)
            elif way == BALL_FLAT:
                found = flat_ball(C, B, t, s, -1.0, n)
            else:
                found = flat_ball(C, B, s, t, 1.0, n)
            if found != 0:
                sign(C, n, B.slot[s, SHAPE], B.slot[t, SHAPE], 0, first)
        B.seen[1 - half, k] = n if found > 0 else -1
        n += found
    return n
