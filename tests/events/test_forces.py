"""Events that name what parts carry: rods, pins and ropes that break, drives that are overloaded."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import flyball as fb
from tests.layers import both_layers

pytestmark = both_layers
G = 9.81
FINE = {"rtol": 1e-10, "atol": 1e-12}
ALONG = {"at": (0, 0), "axis": (1, 0)}


def pendulum(*more, start=1.7, inertia=0.0, hangs=None, planar=True):
    """1 kg at 1 m from where it hangs, let go at an angle from below."""
    m = fb.Mechanism("pendulum", planar=planar, gravity=(0, -G) if planar else (0, -G, 0))
    at = (np.sin(start), -np.cos(start)) if planar else (np.sin(start), -np.cos(start), 0)
    m.add(fb.Body("b", mass=1, inertia=inertia if planar else [inertia] * 3, position=at))
    m.add(hangs or fb.Distance("rod", "ground", "b", at=((0,) * len(at), at)), *more)
    return m


def breaks(limit, start):
    """Angle and speed at which the rod's tension, g cos a + w^2, has grown to the limit."""

    def w2(a):
        return 2 * G * (np.cos(a) - np.cos(start))

    a = brentq(lambda a: G * np.cos(a) + w2(a) - limit, 0, start, xtol=1e-15)
    return a, np.sqrt(w2(a))


@pytest.mark.parametrize("method", ["dop853", "radau"])
@pytest.mark.parametrize("when", ["rod.force > 20 N", "rod.fx**2 + rod.fy**2 > 400", "20 - rod.force"])
def test_a_pendulums_rod_breaks(when, method):
    """And what hung on it flies on."""
    way = "falling" if when.startswith("20") else "rising"
    r = pendulum(fb.Event("breaks", when, direction=way, do=[fb.Release("rod")])).simulate(1.0, method=method, **FINE)
    a, w = breaks(20.0, 1.7)
    (e,) = r.events
    assert np.arctan2(e.before["b.x"], -e.before["b.y"]) == pytest.approx(a, abs=1e-8)
    late = 1.0 - e.t
    x, y, vx, vy = np.sin(a), -np.cos(a), -w * np.cos(a), -w * np.sin(a)
    assert r["b"].position[-1, :2] == pytest.approx([x + vx * late, y + vy * late - G * late**2 / 2], abs=1e-7)


def test_a_shear_pin_in_a_drive():
    """10 t N m drive 2 kg m^2, which a pin connects with 3 kg m^2: it bears 6 t, to 5 N m."""
    m = fb.Mechanism("drive", planar=True, gravity=(0, 0))
    for name, inertia in (("motor", 2), ("load", 3)):
        m.add(fb.Body(name, mass=1, inertia=inertia), fb.Revolute(f"{name} shaft", "ground", name, at=(0, 0)))
    m.add(fb.Fixed("pin", "motor", "load", at=(0, 0)), fb.Motor("M", "motor shaft", torque="10*t"))
    m.add(fb.Event("shears", "abs(pin.torque) > 5", do=[fb.Release("pin")]))
    r = m.simulate(2.0, outputs=3, **FINE)
    t = 5 / 6
    assert [h.t for h in r.events] == pytest.approx([t], abs=1e-9)
    assert r["load.omega"][-1] == pytest.approx(t**2, abs=1e-9)
    assert r["motor.omega"][-1] == pytest.approx(t**2 + 5 * (4 - t**2) / 2, abs=1e-8)


@pytest.mark.parametrize("stiffness", [None, 200.0])
def test_a_rope_snaps(stiffness):
    """One that does not give, as the rod; one that does as it is long enough, 1 kg having fallen from rest."""
    if stiffness is None:
        at = (np.sin(1.5), -np.cos(1.5))
        rope = fb.Rope("rope", ("ground", "b"), at=((0, 0), at))
        m = pendulum(fb.Event("snaps", "rope.tension > 15", do=[fb.Release("rope")]), start=1.5, hangs=rope)
        (e,) = m.simulate(1.0, **FINE).events
        assert np.arctan2(e.before["b.x"], -e.before["b.y"]) == pytest.approx(breaks(15.0, 1.5)[0], abs=1e-8)
        return
    rope = fb.Rope("rope", ("ground", "b"), at=((0, 0), (0, -1)), length=1.0, stiffness=stiffness)
    m = pendulum(fb.Event("snaps", "rope.tension > 15", do=[fb.Release("rope")]), start=0.0, hangs=rope)
    r = m.simulate(1.0, **FINE)
    w = np.sqrt(stiffness)
    t = np.arccos(1 - 15 / G) / w
    assert [h.t for h in r.events if h.kind == "event"] == pytest.approx([t], abs=1e-9)
    late, fallen = 1.0 - t, 15 / stiffness
    speed = G / w * np.sin(w * t)
    assert r["b.y"][-1] == pytest.approx(-1 - fallen - speed * late - G * late**2 / 2, abs=1e-8)


