"""Kinematics of driven mechanisms: positions, velocities and accelerations when drivers prescribe the motion.

At every time positions are found by Newton's method from a prediction, and velocities and accelerations from the same
rows, so nothing drifts and no step jumps to another branch. Masses and forces have no influence on the motion; the
corresponding reactions and efforts are computed too.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..analysis_options import AnalysisOptions
from ..assembly.assemble import assemble
from ..assembly.assembled_state import Assembly
from ..assembly.compiled_mechanism import compile_mechanism
from ..engine.entry_point import FOLLOW, INTEGRATE
from ..errors import AssemblyError, MobilityError, ModelError, SimulationError, SingularityError
from ..mobility.mobility import mobility, nearby_positions
from ..mobility.null_spaces import jacobian_rank, scaled_jacobian
from ..model.body import Driver
from ..model.model import Model
from ..model.unsupported_elements import refuse_unsupported
from ..numerics.rank import MAX_DOUBTFUL_SVD_SIZE
from ..progress import no_progress, progress_bar
from ..results.mobility import Mobility
from ..results.result import Result
from ..simulation.initial_state import InitialState, initial_state_at
from ..simulation.integration_options import default_integration, output_times
from ..simulation.prescribed_motion import is_checked_afterwards, refuse_passed
from ..simulation.simulate import integrate_motion
from ..simulation.solver_switching import CodeSelection, check_specialize

SINGULAR_RATIO = 1e-3  # relative smallest singular value at the end of the motion below which the position is singular
LEAST_SHARE = 1e-2  # relative share in a dependency from which on an element is named
MAX_NAMED = 8

Times = int | Sequence[float]


@dataclass(frozen=True, kw_only=True)
class KinematicsOptions(AnalysisOptions):
    """Arguments of `Mechanism.kinematics`."""

    times: Times
    t_end: float | None
    t_start: float | None
    parameters: Mapping[str, float] | None
    coordinates: str
    specialize: bool | str
    progress: bool | Callable[[float], None]

    def __post_init__(self) -> None:
        super().__post_init__()
        check_specialize(self.specialize)


def kinematics(model: Model, o: KinematicsOptions) -> Result:
    """Compute positions, velocities and accelerations that drivers prescribe: see `Mechanism.kinematics`."""
    refuse_unsupported(model, "kinematics", is_checked_afterwards)
    started = time.perf_counter()
    outputs, begin = requested_times(o.times, o.t_start, o.t_end)
    model = model.snapshot()
    base = driven_assembly(model, begin, o.parameters)
    start = initial_state_at(base, o.parameters, o.coordinates)
    start.since = started
    start.engine = CodeSelection(start.assembly.compiled, o.specialize)
    holonomic = all(r.holonomic for r in base.compiled.structure.rows)
    task = FOLLOW if holonomic else INTEGRATE
    with progress_bar(o.progress, "following the drivers") as tell:
        try:
            result = integrate_motion(
                start, float(outputs[-1]), outputs, default_integration(o.coordinates, 1e-10, 1e-12), task, tell
            )
        except SimulationError as error:
            raise _lock_error(start, error) or error from None

    def again(times: np.ndarray) -> Result:
        start = initial_state_at(base, o.parameters, o.coordinates)
        start.engine = CodeSelection(start.assembly.compiled, o.specialize)
        return integrate_motion(
            start, float(times[-1]), times, default_integration(o.coordinates, 1e-10, 1e-12), task, no_progress
        )

    refuse_passed(result, "kinematics", again)
    return result


def requested_times(times: Times, first: float | None, last: float | None) -> tuple[np.ndarray, float]:
    """Return ascending output times, and the start time.

    Raises
    ------
    ModelError
        If the times are incomplete or invalid.
    """
    if isinstance(times, (int, np.integer)):
        if last is None:
            raise ModelError(f"{times} times until when? Give t_end [s], or the times themselves")
        first = 0.0 if first is None else first
        return output_times(first, last, int(times)), first
    try:
        at = np.atleast_1d(np.asarray(times, float))
    except (TypeError, ValueError):
        raise ModelError(f"times must be a number of times, or the times [s] themselves, not {times!r}") from None
    if last is not None:
        raise ModelError("t_end belongs to a number of output times; an array of times already contains the end")
    if at.ndim != 1 or not len(at) or not np.isfinite(at).all() or not (np.diff(at) > 0).all():
        raise ModelError("times must be finite and in ascending order")
    first = min(0.0, float(at[0])) if first is None else first
    if at[0] < first:
        raise ModelError(f"the first time, {at[0]:g} s, is before the start at {first:g} s")
    return at, first


def driven_assembly(model: Model, t: float, parameters: Mapping[str, float] | None) -> Assembly:
    """Return the mechanism assembled at its start, in absolute coordinates, with drivers that leave no freedom.

    Raises
    ------
    MobilityError, SingularityError, AssemblyError
        As for `kinematics`.
    """
    try:
        base = assemble(model, t=t, parameters=parameters)
    except AssemblyError as error:
        raise _contradiction_error(model, t, error) or error from None
    found = mobility(model, base)
    if found.freedoms:
        raise _singular_start_error(found) or _under_driven_error(found)
    if any(isinstance(model[name], Driver) for name in found.redundant):
        raise _over_driven_error(found)
    return base


def _under_driven_error(found: Mobility) -> MobilityError:
    a = found.found.assembly  # type: ignore[union-attr]
    model = a.compiled.structure.model
    motions = found.motions
    told_of = "; ".join(m.text for m in motions[:MAX_NAMED])
    more = f"; and {found.freedoms - MAX_NAMED} more" if found.freedoms > MAX_NAMED else ""
    example = next((m.coordinate for m in motions if m.coordinate), "")
    remedy = f"for instance Driver('drive', {example!r}, ...), or a joint" if example else "or a joint"
    has = f"{len(model.drivers)} drivers" if len(model.drivers) != 1 else "one driver"
    return MobilityError(
        f"{model.name!r} is under-driven: its {has} leave{'s' if len(model.drivers) == 1 else ''} "
        f"{found.freedoms} freedom{'s' if found.freedoms > 1 else ''}: {told_of}{more}. Add a driver for each, "
        f"{remedy} that prevents it; or simulate() it, if forces are to move it",
        free=tuple(m.name for m in motions),
    )


def _over_driven_error(found: Mobility) -> MobilityError:
    model = found.found.assembly.compiled.structure.model  # type: ignore[union-attr]
    sets = [s for s in found.sets if s.drivers]
    drivers = tuple(dict.fromkeys(n for s in sets for n in s.drivers))
    texts = []
    for s in sets:
        others = [n for n in s.elements if n not in s.drivers]
        through = f" through {', '.join(others[:MAX_NAMED])}" if others else ""
        texts.append(f"drivers {', '.join(s.drivers)} prescribe the same motion{through}" if len(s.drivers) > 1
                     else f"driver {s.drivers[0]} repeats the motion of {', '.join(others[:MAX_NAMED])}")  # fmt: skip
    return MobilityError(
        f"{model.name!r} is over-driven: {'; '.join(texts)}. Leave out one driver of each set; two laws that agree "
        f"only as far as they are rounded would lock the mechanism",
        redundant=drivers,
    )


def _contradiction_error(model: Model, t: float, error: AssemblyError) -> MobilityError | SingularityError | None:
    """Return the error that names contradictory drivers, if they prevent the assembly; None otherwise.

    Or that a driver prescribes a velocity which the singular start position does not allow.
    """
    if error.best is None:
        return None
    found = mobility(model, error.best)
    if not any(isinstance(model[name], Driver) for name in found.redundant):
        return None
    sets = [s for s in found.sets if s.drivers and s.contradiction]
    drivers = tuple(dict.fromkeys(n for s in sets for n in s.drivers))
    if any(s.contradiction == "velocity" for s in sets) and (singular := _singular_start_error(found)) is not None:
        return singular
    if not drivers or (len(drivers) == 1 and sets[0].contradiction == "position"):
        return None  # a single driver that prescribes a position out of reach
    return MobilityError(
        f"{model.name!r} is over-driven: drivers {', '.join(drivers)} contradict one another at t = {t:g} s: "
        f"{'; '.join(s.text for s in sets)}. Leave out one of them, or make their laws agree",
        redundant=drivers,
    )


def _singular_start_error(found: Mobility) -> SingularityError | None:
    """Return the error for a start where drivers do not determine the motion, though at nearby positions they do."""
    a = found.there.assembly
    c = a.compiled
    if not c.structure.model.drivers or not found.redundancy or not found.freedoms:
        return None
    free = c.structure.model.copy()
    free.drivers = []
    loose = compile_mechanism(free, parameters=c.values.parameter_values)
    loose.follow(c.hints)
    released = mobility(free, Assembly(loose, a.t, a.q, a.v))
    ranks = []
    for q in nearby_positions(released.there.assembly, released.there.velocities):
        c.at(a.t, q, a.v)
        ranks.append(jacobian_rank(c))
    c.at(a.t, a.q, a.v)
    if max(ranks, default=0) < c.structure.nv:
        return None
    names = found.redundant
    return SingularityError(
        f"{c.structure.model.name!r} starts in a singular position at t = {a.t:g} s: the constraints of "
        f"{', '.join(names[:MAX_NAMED])} are dependent there, so the drivers do not determine its motion, or cannot "
        f"start it ({'; '.join(m.name for m in found.motions[:MAX_NAMED])} is free). Start a little away from this "
        "position, or drive another coordinate",
        where=a.t,
        elements=names,
    )


def _lock_error(start: InitialState, error: SimulationError) -> SingularityError | None:
    """Return the error that names the locking elements, if the motion ends at a singular position."""
    result = error.result
    if not isinstance(result, Result) or not np.isfinite(result.final[1]).all():
        return None
    base, own = start.base.compiled, start.assembly.compiled
    s = own.structure
    t, y = result.final
    q, v, own.z = y[: s.nq].copy(), y[s.nq : s.nq + s.nv].copy(), y[s.nq + s.nv :].copy()
    if base is not own:
        q, v = base.take(own, t, q, v)
    base.at(t, q, v)
    if base.structure.nv > MAX_DOUBTFUL_SVD_SIZE:
        return None
    U, d, _ = np.linalg.svd(scaled_jacobian(base)[0].toarray(), full_matrices=False)
    n = base.structure.nv
    if len(d) < n or d[n - 1] > SINGULAR_RATIO * d[0]:
        return None
    share = np.abs(U[:, n - 1])
    model = base.structure.model
    names = tuple(
        k for k, rows in base.structure.slices.items() if share[rows].max(initial=0.0) > LEAST_SHARE * share.max()
    )
    drivers = [k for k in names if isinstance(model[k], Driver)]
    joints = [k for k in names if k not in drivers]
    whose = f"driver{'s' if len(drivers) > 1 else ''} {', '.join(drivers)}" if drivers else "its drivers"
    return SingularityError(
        f"{model.name!r} locks at t = {t:.6g} s: {whose} cannot move it further through "
        f"{', '.join(joints[:MAX_NAMED])}, whose constraints become dependent there. Shorten the range of "
        f"{'the driver' if drivers else 'its drivers'}, change lengths so that it reaches further, or drive a "
        "coordinate that keeps turning there (singularities() follows the mechanism through such positions). The "
        "motion up to there is kept in the error's result",
        where=float(t),
        elements=names,
        result=result,
    )
