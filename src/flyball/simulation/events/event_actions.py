"""Actions of the model's events (set, lock, release, impulse, note, stop), and data carried over to the next run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import takewhile
from typing import Any, NamedTuple

import numpy as np

from ...constraints.switches.switch_kind import HELD
from ...engine.kinematics import store_ground_frames, twist_column
from ...errors import FlyballError, SimulationError
from ...model.body import Body, Frame
from ...model.contact_point import Touch
from ...model.element import LawOf, si_numbers
from ...model.event import Action, Event, Impulse, Lock, Note, Release, Set, Stop, comparison_sides, component_list
from ...model.event_validation import coordinate_of, lock_target
from ...model.geometry import vector
from ...results.events import EventRecord
from ...results.reactions import AppliedImpulse, sum_impulses
from ...tables.contact_places import contact_places
from ...tables.element_numbers import names_in
from ...tables.law_inputs import forces_in_events
from ...tables.structure_definition import Structure
from ...tables.table_definitions import assign, map_arrays
from ...tables.values import Values, values
from .context import (
    EventContext,
    lock,
    release,
    restore_locks,
    switch_scales,
    switch_units,
    violated_bounds,
    violated_rule,
)
from .impacts import BounceSeries


def continuation_data(here: EventContext) -> dict[str, Any]:
    """Return the data of events for the next run as plain data by names: counts, last values, recent bounces and
    passages.
    """
    names = _switch_names(here) if here.bounces or here.corner_passages else []
    bounces = [[*names[s], b.count, b.last, b.before] for s, b in here.bounces.items()]
    swings = [[*names[s], *past] for s, past in here.corner_passages.items()]
    every = {"counts": dict(here.counts), "true": list(here.true), "bounces": bounces, "swings": swings}
    every |= {"zero": dict(here.zero), "sides": dict(here.final_signs)}
    return {k: x for k, x in every.items() if x}


def restore_continuation_data(here: EventContext, before: Mapping[str, Any]) -> None:
    """Restore the event data of an earlier run; names that the mechanism no longer has are left out."""
    names = {e.name for e in here.structure.model.events}
    known = {name: s for s, name in enumerate(_switch_names(here))}
    here.counts = {k: int(n) for k, n in before.get("counts", {}).items() if k in names}
    here.zero = {k: float(x) for k, x in before.get("zero", {}).items() if k in names}
    here.final_signs = {k: float(x) for k, x in before.get("sides", {}).items() if k in names}
    here.true = [k for k in before.get("true", ()) if k in names]
    for element, label, which, count, last, previous in before.get("bounces", ()):
        if (s := known.get((element, label, which))) is not None:
            here.bounces[s] = BounceSeries(int(count), float(last), float(previous))
    for element, label, which, *past in before.get("swings", ()):
        if (s := known.get((element, label, which))) is not None:
            here.corner_passages[s] = [float(t) for t in past]


def _switch_names(here: EventContext) -> list[tuple[str, str, int]]:
    """Return the names of switches, used in files too: element, label, number among equal ones."""
    seen: Counter[tuple[str, str]] = Counter()
    out = []
    for spec in here.structure.switches:
        name = spec.element.name, spec.switch.label
        out.append((*name, seen[name]))
        seen[name] += 1
    return out


PLACE_TOLERANCE = 1e-9  # displacement that counts as rounding, relative to the mechanism's length or a radian


def set_parameters(here: EventContext, new: Mapping[str, float], who: str) -> None:
    """Change parameter values during the motion.

    Parameters
    ----------
    here : EventContext
    new : mapping
        Parameter -> value in SI units.
    who : str
        The actions that set them, for messages.

    Raises
    ------
    SimulationError
        If a value is invalid, or something would move instantaneously.
    """
    c = here.c
    told = {**c.parameters, **new}
    old = c.values
    try:
        env = here.structure.model.environment(told)
        for e in here.structure.model.elements():
            if not set(names_in(e)).isdisjoint(_changed_parameters(old.env, env)):
                here.structure.model.validate(e, env)
        found = values(here.structure, told)
    except FlyballError as error:
        raise SimulationError(f"at t = {here.t:.9g} s {who}: {error}", t=here.t) from None
    _refuse_moved_contacts(here, found, who)
    before, bounds, kept = _body_places(here, old), map_arrays(lambda _, x: x.copy(), c.work.modes), c.parameters
    _use_values(here, found, told)
    try:
        _refuse_moved_bodies(here, who, before, _body_places(here, found))
        _move_bounds(here, old)
        _refuse_violated_bounds(here, who)
    except SimulationError:
        _use_values(here, old, kept)
        assign(c.work.modes, bounds)
        raise
    here.fresh = True


def _use_values(here: EventContext, x: Values, parameters: Mapping[str, float]) -> None:
    """Use these values from now on."""
    c = here.c
    c.values, c.system, c.parameters = x, x.system, dict(parameters)
    store_ground_frames(c.system, c.work)


def _move_bounds(here: EventContext, old: Values) -> None:
    """Set the bounds of stops, and the teeth, to their new values."""
    S, W = here.c.system, here.c.work
    now, then = S.switch_numbers, old.system.switch_numbers
    moved = (now.lower != then.lower) | (now.upper != then.upper)
    for s in np.flatnonzero((W.modes.released == 0.0) & moved).tolist():
        if here.structure.switches[s].switch.kind.bounded:
            W.modes.lower[s], W.modes.upper[s] = now.lower[s], now.upper[s]


def _refuse_moved_contacts(here: EventContext, new: Values, who: str) -> None:
    """Refuse changes of contact shapes: contact points are set up when a motion starts."""
    model, had = here.structure.model, [e for e in here.structure.model.forces if isinstance(e, Touch)]
    if not had:
        return
    has = contact_places(model, new.given).touches
    moved = np.array(
        [_contact_distance(a, b) for a, b in zip(had, has, strict=False)] if len(had) == len(has) else [np.inf]
    )
    if not moved.max() <= PLACE_TOLERANCE * here.c.values.length:
        raise SimulationError(
            f"at t = {here.t:.9g} s {who} would move the contact of {had[int(moved.argmax())].title} instantaneously, "
            f"by {moved.max():.3g} m: shapes of contacts keep their sizes and places while they move",
            t=here.t,
        )
    for a, b in zip(had, has, strict=True):
        if (a.friction, a.restitution) != (b.friction, b.restitution):
            raise SimulationError(
                f"at t = {here.t:.9g} s {who} would change friction or restitution of {a.title}, which are constant "
                "during an event-driven motion; end one motion there (fb.Stop), and continue it with the other "
                "value: simulate(start=run, parameters=...)",
                t=here.t,
            )


def _contact_distance(a: Touch, b: Touch) -> float:
    """Return the largest difference between the numbers of two contact points."""
    pairs = [(a.gap, b.gap), *zip(a.slips, b.slips, strict=False), *zip(a.frames, b.frames, strict=True)]
    return max((abs(x - y) for one, other in pairs for x, y in zip(one, other, strict=True)), default=0.0)


def _refuse_violated_bounds(here: EventContext, who: str) -> None:
    """Refuse values with which a stop, a rope or a tooth would be violated."""
    s, W = here.structure, here.c.work
    past = violated_bounds(here, PLACE_TOLERANCE * switch_scales(s, here.c.values.length))
    if past:
        k = max(past, key=past.__getitem__)
        spec, unit = s.switches[k], switch_units(s)[k]
        bounds, x = (W.modes.lower[k], W.modes.upper[k]), W.sensed.value[spec.measured]
        said = spec.switch.kind.misplaced or violated_rule(spec, float(x), bounds, unit)
        raise SimulationError(
            f"at t = {here.t:.9g} s {who} would put {spec.element.title} instantaneously, by {past[k]:.3g} {unit}: "
            f"{said}. Set it where the coordinate is within it, give it stiffness=..., or let a Driver move what it "
            "is fixed to",
            t=here.t,
        )


def _changed_parameters(old: Mapping[str, float], new: Mapping[str, float]) -> set[str]:
    return {k for k, x in new.items() if old[k] != x}


class BodyPlaces(NamedTuple):
    """Poses and velocities of every body's reference frame at the present state; values and rates of rows and
    drivers.
    """

    at: dict[str, np.ndarray]
    moving: dict[str, np.ndarray]
    value: np.ndarray
    rate: np.ndarray


def _body_places(here: EventContext, x: Values) -> BodyPlaces:
    """Evaluate the body poses at the present state with these values."""
    c, s = here.c, here.structure
    here.evaluate()
    K, out, moving = c.work.bodies, {}, {}
    for name, b in s.place.items():
        if b >= 0:
            p, R = K.position[b], K.rotation[b].reshape(3, 3)
            out[name] = np.r_[p - R @ x.bodies[name].com, R.ravel(), p]
            moving[name] = np.r_[K.angular_velocity[b], K.velocity[b]]
    return BodyPlaces(out, moving, c.work.rows.value.copy(), c.work.rows.nu.copy())


def _refuse_moved_bodies(here: EventContext, who: str, before: BodyPlaces, after: BodyPlaces) -> None:
    """Refuse an instantaneous displacement of a body or row, or a jump of prescribed velocities."""
    size = here.c.values.length
    titles = [f"{r.element.title} ({r.label})" for r in here.structure.rows]
    fast = {f"body {k!r}": np.abs(p - before.moving[k]).max() for k, p in after.moving.items()}
    fast |= {title: abs(a - b) for title, a, b in zip(titles, after.rate, before.rate, strict=True)}
    quick = max([1e-3 * size, *(np.abs(x).max() for x in before.moving.values())])
    off = {f"body {k!r}": np.abs(p - before.at[k]).max() / size for k, p in after.at.items()}
    off |= {title: abs(a - b) / size for title, a, b in zip(titles, after.value, before.value, strict=True)}
    worst = max(off, key=lambda name: off[name] if np.isfinite(off[name]) else np.inf)
    if not off[worst] <= PLACE_TOLERANCE:
        raise SimulationError(
            f"at t = {here.t:.9g} s {who} would put {worst} instantaneously, by {off[worst] * size:.3g}: setting a "
            "parameter may change forces, laws and masses, but not positions. Let a Driver move it",
            t=here.t,
        )
    worst = max(fast, key=lambda name: fast[name] if np.isfinite(fast[name]) else np.inf)
    if not fast[worst] <= PLACE_TOLERANCE * quick:
        raise SimulationError(
            f"at t = {here.t:.9g} s {who} would change the velocity of {worst} by {fast[worst]:.3g} in no time, since "
            f"a driver's law jumps: let the law rise smoothly, as by step(t, ...)",
            t=here.t,
        )


SIMULTANEOUS_ULPS = 64  # units in the last place of a time within which events are simultaneous
SIMULTANEOUS_SHARE = 1e-11  # part of a motion's duration within which events are simultaneous
MOST_EXPRESSIONS = 1000  # parsed event expressions in the cache
CLEAR_PASSAGE = 1e-9  # part of an expression's largest value beyond which it has crossed zero by a jump


@dataclass
class EventActions:
    """The actions of events at one instant.

    Attributes
    ----------
    here : EventContext
    events : tuple of Event
        The events that happen.
    words : dict
        Event -> what was done.
    values : dict
        Guard -> value of its event's expression before any action.
    """

    here: EventContext
    events: tuple[Event, ...]
    words: dict[str, list[str]] = field(default_factory=dict)
    values: dict[int, float] = field(default_factory=dict)
    before: np.ndarray = field(default_factory=lambda: np.zeros(0))
    first: int = 0
    tables: Values | None = None  # before

    def record_events(self, labels: Sequence[str] = ()) -> None:
        """Record the events with what was done; jumps that only the events caused (locks, impulses) are included in the
        record.

        ``labels``: names under which jumps caused by events are recorded.
        """
        here = self.here
        if not self.events:
            return
        since, here.records[self.first :] = here.records[self.first :], []
        mine = [
            h
            for h in since
            if h.kind in ("impact", "kick") and set(h.name.split(", ")) <= {*labels, *_lockable_names(here)}
        ]
        cause = next((e for e in self.events if any(isinstance(a, (Lock, Impulse)) for a in e.do)), self.events[0])
        for e in self.events:
            lost = sum(h.lost for h in mine) if e is cause else 0.0
            impulses: Any = {} if e is not cause or not mine else mine[0].impulses
            if e is cause and len(mine) > 1:
                impulses = sum_impulses([h.impulses for h in mine])
            done = tuple(self.words.get(e.name, ()))
            both = None if self.tables is here.c.values else (self.tables, here.c.values)
            here.records.append(
                EventRecord(here.t, e.name, "event", done, lost, impulses, self.before, here.y.copy(), both)
            )
        here.records += [h for h in since if not any(h is x for x in mine)]

    def passed(self) -> np.ndarray:
        """Return the guards of events whose expressions crossed zero by the jump itself, (n,)."""
        return passed_by_jump(self.here, self.values)


def _guards_of_forces(here: EventContext) -> frozenset[int]:
    """Return the guards of events that name forces: these may jump across zero at any event."""
    s = here.structure
    found: frozenset[int] = s.cache.get("events of forces", 0, 1, lambda: _find_guards_of_forces(s))
    return found


def _find_guards_of_forces(s: Structure) -> frozenset[int]:
    named = set(forces_in_events(s.model))
    laws = {g: s.model.law(e.law, e.of, f"when of {e.title}") for g, e in s.events.items()}
    return frozenset(g for g, law in laws.items() if named & law.names)


def _lockable_names(here: EventContext) -> set[str]:
    """Return the names of all that events lock and release."""
    every = here.structure.switches
    return {x.switch.label for x in every if isinstance(x.element, Event)} | {x.element.name for x in every if x.held}


def perform_actions(here: EventContext, fired: Sequence[int]) -> EventActions:
    """Perform the actions of the triggered events: parameters, releases and locks, impulses, end of the motion.

    Velocities do not change here. `EventContext.external_impulse` holds the applied impulse, and the modes hold what is
    locked.

    Parameters
    ----------
    here : EventContext
    fired : sequence of int
        Triggered guards: rows of `System.guards`, those of events among them.

    Raises
    ------
    SimulationError
        If actions contradict one another, or cannot be done; it names the events and the time.
    """
    events = [here.structure.events[int(g)] for g in fired if int(g) in here.structure.events]
    events = [e for e in events if e.times is None or here.counts.get(e.name, 0) < e.times]
    return _perform(here, tuple(events))


def perform_initial_actions(here: EventContext) -> EventActions:
    """Perform the actions of events at the start; lock joints that may be released.

    A continued motion performs none; what was locked or released stays so.
    """
    for k, spec in enumerate(here.structure.switches):
        if spec.held:
            here.c.work.modes.mode[k] = HELD
    if here.start.before is not None:
        restore_locks(here, here.start.before)
        restore_continuation_data(here, here.start.before.carried)
        return EventActions(here, (), before=here.y.copy(), tables=here.c.values)
    # loads are known only after the modes are decided: their earlier values are no reference for a jump
    return _perform(here, tuple(e for e in here.structure.model.events if e.at_start), _guards_of_forces(here))


def _perform(here: EventContext, events: tuple[Event, ...], unknown: frozenset[int] = frozenset()) -> EventActions:
    """Perform the actions of events; ``unknown``: guards whose expressions are not known yet."""
    acts = EventActions(here, events, before=here.y.copy(), first=len(here.records), tables=here.c.values)
    for e in events:
        here.counts[e.name] = here.counts.get(e.name, 0) + 1
    every = [(e, a) for e in events for a in e.do]
    watched = [g for g in here.structure.events if (every or g in _guards_of_forces(here)) and g not in unknown]
    if every or watched:
        here.evaluate()
    for g in watched:
        acts.values[g] = event_expression(here, g)
    if not every:
        return acts
    refuse_contradictions(here, every)
    reckoned = [(e, a, [_evaluated_argument(here, e, a, k, x) for k, x in a.laws()]) for e, a in every]
    for kind, do in ACTION_FUNCTIONS.items():
        if found := [(e, a, x) for e, a, x in reckoned if type(a) is kind]:
            for e, words in do(here, found):
                acts.words.setdefault(e.name, []).append(words)
    return acts


def event_expression(here: EventContext, g: int) -> float:
    """Return the value of an event's expression, by its guard, at the state last evaluated."""
    model, e = here.structure.model, here.structure.events[g]
    law = here.structure.cache.get(
        "law of event", g, MOST_EXPRESSIONS, lambda: model.law(e.law, e.of, f"when of {e.title}")
    )
    return float(law.evaluate(here.names(), model.law_tables()))


