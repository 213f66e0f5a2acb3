"""What of a solid is seen from one side: polygons, and how light they are."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..model.geometry import quaternion_to_matrix
from .meshes import simplified
from .recording import Shape

ROUND = 40  # points of a circle
TRIANGLES = 300  # of a mesh
LIGHT = np.array([-0.35, 0.75, 0.56])  # towards the light, as seen
BARE, RIMMED = 0.4, 1.2  # width of an edge [px]


class Face(NamedTuple):
    """A polygon as seen: points (k, 3), lighter (to 1) or darker (to -1), nearer than its middle [m], its edge [px]."""

    points: np.ndarray
    light: float = 0.0
    nearer: float = 0.0
    rim: float = RIMMED


def circle(radius: float, at: float = 0.0) -> np.ndarray:
    """Points of a circle about z, at a height."""
    turn = np.linspace(0.0, 2.0 * np.pi, ROUND, endpoint=False)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), np.full(ROUND, at)])


def hull(points: np.ndarray) -> np.ndarray:
    """The convex polygon around points of the plane (A. M. Andrew's monotone chain, 1979)."""
    ordered = sorted(set(map(tuple, np.round(points, 12).tolist())))
    half: list[list[tuple[float, ...]]] = []
    for run in (ordered, ordered[::-1]):
        out: list[tuple[float, ...]] = []
        for p in run:
            while len(out) > 1 and _left(out[-2], out[-1], p) <= 0.0:
                out.pop()
            out.append(p)
        half.append(out[:-1])
    return np.array(half[0] + half[1] or ordered[:1])


def _left(a: tuple[float, ...], b: tuple[float, ...], c: tuple[float, ...]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def faces(shape: Shape, view: np.ndarray) -> Iterator[Face]:
    """What is seen of a shape on a body whose axes, as seen, are the columns of ``view``; from the body's origin."""
    turn = view @ quaternion_to_matrix(np.array(shape.quaternion))
    at = view @ np.array(shape.position)
    for f in _own(shape, turn):
        yield f._replace(points=f.points + at)


def _own(shape: Shape, turn: np.ndarray) -> Iterator[Face]:
    if shape.kind == "box":
        yield from _box(np.array(shape.size) / 2, turn)
    elif shape.kind in ("mesh", "plate"):
        yield from _plate(shape, turn) if shape.kind == "plate" else _mesh(shape, turn)
    elif shape.kind in ("sphere", "ellipsoid"):
        half = np.array(shape.size if shape.kind == "ellipsoid" else shape.size * 3)
        up = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 15)
        rings = [circle(np.cos(u), np.sin(u)) for u in up]
        yield _silhouette(np.concatenate(rings) * half @ turn.T)
    elif shape.kind == "capsule":
        radius, length = shape.size
        ends = np.array([[0.0, 0.0, -length / 2], [0.0, 0.0, length / 2]]) @ turn.T
        yield _silhouette(np.concatenate([circle(radius) + end for end in ends]))
    elif shape.kind in ("cylinder", "cone"):
        yield from _turned(shape, turn)


def _silhouette(points: np.ndarray, light: float = 0.0) -> Face:
    outline = hull(points[:, :2])
    return Face(np.column_stack([outline, np.full(len(outline), points[:, 2].mean())]), light)


def _lightness(normal: np.ndarray) -> float:
    return float(np.clip(0.45 * (normal @ LIGHT), -0.35, 0.45))


def _box(half: np.ndarray, turn: np.ndarray) -> Iterator[Face]:
    for axis in range(3):
        for side in (-1.0, 1.0):
            normal = side * turn[:, axis]
            if normal[2] > 1e-9:
                i, j = (k for k in range(3) if k != axis)
                corners = np.zeros((4, 3))
                corners[:, axis] = side * half[axis]
                corners[:, i], corners[:, j] = half[i] * np.array([1, -1, -1, 1]), half[j] * np.array([1, 1, -1, -1])
                flat = abs(normal[2] - 1.0) < 1e-9  # seen from the front: nothing else is
                yield Face(corners @ turn.T, 0.0 if flat else _lightness(normal))


def _turned(shape: Shape, turn: np.ndarray) -> Iterator[Face]:
    """A cylinder or a cone: its outline, and the cap that is towards the eye."""
    radius, length = shape.size
    low, high = circle(radius, -length / 2), circle(radius, length / 2)
    tip = high if shape.kind == "cylinder" else np.array([[0.0, 0.0, length / 2]])
    yield _silhouette(np.concatenate([low, tip]) @ turn.T)
    toward = turn[2, 2]
    for cap, side in ((low, -1.0), (high, 1.0)):
        if side * toward > 1e-6 and (side < 0.0 or shape.kind == "cylinder") and abs(toward) < 1.0 - 1e-9:
            yield Face(cap @ turn.T, 0.3, length)


def _plate(shape: Shape, turn: np.ndarray) -> Iterator[Face]:
    thick = shape.size[0] if shape.size else 0.0
    flat = np.array(shape.outline)
    both = [np.column_stack([flat, np.full(len(flat), z)]) @ turn.T for z in (-thick / 2, thick / 2)]
    toward = turn[2, 2]
    if abs(toward) > 1.0 - 1e-9:
        yield Face(both[1])
        return
    yield _silhouette(np.concatenate(both), -0.15)
    yield Face(both[int(toward > 0.0)], 0.15, thick)


def _mesh(shape: Shape, turn: np.ndarray) -> Iterator[Face]:
    assert shape.vertices is not None
    v, triangles = simplified(np.asarray(shape.vertices), np.asarray(shape.triangles), TRIANGLES)
    corners = (v @ turn.T)[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sizes = np.sqrt((normals**2).sum(axis=1))
    for points, normal, size in zip(corners, normals, sizes, strict=True):
        if normal[2] > 0.0:
            yield Face(points, _lightness(normal / size), rim=BARE)
