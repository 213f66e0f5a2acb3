"""Friction in joints: closed forms in motion, sticking, the load that counts, and joints that jam."""

import re
import warnings

import numpy as np
import pytest

import flyball as fb
from flyball.errors import SimulationError
from flyball.model.element import element
from tests.layers import AUTO, both_layers, in_force

pytestmark = both_layers

G = 9.81
SLOPE = 0.5
laws = pytest.mark.parametrize("law", [{}, {"stick_speed": 1e-3}], ids=["sticks", "regularised"])


def way(law, speed):
    """Part of the full friction that acts while surfaces slide."""
    return np.tanh(speed / law["stick_speed"]) if law else np.sign(speed)


def block(planar, mu, speed=0.0, mass=2.0, **more):
    """A block on a slope, with its centre of mass in the slide."""
    m = fb.Mechanism("block", planar=planar, gravity=(0, -G) if planar else (0, -G, 0))
    axis = (np.cos(SLOPE), -np.sin(SLOPE), 0.0)[: 2 if planar else 3]
    inertia = 0.1 if planar else (0.1, 0.2, 0.15)
    m.add(fb.Body("block", mass=mass, inertia=inertia, velocity=tuple(speed * np.array(axis))))
    kind = fb.Translational if planar else fb.Prismatic
    m.add(kind("slide", "ground", "block", at=(0.0,) * len(axis), axis=axis))
    m.add(fb.JointFriction("f", joint="slide", static=mu, **more))
    return m


@pytest.mark.parametrize("planar", [True, False], ids=["plane", "space"])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_block_slides_on_a_slope(planar, direction):
    """a = g (sin -+ mu cos): down, and up while it still goes up."""
    r = block(planar, 0.3, 2.0 * direction).simulate(0.2, outputs=11)
    a = G * (np.sin(SLOPE) - direction * 0.3 * np.cos(SLOPE))
    assert r["slide"].acceleration == pytest.approx(np.full(11, a), rel=1e-9)
    assert r["f"].friction == pytest.approx(np.full(11, -direction * 0.3 * 2.0 * G * np.cos(SLOPE)), rel=1e-9)
    assert r["f"].work[-1] == pytest.approx(-0.3 * 2.0 * G * np.cos(SLOPE) * abs(r["slide"].displacement[-1]), rel=1e-6)
    assert r.health.energy_drift < 1e-7


def test_block_sticks_on_a_slope():
    """tan(slope) = 0.55 of 0.9: it comes to rest and then creeps slower than the stick speed, and stays there."""
    r = block(True, 0.9, 1.0, stick_speed=1e-3).simulate(2.0, outputs=201, rtol=1e-8)
    late = r.t > 1.0
    creep = r["slide"].rate[late]
    assert (np.abs(creep) < 1e-3).all()
    assert creep == pytest.approx(np.full(late.sum(), 1e-3 * np.arctanh(np.tan(SLOPE) / 0.9)), rel=1e-4)
    assert r["f"].friction[late] == pytest.approx(np.full(late.sum(), -2.0 * G * np.sin(SLOPE)), rel=1e-5)


@laws
def test_stribeck_law_and_viscous_part(law):
    """mu falls from static to kinetic over the Stribeck speed; viscous friction and preload add to it."""
    more = {"kinetic": 0.2, "stribeck_speed": 0.5, "viscous": 1.5, "preload": 4.0}
    r = block(True, 0.3, 2.0, **more, **law).simulate(1.5, outputs=31)
    v = r["slide"].rate
    mu = 0.2 + 0.1 * np.exp(-((v / 0.5) ** 2))
    expected = -mu * (2.0 * G * np.cos(SLOPE) + 4.0) * way(law, v) - 1.5 * v
    assert r["f"].friction == pytest.approx(expected, rel=1e-9)


