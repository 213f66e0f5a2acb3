"""A motion from event to event: the compiled loop, what is decided where it stops, times at which laws have corners.

Where nothing is watched, steps only end on these times: the engine's own loop runs from one to the next.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Mapping, Sequence

import numpy as np

from ....equations.engine import INTEGRATE, REPORT, motion_kernel
from ....equations.explicit import Explicit
from ....equations.sampled import Sampling
from ....equations.unwatched import Unwatched
from ....equations.watched import Loop
from ....errors import FlyballError, ModelError
from ....laws.breaks import Breaks
from ....laws.functions import forget, interrupts_kept
from ....numerics.integrators import clock as ex
from ....numerics.integrators.tableaux import tableau
from ....numerics.integrators.watching import EVENT
from ....tables.system import (
    G_BACK,
    G_CONE,
    G_CORNER,
    G_HOLDS,
    G_PULL,
    G_SHARED,
)
from ...progress import Tell
from ..engines import FAILED, Engine
from ..implicit.made import implicit
from ..implicit.suited import IMPLICIT, explicit
from ..later import unsolved
from ..options import Integration
from ..part import WEIGHT
from ..samples import sampling
from ..stiff import EXPLICIT, NOT_STIFF, STIFF, STRUCK, Pace, on_corner
from .accumulating import Counts
from .actions import expressions, say_never, stepped_over, true_already
from .failed import accumulating, endless
from .happen import begin, happen
from .here import Here
from .idle import tie
from .instant import instant_of
from .legs import Legs, Pauses, breaks
from .looked import DISTANCES, told
from .segments import Segments
from .zeros import as_fired, as_grains, as_left, astray, resume

SLICE = 0.05  # seconds that a call of the compiled loop should take
ENDLESS = 2000  # events
LATEST = 20  # events of which it is told who they were
REACHED = 1e-10  # of the mechanism's length, or a radian: what is no farther from a stop is at it
HOLDING = (G_PULL, G_HOLDS, G_CONE, G_SHARED, G_CORNER)  # guards of what holds, by the forces that it carries
AT_ONCE = 1e-9  # part of the time span within which so many never end


class Run:
    """One motion from event to event.

    Parameters
    ----------
    here : Here
    o : Integration
        Which integrator, and its choices.
    width : int
        Of a row of output.
    tell : callable
        Is told how far it is.
    engine : Engine
        Which loops compute it where nothing is watched.
    """

    def __init__(self, here: Here, o: Integration, width: int, tell: Tell, engine: Engine) -> None:
        self.engine, self.now, self.options = engine, o.method, o
        self.pace = here.start.pace or Pace(float(here.clock.real.t_end), o.method, str)
        self.here, self.method, self.width, self.tell = here, tableau(explicit(o.method)), width, tell
        clock = here.clock
        self.buffer = np.zeros((max(2, min(len(clock.times), 1_000_000 // width + 1)), width))
        self.rows: list[np.ndarray] = [np.zeros((0, width))]
        self.end = float(clock.real.t_end)  # of the motion; the clock's own goes from leg to leg
        self.first, self.span = here.t, self.end - here.t or 1.0
        self.part, self.quota = here.start.part, int(clock.count.quota)
        self.pauses = Pauses(self.part, clock)
        self.recent: deque[float] = deque(maxlen=ENDLESS)
        self.latest: deque[Sequence[int]] = deque(maxlen=LATEST)
        self.counts = Counts()
        self.guarded = len(here.c.system.guards.kind) > 0
        watched = self.guarded or len(here.c.system.switches.row) or here.structure.model.events
        here.seen = Segments() if watched else None
        self.sampling = self._sampling(here.t)
        self.loop = self._loop()

    def _sampling(self, t: float) -> Sampling | None:
        return sampling(self.here.c, self.method, self.pace.mixed, (t, self.end), (self.width, len(self.buffer)))

    @property
    def stops(self) -> Sampling | None:
        """What the loop stops for at instants: where nothing is watched it samples itself."""
        return self.sampling if self.guarded else None

    def _until(self, end: float) -> float:
        """Until when the loop is to run: the next instant at which it stops to sample, or where a part ends."""
        return self.pauses.until(min(end, math.inf if self.stops is None else self.stops.next(self.here.clock.times)))

    def sampled(self) -> bool:
        """Sample what is due now, where the loop stops for it; forces may jump. Whether anything was."""
        here = self.here
        if self.stops is None or not self.stops.due(here.t):
            return False
        before = expressions(here)
        if self.stops.sample(*here.c.buffers, here.clock) != 0:
            here.clock.count.status = ex.STUCK
            return True
        self.jumped(before)
        if len(self.rows[-1]) and self.rows[-1][-1, 0] == here.t:
            self.rows[-1][-1] = self.row()
        return True

    def _loop(self) -> Loop | Unwatched | None:
        """By steps behind a door; nothing where the engine's own loop does."""
        here, c = self.here, self.here.c
        if self.now not in IMPLICIT and not self.guarded:
            return None
        steps = implicit(self.now, c, here.clock, self.options) if self.now in IMPLICIT else Explicit(self.method)
        way = steps, here.clock, c.structure, c.system, c.scratch, max(self.width, steps.width)
        return Loop(*way, here.group) if self.guarded or self.sampling is not None else Unwatched(*way)

    def go(self, known: Breaks) -> tuple[np.ndarray, bool]:
        """Go to the end, or as far as it goes: (rows of output, whether the user interrupted)."""
        here, engine = self.here, self.engine
        forget(here.c.array("stack"))
        try:
            self.begin()
            engine.begin(here.clock)
            self.legs = Legs(here.clock, known, self._until)
            if here.start.before is not None and self.sampled():  # that was not sampled: events may happen by it
                here.clock.count.status = ex.RUNNING
                self.turned()
            while not here.stopped:
                self.integrate()
                if self.over():
                    break
            if here.stopped or self.part.paused:
                self.stop()
            if not self.part.paused:
                say_never(here)
        except KeyboardInterrupt:
            here.clock.count.status = ex.RUNNING
            return np.concatenate(self.rows), True
        except FlyballError as error:
            if isinstance(error, ModelError) and not here.t > self.first:  # the description is wrong
                raise
            here.failed = error
        finally:
            engine.end()
            if isinstance(self.loop, Loop) and self.guarded:
                here.watched = told(self.loop)
                as_left(here, self.loop)
            if self.loop is not None and here.failed is None:
                here.failed = self.loop.steps.failed
            here.method = self.pace.words()
        return np.concatenate(self.rows), False

    def turn(self, to: str, why: str) -> None:
        """Go on by another method from here on."""
        clock, before = self.here.clock, self.loop
        self.pace.turned(clock, to, why)
        self.now = to
        self.engine.stop()
        self.loop = self._loop()
        if isinstance(before, Loop) and isinstance(self.loop, Loop):
            self.loop.desk.side[:], self.loop.desk.g[:] = before.desk.side, before.desk.g
        clock.count.started, clock.count.status = 0, ex.RUNNING
        if to not in IMPLICIT and not clock.real.step:
            clock.real.h = 0.0  # as at a start

    def turned(self) -> bool:
        """Go on by another method where that pays, or where this one does not know what is; whether it does."""
        pace, c, clock = self.pace, self.here.c, self.here.clock
        implicit, corner = self.now in IMPLICIT, on_corner(c)
        if implicit and corner:
            pace.back = self.now
            self.turn(EXPLICIT, "where a law is held on its corner")
        elif pace.back and not corner:
            to, pace.back = pace.back, ""
            self.turn(to, "where none is any more")
        elif implicit and pace.mixed and clock.count.status in FAILED:
            self.turn(EXPLICIT, f"where {self.now} could not go on")
            pace.stays()
        elif pace.asked and clock.count.status in (ex.RUNNING, EVENT):
            self.turn(pace.asked, STIFF if pace.asked in IMPLICIT else STRUCK)
        elif clock.count.status == ex.RUNNING and (to := pace.turns(c, clock, self.now)):
            self.turn(to, STIFF if to in IMPLICIT else NOT_STIFF)
        else:
            return False
        return True

    def over(self) -> bool:
        """Do what the compiled loop has returned for: whether the motion is over."""
        clock, engine = self.here.clock, self.engine
        status = clock.count.status
        if status == EVENT:
            self.event()
        elif status == ex.DONE:
            return self.arrived()
        elif status != ex.RUNNING and not engine.hands_over(clock) and not self.turned():
            return True
        self.turned()
        self.legs.whole()
        if self.loop is None:
            engine.choose_again(clock)
        if self.pauses.here():
            return True
        self.legs.aim()
        return False

    def arrived(self) -> bool:
        """The loop ran as far as it was to: whether the motion is over."""
        clock, through = self.here.clock, self.legs.through()
        if not through and self.pauses.here():
            clock.real.h = max(clock.real.h, clock.real.wide)  # the last step was cut short
            return True
        if self.sampled() or not through:
            if clock.count.status == ex.STUCK:
                return True
            clock.count.status = ex.RUNNING
            self.turned()
            self.legs.aim()
            return False
        sharp = self.legs.ends_sharply() and self.guarded
        before = expressions(self.here) if sharp else {}
        self.pauses.happened()
        if not self.legs.next():
            return True
        if sharp:
            self.jumped(before)
            self.turned()
        return False

    def begin(self) -> None:
        """What happens as the motion begins."""
        here, on = self.here, self.here.start.before is not None
        if not on and self.stops is not None and self.stops.due(here.t):
            self.stops.sample(*here.c.buffers, here.clock)
        begin(here)
        if isinstance(self.loop, Loop) and self.guarded and on:
            resume(here, self.loop)
        here.true = true_already(here)
        self.here.fresh = False
        self.turned()

    def integrate(self) -> None:
        """Call the compiled loop once."""
        here, c, clock = self.here, self.here.c, self.here.clock
        before = time.perf_counter()
        weight = WEIGHT if self.now in IMPLICIT else 1.0
        clock.count.quota = self.part.most(self.pace.limited(clock, self.quota), weight)
        steps = clock.count.accepted + clock.count.rejected
        with interrupts_kept(c.structure.functions):
            if self.loop is None and self.sampling is not None:
                used = self.sampling.go_on(*c.buffers, clock, self.buffer)
            elif self.loop is None:
                used = motion_kernel(*c.buffers, self.method, clock, self.buffer, INTEGRATE)
            elif isinstance(self.loop, Unwatched):
                used = self.loop.go_on(self.buffer)
            else:
                tie(here, self.loop)
                used = self.loop.go_on(c.system, self.buffer, self.sampling)
            self.take(self.buffer[:used].copy())
        self.tell(max(0.0, min(1.0, (clock.real.t - self.first) / self.span)))
        done = int(clock.count.accepted + clock.count.rejected - steps)
        self.part.took(done * weight)
        if clock.count.status == ex.RUNNING:
            took = max(time.perf_counter() - before, 1e-6)
            self.quota = self.engine.limited(clock, max(done, 1) * SLICE / took)

    def take(self, rows: np.ndarray) -> None:
        """Keep rows of output."""
        self.rows.append(rows)
        if self.here.seen is not None:
            self.here.seen.add(self.here, rows)

    def event(self) -> None:
        """Have it decided what happens, and begin anew."""
        here = self.here
        fired = self.loop.fired if self.loop else ()
        self.recent.append(here.t)
        self.latest.append(fired)
        many, since = len(self.recent), self.recent[-1] - self.recent[0]
        if often := (many, since) if many == ENDLESS and since < AT_ONCE * self.span else self.counts.nothing(here):
            raise endless(instant_of(here), self.latest, *often)
        self.counts.add(fired, here.t)
        if found := self.counts.accumulate(fired, self.legs.end):
            raise accumulating(instant_of(here), *found)
        if isinstance(self.loop, Loop):
            here.astray = astray(here, self.loop)
            as_fired(here, self.loop)
        self.happens(fired)
        here.astray, here.nothing = frozenset(), {}

    def happens(self, fired: Sequence[int]) -> None:
        """What happens where these guards fired."""
        here, clock = self.here, self.here.clock
        system, before = here.c.system, here.v.copy()
        happen(here, fired)
        if np.abs(here.v - before).max(initial=0.0) > self.options.rtol * np.abs(before).max(initial=0.0):
            self.pace.struck(self.now)
        self.part.decided()
        self.pauses.happened()
        clock.count.started = 0
        at, over = here.t, self.guarded and not here.stopped and self.legs.over()
        was = {g: x for g, x in expressions(here).items() if g not in fired} if over else {}
        self.legs.passed()
        if here.c.system is not system:  # another value of a parameter: laws have other corners
            self.legs.whole()
            self.legs = Legs(clock, breaks(here.c, here.t, self.legs.end), self._until)
            other = self._sampling(here.t)
            if other is not None and self.sampling is not None and other.differs(self.sampling):
                self.sampling = other
        if self.loop is not None and here.c.scratch is not self.loop.scratch:
            self.loop = self._loop()
        if here.fresh:
            clock.real.h = min(clock.real.h, clock.real.wide or clock.real.h)
            here.fresh = False
        if over and here.t > at:  # laws may jump at the same instant
            self.jumped(was)

    def jumped(self, before: Mapping[int, float]) -> None:
        """Forces may have jumped: what held may not hold any more, or what was at a stop be pressed on it.

        No guard has passed zero there.

        ``before``: expressions of events on the other side of that time, across which nothing is followed.
        """
        here = self.here
        if isinstance(self.loop, Loop):
            as_grains(here, self.loop)
        n, kinds, of = instant_of(here), here.c.system.guards.kind, here.c.system.guards.of
        values, sides = n.guards(), np.isin(kinds, (*DISTANCES, G_BACK))
        at = sides & (np.abs(values) <= REACHED * n.unit[np.where(sides, of, 0)]) if sides.any() else sides
        against = np.flatnonzero(((values < 0.0) & np.isin(kinds, HOLDING)) | at)
        if fired := [*against.tolist(), *stepped_over(here, before)]:
            self.happens(fired)
        here.nothing = {}

    def stop(self) -> None:
        """The motion, or a part of it, ends here: the last row is written, but where it is already."""
        here, clock, part = self.here, self.here.clock, self.part
        part.open = part.paused and self.sampling is not None and self.sampling.due(here.t)
        if part.paused and len(self.rows[-1]) and self.rows[-1][-1, 0] == here.t:
            return
        self.take(self.row()[None, :])
        if not part.paused:
            clock.count.status = ex.DONE

    def row(self) -> np.ndarray:
        """The row of output of here and now."""
        here, c = self.here, self.here.c
        status = here.clock.count.status
        row, y = np.zeros((1, self.width)), here.y.copy()
        if motion_kernel(*c.buffers, self.method, here.clock, row, REPORT) != 0:
            row[0, 1 + len(y) :] = np.nan  # what was found last at another state stands there
            here.doubts.append(unsolved(c, row))
        here.y[:], here.clock.count.status = y, status
        return row[0]


def run_events(
    here: Here, o: Integration, width: int, tell: Tell, engine: Engine, known: Breaks
) -> tuple[np.ndarray, bool]:
    """Integrate from event to event. Returns (output rows, whether the user interrupted).

    Parameters
    ----------
    here : Here
        Where the motion begins; gets what happens, and in ``failed`` why it could not go on.
    o : Integration
        Which integrator, and its choices.
    width : int
        Of a row of output.
    tell : callable
        Is told how far it is.
    engine : Engine
        Which loops compute it where nothing is watched.
    known : Breaks
        Times at which steps end.
    """
    return Run(here, o, width, tell, engine).go(known)
