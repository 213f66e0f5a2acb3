"""Convex hulls of points and convex parts of closed surfaces: computed once, in NumPy, before the motion.

For the decomposition, space is cut by planes into convex regions until the solid in a region is convex within
the tolerance: the empty space of its hull in front of every piece of the surface is at most that thick. Candidate
planes are those of the surface where it is concave, and three through the middle; the plane with the smallest total
volume of the two hulls is chosen. A solid with flat sides is decomposed exactly. Connectivity of the triangles is not
used, so slivers and slits do no harm.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import ModelError

SMALLEST_VOLUME = 1e-9  # relative to the size cubed; smaller volumes count as zero


def triangle_normals(triangles: np.ndarray) -> np.ndarray:
    """Return unit normals (m, 3); nan for triangles without area."""
    n = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    with np.errstate(invalid="ignore"):
        return n / np.linalg.norm(n, axis=1, keepdims=True)


def clip_triangles(triangles: np.ndarray, plane: np.ndarray, thick: float) -> np.ndarray:
    """Clip triangles (m, 3, 3) by the half-space n . x <= c of the plane (n, c).

    Triangles within ``thick`` of the plane are kept if the solid behind them is on that side.
    """
    d = triangles @ plane[:3] - plane[3]
    d[np.abs(d) <= thick] = 0.0
    flat = (d == 0.0).all(axis=1)
    same = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]) @ plane[:3] > 0
    keep = np.where(flat, same, (d <= 0.0).all(axis=1))
    across = (d > 0.0).any(axis=1) & (d < 0.0).any(axis=1)
    cut = [x for t, s in zip(triangles[across], d[across], strict=True) for x in _clip_triangle(t, s)]
    return np.concatenate([triangles[keep], np.array(cut).reshape(-1, 3, 3)])


def _clip_triangle(t: np.ndarray, d: np.ndarray) -> list[np.ndarray]:
    """Part of a triangle below the plane, as triangles; d: heights of its corners (Sutherland and Hodgman 1974)."""
    out = []
    for k in range(3):
        a, b, x, y = t[k], t[(k + 1) % 3], d[k], d[(k + 1) % 3]
        if x <= 0.0:
            out.append(a)
        if x * y < 0.0:
            out.append(a + (x / (x - y)) * (b - a))
    return [np.array([out[0], b, c]) for b, c in itertools.pairwise(out[1:])]


def region_corners(planes: np.ndarray, thick: float) -> np.ndarray:
    """Corners (k, 3) of the region n . x <= c of all planes (n, c)."""
    triples = np.array(list(itertools.combinations(range(len(planes)), 3)))
    normal, c = planes[triples, :3], planes[triples, 3]
    good = np.abs(np.linalg.det(normal)) > 1e-6
    if not good.any():
        return np.zeros((0, 3))
    x = np.linalg.solve(normal[good], c[good][..., None])[..., 0]
    return x[(x @ planes[:, :3].T <= planes[:, 3] + thick).all(axis=1)]


def winding_number(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Winding number of a closed surface about each point: 1 inside, 0 outside (Van Oosterom and Strackee 1983)."""
    out = np.zeros(len(points))
    for k, x in enumerate(points):
        a, b, c = np.moveaxis(triangles - x, 1, 0)
        la, lb, lc = (np.linalg.norm(s, axis=1) for s in (a, b, c))
        top = np.einsum("ij,ij->i", a, np.cross(b, c))
        ab, bc, ca = (np.einsum("ij,ij->i", s, t) for s, t in ((a, b), (b, c), (c, a)))
        out[k] = np.sum(np.arctan2(top, la * lb * lc + ab * lc + bc * la + ca * lb)) / (2 * np.pi)
    return out


SAME_PLANE = 1e-9  # relative to the size; sides whose planes differ by less are merged
THINNEST = 1e-9  # relative to the size; a thinner body is no solid
EDGE_SEARCH_VERTICES = 40  # number of vertices above which the farthest one is found along the edges


