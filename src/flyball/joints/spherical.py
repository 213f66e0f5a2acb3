"""Spherical joint: three rotations about a common point."""

from __future__ import annotations

from typing import ClassVar

from ..constraints.blocks import COMMON_POINT, DEFLECTION, rotation_along
from ..model.element import element
from ..model.joint import ORIENTATION_ANGLES, Coordinate, Joint, Primitive

HALF_TURN = "at half a turn, where the rotation vector changes its sign"


@element
class Spherical(Joint):
    """A ball joint: a common point of two bodies.

    Coordinates describe the rotation of its frame M on ``body_j`` relative to its frame F on ``body_i``. With ``at``
    the axes of both are those of the world in the drawn configuration, so that all coordinates are zero there.

    - ``roll``, ``pitch``, ``yaw``: R_FM = R_z(yaw) R_y(pitch) R_x(roll). Roll and yaw include whole turns; at a pitch
      of 90 deg they are undefined.
    - ``rotation_x``, ``rotation_y``, ``rotation_z``: rotation vector (axis times angle) along F's axes, or M's. It is
      at most half a turn, where it is undefined.
    - ``deflection``: angle between the z axes of F and M, from 0 to 180 deg; ``Limit("cone", "ball.deflection",
      upper="30 deg")`` is a conical stop.

    The effort along a coordinate is conjugate to its rate. Efforts along roll, pitch, yaw together are the components
    of their total torque along M's x axis, the axis of pitch (square to F's z and M's x), and F's z axis.

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Bodies, or frames fixed on bodies; ``"ground"`` is the world.
    at : point [m]
        Common point, in world coordinates of the drawn configuration.
    """

    blocks: ClassVar = COMMON_POINT
    coordinates: ClassVar = {
        **ORIENTATION_ANGLES,
        **{f"rotation_{a}": Coordinate(rotation_along(a), singular=HALF_TURN) for a in "xyz"},
        "deflection": Coordinate(DEFLECTION, singular="where the z axes are parallel"),
    }
    chain: ClassVar = (Primitive("S"),)
    planar_normal: ClassVar[str] = ""
    symbol: ClassVar[str] = "spherical"
    replaceable: ClassVar[bool] = True
    stand_in: ClassVar[float] = 1.0

    def locked(self, planar: bool) -> list[str]:
        """Return the components of the rotation vector: defined at all orientations but half a turn."""
        return [f"rotation_{a}" for a in "xyz"]
