"""Modes that no input moves and that no output shows: closed forms, and gains by python-control."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.numerics.reachability import unreachable_modes

G = 9.81


def two_pendulums(second: float = 0.5) -> fb.Mechanism:
    m = fb.Mechanism("crane", planar=True, gravity=(0, -G))
    m.add(fb.Body("cart", mass=3, inertia=1), fb.Prismatic("rail", "ground", "cart", at=(0, 0), axis=(1, 0)))
    for name, length in (("A", 0.5), ("B", second)):
        m.add(fb.Body(f"bob{name}", mass=1, inertia=0, position=(0, -length)))
        m.add(fb.Revolute(name, "cart", f"bob{name}", at=(0, 0)))
    m.add(fb.PointForce("push", "cart", at=(0, 0), force=("0", 0)))
    return m


def test_the_difference_of_equal_pendulums_follows_no_force_on_their_cart():
    x = two_pendulums().linearize(["push.x"], ["A.angle"], coordinates="joint")
    ((value, shape),) = x.uncontrollable_modes()
    assert value == pytest.approx(1j * np.sqrt(G / 0.5), rel=1e-9)
    assert {"A.angle", "B.angle"} <= set(shape)
    assert shape["A.angle"] == pytest.approx(-shape["B.angle"])
    assert "rail.displacement" not in shape
    text = dict(x.lines())
    assert "not controllable" in text
    assert "not observable" in text  # the position of the cart


def test_what_an_angle_does_not_show_is_the_place_of_the_cart():
    x = two_pendulums(0.8).linearize(["push.x"], ["A.angle", "rail.displacement"], coordinates="joint")
    assert x.uncontrollable_modes() == []
    hidden = x.unobservable_modes("A.angle")
    assert [abs(w) for w, _ in hidden] == pytest.approx([0, 0], abs=1e-6)
    assert set(hidden[0][1]) <= {"rail.displacement", "rail.displacement rate"}
    assert x.unobservable_modes("rail.displacement") == []
    assert x.unobservable_modes() == []


def test_an_inner_torque_does_not_change_the_momentum():
    """Of two coupled pendulums on a cart: 5 kg x' + 0.5 kg m A' + 0.8 kg m B', with B' = -A'."""
    m = two_pendulums(0.8)
    m.add(fb.PointTorque("twist", "bobA", torque="0"), fb.Coupler("C", ["A.angle", "B.angle"], weights=[1, 1]))
    x = m.linearize(["twist"], ["A.angle"], coordinates="joint")
    found = x.uncontrollable_modes()
    assert [abs(w) for w, _ in found] == pytest.approx([0, 0], abs=1e-6)
    for _, shape in found:
        assert shape == pytest.approx({"rail.displacement rate": 1, "A.angle rate": -0.3 / 5})


@pytest.mark.parametrize("seed", range(20))
def test_random_systems_with_known_parts(seed):
    """An uncontrollable block behind a random change of coordinates with uneven units."""
    rng = np.random.default_rng(seed)
    n, k, m = 7, int(rng.integers(0, 5)), int(rng.integers(1, 4))
    A, B = rng.standard_normal((n, n)), rng.standard_normal((n, m))
    A[n - k :, : n - k], B[n - k :] = 0.0, 0.0
    T = np.linalg.qr(rng.standard_normal((n, n)))[0] * 10.0 ** rng.uniform(-3, 3, n)
    values, vectors = unreachable_modes(np.linalg.solve(T, A @ T), np.linalg.solve(T, B))
    assert len(values) == k
    left = np.sort_complex(np.linalg.eigvals(A[n - k :, n - k :]))
    np.testing.assert_allclose(np.sort_complex(values), left, rtol=1e-6, atol=1e-6)
    if k:
        rest = vectors.T @ np.linalg.solve(T, A @ T) - values[:, None] * vectors.T
        assert np.abs(rest).max() < 1e-6 * np.abs(vectors.T @ np.linalg.solve(T, A @ T)).max()


def test_gains_of_a_regulator_by_python_control():
    """An inverted pendulum on a cart: the closed loop is stable, with gains in the order of the states."""
    control = pytest.importorskip("control")
    m = fb.Mechanism("inverted", planar=True, gravity=(0, -G))
    m.add(fb.Body("cart", mass=1, inertia=1), fb.Body("rod", mass=0.2, inertia=0.006, position=(0, 0.3)))
    m.add(fb.Prismatic("rail", "ground", "cart", at=(0, 0), axis=(1, 0)), fb.Revolute("pin", "cart", "rod", at=(0, 0)))
    m.add(fb.PointForce("push", "cart", at=(0, 0), force=("0", 0)))
    x = m.linearize(["push.x"], ["rail.displacement", "pin.angle"], coordinates="joint")
    assert x.uncontrollable_modes() == x.unobservable_modes() == []
    K, _, closed = control.lqr(x.to_control(), np.diag([10, 10, 1, 1]), [[1]])
    np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(x.A - x.B @ K)), np.sort_complex(closed), rtol=1e-6)
    assert closed.real.max() < 0
    L, _, estimator = control.lqe(x.A, x.B, x.C, [[1]], np.diag([1e-4, 1e-4]))
    assert estimator.real.max() < 0
    assert L.shape == (4, 2)
