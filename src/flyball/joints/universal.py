"""Universal joint: two rotations about crossing axes at right angles."""

from __future__ import annotations

from types import SimpleNamespace
from typing import ClassVar

import numpy as np

from ..constraints.blocks import ANGLE, COMMON_POINT, CROSSED_AXES
from ..errors import ModelError
from ..math.vec import inner_product
from ..model.element import Angle, Directions, element
from ..model.geometry import vector
from ..model.joint import Z_TO_X, Coordinate, Joint, Primitive, WorldFrame


@element
class Universal(Joint):
    """A Hooke (Cardan) joint: a cross whose one axis is fixed in ``body_i`` and whose other is fixed in ``body_j``.

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Bodies, or frames fixed on bodies (z is then each body's axis); ``"ground"`` is the world.
    at : point [m]
        Centre of the cross, in world coordinates of the drawn configuration.
    axes : two directions
        The axis fixed in ``body_i`` and the axis fixed in ``body_j``, at right angles, in world coordinates.
    angle_1, angle_2 : number [rad]
        Values of the coordinates in the drawn configuration: of the cross about the first axis, and of ``body_j``
        about the second.
    """

    axes: Directions | None = None
    angle_1: Angle = 0.0
    angle_2: Angle = 0.0

    blocks: ClassVar = COMMON_POINT + CROSSED_AXES
    coordinates: ClassVar = {
        "angle_1": Coordinate(ANGLE, "FM", turn_M=Z_TO_X, offset="angle_1"),
        "angle_2": Coordinate(ANGLE, "MF", turn_F=Z_TO_X, sign=-1.0, offset="angle_2"),
    }
    chain: ClassVar = (Primitive("R", "z", "angle_1"), Primitive("R", "x", "angle_2"))
    rest: ClassVar = ((0.0, 0.0, 1.0), (0.0, -1.0, 0.0), (1.0, 0.0, 0.0))
    planar_normal: ClassVar[str] = ""
    axisless: ClassVar[bool] = True
    axial: ClassVar[bool] = True
    symbol: ClassVar[str] = "universal"
    replaceable: ClassVar[bool] = True
    stand_in: ClassVar[float] = 1.0

    def world_frames(self, n: SimpleNamespace, planar: bool) -> tuple[WorldFrame, WorldFrame]:
        """Return F with the first axis as z and the second as x, and M with the two exchanged."""
        if n.axes is None:
            raise ModelError(f"{self.title}: give its two axes, for instance axes=((1, 0, 0), (0, 1, 0))")
        p = vector(n.at, planar, f"'at' of {self.title}")
        a, b = (vector(x, planar, f"axes of {self.title}", direction=True) for x in n.axes)
        cosine = inner_product(a, b)
        if abs(cosine) > 1e-6:
            degrees = np.degrees(np.arccos(np.clip(cosine.real, -1, 1)))
            raise ModelError(f"{self.title}: its axes must be at right angles, these are at {degrees:.4g} deg")
        b = b - cosine * a
        b = b / np.sqrt(inner_product(b, b))
        F = np.column_stack([b, np.cross(a, b), a])
        M = np.column_stack([a, np.cross(b, a), b])
        return (p, F), (p, M)
