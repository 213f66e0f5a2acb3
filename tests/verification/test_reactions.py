"""Joint reactions against statics and against Newton and Euler's laws for each body."""

import numpy as np
import pytest

import flyball as fb
from tests.layers import both_layers, cached
from tests.mechanisms import G, bricard, door, example, four_bar, spatial_four_bar

pytestmark = both_layers


def cantilever(swapped=False):
    """A bar clamped at the origin, 2 m long along x, with a load at an offset point of its free end."""
    m = fb.Mechanism("cantilever", gravity=(0, 0, -G))
    m.add(fb.Body("bar", mass=3.0, inertia=(0.1, 1.0, 1.0), position=(1, 0, 0)))
    m.add(fb.Fixed("clamp", *(("bar", "ground") if swapped else ("ground", "bar")), at=(0, 0, 0)))
    m.add(fb.PointForce("load", "bar", force=(5, -7, -11), at=(2, 0.3, 0.1)))
    m.add(fb.PointTorque("twist", "bar", torque=(1, 2, 3)))
    return m


@pytest.mark.parametrize("swapped", [False, True])
def test_cantilever(swapped):
    """The clamp bears load and weight and their moments about its point; joint drawn the other way, the reverse."""
    r = cantilever(swapped).simulate(0.1, outputs=3)
    load = np.array([5.0, -7, -11])
    force = -(load + [0, 0, -3 * G])
    torque = -(np.cross([2, 0.3, 0.1], load) + np.cross([1, 0, 0], [0, 0, -3 * G]) + [1, 2, 3])
    sign = -1 if swapped else 1
    assert r["clamp"].force[-1] == pytest.approx(sign * force, abs=1e-9)
    assert r["clamp"].torque[-1] == pytest.approx(sign * torque, abs=1e-9)
    on_bar = r["clamp"].reaction(on="bar")
    assert on_bar[0][-1] == pytest.approx(force, abs=1e-9)
    assert on_bar[1][-1] == pytest.approx(torque, abs=1e-9)
    on_ground = r["clamp"].reaction(on="ground")
    assert on_ground[0][-1] == pytest.approx(-force, abs=1e-9)
    assert on_ground[1][-1] == pytest.approx(-torque, abs=1e-9)


def test_reactions_in_chosen_axes():
    """The same reaction in axes of the joint and of the body: a link that hangs turned by 30 degrees and swings."""
    m = fb.Mechanism("link", gravity=(0, 0, -G))
    a = np.radians(30)
    m.add(
        fb.Body(
            "link",
            mass=2,
            inertia=(0.1, 0.2, 0.2),
            position=(0.5 * np.cos(a), 0, -0.5 * np.sin(a)),
            orientation=(0, a, 0),
        )
    )
    m.add(fb.Revolute("pin", "ground", "link", at=(0, 0, 0), axis=(0, 1, 0)))
    r = m.simulate(0.7, outputs=21)
    world = r["pin"].force
    R = r["link"].rotation
    assert r["pin"].reaction(axes="link")[0] == pytest.approx(np.einsum("nji,nj->ni", R, world), abs=1e-9)
    joint = r["pin"].reaction(axes="joint")[0]
    assert joint[:, 2] == pytest.approx(world[:, 1], abs=1e-9)
    assert np.linalg.norm(joint, axis=1) == pytest.approx(np.linalg.norm(world, axis=1))
    along = -np.einsum("ni,ni->n", world, R[:, :, 0])  # pull towards the pin: m (w^2 r + g sin)
    drop = np.arctan2(-r["link"].position[:, 2], r["link"].position[:, 0])
    assert along == pytest.approx(2 * (0.5 * r["pin"].rate ** 2 + G * np.sin(drop)), abs=1e-7)


def joint_point(r, joint):
    """Point about which a joint's reaction torque is given: its origin on body_j."""
    frame = r.values.structure.frame_at[joint.name, "M", ""]
    return np.stack(r.records.frame(frame)[0], axis=1)


