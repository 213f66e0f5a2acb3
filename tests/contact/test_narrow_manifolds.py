"""Contacts of flat and straight parts: how many, where, how deep, against what geometry says; their names last."""

from __future__ import annotations

import numpy as np
import pytest

from flyball.collision.shape_kinds import BOX, CAPSULE, CONE, CYLINDER, PLANE, SPHERE
from tests.contact.scenes import contacts, turned
from tests.contact.solids import rotation

I, O = np.eye(3), np.zeros(3)
LYING = turned((0, 1, 0), np.pi / 2)
FLOOR, CUBE = (PLANE, []), (BOX, [1, 1, 1])
UPRIGHT = [
    ("cylinder on a plane", FLOOR, (CYLINDER, [0.3, 1]), 1.0, I, 0.3),
    ("cylinder on a box", CUBE, (CYLINDER, [0.3, 1]), 2.0, I, 0.3),
    ("cylinder on a cylinder", (CYLINDER, [0.5, 1]), (CYLINDER, [0.3, 1]), 2.0, I, 0.3),
    ("cone on a plane", FLOOR, (CONE, [0.3, 1]), 0.0, I, 0.3),
    ("cone on a box", CUBE, (CONE, [0.3, 1]), 1.0, I, 0.3),
    ("cone on a cylinder", (CYLINDER, [0.5, 1]), (CONE, [0.3, 1]), 1.0, I, 0.3),
]
LINES = [
    ("cylinder on a plane", FLOOR, (CYLINDER, [0.1, 0.5]), 0.1, (-0.5, 0.5)),
    ("capsule on a plane", FLOOR, (CAPSULE, [0.1, 0.5]), 0.1, (-0.5, 0.5)),
    ("cylinder on a box", (BOX, [0.3, 1, 1]), (CYLINDER, [0.1, 0.5]), 1.1, (-0.3, 0.3)),
    ("capsule on a box", (BOX, [0.3, 1, 1]), (CAPSULE, [0.1, 0.5]), 1.1, (-0.3, 0.3)),
]


def placed(a, b, p, R, reach=0.1):
    """Contacts of b at p, R over a at the origin, all turned and moved somewhere; told where they were."""
    Q, t = rotation(np.random.default_rng(5)), np.array([3.0, -2, 1])
    found = contacts(a, b, (t, Q), (t + Q @ np.asarray(p, dtype=float), Q @ R), reach)
    found[:, :3] = (found[:, :3] - t) @ Q
    found[:, 3:6] = found[:, 3:6] @ Q
    return found


def hull_area(xy):
    """Area of points that are the corners of a convex polygon."""
    c = xy - xy.mean(axis=0)
    x, y = c[np.argsort(np.arctan2(c[:, 1], c[:, 0]))].T
    return 0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1))


@pytest.mark.parametrize("gap", [-1e-3, 0, 1e-12, 1e-3])
@pytest.mark.parametrize(("name", "a", "b", "height", "R", "r"), UPRIGHT, ids=lambda x: x if isinstance(x, str) else "")
def test_a_round_foot_stands_on_four_points_of_its_rim(name, a, b, height, R, r, gap):
    found = placed(a, b, (0.1, 0.05, height + gap), R)
    np.testing.assert_allclose(np.hypot(*(found[:, :2] - [0.1, 0.05]).T), r, atol=1e-9)
    np.testing.assert_allclose(hull_area(found[:, :2]), 2 * r * r, atol=1e-9)
    np.testing.assert_allclose(found[:, 3:6], np.tile([0, 0, 1], (4, 1)), atol=1e-9)
    np.testing.assert_allclose(found[:, 6], gap, atol=1e-12)


@pytest.mark.parametrize("gap", [-1e-3, 0, 1e-12, 1e-3])
@pytest.mark.parametrize(("name", "a", "b", "height", "ends"), LINES, ids=lambda x: x if isinstance(x, str) else "")
def test_what_lies_touches_with_both_ends_of_its_line(name, a, b, height, ends, gap):
    found = placed(a, b, (0, 0.2, height + gap), LYING)
    found = found[np.argsort(found[:, 0])]
    np.testing.assert_allclose(found[:, 0], ends, atol=1e-9)
    np.testing.assert_allclose(found[:, 1], 0.2, atol=1e-9)
    np.testing.assert_allclose(found[:, 3:6], np.tile([0, 0, 1], (2, 1)), atol=1e-9)
    np.testing.assert_allclose(found[:, 6], gap, atol=1e-12)


@pytest.mark.parametrize("a", [CAPSULE, CYLINDER])
@pytest.mark.parametrize("b", [CAPSULE, CYLINDER])
@pytest.mark.parametrize("gap", [-1e-3, 0, 1e-3])
def test_lines_side_by_side_touch_at_both_ends(a, b, gap):
    A, B = ((a, [0.1, 0.5]), LYING), ((b, [0.2, 0.5]), LYING)
    found = contacts(A[0], B[0], (O, A[1]), ((0.25, 0, 0.3 + gap), B[1]), 0.1)
    found = found[np.argsort(found[:, 0])]
    np.testing.assert_allclose(found[:, 0], [-0.25, 0.5], atol=1e-9)
    np.testing.assert_allclose(found[:, 3:7], np.tile([0, 0, 1, gap], (2, 1)), atol=1e-9)


