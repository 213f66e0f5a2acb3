"""Code made for a mechanism fills the engine's arrays with the same numbers as the loops over its tables."""

from __future__ import annotations

import ctypes
import runpy
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

import flyball as fb
from flyball import codegen
from flyball.codegen import machine_code
from flyball.codegen.procedures import ProcedureRecorder
from flyball.compiler.kernels import StructBuffer
from flyball.compiler.object_files import read_object
from flyball.engine.calls import COMPLETE
from flyball.engine.entry_point import allocate_work, run_task
from flyball.engine.pulse_detection import INSPECTION_ROWS
from flyball.engine.stabilization import NONE, STAGES
from flyball.numerics.integrators import time_loop as ex
from flyball.numerics.integrators.butcher_tableaux import tableau
from flyball.simulation.initial_state import find_initial_state
from flyball.tables.table_definitions import TERMS
from tests.contract.zoo import PLANAR, SPATIAL, joined

EXAMPLES = Path(__file__).parents[2] / "examples"
MECHANISMS = ("andrews.toml", "bricard.toml", "spatial_four_bar.toml", "double_wishbone.toml", "stewart.py")
OTHERS = ("governor.toml", "toggle_press.toml", "car_axis.toml", "rolling_disk.toml", "point_mass_pendulum.toml")
STATES = 100
EQUAL = 1e-12  # by the largest entry, or what it is made of
REDUNDANT = 1e-6  # of multipliers, which rows that say the same share by rounding


@lru_cache(maxsize=1)
def rk():
    return tableau("rk45")


def values_of(model, coordinates="joint", parameters=None):
    start = find_initial_state(model.snapshot(), 0.0, parameters, None, coordinates)
    return start.assembly.compiled.values, start.y


def states(x, y, seed=0):
    """States near the start, some velocities in all that moves: rows (t, y, ...) of output."""
    s, rng = x.structure, np.random.default_rng(seed)
    nv, nr = s.nv, len(x.system.rows.law)
    rows = np.zeros((STATES, 1 + len(y) + nv + nr + nv))
    rows[:, 0] = rng.uniform(0.0, 0.3, STATES)
    rows[:, 1 : 1 + len(y)] = y + np.r_[0.02 * np.ones(s.nq), np.ones(nv), np.zeros(len(s.states))] * rng.normal(
        size=(STATES, len(y))
    )
    return rows


def solved(x, S, rows, stabilize=STAGES):
    """Every state projected, its accelerations and multipliers; and the scratch after the last."""
    W, rows = allocate_work(x.structure, S), rows.copy()
    (
        W.options.stabilization,
        W.options.solve_tolerance,
        W.options.position_tolerance,
        W.options.velocity_tolerance,
    ) = stabilize, 1e-13, 1e-12 * x.length, 1e-12
    ny = W.trial.shape[1]
    clock = ex.StepState(
        ex.StepReals.blank(), ex.StepCounts.blank(), np.zeros(0), ex.StateVectors.blank(ny), np.zeros((1, ny)),
        np.zeros(0, np.int64), np.zeros((INSPECTION_ROWS, 0)),
    )  # fmt: skip
    status = run_task(S, W, rk(), clock, rows, COMPLETE)
    return status, rows, W


def arrays(W, x):
    """What the engine leaves, by name."""
    nm = len(x.structure.measured)
    return {
        "G": W.G, "g": W.rows.value, "nu": W.rows.nu, "gamma": W.rows.gamma, "f": W.velocities.applied,
        "measured": W.sensed.value[:nm], "rates": W.sensed.rate[:nm], "x": W.velocities.solved, "M": W.M,
        "effort": W.velocities.effort, "lam": W.rows.multiplier,
    }  # fmt: skip


