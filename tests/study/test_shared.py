"""Runs that share their tables: which parameters are for that, and that the tables are those of a run by itself."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest

import flyball as fb
from flyball import forces
from flyball.analysis.motion.choice import SimulateOptions
from flyball.analysis.runs.compute import Question, compute
from flyball.analysis.runs.lean import Lean, of_states
from flyball.analysis.runs.reading import readings
from flyball.analysis.runs.runner import runner
from flyball.analysis.runs.single import Motion
from flyball.analysis.runs.soft import Filling, derived, soft
from flyball.analysis.runs.spread import LEAST, Spread
from flyball.errors import ModelError
from flyball.tables.spanning import spanning
from flyball.tables.structure import Choices, structure
from flyball.tables.values import values
from tests.complex_steps import with_parameters
from tests.identities.test_complex_values import with_forces
from tests.mechanisms import EXAMPLES, example
from tests.study.rigs import oscillator


def question(m, names, of, specialize=False, **more):
    """What the runs of a study are asked."""
    times = np.array([0.0, 0.01])
    usual = {k: p.default for k, p in __import__("inspect").signature(m.simulate).parameters.items()}
    given = usual | {"t_end": 0.01, "outputs": times, "specialize": specialize, "progress": False} | more
    o = SimulateOptions.asked(given)
    single, m = Motion(), m.snapshot()
    return Question(m, single, o, tuple(names), readings(of, partial(single.named, m)), times)


@pytest.mark.parametrize("where", ["space", "plane"])
def test_every_number_of_every_force_changes_its_own_table_or_is_not_shared(where):
    """Each number is a parameter: where that is taken for one that only forces see, no other table knows it, and what
    fills the tables of a study makes the same of it, to the bit.
    """
    m, names = with_parameters(with_forces(where))
    m = m.snapshot()
    kinds = set()
    for s in (structure(m), structure(m, Choices(tree=spanning(m), switches=True))):
        first = values(s)
        for field, name in names.items():
            if (changed := soft(m, [name])) is None:
                continue
            kinds |= {type(e) for e in changed}
            try:
                x = values(s, {name: 1.0 + 1e-3})
            except ModelError:
                continue
            for table, a in x.system._asdict().items():
                if table not in (*Filling.tables, "ldl", "flat", "switch_x"):
                    np.testing.assert_array_equal(a, getattr(first.system, table), err_msg=f"{field} {table}")
            assert x.q.tobytes() == first.q.tobytes()
            force_x, const = first.system.force_x.copy(), first.system.const.copy()
            Filling.of(first, [name], changed).fill(np.array([1.0 + 1e-3]), {"force_x": force_x, "const": const})
            assert force_x.tobytes() == x.system.force_x.tobytes(), field
            assert const.tobytes() == x.system.const.tobytes(), field
    assert kinds >= set(forces.ALL) - {
        fb.Backlash,
        fb.PointForce,
        fb.PointTorque,
        fb.Motor,
        fb.Actuator,
    }  # the last four are laws


def test_which_parameters_only_forces_see():
    m = example("andrews.toml").snapshot()
    assert [e.name for e in soft(m, ["stiffness"])] == ["spring"]
    assert [e.name for e in soft(m, ["torque"])] == ["motor"]
    for name in ("d", "beta", "xc"):
        assert soft(m, [name]) is None
    falling = fb.Mechanism("m", planar=True, gravity=(0, "-g"), parameters={"g": 9.81})
    falling.add(fb.Body("b", mass=1, inertia=1))
    assert soft(falling.snapshot(), ["g"]) is None
    driven = oscillator()
    driven.add(fb.Body("c", mass=1, inertia=1), fb.Prismatic("rail", "ground", "c", at=(0, 0), axis=(1, 0)))
    driven.add(fb.Driver("drive", "rail.displacement", "k*t"))
    assert soft(driven.snapshot(), ["k"]) is None


def test_parameters_that_depend_on_others_are_found_in_order():
    m = oscillator()
    m.parameters |= {"z": "2*y", "y": "k + 1", "x": "z*y", "w": "mass"}
    assert [name for name, _ in derived(m, ["k"])] == ["y", "z", "x"]
    assert [name for name, _ in derived(m, ["k", "y"])] == ["z", "x"]


@pytest.mark.parametrize("specialize", [False, True])
def test_shared_runs_are_the_runs_by_themselves(specialize):
    q = question(example("andrews.toml"), ("stiffness",), ["K5.x", "end(P3.fy)", "rms(spring.force)"], specialize)
    points = np.linspace(4000, 5000, 5)[:, None]
    run = runner(q, points)
    assert isinstance(run.__self__, Lean)
    a, b = run(points, lambda: False), compute(q, points)
    assert a.status.tolist() == b.status.tolist() == [1] * 5
    for x, y in zip(a.values, b.values, strict=True):
        assert x.tobytes() == y.tobytes()
    assert a.remarks == b.remarks
    assert not np.isnan(np.concatenate([x.ravel() for x in a.values])).any()


def test_a_value_that_made_code_takes_for_granted_is_computed_by_itself():
    """Damping is 0 in the first run, which made code knows; it is 2 in the second."""
    m = oscillator()
    points = np.array([[0.0], [2.0], [0.0], [1.0]])
    q = question(m, ("c",), ["end(b.x)"], True)
    a, b = runner(q, points)(points, lambda: False), compute(q, points)
    assert a.values[0].tobytes() == b.values[0].tobytes()
    assert a.values[0][1] != a.values[0][0] == a.values[0][2]


@pytest.mark.parametrize("more", [{"stabilization": "projection-steps"}, {"start": True}])
def test_what_is_unusual_is_not_shared(more):
    m = oscillator()
    if more.get("start"):
        more = {"start": m.simulate(0.001)}
    if "stabilization" in more:
        more |= {"coordinates": "absolute"}
    run = runner(question(m, ("k",), ["end(b.x)"], **more), np.linspace(1, 9, 5)[:, None])
    assert not hasattr(run, "__self__")


def test_laws_that_are_sharp_in_time_are_not_shared():
    """A corner's time may be what is varied."""
    m = oscillator()
    m.add(fb.Actuator("push", "slide.displacement", force="step(t, k/1e5, 0, k/1e5 + 1e-3, 1)"))
    points = np.linspace(100, 900, 5)[:, None]
    q = question(m, ("k",), ["end(b.x)"])
    run = runner(q, points)
    assert not hasattr(run, "__self__")


