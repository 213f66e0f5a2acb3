"""Bushings, ropes, springs and actuators along coordinates: statics by hand, closed forms, momentum."""

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flyball as fb
from tests.contract.zoo import GRAVITY, MASS, centre, two_bodies
from tests.layers import both_layers

pytestmark = both_layers

G = 9.81


def kept(result, gravity):
    """Largest gap in the balance of momentum, and of angular momentum about the common centre of mass."""
    S, place = result.values.system, result.values.structure.place
    states = {k: centre(result, k) for k in MASS}
    total = sum(MASS.values())
    momentum = sum(MASS[k] * x[1] for k, x in states.items()) - total * np.outer(result.t, gravity)
    middle = sum(MASS[k] * x[0] for k, x in states.items()) / total
    spin = np.zeros_like(middle)
    for k, (p, v, w, R) in states.items():
        I = S.bodies.inertia[place[k]].reshape(3, 3)
        spin += np.cross(p - middle, MASS[k] * v) + np.einsum("nij,jk,nlk,nl->ni", R, I, R, w)
    return max(np.abs(momentum - momentum[0]).max(), np.abs(spin - spin[0]).max())


@pytest.mark.parametrize("where", ["space", "plane"])
@pytest.mark.parametrize("damping", [0.0, 1.0])
def test_bushing_between_tumbling_bodies(where, damping):
    """Different stiffnesses, large rotations: energy and both momenta are kept; it starts as drawn, without a load."""
    m = two_bodies(where)
    plane = where == "plane"
    m.add(
        fb.Bushing(
            "mount",
            "a",
            "b",
            at=(0.4, 0.1) if plane else (0.4, 0.1, 0.5),
            stiffness=(400.0, 900.0) if plane else (400.0, 900.0, 600.0),
            damping=5.0 * damping,
            torsional_stiffness=60.0 if plane else (5.0, 15.0, 9.0),
            torsional_damping=0.2 * damping,
            **({"angle": 0.4} if plane else {"orientation": (0.3, 0.2, -0.6)}),
        )
    )
    r = m.simulate(0.4, outputs=41, rtol=1e-10, atol=1e-12)
    turn = Rotation.from_matrix(np.einsum("nji,njk->nik", centre(r, "a")[3], centre(r, "b")[3]))
    turned = (turn * turn[0].inv()).magnitude()
    assert turned.max() > 0.8, "a test of large rotations has to turn"
    assert r["mount"].energy[0] == pytest.approx(0.0, abs=1e-12)
    assert r.health.energy_drift < 1e-7
    assert kept(r, np.array(GRAVITY if not plane else (*GRAVITY[:2], 0.0))) < 1e-8


def test_bushing_deflects_by_hand():
    """A weight beside a mount: down by m g / k, tilted by m g l / k_t (small), the tilt lowering the point too."""
    m = fb.Mechanism("mount", gravity=(0, 0, -G))
    m.add(fb.Body("load", mass=2.0, inertia=(0.1, 0.1, 0.1), position=(0.3, 0, 0)))
    k, c = (3e5, 4e5, 5e5), (2e4, 6e4, 9e4)
    m.add(
        fb.Bushing(
            "mount",
            "ground",
            "load",
            at=(0, 0, 0),
            stiffness=k,
            damping=400.0,
            torsional_stiffness=c,
            torsional_damping=40.0,
        )
    )
    r = m.simulate(0.5, outputs=[0.4, 0.5])
    tilt = 2.0 * G * 0.3 / c[1]
    assert r["load"].rotation[-1, 0, 2] == pytest.approx(tilt, rel=1e-3)
    assert r["load"].position[-1, 2] == pytest.approx(-2.0 * G / k[2] - 0.3 * tilt, rel=1e-3)
    force, torque = r["mount"].wrench
    assert force[-1] == pytest.approx((0, 0, 2.0 * G), abs=1e-4)
    assert torque[-1] == pytest.approx((0, -2.0 * G * 0.3, 0), abs=1e-3)


def test_bushing_couples_where_its_axes_are_turned():
    """Axes turned by 45 degrees: a force along x moves the point along y as well, by (1/k1 - 1/k2) / 2 of it."""
    m = fb.Mechanism("turned", planar=True)
    m.add(fb.Body("load", mass=1.0, inertia=0.1))
    m.add(
        fb.Bushing(
            "mount", "ground", "load", at=(0, 0), angle=np.pi / 4, stiffness=(2e4, 5e4), damping=300.0,
            torsional_stiffness=1e3, torsional_damping=20.0,
        )
    )  # fmt: skip
    m.add(fb.PointForce("pull", "load", force=(40.0, 0)), fb.PointTorque("twist", "load", torque=7.0))
    r = m.simulate(1.0, outputs=[1.0])
    x, y = r["load"].position[-1]
    assert x == pytest.approx(40.0 * 0.5 * (1 / 2e4 + 1 / 5e4), rel=1e-6)
    assert y == pytest.approx(40.0 * 0.5 * (1 / 2e4 - 1 / 5e4), rel=1e-6)
    assert r["load"].angle[-1] == pytest.approx(7e-3, rel=1e-6)


