"""A point in a plane: a ball between two plates."""

from __future__ import annotations

from typing import ClassVar

from ..constraints.blocks import IN_PLANE, shift
from ..model.element import element
from ..model.joint import Coordinate, Joint, Primitive


@element
class PointInPlane(Joint):
    """A point of ``body_j`` stays in a plane fixed in ``body_i``.

    Its coordinates are ``x`` and ``y`` along the plane, from the drawn position.

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Bodies, or frames fixed on bodies (z of the first is then the normal); ``"ground"`` is the world.
    at : point [m]
        The point, in world coordinates of the drawn configuration.
    axis : direction
        Normal of the plane, in world coordinates.
    """

    blocks: ClassVar = (IN_PLANE,)
    coordinates: ClassVar = {"x": Coordinate(shift("x")), "y": Coordinate(shift("y"))}
    chain: ClassVar = (Primitive("P", "x", "x"), Primitive("P", "y", "y"), Primitive("S"))
    needs_axis: ClassVar[bool] = True
    planar_normal: ClassVar[str] = ""
    symbol: ClassVar[str] = "point_in_plane"
    one_surface: ClassVar[bool] = True
    stand_in: ClassVar[float] = 2.2
