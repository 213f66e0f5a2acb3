"""Places of contact: whether they stick or slide, which way, and the friction of those that slide.

A place is a STOP, its gap, and a SLIP along each of its tangents (`model/touch.py`). What sticks is held by rows; what
slides is pushed by -mu N d, N being the multiplier of the gap and d the direction of sliding.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.scalar import exp, sqrt
from ..tables.system import (
    G_ASTRAY,
    G_CONE,
    LOAD,
    OFF,
    RATE,
    VALUE,
)
from .pace import own_speed
from .rows import way_of

SLOW = 1e-10  # lengths of the mechanism, at its own rate: slower sliding in space goes the way of its switch
FRESH = 2.0  # length of the way of what begins to slide in space: in its first moments it goes that way
FIRST = 3e-5  # of the same: so fast it goes its own way for the most part; so many times as fast, wholly
OVER = 8.0
BACK = 1e-11  # of the same: so fast it goes back when it is told; at first its acceleration is rounding
TURNED = 0.5  # cosine of the angle by which a direction of sliding turns before its way is told anew
NOT_WATCHED = float("nan")


@formula
def slides(S, W, s):
    """Whether the place of contact whose first slip is switch s is closed and does not stick."""
    return W.modes.mode[s].real == OFF and W.modes.mode[S.switches.other[s]].real != OFF


@formula
def heading(S, W, sensed, s):
    """Direction of sliding along the tangents of slip s and of its partner, and the speed.

    In the plane it is the way of the switch, in space `direction`.
    """
    way = sensed[VALUE, way_of(S, W, s)]
    u = sensed[RATE, S.switches.measured[s]]
    other = S.switches.partner[s]
    if other < 0:
        return way, 0.0 * way, u * way
    side = sensed[VALUE, way_of(S, W, other)]
    v = sensed[RATE, S.switches.measured[other]]
    return direction(own_speed(S), (way, side), (u, v))


@formula
def direction(pace, ways, velocity):
    """Direction of sliding in space, and the speed along it; ``pace`` is the mechanism's own speed.

    It is that of the velocity, reversed where it is more against the way than with it: what comes to rest would slide
    on smoothly, until the event is found. What has just begun to slide goes its way, and that of its velocity as it
    gets faster: by itself the velocity turns infinitely fast there.
    """
    (way, side), (u, v) = ways, velocity
    square = u * u + v * v
    if (way * way + side * side).real > FRESH:
        return begins(pace, ways, velocity, square)
    slow = SLOW * pace
    if square.real <= slow.real * slow.real:
        return way, side, u * way + v * side
    speed = sqrt(square) if (u * way + v * side).real >= 0.0 else -sqrt(square)
    return u / speed, v / speed, speed


@formula
def begins(pace, way, velocity, square):
    """The same of what has just begun to slide: velocity + c exp(-(speed / c)^2) way, c = FIRST lengths at its rate."""
    first = FIRST * pace
    c = first * exp(-square / (first * first)) / FRESH
    a, b = velocity[0] + c * way[0], velocity[1] + c * way[1]
    size = sqrt(a * a + b * b)
    return a / size, b / size, (velocity[0] * a + velocity[1] * b) / size


@formula
def slide(S, W, k, work, f):
    """Add the friction of a place of contact to the generalised forces ``f``, and its power to its work."""
    a, b, power = friction(S, W, k)
    work[S.forces.work[k]] = power
    for side in range(2):
        m = S.forces.F[k] if side == 0 else S.forces.M[k]
        if m < 0:
            continue
        r = S.rows.law.shape[0] + m
        for j in range(S.row_start[r], S.row_start[r + 1]):
            f[S.column[j]] += (a if side == 0 else b) * W.G[j]


@formula
def friction(S, W, k):
    """-mu N d of a place of contact that slides along d, on each tangent, and its power; N is its gap's multiplier."""
    s = S.forces.switch[k]
    if not slides(S, W, s):
        o = 0.0 * W.sensed[LOAD, S.forces.load[k]]
        return o, o, o
    d, e, speed = heading(S, W, W.sensed, s)
    pressed, mu = W.sensed[LOAD, S.forces.load[k]], S.switch_numbers.kinetic_friction[s]
    if pressed.real < 0.0 and mu.real > 1.0:  # past where it opens, to the end of the step: it must not run away
        mu = 1.0 + 0.0 * mu
    push = -mu * pressed
    return push * d, push * e, push * speed


@formula
def watched_place(S, W, sensed, lam, kind, s):
    """Value of a guard of a place: friction that its stick has left; whether it slides its way; whether it is there."""
    if kind == G_ASTRAY:
        held = W.modes.mode[S.switches.other[s]] != OFF
        return sensed[VALUE, S.switches.measured[s]] if held else NOT_WATCHED
    other = S.switches.partner[s]
    if kind == G_CONE:
        if W.modes.mode[s] == OFF:
            return NOT_WATCHED
        pressed = lam[S.switches.row[S.switches.other[s]]]
        a = lam[S.switches.row[s]]
        b = lam[S.switches.row[other]] if other >= 0 else 0.0
        return S.switch_numbers.static_friction[s] * pressed - sqrt(a * a + b * b)
    if not slides(S, W, s):
        return NOT_WATCHED
    u = sensed[RATE, S.switches.measured[s]]
    v = sensed[RATE, S.switches.measured[other]]
    way, side = sensed[VALUE, way_of(S, W, s)], sensed[VALUE, way_of(S, W, other)]
    speed, size = sqrt(u * u + v * v), sqrt(way * way + side * side)
    turned = (way * u + side * v) / size - TURNED * speed
    if size * size > FRESH:
        pace = own_speed(S)
        return min(turned + BACK * pace, OVER * FIRST * pace - speed)
    return turned