@laws
@pytest.mark.parametrize("planar", [True, False], ids=["plane", "space"])
def test_wheel_in_a_plain_bearing(planar, law):
    """A balanced wheel loaded by its weight slows down at mu m g r / J, and stands still after w J / (mu m g r)."""
    m = fb.Mechanism("wheel", planar=planar, gravity=(0, -G) if planar else (0, 0, -G))
    axis = {} if planar else {"axis": (0, 1, 0)}
    inertia, w = (0.05, 6.0) if planar else ((0.03, 0.05, 0.03), (0, 6.0, 0))
    m.add(fb.Body("wheel", mass=3.0, inertia=inertia, angular_velocity=w))
    m.add(fb.Revolute("bearing", "ground", "wheel", at=(0, 0) if planar else (0, 0, 0), **axis))
    m.add(fb.JointFriction("f", joint="bearing", static=0.1, radius=0.02, **law))
    slowing = 0.1 * 3.0 * G * 0.02 / 0.05
    stop = 6.0 / slowing
    r = m.simulate(1.2 * stop, outputs=121)
    turning = r.t < 0.95 * stop
    assert r["bearing"].rate[turning] == pytest.approx(6.0 - slowing * r.t[turning], rel=1e-6)
    assert (np.abs(r["bearing"].rate[r.t > 1.02 * stop]) < (0.01 if law else 1e-14)).all()


def test_thrust_bending_and_twist_load_a_joint():
    """An overhung slide in a guide of two points: |R/2 + M/L| + |R/2 - M/L|, as vectors; twist by a pair of forces."""
    m = fb.Mechanism("overhung", gravity=(0, 0, -G))
    m.add(fb.Body("arm", mass=2.0, inertia=(0.1, 0.2, 0.15), position=(0.4, 0.3, 0), velocity=(1.0, 0, 0)))
    m.add(fb.Prismatic("slide", "ground", "arm", at=(0.1, 0, 0), axis=(1, 0, 0)))
    m.add(fb.JointFriction("f", joint="slide", static=0.05, bending_length=0.25, twist_length=0.2))
    r = m.simulate(0.1, outputs=5)
    weight = 2.0 * G
    # the friction -F e_x acts at the joint's point; the arm's inertia pulls at its centre of mass, 0.3 beside
    F = -r["f"].friction
    # about y from the weight, about z from slowing the mass: opposite forces at both points of the guide
    up, aside = weight * 0.3 / 0.25, F * 0.3 / 0.25
    pressed = np.hypot(aside, weight / 2 + up) + np.hypot(aside, weight / 2 - up)
    expected = 0.05 * (pressed + 2 * weight * 0.3 / 0.2)
    assert expected == pytest.approx(F, rel=1e-9)
    assert r["slide"].acceleration == pytest.approx(-F / 2.0, rel=1e-9)


def test_thrust_on_a_collar():
    """A vertical shaft on a collar: only its weight along the axis presses, by the thrust factor."""
    m = fb.Mechanism("shaft", gravity=(0, 0, -G))
    m.add(fb.Body("shaft", mass=4.0, inertia=(0.1, 0.1, 0.02), angular_velocity=(0, 0, 30.0)))
    m.add(fb.Revolute("J", "ground", "shaft", at=(0, 0, 0.3), axis=(0, 0, 1)))
    m.add(fb.JointFriction("f", joint="J", static=0.1, radius=0.03, thrust_factor=0.7))
    r = m.simulate(0.5, outputs=6)
    assert r["J"].acceleration == pytest.approx(np.full(6, -0.1 * 0.03 * 0.7 * 4.0 * G / 0.02), rel=1e-9)


@laws
def test_both_axes_of_a_universal_joint(law):
    """Each axis has its own load and bearing radius: the joint's own force, square to that axis or along it."""
    m = fb.Mechanism("hooke", gravity=(0, 0, -G))
    m.add(fb.Body("arm", mass=2.0, inertia=(0.1, 0.1, 0.1), position=(0.3, 0, 0), angular_velocity=(3.0, -4.0, 0)))
    m.add(fb.Universal("U", "ground", "arm", at=(0, 0, 0), axes=((0, 1, 0), (1, 0, 0))))
    m.add(fb.JointFriction("f1", joint="U", coordinate="angle_1", static=0.2, radius=0.02, thrust_factor=0.5, **law))
    m.add(fb.JointFriction("f2", joint="U", coordinate="angle_2", static=0.2, radius=0.02, thrust_factor=0.5, **law))
    r = m.simulate(0.3, outputs=13)
    force = r["U"].force
    for k, axis in (("1", np.tile((0.0, 1.0, 0.0), (13, 1))), ("2", r["arm"].rotation[:, :, 0])):
        thrust = (force * axis).sum(axis=1)
        load = np.sqrt((force**2).sum(axis=1) - thrust**2) + 0.5 * np.abs(thrust)
        speed = 0.02 * getattr(r["U"], f"angle_{k}_rate")
        assert r[f"f{k}"].friction == pytest.approx(-0.02 * 0.2 * load * way(law, speed), rel=1e-9)
    assert r.health.energy_drift < 1e-7


