"""The contract of a switch: what the event machinery asks of each kind, and the rows of an instant's problem.

`Instant` names what a kind may use of the instant that is resolved (`simulation.events.instant_problem`).

Event functions (guards) are numbers whose zero crossing ends a mode:

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

from collections.abc import Collection
from dataclasses import dataclass
from math import nan
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np

from ...compiler.formulas import formula
from ...compiler.kernels import Signature
from ...math.scalar import magnitude
from ...numerics.complementarity.dense_problem import NO_IMPULSE, SLIDING

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


NO_ROW, ANY_FORCE, ONE_SIDED, INTERVAL, DISC = range(5)
"""Forces that a row can carry. NO_ROW: it has no row. ANY_FORCE: any. ONE_SIDED: in its direction only. INTERVAL: up
to a limit, either way. DISC: with a second row, a vector up to a limit that is proportional to the force of another row
(a contact point with friction).
"""
NO_WORDS = ("", "")
SLOW_ACCELERATION = 1e-9  # negligible acceleration, relative to length (or a radian) times the squared rate


class ProblemRow(NamedTuple):
    """A row of the complementarity problem of an instant; rules are those of `numerics.complementarity`."""

    switch: int
    rule: int
    sign: float = 1.0
    way: float = 0.0  # direction (or STATIC) of the friction law; 0: the limit is const + gain on row ``of``
    rate: float = 0.0
    direction: float = 0.0
    const: float = 0.0
    gain: float = 0.0
    of: int = -1
    state: int = NO_IMPULSE

    def sliding(self, direction: float) -> ProblemRow:
        """Return the row of friction as it slides; a limit that is not a law's holds at rest only."""
        return self._replace(rule=SLIDING, way=direction if self.way != 0.0 else 0.0, direction=direction, const=0.0)


class Instant(Protocol):
    """The instant of a motion at which jumps and modes are resolved; arrays have one entry for each switch."""

    S: Any  # the tables
    W: Any  # the workspace: modes and bounds in ``W.modes``
    x: np.ndarray  # values of the quantities
    rate: np.ndarray
    near: np.ndarray  # tolerances of values
    still: np.ndarray  # tolerances of rates
    unit: np.ndarray  # reference lengths
    characteristic_rate: float
    mode: np.ndarray  # before the instant
    hold: np.ndarray
    way: np.ndarray
    engaging: Collection[int]  # drivers that engage at this instant

    def ways(self) -> np.ndarray:
        """Return the directions of all switches, writable in place."""
        ...

    def acceleration(self, s: int) -> float:
        """Return the second derivative of a quantity with the present modes."""
        ...

    def is_loaded(self, s: int) -> bool:
        """Return whether the force of switch s depends on a load."""
        ...


@dataclass(frozen=True, eq=False)
class SwitchKind:
    """A kind of switch; this base class describes one that never acts.

    Attributes
    ----------
    guards : tuple of int
        Its event functions.
    forces : int
        What its row can carry: NO_ROW, ANY_FORCE, ONE_SIDED, INTERVAL or DISC.
    bounded : bool
        Whether its quantity is compared with a lower and an upper bound.
    elastic : bool
        Whether it is a force beyond its bounds, without a row.
    commanded : bool
        Whether only events change its mode.
    kinetic : bool
        Whether the element continues to act as a force while it slides.
    permanent : bool
        Whether it stays open once it has opened.
    numbers : tuple of str
        Fields of `SwitchNumbers` that `Element.switched` gives, in order.
    role : str
        What it does, for messages: ``"is closed"``.
    closing, opening : (str, str)
        Kind of the event and its description where it becomes active, and where it ends; empty: not recorded.
    states : (str, str)
        Words for active and inactive, for tables; empty: not listed.
    misplaced : str
        Description of an active row that is not at one of its bounds; empty: that of the violated bound.
    """

    guards: tuple[int, ...] = ()
    forces: int = NO_ROW
    bounded: bool = False
    elastic: bool = False
    commanded: bool = False
    kinetic: bool = False
    permanent: bool = False
    numbers: tuple[str, ...] = ("lower", "upper", "restitution", "stiffness", "damping")
    role: str = ""
    closing: tuple[str, str] = NO_WORDS
    opening: tuple[str, str] = NO_WORDS
    states: tuple[str, str] = NO_WORDS
    misplaced: str = ""
    transitions: ClassVar[set[str]] = set()  # kinds of events of all switches

    def __post_init__(self) -> None:
        """Register its kinds of events."""
        self.transitions.update(kind for kind, _ in (self.closing, self.opening) if kind)

    @property
    def decided(self) -> bool:
        """Return whether the problem of an instant decides whether its row is active."""
        return self.forces != NO_ROW

    @property
    def keeps_bounds(self) -> bool:
        """Return whether a row keeps the quantity between its bounds."""
        return self.bounded and self.forces == ONE_SIDED

    def initial_numbers(self, named: dict[str, Any]) -> dict[str, Any]:
        """Return the fields of `SwitchNumbers` from those that the element gives."""
        return named

    def velocity_rows(self, n: Instant, s: int, at: tuple[float, ...], still: bool) -> list[ProblemRow]:
        """Return the rows along which impulses may act.

        ``at``: the bounds that the quantity is at, +1 the lower and -1 the upper one; ``still``: whether its rate is
        zero.
        """
        return []

    def acceleration_rows(self, n: Instant, s: int, at: tuple[float, ...], still: bool) -> list[ProblemRow]:
        """Return the rows along which forces may act; of sliding ones only those that depend on a load."""
        return []

    def direction(self, n: Instant, s: int, still: bool, in_problem: bool) -> float:
        """Return the direction of an inactive switch."""
        return 0.0

    def prepare(self, n: Instant, s: int, still: bool) -> None:
        """Update bounds before jumps and modes are resolved."""

    def finish(self, n: Instant, s: int, hit: Collection[int]) -> None:
        """Update bounds once the modes are decided; ``hit``: switches with an impact."""

    def start_violation(self, n: Instant, s: int) -> float:
        """Return by how much its rule is violated where a motion starts: its quantity is beyond a monitored bound."""
        below = n.W.modes.lower[s] - n.x[s] if G_LOWER in self.guards else 0.0
        above = n.x[s] - n.W.modes.upper[s] if G_UPPER in self.guards else 0.0
        return float(max(below, above))

    def penetration(self, n: Instant, s: int) -> float:
        """Return by how much its quantity is beyond a bound."""
        return 0.0

    def distance_from_bounds(self, modes: Any, numbers: Any, s: int, x: float) -> float:
        """Return by how much the quantity x, or the value at which it is held, is where the row cannot hold it."""
        return 0.0

    def follow_bound(self, modes: Any, ways: np.ndarray, s: int, x: float, near: float) -> None:
        """Update an active row whose bound has moved; it opens if the quantity is on the free side."""

    def excess(self, x: np.ndarray, rate: np.ndarray, bounds: tuple[float, float]) -> np.ndarray | None:
        """Return by how much a motion violates the rule; None: the rule does not depend on the motion alone."""
        return None

    def push_direction(self, x: float, bounds: tuple[float, float], near: float) -> float | None:
        """Return the direction in which it can push at rest, 0 if both; None if it is inactive."""
        return None


NOT_IN_USE = SwitchKind()
"""A switch that an event has released."""
