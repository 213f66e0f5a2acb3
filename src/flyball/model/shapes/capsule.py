"""A cylinder with round ends."""

from __future__ import annotations

from math import pi
from types import SimpleNamespace
from typing import Any

import numpy as np

from ..element import element
from .cylinder import Cylinder
from .geometry import ConvexPart, arc, lathe, polygon_outline, snapped_to_axis
from .solid import RESOLUTION


@element
class Capsule(Cylinder):
    """A cylinder of ``radius`` and ``length`` [m] along its z axis with a half ball on either end.

    Parameters
    ----------
    radius : number [m]
        Of the cylinder and of the half balls.
    length : number [m]
        Of the cylinder, without the half balls.
    """

    def volume(self, n: SimpleNamespace) -> Any:
        """V = pi r^2 l + 4/3 pi r^3."""
        return pi * n.radius**2 * (n.length + 4 / 3 * n.radius)

    def gyration(self, n: SimpleNamespace) -> Any:
        """Cylinder and two half balls, each moved by the parallel axis theorem."""
        r, length = n.radius, n.length
        rod, balls = length / (length + 4 / 3 * r), 4 / 3 * r / (length + 4 / 3 * r)
        across = rod * (3 * r**2 + length**2) / 12 + balls * (0.4 * r**2 + length**2 / 4 + 3 / 8 * length * r)
        return across, across, rod * r**2 / 2 + balls * 0.4 * r**2

    def forms(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """Itself."""
        return (ConvexPart("CAPSULE", (n.radius, n.length / 2), n.radius + n.length / 2),)

    def outlines(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """Return a segment thickened by the radius."""
        p, R = self.pose(n)
        return (polygon_outline(np.array([p - R[:, 2] * n.length / 2, p + R[:, 2] * n.length / 2]), n.radius),)

    def surface(self, n: SimpleNamespace, fine: int = RESOLUTION) -> tuple[np.ndarray, np.ndarray]:
        """Two domes and the side between them."""
        r, h, quarter = n.radius, n.length / 2, max(fine // 4, 1)
        domes = arc((0, -h), r, -pi / 2, 0.0, quarter), arc((0, h), r, 0.0, pi / 2, quarter)
        return lathe(snapped_to_axis(np.vstack(domes)), fine)