def test_a_pin_in_a_slot_has_friction_of_two_kinds():
    """Sliding along the slot, and turning in it about the normal, from one and the same force."""
    m = fb.Mechanism("slot", planar=True, gravity=(0, -G))
    m.add(fb.Body("pin", mass=1.0, inertia=0.01, velocity=(2.0, 0), angular_velocity=30.0))
    m.add(fb.PinInSlot("S", "ground", "pin", at=(0, 0), axis=(1, 0)))
    m.add(
        fb.JointFriction("slide", joint="S", static=0.1), fb.JointFriction("turn", joint="S", static=0.1, radius=0.01)
    )
    r = m.simulate(0.2, outputs=5)
    assert r["S"].displacement_acceleration == pytest.approx(np.full(5, -0.1 * G), rel=1e-9)
    assert r["S"].angle_acceleration == pytest.approx(np.full(5, -0.1 * G * 0.01 / 0.01), rel=1e-9)


def test_a_joint_without_load_has_no_friction():
    """Gravity along the slide presses nothing: what rounding leaves of a load does not matter."""
    m = fb.Mechanism("fall", gravity=(1, 2, -2))
    m.add(fb.Body("a", mass=1.0, inertia=(1, 2, 2.5), velocity=(0.1, 0.2, -0.2)))
    m.add(fb.Prismatic("slide", "ground", "a", at=(0.3, 0.6, -0.6), axis=(1, 2, -2)))
    m.add(fb.JointFriction("f", joint="slide", static=0.5, bending_length=0.1, twist_length=0.1))
    r = m.simulate(1.0, outputs=5)
    assert r["slide"].acceleration == pytest.approx(np.full(5, 3.0), rel=1e-9)


def drawer(ahead, arm, mu=0.3, length=0.1, **law):
    """A drawer on a rail with its centre of mass ahead of and under the point that rubs."""
    m = fb.Mechanism("drawer", planar=True, gravity=(0, -G))
    m.add(fb.Body("drawer", mass=1.0, inertia=0.1, velocity=(1, 0), com=(ahead, -arm)))
    m.add(fb.Translational("rail", "ground", "drawer", at=(0, 0), axis=(1, 0)))
    m.add(fb.JointFriction("rub", joint="rail", static=mu, bending_length=length, **law))
    return m


@pytest.mark.parametrize(("ahead", "arm"), [(-1.0, 1.0), (-0.1, 0.34), (0.2, 1.0)])
def test_friction_that_outweighs_its_cause_jams(ahead, arm):
    """F = mu max(m g, 2 |m g x - F h| / L) has no solution where 2 mu h / L > 1, unless the weight tilts it back."""
    with pytest.raises(SimulationError, match="JointFriction 'rub' jams joint 'rail'") as caught:
        drawer(ahead, arm, stick_speed=1e-3).simulate(1.0)
    assert "bending_length" in str(caught.value)
    assert caught.value.t == 0.0


@pytest.mark.parametrize(("ahead", "arm"), [(-1.0, 1.0), (0.2, 1.0)])
def test_what_jams_and_can_stick_stops(ahead, arm):
    """The same with friction that sticks: it stops at once, which takes all its energy, and the event says why."""
    r = drawer(ahead, arm).simulate(0.1, outputs=3)
    (jam,) = r.events
    assert jam.t == 0.0 and "Painleve" in jam.done[0]
    assert jam.lost == pytest.approx(0.5, rel=1e-9)
    assert np.abs(r["rail"].displacement).max() < 1e-14


