"""Runs of a study are those by themselves, to the last bit: whatever is varied, with made code and without."""

from __future__ import annotations

import inspect
import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import flyball as fb
from flyball.simulation.method_choice import SimulateOptions
from flyball.simulation.solver_switching import IN_MEMORY_ONLY
from flyball.studies.run_analyses import MotionAnalysis, study_quantities
from flyball.studies.study import RunSpecification, compute_runs, with_generated_code
from tests.mechanisms import example
from tests.study.rigs import oscillator


def question(m, names, of, specialize=False, **more):
    """What the runs of a study are asked."""
    times = np.array([0.0, 0.01])
    usual = {k: p.default for k, p in inspect.signature(m.simulate).parameters.items()}
    given = usual | {"t_end": 0.01, "outputs": times, "specialize": specialize, "progress": False} | more
    o = SimulateOptions.from_arguments(given)
    single, m = MotionAnalysis(), m.snapshot()
    return RunSpecification(m, single, o, tuple(names), study_quantities(of, partial(single.named, m)), times)


def single(q, points):
    """Each run by the tables, of a copy of the model that knows nothing of other runs."""
    out = q.empty(len(points))
    for k, point in enumerate(points):
        own = replace(q, model=q.model.copy().snapshot(), options=replace(q.options, specialize=False))
        out.take(np.array([k]), compute_runs(own, point[None]))
    return out


def checked(q, points):
    """The runs together, which are those by themselves, to the last bit."""
    a, b = compute_runs(with_generated_code(q, points, len(points)), points), single(q, points)
    assert a.status.tolist() == b.status.tolist()
    assert (a.reasons, a.remarks, a.doubtful) == (b.reasons, b.remarks, b.doubtful)
    for x, y in zip(a.values, b.values, strict=True):
        assert x.tobytes() == y.tobytes()
    return a


@pytest.mark.parametrize("specialize", [False, True])
def test_runs_of_which_only_forces_differ(specialize):
    q = question(example("andrews.toml"), ("stiffness",), ["K5.x", "end(P3.fy)", "rms(spring.force)"], specialize)
    a = checked(q, np.linspace(4000, 5000, 5)[:, None])
    assert a.status.tolist() == [1] * 5
    assert not np.isnan(np.concatenate([x.ravel() for x in a.values])).any()


def test_a_value_that_made_code_takes_for_granted():
    """Damping is 0 in the first run, which made code knows; it is 2 in the second, which goes through the tables."""
    points = np.array([[0.0], [2.0], [0.0], [1.0]])
    q = question(oscillator(), ("c",), ["end(b.x)"], True)
    a = checked(q, points)
    ready = with_generated_code(q, points, 4)
    assert ready.options.specialize == IN_MEMORY_ONLY
    engines = [ready.single.run(ready.model, ready.at(x)).health.engine for x in points]
    assert [x.startswith("made for this mechanism") for x in engines] == [True, False, True, False]
    assert a.values[0][1] != a.values[0][0] == a.values[0][2]


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
def test_lengths_masses_and_gravity_of_what_starts_at_rest(names, specialize, coordinates):
    of = ["b.y", "end(b.angle)", "min(A.rate)", "end(rod.fx)", "max(energy.kinetic)", "tip.x", "end(tip.angle)"]
    q = question(swinging(), names, of, specialize, coordinates=coordinates)
    points = np.random.default_rng(2).uniform(0.5, 1.5, (5, len(names)))
    points[3] = 1.0  # made code goes by what is 1
    assert len(set(checked(q, points).values[2])) == 5


def test_velocities_at_the_start():
    q = question(swinging(), ("w",), ["b.y", "end(A.rate)"])
    a = checked(q, np.linspace(0.9, 1.1, 5)[:, None])
    assert len({x.tobytes() for x in a.values[0]}) == 5


def test_runs_that_fail_among_others():
    """Of many points some have another longest way, some no length at all."""
    q = question(swinging(), ("l", "mass"), ["end(b.y)", "end(tip.angle)"])
    points = np.column_stack([np.linspace(0.5, 1.5, 40), np.linspace(1.0, 2.0, 40)])
    points[7, 1] = points[31, 1] = -1.0
    points[11, 0] = 0.0
    points[12] = points[13]
    assert {7, 31} <= set(checked(q, points).reasons)


def test_points_of_a_cam():
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
    checked(q, np.linspace(0.04, 0.06, 6)[:, None])


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
def test_controllers(names):
    q = question(controlled(), names, ["end(arm.y)", "hinge.rate", "max(motor.torque)", "end(pid.integral)", "ring.x1"])
    base = np.array([{"kp": 60.0, "T": 0.02, "load": 1.0, "x0": 0.1}[name] for name in names])
    points = base * np.linspace(0.8, 1.2, 6)[:, None]
    assert len(set(checked(q, points).values[2])) == 6


def test_a_gain_that_makes_no_number_is_told_run_by_run():
    q = question(controlled(), ("T",), ["end(arm.y)"])
    assert 2 in checked(q, np.array([0.01, 0.02, 0.0, 0.03, 0.04])[:, None]).reasons


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
        assert len({x.tobytes() for x in checked(q, some).values[1]}) == 6
