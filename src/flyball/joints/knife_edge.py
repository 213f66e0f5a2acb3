"""Knife edge: a skate, which glides along its edge but not sideways. Non-holonomic."""

from __future__ import annotations

from types import SimpleNamespace
from typing import ClassVar

import numpy as np

from ..constraints.blocks import no_sideways
from ..errors import ModelError
from ..model.element import Direction, element
from ..model.geometry import vector
from ..model.joint import Joint, WorldFrame


@element
class KnifeEdge(Joint):
    """A point of ``body_j`` has no velocity across an edge fixed in ``body_j``, as seen from ``body_i``.

    It constrains velocities only. In space it does not keep the point in a plane: add `PointInPlane` or `Planar`.

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Body that carries the ice (``"ground"`` is the world), and the skate.
    at : point [m]
        The point, in world coordinates of the drawn configuration.
    axis : direction
        Along the edge, in world coordinates.
    normal : direction
        In space: the upright direction of the skate; the blocked direction is perpendicular to both.
    """

    normal: Direction = (0.0, 0.0, 1.0)

    blocks: ClassVar = (no_sideways("x"),)
    needs_axis: ClassVar[bool] = True
    planar_normal: ClassVar[str] = "y"
    symbol: ClassVar[str] = "knife_edge"

    def world_frames(self, n: SimpleNamespace, planar: bool) -> tuple[WorldFrame, WorldFrame]:
        """Return both frames at the point; z along the edge, y up, x sideways."""
        p = vector(n.at, planar, f"'at' of {self.title}")
        if planar:
            R = self.orientation(n.axis, planar)
            return (p, R), (p, R)
        a = self.orientation(n.axis, planar)[:, 2]
        up = vector(n.normal, False, f"normal of {self.title}", direction=True)
        x = np.cross(up, a)
        size = np.sqrt((x * x).sum())
        if not size.real > 1e-6:
            raise ModelError(
                f"{self.title}: its normal is parallel to its edge; give the direction perpendicular to the plane on "
                "which it rolls"
            )
        R = np.column_stack([x / size, np.cross(a, x / size), a])
        return (p, R), (p, R)
