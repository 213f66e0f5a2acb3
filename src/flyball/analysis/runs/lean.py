"""Many runs that share all but the numbers of forces or masses, to the last bit what each is by itself.

A run of a small mechanism takes less time in compiled code than to be made ready. Where only forces and laws see what
is varied, structure, coordinates, start and clock are those of the first run, and a run is: numbers into two tables,
scratch and clock as new, one call. Whatever is unusual is left to `compute.alone`.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ... import special
from ...equations.engine import INTEGRATE, motion_kernel
from ...errors import FlyballError
from ...laws.breaks import NO_BREAKS
from ...laws.functions import forget
from ...model.model import Model
from ...model.touching import nothing_touches
from ...numerics.integrators import clock as ex
from ...numerics.integrators.tableaux import TABLEAUX, tableau
from ...results.departure import changed_velocities, not_allowed
from ...results.health import Health
from ...results.result import Result
from ...special.recorder import PLAIN
from ...tables.system import LATER, SEMIDEFINITE, System
from ...tables.values import Values, values
from ..compiled import Compiled
from ..motion.choice import AUTO, SimulateOptions, chosen
from ..motion.driven import leaves_no_freedom
from ..motion.engines import LONGEST, Engine
from ..motion.events.legs import laws_of_time
from ..motion.implicit.suited import unsuited
from ..motion.known import sampled_laws
from ..motion.later import open_until_asked, solved
from ..motion.reasons import remarks
from ..motion.start import Start, begin, start_time
from ..motion.stiff import EXPLICIT, Pace
from ..simulate import clock_for
from .compute import DONE, Answers, Question, alone
from .drawn import Drawn, rests_as_drawn
from .readable import of_states
from .reading import FUNCTION, reduced
from .soft import Filling, soft
from .spread import TABLES, Spread, system_of


@dataclass(frozen=True)
class Shared:
    """What all runs have in common."""

    question: Question
    options: SimulateOptions
    begun: Start
    filling: Filling | Drawn
    made: special.Made | None
    plain: tuple[np.ndarray, ...]  # where tables of the first run are 0, 1 or -1: made code goes by that
    fixed: tuple[tuple[str, int, float], ...]  # entries that made code knows, and their values
    asked: str  # the method

    @property
    def values(self) -> Values:
        """Of the first run."""
        return self.begun.assembly.compiled.values


def shared(question: Question, point: np.ndarray, points: np.ndarray) -> Shared | None:
    """What runs have in common, from the run at one point; None if there is more to do for each, or that one fails.

    ``points`` are those that will be asked for, as far as they are known.
    """
    try:
        return _shared(question, point, points)
    except FlyballError:  # by itself each says why it fails
        return None


def _shared(question: Question, point: np.ndarray, points: np.ndarray) -> Shared | None:
    model, o = question.model, question.options
    if not isinstance(o.specialize, bool) or o.start is not None or _watched(model):
        return None
    if any(r.how == FUNCTION for r in question.asked):
        return None
    o = chosen(model, question.at(point)).options
    if o.method not in TABLEAUX or o.stabilization != "projection":
        return None
    begun = begin(model, start_time(o.t_start, None), o.parameters, None, o.coordinates, switches=True)
    c = begun.assembly.compiled
    s, S = c.structure, c.values.system
    if s.switches or s.guards or s.functions or s.loads or S.glob[SEMIDEFINITE] or leaves_no_freedom(begun):
        return None
    if s.controls or laws_of_time(c):
        return None
    asked, o = o, o.sized(begun.base.compiled.values.length)
    made, fixed = None, tuple[tuple[str, int, float], ...]()
    if o.specialize:
        Engine(c, True)
        made = c.made
        if made is None or (entries := special.entries(made)) is None:
            return None
        fixed = tuple((name, k, float(getattr(S, name).ravel()[k])) for name, k in entries if name in TABLES)
    if (filling := _filling(question, asked, begun, points)) is None:
        return None
    mixed = question.options.method == AUTO and o.step is None
    return Shared(question, o, begun, filling, made, _plain(S, filling.tables), fixed, AUTO if mixed else str(o.method))


def _filling(question: Question, o: SimulateOptions, begun: Start, points: np.ndarray) -> Filling | Drawn | None:
    """What fills in the numbers that change; None if more changes than that."""
    changed = soft(question.model, question.names)
    if changed is not None:
        return Filling.of(begun.assembly.compiled.values, question.names, changed)
    if not rests_as_drawn(begun):
        return None
    plain, mine = begun.base.compiled.structure, begun.assembly.compiled.structure
    structures = (plain,) if plain is mine else (plain, mine)
    given = {name: x for name, x in (question.options.parameters or {}).items() if name not in question.names}
    return Drawn(begun, o, Spread(structures, given, question.names, points))


def _watched(model: Model) -> bool:
    """Whether something may happen at an instant, or a law may have no value."""
    return bool(model.events or model.contacts or model.bulk or any(t.beyond == "refuse" for t in model.tables))


def _plain(S: System, names: Sequence[str]) -> tuple[np.ndarray, ...]:
    return tuple(getattr(S, name) == x for name in names for x in PLAIN)


class Desk:
    """Tables, scratch and clock of one thread."""

    def __init__(self, of: Shared) -> None:
        self.of = of
        a, x = of.begun.assembly.again(), of.values
        c = Compiled(replace(x, system=system_of(x)), a.compiled.z, a.compiled.parameters)
        self.own = {name: getattr(c.values.system, name) for name in TABLES}
        self.filler = of.filling.desk(c)
        if of.made is not None:
            c.run_on(of.made)
        self.start = replace(of.begun, assembly=replace(a, compiled=c))
        self.method, self.call = tableau(of.options.method), motion_kernel
        times, o = of.question.times, of.options
        sampled = sampled_laws(c, NO_BREAKS)
        self.clock = clock_for(self.start, self.start.base.t, float(o.t_end), times, o, sampled)
        self.clock.count[ex.QUOTA] = LONGEST
        self.later = open_until_asked(self.start, o, INTEGRATE)
        c.work.option[LATER] = float(self.later)
        forget(c.work.stack)
        ny = len(of.begun.y)
        width = 1 + ny + c.structure.nv + len(x.system.row_i) + len(c.structure.prescribed)
        self.rows = np.zeros((max(2, len(times)), width))
        self.kept = [(a, a.copy()) for a in (*c.work, self.clock.real, self.clock.count, self.clock.y, self.clock.K,
                                             self.clock.seen, self.rows)]  # fmt: skip

    @property
    def compiled(self) -> Compiled:
        """Tables and scratch."""
        return self.start.assembly.compiled

    def run(self, point: np.ndarray) -> bool:
        """Compute the motion at a point into ``rows``; False if it is not for us."""
        of, c = self.of, self.compiled
        if not self.filler.fill(point, self.own):
            return False
        S = c.values.system
        if of.made is not None:
            if not all(np.array_equal(a, b) for a, b in zip(of.plain, _plain(S, of.filling.tables), strict=True)):
                return False
            if any(getattr(S, name).ravel()[k] != x for name, k, x in of.fixed):
                return False
            c.system = of.made.system(S)
        for array, new in self.kept:
            array[...] = new
        clock, used = self.clock, 0
        self.filler.begin(self.start.assembly, clock)
        pace = Pace(float(of.options.t_end), of.asked, partial(unsuited, of.begun))
        while clock.count[ex.STATUS] == ex.RUNNING:
            clock.count[ex.QUOTA] = pace.limited(clock, LONGEST)
            used += self.call(c.system, c.work, self.method, clock, self.rows[used:], INTEGRATE)
            if clock.count[ex.STATUS] == ex.RUNNING and pace.turns(c, clock, EXPLICIT):
                return False  # it is stiff: by itself it goes on by another method
        return bool(clock.count[ex.STATUS] == ex.DONE and used == len(clock.times))


class Lean:
    """Runs that share all but the numbers of forces; each thread has a desk of its own."""

    def __init__(self, of: Shared) -> None:
        self.of = of
        self._own = threading.local()
        self.alone_count = 0  # runs that were computed by themselves after all
        q = of.question
        same = isinstance(of.filling, Filling)  # where things are on bodies, and where these are drawn
        self.stacked = [k for k, r in enumerate(q.asked) if same and of_states(q.model, r.name)]
        self.alone = [k for k in range(len(q.asked)) if k not in self.stacked]
        self.remarks = [
            *map(not_allowed, changed_velocities(of.begun.base.departures)), *nothing_touches(q.model)
        ]  # fmt: skip

    def compute(self, points: np.ndarray, stopped) -> Answers:  # type: ignore[no-untyped-def]
        """As `compute.compute`."""
        q = self.of.question
        out = q.empty(len(points))
        desk = getattr(self._own, "desk", None)
        if desk is None:
            desk = self._own.desk = Desk(self.of)
        ny = len(self.of.begun.y)
        rows = np.zeros((len(points), len(q.times), 1 + ny))
        mine = np.zeros(len(points), bool)
        for k, point in enumerate(points):
            if stopped():
                break
            try:
                mine[k] = desk.run(point)
            except Exception:  # `alone` tells what it is
                mine[k] = False
            if not mine[k]:
                self.alone_count += 1
                alone(q, point, out, k)
                continue
            rows[k] = desk.rows[: len(q.times), : 1 + ny]
            if found := (*self.remarks, *remarks(desk.start.assembly, desk.clock)):
                out.remarks[k] = "; ".join(found)
            if self.alone:
                self._whole(desk, point, out, k)
        self._read(rows[mine], np.flatnonzero(mine), out)
        out.status[mine] = DONE
        return out

    def _whole(self, desk: Desk, point: np.ndarray, out: Answers, k: int) -> None:
        """What depends on forces is read of the run by itself."""
        q, s = self.of.question, desk.compiled.structure
        x = values(s, q.at(point).parameters)
        rows = desk.rows[: len(q.times)]
        cuts = np.cumsum([1, s.nq, s.nv, len(s.states), s.nv])
        t, p, v, z, vdot, lam = (np.ascontiguousarray(part) for part in np.split(rows, cuts, axis=1))
        if desk.later:
            vdot, lam = solved(desk.start, rows)
        result = Result(q.model, x, t[:, 0], p, v, z, vdot, lam, _health())
        result.wound = self.of.begun.wound
        asked = [q.asked[i] for i in self.alone]
        for i, found in zip(self.alone, q.single.read(result, asked, q.times), strict=True):
            out.values[i][k] = found

    def _read(self, rows: np.ndarray, at: np.ndarray, out: Answers) -> None:
        """What depends on positions and velocities is read of all runs at once, as if they were one motion."""
        if not len(at) or not self.stacked:
            return
        q, s = self.of.question, self.of.values.structure
        flat = rows.reshape(-1, rows.shape[2])
        _, p, v, z = np.split(flat, np.cumsum([1, s.nq, s.nv]), axis=1)
        none = np.zeros((len(flat), s.nv)), np.zeros((len(flat), len(s.rows) + len(s.prescribed)))
        p, v, z = (np.ascontiguousarray(x) for x in (p, v, z))
        result = Result(q.model, self.of.values, flat[:, 0].copy(), p, v, z, *none, _health())
        result.wound = self.of.begun.wound
        for i in self.stacked:
            r = q.asked[i]
            curves = result.curve(r.name)[1].reshape(len(at), -1)
            for k, y in zip(at, curves, strict=True):
                out.values[i][k] = reduced(r.how, q.times, np.ascontiguousarray(y), q.times)


def _health() -> Health:
    """Of a result that is read and forgotten."""
    return Health(True, "", 0.0, 0.0, 0, 0, 0, 0, 0.0)