@pytest.mark.parametrize("a", [CAPSULE, CYLINDER])
@pytest.mark.parametrize("b", [CAPSULE, CYLINDER])
def test_lines_that_cross_touch_where_they_do(a, b):
    (found,) = contacts(
        (a, [0.1, 0.5]), (b, [0.2, 0.5]), (O, LYING), ((0.1, 0, 0.299), turned((0, 0, 1), 1) @ LYING), 0.1
    )
    np.testing.assert_allclose(found[:7], [0.1, 0, 0.0995, 0, 0, 1, -0.001], atol=1e-7)


def test_box_on_a_plane_touches_with_four_corners():
    T = turned((0, 0, 1), 0.3)
    found = contacts(FLOOR, (BOX, [1, 2, 3]), (O, I), ((5, 6, 2.99), T), 0.1)
    corners = np.array([5, 6, 0]) + np.array([[x, y, 0] for x in (-1, 1) for y in (-2, 2)]) @ T.T
    assert {tuple(p) for p in np.round(found[:, :2], 9)} == {tuple(p) for p in np.round(corners[:, :2], 9)}
    np.testing.assert_allclose(found[:, 3:7], np.tile([0, 0, 1, -0.01], (4, 1)), atol=1e-14)


@pytest.mark.parametrize("below", [FLOOR, CUBE])
@pytest.mark.parametrize(("reach", "count"), [(0.1, 4), (0.01, 2), (-1, 0)])
def test_a_tilted_box_has_the_corners_within_reach(below, reach, count):
    height = 0.01 if below is FLOOR else 1.01
    found = contacts(below, (BOX, [0.9, 0.9, 1]), (O, I), ((0, 0, 1 + height), turned((1, 0, 0), 0.01)), reach)
    assert len(found) == count
    lowest = height + 1 - 0.9 * np.sin(0.01) - np.cos(0.01)
    if count:
        np.testing.assert_allclose(found[:, 6].min(), lowest - (below is CUBE), atol=1e-12)


def test_boxes_on_each_other_touch_where_both_faces_are():
    found = placed(CUBE, CUBE, (0.5, -0.2, 1.999), I)
    corners = sorted(map(tuple, np.round(found[:, :3], 9)))
    assert corners == [(x, y, 0.9995) for x in (-0.5, 1.0) for y in (-1.0, 0.8)]
    np.testing.assert_allclose(found[:, 6], -0.001, atol=1e-14)


def test_four_of_eight_points_hold_most_of_the_area():
    found = placed(CUBE, CUBE, (0, 0, 2), turned((0, 0, 1), np.pi / 4))
    assert hull_area(found[:, :2]) > 0.7 * 8 * (np.sqrt(2) - 1)


def test_edges_across_touch_where_they_cross():
    at = (0.1, 0.2, 2 * np.sqrt(2) - 0.01)
    cube = turned((0, 1, 0), np.pi / 4)
    found = contacts(CUBE, CUBE, (O, turned((1, 0, 0), np.pi / 4)), (at, cube), 0.1)
    np.testing.assert_allclose(found[:, :7], [[0.1, 0, np.sqrt(2) - 0.005, 0, 0, 1, -0.01]], atol=1e-12)


def test_corner_to_corner_the_gap_is_the_diagonal():
    (found,) = contacts(CUBE, CUBE, (O, I), ((2.01, 2.01, 2.01), I), 0.1)
    np.testing.assert_allclose(found[3:7], [*np.ones(3) / np.sqrt(3), 0.01 * np.sqrt(3)], atol=1e-12)


def test_a_tilted_disc_touches_with_its_very_rim():
    for angle in (1e-5, 1e-3, 0.1, 0.7, 1.2):
        for about in (0.3, 1.1):
            R = turned((0, 0, 1), about) @ turned((1, 0, 0), angle)
            found = contacts(FLOOR, (CYLINDER, [1, 0.1]), (O, I), ((0, 0, 0), R), 0.1)
            np.testing.assert_allclose(found[:, 6].min(), -np.sin(angle) - 0.1 * np.cos(angle), atol=1e-6)


@pytest.mark.parametrize("below", [FLOOR, CUBE])
@pytest.mark.parametrize(
    ("above", "R"), [(CUBE, I), ((CYLINDER, [0.5, 1]), I), ((CYLINDER, [1, 0.6]), LYING), ((CONE, [0.5, 1]), I)]
)
def test_names_last_while_it_settles(below, above, R):
    """Rattled by millionths, every point keeps its name."""
    rng = np.random.default_rng(4)
    top = 0 if below is FLOOR else 1
    foot = {BOX: 1, CYLINDER: 1, CONE: 0}[above[0]]
    names = set()
    for _ in range(50):
        p = np.array([0, 0, top + foot]) + 1e-7 * rng.normal(size=3)
        found = contacts(below, above, (O, I), (p, turned(rng.normal(size=3), 1e-7) @ R), 0.01)
        names.add(frozenset(found[:, 7]))
    assert len(names) == 1


def test_sphere_and_box():
    (found,) = contacts((SPHERE, [1]), CUBE, ((2, 2, 2.5), I), (O, I))
    d = np.array([1, 1, 1.5])
    np.testing.assert_allclose(found[3:6], -d / np.linalg.norm(d), atol=1e-14)
    np.testing.assert_allclose(found[6], np.linalg.norm(d) - 1, atol=1e-14)
