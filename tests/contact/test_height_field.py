"""Contacts with a height field: the field's own normals, no matter how it is cut into triangles."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest

from flyball.collision.narrow_phase.primitives import SCRATCH_ROWS
from flyball.collision.shape_kinds import BOX, CAPSULE, CYLINDER, ELLIPSOID, FIELD, HULL, SPHERE
from flyball.collision.shapes.height_field import height_field_rows
from flyball.collision.tables import Geometry, Movers
from flyball.errors import ModelError
from tests.contact.against import NAMES, pool, rotation, tables
from tests.contact.pairs import separations
from tests.contact.scenes import contacts, meet, turned

I, O = np.eye(3), np.zeros(3)
FLAT = np.zeros((8, 9))


def ground(heights, dx=1.0, dy=1.0):
    rows, par = height_field_rows(heights, dx, dy)
    return (FIELD, par, rows)


def over(heights, shape, at, R=I, reach=0.1, d=(1.0, 1.0), **how):
    return contacts(ground(heights, *d), shape, (O, I), (at, R), reach, **how)


def slope(a, b, n=9):
    i, j = np.mgrid[:n, :n]
    return a * i + b * j


@pytest.mark.parametrize("at", [(3.3, 3.1), (3.5, 3.5), (3, 3.2), (3.7, 4), (3, 3), (3.000001, 3)])
@pytest.mark.parametrize("gap", [0.05, 0.0, -0.01, -0.3, -0.9])
def test_sphere_on_flat_ground_has_one_upright_contact(at, gap):
    found = over(FLAT, (SPHERE, [0.5]), (*at, 0.5 + gap))
    np.testing.assert_allclose(found[:, :7], [[*at, gap / 2, 0, 0, 1, gap]], atol=1e-12)


@pytest.mark.parametrize(
    "shape", [(SPHERE, [0.7]), (CAPSULE, [0.4, 1.1]), (BOX, [0.6, 0.9, 0.3]), (CYLINDER, [0.7, 0.2])]
)
def test_nothing_catches_while_sliding_on_a_slope(shape):
    """However it is turned and wherever it is, all normals are the slope's, and the lowest gap is the same."""
    n = np.array([-0.3, 0.2, 1]) / np.linalg.norm([-0.3, 0.2, 1])
    rng = np.random.default_rng(0)
    R = turned((1, 2, 3), 0.4)
    least = []
    for _ in range(40):
        x, y = rng.uniform(2.5, 5.5, 2)
        p = np.array([x, y, 0.3 * x - 0.2 * y]) + 0.5 * n
        found = over(slope(0.3, -0.2), shape, p, R, 0.3)
        assert 0 < len(found) <= 8
        np.testing.assert_allclose(found[:, 3:6], np.tile(n, (len(found), 1)), atol=1e-12)
        least.append(found[:, 6].min())
    np.testing.assert_allclose(least, least[0], atol=1e-12)


def test_box_on_flat_ground_stands_on_its_corners_whose_names_last():
    names = []
    for x in np.linspace(3, 4.2, 13):
        found = over(FLAT, (BOX, [1.2, 0.7, 0.5]), (x, 4.1, 0.499), turned((0, 0, 1), 0.3))
        assert len(found) == 4
        np.testing.assert_allclose(found[:, 3:7], np.tile([0, 0, 1, -0.001], (4, 1)), atol=1e-12)
        local = (found[:, :3] - (x, 4.1, 0)) @ turned((0, 0, 1), 0.3)
        np.testing.assert_allclose(np.sort(np.abs(local[:, :2]), axis=0), np.tile([1.2, 0.7], (4, 1)), atol=1e-9)
        names.append({name: tuple(np.round(p, 9)) for name, p in zip(found[:, 7], local[:, :2], strict=True)})
    assert all(n == names[0] for n in names)


def test_box_near_the_border_stands_on_its_corners_too():
    found = over(np.zeros((3, 3)), (BOX, [0.3, 0.3, 0.1]), (1.1, 0.93, 0.0999))
    np.testing.assert_allclose(np.sort(np.abs(found[:, :2] - (1.1, 0.93)), axis=0), np.full((4, 2), 0.3), atol=1e-12)


