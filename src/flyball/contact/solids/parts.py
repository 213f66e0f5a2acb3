"""A closed surface of triangles as convex parts.

Space is cut by planes into convex regions until what a region holds of the solid is convex within the tolerance: in
front of no piece of its surface its hull has more empty space. A plane is one that the surface itself has where it is
hollow, or goes across the middle; that one is taken whose two hulls are smallest in all. A solid with flat sides comes
out as it is. Nothing asks how triangles are joined, so that needles and slits do no harm.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ...errors import ModelError
from .clipping import SLIVER, clipped, corners_of, normals_of, winding
from .hull import Hull, hull

TOLERANCE = 0.02  # of the size: how far a part may reach beyond the solid
MOST = 64  # parts
TRIED = 10  # planes a cut
INNER = 0.999  # winding number of what is inside, not on the surface
SAME = 1e-7  # of the size: what counts as on a plane


@dataclass(frozen=True)
class Parts:
    """Convex parts of a solid.

    Attributes
    ----------
    hulls : tuple of Hull
        Neighbours share the plane that was cut along.
    beyond : float
        How much of nothing [m] a part has in front of the solid's surface at most, square to it.
    """

    hulls: tuple[Hull, ...]
    beyond: float


@dataclass
class _Piece:
    """What one region holds: triangles (m, 3, 3) of the surface, and the half-spaces n . x <= c of the region."""

    triangles: np.ndarray
    planes: np.ndarray
    hull: Hull | None = None
    empty: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @property
    def beyond(self) -> float:
        return float(self.empty.max(initial=0.0))


def parts(vertices: np.ndarray, faces: np.ndarray, tolerance: float | None = None, most: int = MOST) -> Parts:
    """The solid inside a closed surface as convex parts.

    Parameters
    ----------
    vertices : (k, 3) [m]
    faces : (m, 3)
        Triangles, counter-clockwise seen from outside. That the surface is closed is the caller's to see to.
    tolerance : float, optional
        How far [m] a part may reach beyond the solid; a fiftieth of the solid's size if not given.
    most : int
        Parts at most; where these do not suffice `Parts.beyond` is greater than the tolerance.

    Raises
    ------
    ModelError
        If the tolerance is not greater than zero, or nothing solid is inside.
    """
    if tolerance is not None and not 0 < tolerance < np.inf:
        raise ModelError(f"the tolerance of convex parts must be greater than zero, got {tolerance}")
    solid = np.asarray(vertices, dtype=float)[np.asarray(faces)]
    low, high = solid.min(axis=(0, 1)), solid.max(axis=(0, 1))
    size = float(np.linalg.norm(high - low))
    enough = TOLERANCE * size if tolerance is None else tolerance
    box = np.concatenate([np.eye(3), -np.eye(3)])
    c = np.concatenate([high, -low]) + 0.1 * size
    whole = _Piece(solid, np.column_stack([box, c]))
    _close(whole, size, np.zeros((0, 3)))
    if whole.hull is None:
        raise ModelError("its surface has no solid inside: it is flat")
    pieces = [whole]
    while len(pieces) < most:
        worst = max(range(len(pieces)), key=lambda k: pieces[k].beyond)
        if pieces[worst].beyond <= enough:
            break
        halves = _cut(pieces[worst], solid, enough, size)
        if not halves:
            break
        pieces[worst : worst + 1] = halves
    return Parts(tuple(p.hull for p in pieces if p.hull is not None), max(p.beyond for p in pieces))


def _close(piece: _Piece, size: float, more: np.ndarray) -> None:
    """Find the hull of a piece, and how much of nothing it has in front of each triangle of the surface."""
    t = piece.triangles
    try:
        piece.hull = hull(np.concatenate([t.reshape(-1, 3), more]))
    except ModelError:
        return  # nothing but a skin
    if piece.hull.volume < SLIVER * size**3:
        piece.hull = None
        return
    piece.empty = np.zeros(len(t))
    n = np.nan_to_num(normals_of(t))
    step = 1 + 10**6 // len(piece.hull.sides)
    for k in range(0, len(t), step):
        some = slice(k, k + step)
        points = np.concatenate([t[some], t[some].mean(axis=1, keepdims=True)], axis=1)
        piece.empty[some] = _ahead(piece.hull, points, n[some], SAME * size)


def _ahead(body: Hull, points: np.ndarray, n: np.ndarray, thick: float) -> np.ndarray:
    """How far (m,) it is from points (m, 4, 3) out of a convex body along n (m, 3), the farthest of the four."""
    gap = np.maximum(body.offsets - points @ body.normals.T, 0.0)
    gap[gap < thick] = 0.0
    speed = n @ body.normals.T
    with np.errstate(divide="ignore", invalid="ignore"):
        time = np.where(speed[:, None] > 1e-9, gap / speed[:, None], np.inf).min(axis=2)
    return np.where(np.isfinite(time), time, 0.0).max(axis=1)


def _points(piece: _Piece, solid: np.ndarray, size: float) -> np.ndarray:
    """Corners of its region that are inside the solid."""
    x = corners_of(piece.planes, SAME * size)
    return x[winding(x, solid) > INNER]


def _cut(piece: _Piece, solid: np.ndarray, enough: float, size: float) -> list[_Piece]:
    """The two halves along the best plane, or nothing where no plane makes both smaller."""
    best: list[tuple[_Piece, np.ndarray]] = []
    whole = piece.hull.volume if piece.hull is not None else 0.0
    least = 2 * whole
    for plane in _cutting(piece, enough, size):
        halves, rooms = [], []
        for side in (plane, -plane):
            half = _Piece(clipped(piece.triangles, side, SAME * size), np.concatenate([piece.planes, side[None]]))
            halves.append((half, _points(half, solid, size)))
            rooms.append(_room(np.concatenate([half.triangles.reshape(-1, 3), halves[-1][1]]), SLIVER * size**3))
        if sum(rooms) < least * (1 - 1e-9) and max(rooms) < whole * (1 - 1e-6):
            best, least = halves, sum(rooms)
    for half, more in best:
        _close(half, size, more)
    return [half for half, _ in best if half.hull is not None]


def _room(points: np.ndarray, least: float) -> float:
    """Volume of the hull of points; 0 where there is none."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        volume = float(ConvexHull(points).volume)
    except (QhullError, ValueError):
        return 0.0
    return volume if volume > least else 0.0


def _cutting(piece: _Piece, enough: float, size: float) -> Iterator[np.ndarray]:
    """Planes to cut along: of triangles, that with most of nothing before it first; and three across the middle."""
    n = normals_of(piece.triangles)
    c = np.einsum("ij,ij->i", n, piece.triangles[:, 0])
    order = np.argsort(-piece.empty, kind="stable")
    given: list[np.ndarray] = []
    for k in itertools.takewhile(lambda k: piece.empty[k] > 0.5 * min(enough, piece.beyond), order):
        plane = np.array([*n[k], c[k]])
        if np.isfinite(plane).all() and not any(_alike(g, plane, size) for g in given):
            given.append(plane)
            yield plane
        if len(given) == TRIED:
            break
    middle = piece.triangles[order[0]].mean(axis=0)
    for axis in np.eye(3):
        yield np.array([*axis, axis @ middle])


def _alike(a: np.ndarray, b: np.ndarray, size: float) -> bool:
    """Whether two planes are nearly the same."""
    cosine = a[:3] @ b[:3]
    return bool(abs(cosine) > 0.999 and abs(a[3] - np.sign(cosine) * b[3]) < 0.02 * size)
