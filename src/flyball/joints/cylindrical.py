"""Cylindrical joint: a rotation about, and a translation along, a common axis."""

from __future__ import annotations

from typing import ClassVar

from ..constraints.blocks import ANGLE, PARALLEL_AXES, SLIDE, STRAIGHT_LINE
from ..model.element import Angle, Length, element
from ..model.joint import Coordinate, Joint, Primitive


@element
class Cylindrical(Joint):
    """``body_j`` turns about and slides along an axis fixed in ``body_i``.

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Bodies, or frames fixed on bodies (z is then the axis); ``"ground"`` is the world.
    at : point [m]
        A point of the axis, in world coordinates of the drawn configuration.
    axis : direction
        Axis in world coordinates.
    angle, displacement : number [rad], [m]
        Values of the coordinates ``angle`` and ``displacement`` in the drawn configuration.
    """

    angle: Angle = 0.0
    displacement: Length = 0.0

    blocks: ClassVar = STRAIGHT_LINE + PARALLEL_AXES
    coordinates: ClassVar = {
        "angle": Coordinate(ANGLE, offset="angle"),
        "displacement": Coordinate(SLIDE, offset="displacement"),
    }
    chain: ClassVar = (Primitive("P", coordinate="displacement"), Primitive("R", coordinate="angle"))
    needs_axis: ClassVar[bool] = True
    planar_normal: ClassVar[str] = ""
    symbol: ClassVar[str] = "cylindrical"
    one_surface: ClassVar[bool] = True
    replaceable: ClassVar[bool] = True
    stand_in: ClassVar[float] = 1.0
