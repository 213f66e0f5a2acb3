"""What the engine makes of one state, by closed forms: stabilised rows, projected errors, slopes of forces, guards."""

import numpy as np
import pytest

import flyball as fb
from flyball.assembly.assemble import assemble
from flyball.assembly.compiled_mechanism import compile_mechanism
from flyball.engine.calls import GUARD_VALUES, MOTION, POSITION, SLOPES, TANGENT
from flyball.engine.entry_point import evaluate_state, run_task
from flyball.engine.kinematics import retract
from flyball.engine.pulse_detection import INSPECTION_ROWS
from flyball.engine.residual import DAMPING, DIRECTIONS, FORCE_ALONG, SLOPE_WIDTH, STIFFNESS
from flyball.engine.stabilization import BAUMGARTE, NONE, STEPS
from flyball.numerics.integrators.butcher_tableaux import tableau
from flyball.numerics.integrators.time_loop import StateVectors, StepCounts, StepReals, StepState
from flyball.simulation.initial_state import find_initial_state
from tests.mechanisms import four_bar

LAYERS = pytest.mark.parametrize("tree", [(), ("A", "B")], ids=["absolute", "joint"])


def perform(c, y, task, rows=1, width=1, rates=None):
    """Have the engine do a task at a state y: rows of output, and the rates."""
    K = np.zeros((1, len(y))) if rates is None else rates[None].copy()
    Y, out = StateVectors.blank(len(y)), np.zeros((rows, width))
    Y[0] = y
    none = np.zeros(0, np.int64)
    clock = StepState(StepReals.blank(), StepCounts.blank(), np.zeros(0), Y, K, none, np.zeros((INSPECTION_ROWS, 0)))
    if task == SLOPES:
        out[:, DIRECTIONS] = 6.0
    run_task(c.system, c.work, tableau("rk45"), clock, out, task)
    return out, clock.K[0]


def off_the_constraints(tree):
    """A driven four-bar at a state and velocities that fulfil nothing."""
    m = four_bar()
    m.add(fb.Driver("drive", "D.angle", "0.4*t + 0.1*sin(3*t)"))
    a = assemble(m)
    c, q, v = a.compiled, a.q, a.v
    if tree:
        c = compile_mechanism(m, tree=tree)
        q, v = c.take(a.compiled, 0.0, q, v)
    rng, q = np.random.default_rng(3), q.copy()
    retract(c.values.system, q, 0.02 * rng.normal(size=len(v)))
    return c, q, v + 0.3 * rng.normal(size=len(v))


@LAYERS
def test_baumgarte_restores_violated_rows(tree):
    """Baumgarte 1972: d2g/dt2 + 2 alpha dg/dt + beta^2 g = 0, so G vdot differs by the last two terms."""
    c, q, v = off_the_constraints(tree)
    c.work.options.alpha, c.work.options.beta, c.work.options.solve_tolerance = 5.0, 7.0, 1e-13
    found = []
    for choice in (NONE, BAUMGARTE):
        c.work.options.stabilization = choice
        status, dy = evaluate_state(c.system, c.work, 0.3, np.r_[q, v, c.z], MOTION)
        assert status == 0
        found.append(c.jacobian() @ dy[len(q) : len(q) + len(v)])
    g, lost = c.work.rows.value, c.jacobian() @ v - c.work.rows.nu
    assert np.abs(lost).min() > 1e-3
    assert found[1] - found[0] == pytest.approx(-10.0 * lost - 49.0 * g, rel=1e-7, abs=1e-7)


@LAYERS
def test_an_error_keeps_only_what_the_rows_allow(tree):
    """G e = 0 of what is left of an error, which what the rows allow is not taken from."""
    c, q, v = off_the_constraints(tree)
    c.work.options.stabilization, c.work.options.solve_tolerance = STEPS, 1e-13
    y = np.r_[q, v, c.z]
    evaluate_state(c.system, c.work, 0.3, y, MOTION)
    error = np.random.default_rng(4).normal(size=len(y))
    once = perform(c, y, TANGENT, rates=error)[1]
    at = slice(len(q), len(q) + len(v))
    G = c.jacobian()
    assert np.abs(G @ once[at]).max() < 1e-9 * np.abs(G @ error[at]).max()
    assert perform(c, y, TANGENT, rates=once)[1][at] == pytest.approx(once[at], abs=1e-9)


def test_slopes_of_forces_are_their_stiffness_and_damping():
    """Of springs: k and c; of a bushing along and about each axis; of both the force itself."""
    m = fb.Mechanism("springs", gravity=(0, 0, 0))
    m.add(fb.Body("b", mass=1.0, inertia=(1, 2, 2.5), position=(0.3, 0, 0), velocity=(0.2, 0, 0)))
    m.add(fb.Body("c", mass=1.0, inertia=(1, 2, 2.5), position=(0, 0, 0)))
    m.add(fb.Prismatic("p", "ground", "b", at=(0, 0, 0), axis=(1, 0, 0)))
    m.add(fb.CoordinateSpring("s", "p.displacement", stiffness=40.0, damping=3.0, rest=-0.1))
    m.add(fb.Bushing("f", "ground", "c", at=(0, 0, 0), stiffness=(50, 90, 70),
                     torsional_stiffness=(3, 5, 4), damping=(1, 2, 3), torsional_damping=(0.1, 0.2, 0.3)))  # fmt: skip
    a = assemble(m)
    c = a.compiled
    y = np.r_[a.q, a.v, c.z]
    y[7:10] += 0.02, -0.01, 0.03  # of c
    evaluate_state(c.system, c.work, 0.0, y, MOTION)
    found = perform(c, y, SLOPES, len(c.system.forces.F), SLOPE_WIDTH)[0]
    along, between = sorted(found, key=lambda row: np.count_nonzero(row[STIFFNESS:DAMPING]))
    assert along[[STIFFNESS, DAMPING]] == pytest.approx([40.0, 3.0], rel=1e-6)
    assert along[FORCE_ALONG] == pytest.approx(-40.0 * 0.1 - 3.0 * 0.2, rel=1e-9)
    assert between[STIFFNESS:DAMPING] == pytest.approx([50, 90, 70, 3, 5, 4], rel=1e-4)
    assert between[DAMPING:FORCE_ALONG] == pytest.approx([1, 2, 3, 0.1, 0.2, 0.3], rel=1e-6)
    assert between[FORCE_ALONG : FORCE_ALONG + 3] == pytest.approx([-1.0, 0.9, -2.1], rel=1e-6)


def test_a_stop_that_a_mass_leaves_is_none_to_rounding_on_both_sides():
    """A guard that only rounding tells from zero is zero where the mass parts, and stands where it comes nearer."""
    m = fb.Mechanism("stops", planar=True, gravity=(0, 0))
    m.add(fb.Body("b", mass=1.0, inertia=1.0), fb.Prismatic("p", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.Limit("stops", "p.displacement", lower=-0.5, upper=0.5))
    c = find_initial_state(m.snapshot(), 0.0, None, None, "joint", switches=True).assembly.compiled
    rounding = 2.0**-53
    for v in (1.0, -1.0):
        for x in (0.5 - rounding, -0.5 + rounding):
            evaluate_state(c.system, c.work, 0.0, np.array([x, v]), POSITION)
            guards = perform(c, np.array([x, v]), GUARD_VALUES, width=len(c.system.guards.kind))[0][0]
            near = float(guards[np.abs(guards) < 0.1].item())
            assert near == (rounding if x * v > 0.0 else 0.0)
