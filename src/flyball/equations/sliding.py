"""Places of contact: whether they stick or slide, which way, and the friction of those that slide.

A place is a STOP, its gap, and a SLIP along each of its tangents (`model/touch.py`). What sticks is held by rows; what
slides is pushed by -mu N d, N being the multiplier of the gap and d the direction of sliding.
"""

from __future__ import annotations

from ..compiler.jit import formula
from ..math.scalar import sqrt
from ..tables.system import (
    FORCE_F,
    FORCE_LOAD,
    FORCE_M,
    FORCE_SWITCH,
    FORCE_WORK,
    G_ASTRAY,
    G_CONE,
    LENGTH,
    LOAD,
    MODE,
    OFF,
    RATE,
    SWITCH_MEASURED,
    SWITCH_OTHER,
    SWITCH_PARTNER,
    SWITCH_REST,
    SWITCH_ROW,
    SWITCH_SLIDING,
    VALUE,
)
from .rows import way_of

SLOW = 1e-10  # lengths of the mechanism a second: slower sliding in space goes the way of its switch
TURNED = 0.5  # cosine of the angle by which a direction of sliding turns before its way is told anew
NOT_WATCHED = float("nan")


@formula
def slides(S, W, s):
    """Whether the place of contact whose first slip is switch s is closed and does not stick."""
    return W.switch[MODE, s].real == OFF and W.switch[MODE, S.switch_i[s, SWITCH_OTHER]].real != OFF


@formula
def heading(S, W, sensed, s):
    """Direction of sliding along the tangents of slip s and of its partner, and the speed.

    In the plane it is the way of the switch. In space it is that of the velocity, reversed where it is more against the
    way than with it: what comes to rest would slide on smoothly, until the event is found.
    """
    way = sensed[VALUE, way_of(S, W, s)]
    u = sensed[RATE, S.switch_i[s, SWITCH_MEASURED]]
    other = S.switch_i[s, SWITCH_PARTNER]
    if other < 0:
        return way, 0.0 * way, u * way
    side = sensed[VALUE, way_of(S, W, other)]
    v = sensed[RATE, S.switch_i[other, SWITCH_MEASURED]]
    square = u * u + v * v
    slow = SLOW * S.glob[LENGTH]
    if square.real <= slow.real * slow.real:
        return way, side, u * way + v * side
    speed = sqrt(square) if (u * way + v * side).real >= 0.0 else -sqrt(square)
    return u / speed, v / speed, speed


@formula
def slide(S, W, k, work, f):
    """Add the friction -mu N d of a place of contact that slides along d; N is its load, the multiplier of its gap."""
    s = S.force_i[k, FORCE_SWITCH]
    work[S.force_i[k, FORCE_WORK]] = 0.0
    if not slides(S, W, s):
        return
    d, e, speed = heading(S, W, W.sensed, s)
    pressed, mu = W.sensed[LOAD, S.force_i[k, FORCE_LOAD]], S.switch_x[s, SWITCH_SLIDING]
    if pressed.real < 0.0 and mu.real > 1.0:  # past where it opens, to the end of the step: it must not run away
        mu = 1.0 + 0.0 * mu
    push = -mu * pressed
    for side in range(2):
        m = S.force_i[k, FORCE_F] if side == 0 else S.force_i[k, FORCE_M]
        if m < 0:
            continue
        r = S.row_i.shape[0] + m
        for j in range(S.row_p[r], S.row_p[r + 1]):
            f[S.col_i[j]] += push * (d if side == 0 else e) * W.G[j]
    work[S.force_i[k, FORCE_WORK]] = push * speed


@formula
def watched_place(S, W, sensed, lam, kind, s):
    """Value of a guard of a place: friction that its stick has left; whether it slides its way; whether it is there."""
    if kind == G_ASTRAY:
        held = W.switch[MODE, S.switch_i[s, SWITCH_OTHER]] != OFF
        return sensed[VALUE, S.switch_i[s, SWITCH_MEASURED]] if held else NOT_WATCHED
    other = S.switch_i[s, SWITCH_PARTNER]
    if kind == G_CONE:
        if W.switch[MODE, s] == OFF:
            return NOT_WATCHED
        pressed = lam[S.switch_i[S.switch_i[s, SWITCH_OTHER], SWITCH_ROW]]
        a = lam[S.switch_i[s, SWITCH_ROW]]
        b = lam[S.switch_i[other, SWITCH_ROW]] if other >= 0 else 0.0
        return S.switch_x[s, SWITCH_REST] * pressed - sqrt(a * a + b * b)
    if not slides(S, W, s):
        return NOT_WATCHED
    u = sensed[RATE, S.switch_i[s, SWITCH_MEASURED]]
    if other < 0:
        return sensed[VALUE, way_of(S, W, s)] * u
    v = sensed[RATE, S.switch_i[other, SWITCH_MEASURED]]
    along = sensed[VALUE, way_of(S, W, s)] * u + sensed[VALUE, way_of(S, W, other)] * v
    return along - TURNED * sqrt(u * u + v * v)
