"""Gear pair: two wheels that mesh on a common carrier."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from ..errors import ModelError
from ..math.vec import inner_product
from ..model.element import Flag, Numbers, Unit, element
from ..model.joint import Coupling, sense, shared_body

if TYPE_CHECKING:
    from ..model.model import Model


@element
class GearPair(Coupling):
    """Two gears that mesh; each turns in a joint on the same carrier, which may itself move (planetary trains).

    With numbers of teeth z and angles seen from the carrier about axes that point the same way: z_1 angle_1 + z_2
    angle_2 = constant for external gears, z_1 angle_1 - z_2 angle_2 = constant where the second is a ring with its
    teeth inside. Full turns are counted. It acts along the two angles only: tooth forces do not load the bearings;
    ``run["name.effort_1"]`` and ``run["name.effort_2"]`` are the torques on the gears.

    Parameters
    ----------
    name : str
    joint_1, joint_2 : str
        The joints (with a coordinate ``angle``) in which the two gears turn on their carrier.
    teeth : two numbers
        Numbers of teeth, or radii: only their ratio counts.
    internal : bool
        Whether the second gear is a ring with its teeth inside.
    """

    joint_1: str = field(kw_only=False)
    joint_2: str = field(kw_only=False)
    teeth: Annotated[Numbers, Unit(None)]
    internal: Flag = False

    symbol: ClassVar[str] = "gear"
    hints: ClassVar[dict[str, str]] = {
        "backlash": "gears with play are a Backlash in its place: Backlash('mesh', ('A.angle', 'B.angle'), "
        "weights=(z1, z2), gap='0.2 deg')"
    }
    dimensions: ClassVar = {"teeth": ("1", "m")}

    def coupled(self) -> tuple[str, ...]:
        """Return the two angles."""
        return f"{self.joint_1}.angle", f"{self.joint_2}.angle"

    def factors(self, n: SimpleNamespace, model: Model, axes: Callable[[str], Any]) -> tuple[float, ...]:
        """1 and the ratio, with the signs for external or internal teeth, the axes' senses and the carrier's side."""
        carrier = self._carrier(model)
        s1, s2 = (sense(model, self, j, carrier) for j in (self.joint_1, self.joint_2))
        same = -1.0 if inner_product(axes(self.joint_1), axes(self.joint_2)).real < -1e-9 else 1.0
        return 1.0, (-1.0 if self.internal else 1.0) * same * s1 * s2 * n.teeth[1] / n.teeth[0]

    def _carrier(self, model: Model) -> str:
        remedy = "both gears must turn on one carrier: put a Revolute between each gear and the arm that carries them"
        return shared_body(self, model, self.joint_1, self.joint_2, remedy)

    def reversed_factors(self, signs: tuple[float, ...]) -> dict[str, Any]:
        """Return no factors: both gears must be reversed."""
        return {} if signs[0] == signs[1] else super().reversed_factors(signs)

    def check(self, n: SimpleNamespace) -> None:
        """Require two positive numbers of teeth."""
        if len(n.teeth) != 2 or not all(z.real > 0.0 for z in n.teeth):
            raise ModelError(f"{self.title}: teeth are two numbers greater than 0, got {n.teeth}")

    def examine(self, model: Model) -> None:
        """Require joints that share a carrier."""
        for name in (self.joint_1, self.joint_2):
            model.joint(name, self, "angle")
        self._carrier(model)