def test_what_becomes_too_much_by_a_jump_breaks_at_once():
    """A rope that goes taut in a throw along it has no tension before, and v^2 / l more than it bears after."""
    m = fb.Mechanism("throw", planar=True, gravity=(0, 0))
    m.add(fb.Body("b", mass=1, inertia=0, position=(0, -0.6), velocity=(4, 0)))
    m.add(fb.Rope("rope", ("ground", "b"), at=((0, 0), (0, -0.6)), length=1.0))
    m.add(fb.Event("snaps", "rope.tension > 5", do=[fb.Release("rope")]))
    r = m.simulate(0.5, outputs=3, **FINE)
    assert [(h.name, h.kind) for h in r.events] == [("rope", "impact"), ("snaps", "event")]
    t = 0.8 / 4
    assert [h.t for h in r.events] == pytest.approx([t, t], abs=1e-10)
    way = np.array([0.6, 0.8])  # along the circle
    assert r["b"].velocity[-1, :2] == pytest.approx(4 * 0.6 * way, abs=1e-9)


@pytest.mark.parametrize("when", ["D.effort > 7", "stop.force > 2", "k.force < -3", "f.friction < -1.5"])
def test_efforts_along_coordinates(when):
    """A driver that pushes 2 kg by t^3 m, a stop on which t N press, a spring at t m, friction that holds t N."""
    m = fb.Mechanism("efforts", planar=True, gravity=(0, 0))
    for name, mass in (("a", 2), ("b", 1), ("c", 1), ("d", 1)):
        m.add(fb.Body(name, mass=mass, inertia=1), fb.Prismatic(f"P{name}", "ground", name, **ALONG))
    m.add(fb.Driver("D", "Pa.displacement", "t**3"), fb.Limit("stop", "Pb.displacement", lower=0))
    m.add(fb.Actuator("p", "Pb.displacement", force="-t"), fb.Driver("E", "Pc.displacement", "t"))
    m.add(fb.CoordinateSpring("k", "Pc.displacement", stiffness=2))
    m.add(fb.Brake("f", "Pd.displacement", capacity=4), fb.Actuator("q", "Pd.displacement", force="t"))
    m.add(fb.Event("enough", when))
    r = m.simulate(3, outputs=31, **FINE)
    t = {"D": 7 / 12, "stop": 2.0, "k": 1.5, "f": 1.5}[when.split(".")[0]]
    assert [h.t for h in r.events if h.name == "enough"] == pytest.approx([t], abs=1e-9)


def arm():
    """In space: a turned hinge, a universal joint told from the outer body, a ball joint and a weld."""
    m = fb.Mechanism("arm", gravity=(0.5, 1, -G))
    turned = dict(zip("abcd", ([0.1, 0, 0], [0, 0.4, 0], [0.3, 0.2, 0], [0, 0, 0.5]), strict=True))
    for k, (name, way) in enumerate(turned.items()):
        m.add(fb.Body(name, mass=1 + k, inertia=[0.2, 0.1, 0.15], position=(k + 0.5, 0.2 * k, 0), orientation=way))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0, 0), axis=(0, 1, 0.2)))
    m.add(fb.Universal("B", "b", "a", at=(1, 0.1, 0), axes=((0, 0, 1), (0, 1, 0))))
    m.add(fb.Spherical("C", "b", "c", at=(2, 0.3, 0)), fb.Fixed("W", "d", "c", at=(3, 0.5, 0)))
    return m


@pytest.mark.parametrize("what", ["fx", "fy", "fz", "tx", "ty", "tz", "force", "torque"])
def test_it_is_what_results_tell(what):
    """Of four kinds of joints: an event is where the curve of a result has the value that it has there."""
    t, names = 0.3, "ABCW" if what != "torque" else "ABW"
    r = arm().simulate(0.5, outputs=[0, t, 0.5], **FINE)
    for name in names:
        whole = getattr(r[name], what)[1]
        value = np.linalg.norm(whole)
        if what not in ("force", "torque"):
            value = whole
            assert value == r[f"{name}.{what}"][1]
        if abs(value) < 1e-6:
            continue
        m = arm()
        m.add(fb.Event("there", f"{name}.{what} - ({float(value)!r})", direction="either"))
        found = m.simulate(0.5, outputs=2, **FINE).events
        assert min(abs(h.t - t) for h in found) < 1e-8, (name, what)


