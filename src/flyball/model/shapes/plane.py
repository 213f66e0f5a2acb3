"""A plane that bounds a half-space."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

from ...errors import ModelError
from ..element import Direction, Length, element, positive
from ..geometry import triad, vector
from .geometry import ConvexPart, extrude
from .solid import RESOLUTION, Surface, spatial_point


@element
class Plane(Surface):
    """An infinite plane through ``position``; the half-space behind it, opposite to its ``normal``, is solid.

    Parameters
    ----------
    normal : direction
        Outward normal, in the body's reference frame; z if not given. In a planar mechanism it must be given.
    extent : number [m]
        Edge length of the displayed patch; if not given, it follows from the size of the scene.
    """

    normal: Direction | None = None
    extent: Length | None = None

    symmetric: ClassVar[str] = "xy"

    def reflected(self, axis: str, orientation: Any) -> dict[str, Any]:
        """Return the orientation with z reversed, unless a normal is given."""
        return {} if self.normal is not None else super().reflected(axis, orientation)

    def check(self, n: SimpleNamespace) -> None:
        """A normal with a length, and an extent greater than zero."""
        positive(self, n, "extent")
        if n.normal is not None:
            if len(n.normal) not in (2, 3):
                raise ModelError(f"{self.title}: normal must have two or three components, got {n.normal}")
            self._normal(n)
        super().check(n)

    def _normal(self, n: SimpleNamespace) -> np.ndarray:
        return vector(
            spatial_point(n.normal, f"normal of {self.title}"), False, f"normal of {self.title}", direction=True
        )

    def pose(self, n: SimpleNamespace) -> tuple[np.ndarray, np.ndarray]:
        """Its frame, with z along the normal."""
        p, R = super().pose(n)
        return (p, R) if n.normal is None else (p, R @ triad(self._normal(n)))

    def forms(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """The half-space below z = 0."""
        return (ConvexPart("PLANE", (), np.inf),)

    def outlines(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """The half-plane behind its normal, which lies in the plane of the mechanism."""
        p, R = self.pose(n)
        x, y, z = R[:, 2].tolist()
        if not abs(z) < 1e-12:
            raise ModelError(
                f"{self.title}: its normal must lie in the plane of the mechanism, for instance normal=(0, 1); it is "
                f"({x:g}, {y:g}, {z:g})"
            )
        axes = np.array([[-y, 0.0, x], [x, 0.0, y], [0.0, 1.0, 0.0]])  # y is the normal of the mechanism's plane
        return (ConvexPart("PLANE", (), np.inf, np.array([p[0], p[1], 0.0]), axes),)

    def size(self, n: SimpleNamespace) -> tuple[float, ...]:
        """Return the edge length of the displayed patch; 1 m if not given."""
        return (1.0 if n.extent is None else n.extent,)

    def surface(self, n: SimpleNamespace, fine: int = RESOLUTION) -> tuple[np.ndarray, np.ndarray]:
        """A patch, as a thin slab below the plane."""
        a = self.size(n)[0]
        v, f = extrude(np.array([(-a, -a), (a, -a), (a, a), (-a, a)]) / 2, a / 200)
        return v - (0.0, 0.0, a / 400), f
