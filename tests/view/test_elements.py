"""Symbols of wheels, gears, cams, ropes and the like: where they are, how large, and that they fit one another."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import flyball as fb
from flyball.view.animation import record_motion
from flyball.view.page import check_recording
from flyball.view.recording import RecordedJoint, Recording
from tests.view.test_animate import turned


def body(name: str, position: tuple[float, ...], **more: object) -> fb.Body:
    inertia = 0.02 if len(position) == 2 else (0.02, 0.02, 0.02)
    return fb.Body(name, mass=1, inertia=inertia, position=position, **more)


def moved(m: fb.Mechanism, t_end: float = 2.0) -> Recording:
    recording = record_motion(m.simulate(t_end, outputs=41))
    check_recording(recording)
    return recording


def symbol(recording: Recording, name: str, kind: str, on: str = "") -> RecordedJoint:
    (found,) = (j for j in recording.joints if (j.name, j.kind) == (name, kind) and on in ("", j.body))
    return found


def in_world(recording: Recording, name: str, point: np.ndarray) -> np.ndarray:
    """A point of a body over time."""
    if name == "ground":
        return np.tile(point, (recording.t.size, 1))
    b = next(b for b in recording.bodies if b.name == name)
    return b.p + turned(b.q, np.asarray(point, float))


def direction(recording: Recording, j: RecordedJoint, angle: float) -> np.ndarray:
    """A direction at an angle from the x axis of a symbol's frame, over time."""
    local = turned(np.array(j.quaternion), np.array([np.cos(angle), np.sin(angle), 0.0]))
    b = next(b for b in recording.bodies if b.name == j.body)
    return turned(b.q, local)


def phase(recording: Recording, j: RecordedJoint, contact: np.ndarray) -> np.ndarray:
    """Where the teeth of a wheel stand to a direction (n, 3), in pitches anticlockwise about z: a tooth at 0."""
    tooth = direction(recording, j, j.size[2])
    angle = np.arctan2(tooth[:, 1], tooth[:, 0]) - np.arctan2(contact[:, 1], contact[:, 0])
    return angle * j.size[1] / (2 * np.pi)


def from_whole(x: np.ndarray) -> float:
    """How far numbers are from whole ones."""
    return float(np.abs(x - x.round()).max())


@pytest.mark.parametrize("flat", [True, False])
@pytest.mark.parametrize("internal", [False, True])
def test_gears_touch_and_their_teeth_mesh_all_along(flat: bool, internal: bool) -> None:
    m = fb.Mechanism("gears", planar=flat)
    z, at = (18, 30), (0.3, 0.4)
    extra, axis = ((), {}) if flat else ((0.0,), {"axis": (0, 0, 1)})
    for k, p in enumerate(((0.0, 0.0), at)):
        m.add(body(f"g{k}", (*p, *extra)), fb.Revolute(f"A{k}", "ground", f"g{k}", at=(*p, *extra), **axis))
    m.add(fb.GearPair("mesh", joint_1="A0", joint_2="A1", teeth=z, internal=internal))
    m.add(fb.Driver("turn", "A0.angle", "2*t"))
    r = moved(m)
    small, large = (symbol(r, "mesh", "gear", f"g{k}") for k in (0, 1))
    assert [small.size[1], large.size[1]] == [18, 30]
    assert large.size[0] / small.size[0] == pytest.approx(30 / 18)
    assert large.size[0] + (-1 if internal else 1) * small.size[0] == pytest.approx(0.5)
    assert large.size[3] == float(internal)
    towards = np.tile([0.6, 0.8, 0.0], (r.t.size, 1)) * (-1 if internal else 1)
    one, other = phase(r, small, towards), phase(r, large, towards if internal else -towards)
    # heights along the tangent, in pitches: a tooth of the one in a gap of the other
    assert from_whole(one + (-other if internal else other) + 0.5) < 1e-5
    assert not [b for b in r.bodies if b.shapes]  # the wheels are what one sees


