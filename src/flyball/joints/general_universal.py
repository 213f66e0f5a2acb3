"""General universal joint: a massless link with a hinge at either end, axes skew and offset."""

from __future__ import annotations

from types import SimpleNamespace
from typing import ClassVar

import numpy as np

from ..constraints import skew_lines
from ..constraints.blocks import ANGLE, SKEW_LINES, Row
from ..errors import ModelError
from ..math.rotation import reciprocal_rows
from ..math.vec import dot, inner_product
from ..model.element import Angle, Directions, PointPair, element
from ..model.geometry import triad, vector
from ..model.joint import Z_TO_X, Coordinate, Joint, WorldFrame

PARALLEL = 1e-3  # axes closer to parallel than this [rad] do not make a universal joint


@element
class GeneralUniversal(Joint):
    """A massless rigid link hinged to both bodies, its two axes skew and offset (Hahn, appendix A.4).

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Bodies, or frames fixed on bodies (z is then each body's axis); ``"ground"`` is the world.
    at : two points [m]
        A point of the axis fixed in ``body_i`` and one of the axis fixed in ``body_j``, in world coordinates of the
        drawn configuration.
    axes : two directions
        The two axes, in world coordinates.
    angle_1, angle_2 : number [rad]
        Values of the coordinates in the drawn configuration: of the link about the first axis, and of ``body_j``
        about the second.
    """

    at: PointPair | None = None  # type: ignore[assignment]
    axes: Directions | None = None
    angle_1: Angle = 0.0
    angle_2: Angle = 0.0

    blocks: ClassVar = SKEW_LINES
    coordinates: ClassVar = {
        "angle_1": Coordinate(ANGLE, "FM", turn_M=Z_TO_X, offset="angle_1"),
        "angle_2": Coordinate(ANGLE, "MF", turn_F=Z_TO_X, sign=-1.0, offset="angle_2"),
    }
    planar_normal: ClassVar[str] = ""
    axisless: ClassVar[bool] = True
    axial: ClassVar[bool] = True
    symbol: ClassVar[str] = "universal"

    def world_frames(self, n: SimpleNamespace, planar: bool) -> tuple[WorldFrame, WorldFrame]:
        """The frames at their points: z along the axis, x in the plane of both axes, so that angles start at zero."""
        if n.axes is None:
            raise ModelError(f"{self.title}: give its two axes, for instance axes=((1, 0, 0), (0, 1, 0))")
        p, r = (vector(x, planar, f"'at' of {self.title}") for x in n.at)
        a, b = (vector(x, planar, f"axes of {self.title}", direction=True) for x in n.axes)
        return (p, _with_x(a, b)), (r, _with_x(b, a))

    def constants(self, n: SimpleNamespace, row: Row, F: WorldFrame, M: WorldFrame) -> tuple[float, ...]:
        """Return the angle between the axes, and the vector between them along f, m and f x m, as drawn."""
        f, m = F[1][:, 2], M[1][:, 2]
        across = np.cross(f, m)
        if not np.sqrt((across * across).sum()).real > PARALLEL:
            raise ModelError(
                f"{self.title}: its axes are parallel; a link with parallel hinges is a Planar joint and a Distance"
            )
        if row.kind != skew_lines.KIND:
            return (*row.par[:6], inner_product(f, m))
        way = M[0] - F[0]
        return (*row.par[:3], *(dot(way, r) for r in reciprocal_rows((f, m, across))), 0.0)


def _with_x(z: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return axes with the given z, and x towards ``other``."""
    x = other - inner_product(other, z) * z
    size = np.sqrt((x * x).sum())
    if not size.real > PARALLEL:
        return triad(z)
    x = x / size
    return np.column_stack([x, np.cross(z, x), z])
