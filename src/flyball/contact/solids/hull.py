"""The convex hull of points, its coplanar triangles made into sides."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...errors import ModelError

SAME = 1e-9  # of the size: sides whose planes differ by less are one
FLAT = 1e-9  # of the size: thinner is no solid
CLIMB = 40  # vertices from which on the farthest one is found along the edges rather than among all


@dataclass(frozen=True, eq=False)
class Hull:
    """A convex polyhedron: vertices (k, 3) [m], outward unit normals (m, 3), and corners of each side.

    Corners are numbers of vertices, counter-clockwise seen from outside.
    """

    vertices: np.ndarray
    normals: np.ndarray
    sides: tuple[tuple[int, ...], ...]

    @cached_property
    def offsets(self) -> np.ndarray:
        """Of the planes of the sides, from the origin."""
        first = self.vertices[[s[0] for s in self.sides]]
        return np.einsum("ij,ij->i", self.normals, first)

    def outside(self, points: Any) -> np.ndarray:
        """How far points are beyond the plane that they are farthest beyond; less than zero inside."""
        return np.max(np.asarray(points) @ self.normals.T - self.offsets, axis=1)

    @cached_property
    def volume(self) -> float:
        """By Gauss's theorem."""
        fans = [(s[0], a, b) for s in self.sides for a, b in itertools.pairwise(s[1:])]
        a, b, c = self.vertices[np.array(fans).T] - self.vertices.mean(axis=0)
        return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6

    @property
    def rows(self) -> np.ndarray:
        """For `Geometry.vertex`: vertices, then normals."""
        return np.concatenate([self.vertices, self.normals])

    def table(self, at: int) -> tuple[np.ndarray, int]:
        """For `Geometry.face` from place ``at`` on: sides, then edges; where the edges begin, -1 if there are none."""
        sides = [x for s in self.sides for x in (len(s), *s)]
        if len(self.vertices) < CLIMB:
            return np.array(sides, dtype=np.int64), -1
        return np.array([*sides, *self._edges()], dtype=np.int64), at + len(sides)

    def _edges(self) -> list[int]:
        """Six vertices to begin at, where the neighbours of each begin, and those, each list closed by -1."""
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


def hull(points: Any) -> Hull:
    """The convex hull of points (k, 3) [m].

    Raises
    ------
    ModelError
        If they are fewer than four, lie in a plane (within 1e-9 of their size), or are no finite numbers.
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
    if width < FLAT:
        raise ModelError(thin)
    new = np.full(len(x), -1)
    new[found.vertices] = np.arange(len(found.vertices))
    normals, sides = _sides(found, scaled, new)
    used = np.unique(np.concatenate([np.array(s) for s in sides]))
    new = np.full(len(scaled), -1)
    new[used] = np.arange(len(used))
    renamed = tuple(tuple(int(new[k]) for k in s) for s in sides)
    return Hull(x[found.vertices][used], normals, renamed)


def _sides(found: Any, points: np.ndarray, new: np.ndarray) -> tuple[np.ndarray, list[list[int]]]:
    """Unit normals and corners of the sides: neighbouring triangles whose planes are the same are one."""
    planes, member = found.equations, np.full(len(found.equations), -1)
    normals: list[np.ndarray] = []
    sides: list[list[int]] = []
    for k in range(len(planes)):
        if member[k] >= 0:
            continue
        member[k], left, all_of_it = len(sides), [k], [k]
        while left:
            for m in found.neighbors[left.pop()]:
                if member[m] < 0 and np.abs(planes[m] - planes[k]).max() < SAME:
                    member[m] = len(sides)
                    left.append(m)
                    all_of_it.append(m)
        normals.append(planes[k, :3])
        sides.append(_around(points, np.unique(new[found.simplices[all_of_it]]), planes[k, :3]))
    return np.array(normals), sides


def _around(points: np.ndarray, corners: np.ndarray, n: np.ndarray) -> list[int]:
    """The corners in order, counter-clockwise about n, those left out that are on a line between their neighbours."""
    x = points[corners]
    u = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    v = np.cross(n, u)
    x = x - x.mean(axis=0)
    around = corners[np.argsort(np.arctan2(x @ v, x @ u), kind="stable")]
    kept = []
    for k, c in enumerate(around):
        a, b = points[around[k - 1]] - points[c], points[around[(k + 1) % len(around)]] - points[c]
        if np.linalg.norm(np.cross(a, b)) > SAME * np.linalg.norm(a) * np.linalg.norm(b):
            kept.append(int(c))
    return kept