@dataclass(frozen=True, eq=False)
class ConvexPolyhedron:
    """A convex polyhedron: vertices (k, 3) [m], outward unit normals (m, 3), and corners of each side.

    Corners are vertex numbers, counter-clockwise seen from outside.
    """

    vertices: np.ndarray
    normals: np.ndarray
    sides: tuple[tuple[int, ...], ...]

    @cached_property
    def offsets(self) -> np.ndarray:
        """Distances of the planes of the sides from the origin."""
        first = self.vertices[[s[0] for s in self.sides]]
        return np.einsum("ij,ij->i", self.normals, first)

    def outside(self, points: Any) -> np.ndarray:
        """Largest signed distance of points from the planes of the sides; negative inside."""
        return np.max(np.asarray(points) @ self.normals.T - self.offsets, axis=1)

    @cached_property
    def volume(self) -> float:
        """Volume by the divergence theorem."""
        fans = [(s[0], a, b) for s in self.sides for a, b in itertools.pairwise(s[1:])]
        a, b, c = self.vertices[np.array(fans).T] - self.vertices.mean(axis=0)
        return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6

    @property
    def rows(self) -> np.ndarray:
        """Rows for `Geometry.vertex`: vertices, then normals."""
        return np.concatenate([self.vertices, self.normals])

    def table(self, at: int) -> tuple[np.ndarray, int]:
        """Return data for `Geometry.face` from place ``at`` on (sides, then edges), first place of the edges or -1."""
        sides = [x for s in self.sides for x in (len(s), *s)]
        if len(self.vertices) < EDGE_SEARCH_VERTICES:
            return np.array(sides, dtype=np.int64), -1
        return np.array([*sides, *self._edges()], dtype=np.int64), at + len(sides)

    def _edges(self) -> list[int]:
        """Six start vertices, the place of each vertex's neighbours, and the neighbours, each list closed by -1."""
        near: list[set[int]] = [set() for _ in self.vertices]
        for s in self.sides:
            for a, b in zip(s, s[1:] + s[:1], strict=True):
                near[a].add(b)
                near[b].add(a)
        starts: list[int] = []
        lists: list[int] = []
        for some in near:
            starts.append(6 + len(near) + len(lists))
            lists += [*sorted(some), -1]
        ends = [int(pick(self.vertices[:, k])) for k in range(3) for pick in (np.argmin, np.argmax)]
        return [*ends, *starts, *lists]


def convex_hull(points: Any) -> ConvexPolyhedron:
    """Compute the convex hull of points (k, 3) [m].

    Raises
    ------
    ModelError
        If there are fewer than four, they lie in a plane (within 1e-9 of their size), or they are not finite.
    """
    from scipy.spatial import ConvexHull, QhullError

    x = np.asarray(points, dtype=float)
    if x.ndim != 2 or x.shape[1] != 3 or len(x) < 4 or not np.isfinite(x).all():
        raise ModelError(f"a convex hull takes four or more points of three finite numbers, got shape {x.shape}")
    middle = x.mean(axis=0)
    size = float(np.max(np.linalg.norm(x - middle, axis=1)))
    thin = f"a convex hull takes points that are not all in a plane; these {len(x)} are, within 1e-9 of their size"
    try:
        found = ConvexHull((x - middle) / (size or 1.0))
    except QhullError:
        raise ModelError(thin) from None
    scaled = found.points[found.vertices]
    width = np.ptp(scaled @ np.linalg.svd(scaled - scaled.mean(axis=0))[2][2])
    if width < THINNEST:
        raise ModelError(thin)
    new = np.full(len(x), -1)
    new[found.vertices] = np.arange(len(found.vertices))
    normals, sides = _merged_faces(found, scaled, new)
    used = np.unique(np.concatenate([np.array(s) for s in sides]))
    new = np.full(len(scaled), -1)
    new[used] = np.arange(len(used))
    renamed = tuple(tuple(int(new[k]) for k in s) for s in sides)
    return ConvexPolyhedron(x[found.vertices][used], normals, renamed)


def _merged_faces(found: Any, points: np.ndarray, new: np.ndarray) -> tuple[np.ndarray, list[list[int]]]:
    """Return unit normals and corners of the sides: neighbouring triangles in one plane are merged."""
    planes, member = found.equations, np.full(len(found.equations), -1)
    normals: list[np.ndarray] = []
    sides: list[list[int]] = []
    for k in range(len(planes)):
        if member[k] >= 0:
            continue
        member[k], left, all_of_it = len(sides), [k], [k]
        while left:
            for m in found.neighbors[left.pop()]:
                if member[m] < 0 and np.abs(planes[m] - planes[k]).max() < SAME_PLANE:
                    member[m] = len(sides)
                    left.append(m)
                    all_of_it.append(m)
        normals.append(planes[k, :3])
        sides.append(_ordered_corners(points, np.unique(new[found.simplices[all_of_it]]), planes[k, :3]))
    return np.array(normals), sides


