"""Motion in time: the compiled loop, called in chunks, and what it hands out made into a ``Result``."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

from ..equations.engine import FOLLOW, INTEGRATE, motion_kernel
from ..equations.projection import TIGHT_G, TIGHT_V
from ..equations.within import kept
from ..errors import StartWarning
from ..laws.functions import forget, interrupts_kept
from ..model.expressions import number
from ..model.model import Model
from ..numerics.integrators import clock as ex
from ..numerics.integrators.tableaux import Tableau, tableau
from ..results.departure import changed_velocities, not_allowed
from ..results.result import Result
from ..tables.system import ALPHA, BETA, MASS, PASS, STABILIZE, TOL_G, TOL_V
from .assembly.start import Assembly
from .motion import partition
from .motion.driven import at_outputs, leaves_no_freedom, owed_works
from .motion.options import STABILIZATION, Options, options_from, output_times
from .motion.outcome import outcome
from .motion.start import Start, begin

NEARER = 1e-8  # tolerances below this ask the stages to be nearer to the constraints by their square
SLICE = 0.05  # seconds that a call of the compiled loop should take


def simulate(
    model: Model,
    t_end: float,
    *,
    t_start: float = 0.0,
    outputs: int | Sequence[float] = 501,
    parameters: Mapping[str, float] | None = None,
    start: Result | None = None,
    progress: Callable[[float], None] | None = None,
    **options: object,
) -> Result:
    """Integrate the equations of motion from ``t_start`` to ``t_end``.

    Parameters
    ----------
    model : Model
    t_end, t_start : float [s]
    outputs : int or sequence of float
        Number of evenly spaced output times, or the times [s] themselves.
    parameters : mapping, optional
        Values of parameters in SI units, in place of the model's.
    start : Result, optional
        Go on from where this result ended; its last time is then ``t_start``.
    progress : callable, optional
        Called with the fraction done about twenty times a second.
    **options
        Fields of `Options`.

    Returns
    -------
    Result

    Raises
    ------
    AssemblyError
        If the start cannot be made consistent.
    SimulationError
        If the integration cannot go on; its ``result`` holds the motion up to then.
    """
    chosen = options_from(options)
    started = time.perf_counter()
    model = model.snapshot()
    t_start = number(t_start, {}, "s", "t_start") if start is None else start.final[0]
    t_end = number(t_end, {}, "s", "t_end")
    times = output_times(t_start, t_end, outputs)
    begun = begin(model, t_start, parameters, start, chosen.coordinates)
    begun.since = started
    for d in changed_velocities(begun.base.departures):
        warnings.warn(not_allowed(d), StartWarning, stacklevel=3)
    follow = chosen.stabilization == "projection" and leaves_no_freedom(begun)
    return moved(begun, t_end, times, chosen, FOLLOW if follow else INTEGRATE, progress)


def moved(
    begun: Start,
    t_end: float,
    times: np.ndarray,
    o: Options,
    task: int,
    progress: Callable[[float], None] | None = None,
) -> Result:
    """The motion from where it begins, integrated (task INTEGRATE) or as drivers prescribe it (FOLLOW).

    Raises
    ------
    SimulationError
        If it cannot go on; its ``result`` holds the motion up to then.
    """
    if o.stabilization == "partitioning":
        partition.choose(begun.base.compiled.structure.model, begun)
    clock = clock_for(begun, begun.base.t, float(t_end), times, o)
    rows, interrupted = run_clock(begun.assembly, clock, tableau(o.method), progress, task)
    owed = None
    if task == FOLLOW:
        owed = partial(owed_works, begun, clock, rows)
        rows = at_outputs(clock, rows)
    return outcome(begun.base.compiled.structure.model, begun, clock, rows, o, interrupted, owed)


def clock_for(start: Start, t: float, t_end: float, times: np.ndarray, o: Options) -> ex.Clock:
    """Everything the compiled loop needs to start, and the choices of the solve."""
    a, y = start.assembly, start.y
    s, W = a.compiled.structure, a.compiled.work
    real, count = np.zeros(ex.REALS), np.zeros(ex.COUNTS, np.int64)
    real[[ex.T, ex.T_END, ex.RTOL, ex.ATOL]] = t, t_end, o.rtol, o.atol
    real[ex.SPAN] = (t_end - t) or 1.0
    real[ex.H_MAX] = min(o.max_step, t_end - t)
    real[ex.SCALE] = a.compiled.values.length
    real[ex.LEDGER] = _energy_size(start.base, (t_end - t) or 1.0)
    real[ex.LARGEST] = max(abs(t), abs(t_end))
    count[ex.QUOTA] = 50
    count[ex.LIMIT] = o.max_steps
    count[ex.CONTROLLED], count[ex.POSITIONS] = s.nq + s.nv, s.nq
    Y = np.zeros((ex.STATES, len(y)))
    Y[0] = y
    W.option[STABILIZE] = STABILIZATION[o.stabilization]
    W.option[ALPHA], W.option[BETA] = o.alpha, o.beta
    length = a.compiled.values.length
    loose = o.atol + o.rtol * length
    near = loose * min(1.0, loose / (NEARER * length))
    W.option[TOL_G] = min(1e-6, max(TIGHT_G * length, 1e-2 * near))
    W.option[TOL_V] = min(1e-5, max(TIGHT_V, 1e-1 * near))
    W.option[PASS] = 1e-13
    works = [s.nq + s.nv + k for name, k in s.state_at.items() if name.endswith(".work")]
    K = np.zeros((len(tableau(o.method).c) + 1, len(y)))
    return ex.Clock(real, count, times, Y, K, np.array(works, np.int64), kept(a.compiled.values.system))


def _energy_size(a: Assembly, span: float) -> float:
    """An energy [J] that errors of works are small against: to lift the mechanism by its length, and to move it by as
    much in the time there is, besides what it has.
    """
    S, length = a.compiled.values.system, a.compiled.values.length
    mass = S.body_x[:, MASS].sum()
    g = np.sqrt((S.glob[:3] ** 2).sum())
    moving = 0.5 * float(a.v @ (a.compiled.mass() @ a.v))
    return float(mass * (g * length + (length / span) ** 2) + moving)


def run_clock(
    a: Assembly, clock: ex.Clock, method: Tableau, progress: Callable | None, task: int
) -> tuple[np.ndarray, bool]:
    """Call the compiled loop until it is through. Returns (output rows, whether the user interrupted)."""
    s, S, W = a.compiled.structure, a.compiled.values.system, a.compiled.work
    width = 1 + len(a.y) + s.nv + len(S.row_i) + len(s.prescribed)
    buffer = np.zeros((max(2, min(len(clock.times), 1_000_000 // width + 1)), width))
    rows = []
    first = clock.real[ex.T]
    forget(W.stack)
    try:
        while True:
            begin = time.perf_counter()
            before = clock.count[ex.ACCEPTED] + clock.count[ex.REJECTED]
            with interrupts_kept(s.functions):
                used = motion_kernel(S, W, method, clock, buffer, task)
                rows.append(buffer[:used].copy())
            if progress is not None:
                progress((clock.real[ex.T] - first) / (clock.real[ex.T_END] - first))
            if clock.count[ex.STATUS] != ex.RUNNING:
                return np.concatenate(rows), False
            took = time.perf_counter() - begin
            done = clock.count[ex.ACCEPTED] + clock.count[ex.REJECTED] - before
            clock.count[ex.QUOTA] = int(np.clip(max(done, 1) * SLICE / max(took, 1e-6), 1, 100_000))
    except KeyboardInterrupt:
        return np.concatenate(rows) if rows else np.zeros((0, width)), True
