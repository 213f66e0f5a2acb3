"""What every coupling declares: a linear relation between coordinates of joints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, ClassVar

from ..errors import ModelError
from .element import Element

if TYPE_CHECKING:
    from .model import Model


@dataclass(frozen=True)
class Coupling(Element):
    """One row of constraint: a sum of coordinates, each with its weight, stays what it is when drawn.

    Whole turns of angles count, so a gear train holds its phase over any number of turns.
    """

    category: ClassVar[str] = "couplings"
    omission: ClassVar[float] = 2.0  # what it costs to leave it out where rows are too many
    drawn: ClassVar[str] = "coupler"
    dimensions: ClassVar[dict[str, tuple[str, ...]]] = {}  # field -> units that its numbers may have

    def coupled(self) -> tuple[str, ...]:
        """The coordinates: ``"joint.coordinate"``, or ``"body.x"``."""
        raise NotImplementedError

    def factors(self, n: SimpleNamespace, model: Model, axes: Callable[[str], Any]) -> tuple[float, ...]:
        """A weight for each coordinate; ``axes(joint)`` is a joint's axis in the world as drawn."""
        raise NotImplementedError

    def first_weight(self, n: SimpleNamespace) -> float:
        """Weight of the first coordinate, as given."""
        return 1.0

    def total(self, n: SimpleNamespace) -> float | None:
        """What the weighted sum has to be; as drawn if None."""
        return None

    def examine(self, model: Model) -> None:
        """Refuse joints that it cannot couple."""


def shared_body(e: Coupling, model: Model, first: str, second: str, remedy: str) -> str:
    """The body that both joints are on.

    Raises
    ------
    ModelError
        If they share none, or both.
    """
    if first == second:
        raise ModelError(f"{e.title}: both its joints are {first!r}; name two")
    ends = [{model.carrier(x, e) for x in (j.body_i, j.body_j)} for j in (model[first], model[second])]
    common = ends[0] & ends[1]
    if len(common) != 1:
        listed = " and ".join(f"{j!r} ({' - '.join(sorted(x))})" for j, x in zip((first, second), ends, strict=True))
        raise ModelError(f"{e.title}: {listed} have {'no body' if not common else 'both bodies'} in common; {remedy}")
    return common.pop()


def sense(model: Model, e: Coupling, joint: str, carrier: str) -> float:
    """+1 if the joint's coordinate is that of the other body seen from the carrier, -1 if the reverse."""
    return -1.0 if model.carrier(model[joint].body_j, e) == carrier else 1.0