def event_expressions(here: EventContext) -> dict[int, float]:
    """Return the values of all event expressions, by guard, at the state of the instant."""
    if here.structure.events:
        here.evaluate()
    return {g: event_expression(here, g) for g in here.structure.events}


def initially_true(here: EventContext) -> list[str]:
    """Return the names of events whose comparisons are true now: they trigger only after they were false.

    For a continued motion the list of its original start is kept: a comparison that is true now may have become true in
    the earlier motion.
    """
    if here.start.before is not None:
        return here.true
    every = here.structure.events
    texts = {g: e.when for g, e in every.items() if isinstance(e.when, str) and e.direction != "falling"}
    values = event_expressions(here) if texts else {}
    return [
        every[g].name for g, text in texts.items() if values[g] > 0.0 and comparison_sides(text, every[g]) is not None
    ]


def events_at_start(here: EventContext) -> set[str]:
    """Return the names of events that happened at the very end of the motion that this one continues."""
    before = here.start.before
    if before is None or not len(before.t):
        return set()
    end, first = before.final[0], float(before.t[0])
    since = end - max(
        SIMULTANEOUS_ULPS * float(np.spacing(max(abs(end), abs(first)))), SIMULTANEOUS_SHARE * (end - first)
    )
    return {h.name for h in takewhile(lambda h: h.t >= since, reversed(before.events)) if h.kind == "event"}


