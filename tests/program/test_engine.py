"""The engine by its address: loops of others call it, and never contain it."""

import numpy as np
import pytest

import flyball as fb
from flyball.compiler.formulas import call, formula
from flyball.compiler.kernels import BoundKernel, StructBuffer, kernel
from flyball.engine.calls import OutputBuffer
from flyball.engine.entry_point import ARRIVE, MOTION, REPORT, RESIDUAL, engine, run_task
from flyball.numerics.integrators.butcher_tableaux import Tableau, tableau
from flyball.numerics.integrators.time_loop import StateVectors, StepCounts, StepReals, StepState
from flyball.simulation.initial_state import find_initial_state
from flyball.tables.table_definitions import Bodies, System, Work
from tests.layers import LAYERS


@formula
def classical(address, S, W, R, clock, sheet, h, steps):
    """Runge and Kutta's classical method (1901), of an engine that it knows by its address only."""
    y, n = clock.y, clock.y.shape[1]
    for _ in range(steps):
        t = clock.real.t
        for i in range(n):
            y[1, i] = y[2, i] = y[0, i]
        for stage in range(4):
            call(address, S, W, R, clock, sheet, MOTION)
            w = h / 6.0 if stage == 0 or stage == 3 else h / 3.0
            part = h if stage == 2 else 0.5 * h
            clock.real.t = t + (0.0 if stage == 3 else part)
            for i in range(n):
                y[2, i] += w * clock.K[0, i]
                y[0, i] = y[1, i] + part * clock.K[0, i]
        for i in range(n):
            y[0, i] = y[2, i]
        clock.real.t = t + h
    return call(address, S, W, R, clock, sheet, ARRIVE)


@kernel
def classical_kernel(
    address: int, S: System, W: Work, R: Tableau, clock: StepState, sheet: OutputBuffer, h: float, steps: int
) -> int:
    return classical(address, S, W, R, clock, sheet, h, steps)


def desk(model, coordinates):
    """What the engine needs: tables, scratch, a clock at the start, and a sheet to write on."""
    start = find_initial_state(model.snapshot(), 0.0, None, None, coordinates)
    c = start.assembly.compiled
    s, S = c.structure, c.values.system
    n = len(start.y)
    clock = StepState(
        StepReals.blank(), StepCounts.blank(), np.zeros(0), StateVectors.blank(n), np.zeros((1, n)), np.zeros(0, np.int64),
        np.zeros((6, 0)),
    )  # fmt: skip
    clock.y.current = start.y
    width = 1 + n + s.nv + 3 * len(S.rows.law) + 3 * len(s.measured) + len(s.prescribed)
    return s, S, c.work, tableau("rk45"), clock, OutputBuffer(np.zeros((3, width)))


@pytest.mark.parametrize("coordinates", LAYERS)
def test_a_loop_of_ones_own_calls_the_engine(coordinates):
    model = fb.load("examples/andrews.toml")
    s, S, W, R, clock, sheet = desk(model, coordinates)
    assert classical_kernel(engine.address, S, W, R, clock, sheet, 1e-5, 100) == 0
    r = model.simulate(1e-3, coordinates=coordinates, rtol=1e-12, atol=1e-13)
    assert clock.y.current[: s.nq] == pytest.approx(r.final[1][: s.nq], abs=1e-9)


@pytest.mark.parametrize("coordinates", LAYERS)
def test_tasks_agree_with_each_other(coordinates):
    """The row of output holds accelerations and multipliers that leave no residual, of a mechanism with loops."""
    s, S, W, R, clock, sheet = desk(fb.load("examples/slider_crank.toml"), coordinates)
    assert run_task(S, W, R, clock, sheet.rows, ARRIVE) == 0
    moved = sheet.rows[0, 0]
    assert 0.0 <= moved < 1e-9
    assert run_task(S, W, R, clock, sheet.rows, MOTION) == 0
    vdot = clock.K[0, s.nq : s.nq + s.nv].copy()
    nr = len(S.rows.law)
    lam = W.rows.multiplier.copy()
    out = np.zeros((3, sheet.rows.shape[1]))
    out[1, : s.nv], out[2, :nr] = vdot, lam
    assert run_task(S, W, R, clock, out, RESIDUAL) == 0
    free = np.ones(s.nv, bool)
    free[[int(S.tree.v[b]) for b in s.prescribed.values()]] = False
    largest = np.abs(lam).max(initial=1.0)
    assert np.abs(out[0, : s.nv][free]).max(initial=0.0) < 1e-9 * largest
    assert np.abs(out[0, s.nv : s.nv + 2 * nr]).max(initial=0.0) < 1e-9
    row = np.zeros((1, 1 + clock.y.shape[1] + s.nv + nr + len(s.prescribed)))
    assert run_task(S, W, R, clock, row, REPORT) == 0
    assert row[0, 0] == 0.0
    assert row[0, 1 : 1 + clock.y.shape[1]] == pytest.approx(clock.y.current, abs=1e-12)


def test_other_tables_than_those_it_was_made_for_are_refused():
    """Complex tables would be read as if they were real."""
    _, S, W, R, clock, sheet = desk(fb.load("examples/slider_crank.toml"), "absolute")
    complex_tables = S._replace(bodies=Bodies(*(x.astype(complex) for x in S.bodies)))
    with pytest.raises(Exception, match=r"Frames\.position: an array of complex128"):
        run_task(complex_tables, W, R, clock, sheet.rows, MOTION)


def test_a_kernel_with_its_structures_bound_to_it():
    """Called from Python by its address it writes what the kernel writes, also after the arrays have changed."""
    model = fb.load("examples/slider_crank.toml")
    s, S, W, R, clock, sheet = desk(model, "absolute")
    bound = BoundKernel(engine, *map(StructBuffer, (S, W, R, clock, sheet)))
    for t in (0.0, 0.3):
        clock.real.t = t
        clock.y.current[s.nq : s.nq + s.nv] *= 1.0 - t
        status = run_task(S, W, R, clock, sheet.rows, MOTION)
        expected, lam = clock.K.copy(), W.rows.multiplier.copy()
        clock.K[:], W.rows.multiplier[:], W.velocities.solved[:] = 0.0, 0.0, 0.0
        assert bound(MOTION) == status
        assert (expected == clock.K).all() and (W.rows.multiplier == lam).all()


def test_a_kernel_is_bound_to_structures_of_its_layout_only():
    _, S, W, R, clock, sheet = desk(fb.load("examples/slider_crank.toml"), "absolute")
    for other in (sheet._replace(rows=sheet.rows.astype(complex)), sheet._replace(rows=np.asfortranarray(sheet.rows))):
        with pytest.raises(TypeError, match=r"OutputBuffer\.rows: an array of float64 with 2 dimensions"):
            BoundKernel(engine, *map(StructBuffer, (S, W, R, clock, other)))
