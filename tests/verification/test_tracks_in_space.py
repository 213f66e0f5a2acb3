"""Tracks in space: places of shoes as in the plane; straight motion, turn on the spot, a run that stays on its wheels."""

from __future__ import annotations

import runpy

import numpy as np
import pytest

import flyball as fb
from tests.mechanisms import EXAMPLES

SPACE = runpy.run_path(str(EXAMPLES / "tracked_vehicle_in_space.py"))
G, GAUGE, FRICTION, PITCH, TEETH = 9.81, 1.2, 0.6, 0.15, 11
STEPS = fb.Stepping(step="5 ms", solver="gauss-seidel", tolerance=5e-3)


def gear(spatial: bool) -> fb.Mechanism:
    bar = {"stiffness": 1e4, "damping": 600.0, "load": 1500.0}
    road = [
        fb.TrackWheel(f"road_{k}", at=(x, 0.2), mass=15, radius=0.18, arm=(x - 0.2, 0.3), **bar)
        for k, x in enumerate((0.5, 0.9, 1.3))
    ]
    sprocket = fb.TrackWheel("sprocket", at=(1.85, 0.45), mass=30, teeth=TEETH)
    spring = {"stiffness": 1e5, "damping": 2e4, "load": 5e3}
    idler = fb.TrackWheel("idler", at=(0, 0.42), mass=20, radius=0.2, slide=(-1, 0), **spring)
    chain = {"shoes": 35, "pitch": PITCH, "thickness": 0.03, "mass": 5, "width": 0.3}
    return fb.track("track", [sprocket, idler, *road], spatial=spatial, **chain)


def vehicle(left: float, right: float) -> fb.Mechanism:
    """On two short tracks whose sprockets reach their speeds [m/s] within 0.3 s."""
    m = fb.Mechanism("vehicle", gravity=(0, 0, -G))
    m.add(fb.Ground("soil", shape=fb.Plane(normal=(0, 0, 1))))
    m.add(fb.Body("hull", mass=420, inertia=(60, 150, 180), position=(0.9, 0, 0.6)))
    track = gear(True)
    lowest = min(b.position[2] for b in track.bodies) - 0.8 * 0.03
    for side, y, speed in (("left", GAUGE / 2, left), ("right", -GAUGE / 2, right)):
        m.add(track, prefix=side, at=(0, y, 1e-3 - lowest), on="hull")
        rate = f"{speed * 2 * np.pi / (PITCH * TEETH)}*step(t, 0, 0, 0.3, 1)"
        m.add(fb.Motor(f"{side}_drive", f"{side}.sprocket_axle", torque=f"-4e4*(rate + {rate})"))
    shoes = [f"{side}.shoe_{k}" for side in ("left", "right") for k in range(35)]
    m.add(fb.Contact("soil contact", between=shoes, others="soil", friction=FRICTION))
    return m


def test_shoes_are_where_they_are_in_the_plane():
    plane, space = gear(False), gear(True)
    for b in plane.bodies:
        x, y = b.position
        assert space[b.name].position == pytest.approx((x, 0.0, y), abs=1e-12)


def test_straight_motion():
    """Equal speeds: the vehicle goes straight on at pitch times teeth per turn; the soil carries the weight."""
    run = vehicle(0.8, 0.8).simulate(0.9, outputs=181, method=STEPS)
    hull, late = run["hull"], run.t > 0.5
    rolled = -run["left.sprocket_axle.rate"][late].mean() * PITCH * TEETH / (2 * np.pi)
    assert hull.velocity[late, 0].mean() == pytest.approx(rolled, rel=0.02)
    assert abs(hull.position[-1, 1]) < 2e-3
    assert abs(hull.angular_velocity[late, 2].mean()) < 0.01
    soil = run.contacts.on("ground").force
    weight = G * sum(b.mass for b in run.model.bodies)
    momentum = sum(b.mass * run[b.name].velocity[-1] for b in run.model.bodies)
    assert -soil[1:].mean(axis=0)[2] == pytest.approx(weight + momentum[2] / run.t[-1], rel=2e-3)


def test_turn_on_the_spot():
    """Opposite speeds: the yaw rate is that of shoes that slide on the soil under even pressure (Steeds 1950)."""
    m = vehicle(-0.8, 0.8)
    run = m.simulate(1.2, outputs=61, method=STEPS)
    hull, late = run["hull"], run.t > 0.6
    expected = SPACE["quasi_static"](-0.8, 0.8, m, ("road_0", "road_2"), GAUGE)
    assert hull.angular_velocity[late, 2].mean() == pytest.approx(expected[2], rel=0.15)
    for side in ("left", "right"):  # no track leaves its wheels
        for k in range(35):
            way = run[f"{side}.shoe_{k}"].position - hull.position
            across = np.cos(hull.yaw) * way[:, 1] - np.sin(hull.yaw) * way[:, 0]
            assert abs(across - (GAUGE / 2 if side == "left" else -GAUGE / 2)).max() < 0.03