def report_missed_events(here: EventContext) -> None:
    """Add remarks on events that were true at the start and never triggered."""
    for e in here.structure.model.events:
        if e.name in here.true and not here.counts.get(e.name):
            here.doubts.append(
                f"{e.title} never happened: {e.when!r} was true from the start, and the event occurs when it "
                "becomes true"
            )


def passed_by_jump(here: EventContext, before: Mapping[int, float]) -> np.ndarray:
    """Return the guards of events whose expressions crossed zero by a jump, (n,).

    An expression that was zero to rounding, such as that of an event just triggered, does not count, since recomputed
    velocities differ by rounding.
    """
    out = []
    if before:
        here.evaluate()
    for g, was in before.items():
        now, way = event_expression(here, g), here.c.system.guards.direction[g]
        most = max(CLEAR_PASSAGE * max(abs(was), abs(now)), here.nothing.get(g, 0.0))
        rises, falls = was <= -most and now > most, was >= most and now < -most
        if (rises and way >= 0) or (falls and way <= 0):
            out.append(g)
    return np.array(out, np.int64)


def passed_at_jump_time(here: EventContext, before: Mapping[int, float]) -> list[int]:
    """Return the guards of events that crossed zero at a time at which laws jump, except events just triggered."""
    since = here.t - SIMULTANEOUS_ULPS * float(np.spacing(abs(here.t)))
    told = {h.name for h in takewhile(lambda h: h.t >= since, reversed(here.records))}
    return [int(g) for g in passed_by_jump(here, before) if here.structure.events[int(g)].name not in told]


