"""What joints carry of a blow: the blow itself is none of it. By hand, and by Lagrange multipliers of absolute rows."""

import copy
import pickle

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flyball as fb
from tests.layers import both_layers

BODIES = {
    "crank": (0.4, 0.0015, (0, 0.1)),
    "coupler": (1.2, 0.034, (0.25, 0.35)),
    "rocker": (1.0, 0.022, (0.55, 0.25)),
}
JOINTS = {
    "A": ("ground", "crank", (0, 0)),
    "B": ("crank", "coupler", (0, 0.2)),
    "C": ("coupler", "rocker", (0.5, 0.5)),
    "D": ("ground", "rocker", (0.6, 0)),
}


def four_bar(*do, when="t - 0.001"):
    m = fb.Mechanism("four-bar", planar=True, gravity=None)
    for name, (mass, inertia, position) in BODIES.items():
        m.add(fb.Body(name, mass=mass, inertia=inertia, position=position))
    for name, (one, other, at) in JOINTS.items():
        m.add(fb.Revolute(name, one, other, at=at))
    m.add(fb.Event("blow", when, do=list(do)))
    return m


def by_hand(given):
    """Impulses of the joints on their second bodies, (4, 2), of the generalised impulse ``given`` (9,) at rest."""
    names = list(BODIES)
    G = np.zeros((8, 9))
    for k, (one, other, at) in enumerate(JOINTS.values()):
        for body, sign in ((one, -1), (other, 1)):
            if body != "ground":
                x, y = np.array(at) - BODIES[body][2]
                G[2 * k : 2 * k + 2, 3 * names.index(body) :][:, :3] += sign * np.array([[1, 0, -y], [0, 1, x]])
    M = np.diag([m for mass, inertia, _ in BODIES.values() for m in (mass, mass, inertia)])
    solved = np.linalg.solve(np.block([[M, G.T], [G, np.zeros((8, 8))]]), np.r_[given, np.zeros(8)])
    return -solved[9:].reshape(4, 2)