def _ordered_corners(points: np.ndarray, corners: np.ndarray, n: np.ndarray) -> list[int]:
    """Corners in counter-clockwise order about n, without those on a line between their neighbours."""
    x = points[corners]
    u = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    v = np.cross(n, u)
    x = x - x.mean(axis=0)
    around = corners[np.argsort(np.arctan2(x @ v, x @ u), kind="stable")]
    kept = []
    for k, c in enumerate(around):
        a, b = points[around[k - 1]] - points[c], points[around[(k + 1) % len(around)]] - points[c]
        if np.linalg.norm(np.cross(a, b)) > SAME_PLANE * np.linalg.norm(a) * np.linalg.norm(b):
            kept.append(int(c))
    return kept


PART_TOLERANCE = 0.02  # relative to the size: largest protrusion of a part beyond the solid
MAX_PARTS = 64  # maximum number of parts
MAX_PLANES = 10  # candidate planes per cut
INSIDE_WINDING = 0.999  # winding number above which a point is inside, not on the surface
ON_PLANE = 1e-7  # relative to the size; distance within which a point is on a plane


@dataclass(frozen=True)
class ConvexParts:
    """Convex parts of a solid.

    Attributes
    ----------
    hulls : tuple of Hull
        Neighbours share the cutting plane.
    beyond : float
        Largest thickness [m] of empty space in a part in front of the solid's surface, along its normal.
    """

    hulls: tuple[ConvexPolyhedron, ...]
    beyond: float


@dataclass
class _Piece:
    """Contents of one region: triangles (m, 3, 3) of the surface, and the half-spaces n . x <= c of the region."""

    triangles: np.ndarray
    planes: np.ndarray
    hull: ConvexPolyhedron | None = None
    empty: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @property
    def beyond(self) -> float:
        return float(self.empty.max(initial=0.0))


def convex_parts(
    vertices: np.ndarray, faces: np.ndarray, tolerance: float | None = None, most: int = MAX_PARTS
) -> ConvexParts:
    """Decompose the solid inside a closed surface into convex parts.

    Parameters
    ----------
    vertices : (k, 3) [m]
    faces : (m, 3)
        Triangles, counter-clockwise seen from outside. The caller must ensure that the surface is closed.
    tolerance : float, optional
        Largest protrusion [m] of a part beyond the solid; by default a fiftieth of the solid's size.
    most : int
        Maximum number of parts; if it is reached, `ConvexParts.beyond` may exceed the tolerance.

    Raises
    ------
    ModelError
        If the tolerance is not greater than zero, or the surface encloses no solid.
    """
    if tolerance is not None and not 0 < tolerance < np.inf:
        raise ModelError(f"the tolerance of convex parts must be greater than zero, got {tolerance}")
    solid = np.asarray(vertices, dtype=float)[np.asarray(faces)]
    low, high = solid.min(axis=(0, 1)), solid.max(axis=(0, 1))
    size = float(np.linalg.norm(high - low))
    enough = PART_TOLERANCE * size if tolerance is None else tolerance
    box = np.concatenate([np.eye(3), -np.eye(3)])
    c = np.concatenate([high, -low]) + 0.1 * size
    whole = _Piece(solid, np.column_stack([box, c]))
    _update_hull(whole, size, np.zeros((0, 3)))
    if whole.hull is None:
        raise ModelError("its surface has no solid inside: it is flat")
    pieces = [whole]
    while len(pieces) < most:
        worst = max(range(len(pieces)), key=lambda k: pieces[k].beyond)
        if pieces[worst].beyond <= enough:
            break
        halves = _split(pieces[worst], solid, enough, size)
        if not halves:
            break
        pieces[worst : worst + 1] = halves
    return ConvexParts(tuple(p.hull for p in pieces if p.hull is not None), max(p.beyond for p in pieces))


