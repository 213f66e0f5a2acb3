"""A ring of round section."""

from __future__ import annotations

from math import pi
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

from ..element import Length, element, positive
from .geometry import arc, lathe
from .solid import RESOLUTION, Solid, smaller


@element
class Torus(Solid):
    """A ring about its z axis: ``radius`` of the circle through the middle of its section, ``tube_radius`` [m].

    Parameters
    ----------
    radius : number [m]
        Of the circle through the middle of the section.
    tube_radius : number [m]
        Of the section.
    """

    radius: Length
    tube_radius: Length

    symmetric: ClassVar[str] = "xyz"

    def check(self, n: SimpleNamespace) -> None:
        """Radii greater than zero, and a hole in the middle."""
        positive(self, n, "radius", "tube_radius")
        smaller(self, "tube_radius", n.tube_radius, "radius", n.radius)
        super().check(n)

    def volume(self, n: SimpleNamespace) -> Any:
        """V = 2 pi^2 R r^2, after Pappus."""
        return 2 * pi**2 * n.radius * n.tube_radius**2

    def gyration(self, n: SimpleNamespace) -> Any:
        """R^2 / 2 + 5/8 r^2 across, R^2 + 3/4 r^2 about the axis."""
        k = n.radius**2 / 2 + 5 / 8 * n.tube_radius**2
        return k, k, n.radius**2 + 3 / 4 * n.tube_radius**2

    def size(self, n: SimpleNamespace) -> tuple[float, ...]:
        """Radius of the ring and of its section."""
        return n.radius, n.tube_radius

    def surface(self, n: SimpleNamespace, fine: int = RESOLUTION) -> tuple[np.ndarray, np.ndarray]:
        """The section, turned about the axis."""
        steps = max(fine // 2, 3)
        return lathe(arc((n.radius, 0), n.tube_radius, 0.0, 2 * pi, steps)[:-1], fine, ring=True)
