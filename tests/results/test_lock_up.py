"""A warning before a driver locks a mechanism, and none where velocities grow for another reason."""

import numpy as np
import pytest

import flyball as fb

SPEED = 0.5


def pulled_crank(law=f"{SPEED}*t", driven="D.displacement"):
    """Crank of 1 m and rod of 2 m; the slider is pulled from sqrt(3) m towards 3 m, where both are in line."""
    m = fb.Mechanism("pulled crank", planar=True)
    m.add(fb.Body("crank", mass=1, inertia=0.01, position=(0, 0.5)))
    m.add(fb.Body("rod", mass=1, inertia=0.1, position=(np.sqrt(3) / 2, 0.5)))
    m.add(fb.Body("slider", mass=1, inertia=0.1, position=(np.sqrt(3), 0)))
    m.add(fb.Revolute("A", "ground", "crank", at=(0, 0)), fb.Revolute("B", "crank", "rod", at=(0, 1)))
    m.add(fb.Revolute("C", "rod", "slider", at=(np.sqrt(3), 0)))
    m.add(fb.Prismatic("D", "ground", "slider", at=(0, 0), axis=(1, 0)))
    m.add(fb.Driver("d", driven, law))
    return m


def growth(run):
    return [w for w in run.health.warnings if "locks" in w]


def test_warns_before_the_mechanism_locks():
    locks = (3.0 - np.sqrt(3.0)) / SPEED
    (text,) = growth(pulled_crank().simulate(0.99 * locks))
    near = float(text.split("near t = ")[1].split(" s")[0])
    assert near == pytest.approx(locks, rel=2e-3)
    assert "B.angle" in text
    assert "m.singularities()" in text


def test_silent_far_from_it():
    assert not growth(pulled_crank().simulate(1.5))


def test_silent_where_the_driver_turns_back():
    assert not growth(pulled_crank("0.6*sin(t)").simulate(3.0))


def test_silent_for_a_crank_through_its_dead_centres():
    m = pulled_crank("-2*t", "A.angle")
    for t in (0.7, 1.0, 2.0):
        assert not growth(m.simulate(t))


@pytest.mark.parametrize("law", ["exp(3*t)", "t**2", "t**6", "step(t, 0, 0, 1, 5)"])
def test_silent_for_growth_that_is_asked_for(law):
    m = fb.Mechanism("wheel", planar=True)
    m.add(fb.Body("wheel", mass=1, inertia=1), fb.Revolute("A", "ground", "wheel", at=(0, 0)))
    m.add(fb.Driver("d", "A.angle", law))
    for t in (0.3, 0.5, 1.0, 2.0):
        assert not growth(m.simulate(t))
