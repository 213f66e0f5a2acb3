"""Where a motion starts, in which coordinates: as described and assembled, or where an earlier result ended."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...equations.engine import MOTION
from ...equations.velocities import turned_angles
from ...errors import ModelError
from ...model.actions import Set
from ...model.model import Model
from ...results.booked import Begun, ended
from ...results.records import wound
from ...results.result import Result
from ...tables.branches import bent_laws
from ...tables.coordinates import BodyState
from ...tables.numbers import files
from ...tables.specs import Structure
from ...tables.structure import outdated
from ...tables.switches import declared
from ...tables.system import VALUE
from ...tables.values import values_of
from ..assemble import assemble
from ..assembly.start import Assembly
from ..compiled import Compiled, compiled
from ..mobility import mobility
from .engines import Engine
from .layer import in_coordinates
from .layer import known as known_coordinates
from .part import Part, whole
from .stiff import Pace

MOST = 4  # starts of the same numbers whose coordinates are kept


@dataclass
class Start:
    """A consistent start in the coordinates of the motion."""

    base: Assembly  # in absolute coordinates
    assembly: Assembly
    y: np.ndarray
    coordinates: str  # which they are, and why
    wound: dict[str, float]  # body -> whole turns that its coordinates count and its angle does not (`Result.wound`)
    engine: Engine | None = None  # what the motion is computed by; table-driven if none
    before: Result | None = None  # what it goes on from
    pace: Pace | None = None  # whether it goes on by another method; none: it does not
    since: float = 0.0  # when the call began, by the clock of `time.perf_counter`
    part: Part = field(default_factory=whole)  # of the motion

    def again(self, part: Part) -> Start:
        """The same with arrays and scratch of its own; it is of a mechanism as described, with nothing before it."""
        base = self.base.again()
        a = base if self.assembly is self.base else self.assembly.again()
        return Start(base, a, self.y.copy(), self.coordinates, dict(self.wound), part=part)

    @property
    def carried(self) -> Mapping[str, Any]:
        """What the part of the motion before this one hands on; nothing where there is none."""
        return self.before.carried if self.part.later and self.before is not None else {}


def start_time(t_start: float | None, before: Result | None) -> float:
    """When a motion begins.

    Raises
    ------
    ModelError
        If an earlier result and a time both say when, or that is no result.
    """
    if before is None:
        return 0.0 if t_start is None else t_start
    if not isinstance(before, Result):
        raise ModelError(f"start is a result of simulate, not {type(before).__name__}")
    if t_start is not None:
        raise ModelError("a motion that goes on from a result starts where that ended: leave out t_start, or start")
    return before.final[0]


def begin(
    model: Model,
    t: float,
    parameters: Mapping[str, float] | None,
    before: Result | None,
    coordinates: str,
    *,
    switches: bool = False,
    part: Part | None = None,
) -> Start:
    """Assemble, or go on from an earlier result; choose coordinates.

    With ``switches`` there are rows for what holds at times (`tables.switches`), all off; else nothing holds, and
    friction goes by the sign of the rate. ``part`` says which part of a motion it is: a later one has the coordinates,
    and the parameters, of the one before it.

    Raises
    ------
    AssemblyError
        If the start cannot be made consistent.
    ModelError
        If a body can move without inertia, or the earlier result is of another mechanism.
    """
    part = part or whole()
    if before is not None or parameters or not model.frozen:
        return _worked_out(model, t, parameters, before, coordinates, switches, part)
    key = float(t).hex(), coordinates, switches
    known: Start | None = model.kept.known("begun", key)
    if known is not None and outdated(known.base.compiled.structure):
        model.kept.drop("begun", key)
        known = None
    if known is None:
        found = _worked_out(model, t, None, None, coordinates, switches, part)
        if _lasting(found.base.compiled.structure):
            model.kept.get("begun", key, MOST, lambda: found.again(whole()))
        return found
    return known.again(part)


def _worked_out(
    model: Model,
    t: float,
    parameters: Mapping[str, float] | None,
    before: Result | None,
    coordinates: str,
    switches: bool,
    part: Part,
) -> Start:
    """Where it begins, found from the description."""
    if before is not None and before.stretches is not None:
        set_by_events = _set_by_events(model, before)
        parameters = {**(parameters or {}), **set_by_events} if part.later else {**set_by_events, **(parameters or {})}
    base = _base(model, t, parameters, before)
    if part.later and before is not None:
        return replace(_as_it_came(base, parameters, before, switches), part=part)
    if base.compiled.values.system.scales.semidefinite > 0.0:
        mobility(model, base, inertia=True)
    return replace(begin_at(base, parameters, coordinates, before, switches=switches), part=part)


def _lasting(s: Structure) -> bool:
    """Whether what is made of it is what would be made of it now: no file is read, no Python function called."""
    return not s.functions and not files(s.model)


def _as_it_came(base: Assembly, parameters: Mapping[str, float] | None, before: Result, switches: bool) -> Start:
    """Go on in the coordinates that an earlier part has."""
    model, tree = base.compiled.structure.model, before.values.structure.tree
    c = compiled(model, parameters=parameters, tree=tree) if tree else base.compiled.again()
    nq, nv = c.structure.nq, c.structure.nv
    y = before.final[1]
    a = Assembly(c, base.t, y[:nq].copy(), y[nq : nq + nv].copy())
    if switches:
        a = with_switches(a, parameters)
    y = _gone_on(before, a)
    _holds(before, a)
    return Start(base, a, y, before.health.coordinates, _wound(base, a, y), before=before)


def _set_by_events(model: Model, before: Result) -> dict[str, float]:
    """Parameters that events set in an earlier motion, or in one that it went on from, as they were at its end.

    States of controllers that events set are part of the state that it ended in.
    """
    assert before.stretches is not None
    names = {a.parameter for e in model.events for a in e.do if isinstance(a, Set)} & model.parameters.keys()
    if not names:
        return {}
    env, last = compiled(model).values.env, before.stretches.all[-1].values.env
    return {k: float(last[k]) for k in sorted(names) if last.get(k, env[k]) != env[k]}


def begin_at(
    base: Assembly,
    parameters: Mapping[str, float] | None,
    coordinates: str,
    before: Result | None = None,
    *,
    switches: bool = False,
) -> Start:
    """Begin where the mechanism is assembled already; choose coordinates."""
    known_coordinates(coordinates)
    x = base.compiled.values
    key = coordinates, float(base.t).hex(), base.y.tobytes(), switches
    found = x.unforced.kept.get("begun", key, MOST, lambda: _begun(base, coordinates, parameters, switches))
    if found.assembly.compiled.values is found.base.compiled.values:
        a = base
    elif found.base.compiled.values is x:
        a = found.assembly.again()
    else:
        c = found.assembly.compiled
        own = Compiled(values_of(c.structure, x.given), c.z, dict(parameters or {}))
        a = replace(found.assembly.again(), compiled=own.again())
    if before is None:
        return Start(base, a, a.y, found.coordinates, dict(found.wound))
    y = _gone_on(before, a)
    _holds(before, a)
    return Start(base, a, y, found.coordinates, _wound(base, a, y), before=before)


def _begun(base: Assembly, wish: str, parameters: Mapping[str, float] | None, switches: bool) -> Start:
    a, why = in_coordinates(base, wish, parameters)
    if switches:
        a = with_switches(a, parameters)
    found = Start(base, a, a.y, why, _wound(base, a, a.y))
    return replace(found, base=base.again(), assembly=a.again())  # without the scratch


def _holds(before: Result, a: Assembly) -> None:
    """What held where an earlier result ended holds on."""
    s, W = a.compiled.structure, a.compiled.work
    old = before.values.structure
    if before.stretches is None or [x.element.name for x in s.switches] != [x.element.name for x in old.switches]:
        return
    last = before.stretches.all[-1]
    W.modes.mode[:], W.modes.hold[:] = last.modes.mode, last.modes.hold
    W.sensed[VALUE, W.sensed.shape[1] - len(s.switches) :] = last.sigma if last.sigma.ndim == 1 else last.sigma[:, -1]


def with_switches(a: Assembly, parameters: Mapping[str, float] | None) -> Assembly:
    """The same with the rows that have modes, all off, if there are any."""
    s = a.compiled.structure
    if not declared(s.model) and not s.model.events and not bent_laws(s.model):
        return a
    c = compiled(s.model, parameters=parameters, tree=s.tree, switches=True)
    c.follow(a.compiled.hints)
    return replace(a, compiled=c)


def _wound(base: Assembly, a: Assembly, y: np.ndarray) -> dict[str, float]:
    s = a.compiled.structure
    if not s.tree or not s.model.planar or (base.compiled.drawn(base.q) and a.compiled.drawn(y[: s.nq])):
        return {}
    q, c = y[: s.nq], a.compiled
    c.at(a.t, q, np.zeros(s.nv))
    base.compiled.at(base.t, base.q, base.v)
    angles = turned_angles(base.compiled.values, base.compiled.work, base.q)
    return wound(turned_angles(c.values, c.work, q), angles)


def _base(model: Model, t: float, parameters: Mapping[str, float] | None, before: Result | None) -> Assembly:
    """Where to start from, in absolute coordinates: assembled as described, or where an earlier result ended."""
    if before is None:
        return assemble(model, t=t, parameters=parameters)
    old = before.values.structure
    c = compiled(model, parameters=parameters, tree=old.tree, switches=before.stretches is not None)
    y = before.state_at_end(c)
    nq, nv = c.structure.nq, c.structure.nv
    q, v, c.z = y[:nq], y[nq : nq + nv], y[nq + nv :].copy()
    refuse_jump(before, c, t, q, v)
    c.at(t, q, v)
    if not c.structure.tree and before.stretches is None:
        return Assembly(c, t, q.copy(), v.copy())
    plain = compiled(model, parameters=parameters)
    q, v = plain.take(c, t, q, v)
    for name, more in before.wound.items():
        q[plain.values.system.tree.q[plain.structure.place[name]] + 2] -= more
    return Assembly(plain, t, q, v)


def begun(start: Start) -> Begun:
    """How its motion begins; a later part of one counts its own only."""
    return Begun(start.y.copy(), ended(start.before) if start.before is not None and not start.part.later else {})


def _gone_on(before: Result, a: Assembly) -> np.ndarray:
    """The state that an earlier result ended in: to the bit in its own coordinates, works and turns included."""
    s, old = a.compiled.structure, before.values.structure
    y = before.final[1].copy()
    if s.tree == old.tree and s.states == old.states:
        a.compiled.z = y[s.nq + s.nv :].copy()
        return y
    states = dict(zip(old.states, y[old.nq + old.nv :].tolist(), strict=True))
    z = [states.get(name, known) for name, known in a.compiled.hints.items()]
    return np.r_[a.q, a.v, z]


# Whether a motion may go on where an earlier result ended: edits since then must leave all where and as it was.


NEAR = 1e-6  # of the mechanism's length, or radians, that a motion may go on from
ALIKE = 1e-4  # of the largest velocity
LEFT = 1e-5  # velocities [m/s, rad/s] that a motion may leave in its constraints


def refuse_jump(before: Result, c: Compiled, t: float, q: np.ndarray, v: np.ndarray) -> None:
    """Refuse a state that constraints do not allow, or that joint coordinates would put elsewhere.

    Raises
    ------
    ModelError
        Naming what is off, and how far.
    """
    if c.values is before.values:
        return
    now = _moving(c, t, q, v)
    size = c.values.length
    off = dict(zip(_rows(c), np.abs(c.work.rows.value) / size, strict=True))
    fast = {name: abs(x) for name, x in zip(_rows(c), c.jacobian() @ v - c.work.rows.nu, strict=True)}
    most = max(np.abs(v).max(initial=0.0), np.abs(c.work.rows.nu).max(initial=0.0))
    if c.structure.tree:
        then = _moving(Compiled(before.values, before.final[1][len(q) + len(v) :].copy()), t, q, v)
        off |= {f"body {k!r}": max(_most(x.p - then[k].p) / size, _most(x.R - then[k].R)) for k, x in now.items()}
        fast |= {f"body {k!r}": _faster(x, then[k]) for k, x in now.items()}
        most = max([most, *(_most(np.r_[x.v, x.w]) for x in (*now.values(), *then.values()))])
    _refuse(before, c, off, NEAR, "", size)
    _refuse(before, c, fast, max(LEFT, ALIKE * most), " in velocity", 1.0)


def _moving(c: Compiled, t: float, q: np.ndarray, v: np.ndarray) -> dict[str, BodyState]:
    """How every body moves, where prescribed coordinates are what drivers want then."""
    c.at(t, q, v, MOTION)
    K = c.work.BK.copy()
    return {
        name: BodyState(K[b, :3], K[b, 3:12], K[b, 15:18], K[b, 12:15])
        for name, b in c.structure.place.items()
        if b >= 0
    }


def _rows(c: Compiled) -> list[str]:
    return [f"{r.element.title} ({r.label}, row {k})" for k, r in enumerate(c.structure.rows)]


def _most(x: np.ndarray) -> float:
    return float(np.abs(x).max(initial=0.0))


def _faster(a: BodyState, b: BodyState) -> float:
    return max(_most(a.v - b.v), _most(a.w - b.w))


def _refuse(before: Result, c: Compiled, off: dict[str, float], most: float, what: str, size: float) -> None:
    if not off:
        return
    worst = max(off, key=lambda name: off[name] if off[name] == off[name] else np.inf)
    if not off[worst] <= most:
        raise ModelError(
            f"the result of {before.model.name!r} cannot be gone on with: {worst} of {c.structure.model.name!r} is "
            f"{off[worst] * size:.3g}{what} from where the result ended. Were parameters or parts changed? A change "
            "must leave every body where it is, and as fast"
        )
