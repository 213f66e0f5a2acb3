"""Orientation joint: no relative rotation, every relative translation (Hahn's translational joint)."""

from __future__ import annotations

from typing import ClassVar

from ..constraints.blocks import SAME_AXES, shift
from ..model.element import element
from ..model.joint import Coordinate, Joint, Primitive


@element
class Orientation(Joint):
    """``body_j`` does not turn relative to ``body_i``; their positions are free.

    Its coordinates ``x``, ``y``, ``z`` are the displacement of the joint's point on ``body_j`` along axes fixed in
    ``body_i``, from the drawn position.

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Bodies, or frames fixed on bodies; ``"ground"`` is the world.
    at : point [m]
        The point whose displacement is measured, in world coordinates of the drawn configuration.
    """

    blocks: ClassVar = SAME_AXES
    coordinates: ClassVar = {a: Coordinate(shift(a)) for a in "xyz"}
    chain: ClassVar = tuple(Primitive("P", a, a) for a in "xyz")
    symbol: ClassVar[str] = "orientation"