def test_curves_that_follow_from_positions_and_velocities():
    m = example("andrews.toml")
    m.add(fb.Sensor("seen", "crank.angle"), fb.Sensor("pulled", "spring.force"))
    yes = ["K1.x", "K1.vx", "K1.omega", "crank.angle", "crank.rate", "seen", "seen.value"]
    no = ["K1.ax", "P3.fx", "spring.force", "motor.work", "pulled", "energy.total", "crank.acceleration"]
    assert [of_states(m, name) for name in yes + no] == [True] * len(yes) + [False] * len(no)


def swinging():
    """Two links that start at rest; what they weigh, and gravity, are parameters."""
    m = fb.Mechanism(
        "swing", planar=True, gravity=(0, "-g"), parameters={"g": 9.81, "mass": 1.0, "J": 0.1, "l": 1.0, "w": 0.0}
    )
    m.add(fb.Body("a", mass="mass", inertia="J", position=("l/2", 0)))
    m.add(fb.Body("b", mass="2*mass", inertia="0.5*J", position=("1.5*l", 0), angular_velocity="w"))
    m.add(fb.Frame("tip", "b", position=("l/2", "l/10"), angle="0.3*l"))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=("l", 0)))
    m.add(fb.Distance("rod", "ground", "b", at=((1.5, -1.0), ("2*l", 0))))
    m.add(fb.TorsionalSpringDamper("spring", "A", stiffness="10*mass", damping="g/10"))
    return m


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize("specialize", [False, True])
@pytest.mark.parametrize("names", [("mass",), ("J", "g"), ("l",), ("l", "mass", "J", "g")])
def test_lengths_masses_and_gravity_of_what_starts_at_rest_are_shared(names, specialize, coordinates):
    of = ["b.y", "end(b.angle)", "min(A.rate)", "end(rod.fx)", "max(energy.kinetic)", "tip.x", "end(tip.angle)"]
    q = question(swinging(), names, of, specialize, coordinates=coordinates)
    points = np.random.default_rng(2).uniform(0.5, 1.5, (5, len(names)))
    points[3] = 1.0  # made code goes by what is 1
    run = runner(q, points)
    assert isinstance(run.__self__, Lean)
    parts = [run(part, lambda: False) for part in (points[:2], points[2:])]
    a, b = q.empty(5), compute(q, points)
    a.take(np.arange(2), parts[0])
    a.take(np.arange(2, 5), parts[1])
    for x, y in zip(a.values, b.values, strict=True):
        assert x.tobytes() == y.tobytes()
    assert len(set(a.values[2])) == 5
    assert run.__self__.alone_count == 0


