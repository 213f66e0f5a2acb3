"""Coupler: a linear relation between coordinates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from ..errors import ModelError
from ..model.element import Number, Numbers, Unit, element
from ..model.joint import WEIGHT_UNITS, Coupling, check_weights

if TYPE_CHECKING:
    from ..model.model import Model

SUMS = ("1", "m", "rad")


@element
class Coupler(Coupling):
    """A linear relation between coordinates of joints or points: weight_1 q_1 + weight_2 q_2 + ... = constant.

    For a nonlinear relation use a `Constraint`.

    Parameters
    ----------
    name : str
    coordinates : list of str
        Two or more: ``"A.angle"``, ``"slide.displacement"``, ``"block.x"``.
    weights : list of numbers
        One for each coordinate; in metres for angles if lengths and angles are coupled.
    value : number
        Value of the sum; that of the drawn configuration if not given.
    """

    coordinates: tuple[str, ...] = field(kw_only=False)
    weights: Annotated[Numbers, Unit(None)]
    value: Annotated[Number | None, Unit(None)] = None

    dimensions: ClassVar = {"weights": WEIGHT_UNITS, "value": SUMS}

    def coupled(self) -> tuple[str, ...]:
        """Return the coordinates."""
        return self.coordinates

    def factors(self, n: SimpleNamespace, model: Model, axes: Callable[[str], Any]) -> tuple[float, ...]:
        """Return the weights as given."""
        return n.weights

    def first_weight(self, n: SimpleNamespace) -> float:
        """Return the first weight as given."""
        return n.weights[0]

    def total(self, n: SimpleNamespace) -> Any:
        """Return the value as given."""
        return n.value

    def reversed_factors(self, signs: tuple[float, ...]) -> dict[str, Any]:
        """Return the factors of the weights."""
        return {"weights": signs}

    def check(self, n: SimpleNamespace) -> None:
        """Require a nonzero weight for each of at least two different coordinates."""
        if len(self.coordinates) < 2:
            one = "1 coordinate" if self.coordinates else "no coordinates"
            raise ModelError(f"{self.title}: it couples {one}; give two or more")
        check_weights(self, self.coordinates, n.weights)
