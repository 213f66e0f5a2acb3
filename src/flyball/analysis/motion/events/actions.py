"""What the model's events do at an instant, before velocities jump and modes are decided."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import takewhile
from typing import Any

import numpy as np

from ....equations.tree import column
from ....errors import SimulationError
from ....model.actions import Action, Impulse, Lock, Note, Release, Set, Stop, listed
from ....model.body import Body, Frame
from ....model.element import LawOf, si_numbers
from ....model.event import Event, compared
from ....model.event_check import coordinate_of
from ....model.geometry import vector
from ....model.held import held_by
from ....results.events import Happening
from ....results.struck import Blow, summed
from ....tables.reads import read
from ....tables.specs import Structure
from ....tables.system import HELD
from ....tables.values import Values
from .carried import take_up
from .here import Here
from .holding import gone_on, hold, let_go
from .setting import set_parameters

AT_ONCE = 64  # units of the last place of a time: the gap that a jump of laws leaves, and more
TOGETHER = 1e-11  # part of a motion within which events happen at once
MOST = 1000  # expressions of events that are kept as they were read
CLEAR = 1e-9  # of what an expression was at most: beyond it, it has passed zero by a jump


@dataclass
class Acts:
    """What events do at one instant.

    Attributes
    ----------
    here : Here
    events : tuple of Event
        Those that happen.
    words : dict
        Event -> what was done.
    values : dict
        Guard -> value of its event's expression before anything was done.
    """

    here: Here
    events: tuple[Event, ...]
    words: dict[str, list[str]] = field(default_factory=dict)
    values: dict[int, float] = field(default_factory=dict)
    before: np.ndarray = field(default_factory=lambda: np.zeros(0))
    first: int = 0
    tables: Values | None = None  # before

    def told(self, own: Sequence[str] = ()) -> None:
        """Record the events, each with what was done; what only it did (locking, a blow) is told with it.

        ``own``: names under which jumps that events ask for are recorded.
        """
        here = self.here
        if not self.events:
            return
        since, here.records[self.first :] = here.records[self.first :], []
        mine = [h for h in since if h.kind in ("impact", "kick") and set(h.name.split(", ")) <= {*own, *_own(here)}]
        cause = next((e for e in self.events if any(isinstance(a, (Lock, Impulse)) for a in e.do)), self.events[0])
        for e in self.events:
            lost = sum(h.lost for h in mine) if e is cause else 0.0
            impulses: Any = {} if e is not cause or not mine else mine[0].impulses
            if e is cause and len(mine) > 1:
                impulses = summed([h.impulses for h in mine])
            done = tuple(self.words.get(e.name, ()))
            both = None if self.tables is here.c.values else (self.tables, here.c.values)
            here.records.append(
                Happening(here.t, e.name, "event", done, lost, impulses, self.before, here.y.copy(), both)
            )
        here.records += [h for h in since if not any(h is x for x in mine)]

    def passed(self) -> np.ndarray:
        """Guards of events whose expressions went through zero by the jump itself, (n,)."""
        return crossed(self.here, self.values)


def _of_forces(here: Here) -> frozenset[int]:
    """Guards of events that name forces: whatever happens, these may jump past zero."""
    s = here.structure
    found: frozenset[int] = s.kept.get("events of forces", 0, 1, lambda: _naming_forces(s))
    return found


def _naming_forces(s: Structure) -> frozenset[int]:
    named = set(read(s.model))
    laws = {g: s.model.law(e.law, e.of, f"when of {e.title}") for g, e in s.events.items()}
    return frozenset(g for g, law in laws.items() if named & law.names)


def _own(here: Here) -> set[str]:
    """Names of all that events lock and let go."""
    every = here.structure.switches
    return {x.switch.label for x in every if isinstance(x.element, Event)} | {x.element.name for x in every if x.held}


def act(here: Here, fired: Sequence[int]) -> Acts:
    """Do what the events of these guards say: parameters, what is released and locked, blows, an end.

    Velocities do not change here: `Here.kick` says what struck, the modes what is held.

    Parameters
    ----------
    here : Here
    fired : sequence of int
        Rows of `System.guard_i`, those of events among them.

    Raises
    ------
    SimulationError
        If actions contradict one another, or cannot be done; it names the events and the time.
    """
    events = [here.structure.events[int(g)] for g in fired if int(g) in here.structure.events]
    events = [e for e in events if e.times is None or here.counts.get(e.name, 0) < e.times]
    return _acted(here, tuple(events))


def act_at_start(here: Here) -> Acts:
    """Do what events say at the start; joints that may let go hold.

    Where a motion goes on nothing starts: what was locked or released stays so.
    """
    for k, spec in enumerate(here.structure.switches):
        if spec.held:
            here.c.work.modes.mode[k] = HELD
    if here.start.before is not None:
        gone_on(here, here.start.before)
        take_up(here, here.start.before.carried)
        return Acts(here, (), before=here.y.copy(), tables=here.c.values)
    # what parts carry is known only once it is decided what holds: nothing has jumped from what it is before that
    return _acted(here, tuple(e for e in here.structure.model.events if e.at_start), _of_forces(here))


def _acted(here: Here, events: tuple[Event, ...], unknown: frozenset[int] = frozenset()) -> Acts:
    """``unknown``: guards of events whose expressions say nothing yet."""
    acts = Acts(here, events, before=here.y.copy(), first=len(here.records), tables=here.c.values)
    for e in events:
        here.counts[e.name] = here.counts.get(e.name, 0) + 1
    every = [(e, a) for e in events for a in e.do]
    watched = [g for g in here.structure.events if (every or g in _of_forces(here)) and g not in unknown]
    if every or watched:
        here.evaluate()
    for g in watched:
        acts.values[g] = expression(here, g)
    if not every:
        return acts
    refuse_contradictions(here, every)
    reckoned = [(e, a, [_reckoned(here, e, a, k, x) for k, x in a.laws()]) for e, a in every]
    for kind, do in DO.items():
        if found := [(e, a, x) for e, a, x in reckoned if type(a) is kind]:
            for e, words in do(here, found):
                acts.words.setdefault(e.name, []).append(words)
    return acts


def expression(here: Here, g: int) -> float:
    """Value of the expression of an event, by its guard, at the state last evaluated."""
    model, e = here.structure.model, here.structure.events[g]
    law = here.structure.kept.get("law of event", g, MOST, lambda: model.law(e.law, e.of, f"when of {e.title}"))
    return float(law.evaluate(here.names(), {x.name: x for x in model.tables}))


def expressions(here: Here) -> dict[int, float]:
    """Values of the expressions of all events, by their guards, at the state of the instant."""
    if here.structure.events:
        here.evaluate()
    return {g: expression(here, g) for g in here.structure.events}


def true_already(here: Here) -> list[str]:
    """Names of events whose comparisons are true now: they become true only after they were false.

    Where a motion goes on, those of its begin: what is true now may have become true in what went before.
    """
    if here.start.before is not None:
        return here.true
    every = here.structure.events
    texts = {g: e.when for g, e in every.items() if isinstance(e.when, str) and e.direction != "falling"}
    values = expressions(here) if texts else {}
    return [every[g].name for g, text in texts.items() if values[g] > 0.0 and compared(text, every[g]) is not None]


def at_the_seam(here: Here) -> set[str]:
    """Names of events that happened at the very end of the motion that this one goes on from."""
    before = here.start.before
    if before is None or not len(before.t):
        return set()
    end, first = before.final[0], float(before.t[0])
    since = end - max(AT_ONCE * float(np.spacing(max(abs(end), abs(first)))), TOGETHER * (end - first))
    return {h.name for h in takewhile(lambda h: h.t >= since, reversed(before.events)) if h.kind == "event"}


def say_never(here: Here) -> None:
    """Say which events, true as the motion began, did not happen in it."""
    for e in here.structure.model.events:
        if e.name in here.true and not here.counts.get(e.name):
            here.doubts.append(
                f"{e.title} never happened: {e.when!r} was true from the start, and an event is where it becomes true"
            )


def crossed(here: Here, before: Mapping[int, float]) -> np.ndarray:
    """Guards of events whose expressions went through zero without being followed there, (n,).

    What was zero to rounding, as of what has just fired, has not: velocities that are solved for anew differ by that.
    """
    out = []
    if before:
        here.evaluate()
    for g, was in before.items():
        now, way = expression(here, g), here.c.system.guards.direction[g]
        most = max(CLEAR * max(abs(was), abs(now)), here.nothing.get(g, 0.0))
        rises, falls = was <= -most and now > most, was >= most and now < -most
        if (rises and way >= 0) or (falls and way <= 0):
            out.append(g)
    return np.array(out, np.int64)


def stepped_over(here: Here, before: Mapping[int, float]) -> list[int]:
    """Guards of events whose expressions passed zero at a time at which laws jump; not of what has just happened."""
    since = here.t - AT_ONCE * float(np.spacing(abs(here.t)))
    told = {h.name for h in takewhile(lambda h: h.t >= since, reversed(here.records))}
    return [int(g) for g in crossed(here, before) if here.structure.events[int(g)].name not in told]


def _reckoned(here: Here, e: Event, a: Action, what: str, law: Any) -> float:
    """Value of an expression of an action at the instant, as everything is before it."""
    model = here.structure.model
    of = LawOf(_unit(here, e, a, what), curves=True)
    tables = {x.name: x for x in model.tables}
    value = model.law(law, of, f"{what} of {a.title} in {e.title}").evaluate(here.names(), tables)
    if not np.isfinite(value):
        raise SimulationError(
            f"at t = {here.t:.9g} s {what} of {a.title} in {e.title} is {value}: '{law}' has no value there", t=here.t
        )
    return float(value)


def _unit(here: Here, e: Event, a: Action, what: str) -> str | None:
    """Unit of a number of an action, where there is one that it must have."""
    if not isinstance(a, Impulse):
        return None
    model = here.structure.model
    if not isinstance(model.find(a.on), (Body, Frame)):
        return "N*m*s" if model.unit(coordinate_of(model, e, a), e) == "rad" else "N*s"
    return {"impulse": "N*s", "torque": "N*m*s"}[what]


def refuse_contradictions(here: Here, every: Sequence[tuple[Event, Action]]) -> None:
    """Refuse that events of one instant lock and release the same, or set a parameter twice."""
    if here.acted_at != here.t:
        here.acted_at, here.acted = here.t, {}
    for e, a in every:
        for key in keys(here, e, a):
            first, other = here.acted.setdefault(key, (e, a))
            if first is not e and a != other:
                raise SimulationError(
                    f"at t = {here.t:.9g} s actions contradict each other: {other.title} of {first.title} and "
                    f"{a.title} of {e.title}; let one of the events come later, or once (times=1)",
                    t=here.t,
                )


def keys(here: Here, e: Event, a: Action) -> tuple[str, ...]:
    """What an action settles, for this instant."""
    if isinstance(a, (Lock, Release)):
        return held_by(here.structure.model, e, a).keys()
    return (f"parameter {a.parameter}",) if isinstance(a, Set) else ()


Done = list[tuple[Event, str]]
Found = Sequence[tuple[Event, Any, list[float]]]


def _set(here: Here, found: Found) -> Done:
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


def _released(here: Here, found: Found) -> Done:
    return [(e, let_go(here, e, a)) for e, a, _ in found]


def _locked(here: Here, found: Found) -> Done:
    return [(e, hold(here, e, a)) for e, a, _ in found]


def _struck(here: Here, found: Found) -> Done:
    out = []
    for e, a, x in found:
        n = len(listed(a.impulse))
        kick, blow = generalised(here, e, a, x[:n], x[n:])
        here.kick = kick if here.kick is None else here.kick + kick
        here.blows.append(blow)
        along = (_unit(here, e, a, "impulse") or "N*s").replace("*", " ")
        told = [f"{_vector(x[:n])} {along}"] if n else []
        told += [f"{_vector(x[n:])} N m s"] if x[n:] else []
        out.append((e, f"struck {a.on}: {', '.join(told)}"))
    return out


def _vector(x: Sequence[float]) -> str:
    return f"{x[0]:g}" if len(x) == 1 else f"({', '.join(f'{c:g}' for c in x)})"


def _noted(here: Here, found: Found) -> Done:
    return [(e, a.text) for e, a, _ in found]


def _stopped(here: Here, found: Found) -> Done:
    names = " and ".join(repr(e.name) for e, _, _ in found)
    asked = here.start.base.t + here.clock.real.span
    here.stopped = f"ended at {here.t:.6g} s by event {names} (asked: {asked:.6g} s)"
    return [(e, "ended the motion") for e, _, _ in found]


DO: Mapping[type[Action], Callable[[Here, Found], Done]] = {
    Set: _set,
    Release: _released,
    Lock: _locked,
    Impulse: _struck,
    Note: _noted,
    Stop: _stopped,
}
"""How each kind of action is done, in this order: another kind needs a function here."""


# Blows as generalised impulses: what an impulse at a point of a body, or along a coordinate, does to each velocity.


Three = np.ndarray


def generalised(
    here: Here, e: Event, a: Impulse, force: Sequence[float], torque: Sequence[float]
) -> tuple[np.ndarray, Blow]:
    """Its power at each unit velocity, (nv,), and what it is made of; kinematics of the state are in the scratch.

    Parameters
    ----------
    here : Here
    e, a : Event, Impulse
    force, torque : sequence of float
        Its components [N s], [N m s], as many as were written: none is no force; one number along a coordinate.
    """
    model = here.structure.model
    if not isinstance(model.find(a.on), (Body, Frame)):
        text = coordinate_of(model, e, a)
        return force[0] * _gradient(here, text), ("along", here.structure.measured[text], force[0], e.name)
    plane = model.planar
    F = np.array([*force, 0.0, 0.0, 0.0])[:3] if len(force) < 3 else np.array(force)
    T = np.array([0.0, 0.0, *torque]) if plane and len(torque) == 1 else np.array(list(torque) or [0.0] * 3)
    body, point, axes = _frame(here, a)
    if a.axes == "body":
        F, T = axes @ F, axes @ T
    about = T + np.cross(point - here.c.work.BK[body, :3], F)
    return _along(here, body, point, F, T), ("body", body, tuple(F.tolist()), tuple(about.tolist()), e.name)


def _gradient(here: Here, text: str) -> np.ndarray:
    """Gradient of a measured coordinate, (nv,)."""
    s, S = here.structure, here.c.system
    out = np.zeros(s.nv)
    row = len(S.rows.law) + s.measured[text]
    at = slice(S.row_start[row], S.row_start[row + 1])
    np.add.at(out, S.column[at], here.c.work.G[at])
    return out


def _frame(here: Here, a: Impulse) -> tuple[int, Three, np.ndarray]:
    """Row of the body, where it is struck, and the axes of the part that is named, in world axes now."""
    x, model = here.c.values, here.structure.model
    part = model[a.on]
    name = part.body if isinstance(part, Frame) else a.on
    b, drawn = here.structure.place[name], x.bodies[name]
    record = here.c.work.BK[b]
    R = record[3:12].reshape(3, 3)
    at, axes = drawn.c, R
    if isinstance(part, Frame):
        at, turned = x.poses.named(a.on)
        axes = R @ drawn.R.T @ turned
    if a.at is not None:
        given = si_numbers(a.at, x.env, "m", f"at of {a.title}")
        at = vector(given, model.planar, f"at of {a.title}") if len(given) < 3 else np.array(given)
    return b, record[:3] + R @ drawn.R.T @ (at - drawn.c), axes


def _along(here: Here, b: int, point: Three, force: Three, torque: Three) -> np.ndarray:
    """What a wrench on body b, force at ``point``, does along the velocities of it and of all that carry it."""
    S, W = here.c.system, here.c.work
    out = np.zeros(here.structure.nv)
    while b >= 0:
        arm = point - W.O[b]
        for k in range(S.tree.nv[b]):
            turn, shift = (np.array(part) for part in column(S, W, b, k))
            out[S.tree.v[b] + k] = force @ (shift + np.cross(turn, arm)) + torque @ turn
        b = int(S.tree.parent[b])
    return out
