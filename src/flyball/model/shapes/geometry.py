"""Geometry of shapes: collision geometry, triangulated surfaces, planar outlines, integrals over polyhedra."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...errors import ModelError

LENGTH_PARAMETERS = {
    "HULL": (0,),
    "FIELD": (2, 3),
    "SOLID": (7,),
}  # parameters that scale with the shape; of other kinds all do


@dataclass(frozen=True, eq=False)
class ConvexPart:
    """A convex part of a shape, of a kind defined (`collision/shape_kinds.py`).

    Attributes
    ----------
    kind : str
        ``"SPHERE"``, ``"BOX"``, ...; ``"MESH"`` is a closed surface, with triangles in ``face``, and ``"HULL"`` with
        one parameter the hull of ``vertex``: `tables/contact_tables.py` computes the hulls of these.
    par : tuple of float
        Parameters of its kind.
    reach : float
        Radius [m] of an enclosing sphere about its origin; inf if unbounded.
    place : (3,)
        Its origin [m] in the shape's own frame.
    axes : (3, 3)
        Its axes (columns) in the shape's own.
    vertex : (k, 3)
        Corners [m] in its own axes, if any, and other data of its kind.
    face : (l,)
        Faces, if any: count of corners, then the corners counter-clockwise seen from outside, and so on.
    corners : int
        Number of rows of ``vertex`` that are corners; all if not given. The others do not scale with the shape.
    sides : int
        Number of faces.
    owner : type
        The class of a ``"SOLID"``, which has its support function.
    """

    kind: str
    par: tuple[Any, ...]
    reach: Any
    place: np.ndarray = field(default_factory=lambda: np.zeros(3))
    axes: np.ndarray = field(default_factory=lambda: np.eye(3))
    vertex: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    face: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    corners: int | None = None
    sides: int = 0
    owner: type | None = None

    def transformed(self, p: np.ndarray, R: np.ndarray) -> ConvexPart:
        """Return the part in a frame in which the shape's own frame is at p with the axes R."""
        return replace(self, place=p + R @ self.place, axes=R @ self.axes)

    def grown(self, sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return parameters (n, k) and concatenated ``vertex`` of the part in n sizes."""
        par = np.tile(np.real(np.array(self.par, complex)), (len(sizes), 1))
        lengths = list(LENGTH_PARAMETERS.get(self.kind, range(len(self.par))))
        par[:, lengths] *= sizes[:, None]
        vertex = np.tile(np.asarray(self.vertex, float), (len(sizes), 1, 1))
        vertex[:, : self.corners] *= sizes[:, None, None]
        return par, vertex.reshape(-1, 3)


def surface_part(surface: tuple[np.ndarray, np.ndarray]) -> ConvexPart:
    """The part of a closed surface, vertices (k, 3) and triangles (m, 3), before decomposition into convex parts."""
    v, f = np.real(surface[0]), np.asarray(surface[1], np.int64)
    return ConvexPart("MESH", (), np.sqrt((v**2).sum(axis=1)).max(), vertex=v, face=f.ravel())


def lathe(profile: np.ndarray, fine: int, ring: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Rotate a profile about z.

    Parameters
    ----------
    profile : (k, 2)
        Points (r, z), with the solid to the left of their direction. It begins and ends on the axis (r = 0), or it is a
        ring: a closed curve off the axis.
    fine : int
        Number of corners of a circle.
    ring : bool

    Returns
    -------
    vertices : (m, 3)
    triangles : (l, 3)
    """
    turn = np.arange(fine) * (2 * np.pi / fine)
    r, z = np.asarray(profile, float).T
    xy = r[:, None, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    v = np.concatenate([xy, np.broadcast_to(z[:, None, None], (len(r), fine, 1))], axis=2).reshape(-1, 3)
    at = np.arange(len(r))[:, None] * fine + np.where((r == 0.0)[:, None], 0, np.arange(fine))
    low, high = (at, np.roll(at, -1, axis=0)) if ring else (at[:-1], at[1:])
    a, b, c, d = (x.ravel() for x in (low, np.roll(low, -1, axis=1), np.roll(high, -1, axis=1), high))
    return _used(v, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]))


def extrude(outline: np.ndarray, thickness: float) -> tuple[np.ndarray, np.ndarray]:
    """Extrude a simple polygon (k, 2), counter-clockwise, from z = -thickness / 2 to thickness / 2."""
    n = len(outline)
    z = np.full((n, 1), thickness / 2)
    v = np.concatenate([np.hstack([outline, -z]), np.hstack([outline, z])])
    cap = triangulated(outline)
    a, b = np.arange(n), np.roll(np.arange(n), -1)
    sides = np.concatenate([np.stack([a, b, b + n], axis=1), np.stack([a, b + n, a + n], axis=1)])
    return v, np.concatenate([cap[:, ::-1], cap + n, sides])


