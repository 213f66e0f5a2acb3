"""Places of contact: which are found, what is refused, and accelerations of what sticks and slides there."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.assembly.compiled_mechanism import compile_mechanism
from flyball.constraints.switches.switch_kind import HELD, OFF
from flyball.engine.entry_point import MOTION
from flyball.engine.loads import SLOPES_UNKNOWN
from flyball.model.contact_point import Touch
from flyball.simulation.initial_state import find_initial_state
from flyball.simulation.method_choice import unsupported_contacts, with_contact_points

G, MU = 9.81, 0.3
BALL = fb.Sphere(radius=0.1)


def scene(*parts, planar=False, friction=MU):
    m = fb.Mechanism("scene", planar=planar, gravity=(0, -G) if planar else (0, 0, -G))
    m.add(*parts, fb.Contact(friction=friction))
    return m.snapshot()


def floor(planar=False):
    return fb.Ground("floor", shape=fb.Plane(normal=(0, 1) if planar else (0, 0, 1)))


def names(m):
    return [e.name for e in with_contact_points(m, None).forces if isinstance(e, Touch)]


def moving(m, modes, ways, coordinates="absolute"):
    """Accelerations and multipliers of the tables with these modes and ways of the switches of the first place."""
    a = find_initial_state(with_contact_points(m, None), 0.0, None, None, coordinates, switches=True).assembly
    c = a.compiled
    W, n = c.work, len(c.structure.switches)
    W.modes.mode[: len(modes)] = modes
    W.sensed.value[W.sensed.shape[1] - n : W.sensed.shape[1] - n + len(ways)] = ways
    W.counts.load_updates = SLOPES_UNKNOWN
    status, dy = c.at(a.t, a.q, a.v, MOTION)
    assert status == 0
    nq, nv = c.structure.nq, c.structure.nv
    return dy[nq : nq + nv].copy(), W.rows.multiplier.copy(), c


def test_places_of_balls_boxes_and_capsules():
    box = fb.Body("box", shape=fb.Box(edges=(0.2, 0.2, 0.1)), density=1000, position=(0, 0, 0.05))
    ball = fb.Body("ball", shape=BALL, density=1000, position=(0, 0, 0.2))
    rod = fb.Body("rod", shape=fb.Capsule(radius=0.05, length=0.3), density=1000, position=(1, 0, 0.5))
    assert names(scene(floor(), box)) == [f"floor-box-{k}" for k in range(1, 9)]
    assert names(scene(floor(), ball, rod)) == ["floor-ball", "floor-rod-1", "floor-rod-2", "ball-rod"]
    assert names(scene(floor(), box, ball))[-2:] == ["floor-ball", "box-ball"]


def test_places_in_the_plane():
    box = fb.Body("box", shape=fb.Box(edges=(0.2, 0.2, 0.1)), density=1000, position=(0, 0.1))
    top = fb.Body("top", shape=fb.Box(edges=(0.2, 0.2, 0.1)), density=1000, position=(0, 0.3))
    ball = fb.Body("ball", shape=BALL, density=1000, position=(0, 0.5))
    found = names(scene(floor(True), box, top, planar=True))
    assert len(found) == 4 + 4 + 8
    c = compile_mechanism(with_contact_points(scene(box, top, planar=True), None), switches=True)
    faces = [c.z[c.structure.state_at[f"box-top-{k}.place"]] for k in (1, 2, 7, 8)]
    assert faces == [2, 2, 3, 3]  # one stands on the other, though their sides are in line too
    assert names(scene(box, ball, planar=True)) == ["box-ball"]


def test_what_rows_do_not_know_is_named_and_left_to_steps():
    a = fb.Body("a", shape=fb.Box(edges=(0.2, 0.2, 0.1)), density=1000, position=(0, 0, 0.05))
    b = fb.Body("b", shape=fb.Box(edges=(0.2, 0.2, 0.1)), density=1000, position=(0, 0, 0.15))
    m = scene(floor(), a, b)
    with pytest.raises(fb.ModelError, match=r"the box of 'a' on the box of 'b'; leave method out, or give method='imp"):
        with_contact_points(m, None)
    assert "the box of 'a' on the box of 'b'" in unsupported_contacts(m, None)


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
def test_a_ball_that_slides_is_slowed_and_turned(coordinates):
    ball = fb.Body("ball", shape=BALL, density=1000, position=(0, 0, 0.1), velocity=(0.6, 0.8, 0))
    vdot, lam, c = moving(scene(floor(), ball), (HELD, OFF, OFF), (1.0, 0.6, 0.8), coordinates)
    m, r = c.values.bodies["ball"].mass, 0.1
    assert np.allclose(lam[0], m * G, rtol=1e-12)
    assert np.allclose(vdot[:3], (-MU * G * 0.6, -MU * G * 0.8, 0.0), atol=1e-12)
    spin = MU * G * r / (0.4 * r * r)  # mu N r / I
    assert np.allclose(vdot[3:], (-0.8 * spin, 0.6 * spin, 0.0), atol=1e-10)


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
def test_a_ball_rolls_down_a_plank_that_turns(coordinates):
    """Beside the engine's own rows: the same by Lagrange's equation of the second kind."""
    plank = fb.Body("plank", mass=3.0, inertia=0.5, shape=fb.Box(edges=(4.0, 0.2, 0.2), contact=True), position=(0, 0),
                    angular_velocity=0.7)  # fmt: skip
    w, x, h, r, k, J = 0.7, 0.5, 0.2, 0.1, 0.008, 0.5
    speed, spin = 0.4, 0.7 - 0.4 / r  # along the plank; the ball rolls on it
    v = (speed - w * h, w * x)
    ball = fb.Body("ball", mass=2.0, inertia=k, shape=BALL, position=(x, h), velocity=v, angular_velocity=spin)
    m = scene(plank, ball, fb.Revolute("A", "ground", "plank", at=(0, 0)), planar=True)
    vdot, lam, c = moving(m, (HELD, HELD), (1.0, 0.0), coordinates)
    M = 2.0
    # q = (angle a, place s along the plank): ball at (s c - h s', s s' + h c), turned by a - s / r
    A = np.array([[J + M * (x * x + h * h) + k, -M * h - k / r], [-M * h - k / r, M + k / r**2]])
    b = np.array([-2.0 * M * x * speed * w - M * G * x, M * x * w * w])
    alpha, along = np.linalg.solve(A, b)
    turned = vdot[2] if coordinates == "absolute" else vdot[0]
    assert np.allclose(turned, alpha, rtol=1e-10)
    a = np.array([along - h * alpha - x * w * w, x * alpha + 2 * speed * w - h * w * w])
    assert np.allclose(vdot[-3:-1], a, rtol=1e-9)
    assert np.allclose(vdot[-1], alpha - along / r, rtol=1e-9)
    assert np.allclose(lam[-2], M * (a[1] + G), rtol=1e-9)
