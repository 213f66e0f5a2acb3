"""Events, modes and contact by implicit steps: the same guards, decisions and jumps as by every other method."""

import numpy as np
import pytest
from scipy.special import ellipk

import flyball as fb
from tests.layers import both_layers
from tests.mechanisms import example

G = 9.81


def planar(**parameters):
    m = fb.Mechanism("m", planar=True, gravity=(0, -G))
    m.parameters.update(parameters)
    return m


def sled(**friction):
    """1 kg on a slide, a spring of 100 N/m, let go at 0.93 m, with Coulomb's friction."""
    m = fb.Mechanism("sled", planar=True)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("A", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("k", "A.displacement", stiffness=100), fb.Brake("f", "A.displacement", **friction))
    m.add(fb.Initial("A.displacement", value=0.93))
    return m


@pytest.mark.parametrize("method", [{"method": "radau"}, {"method": "generalised-alpha", "step": 0.01}])
@both_layers
def test_a_ball_bounces_when_it_should(method):
    """Free fall is a parabola, on which both are exact: impacts at sqrt(2 h/g) and on, each after 2 e^n sqrt(2 h/g)."""
    m = planar()
    m.add(fb.Body("b", mass=2, inertia=0.1, position=(0, 1)))
    m.add(fb.Prismatic("S", "ground", "b", at=(0, 0), axis=(0, 1)))
    m.add(fb.Limit("floor", "S.displacement", lower=-1.0, restitution=0.8))
    r = m.simulate(3.0, outputs=31, **method)
    fall = np.sqrt(2.0 / G)
    exact = fall * (1.0 + 2.0 * np.cumsum(0.8 ** np.arange(0, 4) * np.r_[0.0, 1, 1, 1]))
    assert [e.t for e in r.events][:4] == pytest.approx(exact, abs=1e-9)
    assert r.health.energy_drift < 1e-7


@both_layers
def test_a_pendulum_passes_its_lowest_point_when_elliptic_integrals_say():
    m = planar()
    m.add(fb.Body("bob", mass=1.0, inertia=1e-6, position=(1, 0)), fb.Revolute("A", "ground", "bob", at=(0, 0)))
    m.add(fb.Event("low", when="A.angle + pi/2", direction="either", do=[]))
    r = m.simulate(5.0, outputs=3, rtol=1e-10, method="radau")
    quarter = ellipk(0.5) / np.sqrt(G / (1 + 1e-6))
    assert [e.t for e in r.events] == pytest.approx(quarter * np.arange(1.0, 5.0 / quarter, 2.0), abs=2e-6)


@both_layers
def test_coulomb_oscillator_sticks_where_it_should():
    """Each half swing loses 2 mu N / k; it stays where the spring pulls less than friction holds."""
    r = sled(capacity=15.0).simulate(3.0, outputs=31, rtol=1e-9, method="radau")
    assert [e.t for e in r.events] == pytest.approx(np.pi / 10 * np.arange(1, 4), abs=1e-6)
    assert r["b"].position[-1, 0] == pytest.approx(-(0.93 - 2 * 0.15 * 3), abs=1e-7)
    assert abs(r["b"].velocity[-1, 0]) < 1e-15
    assert r["f"].work[-1] == pytest.approx(50 * (0.03**2 - 0.93**2), abs=1e-5)


@pytest.mark.parametrize("name", ["clutch_start.toml", "rope_pendulum.toml", "cam_follower.toml", "rocking_block.toml"])
def test_motions_are_those_of_the_explicit_method(name):
    """Clutches, ropes, cams that lift off, contact: events, positions, energy."""
    m = example(name)
    e = m.simulate(1.0, outputs=21, rtol=1e-10, method="dop853")
    r = m.simulate(1.0, outputs=21, rtol=1e-8, method="radau")
    assert [(x.name, x.kind) for x in r.events] == [(x.name, x.kind) for x in e.events]
    assert [x.t for x in r.events] == pytest.approx([x.t for x in e.events], abs=1e-8)
    assert max(np.abs(r[b.name].position - e[b.name].position).max() for b in m.bodies) < 1e-6
    assert not r.health.warnings


def test_a_block_slides_on_a_rough_plane_and_stops():
    """From 2 m/s by mu g, by contact: it stops after v / (mu g), v^2 / (2 mu g) away."""
    m = planar()
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1))), fb.Contact(friction=0.4))
    m.add(fb.Body("box", mass=1, shape=fb.Box(edges=(0.4, 0.2, 0.2)), position=(0, 0.1), velocity=(2.0, 0)))
    r = m.simulate(1.0, outputs=11, method="radau")
    assert r["box"].position[-1, 0] == pytest.approx(4.0 / (2 * 0.4 * G), abs=1e-6)
    assert abs(r["box"].velocity[-1, 0]) < 1e-15


def test_four_hundred_changes_are_found():
    m = planar()
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("A", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(
        fb.Initial("A.displacement", rate=1.0),
        fb.Event("stripe", when="sin(200*pi*A.displacement)", direction="either", do=[]),
    )
    r = m.simulate(2.0005, outputs=2, method="radau", max_step=10)
    assert len(r.events) == 400
    assert [e.t for e in r.events] == pytest.approx(np.arange(1, 401) / 200, abs=1e-10)


@both_layers
def test_a_law_held_on_its_corner_is_computed_by_the_explicit_method():
    """A relay at rest holds what is pushed by less: x stays; beyond its torque it slides on."""
    m = fb.Mechanism("relay", planar=True)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("A", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(
        fb.Actuator("u", "A.displacement", force="-2*sign(value) - rate + t"),
        fb.Initial("A.displacement", value=0.5),
    )
    e = m.simulate(4.0, outputs=41, rtol=1e-11, method="dop853")
    r = m.simulate(4.0, outputs=41, rtol=1e-8, method="radau")
    assert r["b"].position[:, 0] == pytest.approx(e["b"].position[:, 0], abs=1e-6)


def test_a_driven_slide_with_an_event_keeps_its_account():
    """Nothing is free: what the driver does is all energy that there is."""
    m = planar()
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("A", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.Driver("d", "A.displacement", "0.1*sin(5*t)"), fb.Event("more", "t - 0.3", do=[]))
    r = m.simulate(1, outputs=11, rtol=1e-9, method="radau")
    assert r["d"].work == pytest.approx(0.5 * (0.5 * np.cos(5 * r.t)) ** 2 - 0.125, abs=1e-6)
