"""A landscape: heights on a grid."""

from __future__ import annotations

import reprlib
from dataclasses import field
from types import SimpleNamespace
from typing import Annotated, Any

import numpy as np

from ...errors import ModelError
from ..element import Length, element, positive
from .geometry import ConvexPart
from .mesh import number_rows
from .solid import RESOLUTION, Surface


@element
class HeightField(Surface):
    """A landscape: heights on a grid in its x-y plane, solid below, empty beyond its edges.

    Each cell is two triangles that share the diagonal from its corner at least x and y.

    Parameters
    ----------
    heights : (nx, ny) numbers [m]
        Height (i, j) is at (i dx, j dy) from its origin.
    dx, dy : number [m]
        Width of a cell along x and y; ``dy`` equals ``dx`` if not given.
    """

    heights: Annotated[Any, number_rows(float)] = field(repr=False)
    dx: Length
    dy: Length | None = None

    def check(self, n: SimpleNamespace) -> None:
        """Heights in two or more rows and columns, and cells with a width."""
        positive(self, n, "dx", "dy")
        z = self.heights
        if not isinstance(z, tuple) or len(z) < 2 or len(z[0]) < 2 or not np.isfinite(z).all():
            raise ModelError(
                f"{self.title}: heights must be finite numbers in two or more rows and columns, got {reprlib.repr(z)}"
            )
        super().check(n)

    def forms(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """Itself: the heights three a row, those of the first x first."""
        z = np.array(self.heights)
        rows = np.zeros(-(-z.size // 3) * 3)
        rows[: z.size] = z.ravel()
        v = self.surface(n)[0]
        reach = np.sqrt((v**2).sum(axis=1)).max()
        par = (float(z.shape[0]), float(z.shape[1]), n.dx, n.dx if n.dy is None else n.dy)
        return (ConvexPart("FIELD", par, reach, vertex=rows.reshape(-1, 3)),)

    def size(self, n: SimpleNamespace) -> tuple[float, ...]:
        """Edges of the box around it."""
        return tuple(np.ptp(self.surface(n)[0], axis=0).tolist())

    def surface(self, n: SimpleNamespace, fine: int = RESOLUTION) -> tuple[np.ndarray, np.ndarray]:
        """Return two triangles per cell; the surface is open."""
        z = np.array(self.heights)
        i, j = np.indices(z.shape)
        v = np.stack([i * n.dx, j * (n.dx if n.dy is None else n.dy), z], axis=-1).reshape(-1, 3)
        k = i * z.shape[1] + j
        a, b, c, d = (x.ravel() for x in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
        return v, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
