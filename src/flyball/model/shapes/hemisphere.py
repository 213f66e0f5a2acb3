"""Half a ball."""

from __future__ import annotations

from math import pi
from types import SimpleNamespace
from typing import Any

import numpy as np

from ..element import element
from .form import Form
from .outline import ALONG, circle, polygon
from .solid import FINE
from .sphere import Sphere
from .surface import arc, lathe, on_axis

OUTLINE = 128  # corners of a circle's outline


@element
class Hemisphere(Sphere):
    """Half a ball of the given ``radius`` [m]: the middle of its flat side at its origin, the dome towards +z."""

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

    def forms(self, n: SimpleNamespace) -> tuple[Form, ...]:
        """Itself."""
        return (Form("HEMISPHERE", (n.radius,), n.radius),)

    def outlines(self, n: SimpleNamespace) -> tuple[Form, ...]:
        """Seen along its axis a circle; else a polygon about half a circle, or about what is between."""
        p, R = self.pose(n)
        if np.hypot(*R[:2, 2]) < ALONG:
            return (circle(n.radius, p),)
        return (polygon(p + self.surface(n, OUTLINE)[0] @ R.T),)

    def surface(self, n: SimpleNamespace, fine: int = FINE) -> tuple[np.ndarray, np.ndarray]:
        """The flat side and the dome."""
        dome = arc((0, 0), n.radius, 0.0, pi / 2, max(fine // 4, 1))
        return lathe(on_axis(np.vstack([(0.0, 0.0), dome])), fine)