@pytest.mark.parametrize(("ahead", "arm"), [(0.5, 0.1), (-0.5, 0.1), (1.0, 0.32), (-1.0, 0.16), (1.0, 0.5), (1.0, 1.0)])
def test_friction_that_eases_or_adds_to_its_own_load(ahead, arm):
    """The same with a solution; of two the smaller one holds, which grows from no friction at all."""
    r = drawer(ahead, arm).simulate(0.001, outputs=2)
    side = 1.0 if ahead > 0.0 else -1.0  # that the rail is pressed on
    F = 0.6 * G * side * ahead / 0.1 / (1.0 + side * 0.6 * arm / 0.1)
    assert side * (G * ahead - F * arm) > 0.05 * G  # both points of the guide press, on opposite sides
    assert r["rub"].friction[0] == pytest.approx(-F, rel=1e-9)
    assert r["rail"].acceleration[0] == pytest.approx(-F, rel=1e-9)


@laws
def test_two_joints_that_load_one_another(law):
    """A crank-slider with friction in three joints: each friction is its law of its own joint's reaction."""
    m = fb.Mechanism("crank-slider", planar=True, gravity=(0, -G))
    m.add(fb.Body("crank", mass=0.5, inertia=0.002, position=(0.1, 0)))
    m.add(fb.Body("rod", mass=0.8, inertia=0.01, position=(0.4, 0)))
    m.add(fb.Body("piston", mass=0.6, inertia=0.001, position=(0.6, 0)))
    m.add(fb.Revolute("A", "ground", "crank", at=(0, 0)), fb.Revolute("B", "crank", "rod", at=(0.2, 0)))
    m.add(fb.Revolute("C", "rod", "piston", at=(0.6, 0)))
    m.add(fb.Translational("P", "ground", "piston", at=(0.6, 0), axis=(1, 0)))
    m.add(fb.Initial("A.angle", value=0.5, rate=12.0))
    m.add(
        fb.JointFriction("fa", joint="A", static=0.2, radius=0.02, **law),
        fb.JointFriction("fb", joint="B", static=0.2, radius=0.02, **law),
    )
    m.add(fb.JointFriction("fp", joint="P", static=0.3, bending_length=0.1, **law))
    r = m.simulate(0.4, outputs=21)
    for name, joint, arm in (("fa", "A", 0.02), ("fb", "B", 0.02)):
        load = np.linalg.norm(r[joint].force, axis=1)
        speed = arm * r[joint].rate
        assert r[name].friction == pytest.approx(-arm * 0.2 * load * way(law, speed), rel=1e-9)
    load = np.maximum(
        np.abs(r["P"].force[:, 1]), 2 * np.abs(r["P"].torque) / 0.1
    )  # a guide of two points, in the plane
    assert r["fp"].friction == pytest.approx(-0.3 * load * way(law, r["P"].rate), rel=1e-9)
    assert r.health.energy_drift < 1e-6
    # Newton for the piston along the slide: rod's pull and friction
    assert r["C"].force[:, 0] + r["fp"].friction == pytest.approx(0.6 * r["P"].acceleration, abs=1e-8)


@laws
@pytest.mark.parametrize("seed", [1, 9, 28, 50])
def test_frictions_that_load_one_another(seed, law):
    """A slide and a hinge on it, in any direction: each friction loads the other joint; both laws hold at once."""
    rng = np.random.default_rng(seed)
    n, p = rng.normal(size=3), rng.normal(size=3)
    n /= np.linalg.norm(n)
    m = fb.Mechanism("two", gravity=tuple(3.0 * n))
    for name, more in (("a", {"velocity": 0.3 * n}), ("b", {"velocity": 0.3 * n, "angular_velocity": n})):
        m.add(fb.Body(name, mass=1.0, inertia=(1, 2, 2.5), position=p, **more))
    m.add(fb.Prismatic("slide", "ground", "a", at=p, axis=n), fb.Revolute("hinge", "a", "b", at=p, axis=n))
    for name, radius in (("slide", None), ("hinge", 0.1)):
        lengths = {"bending_length": 0.2, "twist_length": 0.2}
        m.add(fb.JointFriction(f"f {name}", joint=name, static=0.5, radius=radius, **lengths, **law))
    r = m.simulate(0.2, outputs=5)
    for name, radius in (("slide", 1.0), ("hinge", 0.1)):
        force, torque = r[name].reaction()
        thrust, twist = force @ n, torque @ n
        radial, couple = force - np.outer(thrust, n), np.cross(torque, n) / 0.2
        load = sum(np.linalg.norm(radial / 2 + side * couple, axis=1) for side in (1, -1))
        load += np.abs(thrust) + 2 * np.abs(twist) / 0.2
        expected = -radius * 0.5 * load * way(law, radius * r[name].rate)
        assert r[f"f {name}"].friction == pytest.approx(expected, rel=1e-8, abs=1e-9)
    total = 2.0 * (r["a"].acceleration @ n)
    assert total == pytest.approx(2.0 * 3.0 + r["f slide"].friction, rel=1e-8)


