"""Constant distance: a massless link with a ball (in the plane a pin) at either end."""

from __future__ import annotations

from types import SimpleNamespace
from typing import ClassVar

import numpy as np

from ..constraints.blocks import CONSTANT_DISTANCE, Row
from ..errors import ModelError
from ..model.element import Length, PointPair, element, positive
from ..model.geometry import vector
from ..model.joint import Joint, WorldFrame


@element
class Distance(Joint):
    """A massless rigid link that keeps a point of ``body_i`` and a point of ``body_j`` at a constant distance.

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Bodies, or frames fixed on bodies; ``"ground"`` is the world.
    at : pair of points [m]
        The two ends, in world coordinates of the drawn configuration.
    length : number [m]
        Length of the link; the drawn distance if not given.
    """

    at: PointPair | None = None  # type: ignore[assignment]
    length: Length | None = None

    blocks: ClassVar = CONSTANT_DISTANCE
    axisless: ClassVar[bool] = True
    symbol: ClassVar[str] = "link"

    def check(self, n: SimpleNamespace) -> None:
        """The length must be greater than zero."""
        positive(self, n, "length", why="To join two points use Revolute or Spherical")

    def world_frames(self, n: SimpleNamespace, planar: bool) -> tuple[WorldFrame, WorldFrame]:
        """Return frames with origins at the two ends; the axes do not matter."""
        a, b = (vector(p, planar, f"'at' of {self.title}") for p in n.at)
        return (a, np.eye(3)), (b, np.eye(3))

    def constants(self, n: SimpleNamespace, row: Row, F: WorldFrame, M: WorldFrame) -> tuple[float, ...]:
        """Return the length: as given, or the distance in the reference configuration."""
        d = M[0] - F[0]
        length = np.sqrt((d * d).sum()) if n.length is None else n.length
        if not length.real > 0.0:
            raise ModelError(f"{self.title}: its two points coincide; use Revolute or Spherical, or give a length")
        return (*row.par[:6], length)
