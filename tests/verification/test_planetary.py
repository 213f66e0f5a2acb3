"""The planetary gear train: Willis' ratio, torques, and its acceleration in closed form."""

import numpy as np
import pytest

from tests.layers import both_layers, cached
from tests.mechanisms import example

pytestmark = both_layers

SUN, PLANET, RING, MODULE = 24, 18, 60, 0.005
RATIO = 1 + RING / SUN  # sun to carrier, the ring at rest (Willis 1841)
TORQUE, BRAKE = 2.0, 0.35


@cached
def train(planets=3):
    return example("planetary.py", planets=planets).simulate(4.0, rtol=1e-11, atol=1e-13, outputs=81)


def test_willis():
    """(w_sun - w_carrier) / (w_ring - w_carrier) = - z_ring / z_sun, over many turns; planets turn by their own teeth."""
    r = train()
    sun, carrier = r["sun.angle"], r["carrier.angle"]
    assert sun[-1] > 30 * 2 * np.pi
    assert sun == pytest.approx(RATIO * carrier, abs=1e-9)
    for k in (1, 2, 3):
        assert r[f"planet {k}.angle"] - carrier == pytest.approx(-SUN / PLANET * (sun - carrier), abs=1e-9)
    assert r["sun.omega"] == pytest.approx(RATIO * r["carrier.omega"], abs=1e-11)


def test_two_planets_are_redundant():
    """One freedom; with one planet nothing is said twice, each more says one thing again."""
    for planets in (1, 2, 3):
        found = example("planetary.py", planets=planets).check()
        assert (found.freedoms, found.redundancy) == (1, planets - 1)
    assert set(found.redundant) == {f"{x} mesh {k}" for x in ("sun", "ring") for k in (1, 2, 3)}


def inertia():
    """Of the whole train as felt at the sun."""
    radius, arm = {z: MODULE * z / 2 for z in (SUN, PLANET)}, MODULE * (SUN + PLANET) / 2
    sun, planet = 1.2 * radius[SUN] ** 2 / 2, 0.7 * radius[PLANET] ** 2 / 2
    carrier = 1 / RATIO
    turning = carrier - SUN / PLANET * (1 - carrier)
    return sun + (4e-3 + 3 * 0.7 * arm**2) * carrier**2 + 3 * planet * turning**2


def test_run_up_against_the_brake():
    """J w' = M - b w / ratio^2 for the sun: w = w_end (1 - exp(-t / T)); in the end the brake has ratio times the torque."""
    r = train()
    end, lag = TORQUE * RATIO**2 / BRAKE, inertia() * RATIO**2 / BRAKE
    assert r["sun.omega"] == pytest.approx(end * (1 - np.exp(-r.t / lag)), abs=1e-8)
    assert r["load.tz"][-1] == pytest.approx(-RATIO * TORQUE * (1 - np.exp(-4.0 / lag)), abs=1e-9)


def test_planets_share_the_load():
    """At the start: what each mesh passes to its planet; one planet carries all, three equal ones a third each.

    Redundancy leaves the shares open; the declared choice is the least one, which for equal planets is equal.
    """
    alpha = TORQUE / inertia()
    sun = 1.2 * (MODULE * SUN / 2) ** 2 / 2
    passed = TORQUE - sun * alpha  # what the sun hands on
    r = train()
    for k in (1, 2, 3):
        assert r[f"sun mesh {k}"].effort("sun bearing.angle")[0] == pytest.approx(-passed / 3, rel=1e-6)
    assert set(r.health.undetermined) >= {f"sun mesh {k}" for k in (1, 2, 3)}