def test_velocities_are_not():
    q = question(swinging(), ("w",), ["b.y", "end(A.rate)"])
    points = np.linspace(0.9, 1.1, 5)[:, None]
    a, b = runner(q, points)(points, lambda: False), compute(q, points)
    for x, y in zip(a.values, b.values, strict=True):
        assert x.tobytes() == y.tobytes()
    assert len({x.tobytes() for x in a.values[0]}) == 5


def test_runs_that_decide_otherwise_or_fail_are_told_apart():
    """Of many points some have another longest way, some no length at all: each is what it is by itself."""
    q = question(swinging(), ("l", "mass"), ["end(b.y)", "end(tip.angle)"])
    points = np.column_stack([np.linspace(0.5, 1.5, 40), np.linspace(1.0, 2.0, 40)])
    points[7, 1] = points[31, 1] = -1.0
    points[11, 0] = 0.0
    points[12] = points[13]
    run = runner(q, points)
    a, b = run(points, lambda: False), compute(q, points)
    assert a.status.tolist() == b.status.tolist()
    assert a.reasons == b.reasons
    assert {7, 31} <= set(a.reasons)
    for x, y in zip(a.values, b.values, strict=True):
        assert x.tobytes() == y.tobytes()
    assert run.__self__.alone_count <= 8


def test_what_only_floats_take_is_computed_by_itself():
    """The points of a cam are one of those: no lanes go through its splines."""
    m = swinging()
    m.parameters["r"] = 0.05
    angles = np.linspace(0.0, 2.0 * np.pi, 13)[:-1].tolist()
    outline = tuple((f"{1.0 + 0.1 * math.cos(2 * a)!r}*r*cos({a!r})", f"r*sin({a!r})") for a in angles)
    m.add(fb.Body("cam", mass=1.0, inertia=0.1, position=(3.0, 0.0)))
    m.add(fb.Body("follower", mass=1.0, inertia=0.1, position=("3 + 1.1*r", 0.0)))
    m.add(fb.Revolute("C", "ground", "cam", at=(3.0, 0.0)))
    m.add(fb.Prismatic("G", "ground", "follower", at=(3.0, 0.0), axis=(1, 0)))
    m.add(fb.Cam("K", "cam", "follower", points=outline, centre=(3.0, 0.0), at=("3 + 1.1*r", 0.0)))
    q = question(m, ("r",), ["end(follower.x)"])
    points = np.linspace(0.04, 0.06, 6)[:, None]
    a, b = runner(q, points)(points, lambda: False), compute(q, points)
    assert a.status.tolist() == b.status.tolist()
    assert a.values[0].tobytes() == b.values[0].tobytes()


