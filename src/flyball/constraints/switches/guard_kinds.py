"""Event functions (guards) of switches: numbers whose zero crossing ends a mode.

    an open stop                   x - lower, upper - x
    a closed stop, a latch         direction * lam: positive while it pushes
    sticking friction              static limit - |lam|
    sliding friction               direction * rate
    an overrunning freewheel       rate
    an open elastic stop           -d, the distance, or past it -(d + c ddot / k) where that is more
    a closed elastic stop          its force, k d + c ddot

Those of contact points, of corners of laws, of groups of rows and of a user's expressions are in `engine.guards`.
``GUARDS`` lists the formulas ``guard(mode, way, x, rate, force, numbers, units)``: mode and direction of the switch,
its quantity and rate, the multiplier of its row, (lower, upper, stiffness, damping, largest force), and the reference
length and rate of the quantity. A guard without meaning in the present mode is nan. A kind of a user's own has a static
method of this form, ``guard``, which is called by its address.
"""

from __future__ import annotations

from math import nan

from ...compiler.formulas import formula
from ...compiler.kernels import Signature
from ...math.scalar import magnitude

G_LAW, G_LOWER, G_UPPER, G_PULL, G_HOLDS, G_SLIDES, G_BACK, G_CORNER, G_PRESS_LOWER, G_PRESS_UPPER = range(10)
G_REVERSES, G_OWN, G_CONE, G_TURNS, G_EDGE, G_SHARED = range(10, 16)
DISTANCE_GUARDS = (G_LOWER, G_UPPER)
"""Distances of open stops and contacts."""
RATE_GUARDS = (G_SLIDES, G_REVERSES, G_BACK, G_TURNS)
"""Rates of sliding and overrunning switches."""
FORCE_GUARDS = (G_PULL, G_HOLDS, G_CONE)
"""Margins of the forces that active rows carry."""
PRESS_GUARDS = (G_PRESS_LOWER, G_PRESS_UPPER)
"""Distances or forces of elastic stops."""

POSITION_ROUNDING = 2e-15  # relative to the mechanism's length, or a radian: a smaller distance counts as zero
RESTING_RATE = 1e-9  # times the characteristic rate of a quantity: a slower approach counts as none
CREEP_RATE = 1e-13  # times the characteristic rate of a quantity: a smaller rate counts as zero
GRAZING_DEPTH = 1e-12  # depth at which an undecided elastic stop counts as closed, in mechanism lengths or radians

OFF, HELD, STEADY = 0.0, 1.0, 2.0
"""Modes of a switch: inactive; active, its quantity kept at a value; of corners of laws: the motion follows the corner.
"""
FROZEN = 4.0
"""Direction value of an elastic switch that is open; one less: pressed at its upper side, one more: at its lower side.
A force formula that gets a value below `STATIC` plus one half determines its side itself.
"""
TURN = 1e-9
"""Rate, in lengths of the mechanism or rad at its own rate, at which a ratchet counts as reversed.

A ratchet at rest is so monitored for either direction in which it may start.
"""
STATIC = 2.0
"""Value in place of the sliding direction: effort formulas then return the largest value that can be held at rest."""
BY_RATE = 8.0
"""Value in place of the sliding direction: the sign of the rate is used, and zero effort at rest.

Used for friction on coordinates that a driver moves or that cannot move, which a row cannot hold.
"""


@formula
def significant_rate(rate, unit):
    """Rate, or 0 where it is only rounding, as of a quantity that does not move or is held by constraints."""
    return 0.0 if magnitude(rate) <= CREEP_RATE * unit else rate


@formula
def stop_distance(x, rate, units):
    """Distance from a stop, or 0 where it is only rounding, as at separation with zero speed."""
    return 0.0 if magnitude(x) <= POSITION_ROUNDING * units[0] and rate >= -RESTING_RATE * units[1] else x


@formula
def lower_distance(mode, way, x, rate, force, numbers, units):
    """Distance from the lower bound."""
    if mode != OFF:
        return nan
    return stop_distance(x - numbers[0], rate, units)


@formula
def upper_distance(mode, way, x, rate, force, numbers, units):
    """Distance from the upper bound."""
    if mode != OFF:
        return nan
    return stop_distance(numbers[1] - x, -rate, units)


@formula
def slip_rate(mode, way, x, rate, force, numbers, units):
    """Rate in the direction of sliding."""
    if mode != OFF or way == BY_RATE:
        return nan
    return way * significant_rate(rate, units[1])


@formula
def reversal_rate(mode, way, x, rate, force, numbers, units):
    """Rate in the free direction of a ratchet, less the rate at which it counts as reversed."""
    if mode != OFF:
        return nan
    return way * significant_rate(rate, units[1]) + TURN * units[1]


@formula
def overrunning_rate(mode, way, x, rate, force, numbers, units):
    """Rate in the free direction."""
    if mode != OFF:
        return nan
    return significant_rate(rate, units[1])


@formula
def pushing_force(mode, way, x, rate, force, numbers, units):
    """Force in the direction in which the row can push."""
    if mode == OFF:
        return nan
    return way * force


@formula
def holding_margin(mode, way, x, rate, force, numbers, units):
    """Largest force less the present one."""
    if mode == OFF:
        return nan
    return numbers[4] - magnitude(force)


@formula
def pressed_side(side, bound, way, x, rate, numbers, units):
    """Guard of one side of an elastic stop: the force on a closed side, the distance on an open side."""
    depth = side * (bound - x)
    push = numbers[2] * depth - numbers[3] * side * rate
    direction = way - FROZEN
    decided = direction > -1.5  # interpolated values are not exact; an undecided side is far below
    if decided and direction * side > 0.5:
        return push
    if decided and direction * side < -0.5:
        return nan
    if not decided:  # at the side, with nothing that determines where it goes
        return GRAZING_DEPTH * units[0] - depth
    # where it separates faster than the force decays it is open: continuous at separation, so that no other event there
    # is mistaken for a zero
    return max(-depth, -push / numbers[2])


@formula
def pressed_lower(mode, way, x, rate, force, numbers, units):
    """Guard of the lower side of an elastic stop."""
    return pressed_side(1.0, numbers[0], way, x, rate, numbers, units)


@formula
def pressed_upper(mode, way, x, rate, force, numbers, units):
    """Guard of the upper side of an elastic stop."""
    return pressed_side(-1.0, numbers[1], way, x, rate, numbers, units)


GUARDS = {
    G_LOWER: lower_distance, G_UPPER: upper_distance, G_PULL: pushing_force, G_HOLDS: holding_margin,
    G_SLIDES: slip_rate, G_REVERSES: reversal_rate, G_BACK: overrunning_rate, G_PRESS_LOWER: pressed_lower,
    G_PRESS_UPPER: pressed_upper,
}  # fmt: skip
SIGNATURES = (Signature("guard", "mode, way, x, rate, force, numbers, units", (0, 0, 0, 0, 0, 5, 2), 0, "a number"),)
"""The guard of a kind of a user's own."""
