"""What laws do within a step is seen: pulses, thin walls, tables."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from tests.layers import both_layers

pytestmark = both_layers
METHODS = ("dop853", "rk45")


def cart(**velocity) -> fb.Mechanism:
    m = fb.Mechanism("cart", planar=True)
    m.add(fb.Body("cart", mass=2, inertia=1, position=(0, 0), **velocity))
    m.add(fb.Prismatic("track", "ground", "cart", at=(0, 0), axis=(1, 0)))
    return m


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("centre", [0.05, 1.23456, 5.0, 6.6666, 8.1234567, 9.97])
def test_a_pulse_of_a_millisecond_wherever_it_lies(method, centre):
    """1000 N for 1 ms in 10 s without anything else: momentum is the integral of the bell."""
    m = cart()
    m.add(fb.PointForce("blow", "cart", force=(f"1000*exp(-((t-{centre})/0.001)**2)", 0)))
    r = m.simulate(10.0, outputs=2, method=method)
    assert r["cart"].velocity[-1, 0] == pytest.approx(1000 * 1e-3 * np.sqrt(np.pi) / 2, rel=1e-6)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "law", ["where(t < 3.3, 0, where(t < 3.301, 1000, 0))", "blow(t)", "max(0, 2000 - 2e6*abs(t-3.3))"]
)
def test_a_pulse_with_edges(method, law):
    m = cart()
    m.add(fb.Table("blow", x=[0, 3.3, 3.3005, 3.301, 10], y=[0, 0, 2000, 0, 0], interpolation="linear"))
    m.add(fb.PointForce("blow force", "cart", force=(law, 0)))
    r = m.simulate(10.0, outputs=2, method=method)
    assert r["cart"].velocity[-1, 0] == pytest.approx(2000 * 1e-3 / 2 * (2 if "abs" in law else 1) / 2, rel=1e-5)


@pytest.mark.parametrize("method", METHODS)
def test_a_thin_wall(method):
    """A strip of 3 mm that brakes with 40 N takes 0.12 J from a cart of 1 J that runs 10 m."""
    m = cart(velocity=(1, 0))
    m.add(fb.CoordinateSpring("strip", "track.displacement", force="where(value < 5, 0, where(value < 5.003, -40, 0))"))
    r = m.simulate(10.0, outputs=2, method=method)
    assert r["cart"].velocity[-1, 0] == pytest.approx(np.sqrt(0.88), rel=1e-6)


def test_a_pulse_that_a_sensor_gives():
    """The strip again, by a law of a sensor."""
    m = cart(velocity=(1, 0))
    m.add(fb.Sensor("place", "track.displacement"))
    m.add(fb.PointForce("strip", "cart", force=("where(place < 5, 0, where(place < 5.003, -40, 0))", 0)))
    r = m.simulate(10.0, outputs=2)
    assert r["cart"].velocity[-1, 0] == pytest.approx(np.sqrt(0.88), rel=1e-6)


def test_a_jolt_of_a_driver():
    """A base is jolted by 1 mm for 4 ms while a mass hangs on it by a damper: the damper passes no net momentum, but
    the work it took is there.
    """
    m = fb.Mechanism("base", planar=True)
    m.add(fb.Body("base", mass=1, inertia=1, position=(0, 0)), fb.Body("load", mass=1, inertia=1, position=(1, 0)))
    m.add(fb.Prismatic("track", "ground", "base", at=(0, 0), axis=(1, 0)))
    m.add(fb.Prismatic("own", "ground", "load", at=(1, 0), axis=(1, 0)))
    m.add(fb.Driver("jolt", "track.displacement", "0.001*exp(-((t-6.2)/0.002)**2)"))
    m.add(fb.SpringDamper("damper", "base", "load", at=((0, 0), (1, 0)), damping=1e-3))
    r = m.simulate(10.0, outputs=2)
    # int c v^2 dt of the bell a exp(-(t/w)^2): c a^2 sqrt(pi/2) / w
    lost = 1e-3 * 1e-6 * np.sqrt(np.pi / 2) / 0.002
    assert r["damper"].work[-1] == pytest.approx(-lost, rel=1e-2)


def test_nothing_is_inspected_without_such_laws():
    m = cart()
    m.add(fb.PointForce("push", "cart", force=("3*sin(2*t) + t**2 - 4*t", 0)))
    from flyball.engine.pulse_detection import inspection_buffer
    from tests.layers import started

    assert inspection_buffer(started(m.snapshot()).compiled.values.system).shape[1] == 0