def test_box_wider_than_the_field_stands_on_its_border():
    found = over(np.zeros((3, 3)), (BOX, [3, 3, 0.1]), (1, 1, 0.0999))
    assert {(0, 0), (2, 0), (0, 2), (2, 2)} <= {tuple(p) for p in np.round(found[:, :2], 9)}
    np.testing.assert_allclose(found[:, 3:6], [[0, 0, 1]] * len(found), atol=1e-9)


def roof(n=9):
    i, _ = np.mgrid[:n, :n]
    return -0.5 * np.abs(i - 4.0)


@pytest.mark.parametrize("gap", [0.05, 0.0, -0.02])
@pytest.mark.parametrize("y", [3.0, 3.4])
def test_sphere_on_a_ridge_is_carried_by_the_ridge(gap, y):
    found = over(roof(), (SPHERE, [0.5]), (4, y, 0.5 + gap))
    np.testing.assert_allclose(found[np.argmin(found[:, 6]), :7], [4, y, gap / 2, 0, 0, 1, gap], atol=1e-7)


def test_box_across_a_ridge_is_carried_along_the_ridge():
    found = over(roof(), (BOX, [1, 0.7, 0.2]), (4, 3.9, 0.199))
    assert len(found) >= 2
    np.testing.assert_allclose(found[:, 3:6], np.tile([0, 0, 1], (len(found), 1)), atol=1e-7)
    touching = found[found[:, 6] < 0]
    np.testing.assert_allclose(touching[:, 0], 4, atol=1e-6)
    assert np.ptp(touching[:, 1]) == pytest.approx(1.4, abs=1e-6)


def test_ball_in_a_valley_touches_both_sides():
    found = over(-roof(), (SPHERE, [0.5]), (4, 3.3, 0.5 * np.sqrt(1.25) + 0.001))
    assert len(found) == 2
    np.testing.assert_allclose(np.sort(found[:, 3]), [-1 / np.sqrt(5), 1 / np.sqrt(5)], atol=1e-12)


def test_ball_on_a_peak():
    z = np.zeros((7, 7))
    z[3, 3] = 1
    for gap in (0.05, -0.01):
        found = over(z, (SPHERE, [0.4]), (3, 3, 1.4 + gap))
        np.testing.assert_allclose(found[np.argmin(found[:, 6]), 3:7], [0, 0, 1, gap], atol=1e-7)


@pytest.mark.parametrize("shape", [(SPHERE, [0.5]), (BOX, [0.5, 0.5, 0.5]), (ELLIPSOID, [0.5, 0.6, 0.4])])
@pytest.mark.parametrize("depth", [0.2, 0.9, 3.0])
def test_what_is_deep_is_pushed_up_by_its_depth(shape, depth):
    low = shape[1][-1]
    found = over(FLAT, shape, (3.6, 3.2, low - depth))
    assert len(found)
    np.testing.assert_allclose(found[:, 3:6], np.tile([0, 0, 1], (len(found), 1)), atol=1e-12)
    assert found[:, 6].min() == pytest.approx(-depth, abs=1e-12)


def test_box_at_the_rim_of_a_step_is_not_pushed_aside():
    z = np.zeros((12, 12))
    z[:6] = 3.0
    found = over(z, (BOX, [0.8, 0.8, 0.8]), (4.6, 5.3, 3.8 - 0.001))
    assert len(found) >= 4
    np.testing.assert_allclose(found[:, 5], 1, atol=1e-7)
    assert found[:, 6].min() == pytest.approx(-0.001, abs=1e-9)


def nearest_point(x, a, b, c):
    """Of the triangle, by brute force: minimum of a quadratic over its weights, sides and corners one by one."""
    best = min((a, b, c), key=lambda p: np.linalg.norm(x - p))
    for p, q in ((a, b), (b, c), (c, a)):
        t = np.clip(np.dot(x - p, q - p) / np.dot(q - p, q - p), 0, 1)
        best = min(best, p + t * (q - p), key=lambda p: np.linalg.norm(x - p))
    w = np.linalg.lstsq(np.array([b - a, c - a]).T, x - a, rcond=None)[0]
    if min(w) > 0 and sum(w) < 1:
        best = min(best, a + w[0] * (b - a) + w[1] * (c - a), key=lambda p: np.linalg.norm(x - p))
    return best