def _evaluated_argument(here: EventContext, e: Event, a: Action, what: str, law: Any) -> float:
    """Return the value of an action's expression at the instant, before any action."""
    model = here.structure.model
    of = LawOf(_unit_of_argument(here, e, a, what), curves=True)
    tables = model.law_tables()
    value = model.law(law, of, f"{what} of {a.title} in {e.title}").evaluate(here.names(), tables)
    if not np.isfinite(value):
        raise SimulationError(
            f"at t = {here.t:.9g} s {what} of {a.title} in {e.title} is {value}: '{law}' has no value there", t=here.t
        )
    return float(value)


def _unit_of_argument(here: EventContext, e: Event, a: Action, what: str) -> str | None:
    """Return the unit of an action's argument; None if it is not prescribed."""
    if not isinstance(a, Impulse):
        return None
    model = here.structure.model
    if not isinstance(model.find(a.on), (Body, Frame)):
        return "N*m*s" if model.unit(coordinate_of(model, e, a), e) == "rad" else "N*s"
    return {"impulse": "N*s", "torque": "N*m*s"}[what]


def refuse_contradictions(here: EventContext, every: Sequence[tuple[Event, Action]]) -> None:
    """Refuse events of one instant that lock and release the same element, or set a parameter twice."""
    if here.settled_at != here.t:
        here.settled_at, here.settled_keys = here.t, {}
    for e, a in every:
        for key in settled_by(here, e, a):
            first, other = here.settled_keys.setdefault(key, (e, a))
            if first is not e and a != other:
                raise SimulationError(
                    f"at t = {here.t:.9g} s actions contradict each other: {other.title} of {first.title} and "
                    f"{a.title} of {e.title}; let one of the events happen later, or once (times=1)",
                    t=here.t,
                )