def loads(r):
    """(body, point, force, torque) of everything that acts on bodies, gravity excepted, from the result's views."""
    m = r.model
    n = len(r.t)
    for joint in m.joints:
        p = joint_point(r, joint)
        for name in (joint.body_i, joint.body_j):
            body = m.carrier(name, joint)
            force, torque = r[joint.name].reaction(on=body)
            yield body, p, force, torque
    for f in m.forces:
        force, torque = r[f.name].wrench
        frame = r.values.system.forces.M[next(i for i, e in enumerate(r.values.structure.forces) if e is f)]
        p = np.stack(r.records.frame(int(frame))[0], axis=1)
        joint = m[f.joint] if hasattr(f, "joint") else None
        ends = (joint.body_j, joint.body_i) if joint else (f.body_j, f.body_i) if hasattr(f, "body_j") else (f.body,)
        for name, sign in zip(ends, (1, -1), strict=False):
            yield m.carrier(name, f), p, sign * force, sign * torque
    for d in m.drivers:
        joint, what = m.coordinate(d.coordinate, d)
        F = r.records.frame(r.values.structure.frame_at[joint.name, "F", ""])
        axis = np.stack([F[1][2], F[1][5], F[1][8]], axis=1)
        effort = r[d.name].effort[:, None] * axis
        none = np.zeros((n, 3))
        p = joint_point(r, joint)
        for name, sign in ((joint.body_j, 1), (joint.body_i, -1)):
            yield m.carrier(name, d), p, *((none, sign * effort) if what == "angle" else (sign * effort, none))


@cached
def motion(name):
    if name == "actuated":
        return actuated().simulate(1.0, outputs=41)
    makers = {"bricard": bricard, "four-bar": four_bar, "door": door}
    if name in makers:
        return makers[name]().simulate(1.0, outputs=41)
    if name == "spatial_four_bar driven":
        return spatial_four_bar(driven=True).simulate(1.0, outputs=41)
    return example(name).simulate(0.3, outputs=41)


def actuated():
    """A spatial arm with one of everything: motor, springs, dampers, given force and torque, a slide and a link."""
    m = fb.Mechanism("actuated", gravity=(0, 0, -G))
    m.add(fb.Body("base", mass=2, inertia=(0.3, 0.2, 0.4), position=(0, 0, 0.2), com=(0.05, 0.02, 0)))
    m.add(fb.Body("arm", mass=1, inertia=(0.02, 0.1, 0.11), position=(0.4, 0, 0.5), orientation=(0.2, 0.3, -0.1)))
    m.add(fb.Body("tool", mass=0.5, inertia=(0.01, 0.02, 0.015), position=(0.9, 0, 0.5)))
    m.add(fb.Body("load", mass=0.7, inertia=(0.01, 0.01, 0.01), position=(0.9, 0, -0.2)))
    m.add(fb.Revolute("waist", "ground", "base", at=(0, 0, 0), axis=(0, 0, 1)))
    m.add(fb.Cylindrical("shoulder", "base", "arm", at=(0, 0, 0.5), axis=(0, 1, 0)))
    m.add(fb.Prismatic("slide", "arm", "tool", at=(0.8, 0, 0.5), axis=(1, 0, 0.1)))
    m.add(fb.Distance("rope", "tool", "load", at=((0.9, 0, 0.5), (0.9, 0, -0.1))))
    m.add(fb.Motor("motor", "waist", torque="2*sin(3*t) - 0.1*rate"))
    m.add(fb.TorsionalSpringDamper("coil", "shoulder", stiffness=20, damping=0.5, angle=0.1))
    m.add(fb.SpringDamper("stay", "base", "tool", at=((0, 0.1, 0.4), (0.9, 0, 0.5)), stiffness=300, damping=5))
    m.add(fb.SpringDamper("tie", "base", "arm", at=((0, 0.1, 0.5), (0, 0.3, 0.5)), stiffness=500, damping=9))
    m.add(fb.PointForce("push", "load", force=("cos(t)", 2, 0), at=(0.95, 0, -0.2), axes="body"))
    m.add(fb.PointTorque("spin", "load", torque=(0, "0.01*t", 0.02)))
    return m


@pytest.mark.parametrize(
    "name",
    [
        "actuated",
        "bricard",
        "four-bar",
        "door",
        "spatial_four_bar.toml",
        "spatial_four_bar driven",
        "slider_crank.toml",
        "governor.toml",
        "heavy_top.toml",
        "thin_rod.toml",
    ],
)
def test_newton_and_euler(name):
    """For every body: m a = sum of forces, I alpha + w x I w = sum of moments about its mass centre."""
    r = motion(name)
    s, n = r.values.structure, len(r.t)
    S = r.values.system
    force = {b: np.tile(S.bodies.mass[k] * S.gravity, (n, 1)) for b, k in s.place.items() if k >= 0}
    moment = {b: np.zeros((n, 3)) for b in force}
    largest = 1.0
    for body, p, f, t in loads(r):
        if body != "ground":
            centre = np.stack(r.records.body(s.place[body])[0], axis=1)
            force[body] = force[body] + f
            moment[body] = moment[body] + t + np.cross(p - centre, f)
            largest = max(largest, np.abs(f).max(), np.abs(t).max())
    for body, total in force.items():
        record = r.records.body(s.place[body])
        R = np.stack(record[1], axis=1).reshape(-1, 3, 3)
        w, alpha, a = (np.stack(x, axis=1) for x in (record[2], record[4], record[5]))
        J = R @ r.values.bodies[body].inertia @ R.transpose(0, 2, 1)
        h = np.einsum("nij,nj->ni", J, w)
        assert total == pytest.approx(S.bodies.mass[s.place[body]] * a, abs=1e-9 * largest)
        rate = np.einsum("nij,nj->ni", J, alpha) + np.cross(w, h)
        axes = [2] if r.planar else [0, 1, 2]
        assert moment[body][:, axes] == pytest.approx(rate[:, axes], abs=1e-9 * largest)