@pytest.mark.parametrize("rubbing", ["left", "right"])
def test_friction_in_one_of_two_hinges_on_one_axis(rubbing):
    """What each carries is a choice; it is made once, whichever coordinates cost less, and refused where it cannot be.

    Of the same size, each carries half: the wheel slows down by mu (m g / 2) r / J.
    """
    m = fb.Mechanism("wheel", gravity=(0, 0, -G))
    m.add(fb.Body("wheel", mass=3.0, inertia=(0.03, 0.05, 0.03), angular_velocity=(0, 6.0, 0)))
    for name, y in (("left", -0.1), ("right", 0.1)):
        m.add(fb.Revolute(name, "ground", "wheel", at=(0, y, 0), axis=(0, 1, 0)))
    m.add(fb.JointFriction("f", joint=rubbing, static=0.1, radius=0.02))
    slowing = 0.1 * 1.5 * G * 0.02 / 0.05
    for coordinates in ("auto", "absolute") if in_force() == AUTO else ("absolute",):
        r = m.simulate(0.5, outputs=3, coordinates=coordinates)
        assert r[rubbing].rate == pytest.approx(6.0 - slowing * r.t, rel=1e-6)
        assert r.health.coordinates.startswith("absolute")
        assert any("not unique" in w for w in r.health.warnings)
    with pytest.raises(
        fb.AnalysisError, match=r"JointFriction 'f' follows reactions .* left, right leave undetermined"
    ):
        m.simulate(0.5, coordinates="joint")


def test_friction_that_counts_no_moments_does_not_mind_those_left_open():
    """A block kept from turning twice: which of both does it is open, but friction leaves moments out."""
    m = fb.Mechanism("block", gravity=(0, 0, -G))
    m.add(fb.Body("block", mass=2.0, inertia=(0.1, 0.1, 0.1), velocity=(1, 0, 0)))
    m.add(fb.Prismatic("slide", "ground", "block", at=(0, 0, 0), axis=(1, 0, 0)))
    m.add(fb.Orientation("square", "ground", "block", at=(0, 0, 0)))
    m.add(fb.JointFriction("f", joint="slide", static=0.1))
    for coordinates in ("absolute", "joint"):
        r = m.simulate(0.1, outputs=3, coordinates=coordinates)
        assert r["slide"].acceleration == pytest.approx(np.full(3, -0.1 * G), rel=1e-8)
        assert r.health.warnings == ()


@pytest.mark.parametrize(("mu", "holds"), [(0.249, False), (0.251, True)])
def test_a_guide_of_two_points_jams_at_half_its_length_over_the_arm(mu, holds):
    """Textbook: a collar of length L pushed along its rod at the distance e jams from mu = L / (2 e) on, however hard."""
    m = fb.Mechanism("collar", planar=True)
    m.add(fb.Body("collar", mass=1.0, inertia=1e-3), fb.Prismatic("rod", "ground", "collar", at=(0, 0), axis=(1, 0)))
    m.add(fb.JointFriction("rub", "rod", static=mu, bending_length=0.2), fb.Frame("arm", "collar", position=(0, 0.4)))
    m.add(fb.PointForce("push", "arm", force=(100.0, 0)))
    r = m.simulate(0.1, outputs=2)
    assert r["rod"].acceleration[-1] == pytest.approx(0.0 if holds else 100.0 * (1 - 2 * mu * 0.4 / 0.2), abs=1e-6)