def controlled():
    """An arm that is brought up by a PID without limits, through a lag; what it weighs and the gains are parameters."""
    m = fb.Mechanism("arm", planar=True, gravity=(0, -9.81), parameters={"load": 1.0, "kp": 60.0, "T": 0.02, "x0": 0.1})
    m.add(fb.Body("arm", mass="1 + load", inertia="0.02 + 0.09*load", position=(0, -0.3)))
    m.add(fb.Revolute("hinge", "ground", "arm", at=(0, 0)))
    m.add(
        fb.PID("pid", setpoint="1.2", measured="hinge.angle", kp="kp", ki=80, kd="kp/8", filter="20 ms", initial="x0")
    )
    m.add(fb.Lag("valve", of="pid", time="T"), fb.Motor("motor", "hinge", torque="valve"))
    m.add(fb.StateSpace("ring", inputs=["hinge.rate"], A=[[0, 1], [-400, -4]], B=[[0], [1]], C=[[1, 0]]))
    return m


@pytest.mark.parametrize("names", [("kp",), ("T", "kp"), ("load", "kp"), ("x0",)])
def test_controllers_without_corners_are_shared(names):
    q = question(controlled(), names, ["end(arm.y)", "hinge.rate", "max(motor.torque)", "end(pid.integral)", "ring.x1"])
    base = np.array([{"kp": 60.0, "T": 0.02, "load": 1.0, "x0": 0.1}[name] for name in names])
    points = base * np.linspace(0.8, 1.2, 6)[:, None]
    run = runner(q, points)
    assert isinstance(run.__self__, Lean)
    a, b = run(points, lambda: False), compute(q, points)
    for x, y in zip(a.values, b.values, strict=True):
        assert x.tobytes() == y.tobytes()
    assert len(set(a.values[2])) == 6
    assert run.__self__.alone_count == 0


def test_a_gain_that_makes_no_number_is_told_run_by_run():
    q = question(controlled(), ("T",), ["end(arm.y)"])
    points = np.array([0.01, 0.02, 0.0, 0.03, 0.04])[:, None]
    a, b = runner(q, points)(points, lambda: False), compute(q, points)
    assert a.status.tolist() == b.status.tolist()
    assert a.reasons == b.reasons
    assert 2 in a.reasons


def test_blocks_of_runs_are_spread_for_every_example():
    """What only floats take is computed run by run, without a word: none but what has to be a whole number may."""
    alone, tried = set(), 0
    for path in sorted(EXAMPLES.glob("*.toml")):
        m = example(path.name).snapshot()
        for name, x in m.parameters.items():
            if not isinstance(x, int | float) or not x:
                continue
            points = x * np.linspace(1.0, 1.0001, LEAST)[:, None]
            tables = Spread((structure(m),), m.parameters, [name], points)
            tables.of(points[0])
            tried += 1
            if tables.useless:
                alone.add((path.stem, name))
    assert tried > 50
    assert alone == {("ratchet", "teeth")}


@pytest.mark.parametrize("specialize", [False, True])
@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_places_on_ground_may_be_what_is_varied(coordinates, specialize):
    """A pull to a place on ground is all work, so that the energy balance knows nothing of where that is."""
    m = fb.Mechanism("pulled", planar=True, gravity=(0, -9.81), parameters={"x": 1.0, "y": -1.0})
    m.add(fb.Body("a", mass=1, inertia=0.1, position=("x - 0.5", 0)), fb.Revolute("A", "ground", "a", at=("x - 1", 0)))
    m.add(fb.SpringDamper("pull", "ground", "a", at=(("x", "y"), ("x", 0)), stiffness=0, force="50 + 200*(length - 1)"))
    points = np.random.default_rng(3).uniform((0.5, -1.5), (1.5, -0.5), (6, 2))
    for names, some in ((("y",), points[:, 1:]), (("x", "y"), points)):
        q = question(m, names, ["a.y", "end(pull.work)"], specialize, coordinates=coordinates)
        run = runner(q, some)
        a, b = run(some, lambda: False), compute(q, some)
        assert run.__self__.alone_count <= 1  # one rounds otherwise
        for x, y in zip(a.values, b.values, strict=True):
            assert x.tobytes() == y.tobytes()
        assert len({x.tobytes() for x in a.values[1]}) == 6
