"""Every element that a writer of robot files knows: saved and read again, it acts as before, or the warning names it."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest

import flyball as fb

FORMATS = ("urdf", "xml")
U = 0.7


def arm(ending: str) -> fb.Mechanism:
    """A tree on ground, whose names are those that a writer makes of other names."""
    m = fb.Mechanism("arm", gravity=(0, 0, -9.80665), parameters={"u": U})
    for k, name in enumerate(("a", "b", "c", "d", "hand", "wheel", "rack")):
        m.add(fb.Body(name, mass=1 + k, inertia=(0.1, 0.2, 0.25), com=(0.1, 0, 0.2), position=(0.5 * k, 0.1 * k, 0.2)))
    m.add(
        fb.Revolute("A", "ground", "a", at=(0, 0, 0), axis=(0, 1, 0)),
        fb.Revolute("B", "b", "a", at=(0.5, 0, 0), axis=(0, 1, 0.2)),  # the other way round
        fb.Prismatic("P", "b", "c", at=(1, 0, 0), axis=(1, 0, 1)),
        fb.Planar("Q", "c", "d", at=(1.5, 0, 0), axis=(0, 1, 1)),
        fb.Fixed("tip_fixed", "d", "hand", at=(2, 0, 0)),
        fb.Revolute("Q_x", "ground", "wheel", at=(2.5, 0, 0), axis=(0, 1, 0)),
        fb.Prismatic("K", "ground", "rack", at=(2.5, 0, 0.3), axis=(1, 0, 0)),
    )
    m.add(fb.Frame("tip", "hand", position=(0, 0, 0.3)), fb.Frame("x_0", "a", position=(0.1, 0.2, 0.3)))
    if ending == "xml":
        for k, name in enumerate(("free", "ball")):
            m.add(fb.Body(name, mass=1, inertia=(0.1, 0.2, 0.25), position=(5 + k, 0, 0)))
        m.add(fb.Spherical("free_free", "free", "ball", at=(5.5, 0, 0)))
    return m


PAIR = {"coordinate": ["A.angle", "B.angle"], "weights": [1, -2]}
CASES = {  # elements; names of those that URDF and MJCF leave out
    "no more": ([], "", ""),
    "springs": ([fb.CoordinateSpring(k, "A.angle", stiffness=3, rest=0.1, damping=0.2) for k in "xy"], "xy", ""),
    "a torsional spring": ([fb.TorsionalSpringDamper("x", "B", stiffness=3, damping=1, angle=0.2)], "x", ""),
    "dampers": ([fb.CoordinateSpring(k, "P.displacement", damping=0.2) for k in "xy"], "", ""),
    "a spring along a sum": ([fb.CoordinateSpring("x", **PAIR, stiffness=3, damping=0.1)], "x", ""),
    "a spring in a plane": ([fb.CoordinateSpring("x", "Q.angle", stiffness=3, damping=0.1)], "x", ""),
    "brakes": ([fb.Brake(k, "A.angle", capacity=0.3) for k in "xy"], "", ""),
    "a brake that sticks": ([fb.Brake("x", "A.angle", capacity=1, static=1.5)], "x", "x"),
    "brakes of two kinds": (
        [fb.Brake("x", "A.angle", capacity="u"), fb.Brake("y", "A.angle", capacity=0.3)], "x", "x",
    ),
    "a brake along a sum": ([fb.Brake("x", **PAIR, capacity=0.3)], "x", ""),
    "stops": (
        [fb.Limit("x", "A.angle", lower=-1, upper=2), fb.Limit("y", "A.angle", lower=-2, upper=1),
         fb.Limit("z", "P.displacement", upper=0.5)], "", "",
    ),
    "an elastic stop": ([fb.Limit("x", "A.angle", upper=-0.1, stiffness=9)], "x", ""),
    "a stop in a plane": ([fb.Limit("x", "Q.x", lower=-1)], "x", ""),
    "a stop along a sum": ([fb.Limit("x", **PAIR, lower=-1)], "x", ""),
    "rotors": (
        [fb.RotorInertia("x", "A.angle", inertia=0.1), fb.RotorInertia("y", "A.angle", inertia=0.1, ratio=3),
         fb.RotorInertia("z", "Q.x", inertia=0.1)], "xyz", "",
    ),
    "a motor": ([fb.Motor("x", "A", torque="-3*u")], "", ""),
    "an actuator": ([fb.Actuator("x", "P.displacement", force="u")], "", ""),
    "motors of one joint": ([fb.Motor("x", "A", torque="-3*u"), fb.Actuator("y", "A.angle", force="u")], "y", ""),
    "a motor by a law": ([fb.Actuator("x", "A.angle", force="u - 2*value")], "x", "x"),
    "a motor along a sum": ([fb.Actuator("x", **PAIR, force="2*u")], "x", ""),
    "a motor in a plane": ([fb.Actuator("x", "Q.y", force="2*u")], "x", ""),
    "paths": (
        [fb.PathSpring("x", ["ground", "a", "hand"], at=((0, 0, 1), (1, 0, 0), (2, 1, 0)), stiffness=3, damping=0.1),
         fb.PathSpring("y", ["ground", "hand"], at=((0, 0, 1), (2, 1, 0)), force="2*u")], "xy", "",
    ),
    "a spring between points": ([fb.SpringDamper("x", "ground", "tip", at=((0, 0, 1), (2, 1, 0)), stiffness=3)], "x", ""),
    "ropes": (
        [fb.Rope("x", ["ground", "hand"], at=((0, 0, 1), (2, 1, 0)), length=8),
         fb.Rope("y", ["ground", "hand"], at=((0, 0, 1), (2, 1, 0)), length=1, stiffness=9)], "xy", "",
    ),
    "a coupler": ([fb.Coupler("x", ["A.angle", "B.angle"], weights=[2, -3], value=0.2)], "", ""),
    "couplers from one joint": (
        [fb.Coupler("x", ["A.angle", "B.angle"], weights=[2, -3]),
         fb.Coupler("y", ["A.angle", "P.displacement"], weights=[1, "3 m"], value="0.1 m")], "", "",
    ),
    "a tree of couplers": (
        [fb.Coupler("x", ["A.angle", "B.angle"], weights=[2, -3]),
         fb.Coupler("y", ["Q_x.angle", "K.displacement"], weights=["1 m", 2]),
         fb.Coupler("z", ["A.angle", "Q_x.angle"], weights=[1, 4])], "", "",
    ),
    "a coupler in a plane": ([fb.Coupler("x", ["A.angle", "Q.angle"], weights=[2, -3])], "x", ""),
    "a coupler of three": ([fb.Coupler("x", ["A.angle", "B.angle", "Q_x.angle"], weights=[2, -3, 1])], "x", ""),
    "gears": ([fb.GearPair("x", "A", "Q_x", teeth=(20, 30)), fb.RackAndPinion("y", "K", "Q_x", radius=0.2)], "", ""),
}  # fmt: skip


def saved_and_read(m, path):
    """The mechanism in the file, and what the writer and the reader remark."""
    remarks = []
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always", fb.ModelWarning)
        m.save(path)
        remarks.append(" ".join(str(x.message) for x in found))
        found.clear()
        again = fb.load(path)
        remarks.append(" ".join(str(x.message) for x in found))
    return again, *remarks


def without_ropes(m):
    """The mechanism without inextensible ropes, with which nothing is prepared."""
    ropes = [e.name for e in m.elements() if isinstance(e, fb.Rope) and e.stiffness is None]
    return m.changed(dict.fromkeys(ropes)) if ropes else m


def stops(m, names):
    """The narrowest bounds of each coordinate or sum, and the lengths of ropes."""
    found = {}
    for e in m.elements():
        if not isinstance(e, fb.Limit | fb.Rope) or e.stiffness is not None:
            continue
        if isinstance(e, fb.Rope):
            found[e.name.removesuffix("_limit")] = [0, e.length]
            continue
        key = tuple(names[x] for x in e.along()), tuple(e.weights or (1,))
        lower, upper = found.get(key, (-np.inf, np.inf))
        found[key] = [max(lower, -np.inf if e.lower is None else e.lower)]
        found[key].append(min(upper, np.inf if e.upper is None else e.upper))
    return found


@pytest.mark.parametrize("ending", FORMATS)
@pytest.mark.parametrize("case", CASES)
def test_what_is_not_written_is_named(tmp_path, case, ending):
    """What is read has the dynamics of the mechanism without the elements that the warning names."""
    if ending == "xml":
        pytest.importorskip("mujoco")
    added, *lost = CASES[case]
    m = arm(ending)
    m.add(*added)
    again, remarks, _ = saved_and_read(m, tmp_path / f"arm.{ending}")
    named = {e.name for e in added if re.search(rf"(counterpart of|,) {re.escape(e.title)} \(", remarks)}
    assert named == set(lost[FORMATS.index(ending)])
    again.parameters.update({k: U for k in again.parameters})
    kept = m.changed(dict.fromkeys(named)) if named else m
    p, r = (without_ropes(x).prepare(coordinates="joint") for x in (kept, again))
    names = dict(zip(r.names, p.names, strict=True))
    rng, n = np.random.default_rng(3), len(p.v)
    shift, v = 0.3 * rng.normal(size=(2, n))
    q, s = p.step(p.q, shift), r.step(r.q, shift)
    if not kept.couplings:
        np.testing.assert_allclose(r.mass_matrix(s), p.mass_matrix(q), rtol=1e-9, atol=1e-10)
        forces = p.forces(0.0, q, v)
        np.testing.assert_allclose(r.forces(0.0, s, v), forces, atol=1e-9 * np.abs(forces).max())
    else:
        a, b = (x.acceleration(0.0, p.q, np.zeros(n)) for x in (p, r))
        np.testing.assert_allclose(b, a, atol=1e-7 * np.abs(a).max())
        for e in (e for e in kept.couplings if isinstance(e, fb.Coupler) and isinstance(e.value, float)):
            at = dict(zip(p.names, r.q[: len(p.names)], strict=True))
            assert np.dot(e.weights, [at[x] for x in e.coordinates]) == pytest.approx(e.value)
    assert stops(again, names) == stops(kept, dict(zip(p.names, p.names, strict=True)))


@pytest.mark.parametrize("case", CASES)
def test_mujoco_reads_urdf(tmp_path, case):
    mujoco = pytest.importorskip("mujoco")
    m = arm("urdf")
    m.add(*CASES[case][0])
    saved_and_read(m, tmp_path / "arm.urdf")
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "arm.urdf")).nv >= 7


PARTS = {  # elements; what URDF and MJCF lack of them
    "restitution": (
        [fb.Limit("x", "A.angle", lower=-1, restitution=0.5)],
        r"the restitution of Limit 'x' \(stops have none in URDF\)", r"the restitution of Limit 'x' \(stops are soft",
    ),
    "a parameter's value": (
        [fb.Motor("x", "A", torque="2*u")], r"the value 0.7 of the parameter 'u' of Motor 'x' \(0 in URDF\)", "",
    ),
    "one parameter of two motors": (
        [fb.Motor("x", "A", torque="2*u"), fb.Actuator("y", "P.displacement", force="u")],
        "the one parameter 'u' of Motor 'x' and Actuator 'y'", "the one parameter 'u' of Motor 'x' and Actuator 'y'",
    ),
    "velocities": (
        [fb.Body("x", mass=1, inertia=(1, 1, 1), position=(9, 0, 0), angular_velocity=(1, 0, 0)),
         fb.Revolute("y", "hand", "x", at=(9, 0, 0), axis=(1, 0, 0))],
        "the initial velocity of x", "the initial velocity of x",
    ),
    "values in the drawn configuration": (
        [fb.Body("x", mass=1, inertia=(1, 1, 1), position=(9, 0, 0)),
         fb.Revolute("y", "hand", "x", at=(9, 0, 0), axis=(1, 0, 0), angle=0.3)],
        r"the value 0.3 of Revolute 'y' in the reference configuration \(0 in URDF\)", "",
    ),
}  # fmt: skip


@pytest.mark.parametrize("ending", FORMATS)
@pytest.mark.parametrize("part", PARTS)
def test_what_is_written_in_part_is_named_too(tmp_path, part, ending):
    if ending == "xml":
        pytest.importorskip("mujoco")
    added, *lost = PARTS[part]
    m = arm(ending)
    m.add(*added)
    _, remarks, _ = saved_and_read(m, tmp_path / f"arm.{ending}")
    wanted = lost[FORMATS.index(ending)]
    assert re.search(wanted, remarks) if wanted else not remarks


def test_stops_and_couplings_of_urdf_count_from_the_drawn_configuration(tmp_path):
    m = fb.Mechanism("m", gravity=(0, 0, -9.80665))
    for k, name in enumerate("ab"):
        m.add(fb.Body(name, mass=1, inertia=(1, 1, 1), position=(k, 0, 0)))
        m.add(fb.Revolute(name.upper(), "ground", name, at=(k, 0, 0), axis=(0, 1, 0), angle=(0.3, -0.2)[k]))
    m.add(fb.Limit("stop", "A.angle", upper=1), fb.Coupler("c", ["A.angle", "B.angle"], weights=[1, 2], value=0.1))
    again, _, remarks = saved_and_read(m, tmp_path / "m.urdf")
    assert not remarks
    (limit,) = again.limits
    assert (limit.lower, limit.upper) == (None, pytest.approx(0.7))
    assert 'effort="1000000000.0" velocity="1000000000.0"' in (tmp_path / "m.urdf").read_text()  # not 0: no motor
    q = again.prepare(coordinates="joint").q
    assert (q[0] + 0.3) + 2 * (q[1] - 0.2) == pytest.approx(0.1)


def test_a_circle_of_couplings_is_cut(tmp_path):
    """URDF's joints follow one other each: a third coupling among three joints follows from two, or nothing moves."""
    m = arm("urdf")
    for name, (i, j) in {"x": "AB", "y": ("B", "Q_x"), "z": ("A", "Q_x")}.items():
        m.add(fb.Coupler(name, [f"{i}.angle", f"{j}.angle"], weights=[1, -1]))
    again, remarks, _ = saved_and_read(m, tmp_path / "m.urdf")
    assert "Coupler 'z' (other couplings relate these coordinates already)" in remarks
    assert len(again.couplings) == 2


