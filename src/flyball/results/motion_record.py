"""Figures recorded when a motion ends, at some of its output times: energies and errors by which it judges itself.

The number of times is limited to a small part of the evaluations of the run, so that recording costs little beside it.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..compiler.kernels import PooledBuffer, StructPool
from ..engine.entry_point import engine, idle_clock_pool, idle_tableau, no_output, pooled_work, struct_tables
from ..engine.recorded_figures import RecordedFigures, record_motion_kernel
from ..forces import ENERGIES
from ..tables.structure_definition import Structure
from ..tables.table_definitions import System

if TYPE_CHECKING:
    from .result import Result

SHORTEST_SPAN = 1e-150  # [s]: the square of a shorter one underflows
SOLVE_TOLERANCE = 1e-13  # relative residual of a solve
MIN_TIMES, MIN_SOLVED, MAX_SOLVED = 32, 16, 100  # least number of recorded times; least and largest with accelerations
EVALUATIONS_PER_TIME, EVALUATIONS_PER_SOLVE = 40, 100  # of the run
NEGLIGIBLE_ACCELERATION = (
    1e-14  # relative to the mechanism's length (or a radian) over the squared duration; smaller ones are rounding
)


class MotionRecord:
    """Recorded figures.

    Attributes
    ----------
    rows : ndarray of int (n,)
        Numbers of the output times.
    solved : bool
        Whether the equations of motion had a solution wherever accelerations were checked.
    deferred : bool
        Whether the accelerations at other output times had not been computed.
    """

    def __init__(self, rows: np.ndarray, solved: bool, deferred: bool, written: PooledBuffer) -> None:
        self.rows, self.solved, self.deferred, self._written = rows, solved, deferred, written

    @cached_property
    def figures(self) -> RecordedFigures:
        """The figures."""
        return self._written.fields  # type: ignore[no-any-return]

    @property
    def violation(self) -> float:
        """Largest |G vdot - gamma| relative to its terms."""
        found = self.figures.violation
        return float(np.max(found, where=np.isfinite(found), initial=0.0))

    def __getstate__(self) -> dict[str, Any]:
        """Without the addresses that compiled code was given."""
        return {name: getattr(self, name) for name in ("rows", "solved", "deferred", "figures")}


def record_motion(
    result: Result,
    work: PooledBuffer | None = None,
    accelerations: bool = True,
    system: System | None = None,
) -> MotionRecord:
    """Evaluate a motion at some of its output times.

    Parameters
    ----------
    result : Result
    work : PooledBuffer
        Workspace with the options of the run. Not given: a new one, without stabilization.
    accelerations : bool
        Whether to check accelerations.
    system : System
        Tables that the run used if one set of parameters held throughout, which compiled code has been given already.
    """
    n, count, steps = len(result.t), result.health.evaluations, result.health.steps
    s, S, deferred = result.values.structure, result.values.system, result.deferred_accelerations is not None
    conservative = s.cache.get("conservative", None, 1, lambda: not any(x.endswith(".work") for x in s.states))
    least_times = steps if conservative and steps <= n else MIN_TIMES  # enough for the time error of a swing
    times = min(n, max(MIN_TIMES, least_times, count // EVALUATIONS_PER_TIME))
    rows = np.arange(times) * (n - 1) // max(times - 1, 1)
    stride = -(-times // min(MAX_SOLVED, max(MIN_SOLVED, count // EVALUATIONS_PER_SOLVE))) if accelerations else 0
    switched = result.phases is not None and bool(s.switches)
    out = s.cache.get("figures", (times, switched), 2, lambda: _pool(s, S, times, switched)).new()
    if work is None:
        work = pooled_work(s, S, S.const.dtype)
        work.array("options").solve_tolerance = SOLVE_TOLERANCE
    states, at = out.array("states"), 1
    states[:, 0] = result.t[rows]
    for x in (result.q, result.v, result.hints, *([] if deferred else [result.vdot])):
        states[:, at : at + x.shape[1]] = x[rows]
        at += x.shape[1]
    released = np.zeros((0, 0))
    if switched:
        switch = result.phases.over("switch")[:, :, rows]  # type: ignore[union-attr]
        out.array("modes")[:] = np.concatenate([*switch[:2], result.phases.sigma[:, rows]]).T  # type: ignore[union-attr]
        released = switch[4]
    span = float(result.t[-1] - result.t[0]) if n else 0.0
    least = NEGLIGIBLE_ACCELERATION / max(span, SHORTEST_SPAN) ** 2 if span > 0.0 else 0.0
    buffers = work, idle_tableau(), idle_clock_pool(states.shape[1] - 1 - s.nv).new(), no_output(), out
    for part, first, last in _systems(result, rows, system):
        tables = struct_tables(s, part)
        record_motion_kernel(engine.address, tables, *buffers, least, stride, deferred, first, last)
    for k in s.cache.get("own energies", None, 1, lambda: _forces_with_python_energy(s)):
        f = s.forces[k]
        out.array("elastic")[:, k] = 0.0 if f.energy is None else result[f.name].energy[rows]
    if released.any():
        _remove_released(s, released, out.array("elastic"))
    solved = not stride or bool(np.isfinite(out.array("violation")[::stride]).all())
    return MotionRecord(rows, solved, deferred, out)


def _pool(s: Structure, S: System, n: int, switched: bool) -> StructPool:
    """Pool of figures of n times."""
    nb, nk, nv, ny = len(S.tree.parent), len(S.forces.F), s.nv, s.nq + s.nv + len(s.states)
    metric = np.zeros(len(s.rows))
    metric[[t.row for t in s.terms if not t.measured and t.formula.measure == "m"]] = 1.0
    modes = np.zeros((n, 3 * len(s.switches)) if switched else (0, 0))
    shapes = ((n, nb), (n, nb), (n, nk), (n, nb, 3), (n, nb), (n, nb), (n, nv), (n,))
    return StructPool(RecordedFigures(np.zeros((n, 1 + ny + nv)), modes, metric, *map(np.zeros, shapes)))


def _systems(result: Result, rows: np.ndarray, system: System | None) -> list[tuple[System, int, int]]:
    """Return the tables with the parameters of each part of the recorded times, and its first and last time."""
    if result.phases is None:
        return [(system or result.values.system, 0, len(rows))]
    cuts = [(at.stop, phases.all[0].values.system) for at, phases in result.phases.equal_parameter_phases()]
    ends = np.searchsorted(rows, [stop for stop, _ in cuts]).tolist()
    return [(S, first, last) for (_, S), first, last in zip(cuts, [0, *ends], ends, strict=False)]


def _forces_with_python_energy(s: Structure) -> list[int]:
    """Return the forces whose energy differs from that of the compiled formula of their kind."""
    return [k for k, f in enumerate(s.forces) if ENERGIES.get(getattr(f, "kind", -1)) is not f.energy]


def _remove_released(s: Structure, released: np.ndarray, elastic: np.ndarray) -> None:
    """Set the energy of elements to zero where events have released them; ``released``: (switches, n)."""
    for k, f in enumerate(s.forces):
        own = [i for i, x in enumerate(s.switches) if x.element is f]
        if own:
            elastic[released[own[0]] != 0.0, k] = 0.0