def settled_by(here: EventContext, e: Event, a: Action) -> tuple[str, ...]:
    """Return the keys of what an action settles at this instant."""
    if isinstance(a, (Lock, Release)):
        return lock_target(here.structure.model, e, a).keys()
    return (f"parameter {a.parameter}",) if isinstance(a, Set) else ()


ActionReports = list[tuple[Event, str]]
EventActionList = Sequence[tuple[Event, Any, list[float]]]


def _do_set(here: EventContext, found: EventActionList) -> ActionReports:
    old = dict(here.c.values.env)
    first = here.structure.nq + here.structure.nv
    place = {x.name: first + k for k, x in enumerate(here.structure.controls)}
    old |= {a.parameter: float(here.y[place[a.parameter]]) for _, a, _ in found if a.parameter in place}
    for _, a, x in found:
        if a.parameter in place:
            here.y[place[a.parameter]] = x[0]
    new = {a.parameter: x[0] for _, a, x in found if a.parameter not in place}
    if new:
        who = " and ".join(f"{a.title} in {e.title}" for e, a, _ in found if a.parameter in new)
        set_parameters(here, new, who)
    return [(e, f"{a.parameter} = {x[0]:g}, was {old[a.parameter]:g}") for e, a, x in found]


def _do_release(here: EventContext, found: EventActionList) -> ActionReports:
    return [(e, release(here, e, a)) for e, a, _ in found]


