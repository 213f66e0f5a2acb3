"""Events on rates of what something holds: rounding of what holds passes no zero, and what is let go does."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import flyball as fb
from tests.layers import both_layers

pytestmark = both_layers
METHODS = ({"method": "dop853"}, {"method": "radau", "rtol": 1e-8}, {"method": "generalised-alpha", "step": 2e-3})


def two(when: str, *more) -> fb.Mechanism:
    """A mass and another that is pushed, a stiff spring between."""
    m = fb.Mechanism("two", planar=True, gravity=(0, 0))
    for i in range(2):
        m.add(fb.Body(f"b{i}", mass=1, inertia=1, position=(i, 0)))
        m.add(fb.Prismatic(f"s{i}", "ground", f"b{i}", at=(i, 0), axis=(1, 0)))
    m.add(fb.SpringDamper("s", "b0", "b1", at=[(0, 0), (1, 0)], stiffness=1e4, damping=100))
    m.add(fb.Actuator("a", "s1.displacement", force="5*sin(4*t)"), *more)
    m.add(fb.Event("e", when, direction="either"))
    return m


def own(r) -> list[float]:
    return [e.t for e in r.events if e.name == "e"]


@pytest.mark.parametrize("kw", METHODS)
def test_rounding_of_what_a_brake_holds_is_no_event(kw):
    brake = fb.Brake("brake", "s0.displacement", capacity=7.0)
    for when in ("b0.vx", "1e6*b0.vx"):
        assert own(two(when, brake).simulate(2, outputs=3, **kw)) == []


def test_what_else_the_law_names_passes_zero():
    """x'' = 5 sin 4 t - 100 x' - 1e4 x from rest: at last the rate is as cos(4 t - phase)."""
    r = two("b1.vx + 3*b0.vx", fb.Brake("brake", "s0.displacement", capacity=7.0)).simulate(2, outputs=3, rtol=1e-10)
    phase = np.arctan2(400, 1e4 - 16)
    late = [(np.pi * (k + 0.5) + phase) / 4 for k in range(3)]
    assert [t for t in own(r) if t > 0.3] == pytest.approx([t for t in late if t < 2], abs=1e-8)


@pytest.mark.parametrize("kw", METHODS)
def test_what_is_let_go_passes_zero(kw):
    """Locked until t = 0.5; then v = sin 2 t - sin 1."""
    m = fb.Mechanism("m", planar=True, gravity=(0, 0))
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("s", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.Event("lock", "t > 0.1", do=[fb.Lock("s")]), fb.Event("free", "t > 0.5", do=[fb.Release("s")]))
    m.add(fb.Actuator("a", "s.displacement", force="2*cos(2*t)"), fb.Event("e", "b.vx", direction="either"))
    v = brentq(lambda t: np.sin(2 * t) - np.sin(1.0), 0.8, 1.5)
    again = 0.5 + np.pi
    assert own(m.simulate(4, outputs=3, **kw)) == pytest.approx([v, again], abs=1e-5 if "step" in kw else 1e-6)


@pytest.mark.parametrize("kw", METHODS)
def test_what_cannot_move_for_a_moment_passes_zero(kw):
    """A link that turns on one that is held: the rate of its centre along itself is -sin(t) / 2."""
    m = fb.Mechanism("m", planar=True, gravity=(0, 0))
    m.add(fb.Body("l1", mass=1, inertia=0.1, position=(0, -0.5)))
    m.add(fb.Body("l2", mass=1, inertia=0.1, position=(0.5, -1), angular_velocity=1.0, velocity=(0, 0.5)))
    m.add(fb.Revolute("r1", "ground", "l1", at=(0, 0)), fb.Revolute("r2", "l1", "l2", at=(0, -1)))
    m.add(fb.Brake("brake", "r1.angle", capacity=100.0), fb.Event("e", "l2.vx", direction="either"))
    assert own(m.simulate(7, outputs=3, **kw)) == pytest.approx([np.pi, 2 * np.pi], abs=1e-5)
