"""Backlash: the play of gears, couplings and joints."""

from __future__ import annotations

from dataclasses import field
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from ..constraints.switches.elastic_stop import ELASTIC
from ..constraints.switches.stop import STOP
from ..errors import ModelError
from ..model.contact import check_restitution
from ..model.element import Number, Numbers, Ratio, Unit, element, positive
from ..model.force import Switch, Unilateral, check_elastic
from ..model.joint import WEIGHT_UNITS, check_weights
from .limit import KIND, effort, energy, stop_parameters, stop_switch_numbers

if TYPE_CHECKING:
    from ..model.model import Model


@element
class Backlash(Unilateral):
    """Coordinates in a linear relation with play: gears that mesh loosely, a dog clutch, a worn key, a slack fork.

    A `Coupler` keeps weight_1 q_1 + weight_2 q_2 + ... constant; here the sum moves freely within the ``gap``, and is
    stopped at either end of it: rigidly, with a restitution, or elastically. It replaces the coupling. For gears on
    parallel axes of equal direction the weights are the radii (or numbers of teeth), both positive for external gears,
    the second negative for an internal gear.

    Parameters
    ----------
    name : str
    coordinates : list of str
        One or more: ``"A.angle"``, ``"slide.displacement"``, ``"block.x"``.
    weights : list of numbers
        One for each coordinate. Not given: 1 for the first and -1 for the second of two.
    gap : number [rad] or [m]
        Travel of the first coordinate from one end of the play to the other while the others rest.
    middle : number [rad] or [m]
        Sum q_1 + (weight_2 / weight_1) q_2 + ... in the middle of the play; that of the reference configuration if not
        given.
    restitution : number [1]
        Of a rigid stop, from 0 (no rebound; the default) to 1 (no energy lost).
    stiffness : number [N/m] or [N m/rad]
        Stiffness of the flanks at the first coordinate; makes the stop elastic.
    damping : number [N s/m] or [N m s/rad]
        Of elastic flanks.

    Notes
    -----
    A result contains ``value``: q_1 + (weight_2 / weight_1) q_2 + ... from the middle of the play, its ``rate``,
    the ``force`` along it (on the first coordinate), and ``closed``: 1 at the lower end, -1 at the upper, 0 between.
    """

    coordinates: tuple[str, ...] = field(kw_only=False)
    weights: Annotated[Numbers | None, Unit(None)] = None
    gap: Annotated[Number, Unit(None)]
    middle: Annotated[Number | None, Unit(None)] = None
    restitution: Ratio | None = None
    stiffness: Annotated[Number | None, Unit(None)] = None
    damping: Annotated[Number, Unit(None)] = 0.0

    kind: ClassVar[int] = KIND
    kinds: ClassVar[dict[str, tuple[str, ...]]] = {"weights": WEIGHT_UNITS}
    effort: ClassVar = staticmethod(effort)
    energy: ClassVar = staticmethod(energy)
    dimensions: ClassVar = Unilateral.dimensions | {"gap": ("m", "rad"), "middle": ("m", "rad")}

    def along(self) -> tuple[str, ...]:
        """Return the coordinates."""
        return self.coordinates

    def switch_weights(self, n: SimpleNamespace, label: str) -> tuple[float, ...]:
        """Return the weights relative to the first."""
        given = self._weights(n)
        return tuple(w / given[0] for w in given)

    def _weights(self, n: SimpleNamespace) -> tuple[float, ...]:
        """Return the weights as given, or those of a difference."""
        return (1.0, -1.0)[: len(self.coordinates)] if n.weights is None else n.weights

    def total(self, n: SimpleNamespace) -> Any:
        """Return the sum in the middle of the play; None: that of the reference configuration."""
        return n.middle

    def first_weight(self, n: SimpleNamespace) -> float:
        """Return 1: weights are relative to the first."""
        return 1.0

    def examine(self, model: Model) -> None:
        """Require that its coordinates exist."""
        for text in self.coordinates:
            model.coordinate(text, self)

    def reversed_factors(self, signs: tuple[float, ...]) -> dict[str, Any]:
        """Return the factors of the weights, and of the sum's value in the middle, which is relative to the first."""
        first = (1.0, -1.0)[: len(signs)] if self.weights is None else (1.0,) * len(signs)
        return {"weights": tuple(a * b for a, b in zip(first, signs, strict=True)), "middle": signs[0]}

    def check(self, n: SimpleNamespace) -> None:
        """Require a gap, and a nonzero weight for each of different coordinates."""
        positive(self, n, "gap", why="Without any play it is a Coupler or a GearPair")
        check_restitution(self, n)
        check_elastic(self, n)
        if not self.coordinates:
            raise ModelError(f"{self.title}: it names no coordinates; give one or more")
        if n.weights is None and len(self.coordinates) > 2:
            raise ModelError(f"{self.title}: {len(self.coordinates)} coordinates need weights; give weights=")
        check_weights(self, self.coordinates, self._weights(n))

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Return the parameters of the formulas."""
        return stop_parameters(n, -0.5 * n.gap, 0.5 * n.gap)

    def switches(self) -> tuple[Switch, ...]:
        """One switch along the sum, which is measured from the middle of the play and thus a quantity of its own."""
        kind = ELASTIC if self.acts() else STOP
        return (Switch(kind, along=self.coordinates, slides=self.acts(), weighted=True),)

    def switched(self, n: SimpleNamespace, label: str, separation: float) -> tuple[float, ...]:
        """Return the bounds: half the gap on either side."""
        return stop_switch_numbers(n, -0.5 * n.gap, 0.5 * n.gap)
