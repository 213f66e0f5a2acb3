"""Watt's governor beyond Vyshnegradskii's boundary: the limit cycle of its two equations of motion, derived by hand."""

from __future__ import annotations

import runpy

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.mechanisms import EXAMPLES


@pytest.fixture(scope="module")
def governor():
    return runpy.run_path(str(EXAMPLES / "governor_criterion.py"))


def critical_damping(p: dict[str, float]) -> float:
    """The criterion of tests/symbolic/test_governor.py as an equation for the dashpot [N s/m]."""
    s, c = np.sin(p["alpha"]), np.cos(p["alpha"])
    ball, lifted = p["m"] * p["l"] ** 2, p["sleeve"] + p["valve"] / p["lever"] ** 2
    inertia = p["J"] + 2 * p["I"] + 2 * ball * s**2 + 8 * ball * c**2
    return 2 * p["k"] * c * (p["I"] + ball + 2 * lifted * p["l"] ** 2 * s**2) / (p["W"] * p["l"] * s**2 * inertia)


def rates(t: float, y: np.ndarray, p: dict[str, float]) -> list[float]:
    """Of the arms' angle, its rate, and the shaft's speed, by Lagrange's equations of two coordinates."""
    theta, rate, w = y
    s, c, l = np.sin(theta), np.cos(theta), p["l"]
    ball, lifted = p["m"] * l**2, p["sleeve"] + p["valve"] / p["lever"] ** 2
    arms = 2 * p["I"] + 2 * ball + 4 * lifted * l**2 * s**2
    force = 2 * ball * s * c * w**2 - 2 * (p["m"] + p["sleeve"]) * p["g"] * l * s
    force -= 4 * p["b"] * l**2 * s**2 * rate + 4 * lifted * l**2 * s * c * rate**2
    steam = -p["load"] * np.tanh(p["k"] * 2 * l * (np.cos(p["alpha"]) - c) / p["load"])
    turning = p["J"] + 2 * p["I"] + 2 * ball * s**2
    return [rate, force / arms, (steam - 4 * ball * s * c * rate * w) / turning]


def test_the_mechanism_swings_for_ever_on_the_boundary(governor):
    p = governor["P"]
    g = p["m"] * p["l"] * np.cos(p["alpha"]) * p["W"] ** 2 / (p["m"] + p["sleeve"])
    eigenvalues = governor["mechanism"](b=critical_damping(p), g=g).linearize(coordinates="joint").eigenvalues
    (swing,) = eigenvalues[eigenvalues.imag > 1e-3]
    assert abs(swing.real) < 1e-9 * abs(swing)


def test_beyond_the_boundary_any_start_ends_in_one_limit_cycle(governor):
    p = governor["P"] | {"b": 4.0}
    assert critical_damping(p) == pytest.approx(4.947, abs=1e-3)
    spans = []
    for speed in (7.8, 8.6):
        run = governor["mechanism"](b=4.0, W=speed).simulate(40, outputs=801, rtol=1e-10)
        start = [p["alpha"], 0.0, speed]
        own = solve_ivp(rates, (0, 40), start, t_eval=run.t, args=(p,), method="DOP853", rtol=1e-11, atol=1e-12)
        assert p["alpha"] + run["right hinge.angle"] == pytest.approx(own.y[0], abs=1e-6)
        assert run["shaft.angle_rate"] == pytest.approx(own.y[2], abs=1e-6)
        spans.append([np.ptp(run[name][-200:]) for name in ("shaft.angle_rate", "guide.displacement")])
    assert spans[0] == pytest.approx(spans[1], rel=5e-3)  # of the output times
    assert spans[0] == pytest.approx([1.19, 0.213], rel=5e-3)


def test_within_the_boundary_it_comes_to_rest(governor):
    run = governor["mechanism"](b=6.0, W=8.0).simulate(60, outputs=601)
    assert np.ptp(run["shaft.angle_rate"][-100:]) < 1e-4