def _update_hull(piece: _Piece, size: float, more: np.ndarray) -> None:
    """Compute the hull of a piece, and the thickness of empty space in front of each triangle of the surface."""
    t = piece.triangles
    try:
        piece.hull = convex_hull(np.concatenate([t.reshape(-1, 3), more]))
    except ModelError:
        return  # no volume
    if piece.hull.volume < SMALLEST_VOLUME * size**3:
        piece.hull = None
        return
    piece.empty = np.zeros(len(t))
    n = np.nan_to_num(triangle_normals(t))
    step = 1 + 10**6 // len(piece.hull.sides)
    for k in range(0, len(t), step):
        some = slice(k, k + step)
        points = np.concatenate([t[some], t[some].mean(axis=1, keepdims=True)], axis=1)
        piece.empty[some] = _exit_distance(piece.hull, points, n[some], ON_PLANE * size)


def _exit_distance(body: ConvexPolyhedron, points: np.ndarray, n: np.ndarray, thick: float) -> np.ndarray:
    """Distance (m,) from points (m, 4, 3) to the surface of a convex body along n (m, 3), largest of the four."""
    gap = np.maximum(body.offsets - points @ body.normals.T, 0.0)
    gap[gap < thick] = 0.0
    speed = n @ body.normals.T
    with np.errstate(divide="ignore", invalid="ignore"):
        time = np.where(speed[:, None] > 1e-9, gap / speed[:, None], np.inf).min(axis=2)
    return np.where(np.isfinite(time), time, 0.0).max(axis=1)


def _inner_corners(piece: _Piece, solid: np.ndarray, size: float) -> np.ndarray:
    """Corners of the region that are inside the solid."""
    x = region_corners(piece.planes, ON_PLANE * size)
    return x[winding_number(x, solid) > INSIDE_WINDING]


def _split(piece: _Piece, solid: np.ndarray, enough: float, size: float) -> list[_Piece]:
    """Split a piece along the best plane; empty list if no plane makes both halves smaller."""
    best: list[tuple[_Piece, np.ndarray]] = []
    whole = piece.hull.volume if piece.hull is not None else 0.0
    least = 2 * whole
    for plane in _cutting_planes(piece, enough, size):
        halves, rooms = [], []
        for side in (plane, -plane):
            half = _Piece(
                clip_triangles(piece.triangles, side, ON_PLANE * size), np.concatenate([piece.planes, side[None]])
            )
            halves.append((half, _inner_corners(half, solid, size)))
            rooms.append(
                _hull_volume(np.concatenate([half.triangles.reshape(-1, 3), halves[-1][1]]), SMALLEST_VOLUME * size**3)
            )
        if sum(rooms) < least * (1 - 1e-9) and max(rooms) < whole * (1 - 1e-6):
            best, least = halves, sum(rooms)
    for half, more in best:
        _update_hull(half, size, more)
    return [half for half, _ in best if half.hull is not None]


def _hull_volume(points: np.ndarray, least: float) -> float:
    """Volume of the convex hull of points; 0 if it has none."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        volume = float(ConvexHull(points).volume)
    except (QhullError, ValueError):
        return 0.0
    return volume if volume > least else 0.0


def _cutting_planes(piece: _Piece, enough: float, size: float) -> Iterator[np.ndarray]:
    """Candidate planes: of triangles, those with the thickest empty space first; then three through the middle."""
    n = triangle_normals(piece.triangles)
    c = np.einsum("ij,ij->i", n, piece.triangles[:, 0])
    order = np.argsort(-piece.empty, kind="stable")
    given: list[np.ndarray] = []
    for k in itertools.takewhile(lambda k: piece.empty[k] > 0.5 * min(enough, piece.beyond), order):
        plane = np.array([*n[k], c[k]])
        if np.isfinite(plane).all() and not any(_similar_planes(g, plane, size) for g in given):
            given.append(plane)
            yield plane
        if len(given) == MAX_PLANES:
            break
    middle = piece.triangles[order[0]].mean(axis=0)
    for axis in np.eye(3):
        yield np.array([*axis, axis @ middle])


def _similar_planes(a: np.ndarray, b: np.ndarray, size: float) -> bool:
    """Whether two planes are nearly the same."""
    cosine = a[:3] @ b[:3]
    return bool(abs(cosine) > 0.999 and abs(a[3] - np.sign(cosine) * b[3]) < 0.02 * size)