def test_a_train_of_gears_meshes_everywhere() -> None:
    """A planetary train: the planet, drawn once, meshes with the sun inside it and with the ring around it."""
    m = fb.Mechanism("planetary", planar=True)
    m.add(body("arm", (0.2, 0)), fb.Revolute("A", "ground", "arm", at=(0, 0)))
    m.add(body("sun", (0, 0)), fb.Revolute("S", "arm", "sun", at=(0, 0)))
    m.add(body("planet", (0.4, 0)), fb.Revolute("P", "arm", "planet", at=(0.4, 0)))
    m.add(body("ring", (0, 0)), fb.Revolute("R", "arm", "ring", at=(0, 0)))
    m.add(fb.Revolute("hold", "ground", "ring", at=(0, 0)), fb.Driver("still", "hold.angle", "0"))
    m.add(fb.GearPair("inner", joint_1="S", joint_2="P", teeth=(21, 19)))
    m.add(fb.GearPair("outer", joint_1="P", joint_2="R", teeth=(19, 59), internal=True))
    m.add(fb.Driver("turn", "A.angle", "t"))
    r = moved(m)
    assert sorted(j.body for j in r.joints if j.kind == "gear") == ["planet", "ring", "sun"]
    sun, planet = symbol(r, "inner", "gear", "sun"), symbol(r, "inner", "gear", "planet")
    ring = symbol(r, "outer", "gear", "ring")
    outwards = in_world(r, "planet", np.zeros(3)) - in_world(r, "sun", np.zeros(3))
    assert from_whole(phase(r, sun, outwards) + phase(r, planet, -outwards) + 0.5) < 1e-5
    assert from_whole(phase(r, planet, outwards) - phase(r, ring, outwards) + 0.5) < 1e-5


def test_axes_that_point_against_one_another_mesh_too() -> None:
    m = fb.Mechanism("gears")
    m.add(body("a", (0, 0, 0)), fb.Revolute("A", "ground", "a", at=(0, 0, 0), axis=(0, 0, 1)))
    m.add(body("b", (0.5, 0, 0)), fb.Revolute("B", "ground", "b", at=(0.5, 0, 0), axis=(0, 0, -1)))
    m.add(body("bar", (0.5, 0.5, 0)), fb.Prismatic("S", "ground", "bar", at=(0.5, 0.5, 0), axis=(1, 0, 0)))
    m.add(fb.GearPair("mesh", joint_1="A", joint_2="B", teeth=(17, 23)), fb.Driver("turn", "A.angle", "2*t"))
    m.add(fb.RackAndPinion("drive", rack="S", pinion="B", radius=0.5 * 23 / 40))
    r = moved(m)
    assert sorted(j.body for j in r.joints if j.kind == "gear") == ["a", "b"]  # the pinion is the second gear
    towards = np.tile([1.0, 0, 0], (r.t.size, 1))
    one, other = (phase(r, symbol(r, "mesh", "gear", k), s * towards) for k, s in (("a", 1), ("b", -1)))
    assert from_whole(one + other + 0.5) < 1e-5
    bar = symbol(r, "drive", "rack")
    assert bar.size[1] == pytest.approx(2 * np.pi * bar.size[0] / 23)
    gap = in_world(r, "bar", np.array(bar.position))
    side = np.tile([0, np.sign(gap[0, 1]), 0.0], (r.t.size, 1))
    # a tooth of the pinion in a gap of the bar: in pitches along x, seen from where they meet
    along = (gap[:, 0] - 0.5) / bar.size[1] * -side[:, 1]
    assert from_whole(phase(r, symbol(r, "mesh", "gear", "b"), side) - along) < 1e-5


@pytest.mark.parametrize("radius", [0.15, -0.15])
def test_a_rack_touches_its_pinion_where_they_move_alike(radius: float) -> None:
    m = fb.Mechanism("rack", planar=True)
    m.add(body("pinion", (0, 0)), fb.Revolute("A", "ground", "pinion", at=(0, 0)))
    m.add(body("bar", (0, -0.3)), fb.Translational("S", "ground", "bar", at=(0, -0.3), axis=(1, 0)))
    m.add(fb.RackAndPinion("drive", rack="S", pinion="A", radius=radius), fb.Driver("turn", "A.angle", "2*t"))
    r = moved(m)
    gear, bar = symbol(r, "drive", "gear"), symbol(r, "drive", "rack")
    side = -np.sign(radius)  # turning to the left, the lowest point goes right, the highest left
    assert gear.size[0] == 0.15
    assert np.allclose(in_world(r, "bar", np.array(bar.position))[0], [0, 0.15 * side, 0], atol=1e-9)
    # the bar's teeth: a gap at its origin, which has moved by the displacement
    along = in_world(r, "bar", np.array(bar.position))[:, 0] * -side / bar.size[1]  # to the left seen along the contact
    contact = np.tile([0.0, side, 0.0], (r.t.size, 1))
    assert from_whole(phase(r, gear, contact) + along) < 1e-5 or from_whole(phase(r, gear, contact) - along) < 1e-5
    assert bar.reach[0] <= -0.15 * 4 + 1e-6 or bar.reach[1] >= 0.15 * 4 - 1e-6  # long enough for 4 rad


