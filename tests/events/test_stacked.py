"""Friction that depends on loads that other friction makes: stacked blocks, a drawer that jams; in both layers."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb

BOTH = pytest.mark.parametrize("coordinates", ["absolute", "joint"])
G = 10.0


def stack(force):
    """B of 1 kg on A of 2 kg on the ground; static above kinetic friction below (0.3, 0.2) and between (0.5, 0.4)."""
    m = fb.Mechanism("stack", planar=True, gravity=(0, -G))
    m.add(fb.Body("A", mass=2.0, inertia=1.0), fb.Body("B", mass=1.0, inertia=1.0))
    m.add(fb.Prismatic("low", "ground", "A", at=(0, 0), axis=(1, 0)))
    m.add(fb.Prismatic("up", "A", "B", at=(0, 0), axis=(1, 0)))
    m.add(fb.JointFriction("under", "low", static=0.3, kinetic=0.2))
    m.add(fb.JointFriction("between", "up", static=0.5, kinetic=0.4))
    m.add(fb.PointForce("pull", body="A", force=(force, 0)))
    return m


@BOTH
@pytest.mark.parametrize("force", [0.0, 8.9, 9.1, 15.0, 20.9, 21.1, 30.0])
def test_stacked_blocks(coordinates, force):
    """All rest up to 9 N; both go as one up to 21 N, where B would need 5 m/s^2; beyond that B has 4 m/s^2."""
    run = stack(force).simulate(0.3, outputs=3, coordinates=coordinates)
    if force < 9.0:
        a, b = 0.0, 0.0
    elif force < 21.0:
        a = b = (force - 6.0) / 3.0
    else:
        a, b = (force - 6.0 - 4.0) / 2.0, 4.0
    np.testing.assert_allclose(run["A.ax"], a, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(run["B.ax"], b, rtol=1e-9, atol=1e-12)


@BOTH
def test_stacked_blocks_struck(coordinates):
    """A blow on A: only finite friction acts on B, whose load takes no part in it."""
    m = stack(0.0)
    m.add(fb.Event("blow", "start", do=[fb.Impulse("A", (3.0, 0.0))]))
    run = m.simulate(2.0, outputs=201, coordinates=coordinates)
    # A from 1.5 m/s: -(6 + 4) / 2 until B has caught up: 1.5 - 5 t = 4 t; then -2, since 2 < 4
    t = 1.5 / 9.0
    v, end = 4.0 * t, t + 4.0 * t / 2.0
    assert run.events.of("stick").t == pytest.approx([t, end], rel=1e-8)
    assert run["A.x"][-1] == pytest.approx(1.5 * t - 2.5 * t * t + v * v / 4.0, rel=1e-8)
    assert run["B.x"][-1] == pytest.approx(2.0 * t * t + v * v / 4.0, rel=1e-8)


def drawer(mu, preload):
    """A drawer of 1 kg whose mass centre is 0.3 m beside its guide of length 0.4 m, at 1 m/s."""
    m = fb.Mechanism("drawer", planar=True, gravity=(0, 0))
    m.add(fb.Body("drawer", mass=1.0, inertia=1e-9, position=(0, 0.3), velocity=(1.0, 0)))
    m.add(fb.Prismatic("guide", "ground", "drawer", at=(0, 0), axis=(1, 0)))
    m.add(fb.JointFriction("rub", "guide", static=mu, bending_length=0.4, preload=preload))
    return m


@BOTH
def test_drawer_slides_where_its_friction_does_not_feed_itself(coordinates):
    """m a = mu (F0 + 2 m a e / l): a = mu F0 / (1 - 2 mu e / l)."""
    run = drawer(0.4, 2.0).simulate(2.0, outputs=11, coordinates=coordinates)
    a = 0.4 * 2.0 / (1 - 0.4 * 1.5)
    (stick,) = run.events.of("stick")
    assert stick.t == pytest.approx(1.0 / a, rel=1e-9)


@BOTH
def test_drawer_jams(coordinates):
    """2 mu e / l > 1: no deceleration goes with its friction; it stops at once."""
    run = drawer(0.8, 2.0).simulate(0.1, outputs=3, coordinates=coordinates)
    (jam,) = run.events.of("jam")
    assert jam.lost == pytest.approx(0.5, rel=1e-9)
    np.testing.assert_allclose(run["drawer.vx"], 0.0, atol=1e-12)


@BOTH
@pytest.mark.parametrize("along", [1.0, -1.0])
def test_brake_that_stops_what_a_force_within_its_capacity_pulls(coordinates, along):
    """m a = -(c - F) to rest, and there it holds: c > F. Its own force counts once."""
    m = fb.Mechanism("braked", planar=True)
    m.add(fb.Body("block", mass=1.0, inertia=1.0, velocity=(2.0 * along, 0)))
    m.add(fb.Prismatic("P", "ground", "block", at=(0, 0), axis=(1, 0)))
    m.add(
        fb.Brake("brake", "P.displacement", capacity=4.0), fb.PointForce("pull", body="block", force=(-2.0 * along, 0))
    )
    run = m.simulate(1.0, outputs=21, coordinates=coordinates)
    (stick,) = run.events
    assert (stick.kind, stick.t) == ("stick", pytest.approx(2.0 / 6.0, rel=1e-10))
    np.testing.assert_allclose(run["P.displacement"][run.t > 0.34], along * 2.0 / 6.0, rtol=1e-9)


def test_brake_whose_capacity_comes_and_goes_never_gives_energy():
    """Its power is never positive, though it sticks, slips and turns again and again."""
    m = fb.Mechanism("braked", planar=True)
    m.add(fb.Body("block", mass=1.0, inertia=1.0, velocity=(1.0, 0)))
    m.add(fb.Prismatic("P", "ground", "block", at=(0, 0), axis=(1, 0)))
    m.add(fb.Brake("brake", "P.displacement", capacity="3 * sin(7*t)**2"))
    m.add(fb.PointForce("pull", body="block", force=("2 * sin(5*t + 1)", 0)))
    run = m.simulate(4.0, outputs=401)
    power = run["brake"].friction * run["brake"].rate
    assert power.max() < 1e-9
    assert len(run.events) > 5


@BOTH
def test_friction_where_nothing_can_move(coordinates):
    """A bar between two fixed hinges: its friction has nothing to hold, and that is no contradiction."""
    m = fb.Mechanism("fixed", planar=True, gravity=(0, -G))
    m.add(fb.Body("bar", mass=1.0, inertia=1.0), fb.Revolute("A", "ground", "bar", at=(0, 0)))
    m.add(fb.Revolute("B", "ground", "bar", at=(1, 0)))
    m.add(fb.Brake("rub", "A.angle", capacity=0.3))
    run = m.simulate(0.1, outputs=2, coordinates=coordinates)
    np.testing.assert_allclose(run["bar.angle"], 0.0, atol=1e-14)
