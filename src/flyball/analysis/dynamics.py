"""Motion in time: the compiled loop, called in chunks, and what it hands out made into a ``Result``."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..errors import ModelError, SimulationError
from ..model.expressions import number
from ..model.model import Model
from ..numerics.integrators import explicit as ex
from ..numerics.integrators.tableaux import tableau
from ..results import doubts
from ..results.health import Health
from ..results.result import Result
from ..system import motion
from ..system.functions import forget, interrupts_kept
from ..system.tables import (
    ALPHA,
    BETA,
    EVALUATIONS,
    FACTORISATIONS,
    G_VALUE,
    MASS,
    PASS,
    SEMIDEFINITE,
    STABILIZE,
    TOL_G,
    TOL_V,
    WORST_G,
    WORST_V,
)
from .assemble import Assembly, assemble
from .compiled import compiled
from .entry import INTEGRATE, motion_kernel
from .mobility import mobility
from .reasons import reason, remarks
from .residual import acceleration_violation

STABILIZATION = {
    "projection": motion.STAGES,
    "projection-steps": motion.STEPS,
    "baumgarte": motion.BAUMGARTE,
    "none": motion.NONE,
}
FINEST = 1e-13  # relative tolerance below which rounding decides
SLICE = 0.05  # seconds that a call of the compiled loop should take


@dataclass(frozen=True)
class Options:
    """Choices of a simulation, as kept in the result.

    ``method``: an explicit Runge-Kutta pair. ``stabilization``: ``projection`` (states and stages are kept on the
    constraints), ``projection-steps`` (states only), ``baumgarte`` with its two rates [1/s], or ``none``. ``max_step``
    [s]: give it where a law acts for a short time only; what is shorter than a step can go unseen.
    """

    rtol: float = 1e-8
    atol: float = 1e-10
    method: str = "dop853"
    stabilization: str = "projection"
    alpha: float = 10.0
    beta: float = 10.0
    max_step: float = np.inf
    max_steps: int = 10_000_000

    def __post_init__(self) -> None:
        for name in ("rtol", "atol", "max_step", "max_steps", "alpha", "beta"):
            value = getattr(self, name)
            if not isinstance(value, (int, float, np.number)) or not value > 0:
                raise ModelError(f"{name} must be greater than 0, got {value!r}")
        if self.rtol < FINEST:
            raise ModelError(
                f"rtol must not be smaller than {FINEST:g}, got {self.rtol!r}: rounding is larger than that"
            )
        if self.stabilization not in STABILIZATION:
            known = ", ".join(STABILIZATION)
            raise ModelError(f"unknown stabilization {self.stabilization!r}; choose one of {known}")
        try:
            tableau(self.method)
        except ValueError as error:
            raise ModelError(str(error)) from None


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
    chosen = _options(options)
    begin = time.perf_counter()
    model = model.snapshot()
    t_start = number(t_start, {}, "s", "t_start") if start is None else start.final[0]
    t_end = number(t_end, {}, "s", "t_end")
    times = output_times(t_start, t_end, outputs)
    a, y = _start(model, t_start, parameters, start)
    if a.compiled.values.system.glob[SEMIDEFINITE] > 0.0:
        mobility(model, a)  # refuses bodies that can move without inertia
    clock = _clock(a, t_start, float(t_end), times, y, chosen)
    rows, interrupted = _run(a, clock, tableau(chosen.method), progress)
    return _finish(model, a, clock, rows, interrupted, chosen, time.perf_counter() - begin)


def _start(
    model: Model, t: float, parameters: Mapping[str, float] | None, before: Result | None
) -> tuple[Assembly, np.ndarray]:
    """Compiled mechanism and state to start from: assembled as described, or where an earlier result ended."""
    if before is None:
        a = assemble(model, t=t, parameters=parameters)
        return a, a.y
    c = compiled(model, parameters=parameters)
    y = before.state_at_end(c)
    nq, nv = c.structure.nq, c.structure.nv
    a = Assembly(c, t, y[:nq].copy(), y[nq : nq + nv].copy())
    c.z = y[nq + nv :].copy()
    c.at(t, a.q, a.v)
    gap = np.abs(c.work.row[G_VALUE]).max(initial=0.0)
    if not gap <= 1e-6 * c.values.length:
        raise ModelError(
            f"the result of {before.model.name!r} ends where the constraints of {model.name!r} are {gap:.3g} from "
            f"fulfilled; it cannot be gone on with. Were parameters changed?"
        )
    return a, y


def _options(options: Mapping[str, object]) -> Options:
    import dataclasses

    known = [f.name for f in dataclasses.fields(Options)]
    for name in options:
        if name not in known:
            raise ModelError(f"simulate has no option {name!r}; it has {', '.join(known)}")
    return Options(**options)  # type: ignore[arg-type]


def output_times(t_start: float, t_end: float, outputs: int | Sequence[float]) -> np.ndarray:
    """Ascending output times within the interval.

    Raises
    ------
    ModelError
        If the interval is empty or not finite, or the times are not ascending within it.
    """
    if not (np.isfinite(t_start) and np.isfinite(t_end)):
        raise ModelError(f"start and end time must be finite, got {t_start} and {t_end}")
    if not t_end > t_start:
        raise ModelError(f"the end time {t_end:g} s must be later than the start time {t_start:g} s")
    if isinstance(outputs, (int, np.integer)):
        if outputs < 2:
            raise ModelError(f"outputs must be at least 2 (start and end), got {outputs}")
        return np.linspace(t_start, t_end, int(outputs))
    try:
        times = np.asarray(outputs, float)
    except (TypeError, ValueError):
        raise ModelError(f"outputs must be a number of times, or the times [s] themselves, not {outputs!r}") from None
    if times.ndim != 1 or not len(times) or not (np.diff(times) > 0).all():
        raise ModelError("outputs must be a number of times, or times in ascending order")
    if times[0] < t_start or times[-1] > t_end:
        raise ModelError(f"output times must lie between {t_start:g} s and {t_end:g} s")
    return times


def _clock(a: Assembly, t: float, t_end: float, times: np.ndarray, y: np.ndarray, o: Options) -> ex.Clock:
    """Everything the compiled loop needs to start, and the choices of the solve."""
    s, W = a.compiled.structure, a.compiled.work
    real, count = np.zeros(10), np.zeros(8, np.int64)
    real[[ex.T, ex.T_END, ex.RTOL, ex.ATOL]] = t, t_end, o.rtol, o.atol
    real[ex.H_MAX] = min(o.max_step, t_end - t)
    real[ex.SCALE] = a.compiled.values.length
    real[ex.LARGEST] = max(abs(t), abs(t_end))
    real[ex.LEDGER] = _energy_size(a, t_end - t)
    count[ex.QUOTA] = 50
    count[ex.LIMIT] = o.max_steps
    count[ex.CONTROLLED] = s.nq + s.nv
    Y = np.zeros((3, len(y)))
    Y[0] = y
    W.option[STABILIZE] = STABILIZATION[o.stabilization]
    W.option[ALPHA], W.option[BETA] = o.alpha, o.beta
    loose = o.atol + o.rtol * a.compiled.values.length
    W.option[TOL_G] = min(1e-6, max(1e-12, 1e-2 * loose))
    W.option[TOL_V] = min(1e-5, max(1e-11, 1e-1 * loose))
    W.option[PASS] = 1e-13
    works = [s.nq + s.nv + k for name, k in s.state_at.items() if name.endswith(".work")]
    K = np.zeros((len(tableau(o.method).c), len(y)))
    return ex.Clock(real, count, times, Y, K, np.array(works, np.int64))


def _energy_size(a: Assembly, span: float) -> float:
    """An energy [J] that errors of works are small against: to lift the mechanism by its length, and to move it by as
    much in the time there is, besides what it has.
    """
    S, length = a.compiled.values.system, a.compiled.values.length
    mass = S.body_x[:, MASS].sum()
    g = np.sqrt((S.glob[:3] ** 2).sum())
    moving = 0.5 * float(a.v @ (a.compiled.mass() @ a.v))
    return float(mass * (g * length + (length / span) ** 2) + moving)


def _run(a: Assembly, clock: ex.Clock, method: object, progress: Callable | None) -> tuple[np.ndarray, bool]:
    """Call the compiled loop until it is through. Returns (output rows, whether the user interrupted)."""
    s, S, W = a.compiled.structure, a.compiled.values.system, a.compiled.work
    width = 1 + len(a.y) + s.nv + len(S.row_i)
    buffer = np.zeros((max(2, min(len(clock.times), 1_000_000 // width + 1)), width))
    rows = []
    first = clock.real[ex.T]
    forget(W.stack)
    try:
        while True:
            begin = time.perf_counter()
            before = clock.count[ex.ACCEPTED] + clock.count[ex.REJECTED]
            with interrupts_kept(s.functions):
                used = motion_kernel(S, W, method, clock, buffer, INTEGRATE)
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


def _finish(
    model: Model, a: Assembly, clock: ex.Clock, rows: np.ndarray, interrupted: bool, o: Options, seconds: float
) -> Result:
    """Result and health; a failed run raises with its partial result."""
    s, W = a.compiled.structure, a.compiled.work
    status = int(clock.count[ex.STATUS])
    t = float(clock.real[ex.T])
    message, cause = "reached the end", None
    if interrupted:
        message = f"interrupted by the user at t = {t:.6g} s; what was computed is kept"
    elif status != ex.DONE:
        message, cause = reason(a, clock)
    health = Health(
        success=status == ex.DONE and not interrupted,
        message=message,
        violation=float(W.option[WORST_G]),
        velocity_violation=float(W.option[WORST_V]),
        steps=int(clock.count[ex.ACCEPTED]),
        rejected=int(clock.count[ex.REJECTED]),
        evaluations=int(W.info[EVALUATIONS]),
        factorisations=int(W.info[FACTORISATIONS]),
        seconds=seconds,
        options={k: getattr(o, k) for k in o.__dataclass_fields__},
        remarks=remarks(a),
    )
    cuts = np.cumsum([1, s.nq, s.nv, len(s.states), s.nv])
    t_out, q, v, z, vdot, lam = (np.ascontiguousarray(p) for p in np.split(rows, cuts, axis=1))
    result = Result(model, a.compiled.values, t_out[:, 0], q, v, z, vdot, lam, health)
    result.final = (t, clock.y[0].copy())
    health.late = {
        "mobility": partial(mobility, model, a),
        "energy_drift": partial(_energy_drift, result),
        "acceleration_violation": partial(acceleration_violation, result),
        "creep": partial(doubts.creep, result),
        "warnings": partial(doubts.warnings, result),
    }
    if status not in (ex.DONE, ex.RUNNING):
        raise SimulationError(message, result, t) from cause
    return result


def _energy_drift(result: Result) -> float:
    return result.energy.drift
