"""Half a ball."""

from __future__ import annotations

from math import pi
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

from ..element import element
from .geometry import ALIGNMENT_TOLERANCE, ConvexPart, arc, circle_outline, lathe, polygon_outline, snapped_to_axis
from .solid import RESOLUTION
from .sphere import Sphere

OUTLINE = 128  # corners of a circle's outline


@element
class Hemisphere(Sphere):
    """Half a ball of the given ``radius`` [m]: the middle of its flat side at its origin, the dome towards +z.

    Parameters
    ----------
    radius : number [m]
    """

    symmetric: ClassVar[str] = "xy"

    def volume(self, n: SimpleNamespace) -> Any:
        """V = 2/3 pi r^3."""
        return 2 / 3 * pi * n.radius**3

    def centre(self, n: SimpleNamespace) -> Any:
        """3/8 r above the flat side."""
        return 0.0, 0.0, 3 / 8 * n.radius

    def gyration(self, n: SimpleNamespace) -> Any:
        """2/5 r^2 about every diameter of the whole ball; across, moved to the centre of mass: 83/320 r^2."""
        k = 83 / 320 * n.radius**2
        return k, k, 0.4 * n.radius**2

    def forms(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """Itself."""
        return (ConvexPart("HEMISPHERE", (n.radius,), n.radius),)

    def outlines(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """Return a circle if seen along its axis; else a circumscribed polygon."""
        p, R = self.pose(n)
        if np.hypot(*R[:2, 2]) < ALIGNMENT_TOLERANCE:
            return (circle_outline(n.radius, p),)
        return (polygon_outline(p + self.surface(n, OUTLINE)[0] @ R.T),)

    def surface(self, n: SimpleNamespace, fine: int = RESOLUTION) -> tuple[np.ndarray, np.ndarray]:
        """The flat side and the dome."""
        dome = arc((0, 0), n.radius, 0.0, pi / 2, max(fine // 4, 1))
        return lathe(snapped_to_axis(np.vstack([(0.0, 0.0), dome])), fine)