def test_a_rack_is_joined_to_its_guide() -> None:
    m = fb.Mechanism("rack", planar=True)
    m.add(body("pinion", (0, 0.3)), body("bar", (0, 0)))
    m.add(fb.Revolute("P", "ground", "pinion", at=(0, 0.3)), fb.Prismatic("G", "ground", "bar", at=(0, 0), axis=(1, 0)))
    m.add(fb.RackAndPinion("R", pinion="P", rack="G", radius=0.1), fb.Initial("G.displacement", rate=0.5))
    r = moved(m)
    block, link = next(b for b in r.bodies if b.name == "bar").shapes
    np.testing.assert_allclose(block.position, 0.0, atol=1e-12)
    assert link.link
    assert np.hypot(*link.position[:2]) == pytest.approx(link.size[1] / 2)  # it begins at the guide
    assert 0.2 - 4.2 * 2 * 0.1 / 18 < 2 * link.position[1] < 0.2  # and ends in the rack, whose pitch line is at 0.2


def test_a_shape_that_stands_away_from_its_joint_is_joined_to_it() -> None:
    m = fb.Mechanism("pendulum", gravity=(0, 0, -9.81))
    m.add(fb.Body("bob", shape=fb.Sphere(radius=0.1), density=1000, position=(0, 0, -1)))
    m.add(fb.Body("arm", shape=fb.Rod(radius=0.05, start=(0, 0, 0), end=(1, 0, 0)), density=1000))
    m.add(fb.Revolute("A", "ground", "bob", at=(0, 0, 0), axis=(0, 1, 0)))
    m.add(fb.Revolute("B", "ground", "arm", at=(0, 0, 0), axis=(0, 1, 0)))
    shapes = {b.name: b.shapes for b in moved(m).bodies}
    assert [s.link for s in shapes["arm"]] == [False]
    ball, link = shapes["bob"]
    assert link.link
    assert link.position[2] + link.size[1] / 2 == pytest.approx(ball.position[2] + 1.0)  # at the joint
    assert abs(link.position[2] - link.size[1] / 2 - ball.position[2]) < 0.1  # in the ball


def test_what_moves_and_was_asked_for_is_plotted_first() -> None:
    m = fb.load("examples/slider_crank.toml")  # the crank turns steadily, and is driven
    assert moved(m).plotted[:3] == ("motor.effort", "C.angle", "D.displacement")
    two = fb.Mechanism("two pendulums and a wheel", planar=True, gravity=(0, -9.81))
    for k, name in enumerate(("wheel", "still", "asked", "swings", "more")):
        two.add(body(name, (k, 0 if k == 0 else -1)), fb.Revolute(f"{name} pin", "ground", name, at=(k, 0)))
    two.add(fb.Initial("wheel pin.angle", rate=5.0), fb.Initial("asked pin.angle", value=0.1))
    two.add(fb.Initial("still pin.angle", value=0.0), fb.PointForce("push", "swings", force=("sin(3*t)", 0.0)))
    assert moved(two, 6.0).plotted[0] == "asked pin.angle"
    assert "wheel pin.angle" not in moved(two, 6.0).plotted


def test_bevel_gears_are_discs_that_touch() -> None:
    m = fb.Mechanism("bevel")
    m.add(body("a", (0, 0, 0.3)), fb.Revolute("A", "ground", "a", at=(0, 0, 0.3), axis=(0, 0, 1)))
    m.add(body("b", (0.2, 0, 0)), fb.Revolute("B", "ground", "b", at=(0.2, 0, 0), axis=(1, 0, 0)))
    m.add(fb.GearPair("mesh", joint_1="A", joint_2="B", teeth=(20, 30)), fb.Driver("turn", "A.angle", "t"))
    r = moved(m)
    a, b = symbol(r, "mesh", "gear", "a"), symbol(r, "mesh", "gear", "b")
    assert a.size[:2] == pytest.approx((0.2, 0))  # the cones meet where both radii end: at (0.2, 0, 0.3)
    assert b.size[:2] == pytest.approx((0.3, 0))


