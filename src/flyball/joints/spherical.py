"""Spherical joint: three rotations about a common point."""

from __future__ import annotations

from typing import ClassVar

from ..constraints.blocks import COMMON_POINT
from ..model.element import element
from ..model.joint import Joint, Primitive


@element
class Spherical(Joint):
    """A ball joint: a common point of two bodies.

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Bodies, or frames fixed on bodies; ``"ground"`` is the world.
    at : point [m]
        Common point, in world coordinates of the drawn configuration.
    """

    blocks: ClassVar = COMMON_POINT
    chain: ClassVar = (Primitive("S"),)
    planar_normal: ClassVar[str] = ""
    symbol: ClassVar[str] = "spherical"
    replaceable: ClassVar[bool] = True
    stand_in: ClassVar[float] = 1.0
