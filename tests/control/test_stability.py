"""Stable, marginal or unstable: every eigenvalue is judged by what it is uncertain by itself, however fast others are."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg

import flyball as fb
from tests.control.slide import slide

FAST = 1e-8  # [s]: a pole at -1e8/s


@pytest.mark.parametrize("damping", [2.0, 1e-3, 1e-6, 0.0])
def test_slow_poles_beside_a_fast_one(damping):
    """A spring behind a lag: s^2 + d s + 10 + 5/(1 + T s); the lag takes 5 T/2 of the damping."""
    m = slide(fb.Lag("lag", of="A.displacement", time=FAST), force="-5*lag")
    m.replace(fb.CoordinateSpring("spring", coordinate="A.displacement", stiffness=10, damping=damping))
    e = m.equilibrium()
    assert e.stability == ("stable" if damping > 5 * FAST else "unstable")
    w = m.linearize(about=e).eigenvalues
    assert w.real.max() == pytest.approx(5 * FAST / 2 - damping / 2, rel=1e-4)
    assert m.modes(about=e).frequency[0] == pytest.approx(np.sqrt(15 - damping**2 / 4) / (2 * np.pi), rel=1e-6)


def test_true_zeros_beside_a_fast_pole():
    fast = fb.Lag("fast", of="A.displacement_rate", time=FAST)
    still = slide(fast, fb.Integrator("idle", of="0*A.displacement"), force="0*idle - fast")
    assert still.equilibrium().stability == "marginal"
    free = slide(fast, force="-3*fast")
    free.replace(fb.CoordinateSpring("spring", coordinate="A.displacement", stiffness=0, damping=0))
    e = free.equilibrium()
    assert e.stability == "marginal"
    assert np.sort(free.linearize(about=e).eigenvalues.real) == pytest.approx([-1e8, -3, 0], rel=1e-6, abs=0)


@pytest.mark.parametrize(("rate", "said"), [(-1e-5, "stable"), (1e-5, "unstable"), (0.0, "marginal")])
def test_one_slow_state(rate, said):
    m = slide(fb.Lag("lag", of="A.displacement", time=FAST), fb.State("x", rate=f"{rate}*x"), force="x - lag")
    assert m.equilibrium().stability == said


@pytest.mark.parametrize(("factor", "said"), [(1 - 1e-9, "stable"), (1.0, "marginal"), (1 + 1e-9, "unstable")])
def test_multipliers_near_one(factor, said):
    m = slide(fb.State("x", next=f"{factor}*x", period=1e-3), fb.Lag("lag", of="x", time=1e-6), force="lag")
    assert m.equilibrium().stability == said


@pytest.mark.parametrize(("law", "said"), [("-value", "stable"), ("value", "unstable")])
def test_a_strong_damper_hides_no_slow_motion_without_controllers(law, said):
    """x'' + 1e5 x' + x = 0 decays with exp(-1e-5 t)."""
    m = fb.Mechanism("slide", planar=True)
    m.add(fb.Body("cart", mass=1.0, inertia=1.0))
    m.add(fb.Prismatic("A", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("damper", coordinate="A.displacement", damping=1e5))
    m.add(fb.Actuator("drive", coordinate="A.displacement", force=law))
    e = m.equilibrium()
    assert e.stability == said
    assert m.modes(about=e).kinds == ("decay" if said == "stable" else "unstable", "decay")


@pytest.mark.parametrize("goal", [0.0, 0.2, 0.123, 1e-9])
@pytest.mark.parametrize("kd", [12.0, 3.7])
def test_at_rest_without_loads(kd, goal):
    """Where nothing acts what is left is rounding: no rest was found, or a state's effect was lost in the linear model.

    Multipliers by the exponential of the slide with its lag, and by the formulas of the sampled PID.
    """
    m = fb.Mechanism("slide", planar=True, parameters={"goal": goal})
    m.add(fb.Body("cart", mass=2, inertia=1), fb.Prismatic("A", "ground", "cart", at=(0, 0), axis=(1, 0)))
    gains = {"kp": 80, "ki": 60, "kd": kd, "filter": 0.02, "period": 0.01}
    m.add(fb.PID("pid", setpoint="goal", measured="A.displacement", **gains))
    m.add(fb.Lag("f", of="A.rate", time=0.1), fb.Actuator("drive", "A.displacement", force="pid - 20*f"))
    e = m.equilibrium()
    assert (e.stability, e["A.displacement"]) == ("stable", pytest.approx(goal, abs=1e-15))
    w = m.linearize(["goal"], ["A.displacement"], about=e).eigenvalues
    F, T, E = 0.02, 0.01, scipy.linalg.expm(0.01 * np.array([[0, 1, 0, 0], [0, 0, -10, 0.5], [0, 10, -10, 0], [0] * 4]))
    X = np.eye(6)  # x, v, f; integral, what the derivative was, what was measured
    d = F / (F + T) * X[4] - kd / (F + T) * (X[0] + X[5])
    A = np.vstack([E[:3, :3] @ X[:3] + np.outer(E[:3, 3], X[3] - 80 * X[0] + d), X[3] - 60 * T * X[0], d, -X[0]])
    np.testing.assert_allclose(np.sort_complex(w), np.sort_complex(np.linalg.eigvals(A)), atol=1e-9)


@pytest.mark.parametrize("ratio", [1e-7, -1e-7, 3e-12])
def test_modes_and_equilibria_say_the_same(ratio):
    """A spring and a negative damper of so small a ratio: it grows, and both say so."""
    m = fb.Mechanism("slide", planar=True)
    m.add(fb.Body("cart", mass=1.0, inertia=1.0), fb.Prismatic("A", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.Actuator("drive", coordinate="A.displacement", force=f"-value + {2 * ratio}*rate"))
    e = m.equilibrium()
    assert e.stability == ("unstable" if ratio > 0 else "stable")
    assert m.modes(about=e).stable == (ratio < 0)
