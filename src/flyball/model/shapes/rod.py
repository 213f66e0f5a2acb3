"""A round bar between two points."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

from ...errors import ModelError
from ...math.vec import matrix_product
from ..element import Length, Point, element, positive
from ..geometry import triad
from .cylinder import Cylinder
from .solid import RESOLUTION, Solid, spatial_point

ROUND = Cylinder(radius=1.0, length=1.0)  # a dummy instance for its formulas; the numbers are passed separately


def ends(solid: Any, n: SimpleNamespace) -> tuple[np.ndarray, np.ndarray, Any]:
    """Middle, direction and distance of the points ``start`` and ``end``.

    Raises
    ------
    ModelError
        If they are the same point.
    """
    a, b = (spatial_point(getattr(n, k), f"{k} of {solid.title}") for k in ("start", "end"))
    length = np.sqrt(((b - a) ** 2).sum())
    if not length.real > 0.0:
        raise ModelError(f"{solid.title}: start and end are the same point, {tuple(a.tolist())}")
    return (a + b) / 2, (b - a) / length, length


@element
class Rod(Solid):
    """A round bar of the given ``radius`` [m] from ``start`` to ``end``, points of the body's reference frame [m].

    Its own frame has its origin in the middle and z along the bar.

    Parameters
    ----------
    start, end : point [m]
        In the body's reference frame.
    radius : number [m]
    """

    start: Point
    end: Point
    radius: Length

    symmetric: ClassVar[str] = "xyz"
    points: ClassVar[tuple[str, ...]] = ("position", "start", "end")

    def check(self, n: SimpleNamespace) -> None:
        """A radius greater than zero and two different ends."""
        positive(self, n, "radius")
        super().check(n)

    def pose(self, n: SimpleNamespace) -> tuple[np.ndarray, np.ndarray]:
        """Return the middle, and axes with z along the bar; ``position`` and ``orientation`` move the whole rod."""
        p, R = super().pose(n)
        middle, axis, _ = ends(self, n)
        return p + matrix_product(R, middle), matrix_product(R, triad(axis))

    def _bar(self, n: SimpleNamespace) -> SimpleNamespace:
        return SimpleNamespace(radius=n.radius, length=ends(self, n)[2])

    def volume(self, n: SimpleNamespace) -> Any:
        """That of a cylinder."""
        return ROUND.volume(self._bar(n))

    def gyration(self, n: SimpleNamespace) -> Any:
        """That of a cylinder."""
        return ROUND.gyration(self._bar(n))

    forms = Cylinder.forms
    outlines = Cylinder.outlines

    def size(self, n: SimpleNamespace) -> tuple[float, ...]:
        """Radius and length."""
        return n.radius, ends(self, n)[2]

    def surface(self, n: SimpleNamespace, fine: int = RESOLUTION) -> tuple[np.ndarray, np.ndarray]:
        """That of a cylinder."""
        return ROUND.surface(self._bar(n), fine)
