"""Friction that follows reactions, where rows that hold give way to none of it: closed forms."""

import numpy as np
import pytest
from scipy.optimize import brentq

import flyball as fb

G = 9.81
ANGLE = 0.2


def wedge():
    """1 kg on a rough slide, pushed under 5 kg that a rough slope lifts along a vertical line."""
    m = fb.Mechanism("wedge", planar=True, gravity=(0, -G))
    m.add(fb.Body("w", mass=1, inertia=1), fb.Body("load", mass=5, inertia=1, position=(0, 1)))
    m.add(fb.Prismatic("s", "ground", "w", at=(0, 0), axis=(1, 0)))
    m.add(fb.Prismatic("p", "w", "load", at=(0, 1), axis=(np.cos(ANGLE), np.sin(ANGLE))))
    m.add(fb.PointOnLine("v", "ground", "load", at=(0, 1), axis=(0, 1)))
    m.add(fb.JointFriction("f1", "s", static=0.1, kinetic=0.08), fb.JointFriction("f2", "p", static=0.15, kinetic=0.12))
    m.add(fb.Actuator("push", "s.displacement", force="-40*sin(1.5*t)"))
    return m


def speed(t):
    """Of the wedge at t: (1 + 5 T k) a = F + 5 g k + m1 g, k = tan(angle + arctan m2) + m1, T = tan(angle)."""

    def resists(m1, m2):
        k = np.tan(ANGLE + np.arctan(m2)) + m1
        return k, G * (5 * k + m1)

    begins = np.arcsin(resists(0.1, 0.15)[1] / 40) / 1.5
    k, against = resists(0.08, 0.12)
    pushed = 40 / 1.5 * (np.cos(1.5 * t) - np.cos(1.5 * begins))
    return np.where(t > begins, (pushed + against * (t - begins)) / (1 + 5 * np.tan(ANGLE) * k), 0.0)


@pytest.mark.parametrize(("options", "near"), [
    ({"method": "radau", "rtol": 1e-11, "coordinates": "absolute"}, 2e-8),
    ({"method": "radau", "rtol": 1e-11, "coordinates": "joint"}, 2e-8),
    ({"method": "radau", "step": 0.02, "rtol": 1e-11}, 2e-8),
    ({"method": "generalised-alpha", "step": 1e-3}, 1e-5),
    ({"method": "dop853", "rtol": 1e-11}, 1e-9),
])  # fmt: skip
def test_a_wedge_under_a_load(options, near):
    """Rows are soft for self-stress' sake; friction made of that 2e-5 of the acceleration, at every tolerance."""
    r = wedge().simulate(2.4, outputs=25, progress=False, **options)
    assert np.abs(r["w"].velocity[:, 0] - speed(r.t)).max() < near


def gripper():
    """A box between two pads that are lifted by 1.5 m in a second, of friction 0.4 under 20 N each."""
    m = fb.Mechanism("grip", planar=True, gravity=(0, -G))
    m.add(fb.Body("arm", mass=1, inertia=1, position=(0, 1)))
    m.add(fb.Prismatic("lift", "ground", "arm", at=(0, 1), axis=(0, 1)))
    m.add(fb.Driver("d", "lift.displacement", "step5(t, 0, 0, 1, 1.5)"))
    for n, side in (("l", -1), ("r", 1)):
        pad = fb.Box(edges=(0.2, 0.4, 0.2), looks=True, contact=True)
        m.add(fb.Body(n, mass=0.2, inertia=0.1, position=(0.3 * side, 1), shape=pad))
        m.add(fb.Prismatic("p" + n, "arm", n, at=(0.3 * side, 1), axis=(-side, 0)))
        m.add(fb.Actuator("f" + n, f"p{n}.displacement", force=20))
    box = fb.Box(edges=(0.4, 0.3, 0.2), looks=True, contact=True)
    m.add(fb.Body("box", mass=1, inertia=0.05, position=(0, 1), shape=box))
    m.add(fb.Contact(between=["l", "r"], others="box", friction=0.4))
    return m


@pytest.mark.parametrize("rtol", [1e-6, 1e-8])
def test_a_box_slips_in_a_gripper_and_is_caught(rtol):
    """It slips while the pads accelerate by more than mu (2 N) / m - g, and sticks when its speed is theirs again."""
    most = 16.0 - G
    way = 1.5 * np.array([6.0, -15, 10, 0, 0, 0])
    v, a = np.polyder(way), np.polyder(way, 2)
    begin = brentq(lambda t: np.polyval(a, t) - most, 0, 0.2)
    ends = brentq(lambda t: np.polyval(v, begin) + most * (t - begin) - np.polyval(v, t), 0.3, 0.9)
    lasts = ends - begin
    behind = np.polyval(way, [begin, ends]) @ [1, -1] + np.polyval(v, begin) * lasts + most * lasts**2 / 2
    r = gripper().simulate(1.0, outputs=3, method="radau", rtol=rtol, progress=False)
    at = {e.kind: e.t for e in r.events}
    assert [at["slip"], at["stick"]] == pytest.approx([begin, ends], abs=1e-8)
    assert "turn" not in at
    assert r["box"].position[-1, 1] == pytest.approx(2.5 + behind, abs=1e-9)


@pytest.mark.parametrize("rtol", [1e-9, 1e-10])
def test_a_door_on_two_rough_hinges_at_narrow_tolerances(rtol):
    """What rounding makes of multipliers that redundant rows leave open stops no step."""
    m = fb.Mechanism("door", gravity=(0, 0, -G))
    m.add(fb.Body("leaf", mass=10.0, inertia=(1, 1, 1), position=(0.5, 0, 1)))
    for name, z in (("upper", 2.0), ("lower", 0.0)):
        m.add(fb.Revolute(name, "ground", "leaf", at=(0, 0, z), axis=(0, 0, 1)))
    m.add(fb.JointFriction("f", "upper", radius=0.1, kinetic=0.3, static=0.3, thrust_factor=1.0))
    m.add(fb.Initial("upper.angle", rate=3.0))
    e = m.simulate(0.3, rtol=1e-11, outputs=4, method="dop853")
    r = m.simulate(0.3, rtol=rtol, outputs=4, method="radau")
    assert np.abs(r["upper"].rate - e["upper"].rate).max() < 1e-5


@pytest.mark.parametrize("options", [{"method": "radau"}, {"method": "radau", "step": 0.1}])
def test_a_driver_does_the_work_that_its_mass_takes_up(options):
    """Beside another freedom a driver's row does work as the motion goes: m (v1^2 - v0^2) / 2."""
    m = fb.Mechanism("driven", planar=True, gravity=(0, 0))
    m.add(fb.Body("b", mass=2.0, inertia=1), fb.Prismatic("p", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.Body("free", mass=1.0, inertia=1), fb.Driver("drive", "p.displacement", "t**2/2 + t"))
    r = m.simulate(1.0, outputs=2, coordinates="absolute", progress=False, **options)
    assert r["drive"].work[-1] == pytest.approx(3.0, rel=1e-9)