def test_distance_of_spheres_over_rough_ground_is_that_of_the_nearest_triangle():
    rng = np.random.default_rng(3)
    z = rng.uniform(0, 0.8, (7, 7))
    for _ in range(40):
        x = np.array([*rng.uniform(1, 5, 2), rng.uniform(0.9, 1.6)])

        def corner(i, j):
            return np.array([i, j, z[i, j]])

        triangles = []
        for i in range(6):
            for j in range(6):
                a, b, c, d = corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)
                triangles += [(a, b, c), (a, c, d)]
        foot = min((nearest_point(x, *t) for t in triangles), key=lambda p: np.linalg.norm(x - p))
        found = over(z, (SPHERE, [0.2]), x, reach=2.0)
        best = found[np.argmin(found[:, 6])]
        away = np.linalg.norm(x - foot)
        assert best[6] == pytest.approx(away - 0.2, abs=1e-9)
        np.testing.assert_allclose(best[3:6], (x - foot) / away, atol=1e-6)


@pytest.mark.parametrize("kind", NAMES, ids=NAMES.get)
def test_any_shape_over_rough_ground_is_as_far_from_it_as_from_its_triangles(kind):
    """And whatever overlaps a triangle has a contact that says so, upwards."""
    rng = np.random.default_rng(kind)
    d, z = 0.3, rng.uniform(0, 0.35, (9, 9))
    i, j = np.mgrid[:9, :9]
    knot = np.stack([i * d, j * d, z], axis=-1)
    a, b, c, e = knot[:-1, :-1], knot[1:, :-1], knot[1:, 1:], knot[:-1, 1:]
    triangles = np.concatenate([np.stack([a, b, c], axis=2), np.stack([a, c, e], axis=2)]).reshape(-1, 3, 3)
    rows, par = height_field_rows(z, d, d)
    for _ in range(25):
        s = pool(kind)[rng.integers(60)]
        R = rotation(rng)
        p = np.array([*rng.uniform(0.7, 1.7, 2), 0.35 + s.top(-R[2]) - rng.uniform(0, 0.25)])
        G = tables([s])
        exact = (of_triangles(G, triangles, p, R) - s.rounding).min()
        at, x = np.repeat(G.shape, 2, axis=0), np.repeat(G.dimensions, 2, axis=0)
        at.kind[1], at.mover[1], at.first[1], x.par[1, :4], x.radius[1] = FIELD, 1, len(G.vertex), par, 4
        both = Geometry(at, x, np.concatenate([G.vertex, rows]), G.face, G.excluded_pairs)
        pose = np.array([[*p, *R.ravel()], [0, 0, 0, *I.ravel()]])
        room = np.zeros((SCRATCH_ROWS, 8))
        count = meet(both, Movers(pose, np.zeros((2, 6))), 0, 1, 0.05, room)
        gap = room[:count, 6].min(initial=np.inf)
        if exact > 0:
            assert gap == pytest.approx(exact, abs=1e-6) if exact < 0.05 else count == 0
        else:
            assert gap < 0
        assert (room[:count, 5] < 0).all()  # from the shape to the ground


def of_triangles(G, triangles, p, R):
    """Separation of the one shape's core, at p turned by R, from each triangle."""
    m = len(triangles)
    at, x = np.repeat(G.shape, 2 * m, axis=0), np.repeat(G.dimensions, 2 * m, axis=0)
    at.kind[1::2], at.count[1::2], at.first[1::2] = HULL, 3, len(G.vertex) + 3 * np.arange(m)
    x.par[1::2, 0], x.par[1::2, 1] = 0, -1
    pose = np.tile([*p, *R.ravel()], (2 * m, 1))
    pose[1::2] = [0, 0, 0, *I.ravel()]
    vertex = np.concatenate([G.vertex, triangles.reshape(-1, 3)])
    return separations(Geometry(at, x, vertex, G.face, G.excluded_pairs), pose)[:, 0]


def test_beyond_its_border_there_is_no_ground():
    assert not len(over(FLAT, (SPHERE, [0.5]), (-0.6, 3, 0.3)))
    assert not len(over(FLAT, (SPHERE, [0.5]), (20, 3, 0.3)))
    found = over(FLAT, (SPHERE, [0.5]), (-0.3, 3.3, 0.39))  # rolls over the rim
    away = np.hypot(0.3, 0.39)
    np.testing.assert_allclose(found[:, 3:7], [[-0.3 / away, 0, 0.39 / away, away - 0.5]], atol=1e-7)


