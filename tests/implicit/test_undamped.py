"""Swings that are too fast for the steps that all else asks for, and that nothing damps: followed, not damped away."""

import numpy as np
import pytest

import flyball as fb

SOFT, SPEED = 10.0, 0.1


def three(k, *more):
    """A on a soft spring; D, strongly damped, what makes it stiff; B on a spring of k, undamped; 1 kg each."""
    m = fb.Mechanism("m", planar=True, gravity=(0, 0))
    for n in "abd":
        m.add(fb.Body(n, mass=1, inertia=1), fb.Prismatic(n.upper(), "ground", n, at=(0, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("soft", "A.displacement", stiffness=SOFT))
    m.add(fb.CoordinateSpring("hard", "B.displacement", stiffness=k))
    m.add(fb.CoordinateSpring("oil", "D.displacement", stiffness=1e5, damping=1e5))
    m.add(fb.Initial("A.displacement", value=0.5), fb.Initial("D.displacement", value=0.1))
    m.add(*more)
    return m


@pytest.mark.parametrize(("k", "rtol", "near"), [(1e8, 1e-3, 0.05), (1e8, 1e-5, 2e-3), (1e10, 1e-5, 2e-3)])
def test_a_blow_swings_on(k, rtol, near):
    """J / sqrt(k m), from the first moment on, for hundreds of swings; what else moves is not disturbed."""
    w = np.sqrt(k)
    m = three(k, fb.Event("blow", "t > 1", do=[fb.Impulse("b", (SPEED, 0))]))
    r = m.simulate(1 + 2000 / w, outputs=np.r_[0, 1 + np.linspace(1 / w, 2000 / w, 401)], rtol=rtol, method="radau")
    swing = np.hypot(r["B.displacement"] * w, r["B.displacement_rate"])[1:]
    assert swing[:40] == pytest.approx(SPEED, rel=0.02)
    assert swing == pytest.approx(SPEED, rel=near)
    assert r["A.displacement"] == pytest.approx(0.5 * np.cos(np.sqrt(SOFT) * r.t), abs=rtol)


@pytest.mark.parametrize("method", ["radau", "auto"])
@pytest.mark.parametrize(("k", "rtol"), [(1e8, 1e-3), (1e8, 1e-5), (1e10, 1e-5), (1e12, 1e-7)])
def test_a_push_within_a_step_excites_what_it_should(k, rtol, method):
    """50 (1 + tanh) of the way of another body: B swings about 100 / k by (100 / k) x / sinh x, x = pi w s / 2."""
    w = np.sqrt(k)
    s = 0.1 / w
    m = three(k, fb.Body("g", mass=1, inertia=1, velocity=(1, 0)))
    m.add(fb.Prismatic("G", "ground", "g", at=(0, 0), axis=(1, 0)), fb.Sensor("way", "G.displacement"))
    m.add(fb.Actuator("push", "B.displacement", force=f"50*(1 + tanh((way - 1)/{s}))"))
    r = m.simulate(1 + 500 / w, outputs=np.r_[0, 1 + np.linspace(10 / w, 500 / w, 101)], rtol=rtol, method=method)
    x = np.pi * w * s / 2
    swing = np.hypot(r["B.displacement"] * k - 100, r["B.displacement_rate"] * w)[1:]
    assert swing == pytest.approx(100 * x / np.sinh(x), rel=0.05)


def test_what_is_damped_costs_few_steps():
    """As a blow on D: it has crept to where nothing is seen of it in 1e-5 s; x = v m / c."""
    m = three(1e8, fb.Event("blow", "t > 1", do=[fb.Impulse("d", (SPEED, 0))]))
    r = m.simulate(2, outputs=[0, 0.9, 1.0001], rtol=1e-5, method="radau")
    plain = three(1e8).simulate(2, outputs=[0, 0.9, 1.0001], rtol=1e-5, method="radau")
    assert r.health.steps < plain.health.steps + 60
    assert r["D.displacement"][2] - plain["D.displacement"][2] == pytest.approx(SPEED / 1e5, rel=1e-2)
