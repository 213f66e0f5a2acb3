"""One motion by several formulations of the same equations: how each drifts, what energy it loses, what it costs."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ..equations.engine import INTEGRATE
from ..errors import AnalysisError, ModelError, SimulationError
from ..model.expressions import number
from ..model.model import Model
from ..model.words import listing, suggest
from ..numerics.integrators import clock as ex
from ..numerics.integrators.tableaux import tableau
from ..results.comparison import Comparison, Formulation
from ..results.result import Result
from ..tables.system import EVALUATIONS, EXCHANGES, FACTORISATIONS, G_VALUE, NU, SEMIDEFINITE, WORST_G, WORST_V
from .compiled import Compiled, compiled
from .motion import partition
from .motion.options import Options, options_from, output_times
from .motion.outcome import outcome
from .motion.start import Start, begin
from .simulate import clock_for, run_clock

FINE = (1e-12, 1e-11, 1e-10, 1e-9)  # relative tolerances of the reference: the first that gets through
LIMIT = 20  # times the steps of the reference: what takes more is given up
BUDGET = 2.0  # seconds of runs of one formulation after which it is not run once more


class Way(NamedTuple):
    """A formulation: choices of a simulation, and what to call them."""

    meaning: str
    stabilization: str = "projection"
    coordinates: str = "absolute"
    coupled: bool = False


WAYS = {
    "none": Way("index 1 alone: G vdot = gamma is solved and the drift left alone", "none"),
    "baumgarte": Way("gamma less 2 alpha (G v - nu) + beta^2 g in place of gamma (Baumgarte 1972)", "baumgarte"),
    "positions": Way("every stage is projected onto g = 0, velocities are left alone", "positions"),
    "velocities": Way("every stage is projected onto G v = nu, positions are left alone", "velocities"),
    "projection-steps": Way("positions and velocities are projected after every step", "projection-steps"),
    "projection": Way("positions and velocities are projected in every stage; the way of simulate"),
    "partitioning": Way(
        "independent coordinates are integrated, the others solved for in every stage (Wehage and Haug 1982)",
        "partitioning",
    ),
    "coupled matrix": Way("projection, by factors of [M G^T; G 0] in place of those of G M^-1 G^T", coupled=True),
    "joint coordinates": Way("projection, in joint coordinates of a spanning tree", coordinates="joint"),
}


@dataclass
class _Task:
    """What all formulations have to do."""

    model: Model
    span: tuple[float, float]
    times: np.ndarray
    options: Options
    base: Start
    parameters: Mapping[str, float] | None
    before: Result | None


def compare(
    model: Model,
    t_end: float,
    *,
    t_start: float = 0.0,
    outputs: int | Sequence[float] = 201,
    formulations: Sequence[str] | None = None,
    repeats: int = 5,
    parameters: Mapping[str, float] | None = None,
    start: Result | None = None,
    progress: Callable[[float], None] | None = None,
    **options: object,
) -> Comparison:
    """Integrate the same motion by several formulations and see what becomes of it.

    All start from the same consistent state, with the same integrator and the same tolerances, in absolute coordinates
    unless their name says otherwise. Drivers are followed by integration here, also where they leave no freedom. Where
    states are not projected they are reported as they are.

    Parameters
    ----------
    model : Model
    t_end, t_start, outputs
        As for `simulate`; drift and energy are looked at at the outputs.
    formulations : sequence of str, optional
        Names out of ``none``, ``baumgarte``, ``positions``, ``velocities``, ``projection-steps``, ``projection``,
        ``partitioning``, ``coupled matrix`` and ``joint coordinates``; all of them by default.
    repeats : int
        Times that each is run for its cost, fewer where that takes long; 0 for none.
    parameters, start, progress
        As for `simulate`.
    **options
        Of `Options`: rtol, atol, method, alpha, beta, max_step, max_steps (without it a formulation is given up after
        twenty times the steps of the reference).

    Returns
    -------
    Comparison
        A formulation that fails is in it too, with its message and the motion up to then.

    Raises
    ------
    AssemblyError, ModelError
        If the start cannot be made consistent; for formulations or options that do not exist.
    """
    names = _known(formulations)
    if not isinstance(repeats, (int, np.integer)) or repeats < 0:
        raise ModelError(f"repeats must be a number of runs, 0 or more, not {repeats!r}")
    chosen = _options(options)
    model = model.snapshot()
    t_start = number(t_start, {}, "s", "t_start") if start is None else start.final[0]
    span = (t_start, float(number(t_end, {}, "s", "t_end")))
    times = output_times(*span, outputs)
    base = begin(model, t_start, parameters, start, "absolute")
    job = _Task(model, span, times, chosen, base, parameters, start)
    truth, told = _reference(job)
    if "max_steps" not in options:
        taken = truth.health.steps + truth.health.rejected if truth is not None else 0
        job.options = replace(chosen, max_steps=LIMIT * max(taken, 1000))
    return _compared(job, names, repeats, truth, told, progress)


def _compared(
    job: _Task,
    names: Sequence[str],
    repeats: int,
    truth: Result | None,
    told: str,
    progress: Callable[[float], None] | None,
) -> Comparison:
    """Run all, first to see what becomes of the motion, then for their cost."""
    starts: dict[str, Start] = {}
    rows = []
    for k, name in enumerate(names):
        rows.append(_row(job, name, starts, truth))
        if progress is not None:
            progress((k + 1) / len(names) * (0.5 if repeats else 1.0))
    _costs(job, rows, starts, repeats)
    if progress is not None:
        progress(1.0)
    energy = float(truth.energy.kinetic.max(initial=0.0)) if truth is not None else np.nan
    kept = {k: v for k, v in vars(job.options).items() if k not in ("coordinates", "stabilization")}
    return Comparison(job.model.name, job.span[1], tuple(rows), told, energy, kept)


def _known(names: Sequence[str] | None) -> list[str]:
    if names is None:
        return list(WAYS)
    wanted = [names] if isinstance(names, str) else list(names)
    for name in wanted:
        if name not in WAYS:
            raise ModelError(f"there is no formulation {name!r}{suggest(str(name), WAYS)}; {listing(list(WAYS))}")
    return list(dict.fromkeys(wanted))


def _options(options: Mapping[str, object]) -> Options:
    for name in ("stabilization", "coordinates"):
        if name in options:
            raise ModelError(f"compare chooses {name} itself; say which with formulations=, {listing(list(WAYS))}")
    return options_from(options)


def _reference(job: _Task) -> tuple[Result | None, str]:
    """The motion by projection at the finest tolerance that gets through singular positions, and what it is."""
    why = "the tolerances asked for are as fine"
    for rtol in FINE:
        if rtol < job.options.rtol:
            result, why = _motion(job, job.base, replace(job.options, rtol=rtol, atol=0.1 * rtol))
            if not why:
                return result, f"projection at rtol = {rtol:g}"
    return None, f"none: {why}"


def _start(job: _Task, way: Way) -> Start:
    """The start for one formulation.

    Raises
    ------
    AnalysisError
        If there is no such formulation for this mechanism.
    """
    a, rows = job.base.assembly, len(job.base.assembly.compiled.structure.rows)
    if way.coordinates == "joint":
        made = begin(job.model, job.span[0], job.parameters, job.before, "joint")
        if not made.assembly.compiled.structure.tree:
            raise AnalysisError(f"there are no joint coordinates: {made.coordinates.removeprefix('absolute: ')}")
        return made
    if not way.coupled:
        return job.base
    if not rows:
        raise AnalysisError("there are no constraint rows, so that there is nothing to couple")
    if a.compiled.values.system.glob[SEMIDEFINITE] > 0.0:
        raise AnalysisError(
            "some body has no inertia about some axis, so that M has no inverse; the coupled matrix is factored in an "
            "order that needs one"
        )
    c = compiled(job.model, parameters=job.parameters, coupled=True)
    c.z = a.compiled.z.copy()
    return replace(job.base, assembly=replace(a, compiled=c))


def _motion(job: _Task, start: Start, o: Options) -> tuple[Result | None, str]:
    """The motion, as far as it goes, and why it goes no further."""
    clock, rows, _ = _run(job, start, o, job.times)
    try:
        return outcome(job.model, start, clock, rows, o), ""
    except SimulationError as stopped:
        return stopped.result, str(stopped).partition(" The motion up to")[0]  # type: ignore[return-value]


def _run(job: _Task, start: Start, o: Options, times: np.ndarray) -> tuple[ex.Clock, np.ndarray, float]:
    """Run the compiled loop from the start. Returns (clock, rows, time of the processor [s])."""
    W = start.assembly.compiled.work
    W.info[:] = 0
    W.option[[WORST_G, WORST_V]] = 0.0
    if o.stabilization == "partitioning":
        partition.choose(job.model, start)
    start.since = time.perf_counter()
    clock = clock_for(start, *job.span, times, o)
    begun = time.thread_time()
    rows, interrupted = run_clock(start.assembly, clock, tableau(o.method), None, INTEGRATE)
    taken = time.thread_time() - begun
    if interrupted:
        raise KeyboardInterrupt
    return clock, rows, taken


def _row(job: _Task, name: str, starts: dict[str, Start], truth: Result | None) -> Formulation:
    """The motion by one formulation, and what can be said about it."""
    way, nothing = WAYS[name], np.zeros(0)
    try:
        starts[name] = start = _start(job, way)
    except AnalysisError as error:
        return Formulation(name, way.meaning, False, str(error), nothing, nothing, nothing, nothing)
    result, why = _motion(job, start, _choice(job, name))
    if result is None:
        return Formulation(name, way.meaning, False, why, nothing, nothing, nothing, nothing)
    g, gv = _drifts(job.base.assembly.compiled, start.assembly.compiled, result)
    f = Formulation(name, way.meaning, not why, why or "reached the end", result.t, g, gv, result.energy.balance)
    f.steps, f.rejected, f.result = result.health.steps, result.health.rejected, result
    f.evaluations, f.factorisations = result.health.evaluations, result.health.factorisations
    f.exchanges = int(start.assembly.compiled.work.info[EXCHANGES])
    if truth is not None and not why:
        f.difference = _difference(job.base.assembly.compiled, truth, start.assembly.compiled, result)
    return f


def _choice(job: _Task, name: str) -> Options:
    way = WAYS[name]
    return replace(job.options, stabilization=way.stabilization, coordinates=way.coordinates)


def _state(c: Compiled, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    nq, nv = c.structure.nq, c.structure.nv
    c.z = y[nq + nv :].copy()
    return y[:nq].copy(), y[nq : nq + nv].copy()


def _drifts(plain: Compiled, c: Compiled, result: Result) -> tuple[np.ndarray, np.ndarray]:
    """Largest |g| and |G v - nu| at every output time, by the rows of absolute coordinates."""
    g, gv = np.zeros(len(result.t)), np.zeros(len(result.t))
    if not len(plain.structure.rows):
        return g, gv
    for k, t in enumerate(result.t.tolist()):
        y = np.r_[result.q[k], result.v[k], result.states[k]]
        q, v = _state(c, y)
        if c.structure.tree:
            q, v = plain.take(c, t, q, v)
        else:
            plain.z = c.z.copy()
        plain.at(t, q, v)
        g[k] = np.abs(plain.work.row[G_VALUE]).max()
        gv[k] = np.abs(plain.sparse_jacobian() @ v - plain.work.row[NU]).max()
    return g, gv


def _difference(own: Compiled, truth: Result, c: Compiled, result: Result) -> float:
    """How far apart two ends are [m]: ways of mass centres, and turns at the mechanism's length."""
    there = own.moving(truth.final[0], *_state(own, truth.final[1]))
    here = c.moving(result.final[0], *_state(c, result.final[1]))
    worst = 0.0
    for name, a in there.items():
        b = here[name]
        turn = 2.0 * np.arcsin(min(1.0, np.linalg.norm(a.R - b.R) / np.sqrt(8.0)))
        worst = max(worst, float(np.linalg.norm(a.p - b.p)), float(own.values.length * turn))
    return worst


def _costs(job: _Task, rows: list[Formulation], starts: Mapping[str, Start], repeats: int) -> None:
    """Run those that reached the end again without outputs on the way, one after the other, for their cost."""
    end = job.times[-1:] * 0.0 + job.span[1]
    spent: dict[str, list[float]] = {f.name: [] for f in rows if f.success}
    for _ in range(repeats):
        for f in rows:
            if f.name not in spent or sum(spent[f.name]) > BUDGET:
                continue
            start = starts[f.name]
            clock, _, seconds = _run(job, start, _choice(job, f.name), end)
            spent[f.name].append(seconds)
            info: Any = start.assembly.compiled.work.info
            f.steps, f.rejected = int(clock.count[ex.ACCEPTED]), int(clock.count[ex.REJECTED])
            f.evaluations, f.factorisations = int(info[EVALUATIONS]), int(info[FACTORISATIONS])
            f.exchanges = int(info[EXCHANGES])
            f.cpu = float(np.median(spent[f.name]))
