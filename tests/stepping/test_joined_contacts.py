"""Contacts on mechanisms: joints stay closed at any mass ratio, impulses are those of closed forms, momentum stays."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flyball as fb
from flyball.collision.tables import ContactShapes, Shapes
from flyball.simulation.impulse_stepping.step_loop import change_of_gap
from flyball.simulation.impulse_stepping.stepping_tables import MechanismCounts
from tests.layers import LAYERS

from .stepped import Stepped

RADIUS = 0.05


def chain(links, tip, length=0.2, height=2.0):
    """Links of 1 kg on spherical joints, stretched out level from the ground; the last one has another mass."""
    m = fb.Mechanism("chain", gravity=(0, 0, -9.81))
    for i in range(links):
        mass = tip if i == links - 1 else 1.0
        m.add(fb.Body(f"b{i}", mass=mass, inertia=(0.01 * mass,) * 3, position=(length * (i + 0.5), 0, height)))
        m.add(fb.Spherical(f"j{i}", f"b{i - 1}" if i else "ground", f"b{i}", at=(length * i, 0, height)))
    return m


def floor(M, near=0.2, friction=0.5):
    """Spheres about all mass centres, on a floor."""
    out = []
    for i, pose in enumerate(M.pose):
        gap = pose[2] - RADIUS
        if gap < near:
            out.append((-1, i, (pose[0], pose[1], 0.5 * gap), (0, 0, 1), gap, friction))
    return out


@pytest.mark.parametrize("coordinates", LAYERS)
@pytest.mark.parametrize("tip", [1.0, 1000.0])
def test_joints_stay_closed_while_a_chain_falls_onto_a_floor(tip, coordinates):
    """20 spherical joints, the tip up to 1000 times as heavy: gaps are rounding (other programs: millimetres)."""
    s = Stepped(chain(20, tip), 0.005, coordinates, 20, floor)
    worst = 0.0
    hit = 0.0
    for _ in range(150):
        s.step()
        hit = max(hit, s.X.p[:, 0].max())
        end = np.array([0.0, 0.0, 2.0])
        for i in range(20):
            p, R = s.pose(f"b{i}")
            worst = max(worst, np.abs(p - R @ [0.1, 0, 0] - end).max())
            end = p + R @ [0.1, 0, 0]
    assert hit > 1.0
    assert worst < 1e-12


@pytest.mark.parametrize("coordinates", LAYERS)
def test_a_rod_on_a_hinge_is_stopped_by_an_obstacle(coordinates):
    """The impulse is I w / d, the joint's m w l / 2 less that; at the centre of percussion the joint feels nothing."""
    w, length = 2.0, 1.2
    m = fb.Mechanism("door", planar=True)
    m.add(fb.Body("rod", mass=3.0, inertia=3.0 * length**2 / 12, position=(length / 2, 0.0),
                  velocity=(0.0, -w * length / 2), angular_velocity=-w))  # fmt: skip
    m.add(fb.Revolute("hinge", "ground", "rod", at=(0.0, 0.0)))
    for d in (2 * length / 3, 0.5):
        s = Stepped(m, 1e-6, coordinates, 1, lambda M, d=d: [(-1, 0, (d, 0.0, 0.0), (0.0, 1.0, 0.0), 0.0, 0.0)])
        s.step()
        about = 3.0 * length**2 / 3
        assert s.X.p[0, 0] == pytest.approx(about * w / d, rel=1e-5)
        assert np.abs(s.v).max() < 1e-4
        if coordinates == "absolute":
            joint = 3.0 * w * length / 2 - about * w / d
            assert np.abs(s.A.reactions.impulse).max() == pytest.approx(abs(joint), abs=1e-4)


