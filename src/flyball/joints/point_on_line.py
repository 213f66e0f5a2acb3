"""A point on a straight line: a pin in a slot, a ball in a groove."""

from __future__ import annotations

from typing import ClassVar

from ..constraints.blocks import ANGLE, SLIDE, STRAIGHT_LINE
from ..model.element import Angle, Length, element
from ..model.joint import Z_TO_X, Coordinate, Joint, Primitive


@element
class PointOnLine(Joint):
    """A point of ``body_j`` stays on a line fixed in ``body_i``; every rotation is free (Hahn's BB3).

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Bodies, or frames fixed on bodies (z of the first is then the line); ``"ground"`` is the world.
    at : point [m]
        The point, in world coordinates of the drawn configuration.
    axis : direction
        The line, in world coordinates.
    displacement : number [m]
        Value of the coordinate ``displacement`` in the drawn configuration.
    """

    displacement: Length = 0.0

    blocks: ClassVar = STRAIGHT_LINE
    coordinates: ClassVar = {"displacement": Coordinate(SLIDE, offset="displacement")}
    chain: ClassVar = (Primitive("P", coordinate="displacement"), Primitive("S", coordinate="angle"))
    needs_axis: ClassVar[bool] = True
    planar_normal: ClassVar[str] = "y"
    symbol: ClassVar[str] = "point_on_line"
    replaceable: ClassVar[bool] = True
    stand_in: ClassVar[float] = 2.1
    called: ClassVar[str] = "a ball in a groove (PointOnLine)"


@element
class PinInSlot(PointOnLine):
    """A pin of ``body_j`` in a straight slot of ``body_i``: the planar `PointOnLine`, with the angle of the pin.

    It is equivalent to a massless block between a slide and a hinge. It takes the arguments of `PointOnLine`, and:

    Parameters
    ----------
    angle : number [rad]
        Value of the coordinate ``angle``, of ``body_j`` relative to ``body_i``, in the drawn configuration.
    """

    angle: Angle = 0.0

    coordinates: ClassVar = PointOnLine.coordinates | {
        "angle": Coordinate(ANGLE, turn_F=Z_TO_X, turn_M=Z_TO_X, offset="angle")
    }
    spatial: ClassVar[bool] = False
    in_space: ClassVar[str] = "PointOnLine"
    stand_in: ClassVar[float] = 1.1
    called: ClassVar[str] = "a pin in a slot (PinInSlot)"
