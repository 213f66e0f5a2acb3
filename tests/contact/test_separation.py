"""Distance and depth of convex cores, proved by both bounds: points of the shapes, and a direction that separates."""

from __future__ import annotations

import numpy as np
import pytest

from flyball.collision.shape_kinds import BOX, ELLIPSOID, HEMISPHERE, HULL, SPHERE
from tests.contact.pairs import separations
from tests.contact.scenes import geometry, turned

I = np.eye(3)
TETRAHEDRON = np.array([[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1.0]])


def hull(vertices):
    return (HULL, [0.0, -1.0], vertices)


def apart(a, b, p, R=I, Q=I):
    pose = np.array([[0, 0, 0, *np.ravel(R)], [*p, *np.ravel(Q)]], dtype=float)
    return separations(geometry(a, b), pose)[0]


def random_rotation(rng):
    return turned(rng.normal(size=3), rng.uniform(0, 3))


def farthest(shape, d):
    """Greatest n . x of a shape about its own axes."""
    kind, par, *more = shape
    if kind == HULL:
        return np.max(more[0] @ d)
    if kind == HEMISPHERE:
        return par[0] * (1 if d[2] > 0 else np.hypot(d[0], d[1]))
    return {SPHERE: 0.0, BOX: np.abs(d) @ par, ELLIPSOID: np.linalg.norm(par * d)}[kind]


def outside(shape, x):
    """How far a point is outside a shape, in the units of its size, from below; 0 on the surface."""
    kind, par, *more = shape
    if kind == HULL:
        from scipy.spatial import ConvexHull

        e = ConvexHull(more[0]).equations
        return np.max(e[:, :3] @ x + e[:, 3])
    if kind == BOX:
        return np.max(np.abs(x) - par)
    if kind == HEMISPHERE:
        return max(np.linalg.norm(x) - par[0], -x[2])
    return np.linalg.norm(x / par) - 1 if kind == ELLIPSOID else np.linalg.norm(x)


def some(kind, rng):
    if kind == HULL:
        return hull(rng.normal(size=(rng.integers(6, 20), 3)) * rng.uniform(0.2, 0.5, 3))
    return (kind, rng.uniform(0.1, 0.7, 3))


@pytest.mark.parametrize("a", [BOX, ELLIPSOID, HULL, SPHERE])
@pytest.mark.parametrize("b", [BOX, ELLIPSOID, HULL, HEMISPHERE])
def test_distance_is_proved_from_both_sides(a, b):
    """The points found belong to the shapes; the direction found holds the shapes apart by as much as the points are."""
    rng = np.random.default_rng(4)
    shapes = [some(k, rng) for _ in range(60) for k in (a, b)]
    pose = np.array([[*rng.normal(size=3), *random_rotation(rng).ravel()] for _ in shapes])
    found = separations(geometry(*shapes), pose)
    assert np.isfinite(found).all()
    n = found[:, 1:4]
    np.testing.assert_allclose(np.linalg.norm(n, axis=1), 1, rtol=1e-14)
    for k, row in enumerate(found):
        for side, x, sign in ((2 * k, row[4:7], 1), (2 * k + 1, row[7:], -1)):
            R = pose[side, 3:].reshape(3, 3)
            local = R.T @ (x - pose[side, :3])
            assert abs(outside(shapes[side], local)) < 3e-7 or shapes[side][0] == SPHERE
            top = farthest(shapes[side], sign * R.T @ row[1:4])
            assert sign * row[1:4] @ (x - pose[side, :3]) == pytest.approx(top, abs=2e-9)


def test_depth_of_random_hulls_is_that_of_the_nearest_side_of_their_difference():
    from scipy.spatial import ConvexHull

    rng = np.random.default_rng(5)
    shapes = [some(HULL, rng) for _ in range(200)]
    pose = np.array([[*rng.normal(size=3) * 0.3, *random_rotation(rng).ravel()] for _ in shapes])
    found = separations(geometry(*shapes), pose)[:, 0]
    x = [s[2] @ p[3:].reshape(3, 3).T + p[:3] for s, p in zip(shapes, pose, strict=True)]
    exact = [ConvexHull((a[:, None] - b[None]).reshape(-1, 3)).equations[:, 3].max() for a, b in zip(x[::2], x[1::2])]
    deep = np.array(exact) < 0
    assert deep.sum() > 60
    np.testing.assert_allclose(found[deep], np.array(exact)[deep], atol=1e-12)
    assert (found[~deep] >= 0).all()


