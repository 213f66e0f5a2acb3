"""Rack and pinion: a toothed bar that a gear drives, or that drives a gear."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, ClassVar

from ..errors import ModelError
from ..model.element import Length, element
from ..model.joint import Coupling

if TYPE_CHECKING:
    from ..model.model import Model


@element
class RackAndPinion(Coupling):
    """A rack that moves by the radius times the angle of the pinion; full turns are counted.

    It acts along the two coordinates only: tooth forces load neither the pinion's bearing nor the rack's guide.
    ``run["name.effort_1"]`` is the force along the rack, ``run["name.effort_2"]`` the torque on the pinion.

    Parameters
    ----------
    name : str
    rack : str
        Joint with a coordinate ``displacement`` in which the rack slides.
    pinion : str
        Joint with a coordinate ``angle`` in which the pinion turns.
    radius : number [m]
        Rolling radius: displacement of the rack per radian of the pinion's coordinate; negative where a positive
        angle moves the rack backwards.
    """

    rack: str = field(kw_only=False)
    pinion: str = field(kw_only=False)
    radius: Length

    symbol: ClassVar[str] = "rack"

    def coupled(self) -> tuple[str, ...]:
        """Return the displacement and the angle."""
        return f"{self.rack}.displacement", f"{self.pinion}.angle"

    def factors(self, n: SimpleNamespace, model: Model, axes: Callable[[str], Any]) -> tuple[float, ...]:
        """Return the factors of: displacement - radius * angle = constant."""
        return 1.0, -n.radius

    def reversed_factors(self, signs: tuple[float, ...]) -> dict[str, Any]:
        """Return the factor of the radius."""
        return {"radius": signs[0] * signs[1]}

    def check(self, n: SimpleNamespace) -> None:
        """Require a radius."""
        if n.radius == 0.0:
            raise ModelError(f"{self.title}: its radius is 0 m; give the rolling radius of the pinion")