@pytest.mark.parametrize("flat", [True, False])
def test_a_cam_touches_its_follower(flat: bool) -> None:
    a = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    radius = 0.3 + 0.06 * np.cos(a)
    points = np.stack([radius * np.cos(a), radius * np.sin(a)], 1)
    m = fb.Mechanism("cam", planar=flat)
    extra, axis = ((), {}) if flat else ((0.0,), {"axis": (0, 0, 1)})
    slide = fb.Translational if flat else fb.Prismatic
    m.add(body("disc", (0, 0, *extra)), fb.Revolute("A", "ground", "disc", at=(0, 0, *extra), **axis))
    m.add(body("tappet", (0, 0.35, *extra)))
    m.add(slide("S", "ground", "tappet", at=(0, 0.35, *extra), axis=(0, 1, *extra)))
    m.add(fb.Cam("contact", "disc", "tappet", points=points, at=(0, 0.35, *extra), radius=0.05, **axis))
    m.add(fb.Driver("turn", "A.angle", "3*t"))
    r = moved(m)
    (curve,) = r.curves
    assert (curve.body, curve.closed) == ("disc", True)
    gaps = np.sqrt(((curve.points[None] - np.column_stack([points, 0 * a])[:, None]) ** 2).sum(axis=2)).min(axis=1)
    assert gaps.max() < 1e-9  # through the points given
    roller = symbol(r, "contact", "roller")
    assert roller.size == (0.05,)
    centre = in_world(r, "tappet", np.array(roller.position))
    path = np.stack([in_world(r, "disc", p) for p in curve.points], axis=1)  # (n, k, 3)
    distance = np.sqrt(((path - centre[:, None]) ** 2).sum(axis=2)).min(axis=1)
    assert np.allclose(distance, 0.05, atol=1e-3)  # sampled every 16 mm
    disc = next(b for b in r.bodies if b.name == "disc").shapes[0]
    assert disc.kind == "plate"


def test_a_rope_runs_over_its_points_and_knows_its_length() -> None:
    m = fb.Mechanism("rope", planar=True, gravity=(0, -9.81))
    m.add(body("load", (0.5, 0)))
    at = ((0, 1), (0.5, 0), (1, 1))
    m.add(fb.Rope("rope", bodies=("ground", "load", "ground"), at=at, stiffness=2000, damping=1, length=2.3))
    result = m.simulate(2.0, outputs=101)
    r = record_motion(result)
    check_recording(r)
    (line,) = r.lines
    assert line.kind == "rope"
    assert len(line.points) == 3
    out = np.isin(r.t, result.t)  # besides, there are times at which it goes slack and taut
    points = [p[out] for p in line.points]
    assert np.allclose(points[1][:, :2], result["load"].position)
    length = sum(np.sqrt(((b - a) ** 2).sum(axis=1)) for a, b in pairwise(points))
    assert np.allclose(length, result["rope"].length)
    assert (line.rest == 2.3).all()
    (pull,) = (a.vector[out] for a in r.arrows if a.name == "rope")
    slack = length < 2.3
    assert slack.any()
    assert not slack.all()
    assert np.allclose(pull[slack], 0)
    # the two halves pull towards their eyes: upwards, with twice the tension times the cosine
    wanted = 2 * result["rope"].tension * (1 - points[1][:, 1]) / (length / 2)
    assert np.allclose(pull[:, 1], wanted)