def equal(x, tables, ours):
    """What both make of the very same state."""
    here = slice(1, 1 + x.structure.nq + x.structure.nv)
    np.testing.assert_allclose(tables[1][0, here], ours[1][0, here], rtol=1e-15, atol=1e-15)  # quaternions become units
    theirs = arrays(tables[2], x)
    speed = np.abs(tables[1][0, here][x.structure.nq :]).max(initial=0.0)
    least = {"g": x.length, "gamma": speed**2 * np.abs(theirs["G"]).max(initial=0.0)}  # zero, but for rounding
    for name, b in arrays(ours[2], x).items():
        size = max(np.abs(theirs[name]).max(initial=0.0), least.get(name, 0.0))
        near = REDUNDANT * (1.0 + size) if name == "lam" else EQUAL * size
        assert np.abs(theirs[name] - b).max(initial=0.0) <= near, name
    S, v = x.system, ours[1][0, here][x.structure.nq :]
    terms = (
        ours[2].G[: S.row_start[len(S.rows.law)]] * v[S.column[: S.row_start[len(S.rows.law)]]]
    )  # of G v, by whose size it drifts
    levers = np.repeat(S.row_levers, np.diff(S.row_start[: len(S.rows.law) + 1]))  # compared as speeds
    assert ours[2].flat[TERMS] == pytest.approx(np.abs(terms * levers).max(initial=0.0), rel=1e-12)


def same(model, coordinates, parameters=None, of=None):
    """Compare made code with the loops; ``of``: whose code it is, if not the mechanism's own."""
    x, y = values_of(model, coordinates, parameters)
    plan = codegen.plan(x)
    made, how = codegen.code(plan, x) if of is None else (of, "")
    rows = solved(x, x.system, states(x, y))[1]  # closed by the loops: where rows are redundant rounding leads the way
    rows = rows[np.isfinite(rows).all(axis=1)]
    assert len(rows)
    S = made.system(x.system)
    tables, ours = solved(x, x.system, rows), solved(x, S, rows)
    assert tables[0] == ours[0]
    ny, nv = len(y), x.structure.nv
    for part in (slice(1, 1 + ny), slice(1 + ny, 1 + ny + nv)):
        a, b = tables[1][:, part], ours[1][:, part]
        assert np.abs(a - b).max(initial=0.0) <= 1e-9 * (1.0 + np.abs(a).max(initial=0.0))
    for state in rows:
        equal(x, *(solved(x, system, state[None], NONE) for system in (x.system, S)))
    return made, how


def example(name):
    if name.endswith(".py"):
        return runpy.run_path(str(EXAMPLES / name))["mechanism"]()
    return fb.load(EXAMPLES / name)


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize("name", MECHANISMS[:4] + OTHERS)
def test_examples(name, coordinates):
    same(example(name), coordinates)


def test_stewart():
    same(example("stewart.py"), "joint")
    x, _ = values_of(example("stewart.py"), "absolute")
    plan = codegen.plan(x)
    assert str(plan.size) in plan.refused
    with pytest.raises(codegen.Refused, match="operations"):
        codegen.code(plan, x)


@pytest.mark.parametrize(("where", "name"), [("space", n) for n in SPATIAL] + [("plane", n) for n in PLANAR])
def test_joints(where, name):
    same(joined(where, name), "absolute")


def test_a_moment_on_a_body_without_inertia():
    """Where something stands in for a missing mass, refinement gives it back of all that has moved."""
    m = fb.Mechanism("point mass", planar=True)
    m.add(fb.Body("a", mass=1.0, inertia=0.0, position=(1.0, -0.2)))
    m.add(fb.Revolute("hinge", "ground", "a", at=(0.2, 0.0)))
    m.add(fb.SpringDamper("spring", "ground", "a", at=((0.5, 1.0), (0.9, 0.1)), stiffness=40.0, length=0.3))
    same(m, "absolute")


def test_what_is_taken_for_granted_is_checked():
    """A procedure whose pivot is zero returns a number greater than none, by which the loops go on."""
    x, _ = values_of(example("andrews.toml"))
    r = ProcedureRecorder(x.structure, x.system)
    pivots = [r.graph.symbol(name) for name in "ab"]
    assert all(y.granted("nonzero") for y in pivots)
    p = r.add("FACTOR", {y.index: ("a", k) for k, y in enumerate(pivots)}, [])
    assert [(nodes, what) for nodes, what, _ in p.checks] == [([y], "nonzero") for y in pivots]
    assert all(number > 0.0 for *_, number in p.checks)
    assert not r.add("LOADS", {}, []).checks


