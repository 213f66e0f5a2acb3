"""What cannot start, or cannot go on, is told apart: who asks for the same, what is in the way, and what to do."""

import numpy as np
import pytest

import flyball as fb
from tests.layers import both_layers

pytestmark = both_layers


def crank(angle=0.3):
    """A crank of 0.2 m and a rod of 0.5 m in the plane."""
    m = fb.Mechanism("crank", planar=True)
    c, s = 0.2 * np.cos(angle), 0.2 * np.sin(angle)
    x = c + np.sqrt(0.25 - s * s)
    m.add(fb.Body("crank", mass=1, inertia=0.01, position=(c / 2, s / 2)))
    m.add(fb.Body("rod", mass=1, inertia=0.01, position=((c + x) / 2, s / 2)))
    m.add(fb.Body("slider", mass=1, inertia=0.01, position=(x, 0)))
    m.add(fb.Revolute("A", "ground", "crank", at=(0, 0)), fb.Revolute("B", "crank", "rod", at=(c, s)))
    m.add(fb.Revolute("C", "rod", "slider", at=(x, 0)))
    m.add(fb.Translational("P", "ground", "slider", at=(x, 0), axis=(1, 0)))
    return m


def spatial(axis=(0, 1, 0)):
    """A four-bar in space whose hinge C has its own axis."""
    m = fb.Mechanism("four-bar")
    points = {"A": (0, 0, 0), "B": (0, 0, 0.2), "C": (0.5, 0, 0.5), "D": (0.6, 0, 0)}
    names = ("ground", "crank", "coupler", "rocker", "ground")
    for name in names[1:4]:
        m.add(fb.Body(name, mass=1, inertia=(0.01, 0.01, 0.01), position=(0.3, 0, 0.3)))
    for k, (name, at) in enumerate(points.items()):
        m.add(fb.Revolute(name, names[k], names[k + 1], at=at, axis=axis if name == "C" else (0, 1, 0)))
    return m


def triangle():
    m = fb.Mechanism("triangle", planar=True)
    m.add(
        fb.Body("a", mass=1, inertia=0.1, position=(0.25, 0.5)), fb.Body("b", mass=1, inertia=0.1, position=(0.75, 0.5))
    )
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=(0.5, 1)))
    m.add(fb.Revolute("C", "ground", "b", at=(1, 0)))
    return m


def driven(m, **laws):
    for name, (coordinate, law) in laws.items():
        m.add(fb.Driver(name, coordinate, law))
    return m


def refused(m):
    with pytest.raises((fb.AssemblyError, fb.SimulationError)) as caught:
        m.simulate(0.5)
    return str(caught.value)


def test_two_drivers_of_one_freedom():
    """Each with its rate in its own unit, and the rate that the rest gives it: dx/dphi of a slider-crank."""
    text = refused(driven(crank(), one=("A.angle", "2*t"), two=("P.displacement", "0.1*t")))
    c, s = 0.2 * np.cos(0.3), 0.2 * np.sin(0.3)
    slope = -s * (1 + c / np.sqrt(0.25 - s * s))
    assert "driver 'one' and driver 'two' move the same freedom through A, B, C, P and disagree" in text
    assert f"one prescribes 2 rad/s where the other constraints give {0.1 / slope:.6g}" in text
    assert f"two prescribes 0.1 m/s where the other constraints give {2 * slope:.6g}" in text
    assert "A, B" not in refused(driven(crank(), one=("A.angle", "2*t"), two=("A.angle", "3*t")))
    m = driven(crank(), one=("A.angle", "2*t"))
    m.add(fb.Initial("P.displacement", rate=0.1))
    assert "driver 'one' and the initial rate of 'P.displacement' move the same freedom" in refused(m)


@pytest.mark.parametrize("law", ["-0.1*t", "-0.1*t**2"])
def test_a_start_at_a_dead_centre(law):
    text = refused(driven(crank(0.0), push=("P.displacement", law)))
    assert "driver 'push' prescribes a motion of 'P.displacement' at a dead centre" in text
    assert "in this position A.angle does not change it, at neighbouring positions it does" in text
    assert "prescribe a motion of A.angle" in text


def test_a_coordinate_that_no_freedom_moves():
    text = refused(driven(crank(), lift=("slider.y", "0.1*t")))
    assert (
        "driver 'lift' prescribes a motion of 'slider.y', which no freedom changes, here or nearby; free is A.angle"
        in text
    )


def test_an_axis_that_is_not_like_the_others():
    text = refused(driven(spatial((0, 1, 0.2)), motor=("A.angle", "2*t")))
    assert "driver 'motor' has nothing to move: the constraints of A, B, C, D leave no freedom" in text
    assert "Counting leaves -2" in text
    assert "the axes of A, B, D are parallel, that of C is 11.3 deg off" in text
    assert spatial().simulate(0.01, outputs=2).health.freedoms == 1


def test_a_locked_triangle():
    text = refused(driven(triangle(), motor=("A.angle", "2*t")))
    assert "driver 'motor' has nothing to move: the constraints of A, B, C leave no freedom" in text
    assert "counting joints leaves 0: it is a structure" in text


def test_drivers_that_disagree_later():
    """At the start neither asks for anything; the first acceleration tells them apart."""
    text = refused(driven(crank(), one=("A.angle", "t**2"), two=("A.angle", "2*t**2")))
    assert (
        "one prescribes 2 rad/s^2 where the other constraints give 4; two prescribes 4 rad/s^2 where the other constraints give 2"
        in text
    )


def test_drivers_that_part_slowly():
    """They agree in all that the start looks at; it was told as a mechanism that may lock."""
    text = refused(driven(crank(), one=("A.angle", "t"), two=("A.angle", "t + 0.1*t**3")))
    assert "Driver 'one' and Driver 'two' both move A.angle and disagree from t = 0.00" in text
    assert "the second derivative of their laws there is 0 and 0.001" in text


def test_a_law_without_a_rate_at_the_start():
    text = refused(driven(crank(), one=("A.angle", "sqrt(t)")))
    assert "the law of Driver 'one' has the rate inf there" in text