def arc(centre: tuple[float, float], radius: float, start: float, end: float, steps: int) -> np.ndarray:
    """Points (steps + 1, 2) on a circle from one angle [rad] to another, both included."""
    turn = np.linspace(start, end, steps + 1)
    return np.array(centre) + radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)


def snapped_to_axis(profile: np.ndarray) -> np.ndarray:
    """Return the profile with its ends exactly on the axis of rotation."""
    profile[[0, -1], 0] = 0.0
    return profile


def triangulated(p: np.ndarray) -> np.ndarray:
    """Triangulate a simple polygon (k, 2), counter-clockwise, by ear clipping (Meisters 1975): triangles (k - 2, 3)."""
    left = list(range(len(p)))
    out = []
    while len(left) > 3:
        k = next((k for k in range(len(left)) if _is_ear(p, left, k)), None)
        if k is None:  # no ear because of rounding: cut at the sharpest corner
            k = int(np.argmax([_turn(p, left, k) for k in range(len(left))]))
        out.append((left[k - 1], left[k], left[(k + 1) % len(left)]))
        left.pop(k)
    return np.array([*out, tuple(left)])


def planar_cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The z component of the cross product of vectors in the plane."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _turn(p: np.ndarray, remaining: list[int], k: int) -> float:
    a, b, c = p[remaining[k - 1]], p[remaining[k]], p[remaining[(k + 1) % len(remaining)]]
    return float(planar_cross(b - a, c - b))


def _is_ear(p: np.ndarray, remaining: list[int], k: int) -> bool:
    """Whether the corner turns left and no other point lies in the triangle that it makes with its neighbours."""
    corner = [remaining[k - 1], remaining[k], remaining[(k + 1) % len(remaining)]]
    a, b, c = p[corner]
    if _turn(p, remaining, k) < 0.0:
        return False
    q = p[[i for i in remaining if i not in corner]]
    inside = (planar_cross(b - a, q - a) >= 0) & (planar_cross(c - b, q - b) >= 0) & (planar_cross(a - c, q - c) >= 0)
    return not inside.any()


