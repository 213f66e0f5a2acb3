"""Contacts of spheres and planes, found here for speed."""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from ...math.vec import add, dot, load3, scale, sub
from ..tables import AHEAD, MARGIN
from .desk import AT, BOUNDED, DRIFT, GOES, MOVES, ORIGIN, SIZE, SPEED, TURNS, UP
from .rows import write


@formula
def met(d, r, reach, u, ahead):
    """When spheres a vector d apart that goes on with u touch, or are nearest; -1 if not within ``reach``."""
    du, u2, d2 = dot(d, u), dot(u, u), dot(d, d)
    if du >= 0.0:
        return -1.0
    time = min(ahead, -du / u2)
    if d2 + time * (2.0 * du + time * u2) >= reach * reach:
        return -1.0
    deep = du * du - u2 * (d2 - r * r)  # discriminant: when the surfaces meet
    if deep > 0.0:
        time = min(time, (d2 - r * r) / (sqrt(deep) - du))
    return time


@formula
def balls(C, B, s, t, n):
    """The contact of two spheres, as row n: how many.

    Spheres whose surfaces come to within the margin in `AHEAD` seconds, as they go or if something stops one of them,
    touch already: along the normal at which they will (first) be nearest, with the gap between their tangent planes
    across it. A sphere that passes another has no contact with it.
    """
    now, far = B.now, 0.0
    x, y, z = now[t, AT] - now[s, AT], now[t, AT + 1] - now[s, AT + 1], now[t, AT + 2] - now[s, AT + 2]
    r = now[s, SIZE] + now[t, SIZE]
    reach = r + B.real[MARGIN]
    d2 = x * x + y * y + z * z
    a, b, c = x, y, z
    if d2 >= reach * reach:
        D = (B.real[DRIFT], B.real[DRIFT + 1], B.real[DRIFT + 2])
        v, w = sub(load3(now, s, GOES), D), sub(load3(now, t, GOES), D)
        u = sub(w, v)
        time = met((x, y, z), r, reach, u, B.real[AHEAD])
        if time < 0.0:
            u = w
            time = met((x, y, z), r, reach, u, B.real[AHEAD])
        if time < 0.0:
            u = scale(-1.0, v)
            time = met((x, y, z), r, reach, u, B.real[AHEAD])
        if time < 0.0:
            return 0
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
    # half of what the middles are apart across the normal: each sphere is touched on the line through its own middle
    along = 0.5 * (a * x + b * y + c * z)
    apart = 0.5 * x - along * a, 0.5 * y - along * b, 0.5 * z - along * c
    if B.slot[t, MOVES] < 0:
        point, apart = sub(point, apart), (0.0, 0.0, 0.0)
    elif B.slot[s, MOVES] < 0:
        point, apart = add(point, apart), (0.0, 0.0, 0.0)
    write(C, n, point, (a, b, c), gap, apart)
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
    write(C, n, point, (side * a, side * b, side * c), gap, (0.0, 0.0, 0.0))
    return 1
