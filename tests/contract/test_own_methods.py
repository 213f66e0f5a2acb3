"""Explicit Runge-Kutta methods of a user's own, given as data."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flyball as fb
from flyball.elements import runge_kutta
from tests.layers import both_layers

METHODS = {
    "heun": {"A": [[], [1]], "b": [1 / 2, 1 / 2], "order": 2, "embedded": [1, 0]},
    "bogacki-shampine": {
        "A": [[], [1 / 2], [0, 3 / 4]],
        "b": [2 / 9, 1 / 3, 4 / 9],
        "order": 3,
        "embedded": [7 / 24, 1 / 4, 1 / 3, 1 / 8],
    },
    "classical": {"A": [[], [1 / 2], [0, 1 / 2], [0, 0, 1]], "b": [1 / 6, 1 / 3, 1 / 3, 1 / 6], "order": 4},
}


@pytest.fixture(autouse=True)
def _defined(built_in_methods):
    for name, given in METHODS.items():
        runge_kutta(name, **given)


def pendulum():
    """A rod that swings about one end from the horizontal: theta'' = -3/2 g/l cos(theta)."""
    m = fb.Mechanism("pendulum", gravity=(0, -9.81), planar=True)
    m.add(fb.Body("rod", mass=1, inertia=1 / 12, position=(0.5, 0)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    return m


def angle(t):
    """Its angle by another integrator."""
    y = solve_ivp(
        lambda _, y: (y[1], -1.5 * 9.81 * np.cos(y[0])), (0, max(t)), (0, 0), t_eval=t, rtol=1e-12, atol=1e-13
    )
    return y.y[0]


@both_layers
@pytest.mark.parametrize("name", METHODS)
def test_with_steps_half_as_wide_errors_fall_as_the_order_says(name):
    t = np.array([0.0, 0.4, 0.8])
    off = [
        np.abs(pendulum().simulate(0.8, outputs=list(t), method=name, step=h)["A.angle"] - angle(t)).max()
        for h in (0.01, 0.005, 0.0025)
    ]
    order = METHODS[name]["order"]
    np.testing.assert_allclose(np.log2(np.array(off[:-1]) / off[1:]), order, atol=0.25)


@both_layers
@pytest.mark.parametrize("name", ["heun", "bogacki-shampine"])
def test_errors_follow_the_tolerance_between_steps_too(name):
    t = np.linspace(0.0, 1.0, 41)
    r = pendulum().simulate(1.0, outputs=list(t), method=name, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(r["A.angle"], angle(t), atol=1e-4)
    assert r.energy.drift < 1e-3


@pytest.mark.parametrize("name", ["bogacki-shampine", "classical"])
def test_events_are_found(name):
    """A ball that falls by 1 m and bounces: at sqrt(2 h / g) it is at the floor."""
    m = fb.Mechanism("bounce", planar=True, gravity=(0, -10))
    m.add(
        fb.Body("b", mass=1, inertia=1, position=(0, 1)), fb.Translational("S", "ground", "b", at=(0, 0), axis=(0, 1))
    )
    m.add(fb.Limit("floor", coordinate="S.displacement", lower=-1, restitution=0.5))
    more = {"step": 0.01} if name == "classical" else {"rtol": 1e-7}
    r = m.simulate(0.6, outputs=7, method=name, **more)
    at = np.sqrt(0.2)
    after = 0.6 - at
    assert r["S.displacement"][-1] == pytest.approx(-1 + 0.5 * 10 * at * after - 5 * after**2, abs=1e-6)


def test_a_method_without_stages_within_a_step_finds_no_events():
    m = pendulum()
    m.add(fb.Limit("stop", coordinate="A.angle", lower=-1))
    with pytest.raises(fb.ModelError, match=r"has 0 stages between the ends of a step; to find events .* it needs two"):
        m.simulate(0.6, method="heun")


def test_a_higher_order_has_its_own_dense_output():
    """Dormand and Prince's pair is what flyball has as rk45."""
    from flyball.numerics.integrators.butcher_tableaux import tableau

    R = tableau("rk45")
    A = [row[:6] for row in R.A[:6]]
    given = {"b": R.A[6, :6], "order": 5, "embedded": np.append(R.A[6, :6], 0.0) - R.E[0]}
    with pytest.raises(fb.ModelError, match="of an order above 4 give dense"):
        runge_kutta("dormand-prince", A, **given)
    runge_kutta("dormand-prince", A, **given, dense=R.P)
    known, found = (
        pendulum().simulate(1.0, outputs=11, method=x, specialize=False) for x in ("rk45", "dormand-prince")
    )
    np.testing.assert_allclose(found["A.angle"], known["A.angle"], atol=1e-9)


WRONG = {
    "order": ({"A": [[], [1]], "b": [0.5, 0.4], "order": 2}, "for order 2 sum b_i must be 1, and is 0.9"),
    "second": ({"A": [[], [0.5]], "b": [0.5, 0.5], "order": 2}, "for order 2 sum b_i c_i must be 0.5, and is 0.25"),
    "implicit": ({"A": [[0.5], [1]], "b": [0.5, 0.5], "order": 2}, "with zeros on and above the diagonal"),
    "embedded": (METHODS["heun"] | {"embedded": [0.5, 0.4]}, "embedded: for order 1 sum b_i must be 1, and is 0.9"),
    "length": (METHODS["heun"] | {"embedded": [1]}, "embedded must have 2 or 3 numbers, got 1"),
    "no order": (METHODS["heun"] | {"order": 0}, "order must be a whole number from 1 on, got 0"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_refused(case):
    given, message = WRONG[case]
    with pytest.raises(fb.ModelError, match=f"Runge-Kutta method 'wrong'.*{message}"):
        runge_kutta("wrong", **given)


def test_names_and_steps():
    for name in ("rk45", "radau"):
        with pytest.raises(fb.ModelError, match="there is another method of that name"):
            runge_kutta(name, **METHODS["heun"])
    with pytest.raises(fb.ModelError, match="there is another method of that name"):
        runge_kutta("heun", **METHODS["classical"])
    with pytest.raises(fb.ModelError, match="method='classical' does not estimate its error: give the step size"):
        pendulum().simulate(0.1, method="classical")
