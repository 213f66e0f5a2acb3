"""Convex hulls in the tables: sides, edges, and the farthest vertex found along them."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from flyball.collision.convex_decomposition import EDGE_SEARCH_VERTICES, convex_hull
from flyball.collision.narrow_phase.primitives import MAX_CORNERS
from flyball.collision.shape_kinds import HULL
from flyball.collision.shapes.hull import face, support
from flyball.collision.tables import Dimensions, Geometry, Shapes
from flyball.errors import ModelError
from tests.compiled import compiled

CUBE = np.array(list(itertools.product((-1, 1), repeat=3)), dtype=float)


def table(h, radius=0.0):
    at, x = Shapes.blank(1), Dimensions.blank(1)
    at.kind[0], at.count[0], at.face_count[0] = HULL, len(h.vertices), len(h.sides)
    faces, x.par[0, 1] = h.table(0)
    x.par[0, 0] = radius
    return Geometry(at, x, h.rows, faces, np.zeros((0, 2), dtype=np.int64))


def _ask(G, d, out, room):
    g = G
    for k in range(d.shape[0]):
        x = support(g, 0, (d[k, 0], d[k, 1], d[k, 2]))
        n, _ = face(g, 0, (d[k, 0], d[k, 1], d[k, 2]), room, 0)
        out[k, 0] = n
        for c in range(3):
            out[k, 1 + c] = x[c]
            out[k, 4 + c] = 0.0
            for s in range(n):
                out[k, 4 + c] += room[s, c] / n
        out[k, 7] = -1.0
        for s in range(n):
            if abs(room[s, 0] - x[0]) + abs(room[s, 1] - x[1]) + abs(room[s, 2] - x[2]) == 0.0:
                out[k, 7] = s
    return 0


ask = compiled(_ask)


def asked(h, d):
    d = np.array(d, dtype=float)
    out = np.zeros((len(d), 8))
    ask(table(h), d, out, np.zeros((MAX_CORNERS, 8)))
    return out


def test_a_cube_has_six_sides_whatever_points_lie_on_it():
    more = np.random.default_rng(0).uniform(-1, 1, (40, 3))
    more[:20, 0] = 1
    middles = [[0, 1, 1], [0, 0, 1]]
    h = convex_hull(np.concatenate([CUBE * 1.0, more, middles]))
    assert len(h.vertices) == 8
    assert sorted(map(len, h.sides)) == [4] * 6
    assert h.volume == pytest.approx(8)
    for n, s in zip(h.normals, h.sides, strict=True):
        x = h.vertices[list(s)]
        np.testing.assert_allclose(np.cross(x[1] - x[0], x[2] - x[1]), 4 * n, atol=1e-12)


@pytest.mark.parametrize("count", [8, 30, EDGE_SEARCH_VERTICES + 5, 500])
def test_the_farthest_vertex_of_small_and_large_ones(count):
    rng = np.random.default_rng(count)
    x = rng.normal(size=(count, 3))
    h = convex_hull(x / np.linalg.norm(x, axis=1)[:, None] * (1, 2, 0.5))
    d = np.concatenate([rng.normal(size=(300, 3)), np.eye(3), -np.eye(3), h.normals])
    found = asked(h, d)
    np.testing.assert_allclose(np.einsum("ij,ij->i", found[:, 1:4], d), np.max(d @ h.vertices.T, axis=1), atol=1e-12)
    assert (found[:, 7] >= 0).all()  # the farthest vertex is among the corners of the side
    own = found[306:]
    middle = np.array([h.vertices[list(s)].mean(axis=0) for s in h.sides])
    np.testing.assert_allclose(own[:, 4:7], middle, atol=1e-12)


def test_a_side_with_many_corners_is_given_by_as_many_as_there_is_room_for():
    a = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    ring = np.stack([np.cos(a), np.sin(a), 0 * a], axis=1)
    h = convex_hull(np.concatenate([ring, ring + (0, 0, 1)]))
    assert len(h.sides) == 202
    found = asked(h, [(1e-3, 2e-3, 1)])[0]
    assert found[0] == MAX_CORNERS
    assert found[7] >= 0
    np.testing.assert_allclose(found[4:7], [0, 0, 1], atol=0.01)


def test_volume_is_that_of_the_points_hull():
    from scipy.spatial import ConvexHull

    x = np.random.default_rng(1).normal(size=(100, 3)) + 7
    assert convex_hull(x).volume == pytest.approx(ConvexHull(x).volume, rel=1e-12)


@pytest.mark.parametrize(
    "points", [CUBE[:3], CUBE * (1, 1, 0), CUBE * 0, CUBE * (1, 1, 1e-11), CUBE * np.nan, CUBE[:, :2], CUBE * (0, 0, 1)]
)
def test_points_without_a_hull_are_refused(points):
    with pytest.raises(ModelError, match="a convex hull takes"):
        convex_hull(points)


def test_size_and_place_do_not_matter():
    for size, at in ((1e-6, 0), (1e6, 0), (1, 1000)):
        assert len(convex_hull(CUBE * size + at).sides) == 6
