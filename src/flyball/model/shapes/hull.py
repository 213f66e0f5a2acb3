"""The convex hull of points."""

from __future__ import annotations

import reprlib
from dataclasses import field
from functools import cached_property
from types import SimpleNamespace
from typing import Annotated, Any

import numpy as np

from ...errors import ModelError
from ..element import Length, element, positive
from ..placement import Placement
from .geometry import ConvexPart, Integrals, polygon_outline, polyhedron_integrals, surface_defects
from .mesh import number_rows
from .solid import RESOLUTION, Solid


@element
class Hull(Solid):
    """The smallest convex solid that contains the given points.

    Parameters
    ----------
    vertices : (k, 3) numbers
        Four or more that do not lie in one plane; interior points have no effect. In units of ``scale``.
    scale : number [m]
        Length of one unit of the vertices: ``"1 mm"``.
    """

    vertices: Annotated[Any, number_rows(float)] = field(repr=False)
    scale: Length = 1.0

    def reflected(self, axis: str, orientation: Any) -> dict[str, Any]:
        """Return the reflected points."""
        return {"vertices": (np.array(self.vertices) @ Placement(mirror=axis).reflection + 0.0).tolist()}

    def check(self, n: SimpleNamespace) -> None:
        """Points that span a solid, and a scale greater than zero."""
        positive(self, n, "scale")
        p = self.vertices
        if not isinstance(p, tuple) or len(p) < 4 or len(p[0]) != 3 or not np.isfinite(p).all():
            raise ModelError(
                f"{self.title}: vertices must be four or more points of three finite numbers, got {reprlib.repr(p)}"
            )
        if surface_defects(*self._triangles):
            raise ModelError(f"{self.title}: its vertices lie in one plane; give it a thickness")
        super().check(n)

    @cached_property
    def _triangles(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the corners of the hull and triangles that face outwards, in its own units."""
        from scipy.spatial import ConvexHull, QhullError

        p = np.array(self.vertices, float)
        middle = p.mean(axis=0)
        try:
            found = ConvexHull(p - middle)
        except QhullError:
            return p, np.zeros((0, 3), int)
        new = np.full(len(p), -1)
        new[found.vertices] = np.arange(len(found.vertices))
        f = found.simplices
        a, b, c = (p[f[:, k]] for k in range(3))
        inwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), found.equations[:, :3]) < 0.0
        f = np.where(inwards[:, None], f[:, ::-1], f)
        return p[found.vertices], new[f]

    @cached_property
    def _integrals(self) -> Integrals:
        return polyhedron_integrals(*self._triangles)

    def volume(self, n: SimpleNamespace) -> Any:
        """By Gauss's theorem."""
        return self._integrals.volume * n.scale**3

    def centre(self, n: SimpleNamespace) -> Any:
        """By Gauss's theorem."""
        return self._integrals.centre * n.scale

    def gyration(self, n: SimpleNamespace) -> Any:
        """By Gauss's theorem; its axes need not be principal ones."""
        return self._integrals.gyration * n.scale**2

    def forms(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """Itself."""
        v = self._triangles[0] * n.scale
        return (ConvexPart("HULL", (0.0,), np.sqrt((v**2).sum(axis=1)).max(), vertex=v),)

    def outlines(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """The outline of its corners."""
        return (polygon_outline(self.mesh(n)[0]),)

    def size(self, n: SimpleNamespace) -> tuple[float, ...]:
        """Edges of the box around it."""
        return tuple((np.ptp(self._triangles[0], axis=0) * n.scale).tolist())

    def surface(self, n: SimpleNamespace, fine: int = RESOLUTION) -> tuple[np.ndarray, np.ndarray]:
        """Its triangles."""
        v, f = self._triangles
        return v * n.scale, f
