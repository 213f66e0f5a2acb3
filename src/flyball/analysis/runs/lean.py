"""Many runs that share all but the numbers of forces or masses, to the last bit what each is by itself.

A run of a small mechanism takes less time in compiled code than to be made ready. Where only forces and laws see what
is varied, structure, coordinates, start and clock are those of the first run; of many such runs in one call see `desk`,
of what is read of them and how they are judged `judged`. Whatever is unusual is left to `compute.alone`.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...errors import FlyballError, ModelError
from ...model.body import Body, Frame
from ...model.joint import Joint
from ...model.model import Model
from ...model.quantities import quantities
from ...model.sensor import Sensor
from ...model.touching import nothing_touches
from ...numerics.integrators.tableaux import TABLEAUX
from ...results.departure import changed_velocities, not_allowed
from ...results.study import DONE, WAITING
from ...tables.system import SEMIDEFINITE
from ...tables.values import Values
from ..motion.choice import AUTO, SimulateOptions, chosen
from ..motion.driven import leaves_no_freedom
from ..motion.engines import AUTO as ANY
from ..motion.engines import worth_making
from ..motion.events.legs import laws_of_time
from ..motion.start import Start, begin, start_time
from ..simulate import simulate
from ..simulate import width as wide
from .codes import Code
from .compute import Answers, Question, alone
from .desk import Desk, Done
from .drawn import Drawn, rests_as_drawn
from .judged import Judge, Ran
from .reading import FUNCTION
from .soft import Filling, soft
from .spread import Spread


@dataclass(frozen=True)
class Shared:
    """What all runs have in common."""

    question: Question
    options: SimulateOptions
    begun: Start
    filling: Filling | Drawn
    code: Code | None  # made for the first of the mechanisms; none: all run through the tables
    asked: str  # the method

    @cached_property
    def whole(self) -> bool:
        """Whether something is asked for that does not follow from positions and velocities alone."""
        return not all(of_states(self.question.model, r.name) for r in self.question.asked)

    @cached_property
    def width(self) -> int:
        """Numbers that are kept of each output time."""
        return wide(self.begun.assembly) if self.whole else 1 + len(self.begun.y)

    @property
    def values(self) -> Values:
        """Of the first run."""
        return self.begun.assembly.compiled.values


def shared(question: Question, point: np.ndarray, points: np.ndarray, runs: int) -> Shared | None:
    """What so many runs have in common, from the one at a point; None if there is more to do for each, or it fails.

    ``points`` are those that will be asked for, as far as they are known.
    """
    try:
        return _shared(question, point, points, runs)
    except FlyballError:  # by itself each says why it fails
        return None


def _shared(question: Question, point: np.ndarray, points: np.ndarray, runs: int) -> Shared | None:
    model, o = question.model, question.options
    if o.start is not None or _watched(model):
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
    if s.sampled or laws_of_time(c):
        return None
    asked, o = o, o.sized(begun.base.compiled.values.length)
    if (filling := _filling(question, asked, begun, points)) is None:
        return None
    if wanted := o.specialize == ANY:
        first = simulate(model, question.at(point))
        wanted = worth_making(first.values, first.health.evaluations, runs)
    code = Code.of(c.again(), filling.tables) if wanted or o.specialize is True else None
    mixed = question.options.method == AUTO and o.step is None
    return Shared(question, o, begun, filling, code, AUTO if mixed else str(o.method))


def _filling(question: Question, o: SimulateOptions, begun: Start, points: np.ndarray) -> Filling | Drawn | None:
    """What fills in the numbers that change; None if more changes than that."""
    changed = soft(question.model, question.names)
    plain, mine = begun.base.compiled.structure, begun.assembly.compiled.structure
    given = {name: x for name, x in (question.options.parameters or {}).items() if name not in question.names}
    if changed is not None:
        filling = Filling.of(begun.assembly.compiled.values, question.names, changed)
        return replace(filling, spread=Spread((mine,), given, question.names, points))
    if not rests_as_drawn(begun):
        return None
    structures = (plain,) if plain is mine else (plain, mine)
    span = float(o.t_end) - begun.base.t or 1.0
    return Drawn(begun, o, span, Spread(structures, given, question.names, points))


def _watched(model: Model) -> bool:
    """Whether something may happen at an instant, or a law may have no value."""
    return bool(model.events or model.contacts or model.bulk or any(t.beyond == "refuse" for t in model.tables))


class Lean:
    """Runs that share all but numbers; each thread has a desk of its own."""

    def __init__(self, of: Shared) -> None:
        self.of = of
        self._own = threading.local()
        self.alone_count = 0  # runs that were computed by themselves after all
        q = of.question
        self.judge = Judge(of)
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
        self.of.filling.also(points)
        ran = Ran.none(points, len(q.times), self.of.width)
        try:
            for done in desk.compute(points, stopped):
                self._take(done, ran, out)
        except Exception:  # `alone` tells what it is
            pass
        for k in np.flatnonzero(~ran.there).tolist():
            if stopped():
                break
            self.alone_count += 1
            alone(q, points[k], out, k)
        doubted = self.judge.read(ran, out)
        out.status[ran.there] = DONE
        self._told(points, np.flatnonzero(doubted), out, stopped)
        return out

    def _take(self, done: Done, ran: Ran, out: Answers) -> None:
        """Runs that were computed together."""
        for k, run in enumerate(done.runs.tolist()) if self.remarks or done.remarks else ():
            if found := (*self.remarks, *done.remarks.get(k, ())):
                out.remarks[run] = "; ".join(found)
        ran.take(done)

    def _told(self, points: np.ndarray, some: np.ndarray, out: Answers, stopped) -> None:  # type: ignore[no-untyped-def]
        """Runs whose balance may be off, by themselves: these say whether it is."""
        for k in some.tolist():
            if stopped():
                out.status[k] = WAITING
            else:
                alone(self.of.question, points[k], out, k)


# Quantities that follow from positions and velocities of a motion alone, whatever forces made it.


OF_POINTS = ("position", "velocity", "angle", "angular_velocity")


def of_states(model: Model, name: str) -> bool:
    """Whether a curve of a result, by its name, is such a quantity; False where that is not known."""
    owner, dot, what = name.partition(".")
    try:
        e = model[owner]
    except ModelError:
        return False
    if isinstance(e, Sensor) and what in ("", "value"):
        return isinstance(e.of, str) and e.of.partition(".")[0] != owner and of_states(model, e.of)
    if not dot or what not in (table := quantities(model, owner)):
        return False
    whole = table[what].of or what
    if isinstance(e, (Body, Frame)):
        return whole in OF_POINTS
    return isinstance(e, Joint) and whole.removesuffix("_rate") in e.coordinates
