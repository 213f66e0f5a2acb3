"""Contacts of flat shapes: how many, where, how deep, against what geometry says."""

from __future__ import annotations

import numpy as np
import pytest

from flyball.contact.kinds import BOX, PLANE, SPHERE
from tests.contact.scenes import contacts, turned

I, O = np.eye(3), np.zeros(3)


def test_box_on_a_plane_touches_with_four_corners():
    found = contacts((PLANE, []), (BOX, [1, 2, 3]), (O, I), ((5, 6, 2.99), turned((0, 0, 1), 0.3)), 0.1)
    corners = np.array([5, 6, 0]) + np.array([[x, y, 0] for x in (-1, 1) for y in (-2, 2)]) @ turned((0, 0, 1), 0.3).T
    assert len(found) == 4
    assert {tuple(p) for p in np.round(found[:, :2], 9)} == {tuple(p) for p in np.round(corners[:, :2], 9)}
    np.testing.assert_allclose(found[:, 3:7], np.tile([0, 0, 1, -0.01], (4, 1)), atol=1e-14)
    assert len(set(found[:, 7])) == 4


@pytest.mark.parametrize(("reach", "count"), [(0.1, 4), (0.01, 2), (-1, 0)])
def test_box_tilted_over_a_plane_has_the_corners_within_reach(reach, count):
    found = contacts((PLANE, []), (BOX, [1, 1, 1]), (O, I), ((0, 0, 1.01), turned((1, 0, 0), 0.01)), reach)
    assert len(found) == count


def test_boxes_on_each_other_touch_where_both_faces_are():
    found = contacts((BOX, [1, 1, 1]), (BOX, [1, 1, 1]), (O, I), ((0.5, -0.2, 1.999), I), 0.1)
    assert sorted(map(tuple, np.round(found[:, :3], 9))) == [(x, y, 0.9995) for x in (-0.5, 1.0) for y in (-1.0, 0.8)]
    np.testing.assert_allclose(found[:, 6], -0.001, atol=1e-14)


def test_edges_across_touch_where_they_cross():
    at = (0.1, 0.2, 2 * np.sqrt(2) - 0.01)
    found = contacts(
        (BOX, [1, 1, 1]), (BOX, [1, 1, 1]), (O, turned((1, 0, 0), np.pi / 4)), (at, turned((0, 1, 0), np.pi / 4)), 0.1
    )
    np.testing.assert_allclose(found[:, :7], [[0.1, 0, np.sqrt(2) - 0.005, 0, 0, 1, -0.01]], atol=1e-12)


def test_sphere_and_box():
    found = contacts((SPHERE, [1]), (BOX, [1, 1, 1]), ((2, 2, 2.5), I), (O, I))
    d = np.array([1, 1, 1.5])
    np.testing.assert_allclose(found[0, 3:6], -d / np.linalg.norm(d), atol=1e-14)
    np.testing.assert_allclose(found[0, 6], np.linalg.norm(d) - 1, atol=1e-14)