def test_ellipsoid_on_ellipsoid_along_an_axis():
    for gap in (0.3, 1e-4, 1e-9, 0.0, -1e-9, -1e-4, -0.1):
        row = apart((ELLIPSOID, [1, 2, 3]), (ELLIPSOID, [2, 1, 0.5]), (0, 0, 3.5 + gap))
        assert row[0] == pytest.approx(gap, abs=2e-14)
        np.testing.assert_allclose(row[1:4], [0, 0, 1], atol=1e-7)


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9, 1e-12, 0.0, -1e-12, -1e-9, -1e-6, -1e-3])
def test_corner_over_a_side_from_clear_to_deep(gap):
    """A tetrahedron on its corner, the point off the middle: the normal is the side's however near they are."""
    R = turned((-1, 1, 0), np.pi - np.arccos(1 / np.sqrt(3)))  # (1, 1, 1) goes down
    down = min((R @ TETRAHEDRON.T).T.tolist(), key=lambda x: x[2])
    at = np.array([0.2, 0.1, 1.0]) - down + (0, 0, gap)
    row = apart((BOX, [1, 1, 1]), hull(TETRAHEDRON), at, Q=R)
    assert row[0] == pytest.approx(gap, abs=1e-14)
    np.testing.assert_allclose(row[1:4], [0, 0, 1], atol=1e-9)
    np.testing.assert_allclose(row[4:7], [0.2, 0.1, 1.0], atol=1e-9)


@pytest.mark.parametrize(
    ("a", "b", "p", "depth"),
    [
        ((SPHERE, [1]), (SPHERE, [1]), (0, 0, 0), 0),  # two points that coincide
        ((SPHERE, [1]), (BOX, [1, 2, 3]), (0, 0, 0), 1),
        ((BOX, [1, 1, 1]), (BOX, [1, 1, 1]), (0, 0, 0), 2),
        ((BOX, [1, 1, 1]), (BOX, [1, 1, 1]), (2, 0, 0), 0),
        ((BOX, [1, 1, 1]), (BOX, [1, 1, 1]), (2, 2, 2), 0),
        ((BOX, [1, 1, 0]), (BOX, [1, 1, 0]), (0.5, 0, 0), 0),  # flat ones in one plane
        ((BOX, [1, 1, 0]), (BOX, [1, 0, 1]), (0.5, 0.25, 0.125), 0.75),
        ((BOX, [0, 0, 0]), (BOX, [0, 0, 0]), (0, 0, 0), 0),
        ((BOX, [0, 0, 0]), (BOX, [1, 0, 0]), (0.5, 0, 0), 0),
        ((ELLIPSOID, [1, 1, 1]), (ELLIPSOID, [2, 2, 2]), (0, 0, 0), 3),
        ((ELLIPSOID, [1, 2, 3]), (BOX, [1, 1, 1]), (0, 0, 0), 2),
        ((ELLIPSOID, [0, 0, 0]), (BOX, [1, 1, 1]), (0.25, 0, 0), 0.75),
        (hull(TETRAHEDRON), hull(TETRAHEDRON), (0, 0, 0), 2),
        (hull(TETRAHEDRON[:1]), hull(TETRAHEDRON), (2, 2, 0), 0),
    ],
)
def test_degenerate_cases_have_finite_answers(a, b, p, depth):
    row = apart(a, b, p)
    assert np.isfinite(row).all()
    assert np.linalg.norm(row[1:4]) == pytest.approx(1, rel=1e-12)
    assert -row[0] == pytest.approx(depth, abs=1e-9)


def test_scale_does_not_matter():
    for size in (1e-6, 1, 1e6):
        row = apart((BOX, [size] * 3), (ELLIPSOID, [size, 2 * size, size]), (0.1 * size, 2.5 * size, 0.2 * size))
        assert -row[0] / size == pytest.approx(0.5, abs=1e-12)


def test_beyond_far_only_a_bound_is_found():
    pose = np.array([[0, 0, 0, *I.ravel()], [5, 0.1, 0.2, *turned((1, 2, 3), 1.0).ravel()]])
    G = geometry((BOX, [1, 1, 1]), (BOX, [1, 1, 1]))
    exact = separations(G, pose)[0, 0]
    assert 0.5 < separations(G, pose, 0.5)[0, 0] <= exact


def test_what_is_not_a_number_ends():
    row = apart((BOX, [1, 1, 1]), (ELLIPSOID, [1, 1, 1]), (np.nan, 0, 0))
    assert not row[0] > 0
