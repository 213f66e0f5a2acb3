"""Stops, ropes, joint friction and stiff springs that turn, in impulse time stepping."""

import numpy as np
import pytest

import flyball as fb
from tests.layers import LAYERS

from .stepped import Stepped


def hanging(length=1.0, **body):
    """A compact body a length away from a hinge, level."""
    m = fb.Mechanism("hanging", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("bob", mass=1.0, inertia=1e-4, position=(length, 0.0), **body))
    return m


@pytest.mark.parametrize("coordinates", LAYERS)
def test_a_double_pendulum_stays_between_its_stops(coordinates):
    m = fb.Mechanism("leg", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("thigh", mass=1.0, inertia=0.02, position=(0.25, 0.0)))
    m.add(fb.Body("shank", mass=1000.0, inertia=20.0, position=(0.75, 0.0)))
    m.add(fb.Revolute("hip", "ground", "thigh", at=(0, 0)))
    m.add(fb.Revolute("knee", "thigh", "shank", at=(0.5, 0)))
    m.add(fb.CoordinateSpring("stop", "knee.angle"))
    m.add(fb.CoordinateSpring("other", "hip.angle"))
    stops = {"stop": (-0.2, 0.3, 0.0), "other": (-2.0, np.inf, 0.5)}
    s = Stepped(m, 0.002, coordinates, stops=stops)
    angle = {"thigh": [], "shank": []}
    energy, mass = [], np.array([1.0, 1000.0])
    for _ in range(1000):
        s.step()
        for name in angle:
            R = s.pose(name)[1]
            angle[name].append(np.arctan2(R[1, 0], R[0, 0]))
        v, w = s.M.twist[:, :3], s.M.twist[:, 5]
        kinetic = 0.5 * mass @ (v * v).sum(axis=1) + 0.5 * 0.02 * mass @ (w * w)
        energy.append(kinetic + 9.81 * mass @ s.M.pose[:, 1])
    hip = np.unwrap(angle["thigh"])
    knee = np.unwrap(np.array(angle["shank"]) - angle["thigh"])
    assert hip.min() == pytest.approx(-2.0, abs=1e-4)
    assert knee.min() > -0.2 - 1e-4 and knee.max() < 0.3 + 1e-4
    assert min(abs(knee.min() + 0.2), abs(knee.max() - 0.3)) < 1e-4
    assert max(np.diff(energy)) < 0.02 * 1000 * 9.81
    assert energy[-1] < 0.9 * abs(energy[0]) + 1.0


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_a_slide_bounces_off_its_stop(e, side):
    """It leaves with e times the speed that it comes with, and (1 - e^2) m v^2 / 2 is lost."""
    m = fb.Mechanism("slide", planar=True)
    m.add(fb.Body("block", mass=2.0, inertia=0.1, position=(0, 0), velocity=(side, 0.0)))
    m.add(fb.Prismatic("rail", "ground", "block", at=(0, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("stop", "rail.displacement"))
    s = Stepped(m, 0.003, "joint", stops={"stop": (-np.inf, 0.1, e) if side > 0.0 else (-0.1, np.inf, e)})
    s.step(60)
    assert s.v[0] == pytest.approx(-side * e, abs=1e-9)
    assert side * s.q[0] <= 0.1 + 1e-9
    assert s.A.real.lost == pytest.approx(1 - e * e, abs=1e-9)


@pytest.mark.parametrize("z", [0.1, 2.0, 100.0])
@pytest.mark.parametrize("coordinates", LAYERS)
def test_what_stops_a_damped_cart(coordinates, z):
    """Impulse of a stop: m v less what the damper takes, h c (1 - b) v / 2, z = h c / m, b = (z/4)^2 / (1 + (z/4)^2).

    It stays there then, in whatever coordinates.
    """
    h, mass, v = 0.01, 2.0, 1.5
    m = fb.Mechanism("slide", planar=True, gravity=(0, 0))
    m.add(fb.Body("cart", mass=mass, inertia=1.0, velocity=(v, 0)))
    m.add(fb.Prismatic("A", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("d", "A.displacement", damping=z * mass / h))
    s = Stepped(m, h, coordinates, stops={"d": (-np.inf, 0.0, 0.0)})
    s.step()
    b = (z / 4) ** 2 / (1 + (z / 4) ** 2)
    assert s.X.line.sum() == pytest.approx(mass * v * (1 - (1 - b) * z / 2), rel=1e-7)
    assert s.v[0] == pytest.approx(0.0, abs=1e-7)  # the damper has had its say


@pytest.mark.parametrize("share", [0.5, 1.5])
def test_friction_in_a_bearing_holds_or_slips(share):
    """A wheel on a shaft under a torque of a share of mu r N; it sticks without creep, or turns at (T - mu r N) / I."""
    m = fb.Mechanism("bearing", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("wheel", mass=10.0, inertia=0.05, position=(0, 0)))
    m.add(fb.Revolute("shaft", "ground", "wheel", at=(0, 0)))
    most = 0.3 * 0.02 * 98.1
    m.add(fb.JointFriction("f", "shaft", static=0.3, radius=0.02))
    m.add(fb.Motor("motor", "shaft", torque=share * most))
    s = Stepped(m, 0.005, "absolute")
    s.step(100)
    turned = s.q[2]
    if share < 1.0:
        assert abs(turned) < 1e-14
    else:
        assert s.v[2] == pytest.approx(0.5 * most / 0.05 * 0.5, rel=1e-9)
        assert s.z[s.structure.state_at["f.work"]] == pytest.approx(-most * turned, rel=1e-9)


@pytest.mark.parametrize("ratio", [1e-2, 1.0, 1e4, 1e8])
def test_a_rope_of_any_stiffness_carries_a_ball(ratio):
    """h^2 k / m up to 1e8: it swings like a pendulum, and falls freely where the rope is slack."""
    h = 0.005
    k = ratio / h**2
    m = hanging()
    m.add(fb.Rope("rope", ["ground", "bob"], at=[(0, 0), (1.0, 0)], stiffness=k, length=1.25))
    s = Stepped(m, h)
    fallen = int(0.38 / h)  # it reaches 1.25 m at g t^2 / 2 = 0.75 m
    s.step(fallen)
    assert s.q[1] == pytest.approx(-9.81 / 2 * (fallen * h) ** 2, rel=1e-12)
    energy = []
    for _ in range(600):
        s.step()
        stretch = max(0.0, np.hypot(*s.q[:2]) - 1.25)
        energy.append(0.5 * s.v[:2] @ s.v[:2] + 9.81 * s.q[1] + (0.5 * k * stretch**2 if ratio < 10 else 0.0))
    assert max(energy) < 1e-2
    if ratio >= 10:
        assert stretch < 2e-3


@pytest.mark.parametrize("ratio", [1e2, 1e4])
def test_a_ball_that_circles_on_a_stiff_rope(ratio):
    """Its stretch is m v^2 / (k r), and tells nothing of the way by which an arc is longer than its chord."""
    h, v = 0.005, 2.0
    k = ratio / h**2
    r = 0.5 + np.sqrt(0.25 + v * v / k)  # k (r - 1) = m v^2 / r
    m = hanging(r, velocity=(0, v))
    m.gravity = (0, 0)
    m.add(fb.Rope("rope", ["ground", "bob"], at=[(0, 0), (r, 0)], stiffness=k, length=1.0))
    s = Stepped(m, h)
    stretch = []
    for _ in range(200):
        s.step()
        stretch.append(np.hypot(*s.q[:2]) - 1.0)
    assert np.abs(np.array(stretch) - (r - 1.0)).max() < 1e-2 * (h * v) ** 2


def test_a_damped_rope_is_a_damped_spring_as_long_as_it_is_taut():
    """e^-at (v / w) sin wt, with w^2 = k / m - a^2 and a = c / 2m, to the second order in the step."""
    k, c, v = 400.0, 8.0, 1.0
    m = hanging(velocity=(v, 0))
    m.gravity = (0, 0)
    m.add(fb.Rope("rope", ["ground", "bob"], at=[(0, 0), (1.0, 0)], stiffness=k, damping=c, length=1.0))
    w = np.sqrt(k - c * c / 4)
    off = []
    for h in (2e-3, 1e-3):
        s = Stepped(m, h)
        s.step(round(0.1 / h))
        off.append(s.q[0] - 1 - np.exp(-c / 2 * 0.1) * v / w * np.sin(w * 0.1))
    assert abs(off[1]) < 1e-5
    assert off[0] == pytest.approx(4 * off[1], rel=0.1)


@pytest.mark.parametrize("z", [0.1, 2.0, 100.0])
@pytest.mark.parametrize("coordinates", LAYERS)
def test_a_damper_of_any_strength_slows_down_and_never_throws_back(coordinates, z):
    """v+ = v (1 - (1 - b) z / 2) / (1 + (1 + b) z / 2) with z = h c / m: b = (z/4)^2 / (1 + (z/4)^2)."""
    h, mass = 0.01, 2.0
    m = fb.Mechanism("slide", planar=True, gravity=(0, 0))
    m.add(fb.Body("cart", mass=mass, inertia=1.0, velocity=(1, 0)))
    m.add(fb.Prismatic("A", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("d", "A.displacement", damping=z * mass / h))
    s = Stepped(m, h, coordinates)
    b = (z / 4) ** 2 / (1 + (z / 4) ** 2)
    for n in range(1, 4):
        s.step()
        wanted = ((1 - (1 - b) * z / 2) / (1 + (1 + b) * z / 2)) ** n
        assert s.twist("cart")[0][0] == pytest.approx(wanted, rel=1e-7, abs=1e-9)


@pytest.mark.parametrize("z", [2.0, 100.0])
@pytest.mark.parametrize("coordinates", LAYERS)
def test_a_damper_between_two_carts_keeps_their_momentum(coordinates, z):
    """By the same rule with the reduced mass, 1.2 kg of 2 kg and 3 kg: their speeds tend to the mean one."""
    h, masses, reduced = 0.01, (2.0, 3.0), 1.2
    m = fb.Mechanism("carts", planar=True, gravity=(0, 0))
    for name, mass, x, v in zip("ab", masses, (0.0, 1.0), (1.0, -1.0), strict=True):
        m.add(fb.Body(name, mass=mass, inertia=1.0, position=(x, 0), velocity=(v, 0)))
        m.add(fb.Prismatic(name.upper(), "ground", name, at=(x, 0), axis=(1, 0)))
    m.add(fb.SpringDamper("d", "a", "b", at=((0, 0), (1, 0)), damping=z * reduced / h))
    s = Stepped(m, h, coordinates)
    b = (z / 4) ** 2 / (1 + (z / 4) ** 2)
    s.step(2)
    apart = 2.0 * ((1 - (1 - b) * z / 2) / (1 + (1 + b) * z / 2)) ** 2
    mean = (2.0 - 3.0) / 5.0
    speeds = [s.twist(name)[0][0] for name in "ab"]
    assert speeds == pytest.approx([mean + 0.6 * apart, mean - 0.4 * apart], abs=1e-8)


@pytest.mark.parametrize("ratio", [1e2, 1e4, 1e6])
def test_a_pendulum_on_a_stiff_spring_keeps_its_length_and_energy(ratio):
    """The spring is as long as its force says, 3 m g / k at most: no energy of a curved way is in it."""
    h = 0.01
    k = ratio / h**2
    m = hanging()
    m.add(fb.SpringDamper("s", "ground", "bob", at=((0, 0), (1.0, 0)), stiffness=k))
    s = Stepped(m, h)
    stretch = []
    for _ in range(300):
        s.step()
        stretch.append(np.hypot(*s.q[:2]) - 1.0)
        energy = 0.5 * s.v[:2] @ s.v[:2] + 9.81 * s.q[1] + 0.5 * k * stretch[-1] ** 2
        assert abs(energy) < 0.004 * 9.81
    assert max(np.abs(stretch)) < 1.1 * 3 * 9.81 / k + 1e-5


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_what_holds_at_rest_is_more_than_what_brakes(share):
    """Static friction holds 1.25 of kinetic; once it turns it is braked by the kinetic one."""
    m = fb.Mechanism("bearing", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("wheel", mass=10.0, inertia=0.05))
    m.add(fb.Revolute("shaft", "ground", "wheel", at=(0, 0)))
    most = 0.25 * 0.02 * 98.1
    m.add(fb.JointFriction("f", "shaft", static=0.25, kinetic=0.2, radius=0.02))
    m.add(fb.Motor("motor", "shaft", torque=share * most))
    s = Stepped(m, 0.005, "absolute")
    s.step(100)
    if share < 1.0:
        assert abs(s.q[2]) < 1e-14
    else:
        assert s.v[2] == pytest.approx((share - 0.8) * most / 0.05 * 0.5, rel=0.02)  # a step of static friction


@pytest.mark.parametrize("coordinates", LAYERS)
def test_a_clutch_and_a_brake(coordinates):
    """Two flywheels come to one speed after (w1 - w2) / (M (1/J1 + 1/J2)) = 0.9 s; a brake stops both, exactly."""
    m = fb.Mechanism("drive", planar=True)
    for k, (J, w) in enumerate(((0.2, 30.0), (0.4, 0.0))):
        m.add(fb.Body(f"w{k}", mass=1.0, inertia=J), fb.Revolute("AB"[k], "ground", f"w{k}", at=(0, 0)))
        m.add(fb.Initial(f"{'AB'[k]}.angle", rate=w))
    m.add(fb.Clutch("clutch", "A.angle", "B.angle", capacity=40.0 / 9.0))
    m.add(fb.Brake("brake", "B.angle", capacity="6*where(t < 2, 0, 1)"))
    s = Stepped(m, 0.005, coordinates)
    turn = [0, 1] if coordinates == "joint" else [2, 5]
    s.step(178)
    assert s.v[turn[0]] > s.v[turn[1]] + 0.1
    s.step(4)
    assert s.v[turn] == pytest.approx([10.0, 10.0], rel=1e-9)
    lost = s.z[s.structure.state_at["clutch.work"]]
    assert lost == pytest.approx(-0.5 * 0.2 * 0.4 / 0.6 * 900.0, rel=1e-6)
    s.step(500)
    assert np.abs(s.v[turn]).max() < 1e-12