def test_bushing_swings_about_each_axis_on_its_own():
    """Small swings about principal axes: w = sqrt(k_t / J) each, from the torsional stiffness of that axis."""
    J, c = np.array([0.1, 0.2, 0.15]), np.array([20.0, 60.0, 35.0])
    m = fb.Mechanism("swing")
    m.add(fb.Body("b", mass=1.0, inertia=tuple(J), angular_velocity=(1e-5, 2e-5, -1e-5)))
    m.add(fb.Bushing("mount", "ground", "b", at=(0, 0, 0), stiffness=1e4, torsional_stiffness=tuple(c)))
    r = m.simulate(1.0, outputs=11, rtol=1e-10, atol=1e-16)
    w = np.sqrt(c / J)
    assert r["b"].angular_velocity == pytest.approx(np.cos(np.outer(r.t, w)) * (1e-5, 2e-5, -1e-5), abs=1e-9)


def test_atwood_machine():
    """A stiff rope over two eyes on ground: a = (m1 - m2) g / (m1 + m2), the tension 2 m1 m2 g / (m1 + m2)."""
    m1, m2, k = 3.0, 2.0, 1e5
    m = fb.Mechanism("Atwood", planar=True, gravity=(0, -G))
    m.add(
        fb.Body("one", mass=m1, inertia=1.0, position=(0, -1)), fb.Body("two", mass=m2, inertia=1.0, position=(1, -1.5))
    )
    tension = 2.0 * m1 * m2 * G / (m1 + m2)
    points = ((0, -1), (0, 0), (1, 0), (1, -1.5))
    m.add(fb.Body("beam", mass=1.0, inertia=1.0, position=(0.5, 0)), fb.Fixed("hold", "ground", "beam", at=(0.5, 0)))
    m.add(rope(points, k, tension))
    r = m.simulate(0.4, outputs=41)
    a = (m1 - m2) * G / (m1 + m2)
    assert r["one"].position[:, 1] == pytest.approx(-1.0 - 0.5 * a * r.t**2, abs=1e-6)
    assert r["two"].position[:, 1] == pytest.approx(-1.5 + 0.5 * a * r.t**2, abs=1e-6)
    assert r["rope"].tension == pytest.approx(np.full(41, tension), rel=1e-4)
    pulls = r["rope"].pulls
    assert pulls[1][1][0] == pytest.approx((tension, -tension, 0), rel=1e-6), "the eye is pulled both ways"
    assert sum(f for _, f in pulls) == pytest.approx(np.zeros((41, 3)), abs=1e-9)
    assert r["hold"].force[:, 1] == pytest.approx(np.full(41, tension + G), rel=1e-4)
    assert r.health.energy_drift < 1e-6


def rope(points, k, tension):
    length = sum(np.hypot(*np.subtract(b, a)) for a, b in itertools.pairwise(points))
    return fb.Rope("rope", bodies=("one", "ground", "beam", "two"), at=points, stiffness=k, length=length - tension / k)


def test_slack_rope_lets_fly():
    """Thrown up from the end of a rope: free flight while it is slack, then it catches; energy is kept throughout."""
    m = fb.Mechanism("slack", gravity=(0, 0, -G))
    m.add(fb.Body("ball", mass=1.0, inertia=(0.01, 0.01, 0.01), position=(0, 0, -1.0), velocity=(1.0, 0, 3.0)))
    m.add(fb.Rope("rope", bodies=("ground", "ball"), at=((0, 0, 0), (0, 0, -1.0)), stiffness=2000.0))
    r = m.simulate(1.5, outputs=301, max_step=0.01)
    slack = np.cumprod(r["rope"].length <= 1.0 + 1e-12).astype(bool)
    assert 20 < slack.sum() < 290
    flight = np.column_stack([r.t, 0 * r.t, -1.0 + 3.0 * r.t - 0.5 * G * r.t**2])
    assert r["ball"].position[slack] == pytest.approx(flight[slack], abs=1e-8)
    assert (r["rope"].tension >= 0.0).all()
    assert r["rope"].tension.max() > 10.0
    assert r["rope"].tension[slack].max() == 0.0
    assert r.health.energy_drift < 1e-4


@pytest.mark.parametrize("where", ["space", "plane"])
def test_rope_over_moving_bodies_keeps_momentum(where):
    """To and fro between two bodies: nothing comes from outside."""
    m = two_bodies(where)
    plane = where == "plane"
    points = [(0.1, 0.3, 0.2), (0.7, 0.2, 0.5), (0.2, -0.4, 0.1), (0.5, 0.4, 0.3)]
    points = [p[:2] if plane else p for p in points]
    m.add(fb.Rope("rope", bodies=("a", "b", "a", "b"), at=points, stiffness=300.0, damping=2.0))
    r = m.simulate(0.4, outputs=41, rtol=1e-9, atol=1e-11, max_step=2e-3)
    assert r["rope"].tension.max() > 10.0
    assert kept(r, np.array(GRAVITY if not plane else (*GRAVITY[:2], 0.0))) < 1e-8
    assert r.health.energy_drift < 1e-3


