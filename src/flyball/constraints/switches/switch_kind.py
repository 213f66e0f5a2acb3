"""The contract of a switch: what the event machinery asks of each kind, and the rows of an instant's problem.

`Instant` names what a kind may use of the instant that is resolved (`simulation.events.instant_problem`).
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np

from ...numerics.complementarity.dense_problem import NO_IMPULSE, SLIDING
from .guard_kinds import G_LOWER, G_UPPER

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
        Its event functions (`guard_kinds`).
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