def test_what_may_not_be_named():
    m = pendulum()
    for law in ("rod.fx", "rod.force"):
        with pytest.raises(fb.ModelError, match=r"rod\.f"):
            m.add(fb.PointForce("push", "b", force=(law, 0)))
        with pytest.raises(fb.ModelError, match="rod"):
            m.add(fb.Event("e", "t > 1", do=[fb.Impulse("b", (law, 0))]))
    with pytest.raises(fb.ModelError, match="known only after the accelerations are"):
        m.add(fb.Event("e", "b.ax > 1"))
    with pytest.raises(fb.ModelError, match=r"rod\.tension"):
        m.add(fb.Event("e", "rod.tension > 1"))


def test_what_redundant_joints_share_is_told_as_a_choice():
    """A pin off the axis that both shafts turn about: the shafts bear what they like of its force."""
    m = fb.Mechanism("shared", planar=True, gravity=(0, 0))
    for name in "ab":
        m.add(fb.Body(name, mass=1, inertia=1), fb.Revolute(f"shaft {name}", "ground", name, at=(0, 0)))
    m.add(fb.Fixed("pin", "a", "b", at=(0.1, 0)), fb.Motor("M", "shaft a", torque="t"))
    m.add(fb.Event("shears", "pin.force > 1e9", do=[fb.Release("pin")]))
    assert any("'pin.force'" in text for text in m.simulate(0.1, coordinates="absolute").health.warnings)
    with pytest.raises(fb.AnalysisError, match=r"'pin\.force'"):
        m.simulate(0.1, coordinates="joint")


@pytest.mark.parametrize("kind", ["brake", "stop", "rope"])
def test_what_is_carried_from_the_start_has_not_become_so(kind):
    """1 kg rests on a rod of 1 m: on a stop or brake its hinge bears 9.81 N, on a rope 6.94; nothing jumps to that."""
    m = fb.Mechanism("at rest", planar=True, gravity=(0, -G), parameters={"k": 1.0})
    m.add(fb.Body("b", mass=1, inertia=0.1, position=(1, 0)), fb.Revolute("A", "ground", "b", at=(0, 0)))
    holds = {"brake": fb.Brake("h", "A.angle", capacity=20), "stop": fb.Limit("h", "A.angle", lower=0)}
    m.add(holds.get(kind) or fb.Rope("h", ("ground", "b"), at=((0, 1), (1, 0))))
    bears = float(G / np.sqrt(2)) if kind == "rope" else G
    for name, sign in (("more", ">"), ("less", "<")):
        for part, by in (("under", 0.9), ("over", 1.1)):
            m.add(fb.Event(f"{name} {part}", f"A.force {sign} {by * bears!r}", do=[fb.Release("A")]))
    m.add(fb.Event("begun", "start", do=[fb.Set("k", 2)]))
    r = m.simulate(0.3, outputs=3)
    assert [h.name for h in r.events if h.kind == "event"] == ["begun"]
    assert np.abs(r["b.y"]).max() < 1e-12


LOCKED = {
    "revolute": lambda: fb.Revolute("J", "arm", "load", at=(0.3, 0.1, 0), axis=(0, 1, 1)),
    "prismatic": lambda: fb.Prismatic("J", "arm", "load", at=(0.3, 0.1, 0), axis=(1, 2, 0)),
    "cylindrical": lambda: fb.Cylindrical("J", "arm", "load", at=(0.3, 0.1, 0), axis=(1, 0, 1)),
    "universal": lambda: fb.Universal("J", "arm", "load", at=(0.3, 0.1, 0), axes=((1, 0, 0), (0, 1, 0))),
    "screw": lambda: fb.Screw("J", "arm", "load", at=(0.3, 0.1, 0), axis=(1, 0, 0), lead=0.02),
    "planar": lambda: fb.Planar("J", "arm", "load", at=(0.3, 0.1, 0), axis=(0, 1, 1)),
    "turned round": lambda: fb.Revolute("J", "load", "arm", at=(0.3, 0.1, 0), axis=(0, 1, 1)),
}


