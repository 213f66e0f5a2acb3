"""Every pair of solids: gaps are true distances, proven from both sides; the same from either side and anywhere.

A direction along which the solids are g apart says that their distance is at least g; points of both that are g from
each other, that it is at most g. For overlaps the first says that g is at most the depth; that it is least is compared
with ``coal``, where that is exact.
"""

from __future__ import annotations

import coal
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flyball.collision.shape_kinds import BOX, CAPSULE, CONE, CYLINDER, PLANE, SPHERE
from tests.contact.scenes import contacts, turned
from tests.contact.solids import SOLIDS, outside, rotation, separation, solid, two

I, O = np.eye(3), np.zeros(3)
PAIRS = [(a, b) for i, a in enumerate(SOLIDS) for b in list(SOLIDS)[i:] if a != "plane" or b != "plane"]
EXACT = {SPHERE, PLANE, BOX, CAPSULE}
lengths = st.floats(1e-3, 1e3)
places = st.tuples(*[st.floats(-10, 10)] * 3).map(np.array)


def accuracy(a, b):
    """Points of faces count as equally deep within some millionths of the size; elsewhere there are none to choose."""
    return 1e-10 if a[0] == SPHERE or {a[0], b[0]} <= {PLANE, CAPSULE} else 5e-6


def check(a, b, at_a, at_b, found):
    """At most four points, all within both solids but for their gap, the smallest gap separates."""
    assert 1 <= len(found) <= 4
    assert np.isfinite(found).all()
    np.testing.assert_allclose(np.linalg.norm(found[:, 3:6], axis=1), 1, atol=1e-12)
    assert len(set(found[:, 7])) == len(found)
    for x, n, g in zip(found[:, :3], found[:, 3:6], found[:, 6], strict=True):
        for shape, (p, R), side in ((a, at_a, -0.5), (b, at_b, 0.5)):
            assert outside(shape, R.T @ (x + side * g * n - p)) < 1e-5
    first = found[found[:, 6].argmin()]
    n = at_a[1][:, 2] if a[0] == PLANE else first[3:6]
    np.testing.assert_allclose(separation(a, b, at_a, at_b, n), first[6], rtol=0, atol=accuracy(a, b))


@pytest.mark.parametrize(("a", "b"), PAIRS)
def test_gaps_are_distances(a, b):
    rng = np.random.default_rng(7)
    for _ in range(60):
        A, B, at_a, at_b = two(SOLIDS[a], SOLIDS[b], rng)
        found = contacts(A, B, at_a, at_b)
        if A[0] == SPHERE and B[0] == PLANE:
            A, B, at_a, at_b, found = B, A, at_b, at_a, found * [1, 1, 1, -1, -1, -1, 1, 1]
        check(A, B, at_a, at_b, found)


@pytest.mark.parametrize(("a", "b"), PAIRS)
def test_the_order_of_the_shapes_does_not_matter(a, b):
    rng = np.random.default_rng(8)
    for _ in range(20):
        A, B, at_a, at_b = two(SOLIDS[a], SOLIDS[b], rng)
        one, other = contacts(A, B, at_a, at_b, 0.3), contacts(A, B, at_a, at_b, 0.3, exchange=True)
        assert (len(one) > 0) == (len(other) > 0)
        if len(one):
            np.testing.assert_allclose(one[:, 6].min(), other[:, 6].min(), rtol=0, atol=accuracy(A, B))


@pytest.mark.parametrize(("a", "b"), PAIRS)
def test_contacts_move_with_the_shapes(a, b):
    rng = np.random.default_rng(9)
    for _ in range(20):
        A, B, (p, R), (q, Q) = two(SOLIDS[a], SOLIDS[b], rng)
        t, T = 10 * rng.normal(size=3), rotation(rng)
        one = contacts(A, B, (p, R), (q, Q), 0.3)
        other = contacts(A, B, (t + T @ p, T @ R), (t + T @ q, T @ Q), 0.3)
        assert (len(one) > 0) == (len(other) > 0)
        if len(one):
            np.testing.assert_allclose(one[:, 6].min(), other[:, 6].min(), rtol=0, atol=accuracy(A, B))


