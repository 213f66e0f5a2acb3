"""An ellipsoid."""

from __future__ import annotations

from math import pi
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

from ..element import Point, element
from .geometry import ConvexPart, arc, lathe, snapped_to_axis
from .solid import RESOLUTION, Solid, three_lengths


@element
class Ellipsoid(Solid):
    """An ellipsoid about its origin with ``semi_axes`` = (a, b, c) [m] along x, y, z.

    Parameters
    ----------
    semi_axes : three numbers [m]
        Half the diameters along x, y, z.
    """

    semi_axes: Point

    symmetric: ClassVar[str] = "xyz"

    def check(self, n: SimpleNamespace) -> None:
        """Three semi-axes greater than zero."""
        three_lengths(self, "semi_axes", n.semi_axes)
        super().check(n)

    def volume(self, n: SimpleNamespace) -> Any:
        """V = 4/3 pi a b c."""
        a, b, c = n.semi_axes
        return 4 / 3 * pi * a * b * c

    def gyration(self, n: SimpleNamespace) -> Any:
        """(b^2 + c^2) / 5 and so on."""
        a, b, c = n.semi_axes
        return (b * b + c * c) / 5, (a * a + c * c) / 5, (a * a + b * b) / 5

    def forms(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """Itself."""
        return (ConvexPart("ELLIPSOID", tuple(n.semi_axes), np.max(n.semi_axes)),)

    def size(self, n: SimpleNamespace) -> tuple[float, ...]:
        """The semi-axes."""
        return tuple(n.semi_axes)

    def surface(self, n: SimpleNamespace, fine: int = RESOLUTION) -> tuple[np.ndarray, np.ndarray]:
        """A ball, stretched."""
        v, f = lathe(snapped_to_axis(arc((0, 0), 1.0, -pi / 2, pi / 2, fine // 2)), fine)
        return v * np.array(n.semi_axes), f
