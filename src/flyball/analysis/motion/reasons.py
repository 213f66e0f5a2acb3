"""Why an integration could not go on: the element behind it, in words, and the exception of a user's function."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from ...constraints.modes import BRANCH
from ...equations import motion
from ...equations.engine import MOTION
from ...equations.loads import wide
from ...equations.records import load
from ...laws.evaluation import evaluate, evaluate_jet
from ...laws.functions import fault
from ...laws.opcodes import BY_TIME
from ...model.body import Driver
from ...model.element import Element, LawOf, fields_with
from ...model.force import CoordinateForce
from ...model.grammar import written
from ...model.touch import Touch
from ...model.words import brief
from ...numerics.integrators import clock as ex
from ...tables.system import (
    LOAD,
    OFF,
    REVOLUTE,
)
from ..assembly.gaps import undefined_row
from ..assembly.start import Assembly
from ..compiled import Compiled
from ..freedom.contradiction import story
from .crossed import crossed
from .jams import Unresolved, jam
from .residual import missed
from .rounding import excess, far_off, rounded
from .samples import too_often
from .unbounded import boundless, escaping, too_long
from .undefined import inputs_of, undefined_in

NEAR = 1e-10  # part of the time span within which a law that jumps is looked for
AHEAD = (1e-10, 1e-8, 1e-6)  # parts of the time span after which a law's values are looked at
LOCKED = 1e-3  # part of the accelerations asked for that no solution of the rows leaves open
PARTED = 1e-6  # part of a rate or second derivative by which laws of one coordinate differ that disagree
PARTS = ("value", "rate", "second derivative")
GROWING = 1.2  # times by which a derivative without bound grows where what separates from the instant is a hundredth
SHARP = 10.0  # a law that changes this many times more than its own slope says has jumped


def reason(
    a: Assembly, base: Assembly, clock: ex.Clock, kept: bool = True, method: str = ""
) -> tuple[str, Exception | None]:
    """What stopped the integration, and the exception that a user's function raised, if one did.

    Parameters
    ----------
    a : Assembly
        Its scratch is as the compiled loop has left it.
    base : Assembly
        The mechanism in absolute coordinates, where every joint and driver has rows.
    clock : Clock
        State of the integration.
    kept : bool
        Whether there is a result up to then.
    method : str
        By which it was integrated.
    """
    name = a.compiled.structure.model.name
    t = float(clock.real.t)
    after = f". The motion up to t = {t:.6g} s is kept in the error's result" if kept else ""
    if clock.count.status == ex.TOO_MANY:
        return f"{name!r}: {_too_many(a, clock)}{rounded(clock)}{after}", None
    stack = a.compiled.work.stack
    found = fault(stack, a.compiled.structure.functions) or a.compiled.structure.missed(stack)
    if found is not None:
        return f"{name!r}: just after t = {t:.6g} s, {found.message}{after}", found.exception
    text = of_drivers(a.compiled, t, float(clock.real.largest)) or _ended(a, clock) or _not_finite(a, clock, method)
    if not text and (text := _jammed(a, clock)):
        return f"{name!r}: {text}{after}", Unresolved(text, t=t)
    text = text or boundless(a, clock, _component) or _broken(a, clock) or escaping(a, clock, _component)
    text = text or _locked(a, base, clock) or _rivals(a, clock) or _stuck(a, clock)
    return f"{name!r}: {text}{after}", None


def remarks(a: Assembly, clock: ex.Clock) -> tuple[str, ...]:
    """What went wrong on the way and was overcome, and where rounding was the limit, for the health report."""
    return tuple(text for text in (_overcome(a), excess(clock), far_off(a, clock)) if text)


def _overcome(a: Assembly) -> str:
    functions = a.compiled.structure.functions
    found = fault(a.compiled.array("stack"), functions, overcome=True) if functions else None
    if found is None:
        return ""
    return (
        f"in a step that was then taken again, shorter, {found.message}. The motion kept does without it; if the "
        f"function is at fault, mend it"
    )


def of_drivers(c: Compiled, t: float, span: float) -> str:
    """A driver whose law is not finite, jumps, or has a derivative without bound, about the time t; else nothing.

    ``span`` is the largest time [s], by which times are told apart.
    """
    S, W = c.values.system, c.work
    stack = np.zeros_like(W.stack)
    for driver, law, wrapped in _driving(c):
        with np.errstate(all="ignore"):
            ahead, behind = (
                [evaluate_jet(S.code, S.const, law, stack, t + way * d * span, W.sensed, BY_TIME) for d in AHEAD]
                for way in (1.0, -1.0)
            )
        problem = _no_number(ahead) or _jump(behind[0], ahead[0], NEAR * span, wrapped)
        problem = problem or _unbounded(ahead, "after") or _unbounded(behind, "before")
        if problem:
            return f"{driver.title} cannot be followed beyond t = {t:.6g} s: its law {problem}{_texts(driver)}"
    return ""


def no_solution(c: Compiled, t: float, span: float) -> str:
    """Why the equations of motion have no solution at the state evaluated last; ``span`` as above."""
    stack = c.work.stack
    found = fault(stack, c.structure.functions) or c.structure.missed(stack)
    text = found.message if found else of_drivers(c, t, span) or broken_force(c, t) or _broken_rate(c, t)
    if text:
        return text
    if c.work.counts.status == motion.JAMMED:
        force = c.structure.forces[int(c.work.counts.guilty_row)]
        return f"{force.title} jams there: it grows with the load that it makes"
    return "the position is singular: constraints depend on one another, or a freedom moves no inertia"


def _broken(a: Assembly, clock: ex.Clock) -> str:
    """A force whose formula ends where the motion stopped; else nothing."""
    t = float(clock.real.t)
    force = broken_force(a.compiled, t)
    return f"at t = {t:.6g} s, {force}" if force else ""


def _driving(c: Compiled) -> list[tuple[Any, int, bool]]:
    """Drivers, where the law of each begins, and whether whole turns count for nothing."""
    s, S = c.structure, c.values.system
    laws: list[tuple[Any, int, bool]] = [
        (row.element, int(S.rows.law[k]), bool(S.rows.wrapped[k]))
        for k, row in enumerate(s.rows)
        if isinstance(row.element, Driver)
    ]
    return laws + [
        (s.model[name], int(S.tree.law[b]), bool(S.tree.joint[b] == REVOLUTE)) for name, b in s.prescribed.items()
    ]


def _rivals(a: Assembly, clock: ex.Clock) -> str:
    """Two drivers of one coordinate whose laws part where the motion stopped; else nothing."""
    S, W, t = a.compiled.values.system, a.compiled.work, float(clock.real.t)
    stack = np.zeros_like(W.stack)
    first: dict[str, tuple[Any, tuple]] = {}
    for driver, law, _ in _driving(a.compiled):
        jet = evaluate_jet(S.code, S.const, law, stack, t, W.sensed, BY_TIME)
        other, before = first.setdefault(driver.coordinate, (driver, jet))
        for what, x, y in zip(PARTS[:0:-1], before[:0:-1], jet[:0:-1], strict=True):
            if abs(x - y) > PARTED * max(abs(x), abs(y)):
                return (
                    f"{other.title} and {driver.title} both move {driver.coordinate} and disagree from "
                    f"t = {t:.6g} s on: the {what} of their laws there is {x:.6g} and {y:.6g}. Leave out one, or make "
                    f"their laws agree"
                )
    return ""


def _no_number(after: list[tuple]) -> str:
    """What is wrong with a law that has these values and derivatives soon after, if they are not finite."""
    for jet in after:
        for what, x in zip(PARTS, jet, strict=True):
            if not math.isfinite(x):
                return f"has the {what} {x:g} just after. Give a law that is finite and smooth over the whole time"
    return ""


def _unbounded(near: list[tuple], when: str) -> str:
    """What is wrong with a law that has these values and derivatives at times ever farther from one instant."""
    for what, *sizes in zip(PARTS[1:], *(np.abs(jet[1:]) for jet in near), strict=True):
        if all(x > GROWING * y for x, y in pairwise(sizes)):
            return (
                f"has a {what} that grows without bound just {when}, which asks for an infinite "
                f"{'velocity' if what == PARTS[1] else 'acceleration'}. Give a law with finite derivatives (a power "
                f"of what becomes zero: an exponent of 2 or more), or step5, which goes over smoothly"
            )
    return ""


def _jump(before: tuple, after: tuple, step: float, wrapped: bool) -> str:
    """What is wrong with a law whose value and two derivatives are these just before and just after."""
    if not all(map(math.isfinite, before)):
        return ""
    for k, remedy in ((0, "step5(t, t0, 0, t1, 1) goes over smoothly"), (1, "step5 or a cubic Table goes smoothly")):
        change = after[k] - before[k]
        if wrapped and k == 0:
            change = math.atan2(math.sin(change), math.cos(change))
        slope = max(abs(before[k + 1]), abs(after[k + 1]))
        if abs(change) > SHARP * step * slope + 1e-7 * (abs(before[k]) + abs(after[k])) + 1e-12:
            return (
                f"jumps in its {PARTS[k]}, from {before[k]:.6g} to {after[k]:.6g}, which asks for an infinite force; "
                f"{remedy}"
            )
    return ""


def _not_finite(a: Assembly, clock: ex.Clock, method: str) -> str:
    if clock.count.status != ex.NOT_FINITE and a.compiled.work.counts.status != motion.NOT_FINITE:
        return ""
    t = float(clock.real.t)
    span = float(clock.real.largest)
    if text := too_long(a, clock, method):
        return f"at t = {t:.6g} s the motion is not finite any more: {text}"
    if text := boundless(a, clock, _component):
        return text
    if text := undefined_row(a.compiled):
        return f"the equations of motion are not finite just after t = {t:.6g} s: {text}"
    times = [t + d * span for d in (0.0, *AHEAD)]
    broken = (text for at in times for find in (broken_force, _broken_rate) if (text := find(a.compiled, at)))
    if text := next(broken, "") or _broken_ahead(a, clock):
        return f"the equations of motion are not finite just after t = {t:.6g} s: {text}"
    wrong = ~np.isfinite(np.r_[clock.K, clock.y]).all(axis=0)
    if not wrong.any() and (corners := _held_on(a)):
        return (
            f"just after t = {t:.6g} s nothing was found that holds the motion on the corner of the "
            f"{' and the '.join(corners)}, or lets it go. Make that law smooth there: max(-1, min(1, x / width)) for "
            f"sign(x)"
        )
    return (
        f"the equations of motion are not finite just after t = {t:.6g} s, first at "
        f"{_component(a, int(np.argmax(wrong)))}. Look for a law that divides by zero or leaves its range"
    )


def _ended(a: Assembly, clock: ex.Clock) -> str:
    """A curve at whose end its follower has come; else nothing."""
    s, numbers = a.compiled.structure, a.compiled.values.numbers
    for joint in s.model.joints:
        at = s.state_at.get(f"{joint.name}.place")
        if at is None or not math.isfinite(place := float(clock.y[0][s.nq + s.nv + at])):
            continue
        if text := joint.end_message(numbers[joint.name], place):  # type: ignore[attr-defined]
            return f"at t = {float(clock.real.t):.6g} s {text}"
    return ""


def _held_on(a: Assembly) -> list[str]:
    """Laws on whose corners the motion is held."""
    mode = a.compiled.work.modes.mode
    specs = enumerate(a.compiled.structure.switches)
    return [x.switch.label for k, x in specs if x.switch.kind == BRANCH and mode[k] != OFF]


def broken_force(c: Compiled, t: float) -> str:
    """The force that is no number at the kinematics that the compiled loop has left, and why; else nothing.

    Where limits of a controller cross it is that.
    """
    if text := crossed(c, t):
        return text
    s, S, W = c.structure, c.values.system, c.work
    stack = np.zeros_like(W.stack)
    forces: list[Any] = list(s.forces)
    with np.errstate(all="ignore"):
        for k, e in enumerate(forces):
            if isinstance(e, Touch):
                if not math.isfinite(W.sensed[LOAD, S.forces.load[k]]):
                    return f"what {e.title} presses with is no number"
                continue
            F, M, par = load(W.FK, S.forces.F[k]), load(W.FK, S.forces.M[k]), wide(S.force_parameters, k)
            x, y = inputs_of(c, k)
            if not math.isfinite(x) or not math.isfinite(y):
                return f"what {e.title} measures is no number. {e.fails}"
            laws = [
                float(evaluate(S.code, S.const, at, stack, (t, x, y), W.sensed)) if at >= 0 else 0.0
                for at in S.forces.laws[k].tolist()
            ]
            if not np.isfinite(laws).all():
                given = (
                    "".join(f", {n} = {v:.6g}" for n, v in zip(e.outputs, (x, y), strict=False)) if e.outputs else ""
                )
                part = undefined_in(c, e, t, (float(x), float(y)))
                return (
                    f"the law of {e.title} gives {laws} for t = {t:.6g}{given}"
                    f"{f', as {part}' if part else ''}. Look for a division by zero or a range that it leaves"
                    f"{_texts(e)}"
                )
            pressed = W.sensed[LOAD, S.forces.load[k]] if S.forces.load[k] >= 0 else 0.0
            out = (
                e.effort(par, x, y, laws, pressed)
                if isinstance(e, CoordinateForce)
                else np.ravel(e.wrench(par, F, M, tuple(laws), (x, y)))
            )
            if not np.isfinite(out).all():
                return f"the force of {e.title} is no number. {e.fails}"
    return ""


def _broken_rate(c: Compiled, t: float) -> str:
    """The controller whose state has no finite rate for what is measured as the compiled loop has left it."""
    for x in c.structure.controls:
        if part := undefined_in(c, x.controller, t):
            law = brief(written(x.law.tree))
            return f"the rate of {x.name!r} of {x.controller.title}, {law}, has no finite value, as {part}"
    return ""


def _broken_ahead(a: Assembly, clock: ex.Clock) -> str:
    """The force or controller without a finite value where the motion would be by its present rates."""
    c, t, y, rates = a.compiled, float(clock.real.t), clock.y[ex.NOW], clock.K[0]
    if not np.isfinite(y).all() or not np.isfinite(rates).all():
        return ""
    s, z = c.structure, c.z
    for d in (clock.real.h, *(part * clock.real.largest for part in AHEAD)):
        x = y + d * rates
        c.z = x[s.nq + s.nv :].copy()
        with np.errstate(all="ignore"):
            c.at(t + d, x[: s.nq].copy(), x[s.nq : s.nq + s.nv].copy(), MOTION)
        if text := broken_force(c, t + d) or _broken_rate(c, t + d):
            break
    c.z = z
    return text


def _texts(e: Element) -> str:
    """What the laws of a force are as given, the beginning and end of long ones."""
    given = {name: getattr(e, name) for name in ("law",) if isinstance(e, Driver)}
    given |= {name: getattr(e, name) for name in fields_with(e.__class__, LawOf)}
    texts = [f"{name} = {brief(x)}" for name, x in given.items() if isinstance(x, str)]
    return f", in {'; '.join(texts)}" if texts else ""


def _locked(a: Assembly, base: Assembly, clock: ex.Clock) -> str:
    """The elements for whose rows there are no accelerations where the motion stopped, if so."""
    t, y, own, c = float(clock.real.t), clock.y[0], a.compiled, base.compiled
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
    gap, _, asked = missed(c, v, x, c.sizes)
    if not gap.max() > LOCKED * asked:
        return ""
    names = list(dict.fromkeys(c.structure.rows[k].element.name for k in np.argsort(-gap) if gap[k] > 1e-3 * gap.max()))
    why = story(c, t, q, v, c.work.rows.gamma.copy(), "/s^2") or (
        "in this position they leave no way on for these velocities. The mechanism locks (a driver may ask for more "
        "than its links allow), or it is drawn in a singular position with velocities that it cannot have"
    )
    return f"at t = {t:.6g} s no accelerations fulfil the constraints of {', '.join(names[:8])} together: {why}"


def _jammed(a: Assembly, clock: ex.Clock) -> str:
    W = a.compiled.work
    if W.counts.status != motion.JAMMED:
        return ""
    loads = int((a.compiled.system.forces.load >= 0).sum())
    return jam(a.compiled.structure.forces[int(W.counts.guilty_row)], float(clock.real.t), loads == 1)


def _stuck(a: Assembly, clock: ex.Clock) -> str:
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
    if rounding := rounded(clock):
        return f"the integration cannot go on at {what}{rounding}"
    return (
        f"the integration cannot go on at {what}. The mechanism may lock there (a driver asks for more than its links "
        f"allow), pass a singular position that the tolerance asks to resolve (a looser rtol steps over it), or meet "
        f"a force that changes abruptly"
    )


def _too_many(a: Assembly, clock: ex.Clock) -> str:
    if clock.real.step > 0.0:
        return (
            f"max_steps = {clock.count.limit} steps of {clock.real.step:g} s were taken by "
            f"t = {clock.real.t:.6g} s; give more (max_steps=)"
        )
    if text := too_often(a.compiled, clock, a.t):
        return text
    slowest = _component(a, _pacemaker(clock))
    return (
        f"max_steps = {clock.count.limit} steps were taken by t = {clock.real.t:.6g} s; they are "
        f"{clock.real.h:.3g} s wide by now, for the sake of {slowest}. Give more steps (max_steps=), a larger "
        f"rtol, or less stiffness (friction too is stiff) there"
    )


def _pacemaker(clock: ex.Clock) -> int:
    """The component of the state whose derivative changed most within the last step, by its tolerance."""
    n = clock.count.controlled
    with np.errstate(all="ignore"):
        change = np.ptp(clock.K[:, :n], axis=0) / (clock.real.atol + clock.real.rtol * np.abs(clock.y[0, :n]))
    return int(np.argmax(np.nan_to_num(change)))


def _component(a: Assembly, i: int) -> str:
    """Name of the body or tree joint that a component of the state belongs to."""
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
