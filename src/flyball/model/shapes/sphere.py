"""A ball."""

from __future__ import annotations

from math import pi
from types import SimpleNamespace
from typing import Any

import numpy as np

from ..element import Length, element, positive
from .form import Form
from .outline import circle
from .solid import FINE, Solid
from .surface import arc, lathe, on_axis


@element
class Sphere(Solid):
    """A ball of the given ``radius`` [m] about its origin."""

    radius: Length

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

    def forms(self, n: SimpleNamespace) -> tuple[Form, ...]:
        """Itself."""
        return (Form("SPHERE", (n.radius,), n.radius),)

    def outlines(self, n: SimpleNamespace) -> tuple[Form, ...]:
        """A circle."""
        return (circle(n.radius, self.pose(n)[0]),)

    def size(self, n: SimpleNamespace) -> tuple[float, ...]:
        """The radius."""
        return (n.radius,)

    def surface(self, n: SimpleNamespace, fine: int = FINE) -> tuple[np.ndarray, np.ndarray]:
        """Meridians and parallels."""
        return lathe(on_axis(arc((0, 0), n.radius, -pi / 2, pi / 2, fine // 2)), fine)