@both_layers
def test_a_rod_struck_off_its_centre_of_percussion():
    """w = J h / (m L^2 / 3): the hinge gives m w L / 2 - J, at h = L half the blow, at h = 2 L / 3 nothing."""
    for h, carried in ((1.0, 0.5), (2 / 3, 0.0), (0.5, -0.25)):
        m = fb.Mechanism("rod", planar=True, gravity=None)
        m.add(fb.Body("rod", mass=1, inertia=1 / 12, position=(0.5, 0)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
        m.add(fb.Event("blow", "t - 0.001", do=[fb.Impulse("rod", (0, 1), at=(h, 0))]))
        (blow,) = m.simulate(0.01, outputs=3).events
        np.testing.assert_allclose(blow.impulses["A"], [0, carried, 0, 0, 0, 0], atol=1e-12)


BLOWS = {
    "coupler": [((0.3, -0.7), (0.4, 0.3)), ((0.1, 0.2), (0.2, 0.5))],  # two at one instant
    "D.angle": [0.02, 0.03],
    "B.angle": [0.02],
}


@both_layers
@pytest.mark.parametrize("when", ["t - 0.001", "start"])
@pytest.mark.parametrize("on", BLOWS)
def test_joints_of_a_struck_four_bar(on, when):
    """Forces by multipliers, torques none about free axes; a start that only a blow has can be judged too."""
    given, do = np.zeros(9), []
    for blow in BLOWS[on]:
        if on == "coupler":
            (fx, fy), at = blow
            x, y = np.array(at) - BODIES["coupler"][2]
            given[3:6] += fx, fy, x * fy - y * fx
            do.append(fb.Impulse(on, (fx, fy), at=at))
        else:
            given[[8] if on == "D.angle" else [2, 5]] += blow if on == "D.angle" else (-blow, blow)
            do.append(fb.Impulse(on, blow))
    run = four_bar(*do, when=when).simulate(0.01, outputs=3)
    (happened,) = run.events
    found = np.array([happened.impulses[name] for name in JOINTS])
    np.testing.assert_allclose(found[:, :2], by_hand(given), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found[:, 2:], 0.0, atol=1e-12)
    if on != "coupler":
        told = [f"impulse on {on}: {blow:g} N m s" for blow in BLOWS[on]]
        assert list(happened.done) == told
    assert run.health.acceleration_violation < 1e-9


@both_layers
def test_a_motion_goes_on_from_one_that_was_struck_at_its_start(tmp_path):
    """It turns on as if it had never been cut, from a file too."""
    m = four_bar(fb.Impulse("D.angle", 0.02), when="start")
    whole, first = m.simulate(0.02, outputs=3), m.simulate(0.01, outputs=3)
    first.save(tmp_path / "first.nc")
    for start in (first, fb.load_result(tmp_path / "first.nc")):
        assert start.health.acceleration_violation < 1e-9
        second = m.simulate(0.02, start=start, outputs=2)
        assert second["D.angle"][-1] == pytest.approx(whole["D.angle"][-1], abs=1e-8)
        assert second["D.rate"][-1] == pytest.approx(whole["D.rate"][-1], rel=1e-6)
        assert not second.health.warnings


def test_a_ball_joint_of_a_body_struck_in_space():
    """By its rows, and by the sweep: a force off the mass centre in body axes, and a couple."""
    seen = []
    for coordinates in ("absolute", "joint"):
        m = fb.Mechanism("bar", gravity=(0, 0, 0))
        m.add(fb.Body("bar", mass=2, inertia=(0.1, 0.6, 0.7), position=(1, 0, 0), angular_velocity=(0, 0.7, 0.3)))
        m.add(fb.Spherical("S", "ground", "bar", at=(0, 0, 0)))
        m.add(
            fb.Event(
                "k", "t - 0.5", do=fb.Impulse("bar", (1, 2, 3), at=(1.5, 0.2, 0.1), torque=(0.3, 0, 1), axes="body")
            )
        )
        (blow,) = m.simulate(0.6, outputs=2, coordinates=coordinates).events
        seen.append(blow.impulses["S"])
    assert np.abs(seen[0][:3]).max() > 0.1
    np.testing.assert_allclose(seen[0], seen[1], rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(seen[1][3:], 0.0, atol=1e-9)


@pytest.mark.parametrize("on", ["body", "frame"])
@pytest.mark.parametrize(("held", "coordinates"), [(False, "absolute"), (True, "absolute"), (True, "joint")])
def test_a_body_that_is_turned_struck_along_its_own_axes(on, held, coordinates):
    """In space: v+ = A F / m, w+ = R J^-1 R^T (A T + r x A F), A the axes of the part that is struck.

    Held by a ball joint at its mass centre it turns as fast, and the joint carries -A F.
    """
    turned = Rotation.from_rotvec((0.3, 0.9, -0.7)).as_matrix()
    own = turned @ Rotation.from_rotvec((-1.1, 0.2, 0.6)).as_matrix()  # axes of the frame, in world axes
    force, torque, at = np.array([1.0, -2.0, 0.5]), np.array([0.3, 0.7, -0.4]), np.array([0.2, 0.5, -0.3])
    m = fb.Mechanism("stone", gravity=(0, 0, 0))
    m.add(fb.Body("stone", mass=2, inertia=(0.4, 0.5, 0.8), position=(1, 0, 0), orientation=turned))
    m.add(fb.Frame("corner", "stone", position=(0.1, 0, 0.2), orientation=turned.T @ own))
    if held:
        m.add(fb.Spherical("S", "ground", "stone", at=(1, 0, 0)))
    part, axes, arm, more = "corner", own, turned @ (0.1, 0, 0.2), {}
    if on == "body":
        part, axes, arm, more = "stone", turned, at, {"at": tuple(at + (1, 0, 0))}
    blow = fb.Impulse(part, tuple(force), torque=tuple(torque), axes="body", **more)
    m.add(fb.Event("hit", "start", do=blow))
    run = m.simulate(1e-3, outputs=2, coordinates=coordinates)
    w = turned @ (turned.T @ (axes @ torque + np.cross(arm, axes @ force)) / (0.4, 0.5, 0.8))
    np.testing.assert_allclose(run["stone"].angular_velocity[0], w, atol=1e-11)
    np.testing.assert_allclose(run["stone"].velocity[0], (0, 0, 0) if held else axes @ force / 2, atol=1e-12)
    if held:
        np.testing.assert_allclose(run.events[0].impulses["S"], [*-axes @ force, 0, 0, 0], atol=1e-11)


@both_layers
def test_all_that_happens_only_at_the_start_is_booked():
    """A blow gives J^2 / 2 m; a parameter that is set then stays so where the motion goes on, w^2 = 4 k / m."""
    m = fb.Mechanism("slide", planar=True, parameters={"k": 8.0})
    m.add(fb.Body("b", mass=2, inertia=1), fb.Prismatic("A", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("s", "A.displacement", stiffness="k"))
    m.add(fb.Event("first", "start", do=[fb.Impulse("A", 4), fb.Set("k", "4*k")]))
    first = m.simulate(0.3, outputs=4)
    assert first.energy.event_work == pytest.approx(4.0, rel=1e-9)
    assert first.energy.drift < 1e-6
    second = m.simulate(0.7, start=first, outputs=3)
    third = m.simulate(1.0, start=second, outputs=3)
    assert third["A.displacement"][-1] == pytest.approx(0.5 * np.sin(4.0), abs=1e-6)
    assert third.energy.drift < 1e-6


@pytest.mark.parametrize("again", [copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))])
def test_impulses_of_a_pickled_event_still_say_what_each_body_got(again):
    """What acts on the struck bar adds up to the change of its momentum, in a copy of the event, of the list, of all."""
    r = four_bar(fb.Impulse("crank", (0.3, 0.1))).simulate(0.002, outputs=3)
    (h,) = r.events
    whole = h.impulses.on("crank")
    for made in (again(h), again(r.events)[0], again(r).events[0]):
        assert dict(made.impulses).keys() == dict(h.impulses).keys()
        found = made.impulses.on("crank")
        assert found.keys() == whole.keys()
        for name, x in whole.items():
            assert found[name] == pytest.approx(x)
    assert sum(whole.values())[0] == pytest.approx(r.model["crank"].mass * (h.after["crank.vx"] - h.before["crank.vx"]))