def test_names_of_equalities_and_of_ground_do_not_clash(tmp_path):
    mujoco = pytest.importorskip("mujoco")
    m = fb.Mechanism("loop", gravity=(0, 0, -9.8))
    for k, name in enumerate("abc"):
        m.add(fb.Body(name, mass=1, inertia=(0.1, 0.1, 0.1), position=((0, 0, 0.5), (0.5, 0, 1), (1, 0, 0.5))[k]))
    places = {"A": ("ground", "a", (0, 0, 0)), "B": ("a", "b", (0, 0, 1)), "C": ("b", "c", (1, 0, 1)), "D": ("c", "ground", (1, 0, 0))}  # fmt: skip
    m.add(*(fb.Revolute(name, i, j, at=at, axis=(0, 1, 0)) for name, (i, j, at) in places.items()))
    m.add(fb.Body("world", mass=1, inertia=(1, 1, 1), position=(3, 0, 0)), fb.Frame("world_", "world"))
    m.add(fb.Revolute("W", "ground", "world", at=(3, 0, 0), axis=(0, 1, 0)))
    m.add(fb.Coupler("D_axis", ["A.angle", "W.angle"], weights=[1, 2]))
    again, remarks, _ = saved_and_read(m, tmp_path / "loop.xml")
    assert "the name of Body 'world' (MuJoCo's of ground; world__ in the file)" in remarks
    M = mujoco.MjModel.from_xml_path(str(tmp_path / "loop.xml"))
    assert {M.equality(k).name for k in range(M.neq)} == {"D", "D_axis", "D_axis_"}
    assert again["W"].body_j == "world__"