def test_a_turned_field_and_an_exchanged_pair_are_the_same():
    R = turned((3, 1, 2), 0.8)
    z = np.random.default_rng(1).uniform(0, 0.3, (6, 6))
    box, p, Q = (BOX, [0.9, 0.7, 0.3]), np.array([2.5, 2.5, 0.45]), turned((0, 1, 1), 0.2)
    found = over(z, box, p, Q)
    again = contacts(ground(z), box, ((1, 2, 3), R), (R @ p + (1, 2, 3), R @ Q), 0.1)
    other = over(z, box, p, Q, exchange=True)
    order = np.lexsort(found[:, :3].T)
    np.testing.assert_allclose(other[np.lexsort(other[:, :3].T), :7], found[order, :7], atol=1e-9)
    back = np.concatenate([(again[:, :3] - (1, 2, 3)) @ R, again[:, 3:6] @ R, again[:, 6:]], axis=1)
    np.testing.assert_allclose(
        back[np.lexsort(np.round(back[:, :3], 6).T), 6], found[np.lexsort(np.round(found[:, :3], 6).T), 6], atol=1e-9
    )


def test_many_contacts_are_thinned_out_to_those_that_differ():
    z = np.random.default_rng(2).uniform(0, 0.01, (40, 40))
    found = over(z, (BOX, [2, 2, 0.2]), (4, 4, 0.21), d=(0.2, 0.2))
    assert 8 <= len(found) <= 24
    assert np.ptp(found[:, 0]) > 3
    assert np.ptp(found[:, 1]) > 3


@pytest.mark.parametrize(
    ("heights", "d", "told"),
    [(np.zeros((1, 5)), (1, 1), "two or more"), (FLAT * np.nan, (1, 1), "finite"), (FLAT, (0, 1), "greater than zero")],
)
def test_what_is_no_field_is_refused(heights, d, told):
    with pytest.raises(ModelError, match=told):
        height_field_rows(heights, *d)


LENS = '''"""Two caps of a sphere, base to base: what is within the radius of both of two centres on the z axis."""

from ...compiler.formulas import formula
from ...math.scalar import sqrt


KIND = 12


@formula
def support(G, i, d):
    """Parameters: radius of the spheres, distance of either centre from the middle plane."""
    r, c = G.dimensions.par[i, 0], G.dimensions.par[i, 1]
    s = sqrt(d[0] * d[0] + d[1] * d[1])
    n = sqrt(s * s + d[2] * d[2])
    z = -c if d[2] > 0.0 else c
    if r * abs(d[2]) > abs(z) * n:
        return (r * d[0] / n, r * d[1] / n, z + r * d[2] / n)
    rim = sqrt(r * r - c * c) / s
    return (rim * d[0], rim * d[1], 0.0)
'''


def test_a_convex_shape_that_is_added_rests_on_a_height_field(tmp_path):
    """One file, as docs/architecture.md says; run without compiling. A plane of the same height finds the same gap."""
    (tmp_path / "lens.py").write_text(LENS, encoding="utf-8")
    script = f"""
import json, numpy as np
import flyball.collision.shapes as shapes
shapes.__path__.append({str(tmp_path)!r})
from flyball.collision.shape_kinds import FIELD, PLANE
from flyball.collision.narrow_phase.dispatch import collide
from flyball.collision.narrow_phase.primitives import SCRATCH_ROWS
from flyball.collision.shapes.height_field import height_field_rows
from flyball.collision.tables import Movers
from tests.contact.scenes import geometry
rows, par = height_field_rows(np.zeros((5, 5)), 1.0, 1.0)
out = []
for ground, at in (((PLANE, []), (0, 0, 0)), ((FIELD, par, rows), (-2.2, -2.3, 0))):
    pose = np.array([[*at, *np.eye(3).ravel()], [0, 0, 0.29, *np.eye(3).ravel()]])
    G, room = geometry(ground, (12, [1.0, 0.7])), np.full((SCRATCH_ROWS, 8), np.nan)
    count = collide(G, Movers(pose, np.zeros((2, 6))), 0, 1, 0.1, room)
    out.append(room[:count, :7].tolist())
print(json.dumps(out))
"""
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    on_plane, on_field = json.loads(ended.stdout)
    want = [[0, 0, -0.005, 0, 0, 1, -0.01]]
    np.testing.assert_allclose(on_plane, want, atol=1e-9)
    np.testing.assert_allclose(on_field, want, atol=1e-9)
