"""Ropes that go slack and taut, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

import flyball as fb
from tests.events.one_sided import LAYERS, G, run, times

layers = pytest.mark.parametrize("coordinates", LAYERS)


@layers
def test_a_pendulum_on_a_rope_goes_slack_over_the_top_and_taut_again(coordinates):
    """Slack where sin phi = (v^2 / (g l) - 2) / 3 above the axis; then a parabola of 4 v_s cos phi / g until taut."""
    l, v, mass = 0.8, np.sqrt(3.7 * G * 0.8), 1.2
    m = fb.Mechanism("rope", planar=True, gravity=(0, -G))
    m.add(fb.Body("bob", mass=mass, inertia=0.01, position=(0, -l), velocity=(v, 0)))
    m.add(fb.Rope("rope", ("ground", "bob"), at=((0, 0), (0, -l))))
    phi = np.arcsin((v**2 / (G * l) - 2) / 3)
    slack = quad(lambda a: l / np.sqrt(v**2 - 2 * G * l * (1 - np.cos(a))), 0, np.pi / 2 + phi, epsabs=1e-13)[0]
    fast = np.sqrt(G * l * np.sin(phi))
    taut = slack + 4 * fast * np.cos(phi) / G
    r = run(m, taut + 0.1, coordinates, outputs=[0.0, 0.1, slack + 0.01, taut + 0.05, taut + 0.1])
    assert times(r, "rope") == pytest.approx([slack, taut], abs=1e-8)
    assert r["rope"].tension[0] == pytest.approx(mass * (G + v**2 / l), rel=1e-9)
    assert r["rope"].tension[2] == 0.0
    assert list(r["rope"].taut) == [1.0, 1.0, 0.0, 1.0, 1.0]
    assert r["rope"].length[3:] == pytest.approx(l, abs=1e-10)
    # where it jerks taut, and the speed along the circle that is left
    flight = taut - slack
    p = l * np.array([np.cos(phi), np.sin(phi)]) + flight * fast * np.array([-np.sin(phi), np.cos(phi)])
    p[1] -= G * flight**2 / 2
    u = fast * np.array([-np.sin(phi), np.cos(phi)]) - np.array([0, G * flight])
    radial = u @ p / l
    assert r.events[-1].lost == pytest.approx(0.5 * mass * radial**2, rel=1e-7)
    assert r.events[-1].impulses["rope"] == pytest.approx(-mass * radial, rel=1e-7)
    assert np.abs(r.energy.balance).max() < 1e-7


@layers
def test_a_pendulum_that_begins_over_the_top_is_held_by_its_speed(coordinates):
    """m (v^2 / l - g) at first, though gravity alone would let the rope go slack; six times m g more at the bottom."""
    l, mass = 0.8, 1.2
    v = np.sqrt(1.5 * G * l)
    m = fb.Mechanism("rope", planar=True, gravity=(0, -G))
    m.add(fb.Body("bob", mass=mass, inertia=0.01, position=(0, l), velocity=(v, 0)))
    m.add(fb.Rope("rope", ("ground", "bob"), at=((0, 0), (0, l))))
    bottom = quad(lambda a: l / np.sqrt(v**2 + 2 * G * l * (1 - np.cos(a))), 0, np.pi, epsabs=1e-13)[0]
    r = run(m, bottom, coordinates, outputs=[0.0, bottom])
    assert r["rope"].tension == pytest.approx([mass * (v**2 / l - G), mass * (v**2 / l + 5 * G)], rel=1e-8)
    assert not len(times(r, "rope"))


@layers
def test_atwoods_rope_slack_and_taut_again(coordinates):
    """The heavy load stops dead: the light one flies for 2 v / g, and takes it up again with m2 / (m1 + m2) of v."""
    m1, m2, height, top = 3.0, 2.0, 0.6, 9.0
    m = fb.Mechanism("Atwood", planar=True, gravity=(0, -G))
    for name, joint, mass, x, y in (("heavy", "left", m1, -0.5, height), ("light", "right", m2, 0.5, 0.0)):
        m.add(fb.Body(name, mass=mass, inertia=0.1, position=(x, y)))
        m.add(fb.Prismatic(joint, "ground", name, at=(x, 0), axis=(0, 1), displacement=y))
    at = ((-0.5, height), (-0.5, top), (0.5, top), (0.5, 0))
    m.add(fb.Rope("rope", ("heavy", "ground", "ground", "light"), at=at))
    m.add(fb.Limit("floor", "left.displacement", lower=0))
    a, share = (m1 - m2) / (m1 + m2) * G, m2 / (m1 + m2)
    t, v, slack, taut = np.sqrt(2 * height / a), np.sqrt(2 * height * a), [], []
    for _ in range(4):
        slack.append(t)
        t += 2 * v / G
        taut.append(t)
        v *= share
        t += 2 * v / a
    r = run(m, taut[-1] + 0.01, coordinates, outputs=401)
    assert times(r, "floor")[: 2 * len(slack)] == pytest.approx(np.ravel(np.transpose([slack, taut])), abs=1e-8)
    before = r.t < slack[0] - 1e-6
    assert r["rope"].tension[before] == pytest.approx(2 * m1 * m2 / (m1 + m2) * G, rel=1e-9)
    flying = (r.t > slack[0] + 1e-6) & (r.t < taut[0] - 1e-6)
    assert (r["rope"].tension[flying] == 0.0).all()
    assert (r["rope"].taut[flying] == 0.0).all()
    assert (r["rope"].taut[before] == 1.0).all()
    assert r["floor"].force[flying] == pytest.approx(m1 * G, rel=1e-9)
    high = (np.sqrt(2 * height * a)) ** 2 / (2 * G) + height
    assert r["right"].displacement.max() <= high + 1e-9
    assert np.abs(r.energy.balance).max() < 1e-7


@layers
def test_a_jump_on_an_elastic_rope(coordinates):
    """Free fall, then x = g/w^2 (1 - cos wt) + v/w sin wt until slack, and up to where it began: all of it again."""
    mass, length, k = 70.0, 10.0, 60.0
    m = fb.Mechanism("jump", planar=True, gravity=(0, -G))
    m.add(fb.Body("jumper", mass=mass, inertia=1.0, position=(0, 0)))
    m.add(fb.PointOnLine("line", "ground", "jumper", at=(0, 0), axis=(0, 1)))
    m.add(fb.Rope("rope", ("ground", "jumper"), at=((0, 1.0), (0, 0)), stiffness=k, length=length + 1.0))
    fall, w = np.sqrt(2 * length / G), np.sqrt(k / mass)
    v = G * fall
    pulled = 2 * (np.pi - np.arctan(v * w / G)) / w
    wanted = fall + np.array([0.0, pulled, pulled + 2 * fall, 2 * pulled + 2 * fall])
    r = run(m, wanted[-1] + 0.5, coordinates)
    assert times(r, "rope") == pytest.approx(wanted, abs=1e-8)
    assert r["rope"].tension.min() == 0.0
    assert np.abs(r.energy.balance).max() < 1e-8 * mass * G * length


@layers
def test_a_conical_pendulum_on_a_rope(coordinates):
    """In space: the tension is m g / cos all the way, at the speed sqrt(g r tan)."""
    m = fb.Mechanism("cone", gravity=(0, 0, -G))
    at, v = (0.6, 0, -0.8), (0, np.sqrt(G * 0.36 / 0.8), 0)
    m.add(fb.Body("bob", mass=2, inertia=(0.01, 0.01, 0.01), position=at, velocity=v))
    m.add(fb.Rope("rope", ("ground", "bob"), at=((0, 0, 0), at)))
    r = run(m, 2.0, coordinates)
    assert r["rope"].tension == pytest.approx(2 * G / 0.8, rel=1e-9)
    assert r["bob.z"] == pytest.approx(-0.8, abs=1e-9)
    assert not len(times(r, "rope"))


@layers
def test_a_rope_with_restitution_bounces(coordinates):
    """Without gravity: it runs out at v, jerks, and comes back at e v."""
    m = fb.Mechanism("tether", planar=True)
    m.add(fb.Body("bob", mass=1.0, inertia=0.1, position=(1, 0), velocity=(2, 0)))
    m.add(fb.Rope("tether", ("ground", "bob"), at=((0, 0), (1, 0)), length=2.0, restitution=0.4))
    r = run(m, 1.0, coordinates)
    assert times(r, "tether") == pytest.approx([0.5], abs=1e-9)
    assert r["bob"].velocity[-1] == pytest.approx([-0.8, 0.0], abs=1e-9)


@layers
def test_an_elastic_rope_that_ends_where_a_rigid_one_does_never_pulls_nor_pushes(coordinates):
    """It runs out at the instant at which the rigid one throws the bob back."""
    m = fb.Mechanism("tethers", planar=True)
    m.add(fb.Body("bob", mass=1.0, inertia=0.1, position=(1, 0), velocity=(2, 0)))
    m.add(fb.Rope("rigid", ("ground", "bob"), at=((0, 0), (1, 0)), length=2.0, restitution=0.4))
    m.add(fb.Rope("elastic", ("ground", "bob"), at=((0, 0), (1, 0)), length=2.0, stiffness=1e3, damping=5.0))
    r = run(m, 1.0, coordinates)
    assert times(r, "rigid") == pytest.approx([0.5], abs=1e-9)
    assert r["bob"].velocity[-1] == pytest.approx([-0.8, 0.0], abs=1e-9)
    assert (r["elastic"].tension == 0.0).all() and (r["elastic"].taut == 0.0).all()
