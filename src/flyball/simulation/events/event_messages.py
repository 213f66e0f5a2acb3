"""Messages of an instant: records of impacts and mode changes, and errors where no consistent solution exists."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from ...constraints.switches.switch_kind import BY_RATE, DISC, FROZEN, G_LAW, G_LOWER, G_SHARED, G_UPPER, OFF, ONE_SIDED
from ...errors import ModelError
from ...model.body import Driver
from ...model.contact_point import Touch
from ...model.joint import Joint
from ...numerics.complementarity.dense_problem import FRICTION_LINE, HOLD_IMPOSSIBLE, SLIDING
from ...results.events import EventRecord
from ...results.reactions import EventImpulses
from ..diagnosis import InitialOverlap, UnresolvedInstant, body_names, jam_message
from .context import value_in_words
from .impacts import VelocityJump
from .instant_problem import InstantProblem, ProblemRow
from .mode_selection import ModeDecision, element_titles


def rows_in_words(n: InstantProblem, parts: list[ProblemRow]) -> str:
    """Name the elements of rows, with their roles."""
    seen = dict.fromkeys((n.here.structure.switches[p.switch].element.title, n.kinds[p.switch].role) for p in parts)
    return " and ".join(f"{title}, which {role}" for title, role in seen)


def guard_titles(n: InstantProblem, fired: Iterable[int]) -> list[str]:
    """Return the titles of guards: events, elements with active rows, elements whose laws have corners; each once."""
    out = []
    for g in fired:
        kind, s = int(n.S.guards.kind[g]), int(n.S.guards.of[g])
        if kind == G_LAW:
            out.append(n.here.structure.events[int(g)].title)
            continue
        for k in np.flatnonzero(n.W.modes.shared).tolist() if kind == G_SHARED else [s]:
            e = n.here.structure.switches[k].element
            out.append(n.name(k) if e.category == "events" else e.title)
    return list(dict.fromkeys(out))


def switch_quantity(n: InstantProblem, s: int) -> str:
    """Return the quantity of a switch as an expression of coordinates."""
    x = n.here.structure.switches[s]
    if not x.switch.along:
        return "its length"
    if not x.switch.summed:
        return x.switch.along[0]
    weights = x.element.switch_weights(n.here.c.values.numbers[x.element.name], x.switch.label)
    terms = [f"{w:+.6g}*{c}".replace("1*", "", abs(w) == 1.0) for w, c in zip(weights, x.switch.along, strict=True)]
    return " ".join(f"{y[0]} {y[1:]}" for y in terms).removeprefix("+ ")


def start_beyond_bound(n: InstantProblem, s: int) -> ModelError:
    """Return the error for a motion that starts past a stop, or against a freewheel."""
    x = n.here.structure.switches[s]
    e, model = x.element, n.here.structure.model
    metric = not x.switch.along or model.unit(x.switch.along[0], e) == "m"
    unit, what = "m" if metric else "rad", switch_quantity(n, s)
    if isinstance(e, Touch):
        return InitialOverlap(
            f"{e.title}: {body_names(e)} overlap at the start by {n.W.modes.lower[s] - n.x[s]:.3g} m; move one "
            "of them, "
            f"or give method='impulse', which puts them side by side"
        )
    remedy = "change the start or the limit"
    if n.kinds[s].bounded or {G_LOWER, G_UPPER}.intersection(n.kinds[s].guards):
        lower, upper = n.W.modes.lower[s], n.W.modes.upper[s]
        if not np.isfinite(upper):
            rule = f"at least {value_in_words(lower, unit)}"
        elif not np.isfinite(lower):
            rule = f"at most {value_in_words(upper, unit)}"
        else:
            rule = f"within {value_in_words(lower, unit)} and {value_in_words(upper, unit)}"
        said = f"{what} is {value_in_words(n.x[s], unit)} and must be {rule}"
    else:
        rule = "not be negative" if n.kinds[s].forces == ONE_SIDED else "be zero"
        said = f"the rate of {what} is {n.rate[s]:.6g} {unit}/s and must {rule}"
    if not type(n.kinds[s]).__module__.startswith("flyball."):
        remedy += ", or give its kind a guard of its own, if its quantity may pass the bound"
    return ModelError(f"{e.title}: the motion starts beyond it: {said}; {remedy}")


def passed_bound(n: InstantProblem, s: int, past: float) -> UnresolvedInstant:
    """Return the error for an open stop or contact past its bound, which no rigid-body motion reaches."""
    e = n.here.structure.switches[s].element
    what = f"{body_names(e)} are in each other" if isinstance(e, Touch) else f"{switch_quantity(n, s)} is beyond it"
    return UnresolvedInstant(
        f"at t = {n.here.t:.9g} s {e.title}: {what} by {past:.3g} {n.units[s]}: where they met was not seen. Follow "
        f"it more closely (max_step=, a smaller rtol)",
        t=n.here.t,
    )


def endless_events(n: InstantProblem, recent: Iterable[Sequence[int]], many: int, within: float) -> UnresolvedInstant:
    """Return the error for endless events; ``recent``: the guards that triggered at the last ones."""
    names = guard_titles(n, (g for fired in recent for g in fired))
    return UnresolvedInstant(
        f"at t = {n.here.t:.9g} s events follow each other without end ({many} within {within:.2g} s): "
        f"{', '.join(names)}",
        t=n.here.t,
    )


def accumulating_events(n: InstantProblem, guard: int, many: int, end: float) -> UnresolvedInstant:
    """Return the error for events of one guard, ``many`` so far, that accumulate at the time ``end``."""
    return UnresolvedInstant(
        f"at t = {n.here.t:.9g} s {guard_titles(n, [guard])[0]} has happened {many} times at decreasing intervals, "
        f"without end before t = {end:.6g} s",
        t=n.here.t,
    )


def no_admissible_impulses(n: InstantProblem, parts: list[ProblemRow]) -> UnresolvedInstant:
    """Return the error for impulse equations without solution."""
    return UnresolvedInstant(
        f"at t = {n.here.t:.9g} s no impulses satisfy all constraints on the velocities at once: those of "
        f"{rows_in_words(n, parts)}. If a driver moves a coordinate that a stop or a lock fixes, make one of them "
        "compliant, or leave it out",
        t=n.here.t,
    )


def no_admissible_forces(n: InstantProblem, found: ModeDecision) -> UnresolvedInstant:
    """Return the error for force equations without solution."""
    sliding = [p for p in found.parts if p.rule in (SLIDING, FRICTION_LINE)]
    jammed = [n.here.structure.switches[p.switch].element for p in sliding]
    if found.ended != HOLD_IMPOSSIBLE and len(jammed) == 1 and hasattr(jammed[0], "joint"):
        return UnresolvedInstant(jam_message(jammed[0], n.here.t, True), t=n.here.t)
    if found.ended == HOLD_IMPOSSIBLE or not sliding:
        why = "their constraints contradict each other: make one of them compliant, or leave it out"
    else:
        why = (
            "no loads were found that are consistent with the friction of "
            f"{' and '.join(element_titles(n, sliding))}. Either there are none, since friction increases its own "
            "load too much (a jam, or Painleve's paradox): with less friction, or an elastic stop or joint, there is "
            "a solution. Or the search did not find them"
        )
    return UnresolvedInstant(
        f"at t = {n.here.t:.9g} s no forces satisfy all conditions at once: those of {rows_in_words(n, found.parts)}; "
        f"{why}",
        t=n.here.t,
    )


def endless_instant(t: float, names: list[str], rounds: int) -> UnresolvedInstant:
    """Return the error for an instant that cannot be resolved in a finite number of rounds."""
    return UnresolvedInstant(
        f"at t = {t:.9g} s events follow each other without end ({rounds} times at one instant): "
        f"{', '.join(dict.fromkeys(names))}; each reverses the other",
        t=t,
    )


ENERGY_ROUNDING = 1e-14  # part of the motion's or the impact's energy below which a loss is rounding


def transition_words(n: InstantProblem, s: int, held: bool) -> tuple[str, str]:
    """Return the kind and description of what switch s did."""
    return n.kinds[s].closing if held else n.kinds[s].opening


def record_jump(n: InstantProblem, jumped: VelocityJump, before: np.ndarray) -> None:
    """Record a jump of velocities."""
    if not (jumped.closing or jumped.external_impulses or jumped.given or jumped.jammed):
        return
    done: list[str] = []
    impulses: dict[str, float] = {}
    for s, (u, after) in jumped.closing.items():
        unit = n.units[s]
        goes = "stays" if s in jumped.at_rest else f"leaves at {abs(after):.6g} {unit}/s"
        done.append(
            f"{n.name(s)} closes at {abs(u):.6g} {unit}/s, {goes}" if not n.kinds[s].commanded else f"{n.name(s)} locks"
        )
    for s, x in jumped.impulse.items():  # those of joints, drivers and contact points are taken from their rows
        if x != 0.0 and not isinstance(n.here.structure.switches[s].element, (Driver, Joint, Touch)):
            impulses[n.name(s)] = impulses.get(n.name(s), 0.0) + x
    if jumped.jammed:
        done.append("stops without a collision: no accelerations go with its friction (Painleve's paradox)")
    names = ", ".join(dict.fromkeys(n.name(s) for s in jumped.closing or jumped.jammed)) or "start"
    kind = "jam" if jumped.jammed else "impact" if jumped.closing else "kick"
    append_record(n, names, kind, tuple(done), jumped, impulses, before)


def record_mode_changes(
    n: InstantProblem, old: tuple[np.ndarray, np.ndarray], before: np.ndarray, hits: dict[int, bool]
) -> None:
    """Record mode changes (closed, sliding, released), one record per kind.

    Parameters
    ----------
    n : InstantProblem
    old : tuple of ndarray
        Modes and switch states before.
    before : ndarray
        The state before.
    hits : dict
        Switches whose impact is recorded already, and whether they stay closed.
    """
    modes, ways = old
    told: dict[str, list[tuple[int, str]]] = {}
    for s in range(len(n.kinds)):
        was, now = modes[s] != OFF, n.W.modes.mode[s] != OFF
        over = n.here.bounces[s].over if s in n.here.bounces else np.nan
        if now and not np.isnan(over):
            count = n.here.bounces.pop(s).count
            told.setdefault("rest", []).append((s, f"came to rest after {count} bounces"))
            n.over = float(np.fmax(n.over, over))
        elif n.kinds[s].elastic and ways[s] != n.ways()[s] != 0.0 and not ways[s] == 0.0 < n.ways()[s] == FROZEN:
            kind, said = transition_words(n, s, n.ways()[s] != FROZEN)
            told.setdefault(kind, []).append((s, said))
        elif was != now and s not in hits and not (n.kinds[s].forces == DISC and _gap_is_open(n, s)):
            kind, said = transition_words(n, s, now)
            if kind:
                told.setdefault(kind, []).append((s, said))
        elif (
            not was and not now and _slides_either_way(n, s) and ways[s] * n.ways()[s] < 0.0 and n.ways()[s] != BY_RATE
        ):
            told.setdefault("turn", []).append((s, "slides in the other direction"))
    for kind, all_of in told.items():
        names = ", ".join(dict.fromkeys(n.name(s) for s, _ in all_of))
        append_record(n, names, kind, tuple(dict.fromkeys(said for _, said in all_of)), None, {}, before)


def record_initial_breaks(n: InstantProblem) -> None:
    """Record what cannot hold where the motion starts, and stays open."""
    for s in n.of(lambda kind: kind.permanent):
        if n.W.modes.mode[s] == OFF:
            kind, said = n.kinds[s].opening
            append_record(n, n.name(s), kind, (said,), None, {}, n.here.y)


def _gap_is_open(n: InstantProblem, s: int) -> bool:
    """Return whether the gap of a slip is open: then it does not slide either."""
    return bool(n.W.modes.mode[n.S.switches.other[s]] == OFF)


def _slides_either_way(n: InstantProblem, s: int) -> bool:
    """Return whether a switch slides in one of two directions: not a tangent of a spatial contact point."""
    return n.kinds[s].kinetic and bool(n.S.switches.partner[s] < 0)


def append_record(
    n: InstantProblem,
    names: str,
    kind: str,
    done: tuple[str, ...],
    jumped: VelocityJump | None,
    impulses: dict,
    before: np.ndarray,
) -> None:
    """Append an event record."""
    t = n.over if kind == "rest" and not np.isnan(n.over) else n.here.t
    size = max(jumped.passed, min(n.energy, n.here.clock.real.energy_size)) if jumped else 0.0
    lost = jumped.lost if jumped and abs(jumped.lost) > ENERGY_ROUNDING * size else 0.0
    known = EventImpulses(impulses, jumped.rows, jumped.external_impulses) if jumped else impulses
    n.here.records.append(EventRecord(t, names, kind, done, lost, known, before.copy(), n.here.y.copy()))
