"""Screw joint: rotation and translation along an axis are coupled."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, ClassVar

from ..constraints.blocks import ANGLE, PARALLEL_AXES, SLIDE, STRAIGHT_LINE
from ..errors import ModelError
from ..model.element import Angle, Length, element
from ..model.joint import Coordinate, Joint, Primitive, WorldFrame

TURN = 6.283185307179586


@element
class Screw(Joint):
    """A thread: ``body_j`` moves along the axis by the lead for each turn about it, counted over any number of turns.

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Bodies, or frames fixed on bodies (z is then the axis); ``"ground"`` is the world.
    at : point [m]
        A point of the axis, in world coordinates of the drawn configuration.
    axis : direction
        Axis in world coordinates.
    lead : number [m]
        Displacement along the axis per turn; negative for a left-handed thread.
    angle, displacement : number [rad], [m]
        Values of the coordinates in the drawn configuration.
    """

    lead: Length
    angle: Angle = 0.0
    displacement: Length = 0.0

    blocks: ClassVar = (*STRAIGHT_LINE, *PARALLEL_AXES, replace(SLIDE, plus=("angle",)))
    coordinates: ClassVar = {
        "angle": Coordinate(ANGLE, offset="angle"),
        "displacement": Coordinate(SLIDE, offset="displacement"),
    }
    chain: ClassVar = (Primitive("P", coordinate="displacement"), Primitive("R", coordinate="angle"))
    remaining_rows: ClassVar = blocks[-1:]
    needs_axis: ClassVar[bool] = True
    planar_normal: ClassVar[str] = ""
    symbol: ClassVar[str] = "screw"
    thread: ClassVar[bool] = True
    replaceable: ClassVar[bool] = True

    def reversed_factors(self, signs: tuple[float, ...]) -> dict[str, Any]:
        """Return the factors of the drawn values, and of the lead, which relates the coordinates."""
        return super().reversed_factors(signs) | {"lead": signs[0] * signs[1]}

    def check(self, n: SimpleNamespace) -> None:
        """Require a lead other than zero."""
        if n.lead == 0.0:
            raise ModelError(f"{self.title}: its lead is 0 m; without one it is a Revolute joint")

    def weight(self, n: SimpleNamespace, coordinate: str, F: WorldFrame, M: WorldFrame) -> float:
        """Return the weight of: displacement - lead / (2 pi) angle = 0."""
        return -n.lead / TURN
