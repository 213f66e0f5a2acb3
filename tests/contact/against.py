"""Random pairs of bounded convex shapes, and a library (coal) that says how far apart they are.

Supports are written once more in NumPy here: a direction along which these say that shapes are apart by s proves that
the separation is s or more, whoever found it.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from flyball.collision.convex_decomposition import ConvexPolyhedron, convex_hull
from flyball.collision.shape_kinds import BOX, CAPSULE, CONE, CYLINDER, ELLIPSOID, HULL, SPHERE
from flyball.collision.tables import (
    Dimensions,
    Geometry,
    Shapes,
)
from tests.contact.pairs import separations

NAMES = {
    SPHERE: "sphere",
    BOX: "box",
    CAPSULE: "capsule",
    CYLINDER: "cylinder",
    CONE: "cone",
    HULL: "hull",
    ELLIPSOID: "ellipsoid",
}
PAIRS = tuple(itertools.combinations_with_replacement(NAMES, 2))
MODES = ("apart", "deep", "grazing", "degenerate")
GRAZE = 1e-6  # [m]
ROUND = {SPHERE, CAPSULE}


@dataclass
class Some:
    """A shape: its kind, parameters, and hull if it is one."""

    kind: int
    par: np.ndarray
    hull: ConvexPolyhedron | None = None

    @property
    def rounding(self) -> float:
        return float(self.par[0]) if self.kind in ROUND else 0.0

    def top(self, d):
        """Greatest d . x over the shape, rounding included, for a unit vector d in its axes."""
        a = self.par
        across = np.hypot(d[0], d[1])
        if self.kind == SPHERE:
            return a[0]
        if self.kind == BOX:
            return np.abs(d) @ a[:3]
        if self.kind == CAPSULE:
            return a[0] + a[1] * abs(d[2])
        if self.kind == CYLINDER:
            return a[0] * across + a[1] * abs(d[2])
        if self.kind == CONE:
            return max(a[0] * across, a[1] * d[2])
        if self.kind == ELLIPSOID:
            return np.linalg.norm(a[:3] * d)
        return np.max(self.hull.vertices @ d)

    @cached_property
    def coal(self):
        """The same for coal, whose cone has its origin at half its height."""
        import coal

        a = [float(x) for x in self.par]
        if self.kind == HULL:
            points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
            for x in self.hull.vertices:
                points.append(x)
            for s in self.hull.sides:
                for b, c in itertools.pairwise(s[1:]):
                    triangles.append(coal.Triangle(s[0], b, c))
            return coal.Convex(points, triangles)
        return {
            SPHERE: lambda: coal.Sphere(a[0]),
            BOX: lambda: coal.Box(2 * a[0], 2 * a[1], 2 * a[2]),
            CAPSULE: lambda: coal.Capsule(a[0], 2 * a[1]),
            CYLINDER: lambda: coal.Cylinder(a[0], 2 * a[1]),
            CONE: lambda: coal.Cone(a[0], a[1]),
            ELLIPSOID: lambda: coal.Ellipsoid(a[0], a[1], a[2]),
        }[self.kind]()


def some(kind, rng):
    """A random shape about half a metre in size."""
    if kind == HULL:
        return Some(
            kind, np.zeros(3), convex_hull(rng.normal(size=(rng.integers(8, 21), 3)) * rng.uniform(0.1, 0.5, 3))
        )
    return Some(kind, rng.uniform(0.15, 0.6, 3))


@lru_cache
def pool(kind, seed=0, count=60):
    """Shapes to draw pairs from."""
    rng = np.random.default_rng((kind, seed))
    return [some(kind, rng) for _ in range(count)]


def rotation(rng):
    w, x, y, z = (q := rng.normal(size=4)) / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def tables(shapes):
    """The shapes as `Geometry`, each on a mover of its own."""
    n = len(shapes)
    at, x = Shapes.blank(n), Dimensions.blank(n)
    rows, faces = [np.zeros((0, 3))], [np.zeros(0, dtype=np.int64)]
    first = place = 0
    for k, s in enumerate(shapes):
        at.kind[k], at.mover[k] = s.kind, k
        x.axes[k] = np.eye(3).ravel()
        x.par[k, :3] = s.par
        x.radius[k] = np.linalg.norm(s.par)
        if s.hull is not None:
            table, x.par[k, 1] = s.hull.table(place)
            at.first[k], at.count[k], at.face_first[k], at.face_count[k] = (
                first,
                len(s.hull.vertices),
                place,
                len(s.hull.sides),
            )
            x.radius[k] = np.max(np.linalg.norm(s.hull.vertices, axis=1))
            rows.append(s.hull.rows)
            faces.append(table)
            first, place = first + len(s.hull.rows), place + len(table)
    return Geometry(at, x, np.concatenate(rows), np.concatenate(faces), np.zeros((0, 2), dtype=np.int64))


def poses(count, mode, rng):
    """Poses (2 count, 12): positions and rotations."""
    out = np.zeros((2 * count, 12))
    for row in out:
        if mode == "degenerate":  # parallel, in line or one upon the other
            row[:3] = np.round(rng.normal(size=3), 1) * rng.integers(0, 2, 3) * 0.5
            row[3:] = np.eye(3)[rng.permutation(3)].ravel() if rng.integers(0, 2) else np.eye(3).ravel()
            row[3:6] *= np.linalg.det(row[3:].reshape(3, 3))
        else:
            row[:3] = rng.normal(size=3) * (0.12 if mode == "deep" else 0.8)
            row[3:] = rotation(rng).ravel()
    return out


@dataclass
class Sample:
    """Pairs of two kinds with what both say: separations [m], and directions from 1 to 2."""

    shapes: list
    pose: np.ndarray
    geometry: Geometry
    ours: np.ndarray
    normal: np.ndarray
    core: np.ndarray


def sample(a, b, count, mode, seed=0):
    """Random pairs of shapes of kinds a and b, and what flyball says of them."""
    rng = np.random.default_rng((a, b, MODES.index(mode), seed))
    shapes = [pool(k)[rng.integers(60)] for _ in range(count) for k in (a, b)]
    G, pose = tables(shapes), poses(count, mode, rng)
    r = np.array([s.rounding for s in shapes]).reshape(-1, 2).sum(axis=1)
    found = separations(G, pose)
    if mode == "grazing":
        gap = rng.uniform(-GRAZE, GRAZE, count)
        pose[1::2, :3] -= ((found[:, 0] - r) - gap)[:, None] * found[:, 1:4]
        found = separations(G, pose)
    return Sample(shapes, pose, G, found[:, 0] - r, found[:, 1:4], found)


def along(sample, k, n):
    """Separation of pair k along a unit vector n, by the supports written here: a bound from below."""
    a, b = sample.shapes[2 * k], sample.shapes[2 * k + 1]
    p, q = sample.pose[2 * k], sample.pose[2 * k + 1]
    R, S = p[3:].reshape(3, 3), q[3:].reshape(3, 3)
    return n @ (q[:3] - p[:3]) - a.top(R.T @ n) - b.top(-(S.T @ n))


def asked(sample):
    """Separations and normals (from 1 to 2) that coal says, as exactly as it can be asked."""
    import coal

    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.enable_signed_distance = True
    request.gjk_tolerance = request.epa_tolerance = 1e-9
    request.gjk_max_iterations = request.epa_max_iterations = 1000
    at = [coal.Transform3s(), coal.Transform3s()]
    out = np.zeros((len(sample.ours), 4))
    for k in range(len(sample.ours)):
        pair = []
        for side in (0, 1):
            s, row = sample.shapes[2 * k + side], sample.pose[2 * k + side]
            R = row[3:].reshape(3, 3)
            at[side].setRotation(R)
            at[side].setTranslation(row[:3] + (R[:, 2] * s.par[1] / 2 if s.kind == CONE else 0))
            pair.append(s.coal)
        result.clear()
        out[k, 0] = coal.distance(pair[0], at[0], pair[1], at[1], request, result)
        out[k, 1:] = result.normal
    return out


@dataclass
class Verdict:
    """Of the pairs of one kind: how many, largest difference where both agree, who was refuted."""

    count: int
    difference: float
    unproved: float
    wrong: list
    refuted: list


def judged(sample, reference, tolerance):
    """Compare; where they differ by more than the tolerance, decide by directions.

    A direction that separates more than the other says refutes the other. ``unproved`` is by how much our own direction
    separates less than we say.
    """
    proved = np.array([along(sample, k, n) for k, n in enumerate(sample.normal)])
    difference = np.abs(sample.ours - reference[:, 0])
    wrong, refuted = [], []
    for k in np.flatnonzero(~(difference <= tolerance)):
        better = reference[k, 0] > sample.ours[k] and along(sample, k, reference[k, 1:]) > sample.ours[k] + tolerance
        (wrong if better else refuted).append(int(k))
    agreed = difference[difference <= tolerance]
    return Verdict(len(proved), float(agreed.max(initial=0)), float(np.max(sample.ours - proved)), wrong, refuted)