def _do_lock(here: EventContext, found: EventActionList) -> ActionReports:
    return [(e, lock(here, e, a)) for e, a, _ in found]


def _do_impulse(here: EventContext, found: EventActionList) -> ActionReports:
    out = []
    for e, a, x in found:
        n = len(component_list(a.impulse))
        kick, blow = generalised_impulse(here, e, a, x[:n], x[n:])
        here.external_impulse = kick if here.external_impulse is None else here.external_impulse + kick
        here.external_impulses.append(blow)
        along = (_unit_of_argument(here, e, a, "impulse") or "N*s").replace("*", " ")
        told = [f"{_vector_text(x[:n])} {along}"] if n else []
        told += [f"{_vector_text(x[n:])} N m s"] if x[n:] else []
        out.append((e, f"impulse on {a.on}: {', '.join(told)}"))
    return out


def _vector_text(x: Sequence[float]) -> str:
    return f"{x[0]:g}" if len(x) == 1 else f"({', '.join(f'{c:g}' for c in x)})"


def _do_note(here: EventContext, found: EventActionList) -> ActionReports:
    return [(e, a.text) for e, a, _ in found]


def _do_stop(here: EventContext, found: EventActionList) -> ActionReports:
    names = " and ".join(repr(e.name) for e, _, _ in found)
    asked = here.start.base.t + here.clock.real.span
    here.stopped = f"ended at {here.t:.6g} s by event {names} (requested: {asked:.6g} s)"
    return [(e, "ended the motion") for e, _, _ in found]


