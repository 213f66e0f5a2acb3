"""Every joint in other words: from the other side, as forces over time, in another place: the motion is the same."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flyball as fb
from flyball import joints as room
from tests.contract.zoo import CASES, SPLINED, TIMES, centre, declared, joined, motion, two_bodies, wrench
from tests.layers import both_layers

# The random starts of these tests are no consistent ones, and being told so is not what they ask about.
pytestmark = [both_layers, pytest.mark.filterwarnings("ignore::flyball.errors.StartWarning")]

every = pytest.mark.parametrize(("where", "name"), CASES, ids=lambda x: x)


SWAPPED = {  # joints that are the same from either side, and what of their description has to be turned round
    "Cylindrical": (),
    "Distance": ("at",),
    "Fixed": (),
    "GeneralUniversal": ("at", "axes"),
    "LinearActuator": ("at",),
    "Orientation": (),
    "Prismatic": (),
    "Revolute": (),
    "Screw": (),
    "Spherical": (),
    "Translational": (),
    "Universal": ("axes",),
}


@pytest.mark.parametrize(("where", "name"), [c for c in CASES if c[1] in SWAPPED], ids=lambda x: x)
def test_swapped_bodies_move_the_same(where, name):
    """The joint from b to a: the same motion, coordinates the other way round, the same reactions on each body."""
    one = motion(where, name)
    m = two_bodies(where)
    fields = {k: v[::-1] if k in SWAPPED[name] else v for k, v in declared(where, name).items()}
    m.add(getattr(room, name)("J", "b", "a", **fields))
    two = m.simulate(0.4, outputs=TIMES, rtol=1e-10, atol=1e-12)
    for body in "ab":
        for x, y in zip(centre(one, body), centre(two, body), strict=True):
            assert y == pytest.approx(x, abs=1e-7)
        for x, y in zip(wrench(one, body), wrench(two, body), strict=True):
            assert y == pytest.approx(x, abs=1e-6 * np.abs(x).max() + 1e-9)
    own = one["J"].element.measured(where == "plane")
    for what in set(own) & {"angle", "displacement"}:
        x, y = getattr(one["J"], what), getattr(two["J"], what)
        assert y - y[0] == pytest.approx(x[0] - x, abs=1e-7)


@every
def test_order_of_the_bodies_changes_nothing(where, name):
    one = motion(where, name)
    two = joined(where, name, names=("b", "a")).simulate(0.4, outputs=TIMES, rtol=1e-10, atol=1e-12)
    for body in "ab":
        for x, y in zip(
            (*centre(one, body), *wrench(one, body)), (*centre(two, body), *wrench(two, body)), strict=True
        ):
            assert y == pytest.approx(x, abs=1e-6 * (1.0 + np.abs(x).max()))


@every
def test_reactions_in_place_of_the_joint_move_the_same(where, name):
    """The joint taken away, its reactions given as forces and torques over time: the same motion.

    The force acts at M's origin on body j, and the reverse at the same point of body i.
    """
    if (where, name) == ("space", "FlatFacedCam"):
        pytest.skip("its axes tumble, and the force has peaks between the output times")
    one = motion(where, name)
    plane = where == "plane"
    m = two_bodies(where)
    m.bodies.clear()
    m.by_name.clear()
    for b in two_bodies(where).bodies:
        _, v, w, _ = centre(one, b.name)  # assembly made the velocities consistent: start with those
        arm = one[b.name].rotation[0] @ np.pad(b.com, (0, 3 - len(b.com)))
        velocity = tuple((v[0] - np.cross(w[0], arm))[: 2 if plane else 3].tolist())
        m.add(replace(b, velocity=velocity, angular_velocity=float(w[0, 2]) if plane else tuple(w[0].tolist())))
        force, torque = (
            [over_time(m, f"{k}_{b.name}{i}", x[:, i]) for i in range(3)]
            for k, x in zip("ft", wrench(one, b.name), strict=True)
        )
        m.add(fb.PointForce(f"force {b.name}", b.name, force=tuple(force[: 2 if plane else 3])))
        m.add(fb.PointTorque(f"torque {b.name}", b.name, torque=torque[2] if plane else tuple(torque)))
    two = m.simulate(0.4, outputs=TIMES, rtol=1e-9, atol=1e-11, coordinates="absolute")  # nothing is left to hang by
    # where a spline's curvature has a kink, so has the force over time; those of the last two change fast
    close = {"Cam": 5e-3, "FlatFacedCam": 5e-2, "PointOnCurve": 2e-2}.get(name, 2e-5)
    for body in "ab":
        for x, y in zip(centre(one, body), centre(two, body), strict=True):
            assert y == pytest.approx(x, abs=close * (1.0 + np.abs(x).max()))


def over_time(m, name, values):
    """A law that gives the values at the output times."""
    m.add(fb.Table(name, x=TIMES, y=values))
    return f"{name}(t)"


@every
def test_nothing_depends_on_where_the_world_is(where, name):
    """Everything turned, and put 100 m away: the motion is turned with it."""
    one = motion(where, name)
    Q = Rotation.from_rotvec((0, 0, 1.1) if where == "plane" else (0.4, -1.0, 0.7)).as_matrix()
    d = np.array([100.0, -50.0, 0.0 if where == "plane" else 20.0])
    two = carried_away(where, name, Q, d).simulate(0.4, outputs=TIMES, rtol=1e-10, atol=1e-12)
    for body in "ab":
        here, there = centre(one, body), centre(two, body)
        back = (there[0] - d) @ Q, there[1] @ Q, there[2] @ Q, Q.T @ there[3]
        for x, y in zip(here, back, strict=True):
            close = 2e-5 if name in SPLINED else 1e-6
            assert y == pytest.approx(x, abs=close * (1.0 + np.abs(x).max()))


def carried_away(where, name, Q, d):
    """The same mechanism elsewhere."""
    plane = where == "plane"

    def direction(x):
        return tuple((Q @ np.pad(x, (0, 3 - len(x))))[: len(x)].tolist())

    def point(x):
        return tuple(np.add(direction(x), d[: len(x)]).tolist())

    drawn = two_bodies(where)
    m = fb.Mechanism("elsewhere", planar=plane, gravity=direction(drawn.gravity))
    for b in drawn.bodies:
        new = {"position": point(b.position), "velocity": direction(b.velocity)}
        if plane:
            new["angle"] = b.angle + 1.1
        else:
            R = Rotation.from_euler("XYZ", b.orientation)
            new |= {"orientation": Rotation.from_matrix(Q) * R, "angular_velocity": direction(b.angular_velocity)}
        m.add(replace(b, **new))
    fields = dict(declared(where, name))
    for k, v in fields.items():
        if k in ("at", "centre", "axis", "normal", "axes"):
            move = point if k in ("at", "centre") else direction
            fields[k] = tuple(map(move, v)) if isinstance(v[0], tuple) else move(v)
    joint = getattr(room, name)("J", "a", "b", **fields)
    if name == "PointOnCurve":
        joint = replace(joint, points=[tuple(Q[: len(p), : len(p)] @ p) for p in joint.points])
    elif name in SPLINED:  # their profiles are along axes that follow from the normal
        old, new = (
            x.orientation(x.axis, plane) for x in (getattr(room, name)("J", "a", "b", **declared(where, name)), joint)
        )
        joint = replace(joint, points=[tuple((new.T @ Q @ old)[:2, :2] @ p) for p in joint.points])
    m.add(joint)
    return m
