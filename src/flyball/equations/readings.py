"""Forces that events name, into their columns of what is sensed, once accelerations and multipliers are known.

Behind the loads of joints; which columns there are, and what they are made of, is said in `tables.reads`.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.scalar import sqrt
from ..tables.system import VALUE
from .control import column_of
from .friction import loads_end
from .loads import effort_of
from .rows import on_second

FORCE, TORQUE = 6, 7  # columns of their sizes, after those of their components


@formula
def readings(S, W, t):
    """Fill in the columns, from the solution in W."""
    first = loads_end(S, W)
    if first == column_of(S, W, 0):
        return
    for m in range(first, column_of(S, W, 0)):
        W.sensed[VALUE, m] = 0.0 * t
    for x in range(S.load_terms.load.shape[0]):
        at, what = S.load_terms.load[x], S.load_terms.term[x]
        if at >= first:
            if what >= 0:
                through(S, W, at, what)
            else:
                W.sensed[VALUE, at] += along(S, W, t, -2 - what)
                W.sensed[VALUE, at + 1] = -W.sensed[VALUE, at]


@formula
def through(S, W, at, what):
    """Add what term ``what`` of a joint's rows does to the joint's wrench, on its second body, about M's origin."""
    force, torque = on_second(S, W, what)
    for i in range(3):
        W.sensed[VALUE, at + i] += force[i]
        W.sensed[VALUE, at + 3 + i] += torque[i]
    for i in range(2):
        a, b, d = W.sensed[VALUE, at + 3 * i], W.sensed[VALUE, at + 3 * i + 1], W.sensed[VALUE, at + 3 * i + 2]
        W.sensed[VALUE, at + (FORCE if i == 0 else TORQUE)] = sqrt(a * a + b * b + d * d)


@formula
def along(S, W, t, what):
    """What a row, a force along a quantity or a driver that prescribes does along its quantity."""
    nr, nk = S.rows.law.shape[0], S.forces.F.shape[0]
    if what < nr:
        return W.rows.multiplier[what]
    if what < nr + nk:
        return effort_of(S, W, t, what - nr)[0]
    return W.velocities.effort[what - nr - nk]