def _used(v: np.ndarray, f: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Remove triangles with repeated indices, and unused vertices."""
    f = f[(f[:, 0] != f[:, 1]) & (f[:, 1] != f[:, 2]) & (f[:, 2] != f[:, 0])]
    used, at = np.unique(f, return_inverse=True)
    return v[used], at.reshape(f.shape)


ALIGNMENT_TOLERANCE = 1e-9  # sine of the angle between directions that count as equal
OBLIQUE_REMEDY = (
    "it is oblique to the plane of the mechanism, so contact detection has no outline for it; turn it, or give it "
    "contact=False"
)


def polygon_outline(points: np.ndarray, rounding: Any = 0.0) -> ConvexPart:
    """Return the convex polygon around points (k, 2 or 3), seen along z, enlarged by ``rounding``; in their axes."""
    corners = convex_hull(np.asarray(points, float)[:, :2])
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    at = np.hstack([corners - middle, np.zeros((len(corners), 1))])
    reach = np.sqrt((at**2).sum(axis=1)).max() + rounding
    return ConvexPart("POLYGON", (rounding,), reach, np.array([*middle, 0.0]), vertex=at)


def circle_outline(radius: Any, p: np.ndarray) -> ConvexPart:
    """Return a circle about p, seen along z."""
    return ConvexPart("SPHERE", (radius,), radius, np.array([p[0], p[1], 0.0]))


def revolved_outline(
    what: Any, p: np.ndarray, R: np.ndarray, radius: Any, profile: list[tuple[Any, Any]]
) -> ConvexPart:
    """The outline of a solid of revolution: a circle along its axis, the points (r, z) and (-r, z) from the side.

    Raises
    ------
    ModelError
        If its axis is oblique to the plane of the mechanism.
    """
    if np.hypot(*R[:2, 2]) < ALIGNMENT_TOLERANCE:
        return circle_outline(radius, p)
    if not abs(R[2, 2]) < ALIGNMENT_TOLERANCE:
        raise ModelError(f"{what.title}: {OBLIQUE_REMEDY}")
    z = R[:2, 2]
    x = np.array([-z[1], z[0]])
    return polygon_outline(np.array([p[:2] + r * x * side + h * z for r, h in profile for side in (-1.0, 1.0)]))


def convex_hull(p: np.ndarray) -> np.ndarray:
    """Corners (k, 2) of the convex hull of points in the plane, counter-clockwise (Andrew 1979)."""
    p = np.unique(p, axis=0)  # sorted
    size = np.ptp(p, axis=0).max() if len(p) else 0.0
    chains = []
    for way in (p, p[::-1]):
        chain: list[np.ndarray] = []
        for x in way:
            while len(chain) > 1 and planar_cross(chain[-1] - chain[-2], x - chain[-1]) <= 1e-12 * size**2:
                chain.pop()
            chain.append(x)
        chains.append(chain[:-1])
    return np.array([*chains[0], *chains[1]]) if len(p) > 1 else p


ZERO_TOLERANCE = 1e-12  # a volume smaller than this part of the bounding box's counts as zero


@dataclass(frozen=True)
class Integrals:
    """Volume [m^3], centre [m] and inertia per unit mass about it [m^2] of a homogeneous polyhedron."""

    volume: float
    centre: np.ndarray
    gyration: np.ndarray


def polyhedron_integrals(v: np.ndarray, f: np.ndarray) -> Integrals:
    """Return the integrals over the inside of a closed surface, exact up to rounding.

    They are signed sums over the tetrahedra formed by the triangles and one point: with corners 0, a, b, c and s = a +
    b + c its volume is V = a . (b x c) / 6, its first moment V s / 4, its second moment V (a a + b b + c c + s s) / 20.

    Parameters
    ----------
    v : (k, 3)
        Vertices.
    f : (m, 3)
        Triangles, counter-clockwise seen from outside.
    """
    middle = v.mean(axis=0)  # close to the solid, to reduce cancellation
    corners = (v - middle)[f]
    a, b, c = corners.transpose(1, 0, 2)
    V = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6
    volume = V.sum()
    s = a + b + c
    first = V @ s / (4 * volume)
    second = sum(np.einsum("k,ki,kj->ij", V, x, x) for x in (a, b, c, s)) / (20 * volume) - np.outer(first, first)
    return Integrals(volume, middle + first, np.trace(second) * np.eye(3) - second)


def weld_vertices(v: np.ndarray, f: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Merge vertices at the same place, and remove triangles with repeated indices."""
    order = np.lexsort(v.T)  # np.unique by rows takes ten times as long
    new = np.ones(len(v), bool)
    new[1:] = (np.diff(v[order], axis=0) != 0.0).any(axis=1)
    at = np.empty(len(v), int)
    at[order] = np.cumsum(new) - 1
    v, f = v[order[new]], at[f]
    return v, f[(f[:, 0] != f[:, 1]) & (f[:, 1] != f[:, 2]) & (f[:, 2] != f[:, 0])]


def surface_defects(v: np.ndarray, f: np.ndarray) -> str:
    """Return why a (welded) surface does not enclose a volume, as a sentence with numbers; empty if it does."""
    if not len(f):
        return "it has no triangles"
    open_edges, twisted = _edges(f)
    if open_edges:
        return (
            f"it is not closed: {open_edges} of its edges have a triangle on one side only. Close its holes and merge "
            f"vertices that should be one in the program that made it"
        )
    if twisted:
        return (
            f"its triangles do not all face outwards: at {twisted} edges two neighbours are oriented differently. "
            "Make its normals consistent in the program that made it"
        )
    return _inside_out(v, f)


def _edges(f: np.ndarray) -> tuple[int, int]:
    """Return edges with an odd number of triangles, and edges not traversed equally often in both directions."""
    ways = np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]])
    up = np.where(ways[:, 0] < ways[:, 1], 1, -1)
    edge = ways.min(axis=1) * (f.max() + 1) + ways.max(axis=1)
    _, at = np.unique(edge, return_inverse=True)
    count, sense = np.bincount(at), np.bincount(at, weights=up)
    odd = count % 2 == 1
    return int(odd.sum()), int(((sense != 0) & ~odd).sum())


def _inside_out(v: np.ndarray, f: np.ndarray) -> str:
    """Return parts that face inwards without being cavities of another part; or a zero volume."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    pairs = np.concatenate([f[:, [0, 1]], f[:, [1, 2]]])
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(v), len(v)))
    _, part = np.unique(connected_components(graph, directed=False)[1][f[:, 0]], return_inverse=True)
    corners = (v - v.mean(axis=0))[f]
    a, b, c = corners.transpose(1, 0, 2)
    volumes = np.bincount(part, weights=np.einsum("ij,ij->i", a, np.cross(b, c)) / 6)
    low, high = np.full((len(volumes), 3), np.inf), np.full((len(volumes), 3), -np.inf)
    np.minimum.at(low, part, corners.min(axis=1))
    np.maximum.at(high, part, corners.max(axis=1))
    if not abs(volumes.sum()) > ZERO_TOLERANCE * np.prod(high.max(axis=0) - low.min(axis=0)):
        return "it encloses no volume. Give it a thickness"
    for k in np.flatnonzero(volumes < 0):
        if not ((volumes > 0) & (low <= low[k]).all(axis=1) & (high >= high[k]).all(axis=1)).any():
            return (
                f"triangles of it face inwards (the volume of a part is {volumes[k]:.3g}). Flip the normals of these "
                "faces in the program that made it"
            )
    return ""