def test_sampled_laws_of_drivers_are_their_second_derivatives():
    """Which is what asks for force, within a step too: of a bell a exp(-(t / w)^2) it is (4 t^2 / w^2 - 2) / w^2 of it.

    On a coordinate and on a row alike.
    """
    m = fb.Mechanism("driven", planar=True)
    m.add(fb.Body("b", mass=1.0, inertia=1.0), fb.Prismatic("P", "ground", "b", axis=(1, 0), at=(0, 0)))
    m.add(fb.Driver("drive", "P.displacement", "0.2*exp(-(t/0.3)**2)"))
    for coordinates in ("joint", "absolute"):
        x, _ = values_of(m, coordinates)
        made, _ = codegen.code(codegen.plan(x), x)
        (name,) = filter(None, made.laws)
        S = StructBuffer(made.system(x.system))
        of = ctypes.CFUNCTYPE(ctypes.c_double, *[ctypes.c_void_p] * 2, ctypes.c_double, *[ctypes.c_void_p] * 4)
        sensors, W = np.zeros(16), StructBuffer(allocate_work(x.structure, x.system))
        for t in (0.1, 0.5):
            found = of(made.loaded.addresses[name])(S.address, W.address, t, *[sensors.ctypes.data] * 4)
            assert found == pytest.approx(0.2 * np.exp(-((t / 0.3) ** 2)) * (4 * t**2 / 0.09 - 2) / 0.09, rel=1e-12)


def test_other_values_run_the_same_code():
    m = example("andrews.toml")
    made, _ = same(m, "joint")
    more = {"stiffness": 9000.0, "torque": 0.05}
    x, _ = values_of(m)
    other, _ = values_of(m, parameters=more)
    assert codegen.plan(other).key == codegen.plan(x).key
    assert codegen.code(codegen.plan(other), other) == (made, "kept in this process")
    same(m, "joint", more, made)


def test_a_zero_is_other_code():
    m = example("andrews.toml")
    x, _ = values_of(m)
    other, _ = values_of(m, parameters={"stiffness": 0.0})
    assert codegen.plan(other).key != codegen.plan(x).key


def test_code_is_known_by_the_values_that_formulas_decided_by():
    """Of the same entries other values are another digest, others' values are not."""
    m = example("andrews.toml")
    x, other = (values_of(m, parameters=p)[0].system for p in (None, {"stiffness": 9000.0}))
    of, others = x.force_parameters.ravel(), other.force_parameters.ravel()
    changed = [("force_parameters", int(k)) for k in np.flatnonzero(of != others)]
    same = [("bodies.inertia", k) for k in range(4)]
    assert changed
    assert machine_code.digest(x, changed) != machine_code.digest(other, changed)
    assert machine_code.digest(x, same) == machine_code.digest(other, same)


def test_files_on_disk(tmp_path, monkeypatch):
    m = example("governor.toml")
    x, _ = values_of(m)
    plan = codegen.plan(x)
    monkeypatch.setattr(machine_code, "_folder", lambda: tmp_path)

    def forget():
        for key in [k for k in machine_code._found if k[0] == plan.key]:
            del machine_code._found[key]

    forget()
    assert codegen.known(plan, x) == ""
    assert codegen.code(plan, x)[1].startswith("made now")
    (file,) = tmp_path.glob("made-*.o")
    forget()
    assert codegen.known(plan, x) == "disk"
    assert codegen.code(plan, x)[1] == "found on disk"
    same(m, "joint")
    text = file.read_bytes()
    for damaged in (text[:-1], text[:1000] + bytes([text[1000] ^ 1]) + text[1001:], b"", b"something else"):
        file.write_bytes(damaged)
        forget()
        assert codegen.known(plan, x) == ""
        assert codegen.code(plan, x)[1].startswith("made now")
        assert read_object(file) is not None