@pytest.mark.parametrize("coordinates", LAYERS)
def test_jointed_bodies_that_meet_in_space_keep_their_momentum(coordinates):
    """Two pairs of bodies, each on a spherical joint, collide with friction.

    To rounding in absolute coordinates; in joint coordinates to the order of the step, as masses change along the way.
    """
    m = fb.Mechanism("pairs")
    centres = {"a": (0.0, 0, 0), "b": (0.4, 0, 0), "c": (0.05, 0.02, 0.1), "d": (0.05, 0.5, 0.1)}
    for k, (name, p) in enumerate(centres.items()):
        m.add(fb.Body(name, mass=1.0 + k, inertia=(0.01, 0.02, 0.015), position=p,
                      velocity=(0.0, 0.0, 0.0) if k < 2 else (0.3, 0.0, -1.0)))  # fmt: skip
    m.add(fb.Spherical("j", "a", "b", at=(0.2, 0, 0)))
    m.add(fb.Spherical("k", "c", "d", at=(0.05, 0.25, 0.1)))
    mass = np.arange(1.0, 5.0)

    def touching(M):
        n = M.pose[2, :3] - M.pose[0, :3]
        far = np.linalg.norm(n)
        return [(0, 2, (M.pose[0, :3] + M.pose[2, :3]) / 2, n / far, far - 0.1, 0.4)]

    def momentum(s):
        P = mass @ s.M.twist[:, :3]
        L = np.cross(s.M.pose[:, :3], mass[:, None] * s.M.twist[:, :3]).sum(axis=0)
        for k, name in enumerate(centres):
            R = s.pose(name)[1]
            L = L + R @ ((0.01, 0.02, 0.015) * (R.T @ s.M.twist[k, 3:]))
        return P, L

    h = 1e-3
    s = Stepped(m, h, coordinates, 1, touching)
    P, L = momentum(s)
    s.step(30)
    after = momentum(s)
    assert np.abs(s.v).max() > 0.1
    assert not np.allclose(s.twist("a")[0], 0.0)
    assert after[0] == pytest.approx(P, abs=1e-12 if coordinates == "absolute" else 1e-3)
    assert after[1] == pytest.approx(L, abs=1e-3)


@pytest.mark.parametrize("coordinates", LAYERS)
def test_jaws_that_close_on_each_other(coordinates):
    """Two floating bodies on one hinge, which turn towards each other with w and -w and meet: both then go on without.

    Momentum m w along each axis stays; moment of momentum about the centre is none, before as after.
    """
    w, mass, inertia = 2.0, 3.0, 0.4
    m = fb.Mechanism("jaws", planar=True)
    m.add(fb.Body("a", mass=mass, inertia=inertia, position=(1.0, 0.0), velocity=(0.0, w), angular_velocity=w))
    m.add(fb.Body("b", mass=mass, inertia=inertia, position=(0.0, 1.0), velocity=(w, 0.0), angular_velocity=-w))
    m.add(fb.Revolute("hinge", "a", "b", at=(0.0, 0.0)))
    way = np.array([-1.0, 1.0, 0.0]) / np.sqrt(2)
    s = Stepped(m, 1e-7, coordinates, 1, lambda M: [(0, 1, (1.0, 1.0, 0.0), way, 0.0, 0.0)])
    s.step()
    for name in "ab":
        v, turning = s.twist(name)
        assert v == pytest.approx([w / 2, w / 2, 0.0], abs=1e-5)
        assert turning == pytest.approx(np.zeros(3), abs=1e-5)


def test_what_closing_joints_does_to_a_gap():
    """The way of one body's point less that of the other's, along the normal, for small turns about any axis."""
    rng = np.random.default_rng(5)
    normal, arms = np.array([0.6, 0.0, 0.8]), rng.normal(size=(2, 3))
    before, after, ways = np.zeros((2, 12)), np.zeros((2, 12)), []
    for k in range(2):
        R, turn = Rotation.random(random_state=k), Rotation.from_rotvec(1e-6 * rng.normal(size=3))
        place, shift = rng.normal(size=3), 1e-6 * rng.normal(size=3)
        before[k] = np.r_[place, R.as_matrix().ravel()]
        after[k] = np.r_[place + shift, (turn * R).as_matrix().ravel()]
        ways.append(shift + turn.apply(arms[k]) - arms[k])
    shapes, at = Shapes.blank(2), ContactShapes.blank(1)
    shapes.mover = 0, 1
    at.shape_1, at.shape_2 = 0, 1
    A = SimpleNamespace(pose=before, count=MechanismCounts.blank())
    P = SimpleNamespace(frame=np.r_[normal, np.zeros(6)][None], arm=arms.reshape(1, 6))
    M, C = SimpleNamespace(pose=after), SimpleNamespace(at=at)
    found = change_of_gap(SimpleNamespace(shape=shapes), A, M, C, P, 0)
    assert found == pytest.approx(normal @ (ways[1] - ways[0]), abs=1e-11)
