"""Fixed joint: no relative motion."""

from __future__ import annotations

from typing import ClassVar

from ..constraints.blocks import COMMON_POINT, SAME_AXES
from ..model.element import element
from ..model.joint import Joint


@element
class Fixed(Joint):
    """A rigid connection of two bodies.

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Bodies, or frames fixed on bodies; ``"ground"`` is the world.
    at : point [m]
        Reference point of its reaction torque, in world coordinates of the drawn configuration.
    """

    blocks: ClassVar = COMMON_POINT + SAME_AXES
    chain: ClassVar = ()
    symbol: ClassVar[str] = "fixed"
    replaceable: ClassVar[bool] = True
    omission: ClassVar[float] = 1.5
