"""A rod that slides on its end with much friction: no accelerations, or several; against closed forms, in both layers.

Painleve 1895; Stewart 2000, SIAM Review 42, sections 1.2 and 1.3.
"""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb

A, FOOT = 1.1, 0.01
C, S = np.cos(A), np.sin(A)
H = S + FOOT  # height of the middle
N = np.array([[1 + 3 * C * C, -3 * C * H], [-3 * C * H, 1 + 3 * H * H]])  # accelerations of the foot by N and F
G = 9.81
BOTH = pytest.mark.parametrize("coordinates", ["absolute", "joint"])


def rod(mu, speed, spin=0.0):
    """A uniform rod of mass 1 and length 2 at 63 degrees, its foot, a small ball, on the floor at a speed along it."""
    m = fb.Mechanism("rod", planar=True, gravity=(0, -G))
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1))))
    foot = fb.Sphere(radius=FOOT, position=(-1, 0))
    state = {"velocity": (speed - spin * H, spin * C), "angular_velocity": spin}
    m.add(fb.Body("rod", mass=1.0, inertia=1 / 3, position=(C, H), angle=A, shape=foot, **state))
    m.add(fb.Contact(friction=mu))
    return m


@BOTH
@pytest.mark.parametrize(("mu", "speed"), [(0.3, -1.0), (3.0, 1.0)])
def test_it_slides_where_accelerations_exist(coordinates, mu, speed):
    """N (1 + 3 c^2 - sign(v) mu ... ) = g."""
    run = rod(mu, speed).simulate(1e-3, outputs=2, method="dop853", coordinates=coordinates)
    force = G / (N[0, 0] - np.sign(speed) * mu * N[0, 1])
    assert run["rod.ay"][0] == pytest.approx(force - G, rel=1e-9)
    assert not len(run.events)
    assert not any("Painleve" in r for r in run.health.remarks)


@BOTH
def test_without_accelerations_it_stops_without_a_collision(coordinates):
    """Impulses that end the slip: N x = (0, v), of which v F / 2 is lost."""
    run = rod(3.0, -1.0).simulate(1e-3, outputs=2, method="dop853", coordinates=coordinates)
    (jam,) = run.events
    x = np.linalg.solve(N, [0.0, 1.0])
    assert jam.kind == "jam"
    assert "Painleve" in jam.done[0]
    assert jam.lost == pytest.approx(0.5 * x[1], rel=1e-8)
    assert jam.after["rod.omega"] == pytest.approx(3.0 * (H * x[1] - C * x[0]), rel=1e-8)


@BOTH
def test_where_there_are_several_it_says_so(coordinates):
    """Turning fast it may lift off or press on: at the start nothing holds it, so it lifts off."""
    run = rod(3.0, -1.0, spin=4.0).simulate(1e-3, outputs=2, method="dop853", coordinates=coordinates)
    assert any("have several solutions (Painleve's paradox)" in r and "floor-rod" in r for r in run.health.remarks)
    assert run["rod.ay"][0] == pytest.approx(-G, rel=1e-9)


@BOTH
def test_a_take_off_is_none_of_these(coordinates):
    """A ball leaves a shaken plate where A w^2 sin(w t) = g: its force passes zero, nothing slides, one way is open."""
    m, width, radius = fb.Mechanism("shaker", planar=True, gravity=(0, -G)), 0.02, 0.05
    m.add(fb.Body("plate", shape=fb.Box(edges=(1, 0.1, 0.1), mass=5.0), position=(0, -0.05)))
    m.add(fb.Prismatic("J", "ground", "plate", at=(0, -0.05), axis=(0, 1)))
    m.add(fb.Driver("D", "J.displacement", f"{width}*sin(30*t)"))
    m.add(fb.Body("ball", shape=fb.Sphere(radius=radius, mass=1.0), position=(0, radius)), fb.Contact(friction=0.3))
    run = m.simulate(0.1, outputs=2, coordinates=coordinates)
    off = np.arcsin(G / (width * 30**2)) / 30
    assert [e.t for e in run.events] == pytest.approx([0.0, off], rel=1e-9)  # struck as the plate starts at .6 m/s
    flight = 0.1 - off
    height = width * np.sin(30 * off) + width * 30 * np.cos(30 * off) * flight - G * flight**2 / 2
    assert run["ball.y"][-1] == pytest.approx(radius + height, abs=1e-9)
    assert run.health.warnings == ()