def nut(torque, flank=1.0, **law):
    """A nut of 100 N on a thread of 10 mm mean radius and 45 deg lead angle."""
    m = fb.Mechanism("jack", gravity=(0, 0, -G))
    m.add(fb.Body("nut", mass=100 / G, inertia=(1, 1, 1)))
    m.add(fb.Screw("thread", "ground", "nut", at=(0, 0, 0), axis=(0, 0, 1), lead=2 * np.pi * 0.01))
    m.add(fb.Motor("motor", "thread", torque=torque))
    m.add(fb.JointFriction("rub", "thread", static=0.15, radius=0.01, thrust_factor=flank, **law))
    return m


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize("flank", [1.0, 1 / np.cos(np.radians(15))])
def test_friction_of_a_thread(coordinates, flank):
    """It lifts from F r tan(a + phi) on, sinks below F r tan(a - phi), tan(phi) = mu / cos(flank angle); slides as
    (I + m h r tan(a + phi)) dw/dt = T - F r tan(a + phi), h the lead for one radian."""
    phi = np.arctan(0.15 * flank)
    lift, sink = np.tan(np.pi / 4 + phi), np.tan(np.pi / 4 - phi)
    assert flank != 1.0 or (round(lift, 3), round(sink, 3)) == (1.353, 0.739)
    for torque, way in ((lift + 1e-3, 1), (lift - 1e-3, 0), (sink + 1e-3, 0), (sink - 1e-3, -1)):
        r = nut(torque, flank).simulate(0.05, outputs=2, coordinates=coordinates)
        assert np.sign(r["thread"].angle_acceleration[-1].round(9)) == way
    r = nut(2.0, flank).simulate(0.05, outputs=2, coordinates=coordinates)
    expected = (2.0 - lift) / (1 + 100 / G * 1e-4 * lift)
    assert r["thread"].angle_acceleration == pytest.approx(np.full(2, expected), rel=1e-9)
    assert r["rub"].value == pytest.approx(r["thread"].angle, abs=1e-12)
    assert r["rub"].friction * r["rub"].rate == pytest.approx(r["rub"].power, rel=1e-9)
    assert np.abs(r.energy.balance).max() < 1e-9


def test_friction_of_a_thread_by_steps_of_impulses():
    """It holds and slides at the same torques."""
    for torque, rate in ((1.3, 0.0), (1.4, 2.35e-3), (0.78, 0.0), (0.7, -1.95e-3)):
        r = nut(torque).simulate(0.05, outputs=2, method="impulse")
        assert r["thread"].angle_rate[-1] == pytest.approx(rate, abs=6e-4)


def test_a_second_friction_on_one_surface_is_refused():
    """Friction of one surface is mu N against its whole slip, in whatever direction; two would be a box."""
    block = fb.Body("block", mass=1, inertia=(1, 1, 1))
    for joint, first, second in (
        (fb.Planar, {"coordinate": "x"}, {"coordinate": "y"}),
        (fb.PointInPlane, {"coordinate": "x"}, {"coordinate": "y"}),
        (fb.Cylindrical, {}, {"radius": 0.01}),
    ):
        m = fb.Mechanism("table")
        m.add(block, joint("table", "ground", "block", at=(0, 0, 0), axis=(0, 0, 1)))
        m.add(fb.JointFriction("f", "table", static=0.3, **first))
        with pytest.raises(
            fb.ModelError, match=r"JointFriction 'g': JointFriction 'f' already acts on the surface of \w+ 'table'"
        ):
            m.add(fb.JointFriction("g", "table", static=0.3, **second))
        m.add(fb.JointFriction("seal", "table", static=0.1, preload=5, **first))
        m.replace(fb.JointFriction("f", "table", static=0.2, **first))


@element
class Tray(fb.Planar):
    """A joint of two slides that does not declare whether they are of one surface."""

    one_surface = False


@element
class Gantry(fb.Orientation):
    """One without a normal force."""


def test_friction_along_two_directions_of_one_plane_is_a_box_and_says_so():
    for joint, said in ((Tray, 1), (Gantry, 0)):
        m = fb.Mechanism("table")
        m.add(fb.Body("block", mass=1, inertia=(1, 1, 1)))
        axis = {"axis": (0, 0, 1)} if joint is Tray else {}
        m.add(joint("table", "ground", "block", at=(0, 0, 0), **axis))
        m.add(fb.JointFriction("f", "table", static=0.3, coordinate="x"))
        with warnings.catch_warnings(record=True) as found:
            warnings.simplefilter("always")
            m.add(fb.JointFriction("g", "table", static=0.3, coordinate="y"))
        assert len(found) == said
        for x in found:
            assert re.match(
                r"JointFriction 'g' and JointFriction 'f' .*in one plane of Tray 'table'.*one_surface", str(x.message)
            )


