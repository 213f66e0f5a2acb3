"""What bounces ever faster comes to rest in finite time; against closed forms, in both coordinate layers."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

import flyball as fb
from flyball.constraints.switches.stop import STOP
from tests.events.one_row import BOTH, Row, forgotten, rows

G = 9.81
__all__ = ["forgotten"]


def ball(e, height=1.0):
    m = fb.Mechanism("ball", planar=True, gravity=(0, -G))
    m.add(fb.Body("ball", mass=2.0, inertia=0.1, position=(0, height)))
    m.add(fb.Prismatic("P", "ground", "ball", at=(0, height), axis=(0, 1)))
    return rows(m, Row("floor", of=("P.displacement",), kind=STOP, par=(-height, np.inf, e)))


@BOTH
@pytest.mark.parametrize("e", [0.0, 0.5, 0.8])
def test_ball_comes_to_rest_at_the_sum_of_its_series(coordinates, e):
    """Hits at T (1 + 2 e + 2 e^2 + ...), T = sqrt(2 h / g); the sum is T (1 + e) / (1 - e); heights fall by e^2."""
    run = ball(e).simulate(6.0, outputs=61, rtol=1e-10, coordinates=coordinates)
    T = np.sqrt(2.0 / G)
    hits = run.events.of("impact").t
    series = T * (1.0 + 2.0 * np.cumsum(e ** np.arange(1, len(hits) + 1)) * (e > 0))
    np.testing.assert_allclose(hits[0], T, rtol=1e-12)
    speed = np.sqrt(2.0 * G) * e ** np.arange(1, len(hits))  # a place has 16 digits, a slow hit's time less
    if e > 0.0:
        assert (np.abs(hits[1:] - series[: len(hits) - 1]) < 2e-10 + 1e-15 / speed).all()
    end = T * (1 + e) / (1 - e)
    if e > 0.0:
        (rest,) = run.events.of("rest")
        assert rest.t == pytest.approx(end, abs=1e-8)
        assert rest.done == (f"came to rest after {len(hits)} bounces",)
    after = run.t > end + 1e-6
    np.testing.assert_allclose(run["P.displacement"][after], -1.0, atol=1e-15)
    np.testing.assert_allclose(run.q[-1], run.q[after][0], atol=1e-15)
    assert sum(h.lost for h in run.events) == pytest.approx(2.0 * G, rel=1e-12)
    for h in run.events.of("impact")[:4]:
        assert h.impulses["floor"] == pytest.approx(2.0 * (1 + e) * -h.before["ball.vy"], rel=1e-10)


def rocking(height, width, tilt):
    """A block that stands on its right corner on a smooth floor, its left one ``tilt`` up."""
    m = fb.Mechanism("rocking", planar=True, gravity=(0, -G))
    c, s = np.cos(tilt), np.sin(tilt)
    middle = (-c * width / 2 + s * height / 2, s * width / 2 + c * height / 2)
    m.add(fb.Body("block", mass=3.0, inertia=3.0 * (height**2 + width**2) / 12, position=middle, angle=-tilt))
    for name, side in (("left", -1.0), ("right", 1.0)):
        m.add(fb.Frame(name, body="block", position=(side * width / 2, -height / 2)))
        rows(m, Row(f"{name}_stop", of=(f"{name}.y",), kind=STOP, par=(0.0, np.inf, 0.0)))
    return m


def rocking_time(height, width, energy):
    """Time [s] from flat to the highest tilt of a block of unit mass on a smooth floor, and that tilt's own energy.

    (I + y'^2) w^2 / 2 + g y = E, y = h cos(a) / 2 + b sin(a) / 2 the height of its middle.
    """
    inertia = (height**2 + width**2) / 12

    def rise(a):
        return G * (height / 2 * (np.cos(a) - 1.0) + width / 2 * np.sin(a)) - energy

    top = brentq(rise, 0.0, np.arctan(width / height), xtol=1e-17, rtol=1e-15)

    def slowness(s):  # a = top (1 - s^2)
        a = top * (1.0 - s * s)
        slope = -height / 2 * np.sin(a) + width / 2 * np.cos(a)
        # what is left below the top, without the difference of large numbers
        d = top - a
        left = G * (-height * np.sin(top - d / 2) * np.sin(d / 2) + width * np.cos(top - d / 2) * np.sin(d / 2))
        return 2.0 * top * s / np.sqrt(2.0 * left / (inertia + slope**2)) if s > 0 else 0.0

    return quad(slowness, 0.0, 1.0, epsabs=1e-14, epsrel=1e-13)[0]


@BOTH
def test_block_rocks_itself_to_rest(coordinates):
    """On a smooth floor the rate falls by (h^2 - 2 b^2) / (h^2 + 4 b^2) from hit to hit: one corner closes, one opens."""
    h, b, tilt = 2.0, 1.0, 0.1
    run = rocking(h, b, tilt).simulate(6.0, outputs=31, rtol=1e-11, coordinates=coordinates)
    hits = run.events.of("impact")
    ratio = (h * h - 2 * b * b) / (h * h + 4 * b * b)
    rates = np.array([x.before["block.omega"] for x in hits])
    np.testing.assert_allclose(np.abs(rates[1:6] / rates[:5]), ratio, rtol=1e-8)
    energy = G * (h / 2 * (np.cos(tilt) - 1.0) + b / 2 * np.sin(tilt))
    total = t = rocking_time(h, b, energy)
    for k in range(1, 40):
        t = 2.0 * rocking_time(h, b, energy * ratio ** (2 * k)) if energy * ratio ** (2 * k) > 1e-14 else ratio * t
        total += t
    (rest,) = run.events.of("rest")
    assert rest.t == pytest.approx(total, abs=1e-8)
    assert sum(x.lost for x in hits) == pytest.approx(3.0 * energy, rel=1e-9)
    assert abs(run["block.angle"][-1]) < 1e-15


def test_what_a_brake_has_stopped_stands_still():
    """A flywheel of 2 kg m^2 at 3 rad/s, braked by 4 N m, stands at 1.5 s; from then on its rate is 0, to the bit."""
    m = fb.Mechanism("flywheel", planar=True)
    m.add(fb.Body("w", mass=1, inertia=2), fb.Revolute("A", "ground", "w", at=(0, 0)))
    m.add(fb.Brake("b", "A.angle", capacity=4), fb.Initial("A.angle", rate=3))
    m.add(fb.Motor("load", "A", torque="where(t > 1.5, sin(7*t), 0)"))
    r = m.simulate(3, outputs=301, coordinates="joint")
    stands = r.t > 1.5 + 1e-9
    assert r.events["b"].t == pytest.approx([1.5], abs=1e-9)
    assert not r["A.angle_rate"][stands].any()
    assert not r["w.angular_velocity"][stands].any()
    assert r["A.angle"][-1] == pytest.approx(2.25, abs=1e-8)
