"""A ball."""

from __future__ import annotations

from math import pi
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

from ..element import Length, element, positive
from .geometry import ConvexPart, arc, circle_outline, lathe, snapped_to_axis
from .solid import RESOLUTION, Solid


@element
class Sphere(Solid):
    """A ball of the given ``radius`` [m] about its origin.

    Parameters
    ----------
    radius : number [m]
    """

    radius: Length

    symmetric: ClassVar[str] = "xyz"

    def check(self, n: SimpleNamespace) -> None:
        """A radius greater than zero."""
        positive(self, n, "radius")
        super().check(n)

    def volume(self, n: SimpleNamespace) -> Any:
        """V = 4/3 pi r^3."""
        return 4 / 3 * pi * n.radius**3

    def gyration(self, n: SimpleNamespace) -> Any:
        """2/5 r^2."""
        k = 0.4 * n.radius**2
        return k, k, k

    def forms(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """Itself."""
        return (ConvexPart("SPHERE", (n.radius,), n.radius),)

    def outlines(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """A circle."""
        return (circle_outline(n.radius, self.pose(n)[0]),)

    def size(self, n: SimpleNamespace) -> tuple[float, ...]:
        """The radius."""
        return (n.radius,)

    def surface(self, n: SimpleNamespace, fine: int = RESOLUTION) -> tuple[np.ndarray, np.ndarray]:
        """Meridians and parallels."""
        return lathe(snapped_to_axis(arc((0, 0), n.radius, -pi / 2, pi / 2, fine // 2)), fine)
