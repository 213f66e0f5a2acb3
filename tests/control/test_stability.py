"""Stable, marginal or unstable: every eigenvalue is judged by what it is uncertain by itself, however fast others are."""

from __future__ import annotations

import numpy as np
import pytest

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
