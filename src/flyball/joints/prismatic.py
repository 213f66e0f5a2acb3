"""Prismatic joint: one translation along a common axis."""

from __future__ import annotations

from typing import ClassVar

from ..constraints.blocks import SAME_AXES, SLIDE, STRAIGHT_LINE
from ..model.element import Length, element
from ..model.joint import Coordinate, Joint, Primitive


@element
class Prismatic(Joint):
    """A slide: ``body_j`` moves along an axis fixed in ``body_i`` and does not turn relative to it.

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Bodies, or frames fixed on bodies (z is then the axis); ``"ground"`` is the world.
    at : point [m]
        A point of the axis, in world coordinates of the drawn configuration.
    axis : direction
        Axis in world coordinates.
    displacement : number [m]
        Value of the coordinate ``displacement`` in the drawn configuration.
    """

    displacement: Length = 0.0

    blocks: ClassVar = STRAIGHT_LINE + SAME_AXES
    coordinates: ClassVar = {"displacement": Coordinate(SLIDE, offset="displacement")}
    chain: ClassVar = (Primitive("P", coordinate="displacement"),)
    needs_axis: ClassVar[bool] = True
    planar_normal: ClassVar[str] = "y"
    symbol: ClassVar[str] = "prismatic"
    replaceable: ClassVar[bool] = True
