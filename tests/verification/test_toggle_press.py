"""The toggle press at rest, by the equilibrium of knee and ram and by virtual work; its energy on the way."""

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from tests.layers import both_layers, cached
from tests.mechanisms import G, example

pytestmark = both_layers

ARM, GAP, STROKE, OPEN = 0.25, 0.05, 0.112, np.radians(30)
FOOT = np.array([-0.55, -0.32])
RESISTANCE = PchipInterpolator(
    1e-3 * np.array([0, 2, 5, 9, 14, 20]), 1e3 * np.array([0, 3, 9, 19, 36, 64]), extrapolate=False
)


def resistance(travel):
    return np.nan_to_num(RESISTANCE(np.asarray(travel) - GAP))


def knee(slope):
    return np.array([-ARM * np.sin(slope), -ARM * np.cos(slope)])


def cylinder(slope):
    """Its length where the links slope so much."""
    d = knee(slope) - FOOT
    return np.sqrt(d @ d)


def travel(slope):
    return 2 * ARM * (np.cos(slope) - np.cos(OPEN))


def potential(slope):
    """Of the weights: links, ram, barrel and rod."""
    x, y = knee(slope)
    along = (knee(slope) - FOOT) / cylinder(slope)
    heights = (4, y / 2), (4, 1.5 * y), (20, 2 * y), (5, FOOT[1] + 0.12 * along[1]), (2, y - 0.12 * along[1])
    return G * sum(m * h for m, h in heights)


CLOSED = brentq(lambda s: cylinder(s) - cylinder(OPEN) - STROKE, 0.0, OPEN, xtol=1e-15)


@cached
def press(weightless=False):
    m = example("toggle_press.toml")
    if weightless:
        m.gravity = (0.0, 0.0)
    return m.simulate(3.0, rtol=1e-10, atol=1e-12, outputs=301)


def resting(r):
    return slice(101, 150)  # between 1 s and 1.5 s


def test_it_closes_as_drawn_by_hand():
    """Slope, travel and resistance with the cylinder out, from the triangle that the cylinder closes."""
    r = press()
    assert 0 < CLOSED < np.radians(2)
    assert r["top.angle"][resting(r)] == pytest.approx(OPEN + OPEN - CLOSED, abs=1e-11)
    assert r["guide.displacement"][resting(r)] == pytest.approx(travel(CLOSED), abs=1e-12)
    assert -r["workpiece"].force[resting(r)] == pytest.approx(resistance(travel(CLOSED)), rel=1e-9)


def test_force_ratio_without_weights():
    """At the knee F (cos g - sin g tan s) = 2 R tan s: s the links' slope, g the cylinder's (equilibrium of pins)."""
    r = press(weightless=True)
    d = knee(CLOSED) - FOOT
    g = np.arctan2(d[1], d[0])
    F, R = r["pump.effort"][resting(r)], resistance(travel(CLOSED))
    tan = np.tan(CLOSED)
    assert F * (np.cos(g) - np.sin(g) * tan) == pytest.approx(2 * R * tan, rel=1e-8)
    assert R / F[0] > 15  # what a toggle is for
    lower = r["wrist"].force[resting(r)]  # on the ram, by the lower link, along which it acts
    assert lower[:, 1] == pytest.approx(-R, rel=1e-9)
    assert lower[:, 0] == pytest.approx(R * tan, rel=1e-8)


def test_force_at_rest_with_weights():
    """Virtual work: F dc = R dh + dV for a small change of the slope."""
    r = press()
    h = 1e-5
    c, s, v = ((f(CLOSED + h) - f(CLOSED - h)) / (2 * h) for f in (cylinder, travel, potential))
    expected = (resistance(travel(CLOSED)) * s + v) / c
    assert r["pump.effort"][resting(r)] == pytest.approx(expected, rel=1e-7)


def test_work_of_the_workpiece():
    """What it has taken at any travel is the integral of its table, and all energies balance.

    Motion and reactions do not depend on the steps here, but works are integrated over them: they have to be short
    against the table's kinks.
    """
    r = example("toggle_press.toml").simulate(3.0, outputs=301, max_step=1e-3)
    area = RESISTANCE.antiderivative()
    squeezed = np.maximum(r["guide.displacement"] - GAP, 0.0)
    assert area(squeezed).max() > 300
    assert -r["workpiece"].work == pytest.approx(area(squeezed), abs=1e-3)
    assert r["pump"].work[-1] == pytest.approx(0.0, abs=1e-3)  # open again: the table gives back what it took
    assert r.energy.drift < 1e-5
