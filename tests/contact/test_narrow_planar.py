"""Circles, polygons, segments and planes at z = 0: distances, two-point contacts, nothing out of the plane."""

from __future__ import annotations

import numpy as np
import pytest

from flyball.collision.shape_kinds import PLANE, POLYGON, SPHERE
from tests.contact.scenes import contacts, turned

I, O = np.eye(3), np.zeros(3)
FLOOR = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # its z axis is the world's y


def regular(n, size, rounding=0.0):
    angle = 2 * np.pi * np.arange(n) / n
    return POLYGON, [rounding], size * np.c_[np.cos(angle), np.sin(angle), 0 * angle]


def rectangle(a, b, rounding=0.0):
    return POLYGON, [rounding], np.array([(-a, -b, 0), (a, -b, 0), (a, b, 0), (-a, b, 0)], dtype=float)


def segment(a, rounding=0.0):
    return POLYGON, [rounding], np.array([(-a, 0, 0), (a, 0, 0)], dtype=float)


def turn(angle):
    return turned((0, 0, 1), angle)


def edges(corners):
    return [(corners[k - 1], corners[k]) for k in range(len(corners))]


def distance(P, Q):
    """Signed distance of two convex polygons: the plain way."""
    far = -np.inf
    for one, other in ((P, Q), (Q, P)):
        for a, b in edges(one):
            n = np.array([b[1] - a[1], a[0] - b[0]]) / np.linalg.norm(b - a)
            far = max(far, ((other - a) @ n).min())
    if far <= 0:
        return far
    nearest = np.inf
    for one, other in ((P, Q), (Q, P)):
        for a, b in edges(one):
            for c in other:
                t = np.clip((c - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
                nearest = min(nearest, np.linalg.norm(c - a - t * (b - a)))
    return nearest


def corners(shape, p, R):
    return (p + shape[2] @ R.T)[:, :2]


@pytest.mark.parametrize("rounding", [0.0, 0.1])
def test_polygons_are_as_far_apart_as_they_are(rounding):
    rng = np.random.default_rng(1)
    shapes = [rectangle(1, 0.5), regular(3, 1), regular(5, 0.7), segment(1), regular(12, 1)]
    for _ in range(200):
        a, b = (shapes[k] for k in rng.integers(len(shapes), size=2))
        a, b = (a[0], [rounding], a[2]), (b[0], [2 * rounding], b[2])
        R, Q = turn(rng.uniform(0, 7)), turn(rng.choice([0, 1e-7, np.pi / 2, rng.uniform(0, 7)]))
        p, q = np.array([*rng.normal(size=2), 0]), np.array([*rng.normal(size=2) * 1.5, 0])
        found = contacts(a, b, (p, R), (q, Q))
        far = distance(corners(a, p, R), corners(b, q, Q)) - 3 * rounding
        assert len(found) in (1, 2)
        np.testing.assert_allclose(found[:, 6].min(), far, rtol=0, atol=5e-6)
        np.testing.assert_allclose(np.linalg.norm(found[:, 3:6], axis=1), 1, atol=1e-12)
        assert (found[:, [2, 5]] == 0).all()
        back = contacts(a, b, (p, R), (q, Q), exchange=True)
        np.testing.assert_allclose(back[:, 6].min(), far, rtol=0, atol=5e-6)


@pytest.mark.parametrize("gap", [-1e-3, 0, 1e-12, 1e-3])
@pytest.mark.parametrize("rounding", [0.0, 0.05])
def test_boxes_stand_on_two_points(gap, rounding):
    a, b = rectangle(1, 0.5, rounding), rectangle(0.4, 0.5, rounding)
    for R in (I, turn(0.3)):
        found = contacts(a, b, (O, R), (R @ np.array([0.8, 1 + 2 * rounding + gap, 0]), R), 0.1)
        local = found[np.argsort((found[:, :3] @ R)[:, 0])]
        np.testing.assert_allclose((local[:, :3] @ R)[:, 0], [0.4, 1.0], atol=1e-9)
        np.testing.assert_allclose((local[:, :3] @ R)[:, 1], 0.5 + rounding + gap / 2, atol=1e-12)
        np.testing.assert_allclose(local[:, 3:6] @ R, np.tile([0, 1, 0], (2, 1)), atol=1e-12)
        np.testing.assert_allclose(local[:, 6], gap, atol=1e-12)
        assert (found[:, [2, 5]] == 0).all()


def test_a_tilted_box_has_both_corners_within_reach():
    found = contacts(rectangle(2, 1), rectangle(1, 1), (O, I), ((0, 2.01, 0), turn(0.01)), 0.1)
    lowest = 1.01 - np.cos(0.01) + np.sin(0.01) * np.array([-1, 1])
    np.testing.assert_allclose(np.sort(found[:, 6]), lowest, atol=1e-12)
    np.testing.assert_allclose(found[:, 3:6], np.tile([0, 1, 0], (2, 1)), atol=1e-12)


def test_corner_on_a_side():
    (found,) = contacts(
        rectangle(2, 1), rectangle(1, 1), (O, I), ((0.3, 1 + np.sqrt(2) - 0.01, 0), turn(np.pi / 4)), 0.1
    )
    np.testing.assert_allclose(found[:7], [0.3, 0.995, 0, 0, 1, 0, -0.01], atol=1e-12)


def test_corner_to_corner_rounded():
    (found,) = contacts(rectangle(1, 1, 0.1), rectangle(1, 1, 0.1), (O, I), ((2.3, 2.4, 0), I), 1)
    np.testing.assert_allclose(found[3:7], [0.6, 0.8, 0, 0.3], atol=1e-12)


@pytest.mark.parametrize("rounding", [0.0, 0.05])
def test_polygon_on_a_line(rounding):
    found = contacts((PLANE, []), rectangle(1, 0.5, rounding), (O, FLOOR), ((3, 0.49 + rounding, 0), I), 0.1)
    found = found[np.argsort(found[:, 0])]
    np.testing.assert_allclose(found[:, :7], [[x, -0.005, 0, 0, 1, 0, -0.01] for x in (2, 4)], atol=1e-12)
    assert (found[:, [2, 5]] == 0).all()


def test_circle_and_polygon():
    square = rectangle(1, 1, 0.1)
    for p, n, gap in (
        ((0, 1.5, 0), (0, -1, 0), -0.1),
        ((1.6, 1.8, 0), (-0.6, -0.8, 0), 0.4),
        ((0.5, 0, 0), (-1, 0, 0), -1.1),
    ):
        (found,) = contacts((SPHERE, [0.5]), square, (p, I), (O, I))
        np.testing.assert_allclose(found[3:7], [*n, gap], atol=1e-12)
        np.testing.assert_allclose(found[:3], np.array(p) + (0.5 + gap / 2) * np.array(n), atol=1e-12)
        assert found[5] == 0


def test_circles_at_the_same_place_part_in_the_plane():
    (found,) = contacts((SPHERE, [1]), (SPHERE, [2]), (O, I), (O, I))
    np.testing.assert_allclose(found[3:7], [1, 0, 0, -3], atol=0)


def test_segments_that_cross_and_meet():
    (found,) = contacts(segment(1, 0.1), segment(1, 0.1), (O, I), ((0, 0.5, 0), turn(np.pi / 2)), 1)
    np.testing.assert_allclose(found[6], -0.7, atol=1e-12)
    found = contacts(segment(1, 0.1), segment(1, 0.1), (O, I), ((0.5, 0.19, 0), I), 1)
    np.testing.assert_allclose(np.sort(found[:, 0]), [-0.5, 1], atol=1e-9)
    np.testing.assert_allclose(found[:, 6], -0.01, atol=1e-12)


@pytest.mark.parametrize("exchange", [False, True])
@pytest.mark.parametrize("rounding", [0.0, 0.05])
@pytest.mark.parametrize("case", ["two corners", "the second's corner", "the first's corner"])
def test_corner_to_corner_and_corner_to_side(case, rounding, exchange):
    """The point is midway between the surfaces where they are nearest, whichever of the two squares has the corner."""
    here, tip = (O, I), 1.5 - np.sqrt(0.5)  # of a square that stands on a corner, beside the other one
    there = ((1.5, 0.1, 0), turn(np.pi / 4))
    first, second, p, q = {
        "two corners": (here, ((1.2, 1.3, 0), I), (0.5, 0.5), (0.7, 0.8)),
        "the second's corner": (here, there, (0.5, 0.1), (tip, 0.1)),
        "the first's corner": (there, here, (tip, 0.1), (0.5, 0.1)),
    }[case]
    way = np.subtract(q, p)
    far = np.linalg.norm(way)
    square = rectangle(0.5, 0.5, rounding)
    (found,) = contacts(square, square, first, second, reach=far - 2 * rounding + 1e-3, exchange=exchange)
    assert found[:2] == pytest.approx(np.add(p, q) / 2, abs=1e-12)
    assert found[3:5] == pytest.approx(way / far, abs=1e-12)
    assert found[6] == pytest.approx(far - 2 * rounding, abs=1e-12)
