"""A cylinder."""

from __future__ import annotations

from math import pi
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

from ..element import Length, element, positive
from .geometry import ConvexPart, lathe, revolved_outline
from .solid import RESOLUTION, Solid


@element
class Cylinder(Solid):
    """A cylinder of ``radius`` and ``length`` [m] along its z axis, its middle at its origin.

    Parameters
    ----------
    radius : number [m]
    length : number [m]
        Along z.
    """

    radius: Length
    length: Length

    symmetric: ClassVar[str] = "xyz"
    hints: ClassVar[dict[str, str]] = dict.fromkeys(
        ("at", "force", "body_i"), "a Cylinder is a shape; a hydraulic cylinder between two points is a LinearActuator"
    )

    def check(self, n: SimpleNamespace) -> None:
        """Radius and length greater than zero."""
        positive(self, n, "radius", "length")
        super().check(n)

    def volume(self, n: SimpleNamespace) -> Any:
        """V = pi r^2 l."""
        return pi * n.radius**2 * n.length

    def gyration(self, n: SimpleNamespace) -> Any:
        """(3 r^2 + l^2) / 12 across, r^2 / 2 along."""
        k = (3 * n.radius**2 + n.length**2) / 12
        return k, k, n.radius**2 / 2

    def forms(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """Itself."""
        r, h = self.size(n)[0], self.size(n)[-1] / 2
        return (ConvexPart("CYLINDER", (r, h), np.hypot(r, h)),)

    def outlines(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """A circle, or a rectangle from the side."""
        r, h = self.size(n)[0], self.size(n)[-1] / 2
        return (revolved_outline(self, *self.pose(n), r, [(r, -h), (r, h)]),)

    def size(self, n: SimpleNamespace) -> tuple[float, ...]:
        """Radius and length."""
        return n.radius, n.length

    def surface(self, n: SimpleNamespace, fine: int = RESOLUTION) -> tuple[np.ndarray, np.ndarray]:
        """Two discs and the side."""
        r, h = n.radius, n.length / 2
        return lathe(np.array([(0, -h), (r, -h), (r, h), (0, h)]), fine)
