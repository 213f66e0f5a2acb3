"""A plate with a polygonal outline."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Annotated, Any, ClassVar

import numpy as np

from ...errors import ModelError
from ..element import Length, Numbers, Unit, element, positive
from ..placement import Placement
from .geometry import ConvexPart, extrude, planar_cross, surface_part
from .solid import RESOLUTION, Solid

Outline = Annotated[tuple[Numbers, ...], Unit("m")]


@element
class Prism(Solid):
    """A polygon in its x-y plane, extruded along z: a plate with its middle plane at z = 0.

    Parameters
    ----------
    outline : list of points (x, y) [m]
        Corners of a polygon that does not cross itself, either way round; the first may be repeated at the end.
        Cut-outs are shapes of their own, with ``hole=True``.
    thickness : number [m]
    """

    outline: Outline
    thickness: Length

    symmetric: ClassVar[str] = "z"

    def reflected(self, axis: str, orientation: Any) -> dict[str, Any]:
        """Return the reflected outline."""
        return {"outline": Placement(mirror=axis).directions(self.outline)}

    def check(self, n: SimpleNamespace) -> None:
        """A thickness greater than zero; an outline with an area that does not cross itself."""
        positive(self, n, "thickness")
        p = self._corners(n)
        if len(p) < 3:
            raise ModelError(f"{self.title}: its outline has {len(p)} corners; it needs three at least")
        around = np.abs(np.diff(p, axis=0, append=p[:1])).max()
        if not abs(_moments(p)[0].real) > 1e-12 * around**2:
            raise ModelError(f"{self.title}: its outline has no area; its corners must not lie on one line")
        if hit := _crossing(p.real):
            raise ModelError(
                f"{self.title}: its outline crosses itself: the side from corner {hit[0]} meets the side from corner "
                f"{hit[1]}; list the corners in their order around it, each once"
            )
        super().check(n)

    def _corners(self, n: SimpleNamespace) -> np.ndarray:
        """Corners (k, 2), the first not repeated at the end."""
        wrong = next((p for p in n.outline if len(p) != 2), None)
        if wrong is not None:
            raise ModelError(f"{self.title}: its outline is a list of points (x, y), got {wrong} among them")
        p = np.array(n.outline)
        return p[:-1] if len(p) > 1 and (p[0] == p[-1]).all() else p

    def volume(self, n: SimpleNamespace) -> Any:
        """Area times thickness."""
        area = _moments(self._corners(n))[0]
        return (area if area.real > 0 else -area) * n.thickness

    def centre(self, n: SimpleNamespace) -> Any:
        """The centroid of the outline."""
        _, c, _ = _moments(self._corners(n))
        return c[0], c[1], 0.0

    def gyration(self, n: SimpleNamespace) -> Any:
        """From the second moments of the outline's area."""
        _, _, S = _moments(self._corners(n))
        z2 = n.thickness**2 / 12
        o = 0.0 * z2
        return np.array([[S[1, 1] + z2, -S[0, 1], o], [-S[0, 1], S[0, 0] + z2, o], [o, o, S[0, 0] + S[1, 1]]])

    def size(self, n: SimpleNamespace) -> tuple[float, ...]:
        """The thickness."""
        return (n.thickness,)

    def forms(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """Its surface: one convex part, or several."""
        return (surface_part(self.surface(n)),)

    def outlines(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """The outline of each part."""
        return (surface_part(self.mesh(n)),)

    def surface(self, n: SimpleNamespace, fine: int = RESOLUTION) -> tuple[np.ndarray, np.ndarray]:
        """The outline, extruded."""
        p = self._corners(n)
        return extrude(p if _moments(p)[0] > 0 else p[::-1], n.thickness)


def _moments(p: np.ndarray) -> tuple[Any, np.ndarray, np.ndarray]:
    """Area (negative for clockwise), centroid, and second moments about it per area, of a polygon (k, 2).

    Sums over the triangles that the sides make with the first corner: of area A and corners 0, a, b, the first moment
    is A (a + b) / 3 and the second A (a a + b b + (a + b)(a + b)) / 12.
    """
    a = p - p[0]
    b = np.roll(a, -1, axis=0)
    A = planar_cross(a, b) / 2
    area = A.sum()
    if area == 0.0:
        return area, p[0], np.zeros((2, 2))
    s = a + b
    c = (A[:, None] * s).sum(axis=0) / (3 * area)
    S = sum(np.einsum("k,ki,kj->ij", A, x, x) for x in (a, b, s)) / (12 * area)
    return area, p[0] + c, S - np.outer(c, c)


def _crossing(p: np.ndarray) -> tuple[int, int] | None:
    """Return two sides (numbered by their first corner, from 1) that intersect other than at a common corner."""
    k = len(p)
    q = np.roll(p, -1, axis=0)
    for i in range(k - 1):
        a, b = p[i], q[i]
        c, d = p[i + 1 :], q[i + 1 :]
        one, two = planar_cross(b - a, c - a), planar_cross(b - a, d - a)
        three, four = planar_cross(d - c, a - c), planar_cross(d - c, b - c)
        hit = (one * two <= 0) & (three * four <= 0) & _overlap(a, b, c, d)
        hit[0] = _turns_back(a, b, d[0])  # consecutive sides share this corner
        if i == 0:
            hit[-1] = _turns_back(c[-1], a, b)
        if hit.any():
            return i + 1, i + 2 + int(np.argmax(hit))
    return None


def _overlap(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Return whether the rectangles around the sides overlap: decides for sides that lie on one line."""
    low, high = np.minimum(a, b), np.maximum(a, b)
    return ((np.minimum(c, d) <= high) & (np.maximum(c, d) >= low)).all(axis=1)


def _turns_back(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> bool:
    """Return whether the path a, b, c reverses at b, or does not leave it."""
    return bool(planar_cross(b - a, c - b) == 0.0 and (b - a) @ (c - b) <= 0.0)
