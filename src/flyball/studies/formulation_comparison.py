"""One motion computed by several formulations of the same equations: drift, energy error and cost of each."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..analysis_options import AnalysisOptions, require_count, seconds
from ..assembly.compiled_mechanism import CompiledMechanism, compile_mechanism
from ..engine.entry_point import INTEGRATE
from ..errors import AnalysisError, ModelError, SimulationError
from ..laws.breakpoints import NO_BREAKPOINTS
from ..model.messages import listing, suggest
from ..model.model import Model
from ..model.unsupported_elements import refuse_unsupported
from ..numerics.integrators import time_loop as ex
from ..numerics.integrators.butcher_tableaux import tableau
from ..progress import ReportProgress, no_progress, progress_bar
from ..results.comparison import Comparison, Formulation
from ..results.result import Result
from ..simulation import initial_state
from ..simulation.events.context import EventContext
from ..simulation.events.event_loop import integrate_events
from ..simulation.implicit_integrators import refuse_for_variational
from ..simulation.initial_state import InitialState, find_initial_state, start_of_motion, start_time
from ..simulation.integration_options import MOST_STEPS, Integration, output_times
from ..simulation.law_faults import refuse_out_of_table
from ..simulation.method_choice import (
    FIXED_STEP_METHODS,
    GENERALISED_ALPHA,
    IMPLICIT_METHODS,
    RADAU,
    VARIATIONAL,
    in_suitable_coordinates,
)
from ..simulation.motion_result import make_result
from ..simulation.simulate import clock_for, row_width, run_compiled_loop
from ..simulation.solver_switching import CodeSelection
from ..tables.law_inputs import nonsmooth_elements

REFERENCE_TOLERANCES = (
    1e-12,
    1e-11,
    1e-10,
    1e-9,
)  # relative tolerances of the reference; the first that succeeds is used
# Steps after which a reference is abandoned: where a law chatters there is none.
MAX_REFERENCE_STEPS = 300_000
# Step limit of a formulation, relative to the steps of the reference.
STEP_LIMIT_FACTOR = 20
# Timing runs of one formulation are repeated up to this total duration [s].
REPEAT_SECONDS = 2.0


class FormulationChoice(NamedTuple):
    """A formulation: simulation options and their name."""

    meaning: str
    stabilization: str = "projection"
    coordinates: str = "absolute"
    coupled: bool = False
    method: str = ""  # implicit method


EXPLICIT_FORMULATIONS = {
    "none": FormulationChoice("index 1 alone: G vdot = gamma is solved and the drift left alone", "none"),
    "baumgarte": FormulationChoice(
        "gamma less 2 alpha (G v - nu) + beta^2 g in place of gamma (Baumgarte 1972)", "baumgarte"
    ),
    "positions": FormulationChoice("every stage is projected onto g = 0, velocities are left alone", "positions"),
    "velocities": FormulationChoice("every stage is projected onto G v = nu, positions are left alone", "velocities"),
    "projection-steps": FormulationChoice(
        "positions and velocities are projected after every step", "projection-steps"
    ),
    "projection": FormulationChoice("positions and velocities are projected in every stage, as in simulate"),
    "partitioning": FormulationChoice(
        "independent coordinates are integrated, the others solved for in every stage (Wehage and Haug 1982)",
        "partitioning",
    ),
    "coupled matrix": FormulationChoice(
        "projection, by factors of [M G^T; G 0] in place of those of G M^-1 G^T", coupled=True
    ),
    "joint coordinates": FormulationChoice("projection, in joint coordinates of a spanning tree", coordinates="joint"),
}
"""Formulations for explicit methods, all of which are compared unless some are named."""
IMPLICIT_FORMULATIONS = {
    RADAU: FormulationChoice("Radau IIA of order 5, implicit, of the stabilised equations of index 2", method=RADAU),
    f"{RADAU} index 3": FormulationChoice("the same with projection of positions only", "none", method=RADAU),
    GENERALISED_ALPHA: FormulationChoice(
        "generalised-alpha, implicit, of order 2, of the stabilised equations of index 2", method=GENERALISED_ALPHA
    ),
    f"{GENERALISED_ALPHA} index 3": FormulationChoice(
        "the same with projection of positions only", "none", method=GENERALISED_ALPHA
    ),
    VARIATIONAL: FormulationChoice(
        "a variational integrator on Lie groups, of order 2: symplectic", method=VARIATIONAL
    ),
}
"""Methods that enforce the constraints themselves, by name."""
FORMULATIONS = EXPLICIT_FORMULATIONS | IMPLICIT_FORMULATIONS


@dataclass(frozen=True, kw_only=True)
class CompareOptions(AnalysisOptions):
    """Arguments of `Mechanism.compare`."""

    t_end: float
    t_start: float | None
    outputs: int | Sequence[float]
    formulations: tuple[str, ...] | None
    repeats: int
    parameters: Mapping[str, float] | None
    start: Result | None
    method: str
    step: float | None
    rtol: float
    atol: float | None
    max_step: float
    max_steps: int | None
    alpha: float | None
    beta: float | None
    progress: bool | Callable[[float], None]

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "formulations", _checked_names(self.formulations))
        object.__setattr__(self, "start", start_of_motion(self.start))
        require_count(self.repeats, "repeats", 0)
        if self.step is not None:
            object.__setattr__(self, "step", seconds(self.step, "step"))
        ways = [FORMULATIONS[name] for name in self.formulations or ()]
        even = [name for name in self.formulations or () if FORMULATIONS[name].method in FIXED_STEP_METHODS]
        if even and self.step is None:
            raise ModelError(f"{even[0]!r} takes steps of fixed width: give one, for instance step='1 ms'")
        if self.step is not None and not any(w.method for w in ways):
            raise ModelError(
                f"step is the fixed step of {listing(list(IMPLICIT_FORMULATIONS))}, of which none is compared"
            )
        for name in ("alpha", "beta"):
            if "baumgarte" not in (self.formulations or ()) and getattr(self, name) is not None:
                raise ModelError(f"{name} is a rate of the formulation 'baumgarte', which is not among those compared")
        self.integration_options(EXPLICIT_FORMULATIONS["baumgarte"])

    def integration_options(self, formulation: FormulationChoice, max_steps: int = MOST_STEPS) -> Integration:
        """Integration options of a formulation; those with their own method use ``step`` if it is given."""
        rates = (self.alpha, self.beta) if formulation.stabilization == "baumgarte" else (None, None)
        return Integration(
            coordinates=formulation.coordinates,
            method=self.method,
            rtol=self.rtol,
            atol=self.atol,
            max_step=self.max_step,
            max_steps=max_steps if self.max_steps is None else self.max_steps,
            stabilization=formulation.stabilization,
            alpha=rates[0],
            beta=rates[1],
            step=self.step,
            rho_inf=None,
        ).known(method=formulation.method or self.method, step=self.step if formulation.method else None)


@dataclass
class _ComparisonTask:
    """The motion that all formulations compute."""

    model: Model
    options: CompareOptions
    span: tuple[float, float]
    times: np.ndarray
    base: InitialState
    max_steps: int = MAX_REFERENCE_STEPS


def compare(model: Model, o: CompareOptions) -> Comparison:
    """Integrate the same motion by several formulations: see `Mechanism.compare`."""
    refuse_unsupported(model, "compare")
    model = model.snapshot()
    t_start = start_time(o.t_start, o.start)
    times = output_times(t_start, o.t_end, o.outputs)
    base = find_initial_state(model, t_start, o.parameters, o.start, "absolute")
    refuse_out_of_table(base.base, o.t_end)
    job = _ComparisonTask(model, o, (t_start, o.t_end), times, base)
    with progress_bar(o.progress, "comparing") as tell:
        truth, told = _reference(job)
        if o.max_steps is None:
            taken = truth.health.steps + truth.health.rejected if truth is not None else 0
            job.max_steps = STEP_LIMIT_FACTOR * max(taken, 1000)
        return _run_all(job, truth, told, tell)


def _run_all(
    job: _ComparisonTask, truth: Result | None, reference_text: str, report_progress: ReportProgress
) -> Comparison:
    """Run all formulations, first for the results, then for their cost."""
    starts: dict[str, InitialState] = {}
    rows = []
    names = job.options.formulations or ()
    for k, name in enumerate(names):
        rows.append(_formulation(job, name, starts, truth))
        report_progress((k + 1) / len(names) * (0.5 if job.options.repeats else 1.0), name)
    _measure_costs(job, rows, starts, report_progress)
    report_progress(1.0)
    energy = float(truth.energy.kinetic.max(initial=0.0)) if truth is not None else np.nan
    kept = {
        k: v for k, v in _integration(job, "baumgarte").choices().items() if k not in ("coordinates", "stabilization")
    }
    return Comparison(job.model.name, job.span[1], tuple(rows), reference_text, energy, kept)


def _checked_names(names: Sequence[str] | None) -> tuple[str, ...]:
    if names is None:
        return tuple(EXPLICIT_FORMULATIONS)
    wanted = (names,) if isinstance(names, str) else tuple(names)
    if not wanted:
        raise ModelError(f"formulations is empty: nothing would be compared; {listing(list(FORMULATIONS))}")
    for name in wanted:
        if name not in FORMULATIONS:
            raise ModelError(
                f"there is no formulation {name!r}{suggest(str(name), FORMULATIONS)}; {listing(list(FORMULATIONS))}"
            )
    return tuple(dict.fromkeys(wanted))


def _reference(job: _ComparisonTask) -> tuple[Result | None, str]:
    """Reference motion by projection at the finest tolerance that succeeds, and its description."""
    why = "the requested tolerances are as small"
    usual = _integration(job, "projection")
    for rtol in REFERENCE_TOLERANCES:
        if rtol < usual.rtol:
            result, why = _integrate(job, job.base, replace(usual, rtol=rtol, atol=0.1 * rtol))
            if not why:
                return result, f"projection at rtol = {rtol:g}"
    bent = ", ".join(e.title for e in nonsmooth_elements(job.model))
    note = (
        f" compare does not support corners of laws ({bent}), at which a motion may stick; simulate does"
        if bent
        else ""
    )
    return None, f"none: {why}{note}"


def _initial_state(job: _ComparisonTask, formulation: FormulationChoice) -> InitialState:
    """Initial state for one formulation.

    Raises
    ------
    AnalysisError
        If the formulation does not exist for this mechanism.
    """
    a, rows = job.base.assembly, len(job.base.assembly.compiled.structure.rows)
    if formulation.method:
        try:
            begun = in_suitable_coordinates(job.base, formulation.method, "absolute", job.options.parameters)
            if formulation.method == VARIATIONAL:
                refuse_for_variational(begun)
            return begun
        except ModelError as error:
            raise AnalysisError(str(error)) from None
    if formulation.coordinates == "joint":
        made = find_initial_state(job.model, job.span[0], job.options.parameters, job.options.start, "joint")
        if not made.assembly.compiled.structure.tree:
            raise AnalysisError(f"there are no joint coordinates: {made.coordinates.removeprefix('absolute: ')}")
        return made
    if not formulation.coupled:
        return job.base
    if not rows:
        raise AnalysisError("there are no constraint rows, so that there is nothing to couple")
    if a.compiled.values.system.scales.semidefinite > 0.0:
        raise AnalysisError(
            "some body has no inertia about some axis, so that M has no inverse; the coupled matrix is factored in an "
            "order that needs one"
        )
    c = compile_mechanism(job.model, parameters=job.options.parameters, coupled=True)
    c.z = a.compiled.z.copy()
    return replace(job.base, assembly=replace(a, compiled=c))


def _integrate(job: _ComparisonTask, start: InitialState, o: Integration) -> tuple[Result | None, str]:
    """The motion as far as it could be computed, and the reason why it stopped."""
    clock, rows, _, failed = _run_loop(job, start, o, job.times)
    here = EventContext(start, clock)
    here.failed = failed
    try:
        return make_result(here, rows, o), ""
    except SimulationError as stopped:
        return stopped.result, str(stopped).partition(" The motion up to")[0]  # type: ignore[return-value]


def _run_loop(
    job: _ComparisonTask, start: InitialState, o: Integration, times: np.ndarray
) -> tuple[ex.StepState, np.ndarray, float, Exception | None]:
    """Run the compiled loop from the start: (integrator state, rows, processor time [s], error)."""
    W = start.assembly.compiled.work
    W.counts[:] = 0
    W.options.position_violation = W.options.velocity_violation = 0.0
    if o.stabilization == "partitioning":
        initial_state.choose_independent(job.model, start)
    start.since = time.perf_counter()
    clock = clock_for(start, *job.span, times, o)
    here = EventContext(start, clock)
    begun = time.thread_time()
    if o.method in IMPLICIT_METHODS:
        engine = CodeSelection(start.assembly.compiled, False)
        rows, interrupted = integrate_events(here, o, row_width(start.assembly), no_progress, engine, NO_BREAKPOINTS)
    else:
        rows, interrupted = run_compiled_loop(start.assembly, clock, tableau(o.method), no_progress, INTEGRATE)
    taken = time.thread_time() - begun
    if interrupted:
        raise KeyboardInterrupt
    return clock, rows, taken, here.failed


def _formulation(job: _ComparisonTask, name: str, starts: dict[str, InitialState], truth: Result | None) -> Formulation:
    """The motion by one formulation, with drift, error and steps."""
    way, nothing = FORMULATIONS[name], np.zeros(0)
    try:
        starts[name] = start = _initial_state(job, way)
    except AnalysisError as error:
        return Formulation(name, way.meaning, False, str(error), nothing, nothing, nothing, nothing)
    result, why = _integrate(job, start, _integration(job, name))
    if result is None:
        return Formulation(name, way.meaning, False, why, nothing, nothing, nothing, nothing)
    g, gv = _drifts(job.base.assembly.compiled, start.assembly.compiled, result)
    f = Formulation(name, way.meaning, not why, why or "reached the end", result.t, g, gv, result.energy.balance)
    f.steps, f.rejected, f.result = result.health.steps, result.health.rejected, result
    f.evaluations, f.factorisations = result.health.evaluations, result.health.factorisations
    f.exchanges = int(start.assembly.compiled.work.counts.exchanges)
    if truth is not None and not why:
        f.difference = _motion_difference(job.base.assembly.compiled, truth, start.assembly.compiled, result)
    return f


def _integration(job: _ComparisonTask, name: str) -> Integration:
    return job.options.integration_options(FORMULATIONS[name], job.max_steps).with_tolerance()


def _state(c: CompiledMechanism, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    nq, nv = c.structure.nq, c.structure.nv
    c.z = y[nq + nv :].copy()
    return y[:nq].copy(), y[nq : nq + nv].copy()


def _drifts(absolute: CompiledMechanism, c: CompiledMechanism, result: Result) -> tuple[np.ndarray, np.ndarray]:
    """Largest |g| and |G v - nu| at every output time, of the constraints in absolute coordinates."""
    g, gv = np.zeros(len(result.t)), np.zeros(len(result.t))
    if not len(absolute.structure.rows):
        return g, gv
    for k, t in enumerate(result.t.tolist()):
        y = np.r_[result.q[k], result.v[k], result.states[k]]
        q, v = _state(c, y)
        if c.structure.tree:
            q, v = absolute.take(c, t, q, v)
        else:
            absolute.z = c.z.copy()
        absolute.at(t, q, v)
        g[k] = np.abs(absolute.work.rows.value).max()
        gv[k] = np.abs(absolute.sparse_jacobian() @ v - absolute.work.rows.nu).max()
    return g, gv


def _motion_difference(absolute: CompiledMechanism, truth: Result, c: CompiledMechanism, result: Result) -> float:
    """Largest distance of two motions [m] at output times and at the end.

    Displacements of mass centres, and rotations times the mechanism's length.
    """
    there = absolute.moving(truth.final[0], *_state(absolute, truth.final[1]))
    here = c.moving(result.final[0], *_state(c, result.final[1]))
    length, worst = absolute.values.length, 0.0
    for name, a in there.items():
        b, x, y = here[name], truth[name], result[name]
        on_the_way = _pose_distance(x.position - y.position, x.rotation - y.rotation, length)
        worst = max(worst, on_the_way, _pose_distance((a.p - b.p)[None], (a.R - b.R)[None], length))
    return worst


def _pose_distance(p: np.ndarray, R: np.ndarray, length: float) -> float:
    """Largest displacement [m] or rotation times the length, from differences of positions and rotation matrices."""
    turn = 2.0 * np.arcsin(np.minimum(1.0, np.linalg.norm(R, axis=(1, 2)) / np.sqrt(8.0)))
    return float(np.maximum(np.linalg.norm(p, axis=1), length * turn).max(initial=0.0))


def _measure_costs(
    job: _ComparisonTask, rows: list[Formulation], starts: Mapping[str, InitialState], report_progress: ReportProgress
) -> None:
    """Repeat the formulations that reached the end without intermediate outputs, to measure their cost."""
    end = job.times[-1:] * 0.0 + job.span[1]
    spent: dict[str, list[float]] = {f.name: [] for f in rows if f.success}
    repeats = job.options.repeats
    for k in range(repeats):
        report_progress(0.5 + 0.5 * k / repeats, "costs")
        for f in rows:
            if f.name not in spent or sum(spent[f.name]) > REPEAT_SECONDS:
                continue
            start = starts[f.name]
            clock, _, seconds, _ = _run_loop(job, start, _integration(job, f.name), end)
            spent[f.name].append(seconds)
            counts = start.assembly.compiled.work.counts
            f.steps, f.rejected = int(clock.count.accepted), int(clock.count.rejected)
            f.evaluations, f.factorisations = int(counts.evaluations), int(counts.factorisations)
            f.exchanges = int(counts.exchanges)
            f.cpu = float(np.median(spent[f.name]))
