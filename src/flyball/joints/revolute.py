"""Revolute joint: one rotation about a common axis."""

from __future__ import annotations

from typing import ClassVar

from ..constraints.blocks import ANGLE, COMMON_POINT, PARALLEL_AXES
from ..model.element import Angle, element
from ..model.joint import Coordinate, Joint, Primitive


@element
class Revolute(Joint):
    """A hinge: ``body_j`` turns relative to ``body_i`` about an axis through a common point.

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Bodies, or frames fixed on bodies (z is then the axis); ``"ground"`` is the world.
    at : point [m]
        Common point, in world coordinates of the drawn configuration.
    axis : direction
        Axis in world coordinates; in a planar mechanism it is the normal and left out.
    angle : number [rad]
        Value of the coordinate ``angle`` in the drawn configuration.
    """

    angle: Angle = 0.0

    blocks: ClassVar = COMMON_POINT + PARALLEL_AXES
    coordinates: ClassVar = {"angle": Coordinate(ANGLE, offset="angle")}
    chain: ClassVar = (Primitive("R", coordinate="angle"),)
    needs_axis: ClassVar[bool] = True
    axial: ClassVar[bool] = True
    symbol: ClassVar[str] = "revolute"
    replaceable: ClassVar[bool] = True
    stand_in: ClassVar[float] = 1.0
