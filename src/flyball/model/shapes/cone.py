"""A cone."""

from __future__ import annotations

from math import pi
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

from ..element import Length, element, positive
from .geometry import ConvexPart, lathe, revolved_outline
from .solid import RESOLUTION, Solid


@element
class Cone(Solid):
    """A cone of base ``radius`` and ``height`` [m]: the middle of its base at its origin, its tip at +z.

    Parameters
    ----------
    radius : number [m]
        Of the base.
    height : number [m]
    """

    radius: Length
    height: Length

    symmetric: ClassVar[str] = "xy"

    def check(self, n: SimpleNamespace) -> None:
        """Radius and height greater than zero."""
        positive(self, n, "radius", "height")
        super().check(n)

    def volume(self, n: SimpleNamespace) -> Any:
        """V = pi r^2 h / 3."""
        return pi * n.radius**2 * n.height / 3

    def gyration(self, n: SimpleNamespace) -> Any:
        """3/20 r^2 + 3/80 h^2 across, 3/10 r^2 along."""
        k = 0.15 * n.radius**2 + 0.0375 * n.height**2
        return k, k, 0.3 * n.radius**2

    def centre(self, n: SimpleNamespace) -> Any:
        """A quarter of the height above the base."""
        return 0.0, 0.0, n.height / 4

    def forms(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """Itself."""
        return (ConvexPart("CONE", (n.radius, n.height), np.maximum(n.radius, n.height)),)

    def outlines(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """A circle, or a triangle from the side."""
        return (revolved_outline(self, *self.pose(n), n.radius, [(n.radius, 0.0), (0.0, n.height)]),)

    def size(self, n: SimpleNamespace) -> tuple[float, ...]:
        """Radius and height."""
        return n.radius, n.height

    def surface(self, n: SimpleNamespace, fine: int = RESOLUTION) -> tuple[np.ndarray, np.ndarray]:
        """Base and mantle."""
        return lathe(np.array([(0, 0), (n.radius, 0), (0, n.height)]), fine)
