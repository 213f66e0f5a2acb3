"""Tracks: places of pins against closed forms; a hanging run against its catenary; weight, speed, no lost tooth."""

from __future__ import annotations

import runpy

import numpy as np
import pytest

import flyball as fb
from flyball.vehicles.track import chords, taut_band
from tests.mechanisms import EXAMPLES

VEHICLE = runpy.run_path(str(EXAMPLES / "tracked_vehicle.py"))
SHOES, PITCH, TEETH = VEHICLE["SHOES"], VEHICLE["PITCH"], VEHICLE["TEETH"]
REST = fb.Stepping(step="10 ms", solver="gauss-seidel", tolerance=5e-3)


@pytest.mark.parametrize("small", [0.3, 0.5])
def test_band_around_two_circles(small):
    """Its length: the open belt's, 2 sqrt(d^2 - (R - r)^2) + R (pi + 2 a) + r (pi - 2 a), sin a = (R - r) / d."""
    R, d = 0.5, 2.0
    a = np.arcsin((R - small) / d)
    expected = 2 * np.sqrt(d**2 - (R - small) ** 2) + R * (np.pi + 2 * a) + small * (np.pi - 2 * a)
    inside = [(1.0, 0.1)], [0.2]
    arcs = taut_band([(0.0, 0.0), (d, 0.0), *inside[0]], [R, small, *inside[1]])
    assert sum(arc.length for arc in arcs) == pytest.approx(expected, rel=1e-12)
    assert {arc.circle for arc in arcs} == {0, 1}


def test_chain_on_one_circle_is_a_regular_polygon():
    pitch, number = 0.1, 20
    R = pitch / (2 * np.sin(np.pi / number))
    points, surplus = chords(taut_band([(0.0, 0.0), (0.0, 0.0)], [R, R / 2]), 0.0, pitch, number)
    assert surplus == pytest.approx(0.0, abs=1e-12)
    assert np.hypot(*points.T) == pytest.approx(R, rel=1e-12)
    assert np.hypot(*(np.roll(points, -1, axis=0) - points).T) == pytest.approx(pitch, rel=1e-12)


def test_described_track_is_closed_and_touches_its_wheels():
    """All hinges fit, pins of the sprocket lie on its pitch circle between two teeth's flanks, no shoe is in a wheel."""
    track = VEHICLE["running_gear"]()
    middle = np.array([track[f"shoe_{k}"].position for k in range(SHOES)])
    for name in ("sprocket", "idler"):
        wheel = track[name]
        apart = np.hypot(*(middle - wheel.position).T).min()
        assert apart == pytest.approx(wheel.shape[0].radius + VEHICLE["THICKNESS"] / 2, abs=1e-9)


def test_hanging_run_is_a_catenary():
    """At rest, braked, on a fixed hull: tension and pins of the upper run are those of hanging rigid links."""
    m = fb.Mechanism("gear", planar=True, gravity=(0, -9.81))
    m.add(VEHICLE["running_gear"](damping=8.0), prefix="track")
    m.add(fb.Motor("brake", "track.sprocket_axle", torque="-2e4*rate"))
    run = m.simulate(3.0, outputs=4, method=REST)
    places, forces = VEHICLE["pins"](run, "track.")
    hanging = slice(4, 24)
    upper = places[hanging, -1][::-1]
    tension, expected = VEHICLE["catenary"](upper[0], upper[-1], len(upper) - 1)
    assert forces[hanging, -1, 0] == pytest.approx(tension, rel=0.01)
    assert upper == pytest.approx(expected, abs=1e-3)
    assert np.ptp(upper[:, 1]) > 0.1  # it sags


def test_weight_and_speed_of_the_vehicle():
    """The soil's mean force is the weight, but for the momentum at the end; every step is an output time."""
    run = VEHICLE["mechanism"]().simulate(2.2, outputs=551, method=VEHICLE["STEPS"])
    t = run.t
    soil = sum(run.contacts.between("ground", f"track.shoe_{k}").force for k in range(SHOES))
    weight = 9.81 * sum(b.mass for b in run.model.bodies)
    momentum = sum(b.mass * run[b.name].velocity[-1] for b in run.model.bodies)
    assert soil[1:].mean(axis=0) == pytest.approx(momentum / t[-1] + [0, weight], abs=1e-3 * weight)
    rolled = -run["track.sprocket_axle.angle"] * PITCH * TEETH / (2 * np.pi)
    moving = t > 1.6
    speed = np.polyfit(t[moving], run["hull.x"][moving], 1)[0]
    assert speed == pytest.approx(np.polyfit(t[moving], rolled[moving], 1)[0], rel=0.01)
    assert speed == pytest.approx(VEHICLE["SPEED"], rel=0.01)
    hull = run["hull"].position - run["hull"].position[0]
    for k in range(SHOES):  # no shoe leaves the track: sprocket, idler and soil bound where it can be
        way = run[f"track.shoe_{k}"].position - hull
        assert (way.min(axis=0) > (-0.3, 0)).all() and (way.max(axis=0) < (3.55, 1.0)).all()
    assert (hull[:, 0] - rolled)[-1] == pytest.approx(0.0, abs=PITCH / 10)  # no tooth is skipped
