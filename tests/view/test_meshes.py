"""Meshes made small keep their form."""

from __future__ import annotations

import numpy as np
import pytest

from flyball.view.body_shapes import simplify_mesh


def box(n: int, edges: tuple[float, float, float] = (2.0, 1.0, 0.5)) -> tuple[np.ndarray, np.ndarray]:
    """A box of 12 n^2 triangles, each face a grid of its own, all seen from outside."""
    s, t = np.meshgrid(np.linspace(-1, 1, n + 1), np.linspace(-1, 1, n + 1), indexing="ij")
    k = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = k[:-1, :-1], k[1:, :-1], k[:-1, 1:], k[1:, 1:]
    face = np.concatenate([np.stack(x, -1).reshape(-1, 3) for x in ((a, b, c), (c, b, d))])
    points, triangles = [], []
    for axis in range(3):
        for side in (-1.0, 1.0):
            p = np.stack([np.full(s.size, side), s.ravel(), t.ravel()], 1)
            triangles.append((face if side > 0 else face[:, ::-1]) + len(points) * s.size)
            points.append(np.roll(p, axis, axis=1) * edges / 2)
    return np.concatenate(points), np.concatenate(triangles)


def volume(vertices: np.ndarray, triangles: np.ndarray) -> float:
    """Of a closed mesh, by the divergence theorem; positive if its faces are seen from outside."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def test_a_small_mesh_keeps_its_form_and_loses_what_is_double() -> None:
    v, t = box(4)
    points, triangles = simplify_mesh(v, t, 1000)
    assert len(triangles) == len(t) == 192
    assert len(points) == 98  # corners, edges and faces of the grids, shared: 6 * 25 - 12 * 5 + 8
    assert volume(points, triangles) == pytest.approx(1.0)


def test_a_large_mesh_becomes_small_and_keeps_volume_edges_and_orientation() -> None:
    v, t = box(60)
    points, triangles = simplify_mesh(v, t, 2000)
    assert 200 < len(triangles) <= 2000
    assert volume(points, triangles) == pytest.approx(1.0, rel=0.01)
    # the planes of the faces draw points to edges and corners: no rounding off
    assert np.allclose(points.max(0), [1.0, 0.5, 0.25], atol=1e-9)
    assert np.allclose(points.min(0), [-1.0, -0.5, -0.25], atol=1e-9)
    corners = np.abs(np.abs(points) - [1.0, 0.5, 0.25]).max(axis=1)
    assert (corners < 1e-9).sum() == 8


def test_only_what_is_used_is_kept_and_empty_triangles_go() -> None:
    v = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5], [0, 0, 0]], float)
    points, triangles = simplify_mesh(v, np.array([[0, 1, 2], [0, 4, 1], [2, 0, 1], [1, 2, 2]]), 10)
    assert len(points) == 3
    assert len(triangles) == 1
    assert np.allclose(np.cross(*(points[triangles[0, k]] - points[triangles[0, 0]] for k in (1, 2))), [0, 0, 1])
