"""A hollow cylinder."""

from __future__ import annotations

from math import pi
from types import SimpleNamespace
from typing import Any

import numpy as np

from ..element import Length, element, positive
from .cylinder import Cylinder
from .geometry import lathe
from .solid import RESOLUTION, smaller


@element
class Tube(Cylinder):
    """A hollow cylinder along z, its middle at its origin: outer ``radius``, ``inner_radius`` and ``length`` [m].

    In contact it is a solid cylinder: nothing can enter its bore.

    Parameters
    ----------
    radius : number [m]
        Outer radius.
    inner_radius : number [m]
        Radius of the bore.
    length : number [m]
        Along z.
    """

    inner_radius: Length

    def check(self, n: SimpleNamespace) -> None:
        """Lengths greater than zero, the inner radius smaller than the outer."""
        positive(self, n, "inner_radius", why="Without a bore it is a Cylinder")
        smaller(self, "inner_radius", n.inner_radius, "radius", n.radius)
        super().check(n)

    def volume(self, n: SimpleNamespace) -> Any:
        """V = pi (R^2 - r^2) l."""
        return pi * (n.radius**2 - n.inner_radius**2) * n.length

    def gyration(self, n: SimpleNamespace) -> Any:
        """(3 (R^2 + r^2) + l^2) / 12 across, (R^2 + r^2) / 2 along."""
        s = n.radius**2 + n.inner_radius**2
        k = (3 * s + n.length**2) / 12
        return k, k, s / 2

    def size(self, n: SimpleNamespace) -> tuple[float, ...]:
        """Outer radius, inner radius and length."""
        return n.radius, n.inner_radius, n.length

    def surface(self, n: SimpleNamespace, fine: int = RESOLUTION) -> tuple[np.ndarray, np.ndarray]:
        """Two rings, the side and the bore."""
        a, b, h = n.inner_radius, n.radius, n.length / 2
        return lathe(np.array([(a, -h), (b, -h), (b, h), (a, h)]), fine, ring=True)