def of_coal(shape, p, R):
    kind, s = shape
    made = {
        SPHERE: lambda: coal.Sphere(s[0]),
        PLANE: lambda: coal.Halfspace(np.array([0, 0, 1.0]), 0.0),
        BOX: lambda: coal.Box(*(2 * s)),
        CAPSULE: lambda: coal.Capsule(s[0], 2 * s[1]),
    }[kind]()
    return made, coal.Transform3s(R, p)


@pytest.mark.parametrize(("a", "b"), [(a, b) for a, b in PAIRS if {SOLIDS[a], SOLIDS[b]} <= EXACT])
def test_least_depths_agree_with_coal(a, b):
    rng = np.random.default_rng(10)
    asked = coal.DistanceRequest()
    asked.enable_signed_distance = True
    asked.gjk_tolerance = asked.epa_tolerance = 1e-10
    for _ in range(60):
        A, B, at_a, at_b = two(SOLIDS[a], SOLIDS[b], rng)
        theirs = coal.distance(*of_coal(A, *at_a), *of_coal(B, *at_b), asked, coal.DistanceResult())
        np.testing.assert_allclose(contacts(A, B, at_a, at_b)[:, 6].min(), theirs, rtol=0, atol=5e-6)


@given(lengths, lengths, places, places)
def test_spheres(r, s, p, q):
    (found,) = contacts((SPHERE, [r]), (SPHERE, [s]), (p, I), (q, I))
    np.testing.assert_allclose(found[6], np.linalg.norm(q - p) - r - s, rtol=1e-12, atol=1e-12)


@given(lengths, st.tuples(lengths, lengths), st.floats(-10, 10), st.floats(-10, 10))
def test_sphere_and_cylinder(r, size, x, z):
    (found,) = contacts((SPHERE, [r]), (CYLINDER, size), ((x, 0, z), I), (O, I))
    u, v = abs(x) - size[0], abs(z) - size[1]
    away = max(u, v) if u <= 0 and v <= 0 else np.hypot(max(u, 0), max(v, 0))
    np.testing.assert_allclose(found[6], away - r, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("a", "b"), PAIRS)
def test_one_inside_the_other_at_the_same_place(a, b):
    """Nothing tells which way to go: any will do that parts them."""
    rng = np.random.default_rng(11)
    for _ in range(5):
        A, B = solid(SOLIDS[a], rng), solid(SOLIDS[b], rng)
        R = rotation(rng)
        for Q in (R, R @ turned((1, 0, 0), np.pi / 2)):
            found = contacts(A, B, (O, R), (O, Q))
            at_a, at_b = (O, R), (O, Q)
            if A[0] == SPHERE and B[0] == PLANE:
                A, B, at_a, at_b, found = B, A, at_b, at_a, found * [1, 1, 1, -1, -1, -1, 1, 1]
            check(A, B, at_a, at_b, found)
            assert found[:, 6].min() <= 0


@pytest.mark.parametrize(("a", "b"), PAIRS)
def test_what_is_no_number_touches_nothing(a, b):
    A, B = solid(SOLIDS[a], np.random.default_rng(1)), solid(SOLIDS[b], np.random.default_rng(2))
    assert len(contacts(A, B, (O, I), ((0, np.nan, 0), I), 0.1)) == 0
    assert len(contacts(A, B, (O, I), ((0, 0, np.inf), I), 0.1)) == 0


@pytest.mark.parametrize("kind", [BOX, CYLINDER, CONE, CAPSULE])
def test_far_from_the_origin(kind):
    """The place in the world costs no digits but those of the place itself."""
    shape = solid(kind, np.random.default_rng(3))
    far = np.array([1e6, -3e6, 2e6])
    step = np.array([0.25, 0.125, 2.0])
    near = contacts(shape, shape, (O, I), (step, I), 10)
    np.testing.assert_allclose(contacts(shape, shape, (far, I), (far + step, I), 10)[:, 6], near[:, 6], atol=1e-12)
