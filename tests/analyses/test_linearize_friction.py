"""Joint friction follows the reactions: what presses on a bearing brakes it."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from tests.analyses.made import G


def shaft() -> fb.Mechanism:
    """A disk that turns evenly in a bearing whose friction a motor balances."""
    m = fb.Mechanism("shaft", planar=True, gravity=(0, -G))
    m.add(fb.Body("disk", mass=2, inertia=0.1, position=(0, 0), angular_velocity=10.0))
    m.add(fb.Revolute("A", "ground", "disk", at=(0, 0)))
    m.add(fb.JointFriction("bearing", joint="A", static=0.2, kinetic=0.2, radius=0.05, stick_speed=0.001))
    m.add(fb.Motor("motor", joint="A", torque=0.2 * 0.05 * 2 * G))
    m.add(fb.PointForce("load", "disk", force=("0", "0")))
    return m


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
def test_a_load_on_a_bearing_brakes_the_shaft(coordinates):
    """Lifting by F takes mu r F off the friction: mu r / J = 0.1 rad/s^2 per newton, and F off the bearing's force."""
    found = shaft().linearize(["load.y", "load.x"], ["A.fy", "bearing.friction"], coordinates=coordinates)
    assert found.B[-1] == pytest.approx([0.2 * 0.05 / 0.1, 0], abs=1e-9)
    through = found.D
    assert through == pytest.approx(np.array([[-1, 0], [0.2 * 0.05, 0]]), abs=1e-9)


def pendulum(mu: float = 0.2) -> fb.Mechanism:
    """A rod that falls from lying against the friction of its hinge."""
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, -G), parameters={"mu": mu, "mass": 1.0})
    m.add(fb.Body("rod", mass="mass", inertia=1 / 12, position=(0.5, 0)))
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.JointFriction("hinge", joint="A", static="mu", kinetic="mu", radius="10 cm", stick_speed=0.5))
    return m


def test_a_motion_with_friction_by_its_coefficient():
    found = pendulum().sensitivity(
        ["rod.angle", "A.fy"], ["mu", "mass"], analysis="motion", t_end=0.4, outputs=3, verify=True
    )
    assert found.derivatives == pytest.approx(found.verification, rel=1e-5, abs=1e-6)
    assert abs(found["rod.angle", "mu"][-1]) > 0.01


def test_an_instant_with_friction_under_its_own_reactions():
    """omega' = (m g l / 2 - mu r N) / J_A with N = |reaction|; at 2 rad/s, lying: N_x = m l/2 w^2, N_y = m (g - l/2 a)."""
    m = pendulum()
    m.replace(fb.Body("rod", mass="mass", inertia=1 / 12, position=(0.5, 0), angular_velocity=-2.0, velocity=(0, -1.0)))

    def forces(mu):
        a = 0.0
        for _ in range(200):
            N = np.hypot(0.5 * 4.0, G - 0.5 * a)
            a = (G / 2 - mu * 0.1 * N * np.tanh(0.2 / 0.5)) * 3
        return a

    h = 1e-4
    expected = (forces(0.2 + h) - forces(0.2 - h)) / (2 * h)
    found = m.sensitivity(["A.fy", "rod.ay"], ["mu"])
    assert found.derivatives[0, 0, 0] == pytest.approx(-0.5 * expected, rel=1e-6)
    assert found.derivatives[0, 1, 0] == pytest.approx(-0.5 * expected, rel=1e-6)


def coaxial(**friction) -> fb.Mechanism:
    """Two coaxial bearings, each with all its rows: how they share the load is not determined."""
    m = fb.Mechanism("shaft", gravity=(0, 0, -G))
    m.add(fb.Body("shaft", mass=2, inertia=(0.1, 0.1, 0.1), position=(0.5, 0, 0), angular_velocity=(10, 0, 0)))
    for name, x in (("left", 0.0), ("right", 1.0)):
        m.add(fb.Revolute(name, "ground", "shaft", at=(x, 0, 0), axis=(1, 0, 0)))
    m.add(fb.JointFriction("bearing", joint="left", static=0.2, radius=0.05, bending_length=0.1, **friction))
    return m


def test_friction_under_reactions_that_nobody_knows_is_refused():
    """Whether it is a plain force, or slides at the end of a motion."""
    with pytest.raises(fb.ModelError, match=r"friction of bearing depends on reactions that redundant"):
        coaxial(stick_speed=0.01).linearize(frozen=True)
    m = coaxial()
    with pytest.raises(fb.ModelError, match=r"friction of bearing depends on reactions that redundant"):
        m.linearize(about=m.simulate(0.01, outputs=2), frozen=True)


def test_friction_in_motion_is_asked_about_a_motion():
    """Where a mechanism is described in motion nobody says what sticks: a motion does."""
    said = r"linearize with JointFriction 'bearing' is made about a position of rest, and 'shaft' moves: .*about=m.simulate"
    with pytest.raises(fb.ModelError, match=said):
        coaxial().linearize(frozen=True)


def test_about_a_motion_what_slides_goes_on_sliding():
    """Friction of one size does not bend the motion: a mass on a spring, sqrt(k / m), and what it gives is its sign's."""
    m = fb.Mechanism("sled", planar=True, gravity=(0, -G))
    m.add(fb.Body("sled", mass=2, inertia=1, velocity=(1, 0)))
    m.add(fb.Prismatic("slide", "ground", "sled", at=(0, 0), axis=(1, 0)))
    m.add(
        fb.JointFriction("rub", joint="slide", static=0.1),
        fb.CoordinateSpring("spring", "slide.displacement", stiffness=8),
    )
    m.add(fb.PointForce("load", "sled", force=("0", "0")))
    run = m.simulate(0.1, outputs=2)
    assert m.modes(about=run, frozen=True).omega == pytest.approx([2.0], rel=1e-9)
    found = m.linearize(["load.x", "load.y"], ["sled.x", "sled.vx"], about=run, frozen=True)
    assert "assumed to keep sliding" in " ".join(found.notes)
    assert found.B[-1] == pytest.approx([0.5, 0.1 / 2], abs=1e-12)  # lifting takes mu F off the friction
    assert np.linalg.eigvals(found.A).imag.max() == pytest.approx(2.0, rel=1e-9)
