"""Wheels and balls that roll on a plane without slip: non-holonomic."""

from __future__ import annotations

from types import SimpleNamespace
from typing import ClassVar

import numpy as np

from ..constraints.blocks import ON_PLANE, Row, no_slip
from ..errors import ModelError
from ..math.vec import inner_product
from ..model.element import Direction, Length, element, nonnegative, positive
from ..model.geometry import triad, vector
from ..model.joint import Joint, WorldFrame

FLAT = 1e-6  # a disk whose axle is this close to the plane's normal counts as lying flat


@element
class RollingDisk(Joint):
    """``body_j`` is a wheel that touches a plane fixed in ``body_i`` and rolls on it without slip.

    The plane passes through the contact point in the reference configuration: ``radius + tread`` below the centre of an
    upright wheel. Two of its three rows constrain velocities only (non-holonomic). The constraint can pull as well as
    push; if it pulls, ``health.warnings`` of a motion reports it.

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Body that carries the plane (``"ground"`` is the world), and the wheel.
    at : point [m]
        Centre of the wheel, in world coordinates of the drawn configuration.
    axis : direction
        The wheel's axle, in world coordinates.
    radius : number [m]
        From the centre to the middle of the tread.
    tread : number [m]
        Radius of the tread's cross-section: 0 for a sharp disk. The wheel touches at ``radius + tread`` when upright.
    normal : direction
        Normal of the plane, on the side of the wheel, in world coordinates.
    """

    radius: Length
    tread: Length = 0.0
    normal: Direction = (0.0, 0.0, 1.0)

    blocks: ClassVar = (ON_PLANE, no_slip("x"), no_slip("y"))
    planar_normal: ClassVar[str] = ""
    needs_axis: ClassVar[bool] = True
    symbol: ClassVar[str] = "rolling"
    one_sided: ClassVar[bool] = True

    def check(self, n: SimpleNamespace) -> None:
        """Require valid radii."""
        positive(self, n, "radius", why="For a ball use RollingBall")
        nonnegative(self, n, "tread")

    def world_frames(self, n: SimpleNamespace, planar: bool) -> tuple[WorldFrame, WorldFrame]:
        """Return F at the contact point, z along the plane's normal; M in the wheel's centre, z along its axle."""
        centre = vector(n.at, planar, f"'at' of {self.title}")
        up = vector(n.normal, planar, f"normal of {self.title}", direction=True)
        M = self.orientation(n.axis, planar)
        c = inner_product(up, M[:, 2])
        s = np.sqrt((1.0 - c) * (1.0 + c))
        if not s.real > FLAT:
            raise ModelError(
                f"{self.title}: its axle is square to the plane: the wheel lies flat and cannot roll; turn its axis"
            )
        contact = centre - n.radius / s * (up - c * M[:, 2]) - n.tread * up
        return (contact, triad(up)), (centre, M)

    def constants(self, n: SimpleNamespace, row: Row, F: WorldFrame, M: WorldFrame) -> tuple[float, ...]:
        """Return the radii."""
        return (*row.par[:3], n.radius, n.tread, row.par[5], 0.0)


@element
class RollingBall(Joint):
    """``body_j`` is a ball that touches a plane fixed in ``body_i`` and rolls on it without slip; it may spin.

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Body that carries the plane (``"ground"`` is the world), and the ball.
    at : point [m]
        Centre of the ball, in world coordinates of the drawn configuration.
    radius : number [m]
    normal : direction
        Normal of the plane, on the side of the ball, in world coordinates.
    """

    radius: Length
    normal: Direction = (0.0, 0.0, 1.0)

    blocks: ClassVar = (ON_PLANE, no_slip("x"), no_slip("y"))
    planar_normal: ClassVar[str] = ""
    axisless: ClassVar[bool] = True
    symbol: ClassVar[str] = "rolling"
    one_sided: ClassVar[bool] = True

    def check(self, n: SimpleNamespace) -> None:
        """Require a radius."""
        positive(self, n, "radius")

    def world_frames(self, n: SimpleNamespace, planar: bool) -> tuple[WorldFrame, WorldFrame]:
        """Return F at the contact point, z along the plane's normal; M in the ball's centre."""
        centre = vector(n.at, planar, f"'at' of {self.title}")
        up = vector(n.normal, planar, f"normal of {self.title}", direction=True)
        return (centre - n.radius * up, triad(up)), (centre, np.eye(3))

    def constants(self, n: SimpleNamespace, row: Row, F: WorldFrame, M: WorldFrame) -> tuple[float, ...]:
        """Return the radii of a wheel of radius 0 whose tread is the ball."""
        return (*row.par[:3], 0.0, n.radius, row.par[5], 0.0)
