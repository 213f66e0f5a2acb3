"""Planar joint: one plane on another."""

from __future__ import annotations

from typing import ClassVar

from ..constraints.blocks import ANGLE, IN_PLANE, PARALLEL_AXES, shift
from ..model.element import Angle, element
from ..model.joint import Coordinate, Joint, Primitive


@element
class Planar(Joint):
    """``body_j`` slides and turns on a plane fixed in ``body_i``.

    Its coordinates are ``x`` and ``y`` along the plane, from the drawn position, and ``angle`` about the normal.

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Bodies, or frames fixed on bodies (z is then the normal); ``"ground"`` is the world.
    at : point [m]
        A point of the plane, in world coordinates of the drawn configuration.
    axis : direction
        Normal of the plane in world coordinates.
    angle : number [rad]
        Value of the coordinate ``angle`` in the drawn configuration.
    """

    angle: Angle = 0.0

    blocks: ClassVar = (IN_PLANE, *PARALLEL_AXES)
    coordinates: ClassVar = {
        "angle": Coordinate(ANGLE, offset="angle"),
        "x": Coordinate(shift("x")),
        "y": Coordinate(shift("y")),
    }
    chain: ClassVar = (Primitive("P", "x", "x"), Primitive("P", "y", "y"), Primitive("R", "z", "angle"))
    needs_axis: ClassVar[bool] = True
    planar_normal: ClassVar[str] = ""
    symbol: ClassVar[str] = "planar"
    one_surface: ClassVar[bool] = True
    replaceable: ClassVar[bool] = True