@pytest.mark.parametrize("name", ["actuated", "four-bar", "spatial_four_bar.toml", "slider_crank.toml"])
def test_accelerations_are_the_rates_of_velocities(name):
    """Of reference points and orientations, by differences of the velocities; of joints too."""
    r = motion(name)
    h = 1e-4
    t = np.array([0.1, 0.2])
    m = r.model
    r = m.simulate(0.25, outputs=np.sort(np.r_[t - h, t, t + h]), rtol=1e-11, atol=1e-13)
    curves = {f"{b.name}.{k}": (r[b.name].velocity, r[b.name].acceleration) for b in m.bodies for k in ("position",)}
    curves |= {f"{b.name} turns": (r[b.name].angular_velocity, r[b.name].angular_acceleration) for b in m.bodies}
    for joint in m.joints:
        for c in joint.coordinates:
            curves[f"{joint.name}.{c}"] = (
                getattr(r[joint.name], f"{c}_rate"),
                getattr(r[joint.name], f"{c}_acceleration"),
            )
    for what, (v, a) in curves.items():
        size = 1.0 + np.abs(a).max()
        assert (v[2::3] - v[0::3]) / (2 * h) == pytest.approx(a[1::3], abs=1e-4 * size), what


def test_door_on_two_hinges():
    """Five constraints too many: every shared component is flagged, yet sums and the free axis are determinate."""
    m = door()
    m.add(fb.Initial("upper.angle", rate=2.0))
    r = m.simulate(0.5, outputs=6, rtol=1e-11, atol=1e-12)
    assert r.health.freedoms == 1
    assert set(r.health.redundant) == {"upper", "lower"}
    shared = ("force x", "force y", "force z", "torque x", "torque y")
    assert r.health.undetermined == {"upper": shared, "lower": shared}
    assert r["upper"].undetermined == shared
    total = r["upper"].force + r["lower"].force
    a = 2.0 * r.t
    pull = -30 * 0.4 * 4.0
    exact = np.stack([pull * np.cos(a), pull * np.sin(a), 30 * G + 0 * a], axis=1)
    assert total == pytest.approx(exact, abs=1e-7)
    assert r["upper"].angle == pytest.approx(a, abs=1e-9)


def test_door_on_two_balls():
    """Only the share of the weight is undetermined; the couple that holds the leaf up is statics: W b / h."""
    r = door(fb.Spherical, fb.Spherical).simulate(0.2, outputs=3)
    assert r.health.undetermined == {"upper": ("force z",), "lower": ("force z",)}
    couple = 30 * G * 0.4 / 1.6
    assert r["upper"].force[:, 0] == pytest.approx(np.full(3, -couple), abs=1e-8)
    assert r["lower"].force[:, 0] == pytest.approx(np.full(3, couple), abs=1e-8)
    assert (r["upper"].force + r["lower"].force)[:, 2] == pytest.approx(np.full(3, 30 * G), abs=1e-8)


def test_door_that_is_determinate():
    """A ball above and a vertical guide (cylindrical joint) below carry the leaf without redundancy in z."""
    m = fb.Mechanism("door", gravity=(0, 0, -G))
    m.add(fb.Body("leaf", mass=30.0, inertia=(10.0, 11.6, 1.6), position=(0.4, 0, 1)))
    m.add(fb.Spherical("upper", "ground", "leaf", at=(0, 0, 1.8)))
    m.add(fb.Cylindrical("lower", "ground", "leaf", at=(0, 0, 0.2), axis=(0, 0, 1)))
    found = m.check()
    assert (found.freedoms, found.redundancy) == (1, 2)
    r = m.simulate(0.1, outputs=2)
    assert r["upper"].undetermined == ("force x", "force y")
    assert r["lower"].undetermined == ("force x", "force y", "torque x", "torque y")
    assert r["upper"].force[:, 2] == pytest.approx([30 * G] * 2, abs=1e-8)
    assert r["lower"].force[:, 2] == pytest.approx([0, 0], abs=1e-8)