@pytest.mark.parametrize("named", [False, True])
@pytest.mark.parametrize("kind", LOCKED)
def test_a_locked_joint_carries_what_its_load_needs(kind, named):
    """Newton and Euler: m (a - g), and I alpha + w x I w about the load's centre, through the joint."""
    m = fb.Mechanism("locked", gravity=(0, 0, -G))
    m.add(fb.Body("arm", mass=2, inertia=(0.1, 0.2, 0.3), angular_velocity=(0, 0, 0.7)))
    about = {"velocity": (-0.14, 0.35, 0), "angular_velocity": (0, 0, 0.7)}
    m.add(fb.Body("load", mass=3, inertia=(0.02, 0.05, 0.04), position=(0.5, 0.2, 0.1), **about))
    m.add(fb.Revolute("R", "ground", "arm", at=(0, 0, 0), axis=(0, 0, 1)), LOCKED[kind]())
    m.add(fb.Motor("M", "R", torque="3*t + 1"), fb.Event("lock", "start", do=[fb.Lock("J")]))
    if named:
        m.add(fb.Event("over", "J.force + J.torque > 1e6"))
    r = m.simulate(0.4, outputs=5, **FINE)
    load, inertia = r["load"], np.diag((0.02, 0.05, 0.04))
    force, torque = r["J"].reaction(on="load")
    at = r["arm"].position + np.einsum("nij,j->ni", r["arm"].rotation, (0.3, 0.1, 0.0))
    for k in range(len(r.t)):
        R, w = load.rotation[k], load.angular_velocity[k]
        I = R @ inertia @ R.T
        need = 3 * (load.acceleration[k] + (0, 0, G))
        spin = I @ load.angular_acceleration[k] + np.cross(w, I @ w) + np.cross(load.position[k] - at[k], need)
        np.testing.assert_allclose(force[k], need, rtol=1e-7, atol=1e-7)
        np.testing.assert_allclose(torque[k], spin, rtol=1e-7, atol=1e-7)


def test_a_locked_hinge_shears():
    """2 t N m turn 0.1 and 0.3 kg m^2: the lock bears 1.5 t, to 3 N m."""
    for named in (True, False):
        m = fb.Mechanism("pin", planar=True, gravity=(0, 0))
        m.add(fb.Body("rotor", mass=1, inertia=0.1), fb.Body("load", mass=1, inertia=0.3))
        m.add(fb.Revolute("R", "ground", "rotor", at=(0, 0)), fb.Revolute("H", "rotor", "load", at=(0, 0)))
        m.add(fb.Motor("M", "R", torque="2*t"), fb.Event("lock", "start", do=[fb.Lock("H")]))
        if named:
            m.add(fb.Event("shears", "abs(H.torque) > 3 N*m", do=[fb.Release("H")]))
        r = m.simulate(4, outputs=[0, 1, 1.5, 3, 4])
        np.testing.assert_allclose(r["H.torque"], [0, 1.5, 2.25, *((0, 0) if named else (4.5, 6))], atol=1e-9)
        assert [h.t for h in r.events["shears"]] == pytest.approx([2.0], abs=1e-9) if named else True


def test_a_locked_slide_lets_go():
    """A locked slide bears the weight that swings on it."""
    m = fb.Mechanism("slide", planar=True, gravity=(0, -G))
    m.add(fb.Body("b", mass=2, inertia=0.1), fb.Prismatic("P", "ground", "b", at=(0, 0), axis=(0, 1)))
    m.add(fb.Actuator("pull", "P.displacement", force="-10*t"))
    m.add(fb.Event("lock", "start", do=[fb.Lock("P")]), fb.Event("off", "P.fy > 30", do=[fb.Release("P")]))
    r = m.simulate(1.5, outputs=[0.5, 1.0, 1.5])
    assert r["P"].force[:2, 1] == pytest.approx([2 * G + 5, 2 * G + 10])
    assert [h.t for h in r.events["off"]] == pytest.approx([(30 - 2 * G) / 10], abs=1e-9)


def test_friction_is_pressed_by_what_a_lock_carries():
    """A collar of 2 kg hangs on its locked displacement and turns: mu m g r slows it."""
    m = fb.Mechanism("collar", gravity=(0, 0, -G))
    m.add(fb.Body("b", mass=2, inertia=(0.1, 0.1, 0.2), angular_velocity=(0, 0, 5)))
    m.add(fb.Cylindrical("C", "ground", "b", at=(0, 0, 0), axis=(0, 0, 1)))
    m.add(fb.JointFriction("f", "C", static=0.1, radius=0.05, coordinate="angle"))
    m.add(fb.Event("lock", "start", do=[fb.Lock("C.displacement")]))
    r = m.simulate(1.0, outputs=3)
    slower = 0.1 * 2 * G * 0.05 / 0.2
    assert r["C.angle_rate"] == pytest.approx([5, 5 - slower / 2, 5 - slower], rel=1e-8)
    assert r["C"].force[:, 2] == pytest.approx(2 * G)
    assert r["C"].torque[:, 2] == pytest.approx(0.0, abs=1e-9)
