"""Translational joint: the prismatic joint of the plane."""

from __future__ import annotations

from typing import ClassVar

from ..model.element import element
from .prismatic import Prismatic


@element
class Translational(Prismatic):
    """A planar slide: ``body_j`` moves along an axis fixed in ``body_i`` and does not turn relative to it.

    It takes the arguments of `Prismatic`, with ``at`` and ``axis`` in the plane.
    """

    spatial: ClassVar[bool] = False
