"""M, f, g, nu, G, gamma traced on expressions, at 100 random states, against the compiled engine: every element kind."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball import forces
from flyball.assembly.compiled_mechanism import compile_mechanism
from flyball.engine.entry_point import MOTION
from flyball.expression_graph.graph import evaluate_array
from flyball.expression_graph.tracing import object_tables, trace_equations
from flyball.model.contact import has_contact
from flyball.tables.coordinate_choice import spanning_joints
from flyball.tables.structure_definition import velocity_names
from tests import mechanisms
from tests.contract import zoo
from tests.examples.test_examples import EQUATIONS
from tests.identities.test_complex_values import with_couplings, with_forces

STATES = 100
CLOSE = 1e-12


def quaternions_of(c):
    """Places of quaternions in q."""
    from flyball.engine.kinematics import quaternion_at

    at = (quaternion_at(c.values.system, b)[0] for b in range(len(c.values.system.tree.parent)))
    return [k for k in at if k >= 0]


def engine_at(c, rng):
    """A state as the engine took it, and what it made of it."""
    s, W = c.structure, c.work
    q = c.values.q + 0.3 * rng.normal(size=s.nq)
    for k in quaternions_of(c):
        q[k : k + 4] /= np.linalg.norm(q[k : k + 4])
    z = c.z.copy()
    t = rng.uniform(0.0, 1.0)
    c.at(t, q, rng.normal(size=s.nv), MOTION)
    c.z = z
    nm = len(s.measured)
    state = {"t": t} | {f"z[{k}]": x for k, x in enumerate(z)}
    state |= {f"q[{k}]": x for k, x in enumerate(W.trial.state[: s.nq])}
    state |= {f"v[{k}]": x for k, x in enumerate(W.trial.state[s.nq : s.nq + s.nv])}
    state |= {f"load[{k}]": x for k, x in enumerate(W.sensed.load[2 * nm :])}
    M = np.zeros((s.nv, s.nv))
    i, j, _ = c.values.system.mass_entries
    M[i, j] = M[j, i] = W.M
    found = {"M": M if len(i) else c.mass().toarray(), "f": W.velocities.applied, "G": c.jacobian()}
    found |= {"g": W.rows.value, "nu": W.rows.nu, "gamma": W.rows.gamma}
    found["measured"] = W.sensed[:3, :nm].T
    return state, {name: np.array(x) for name, x in found.items()}


def sizes_of(name, b, state, nv):
    """What rounding of an entry is compared with: the largest terms that it can be made of."""
    largest = np.nanmax(np.abs(np.where(np.isfinite(b), b, np.nan)).reshape(len(b), -1), axis=1, initial=0.0)
    fast = 1.0 + max(np.abs(state[f"v[{k}]"]).max() for k in range(nv))
    return np.maximum(largest, 1.0) * (fast if name in ("f", "gamma", "measured") else 1.0)


def agree(m, states=STATES):
    m = m.snapshot()
    for tree in {(), tuple(spanning_joints(m))}:
        c = compile_mechanism(m, tree=tree, coupled=bool(tree))
        if c.structure.nv == 0:
            continue
        symbolic = trace_equations(c.structure, object_tables(c.values.system))
        rng = np.random.default_rng(7)
        found = [engine_at(c, rng) for _ in range(states)]
        state = {k: np.array([f[0][k] for f in found]) for k in found[0][0]}
        for name in found[0][1]:
            b = np.array([f[1][name] for f in found])
            a = evaluate_array(getattr(symbolic, name), state).astype(float)
            a = np.broadcast_to(a.reshape((*a.shape[: a.ndim - b.ndim + 1], *b.shape[1:])), b.shape)
            tolerance = CLOSE * sizes_of(name, b, state, c.structure.nv).reshape(-1, *[1] * (b.ndim - 1))
            bad = ~((np.abs(a - b) <= tolerance) | (np.isnan(a) & np.isnan(b)))
            names = velocity_names(c.structure)
            assert not bad.any(), (name, tree, np.argwhere(bad)[:3], a[bad][:3], b[bad][:3], names[:1])


def test_coordinates_that_are_drawn_at_other_values_than_zero():
    """A user's are the engine's and what they are as drawn: masses and forces are those of the engine."""
    m = fb.Mechanism("arm", planar=True, gravity=(0, -9.81))
    m.add(
        fb.Body("a", mass=2.0, inertia=0.1, position=(0.5, 0)), fb.Body("b", mass=1.0, inertia=0.05, position=(1.4, 0))
    )
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=(1, 0)))
    m = m.snapshot()
    c = compile_mechanism(m, tree=tuple(spanning_joints(m)), coupled=True)
    drawn = [0.3, -0.7]
    symbolic = trace_equations(c.structure, object_tables(c.values.system), reference=drawn)
    state, found = engine_at(c, np.random.default_rng(7))
    state |= {f"q[{k}]": state[f"q[{k}]"] + x for k, x in enumerate(drawn)}
    for name in ("M", "f"):
        ours = evaluate_array(getattr(symbolic, name), state).astype(float).reshape(found[name].shape)
        np.testing.assert_allclose(ours, found[name], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("where", "name"), zoo.CASES)
def test_every_joint(where, name):
    agree(zoo.joined(where, name))


@pytest.mark.parametrize("where", ["space", "plane"])
def test_every_force(where):
    m = with_forces(where)
    spatial = {c for c in forces.ALL if c.__name__ in ("WheelOnRail", "Tyre")}
    found = {type(f) for f in m.forces} | (spatial if where == "plane" else set())
    assert found == {c for c in forces.ALL if not getattr(c, "adds_inertia", False)}
    agree(m)


def test_every_coupling():
    agree(with_couplings())


def followed(t, angle):
    return 0.3 * t + 0.1 * angle * angle


def test_laws_that_follow_sensors_call_tables_and_functions():
    m = fb.Mechanism("two arms", planar=True)
    m.add(fb.Table("profile", x=(0.0, 0.4, 1.1, 2.0), y=(0.0, 0.3, -0.2, 0.5), beyond="line"))
    m.add(
        fb.Body("a", mass=1.0, inertia=0.1, position=(0.5, 0.0)),
        fb.Body("b", mass=2.0, inertia=0.2, position=(1.5, 0.0)),
    )
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=(1, 0)))
    m.add(fb.Sensor("alpha", "A.angle"))
    m.add(fb.Driver("drive", "B.angle", law="profile(t) + 0.2*alpha**2"))
    m.add(fb.Motor("motor", "A", torque=followed))
    m.add(fb.PointForce("push", "b", force=("profile(t)", "sin(alpha)")))
    agree(m)


def test_every_operation_of_a_law():
    m = mechanisms.four_bar()
    laws = (
        "where(t < 0.5, sin(3*t), abs(t - 0.7)) + min(t, 0.3)*max(t, 0.4)**3 + step(t, 0.2, 0, 0.8, 1)",
        "atan2(t, 0.3) + exp(-t)*cosh(t)/(1 + t**2) + sign(t - 0.5)*sqrt(t) + tanh(t)**2.5",
    )
    m.add(fb.PointForce("push", m.bodies[0].name, force=laws))
    agree(m)


@pytest.mark.parametrize("name", [f for f in EQUATIONS if not has_contact(mechanisms.example(f))])
def test_every_example(name):
    agree(mechanisms.example(name))
