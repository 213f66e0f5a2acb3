"""Fixed joint: no relative motion."""

from __future__ import annotations

from typing import Any, ClassVar

from ..constraints.blocks import COMMON_POINT, SAME_AXES
from ..model.element import element
from ..model.joint import Joint


@element
class Fixed(Joint):
    """Two bodies held together as if welded.

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Bodies, or frames fixed on bodies; ``"ground"`` is the world.
    at : point [m]
        Point about which its reaction torque is counted, in world coordinates of the drawn configuration.
    """

    blocks: ClassVar = COMMON_POINT + SAME_AXES
    chain: ClassVar = ()
    drawn: ClassVar[str] = "fixed"
    replaceable: ClassVar[bool] = True
    omission: ClassVar[float] = 1.5


def weld_to_ground(name: str, body: str, at: Any) -> Fixed:
    """A joint that holds a body where it is drawn."""
    return Fixed(name, "ground", body, at=at)