ACTION_FUNCTIONS: Mapping[type[Action], Callable[[EventContext, EventActionList], ActionReports]] = {
    Set: _do_set,
    Release: _do_release,
    Lock: _do_lock,
    Impulse: _do_impulse,
    Note: _do_note,
    Stop: _do_stop,
}
"""The function of each kind of action, in the order of execution; a new kind needs a function here."""


# Applied impulses (at a point of a body, or along a coordinate) as generalised impulses.


Vector3 = np.ndarray


def generalised_impulse(
    here: EventContext, e: Event, a: Impulse, force: Sequence[float], torque: Sequence[float]
) -> tuple[np.ndarray, AppliedImpulse]:
    """Return the generalised impulse, (nv,), and its record; kinematics of the state are in the workspace.

    Parameters
    ----------
    here : EventContext
    e, a : Event, Impulse
    force, torque : sequence of float
        Its components [N s], [N m s], as many as were given: empty for no force, one number along a coordinate.
    """
    model = here.structure.model
    if not isinstance(model.find(a.on), (Body, Frame)):
        text = coordinate_of(model, e, a)
        return force[0] * _coordinate_gradient(here, text), ("along", here.structure.measured[text], force[0], e.name)
    plane = model.planar
    F = np.array([*force, 0.0, 0.0, 0.0])[:3] if len(force) < 3 else np.array(force)
    T = np.array([0.0, 0.0, *torque]) if plane and len(torque) == 1 else np.array(list(torque) or [0.0] * 3)
    body, point, axes = _point_of_impulse(here, a)
    if a.axes == "body":
        F, T = axes @ F, axes @ T
    about = T + np.cross(point - here.c.work.bodies.position[body], F)
    return _impulse_along_velocities(here, body, point, F, T), (
        "body",
        body,
        tuple(F.tolist()),
        tuple(about.tolist()),
        e.name,
    )


def _coordinate_gradient(here: EventContext, text: str) -> np.ndarray:
    """Return the gradient of a measured coordinate, (nv,)."""
    s, S = here.structure, here.c.system
    out = np.zeros(s.nv)
    row = len(S.rows.law) + s.measured[text]
    at = slice(S.row_start[row], S.row_start[row + 1])
    np.add.at(out, S.column[at], here.c.work.G[at])
    return out


def _point_of_impulse(here: EventContext, a: Impulse) -> tuple[int, Vector3, np.ndarray]:
    """Return the row of the body, the point of the impulse and the axes of the named body or frame, in world axes."""
    x, model = here.c.values, here.structure.model
    part = model[a.on]
    name = part.body if isinstance(part, Frame) else a.on
    b, drawn = here.structure.place[name], x.bodies[name]
    p, R = here.c.work.bodies.position[b], here.c.work.bodies.rotation[b].reshape(3, 3)
    at, axes = drawn.c, R
    if isinstance(part, Frame):
        at, turned = x.poses.named(a.on)
        axes = R @ drawn.R.T @ turned
    if a.at is not None:
        given = si_numbers(a.at, x.env, "m", f"at of {a.title}")
        at = vector(given, model.planar, f"at of {a.title}") if len(given) < 3 else np.array(given)
    return b, p + R @ drawn.R.T @ (at - drawn.c), axes


def _impulse_along_velocities(
    here: EventContext, b: int, point: Vector3, force: Vector3, torque: Vector3
) -> np.ndarray:
    """Return the generalised force of a wrench on body b, with the force at ``point``."""
    S, W = here.c.system, here.c.work
    out = np.zeros(here.structure.nv)
    while b >= 0:
        arm = point - W.O[b]
        for k in range(S.tree.nv[b]):
            turn, shift = (np.array(part) for part in twist_column(S, W, b, k))
            out[S.tree.v[b] + k] = force @ (shift + np.cross(turn, arm)) + torque @ turn
        b = int(S.tree.parent[b])
    return out
