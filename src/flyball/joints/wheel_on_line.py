"""A wheel that rolls along a straight line, in the plane."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import ClassVar

from ..constraints.blocks import ANGLE, SLIDE, STRAIGHT_LINE, Row
from ..errors import ModelError
from ..math.vec import inner_product, matrix_product
from ..model.element import Angle, Length, Point, element
from ..model.geometry import vector
from ..model.joint import Z_TO_X, Coordinate, Joint, WorldFrame


@element
class WheelOnLine(Joint):
    """``body_j`` is a wheel that rolls, without slip, along a straight line fixed in ``body_i``: a pinion on a rack.

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Body that carries the line (``"ground"`` is the world), and the wheel.
    at : point [m]
        Contact point of the wheel and the line, in world coordinates of the drawn configuration.
    axis : direction
        The line, in world coordinates.
    centre : point [m]
        Centre of the wheel, perpendicular to the line from ``at``; its distance is the rolling radius.
    angle, displacement : number [rad], [m]
        Values of the coordinates in the drawn configuration: the rotation of the wheel relative to ``body_i``, and the
        displacement of its centre along the line.
    """

    centre: Point
    angle: Angle = 0.0
    displacement: Length = 0.0

    blocks: ClassVar = (STRAIGHT_LINE[0], replace(SLIDE, plus=("angle",)))
    coordinates: ClassVar = {
        "angle": Coordinate(ANGLE, turn_F=Z_TO_X, turn_M=Z_TO_X, offset="angle"),
        "displacement": Coordinate(SLIDE, offset="displacement"),
    }
    needs_axis: ClassVar[bool] = True
    planar_normal: ClassVar[str] = "y"
    spatial: ClassVar[bool] = False
    in_space: ClassVar[str] = "RollingDisk, or a RackAndPinion between two joints"
    symbol: ClassVar[str] = "rolling"
    one_sided: ClassVar[bool] = True

    def world_frames(self, n: SimpleNamespace, planar: bool) -> tuple[WorldFrame, WorldFrame]:
        """Return F at the contact point on the line, M in the wheel's centre."""
        R = self.orientation(n.axis, planar)
        at = vector(n.at, planar, f"'at' of {self.title}")
        centre = vector(n.centre, planar, f"centre of {self.title}")
        d = matrix_product(R.T, centre - at)
        if not abs(d[0].real) > 0.0:
            raise ModelError(f"{self.title}: its centre lies on the line; the wheel has no radius")
        if abs(d[2].real) > 1e-9 * abs(d[0].real):
            raise ModelError(
                f"{self.title}: the vector from 'at' to the centre must be perpendicular to the line; the centre is "
                f"{d[2].real:g} m further along it"
            )
        return (at, R), (centre, R)

    def constants(self, n: SimpleNamespace, row: Row, F: WorldFrame, M: WorldFrame) -> tuple[float, ...]:
        """Return the height of the centre above the line, which is constant."""
        return (*row.par[:6], 0.0 if row.plus else _height(F, M))

    def pushing_sign(self, n: SimpleNamespace, F: WorldFrame, M: WorldFrame) -> float | None:
        """Return the sign of a force towards the centre of the wheel."""
        return 1.0 if _height(F, M).real > 0.0 else -1.0

    def weight(self, n: SimpleNamespace, coordinate: str, F: WorldFrame, M: WorldFrame) -> float:
        """Return the weight of: displacement + height * angle = 0, with the height counted to the left of the line."""
        return _height(F, M)


def _height(F: WorldFrame, M: WorldFrame) -> float:
    return inner_product(F[1][:, 0], M[0] - F[0])