@pytest.mark.parametrize("swapped", [False, True])
def test_spring_and_actuator_along_a_slide(swapped):
    """m x.. = -k (x - x0) - c x. + F about the coordinate as it is written down: a damped oscillator."""
    m = fb.Mechanism("slide", planar=True)
    m.add(fb.Body("block", mass=2.0, inertia=0.1))
    ends = ("block", "ground") if swapped else ("ground", "block")
    m.add(fb.Translational("s", *ends, at=(0, 0), axis=(3, 4), displacement=0.4))
    m.add(fb.CoordinateSpring("spring", coordinate="s.displacement", stiffness=50.0, damping=4.0, rest=0.1))
    m.add(fb.Actuator("push", coordinate="s.displacement", force="6 + 0*value + 0*rate"))
    r = m.simulate(2.0, outputs=41, rtol=1e-10, atol=1e-12)
    end, d = 0.1 + 6.0 / 50.0, 4.0 / (2 * 2.0)
    w = np.sqrt(50.0 / 2.0 - d * d)
    x = end + (0.4 - end) * np.exp(-d * r.t) * (np.cos(w * r.t) + d / w * np.sin(w * r.t))
    assert r["s"].displacement == pytest.approx(x, abs=1e-9)
    way = (x - 0.4)[:, None] * np.array([0.6, 0.8]) * (-1.0 if swapped else 1.0)
    assert r["block"].position == pytest.approx(way, abs=1e-9)
    assert r["spring"].force == pytest.approx(-50.0 * (x - 0.1) - 4.0 * r["s"].rate, abs=1e-8)
    assert r["push"].force == pytest.approx(np.full(41, 6.0))
    assert r.health.energy_drift < 1e-8


def test_spring_along_a_world_coordinate_of_a_point():
    """A spring on the height of a point beside the centre of mass turns the body as well."""
    m = fb.Mechanism("height", planar=True)
    m.add(fb.Body("b", mass=2.0, inertia=0.3, position=(1, 1)), fb.Frame("tip", "b", position=(0.5, 0)))
    m.add(fb.CoordinateSpring("s", coordinate="tip.y", stiffness=80.0, rest=0.7))
    r = m.simulate(0.5, outputs=11)
    force = -80.0 * (r["tip.y"] - 0.7)
    arm = r["tip"].position - r["b"].position
    assert r["b"].acceleration == pytest.approx(np.column_stack([0 * force, force / 2.0]), abs=1e-9)
    assert r["b"].angular_acceleration == pytest.approx(arm[:, 0] * force / 0.3, abs=1e-9)
    assert force[0] == pytest.approx(-24.0)
    assert r.health.energy_drift < 1e-6


def test_a_spring_about_an_axis_is_wound_up_over_turns():
    """Three turns of winding count three turns, in space too; its torque is about the axis on body j."""
    m = fb.Mechanism("spring", gravity=(0, 0, -G))
    m.add(fb.Body("wheel", mass=1.0, inertia=(0.02, 0.03, 0.04)))
    m.add(fb.Revolute("J", "ground", "wheel", at=(0, 0, 0), axis=(0, 0, 1)), fb.Initial("J.angle", value=6.0 * np.pi))
    m.add(fb.TorsionalSpringDamper("s", joint="J", stiffness=0.1))
    r = m.simulate(10.0, outputs=51, rtol=1e-8)
    assert r["J"].angle == pytest.approx(6.0 * np.pi * np.cos(np.sqrt(0.1 / 0.04) * r.t), abs=1e-5)
    assert r["s"].wrench[1] == pytest.approx(np.outer(-0.1 * r["J"].angle, (0, 0, 1)), abs=1e-12)
    assert r.health.energy_drift < 1e-6


def test_a_damped_rope_does_not_push():
    """Stretched, but shortening faster than stiffness / damping: it carries nothing, its load goes on evenly."""
    m = fb.Mechanism("rebound")
    m.add(fb.Body("load", mass=2.0, inertia=(1, 1, 1), position=(1.2, 0, 0), velocity=(-10, 0, 0)))
    m.add(fb.Prismatic("slide", "ground", "load", at=(0, 0, 0), axis=(1, 0, 0)))
    m.add(fb.Rope("rope", ["ground", "load"], at=[(0, 0, 0), (1.2, 0, 0)], stiffness=100, damping=30, length=1.0))
    r = m.simulate(0.1, outputs=11)
    assert r["load"].position[:, 0] == pytest.approx(1.2 - 10 * r.t, abs=1e-12)
    assert r["rope"].tension == pytest.approx(0.0, abs=1e-12)
