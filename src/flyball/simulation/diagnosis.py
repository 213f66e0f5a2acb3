"""Diagnosis: why an integration could not continue; rounding limits; residual of the accelerations.

`failure_reason` finds the cause of a failure: a law that jumps or is not finite, contradictory drivers, a lock-up, a
friction jam, an unbounded motion, too many steps.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ..assembly.assembled_state import Assembly, undefined_row
from ..assembly.compiled_mechanism import CompiledMechanism
from ..constraints.switches.switch_kind import OFF
from ..engine import motion
from ..engine.entry_point import MOTION
from ..engine.kinematics import load_record
from ..engine.loads import force_row
from ..errors import AnalysisError, ModelError, SimulationError
from ..laws.bytecode import BY_TIME, evaluate, evaluate_jet
from ..laws.python_functions import function_fault
from ..mobility.mobility import explain_contradiction
from ..model.body import GROUND, Driver
from ..model.contact_point import Touch
from ..model.element import Element, LawOf, fields_with
from ..model.expression_parser import tree_text
from ..model.force import CoordinateForce
from ..model.messages import abbreviated
from ..numerics.integrators import time_loop as ex
from ..tables.table_definitions import REVOLUTE
from .integration_intervals import sampling_limits_steps
from .law_faults import finite_time_escape, law_inputs, step_too_long, unbounded_motion, undefined_law_part

if TYPE_CHECKING:
    pass


class UnresolvedInstant(SimulationError):
    """An instant at which rigid-body equations have no solution, or at which events never end."""


class InitialOverlap(ModelError):
    """A motion that starts with overlapping bodies."""


def jam_message(e: Any, t: float, single: bool) -> str:
    """Return the message for friction in a joint or contact for which no consistent load was found.

    With a single load (``single``) the search finds a solution if one exists; with several it may end without finding
    it.
    """
    if not single:
        where = f"of {body_names(e)}" if isinstance(e, Touch) else f"in joint {e.joint!r}"
        return (
            f"{e.title} {where}: at t = {t:.6g} s no joint loads were found that are consistent with the friction "
            "that they cause. Either there are none, since friction increases its own load too much (a jam, or "
            "Painleve's paradox), or the iteration did not converge to them. It converges better with less friction "
            "(coefficients, radius, bending_length, twist_length); impulse time stepping (method='impulse') needs no "
            "such iteration"
        )
    if isinstance(e, Touch):
        return (
            f"{e.title} of {body_names(e)} jams at t = {t:.6g} s: friction there increases its own normal force so "
            "much that there is no finite solution, or several (Painleve's paradox). With less friction, or "
            "compliant contact (law=), there is a solution; impulse time stepping passes over it"
        )
    return (
        f"{e.title} jams joint {e.joint!r} at t = {t:.6g} s: friction increases the joint's load by as much as the "
        "load that causes it, so that there is no finite solution, or several. Check its coefficients, and the "
        "lengths over which the joint carries moments (bending_length, twist_length)"
    )


def body_names(e: Touch) -> str:
    """Return the names of both bodies of a contact point."""
    return " and ".join(repr(b) if b != GROUND else GROUND for b in (e.body_i, e.body_j))


LIMIT_TOLERANCE = 1e-6  # relative distance below which limits count as crossed where an integration has just ended


def contradicting_limits(c: CompiledMechanism, t: float, near: float = LIMIT_TOLERANCE) -> str:
    """Return a message on a controller whose limits cross at the kinematics last evaluated; empty if there is none."""
    S, W = c.values.system, c.work
    stack = np.zeros_like(W.stack)
    with np.errstate(all="ignore"):
        for e, names, laws in c.structure.ordered:
            low, high = (float(evaluate(S.code, S.const, at, stack, (t, 0.0 * t, 0.0 * t), W.sensed)) for at in laws)
            if low > high - near * (abs(low) + abs(high)):
                first, last = names
                return (
                    f"{e.title} has no output: its limits cross, {first} is {low:.6g} and {last} {high:.6g}. Give "
                    f"limits of which {first} stays below {last}"
                )
    return ""


def refuse_contradicting_limits(c: CompiledMechanism, t: float) -> None:
    """Refuse controllers whose limits cross at the kinematics last evaluated.

    Raises
    ------
    AnalysisError
        Naming one, its limits and the time.
    """
    if text := contradicting_limits(c, t, 0.0):
        raise AnalysisError(f"{c.structure.model.name!r}: at t = {t:.6g} s, {text}")


NOTABLE = 10.0  # rounding error of a step, in tolerances, from which on it is reported
RECENT_SHARE = 1e-3  # part of the time span before a stop within which rounding counts as its cause


def rounding_error_remark(clock: ex.StepState) -> str:
    """Return a remark on the largest accepted step error caused by rounding; empty if it is not notable."""
    size = clock.real.largest_error
    if not size > NOTABLE:
        return ""
    return (
        f"rounding is the limit: near t = {clock.real.largest_error_at:.6g} s, where the mechanism is close to a "
        f"singular position, rounding of the state alone changes a step by up to {size:.2g} times what rtol = "
        f"{clock.real.rtol:g} allows. The step was accepted; a larger rtol can be satisfied"
    )


def origin_distance_remark(a: Assembly, clock: ex.StepState) -> str:
    """Return a remark if the mechanism is so far from the origin that rounding of positions exceeds the tolerance."""
    length = a.compiled.values.length
    far = float(np.abs(a.compiled.array("frames").position).max(initial=0.0))
    digit = math.ulp(far)
    if not digit > (clock.real.atol + clock.real.rtol) * length:
        return ""
    return (
        f"rounding is the limit: positions {far:.3g} m from the origin are known to {digit:.1g} m, which is more than "
        f"rtol = {clock.real.rtol:g} of the mechanism's length of {length:.3g} m; describe it near the origin"
    )


def rounding_suffix(clock: ex.StepState) -> str:
    """Return the addition to the message of a stopped run if rounding dominated shortly before."""
    if clock.real.t - clock.real.rounding_found_at > RECENT_SHARE * clock.real.span:
        return ""
    return (
        ". Rounding is the limit there: rounding of the state changes the error of a step by a tenth of it or more, "
        f"as it does close to a singular position; rtol = {clock.real.rtol:g} cannot be satisfied"
    )


def acceleration_residual(
    c: CompiledMechanism, v: np.ndarray, x: np.ndarray, sizes: np.ndarray
) -> tuple[np.ndarray, float, float]:
    """Return the residual of accelerations x in each row, (nr,), the largest sum of a row's terms, and that without x's
    own.

    Rows in metres are divided by the mechanism's length. The state (velocities v) is the one in c's workspace,
    evaluated with forces; ``sizes`` are c's.
    """
    S, n = c.values.system, len(c.structure.rows)
    row_p = S.row_start[: n + 1]
    row, column, G = np.repeat(np.arange(n), np.diff(row_p)), S.column[: row_p[-1]], c.work.G[: row_p[-1]]

    def times(entries: np.ndarray, x: np.ndarray) -> np.ndarray:
        return np.bincount(row, entries * x[column], n)

    gamma = c.work.rows.gamma
    turning = np.zeros(n)
    np.maximum.at(turning, row, (np.abs(v) / sizes)[column])
    asked = times(abs(G), np.abs(_unconstrained_accelerations(c))) + np.abs(gamma) + times(abs(G), np.abs(v)) * turning
    metre = c.row_units
    size = asked + times(abs(G), np.abs(x))
    return np.abs(times(G, x) - gamma) / metre, float((size / metre).max()), float((asked / metre).max())


def _unconstrained_accelerations(c: CompiledMechanism) -> np.ndarray:
    """Return the accelerations (nv,) that forces would cause without constraints, at the state in c's workspace.

    Each body has a single reference inertia about all axes: a slender body that its joints keep from spinning does not
    spin.
    """
    S = c.values.system
    per = np.zeros(c.structure.nv)
    for b, (v0, n) in enumerate(zip(S.tree.v, S.tree.nv, strict=True)):
        k = min(n, 2 if c.structure.model.planar else 3)
        per[v0 : v0 + k], per[v0 + k : v0 + n] = S.bodies.inverse_mass[b], S.bodies.inverse_reference_inertia[b]
    return per * c.work.velocities.applied


JUMP_WINDOW = 1e-10  # part of the time span within which jumps of a law are sought
# change of a law, or of its rate times the span, that is none: relative to itself, and to the other of the two
JUMP_ROUNDING, LAW_ROUNDING = 1e-7, 1e-12
LOOKAHEAD = (1e-10, 1e-8, 1e-6)  # parts of the time span after which a law is evaluated
LOCKED_RESIDUAL = 1e-3  # relative residual of the accelerations above which the mechanism is locked
DISAGREEMENT = 1e-6  # relative difference of derivatives above which two laws of one coordinate disagree
DERIVATIVE_NAMES = ("value", "rate", "second derivative")
GROWTH_FACTOR = 1.2  # growth of an unbounded derivative when the distance from the instant is divided by a hundred
JUMP_FACTOR = 10.0  # ratio of a law's change to that by its slope above which it has jumped


def failure_reason(
    a: Assembly, base: Assembly, clock: ex.StepState, with_result: bool = True, method: str = ""
) -> tuple[str, Exception | None]:
    """Return why the integration stopped, and the exception that a user's function raised, if one did.

    Parameters
    ----------
    a : Assembly
        Its workspace is as the compiled loop has left it.
    base : Assembly
        The mechanism in absolute coordinates, where every joint and driver has rows.
    clock : StepState
        State of the integration.
    with_result : bool
        Whether there is a partial result.
    method : str
        Name of the integrator.
    """
    name = a.compiled.structure.model.name
    t = float(clock.real.t)
    after = f". The motion up to t = {t:.6g} s is kept in the error's result" if with_result else ""
    if clock.count.status == ex.TOO_MANY_STEPS:
        near = undefined_row(a.compiled)
        text = f"{_too_many_steps(a, clock)}{rounding_suffix(clock)}{near and f'. There {near}'}"
        return f"{name!r}: {text}{after}", None
    stack = a.compiled.work.stack
    found = function_fault(stack, a.compiled.structure.functions) or a.compiled.structure.missed(stack)
    if found is not None:
        return f"{name!r}: just after t = {t:.6g} s, {found.message}{after}", found.exception
    text = (
        driver_fault(a.compiled, t, float(clock.real.largest))
        or _end_of_curve(a, clock)
        or _not_finite_motion(a, clock, method)
    )
    if not text and (text := _friction_jam(a, clock)):
        return f"{name!r}: {text}{after}", UnresolvedInstant(text, t=t)
    text = (
        text
        or unbounded_motion(a, clock, _component_name)
        or _force_fault_at_end(a, clock)
        or finite_time_escape(a, clock, _component_name)
    )
    text = (
        text
        or _singular_coordinate(a, t)
        or _lock_up(a, base, clock)
        or _contradicting_drivers(a, clock)
        or _step_too_small(a, clock)
    )
    return f"{name!r}: {text}{after}", None


def health_remarks(a: Assembly, clock: ex.StepState) -> tuple[str, ...]:
    """Return health remarks on faults that were overcome, and on rounding as the limit of accuracy."""
    return tuple(
        text for text in (_overcome_fault(a), rounding_error_remark(clock), origin_distance_remark(a, clock)) if text
    )


def _overcome_fault(a: Assembly) -> str:
    functions = a.compiled.structure.functions
    found = function_fault(a.compiled.array("stack"), functions, overcome=True) if functions else None
    if found is None:
        return ""
    return (
        f"in a step that was then taken again, shorter, {found.message}. The motion does not contain that step; if "
        "the function is wrong, correct it"
    )


def driver_fault(c: CompiledMechanism, t: float, span: float) -> str:
    """Return why a driver's law fails about time t (not finite, jump, unbounded derivative); empty if none does.

    ``span`` is the largest time [s], relative to which times are distinguished.
    """
    S, W = c.values.system, c.work
    stack = np.zeros_like(W.stack)
    for driver, law, wrapped in _driver_laws(c):
        with np.errstate(all="ignore"):
            ahead, behind = (
                [evaluate_jet(S.code, S.const, law, stack, t + way * d * span, W.sensed, BY_TIME) for d in LOOKAHEAD]
                for way in (1.0, -1.0)
            )
        problem = _not_finite_law(ahead) or _jump_of_law(behind[0], ahead[0], span, wrapped)
        problem = problem or _unbounded_derivative(ahead, "after") or _unbounded_derivative(behind, "before")
        if problem:
            return f"{driver.title} cannot be followed beyond t = {t:.6g} s: its law {problem}{_law_texts(driver)}"
    return ""


def reason_without_solution(c: CompiledMechanism, t: float, span: float) -> str:
    """Return why the equations of motion have no solution at the last state; ``span`` as in `driver_fault`."""
    stack = c.work.stack
    found = function_fault(stack, c.structure.functions) or c.structure.missed(stack)
    text = found.message if found else driver_fault(c, t, span) or force_fault(c, t) or _controller_fault(c, t)
    if text:
        return text
    if c.work.counts.status == motion.JAMMED:
        force = c.structure.forces[int(c.work.counts.guilty_row)]
        return f"{force.title} jams there: it grows with the load that it makes"
    return "the position is singular: constraints depend on one another, or a freedom moves no inertia"


def _force_fault_at_end(a: Assembly, clock: ex.StepState) -> str:
    """Return a message on a force without finite value where the motion stopped; empty if there is none."""
    t = float(clock.real.t)
    force = force_fault(a.compiled, t)
    return f"at t = {t:.6g} s, {force}" if force else ""


def _driver_laws(c: CompiledMechanism) -> list[tuple[Any, int, bool]]:
    """Return the drivers, the start index of each law, and whether the value is an angle modulo whole turns."""
    s, S = c.structure, c.values.system
    laws: list[tuple[Any, int, bool]] = [
        (row.element, int(S.rows.law[k]), bool(S.rows.wrapped[k]))
        for k, row in enumerate(s.rows)
        if isinstance(row.element, Driver)
    ]
    return laws + [
        (s.model[name], int(S.tree.law[b]), bool(S.tree.joint[b] == REVOLUTE)) for name, b in s.prescribed.items()
    ]


def _contradicting_drivers(a: Assembly, clock: ex.StepState) -> str:
    """Return a message on two drivers of one coordinate whose laws diverge where the motion stopped; else empty."""
    S, W, t = a.compiled.values.system, a.compiled.work, float(clock.real.t)
    stack = np.zeros_like(W.stack)
    first: dict[str, tuple[Any, tuple]] = {}
    for driver, law, _ in _driver_laws(a.compiled):
        jet = evaluate_jet(S.code, S.const, law, stack, t, W.sensed, BY_TIME)
        other, before = first.setdefault(driver.coordinate, (driver, jet))
        for what, x, y in zip(DERIVATIVE_NAMES[:0:-1], before[:0:-1], jet[:0:-1], strict=True):
            if abs(x - y) > DISAGREEMENT * max(abs(x), abs(y)):
                return (
                    f"{other.title} and {driver.title} both move {driver.coordinate} and disagree from "
                    f"t = {t:.6g} s on: the {what} of their laws there is {x:.6g} and {y:.6g}. Leave out one, or make "
                    f"their laws agree"
                )
    return ""


def _not_finite_law(after: list[tuple]) -> str:
    """Describe a value or derivative that is not finite at times just after an instant; empty if all are finite."""
    for jet in after:
        for what, x in zip(DERIVATIVE_NAMES, jet, strict=True):
            if not math.isfinite(x):
                return f"has the {what} {x:g} just after. Give a law that is finite and smooth over the whole time"
    return ""


def _unbounded_derivative(near: list[tuple], when: str) -> str:
    """Describe a derivative that grows towards an instant; ``near`` has values at increasing distance from it."""
    for what, *sizes in zip(DERIVATIVE_NAMES[1:], *(np.abs(jet[1:]) for jet in near), strict=True):
        if all(x > GROWTH_FACTOR * y for x, y in pairwise(sizes)):
            return (
                f"has a {what} that grows without bound just {when}, which requires an infinite "
                f"{'velocity' if what == DERIVATIVE_NAMES[1] else 'acceleration'}. Give a law with finite derivatives "
                "(a power of what becomes zero: an exponent of 2 or more), or step5, which changes smoothly"
            )
    return ""


def _jump_of_law(before: tuple, after: tuple, span: float, wrapped: bool) -> str:
    """Describe a jump between value and derivatives just before and just after an instant; empty if there is none."""
    if not all(map(math.isfinite, before)):
        return ""
    sizes = [span**k * (abs(before[k]) + abs(after[k])) for k in range(2)]
    for k, remedy in ((0, "step5(t, t0, 0, t1, 1) changes smoothly"), (1, "step5 or a cubic Table changes smoothly")):
        change = after[k] - before[k]
        if wrapped and k == 0:
            change = math.atan2(math.sin(change), math.cos(change))
        slope = max(abs(before[k + 1]), abs(after[k + 1]))
        rounding = JUMP_ROUNDING * sizes[k] + LAW_ROUNDING * sizes[1 - k]
        if span**k * abs(change) > JUMP_FACTOR * JUMP_WINDOW * span ** (k + 1) * slope + rounding:
            return (
                f"jumps in its {DERIVATIVE_NAMES[k]}, from {before[k]:.6g} to {after[k]:.6g}, which requires an "
                f"infinite force; {remedy}"
            )
    return ""


def _not_finite_motion(a: Assembly, clock: ex.StepState, method: str) -> str:
    if clock.count.status != ex.NOT_FINITE and a.compiled.work.counts.status != motion.NOT_FINITE:
        return ""
    t = float(clock.real.t)
    span = float(clock.real.largest)
    if text := step_too_long(a, clock, method):
        return f"at t = {t:.6g} s the motion is not finite any more: {text}"
    if text := unbounded_motion(a, clock, _component_name):
        return text
    if text := undefined_row(a.compiled):
        return f"the equations of motion are not finite just after t = {t:.6g} s: {text}"
    times = [t + d * span for d in (0.0, *LOOKAHEAD)]
    broken = (text for at in times for find in (force_fault, _controller_fault) if (text := find(a.compiled, at)))
    if text := next(broken, "") or _extrapolated_fault(a, clock):
        return f"the equations of motion are not finite just after t = {t:.6g} s: {text}"
    wrong = ~np.isfinite(np.r_[clock.K, clock.y]).all(axis=0)
    if not wrong.any() and (corners := _active_corners(a)):
        return (
            f"just after t = {t:.6g} s no motion was found that stays on the corner of the "
            f"{' and the '.join(corners)}, or leaves it. Make that law smooth there: max(-1, min(1, x / width)) for "
            "sign(x)"
        )
    return (
        f"the equations of motion are not finite just after t = {t:.6g} s, first at "
        f"{_component_name(a, int(np.argmax(wrong)))}. Look for a law that divides by zero or leaves its range"
    )


def _end_of_curve(a: Assembly, clock: ex.StepState) -> str:
    """Return a message on a follower that has reached the end of its curve; empty if there is none."""
    s, numbers = a.compiled.structure, a.compiled.values.numbers
    for joint in s.model.joints:
        at = s.state_at.get(f"{joint.name}.place")
        if at is None or not math.isfinite(place := float(clock.y.current[s.nq + s.nv + at])):
            continue
        if text := joint.end_message(numbers[joint.name], place):  # type: ignore[attr-defined]
            return f"at t = {float(clock.real.t):.6g} s {text}"
    return ""


def _active_corners(a: Assembly) -> list[str]:
    """Return the labels of laws on whose corners the motion is held."""
    mode = a.compiled.work.modes.mode
    specs = enumerate(a.compiled.structure.switches)
    return [x.switch.label for k, x in specs if x.law >= 0 and mode[k] != OFF]


def force_fault(c: CompiledMechanism, t: float) -> str:
    """Return a message on a force that is not finite at the kinematics last evaluated; empty if there is none.

    Controllers whose limits cross are reported first.
    """
    if text := contradicting_limits(c, t):
        return text
    s, S, W = c.structure, c.values.system, c.work
    stack = np.zeros_like(W.stack)
    forces: list[Any] = list(s.forces)
    with np.errstate(all="ignore"):
        for k, e in enumerate(forces):
            if isinstance(e, Touch):
                if not math.isfinite(W.sensed.load[S.forces.load[k]]):
                    return f"the normal force of {e.title} is not finite"
                continue
            F, M, par = (
                load_record(W.frames, S.forces.F[k]),
                load_record(W.frames, S.forces.M[k]),
                force_row(S.force_parameters, k),
            )
            x, y = law_inputs(c, k)
            if not math.isfinite(x) or not math.isfinite(y):
                return undefined_row(c) or f"the measured quantity of {e.title} is not finite. {e.fails}"
            laws = [
                float(evaluate(S.code, S.const, at, stack, (t, x, y), W.sensed)) if at >= 0 else 0.0
                for at in S.forces.laws[k].tolist()
            ]
            if not np.isfinite(laws).all():
                given = (
                    "".join(f", {n} = {v:.6g}" for n, v in zip(e.outputs, (x, y), strict=False)) if e.outputs else ""
                )
                part = undefined_law_part(c, e, t, (float(x), float(y)))
                return (
                    f"the law of {e.title} gives {laws} for t = {t:.6g}{given}"
                    f"{f', as {part}' if part else ''}. Look for a division by zero or a range that it leaves"
                    f"{_law_texts(e)}"
                )
            pressed = W.sensed.load[S.forces.load[k]] if S.forces.load[k] >= 0 else 0.0
            if e.states():
                own = tuple(c.z[S.forces.state[k] : S.forces.state[k] + 2])
                out = np.ravel(e.wrench_and_rates(par, F, M, own, S.const, S.surfaces)[0])
            elif isinstance(e, CoordinateForce):
                out = e.effort(par, x, y, laws, pressed)
            else:
                out = np.ravel(e.wrench_between(par, F, M, tuple(laws), (x, y), S.const))
            if not np.isfinite(out).all():
                return f"the force of {e.title} is no number. {e.failure(par, F, M, S.surfaces)}"
    return ""


def _controller_fault(c: CompiledMechanism, t: float) -> str:
    """Return a message on a controller whose state has no finite rate at the measured values; empty if none."""
    for x in c.structure.controls:
        if part := undefined_law_part(c, x.controller, t):
            law = abbreviated(tree_text(x.law.tree))
            return f"the rate of {x.name!r} of {x.controller.title}, {law}, has no finite value, as {part}"
    return ""


def _extrapolated_fault(a: Assembly, clock: ex.StepState) -> str:
    """Return a message on a force or controller that is not finite where the present rates lead; empty if there is
    none.
    """
    c, t, y, rates = a.compiled, float(clock.real.t), clock.y.current, clock.K[0]
    if not np.isfinite(y).all() or not np.isfinite(rates).all():
        return ""
    s, z = c.structure, c.z
    for d in (clock.real.h, *(part * clock.real.largest for part in LOOKAHEAD)):
        x = y + d * rates
        c.z = x[s.nq + s.nv :].copy()
        with np.errstate(all="ignore"):
            c.at(t + d, x[: s.nq].copy(), x[s.nq : s.nq + s.nv].copy(), MOTION)
        if text := force_fault(c, t + d) or _controller_fault(c, t + d):
            break
    c.z = z
    return text


def _law_texts(e: Element) -> str:
    """Return the laws of an element as given; long ones are abbreviated."""
    given = {name: getattr(e, name) for name in ("law",) if isinstance(e, Driver)}
    given |= {name: getattr(e, name) for name in fields_with(e.__class__, LawOf)}
    texts = [f"{name} = {abbreviated(x)}" for name, x in given.items() if isinstance(x, str)]
    return f", in {'; '.join(texts)}" if texts else ""


def _singular_coordinate(a: Assembly, t: float) -> str:
    """Return a message on a coordinate that is at a singular position where the motion stopped; empty if none is."""
    text = undefined_row(a.compiled)
    return text and f"the integration cannot continue at t = {t:.6g} s: {text}"


def _lock_up(a: Assembly, base: Assembly, clock: ex.StepState) -> str:
    """Name the elements whose rows allow no accelerations where the motion stopped; empty if there are none."""
    t, y, own, c = float(clock.real.t), clock.y.current, a.compiled, base.compiled
    if not len(c.structure.rows) or not np.isfinite(y).all():
        return ""
    nq, nv = own.structure.nq, own.structure.nv
    q, v, own.z = y[:nq].copy(), y[nq : nq + nv].copy(), y[nq + nv :].copy()
    if c is not own:
        q, v = c.take(own, t, q, v)
    _, dy = c.at(t, q, v, MOTION)
    x = dy[c.structure.nq : c.structure.nq + c.structure.nv]
    if not np.isfinite(x).all():
        return ""
    gap, _, asked = acceleration_residual(c, v, x, c.sizes)
    if not gap.max() > LOCKED_RESIDUAL * asked:
        return ""
    names = list(dict.fromkeys(c.structure.rows[k].element.name for k in np.argsort(-gap) if gap[k] > 1e-3 * gap.max()))
    why = explain_contradiction(c, t, q, v, c.work.rows.gamma.copy(), "/s^2") or (
        "in this position no acceleration satisfies them with these velocities. The mechanism locks (a driver may "
        "prescribe more than its links allow), or it starts in a singular position with impossible velocities"
    )
    return f"at t = {t:.6g} s no accelerations satisfy the constraints of {', '.join(names[:8])} together: {why}"


def _friction_jam(a: Assembly, clock: ex.StepState) -> str:
    W = a.compiled.work
    if W.counts.status != motion.JAMMED:
        return ""
    loads = int((a.compiled.system.forces.load >= 0).sum())
    return jam_message(a.compiled.structure.forces[int(W.counts.guilty_row)], float(clock.real.t), loads == 1)


def _step_too_small(a: Assembly, clock: ex.StepState) -> str:
    rows, W = a.compiled.structure.rows, a.compiled.work
    k = int(W.counts.guilty_row)
    where = f" near {rows[k].element.title}" if rows else ""
    if rows and isinstance(rows[k].element, Driver):
        where += f" (whose law there has the rate {W.rows.nu[k]:.4g} and the second derivative {W.rows.nu_dot[k]:.4g})"
    t = f"t = {clock.real.t:.6g} s"
    begun = clock.count.started == 1
    if clock.real.step > 0.0 and begun:
        return (
            f"at {t} a step of {clock.real.step:g} s has no solution{where}: give a shorter step, or leave step "
            f"out, and its width is chosen"
        )
    what = f"{t}: the step width fell to {clock.real.h:.3g} s{where}" if begun else f"its start, {t}{where}"
    if rounding := rounding_suffix(clock):
        return f"the integration cannot continue at {what}{rounding}"
    return (
        f"the integration cannot continue at {what}. The mechanism may lock there (a driver prescribes more than its "
        "links allow), pass a singular position that the tolerance cannot resolve (a larger rtol steps over it), or "
        "a force changes abruptly"
    )


def _too_many_steps(a: Assembly, clock: ex.StepState) -> str:
    if clock.real.step > 0.0:
        return (
            f"max_steps = {clock.count.limit} steps of {clock.real.step:g} s were taken by "
            f"t = {clock.real.t:.6g} s; give more (max_steps=)"
        )
    if text := sampling_limits_steps(a.compiled, clock, a.t):
        return text
    slowest = _component_name(a, _fastest_component(clock))
    return (
        f"max_steps = {clock.count.limit} steps were taken up to t = {clock.real.t:.6g} s; the last ones are "
        f"{clock.real.h:.3g} s long because of {slowest}. Give more steps (max_steps=), a larger rtol, or less "
        "stiffness (friction too is stiff) there"
    )


def _fastest_component(clock: ex.StepState) -> int:
    """Return the state component whose derivative changed most within the last step, relative to its tolerance."""
    n = clock.count.controlled
    with np.errstate(all="ignore"):
        allowed = clock.real.atol * clock.y.unit[:n] + clock.real.rtol * np.abs(clock.y.current[:n])
        change = np.ptp(clock.K[:, :n], axis=0) / allowed
    return int(np.argmax(np.nan_to_num(change)))


def _component_name(a: Assembly, i: int) -> str:
    """Return the name of the body, tree joint or controller state that a component of the state belongs to."""
    s, tree = a.compiled.structure, a.compiled.structure.tables["tree"]
    if s.nq + s.nv <= i < s.nq + s.nv + len(s.controls):
        return f"controller state {s.controls[i - s.nq - s.nv].name!r}"
    for joint in s.tree_joints.values():
        for b in joint.links:
            if i in range(s.nq)[tree.coordinates(b)] or i - s.nq in range(s.nv)[tree.velocities(b)]:
                return f"joint {joint.joint.name!r}"
    for name, b in s.place.items():
        if b >= 0 and (i in range(s.nq)[tree.coordinates(b)] or i - s.nq in range(s.nv)[tree.velocities(b)]):
            return f"body {name!r}"
    return "a measured quantity"