def test_friction_of_a_screw_says_what_it_needs():
    m = nut(1.0)
    with pytest.raises(fb.ModelError, match=r"needs the mean radius of the thread; give radius="):
        m.add(fb.JointFriction("f", "thread", static=0.1))
    with pytest.raises(fb.ModelError, match=r"twist_length has no effect on Screw 'thread'"):
        m.add(fb.JointFriction("f", "thread", static=0.1, radius=0.01, twist_length=0.1))
    m.add(fb.Body("b", mass=1, inertia=(1, 1, 1)), fb.Revolute("A", "ground", "b", at=(0, 0, 0), axis=(0, 0, 1)))
    with pytest.raises(fb.ModelError, match=r"Revolute 'A' has no thread"):
        m.add(fb.JointFriction("f", "A", coordinate="thread", static=0.1, radius=0.01))
    plain = fb.JointFriction("rub", "thread", static=0.15, radius=0.01)
    assert m.replace(plain).coordinate == m.changed({"rub": plain})["rub"].coordinate == "thread"


@pytest.mark.parametrize("law", [{}, {"stick_speed": 1e-3}])
def test_more_frictions_than_newton_takes_steps(law):
    """A hundred pendulums, one hung on another: each friction is its law at its own joint's load, from rest on."""
    rng = np.random.default_rng(0)
    m, tips = fb.Mechanism("tree", gravity=(0, 0, -G)), {"ground": np.zeros(3)}
    for k in range(100):
        on = str(rng.choice(list(tips)))
        base, d = tips[on], rng.normal(size=3)
        d *= 0.1 / np.linalg.norm(d)
        tips[f"b{k}"] = base + d
        m.add(fb.Body(f"b{k}", mass=1, inertia=(1e-3,) * 3, position=base + d / 2))
        m.add(fb.Revolute(f"j{k}", on, f"b{k}", at=base, axis=rng.normal(size=3)))
        m.add(fb.JointFriction(f"f{k}", f"j{k}", static=0.2, radius=0.02, **law))
    r = m.simulate(1e-3, outputs=2)
    for k in range(100):
        force, axis = r[f"j{k}"].reaction(axes="joint")[0], np.array([0.0, 0.0, 1.0])
        thrust = force @ axis
        load = np.linalg.norm(force - np.outer(thrust, axis), axis=1) + np.abs(thrust)
        most = 0.02 * 0.2 * load
        assert (np.abs(r[f"f{k}"].friction) <= most * (1 + 1e-6)).all()
        slides = np.abs(r[f"j{k}"].rate[-1]) > 1e-9
        if slides:
            want = -most[-1] * way(law, 0.02 * r[f"j{k}"].rate)[-1]
            assert r[f"f{k}"].friction[-1] == pytest.approx(want, rel=1e-6)


@pytest.mark.parametrize(
    ("spin", "given", "said"),
    [
        (50.0, {"coordinate": "displacement", "radius": 0.01}, r"'C.angle' it slips 0.25 m without"),
        (50.0, {"coordinate": "displacement"}, r"'C.angle' it slips 25 rad without"),
        (0.0, {"coordinate": "displacement", "radius": 0.01}, ""),
        (50.0, {"coordinate": "angle", "radius": 0.01}, r"'C.displacement' it slips 0.125 m without"),
    ],
)
def test_friction_along_one_coordinate_says_where_its_surface_slips_along_another(spin, given, said):
    """A shaft in a bush, pushed with half of what friction holds at rest: one that spins fast would creep at once."""
    m = fb.Mechanism("shaft", gravity=(0, 0, -9.81))
    m.add(
        fb.Body("b", mass=1.0, inertia=(0.1, 0.1, 0.1)),
        fb.Cylindrical("C", "ground", "b", axis=(1, 0, 0), at=(0, 0, 0)),
    )
    m.add(fb.Initial("C.angle", rate=spin), fb.PointForce("push", "b", at=(0, 0, 0), force=(1.0, 0, 0)))
    m.add(fb.JointFriction("f", joint="C", static=0.2, **given))
    found = m.simulate(0.5).health.warnings
    assert len(found) == bool(said)
    assert not said or (re.search(said, found[0]) and "JointFriction 'f' acts along" in found[0])
