"""What every one-sided element declares: a quantity that is free on one side, and held or pushed on the other."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, ClassVar

from ..errors import ModelError
from .element import Element, nonnegative, positive
from .force import CoordinateForce

if TYPE_CHECKING:
    from .model import Model

DIRECTIONS = (1.0, -1.0)


@dataclass(frozen=True)
class Unilateral(CoordinateForce):
    """A stop, a play, a latch: along a coordinate, or along a weighted sum of some.

    A rigid one is a row that holds at times (`switches`), an elastic one a force with a corner. Of either a result
    tells ``value`` and ``rate`` of the quantity, the ``force`` along it (positive where it pushes the value up), and
    ``closed``: 1 where it holds or pushes at its lower side, -1 at its upper, 0 where it is open.
    """

    category: ClassVar[str] = "limits"
    outputs: ClassVar[dict[str, str]] = {"value": "", "rate": "/s", "force": "effort", "closed": "1"}

    def acts(self) -> bool:
        """Whether it is a force: an elastic one."""
        return getattr(self, "stiffness", None) is not None

    def check_sides(self, n: SimpleNamespace, unit: str) -> None:
        """Refuse sides that leave no room; ``unit`` is that of its quantity."""

    def conservative(self) -> bool:
        """Whether its energy is all that it ever takes or gives."""
        return getattr(self, "damping", 0.0) == 0.0


@dataclass(frozen=True)
class Latch(Unilateral):
    """What may move one way: a coordinate, or the difference of two."""

    coordinate: str

    def along(self) -> tuple[str, ...]:
        """The coordinate, and that which it is relative to."""
        other = getattr(self, "relative_to", None)
        return (self.coordinate,) if other is None else (self.coordinate, other)

    def switch_weights(self, n: SimpleNamespace, label: str) -> tuple[float, ...]:
        """Such that the quantity may grow."""
        way = float(n.direction.real)
        return (way, -way)[: len(self.along())]

    def outward(self, n: SimpleNamespace) -> float:
        """As the user's coordinate goes."""
        return float(n.direction.real)

    def examine(self, model: Model) -> None:
        """Its coordinates are there, and of one kind."""
        for text in self.along():
            model.coordinate(text, self)
        if len(self.along()) == 2:
            check_same_kind(self, model, *self.along())


def check_elastic(e: Element, n: SimpleNamespace, rigid: str = "a rigid one, which gives no way") -> None:
    """Refuse a stiffness that is none, and what goes with the other kind of stop only."""
    positive(e, n, "stiffness", why=f"Leave it out for {rigid}")
    nonnegative(e, n, "damping")
    if n.stiffness is None and n.damping != 0.0:
        raise ModelError(
            f"{e.title}: damping is {n.damping:g}, and a rigid one has none; give stiffness= too, or neither"
        )
    if n.stiffness is not None and n.restitution is not None:
        raise ModelError(
            f"{e.title}: restitution belongs to a rigid one and stiffness to an elastic one, which bounces off by "
            f"itself; leave one out"
        )


def check_direction(e: Element, value: Any) -> None:
    """Refuse a direction that is none."""
    if value not in DIRECTIONS:
        raise ModelError(f"{e.title}: direction is {value!r}; it must be 1 (the value may grow) or -1 (it may fall)")


def check_same_kind(e: Any, model: Model, first: str, second: str) -> None:
    """Refuse two coordinates of which one is an angle and the other a length, or that are the same."""
    if first == second:
        raise ModelError(f"{e.title}: {first!r} relative to itself never moves; name another, or leave it out")
    units = [model.unit(text, e) for text in (first, second)]
    if units[0] != units[1]:
        raise ModelError(f"{e.title}: {first!r} is in {units[0]} and {second!r} in {units[1]}; name two of one kind")