def test_springs_along_coordinates() -> None:
    """A slide's and a height's springs run from what moves to a place that stands still; about a pin there is a spiral."""
    m = fb.Mechanism("springs", planar=True, gravity=(0, -9.81))
    m.add(body("block", (0, 0)), fb.Prismatic("A", "ground", "block", at=(0, 0), axis=(3, 4)))
    m.add(fb.CoordinateSpring("s", "A.displacement", stiffness=40), fb.CoordinateSpring("d", "block.x", damping=2))
    m.add(body("arm", (2, 0)), fb.Revolute("B", "ground", "arm", at=(1, 0)))
    m.add(fb.TorsionalSpringDamper("coil", "B", stiffness=20), fb.Actuator("push", "A.displacement", force=3))
    result = m.simulate(1.0, outputs=41)
    r = record_motion(result)
    check_recording(r)
    lines = {line.name: line for line in r.lines}
    assert {k: line.kind for k, line in lines.items()} == {"s": "spring", "d": "damper"}
    foot, end = lines["s"].points
    assert np.allclose(end[:, :2], result["block"].position, atol=1e-9)
    assert np.abs(foot - foot[0]).max() < 1e-9
    length = np.sqrt(((end - foot) ** 2).sum(axis=1))
    assert np.allclose(length - length[0], result["A.displacement"] - result["A.displacement"][0], atol=1e-9)
    assert length.min() > 0
    (coil,) = r.curves
    assert coil.body == "ground"
    far = np.sqrt(((coil.points - (1, 0, 0)) ** 2).sum(axis=1))
    assert (np.diff(far) > 0).all()


@pytest.mark.parametrize("ball", [False, True])
def test_wheels_touch_the_plane_that_is_drawn(ball: bool) -> None:
    m = fb.Mechanism("wheel", gravity=(0, 0, -9.81))
    m.add(body("wheel", (0, 0, 0.25), velocity=(0.5, 0, 0), angular_velocity=(0, 2, 0)))
    where = {"at": (0, 0, 0.25), "radius": 0.25}
    m.add(
        fb.RollingBall("roll", "ground", "wheel", **where)
        if ball
        else fb.RollingDisk("roll", "ground", "wheel", axis=(0, 1, 0), **where)
    )
    r = moved(m)
    plane, wheel = symbol(r, "roll", "plane"), symbol(r, "roll", "ball" if ball else "wheel")
    assert (plane.body, wheel.body) == ("ground", "wheel")
    assert np.allclose(plane.position, 0)
    assert np.allclose(plane.axis, [0, 0, 1])
    assert plane.reach[4] == pytest.approx(wheel.size[0])  # the centre is a radius above
    assert plane.reach[1] - plane.reach[0] + plane.reach[3] - plane.reach[2] == pytest.approx(
        1.0, rel=1e-3
    )  # 0.5 m/s, 2 s
    assert not r.bodies[0].shapes


def test_a_wheel_on_a_line_in_the_plane() -> None:
    m = fb.Mechanism("wheel", planar=True)
    m.add(
        body("wheel", (0, 0.2), velocity=(1, 0), angular_velocity=-5),
        fb.WheelOnLine("roll", "ground", "wheel", at=(0, 0), axis=(1, 0), centre=(0, 0.2)),
    )
    r = moved(m)
    assert symbol(r, "roll", "wheel").size == pytest.approx((0.2,))
    line = symbol(r, "roll", "plane")
    assert abs(line.reach[0]) == pytest.approx(0.2)
    assert line.reach[5] - line.reach[4] == pytest.approx(2.0, rel=1e-3)


def joints() -> dict[str, tuple[fb.Mechanism, set[tuple[str, str]]]]:
    """Mechanisms with one joint J, and the (kind, body) of the symbols that it is to have."""
    z = {"at": (0, 0, 0), "axis": (0, 0, 1)}
    return {
        "Screw": (fb.Screw("J", "ground", "b", lead=0.02, **z), {("screw", "ground")}),
        "Planar": (fb.Planar("J", "ground", "b", **z), {("plane", "ground"), ("point", "b")}),
        "PointInPlane": (fb.PointInPlane("J", "ground", "b", **z), {("plane", "ground"), ("point", "b")}),
        "PointOnLine": (fb.PointOnLine("J", "ground", "b", **z), {("rail", "ground"), ("point", "b")}),
        "KnifeEdge": (fb.KnifeEdge("J", "ground", "b", at=(0, 0, 0), axis=(1, 0, 0)), {("knife_edge", "b")}),
        "Orientation": (fb.Orientation("J", "ground", "b", at=(0, 0, 0)), {("orientation", "ground")}),
        "Universal": (fb.Universal("J", "ground", "b", at=(0, 0, 0), axes=((1, 0, 0), (0, 1, 0))), {("universal", "ground")}),
        "GeneralUniversal": (
            fb.GeneralUniversal("J", "ground", "b", at=((0, 0, 0), (0.1, 0, 0.1)), axes=((1, 0, 0), (0, 1, 0.2))),
            {("revolute", "ground"), ("revolute", "b")},
        ),
        "Bushing": (fb.Bushing("J", "ground", "b", at=(0, 0, 0), stiffness=100), {("bushing", "ground")}),
    }  # fmt: skip


