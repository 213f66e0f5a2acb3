"""A box."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

from ..element import Point, element
from .geometry import ConvexPart, extrude, polygon_outline
from .solid import RESOLUTION, Solid, three_lengths


@element
class Box(Solid):
    """A box about its origin with ``edges`` = (x, y, z) [m].

    Parameters
    ----------
    edges : three numbers [m]
        Edge lengths along x, y, z.
    """

    edges: Point

    symmetric: ClassVar[str] = "xyz"

    def check(self, n: SimpleNamespace) -> None:
        """Three edges greater than zero."""
        three_lengths(self, "edges", n.edges)
        super().check(n)

    def volume(self, n: SimpleNamespace) -> Any:
        """V = x y z."""
        x, y, z = n.edges
        return x * y * z

    def gyration(self, n: SimpleNamespace) -> Any:
        """(y^2 + z^2) / 12 and so on."""
        x, y, z = n.edges
        return (y * y + z * z) / 12, (x * x + z * z) / 12, (x * x + y * y) / 12

    def forms(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """Itself."""
        half = np.array(n.edges) / 2
        return (ConvexPart("BOX", tuple(half.tolist()), np.sqrt(half @ half)),)

    def outlines(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """The outline of its corners: a rectangle, if it is not tilted out of the plane."""
        return (polygon_outline(self.mesh(n)[0]),)

    def size(self, n: SimpleNamespace) -> tuple[float, ...]:
        """The edges."""
        return tuple(n.edges)

    def surface(self, n: SimpleNamespace, fine: int = RESOLUTION) -> tuple[np.ndarray, np.ndarray]:
        """Twelve triangles."""
        x, y, z = n.edges
        return extrude(np.array([(-x, -y), (x, -y), (x, y), (-x, y)]) / 2, z)
