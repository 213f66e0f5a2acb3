"""Fast bodies in free flight: no error bounds the step, and a gap closes and reopens within a small part of it."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb

BOUNCE = fb.Contact(friction=0, restitution=1)


def ball(name, radius, position, velocity):
    return fb.Body(name, shape=fb.Sphere(radius=radius, mass=1), position=position, velocity=velocity)


@pytest.mark.parametrize("method", ["dop853", "rk45"])
@pytest.mark.parametrize(
    ("thick", "radius", "v", "end"), [(0.001, 0.01, 10, 1), (0.05, 0.05, 10, 2), (0.2, 0.1, 20, 2)]
)
def test_a_ball_does_not_fly_through_a_plate(method, thick, radius, v, end):
    for x in (-2, *np.random.default_rng(0).uniform(-4, 4, 12)):
        m = fb.Mechanism("plate", planar=True)
        m.add(fb.Ground("w", shape=fb.Box(edges=(thick, 2, 1), position=(5, 0, 0))))
        m.add(ball("b", radius, (x, 0), (v, 0)), BOUNCE)
        r = m.simulate(end, outputs=3, method=method)
        t = (5 - thick / 2 - radius - x) / v
        assert [e.t for e in r.events] == pytest.approx([t], abs=1e-9), x
        assert r["b.x"][-1] == pytest.approx(x + v * (2 * t - end), abs=1e-8)


@pytest.mark.parametrize(("radius", "v", "end", "off"), [(0.05, 2, 10, 0), (0.02, 5, 2, 0.5), (0.02, 5, 2, 0.999)])
def test_balls_do_not_fly_through_each_other(radius, v, end, off):
    for x in np.random.default_rng(1).uniform(0.2, 0.8, 15) * v * end:
        m = fb.Mechanism("balls", gravity=(0, 0, 0))
        m.add(ball("a", radius, (0, 0, 0), (0, 0, 0)), ball("b", radius, (-x, 2 * radius * off, 0), (v, 0, 0)), BOUNCE)
        r = m.simulate(end, outputs=3)
        t = (x - 2 * radius * np.sqrt(1 - off**2)) / v
        assert [e.t for e in r.events] == pytest.approx([t], abs=1e-9), x


def test_what_flies_past_is_not_touched():
    for off in (1.001, 1.5):
        m = fb.Mechanism("past", gravity=(0, 0, 0))
        m.add(ball("a", 0.05, (0, 0, 0), (0, 0, 0)), ball("b", 0.05, (-9.3, 0.1 * off, 0), (2, 0, 0)), BOUNCE)
        assert len(m.simulate(10, outputs=3).events) == 0


@pytest.mark.parametrize("start", [0.3, 1.2, 2.4, 3.3, 4.1, 5.5])
def test_a_rod_does_not_turn_through_a_peg(start):
    rod = fb.Capsule(radius=0.005, length=1, orientation=(0, np.pi / 2, 0), position=(0.5, 0, 0), mass=1)
    m = fb.Mechanism("rod", planar=True)
    m.add(fb.Ground("p", shape=fb.Sphere(radius=0.005, position=(0.5, 0, 0))))
    m.add(fb.Body("b", shape=rod, position=(0, 0), angle=start - 2 * np.pi), fb.Revolute("A", "ground", "b", at=(0, 0)))
    m.add(fb.Initial("A.angle", rate=50), BOUNCE)
    r = m.simulate(0.14, outputs=3)
    assert r.events[0].t == pytest.approx((2 * np.pi - start - np.arcsin(0.02)) / 50, rel=1e-7)