@pytest.mark.parametrize("name", list(joints()))
def test_every_joint_has_its_symbol(name: str) -> None:
    from tests.view.test_animate import still

    element, wanted = joints()[name]
    m = fb.Mechanism("m")
    m.add(fb.Body("b", mass=1, inertia=(1, 1, 1), position=(0.3, 0, 0)), element)
    recording = record_motion(still(m))
    check_recording(recording)
    assert {(j.kind, j.body) for j in recording.joints} == wanted


def test_couplers_are_not_drawn_and_slots_reach_as_far_as_their_pin() -> None:
    m = fb.Mechanism("slot", planar=True)
    m.add(body("crank", (0, 0)), fb.Revolute("A", "ground", "crank", at=(0, 0)), fb.Driver("turn", "A.angle", "2*t"))
    m.add(body("arm", (0, -0.5)), fb.Revolute("B", "ground", "arm", at=(0, -0.5)))
    m.add(fb.PinInSlot("slot", "arm", "crank", at=(0.2, 0), axis=(2, 5)))
    m.add(body("idle", (2, 0)), fb.Revolute("C", "ground", "idle", at=(2, 0)))
    m.add(fb.Coupler("tie", coordinates=("A.angle", "C.angle"), weights=(1, 2)))
    r = moved(m, 3.2)
    assert "tie" not in {j.name for j in r.joints}
    rail = symbol(r, "slot", "rail", "arm")
    # a crank of 0.2 m 0.5 m from the arm's pivot: the pin is between 0.3 m and 0.7 m from it
    assert rail.reach[5] - rail.reach[4] == pytest.approx(0.4, abs=2e-3)


def test_sensors_are_shown_first_and_listed() -> None:
    from flyball.view.figures import standard_figures
    from flyball.view.report import report_tables

    m = fb.Mechanism("m", planar=True, gravity=(0, -10))
    m.add(body("b", (1, 0)), fb.Revolute("A", "ground", "b", at=(0, 0)), fb.Sensor("height", "b.y"), fb.IMU("imu", "b"))
    result = m.simulate(1.0, outputs=21)
    recording = record_motion(result)
    check_recording(recording)
    assert recording.plotted[0] == "height.value"
    assert recording.facts["height"] == ("Sensor", "of b.y")
    drawn = {f.name: f for f in standard_figures(result)}["sensors"]
    curves = {c.name: c.values for p in drawn.panels for c in p.curves}
    assert np.array_equal(curves["height"], result["b.y"])
    assert set(curves) == {"height", "imu.fx", "imu.fy", "imu.w"}
    listed = {t.name: t for t in report_tables(result)}["sensors"].rows
    assert listed[0] == ("height", "Sensor", "of b.y", "value", f"{result['b.y'].min():.4g}", "0", "m")


ALONG = {
    "friction of a slide": lambda: fb.JointFriction("f", "S", static=0.1),
    "a driven planar body": lambda: fb.Driver("f", "a.angle", "t**2"),
    "a torque on a planar body": lambda: fb.Actuator("f", "a.angle", force=0.1),
    "a force on a point": lambda: fb.Actuator("f", "b.x", force=0.1),
    "a spring on a slide": lambda: fb.CoordinateSpring("f", "S.displacement", stiffness=3),
}


@pytest.mark.parametrize("kind", ALONG)
def test_what_acts_along_a_coordinate_is_an_arrow(kind):
    """Forces and drivers along every kind of coordinate: a force along it, or a moment about it."""
    m = fb.Mechanism("m", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("a", mass=1, inertia=0.1), fb.Body("b", mass=2, inertia=0.1, position=(1, 0), velocity=(1, 0)))
    m.add(fb.Revolute("R", "ground", "a", at=(0, 0)), fb.Translational("S", "ground", "b", at=(1, 0), axis=(1, 0)))
    m.add(ALONG[kind]())
    found = [a for a in record_motion(m.simulate(0.1, outputs=3)).arrows if a.name == "f"]
    assert [a.what for a in found] == ["moment" if "planar body" in kind else "force"]
