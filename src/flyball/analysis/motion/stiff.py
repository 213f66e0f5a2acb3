"""Whether a motion is stiff for the method that computes it, and whether it pays to go on by another.

Looked at after counts of steps, never by a clock, so that the same call gives the same motion. A motion is stiff where
steps of an explicit method are as wide as it is stable and no wider: h rho near the edge of its region of stability,
rho being the largest |eigenvalue| of the right-hand side (Hairer and Wanner 1996, section IV.2); for dop853 that is at
6 to 6.8 in all directions. By tight tolerances steps do not get there: rounding of what is fast is an error at each.
That is told from a motion that is as fast by three things: steps are refused, a swing would have been damped away
since the last look, and none is there that matters.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...constraints.modes import BRANCH
from ...equations.engine import MOTION, evaluate
from ...numerics.arnoldi import largest
from ...numerics.integrators import clock as ex
from ...numerics.integrators.step import scaled
from ...tables.system import OFF, VALUE, assign
from ..compiled import Compiled
from .engines import kind

AUTO, EXPLICIT, IMPLICIT = "auto", "dop853", "radau"
NEVER = 2**60  # steps
STAGES = 12  # of a step of the explicit method
EVERY = 100  # steps of it between two looks
LOOK, LITTLE = 8e5, 0.01  # what a look takes [ns], and part of the time that looks may take where they find nothing
SELDOM = 60  # steps of the implicit method
IN_A_ROW = 2  # looks that say the same
LONG = 4e8  # that the explicit method has left at least [ns], as estimated: what it takes to load the implicit one
LEAST = 270.0  # that an evaluation takes [ns], with the loop about it
EDGE = 3.5  # h rho of wide steps that are hardly stable any more
WHOLE = 0.3  # part of the state; what swings so far is the motion itself, at whatever tolerance
ROUGH = 0.3  # h rho of steps that rounding may limit, with what is fast
STILL = 20.0  # tolerances; what swings less, by h rho = EDGE, limits no steps (by less: by the cube of that, or more)
PART = 1e-3  # part of the state; the same where tolerances are loose
GONE = 3.0  # -ln of what is left of a swing since the last look, where none can have lasted
OFTEN = 0.05  # part of steps that are refused where rounding limits them
CALM = 1.2  # h rho of implicit steps that the explicit method could take too
PATIENCE = 8  # times as long it takes to go back to the implicit method once more
STIFF, NOT_STIFF, STRUCK = "where it is stiff", "where it is not stiff any more", "as velocities jumped"
TOLD = 5  # changes of the method that are told one by one


class Lately(NamedTuple):
    """Steps since the last look."""

    width: float  # of those accepted, on average [s]
    refused: float  # part of them
    time: float  # [s]


class Pace:
    """How a motion gets on, and by what it should go on.

    Parameters
    ----------
    t_end : float
        Where it ends [s].
    method : str
        That is asked for; ``"auto"``: whichever suits.
    why_not : callable
        Says why it cannot go on by the implicit method, in words; empty: it can.

    Attributes
    ----------
    told : list of str
        By what it went from when on, in words.
    asked : str
        What it should go on by, and does not yet.
    back : str
        What it goes on by again as soon as that knows what is.
    now : str
        What it has gone over to.
    """

    def __init__(self, t_end: float, method: str, why_not: Callable[[], str]) -> None:
        self.t_end, self.mixed, self.why_not = t_end, method == AUTO, why_not
        self.told: list[str] = []
        self.asked = self.back = self.now = ""
        self._goes_on = False
        self.every, self.often, self.row, self.rate = EVERY, EVERY, 0, 0.0
        self.last: tuple[int, int, float] | None = None

    def limited(self, clock: ex.Clock, steps: int) -> int:
        """So many steps as a call of the compiled loop should take, or as are left until it is looked at again."""
        if self.last is None or self._since(clock) < 0:  # it has begun anew
            self._mark(clock)
        return max(1, min(steps, self.every - self._since(clock))) if self.mixed else steps

    def turns(self, c: Compiled, clock: ex.Clock, now: str) -> str:
        """The method to go on by, where that is another one; if it is time to look."""
        if not self.mixed or self.last is None or self._since(clock) < self.every:
            return ""
        lately = self._lately(clock)
        self._mark(clock)
        if not lately.width > 0.0 or not self._speaks_for_another(c, clock, lately, now):
            self.row = 0
            if now == EXPLICIT:
                self.every = max(self.every, min(2 * self.every, int(LOOK / (LITTLE * STAGES * each(c)))))
            return ""
        self.row, self.every = self.row + 1, self.often
        if self.row < IN_A_ROW:
            return ""
        if now == EXPLICIT and (why := self.why_not()):
            self.told = [f"{EXPLICIT}, though it is stiff from t = {clock.real.t:.6g} s on: {why}"]
            self.every = NEVER
            return ""
        return IMPLICIT if now == EXPLICIT else EXPLICIT

    def struck(self, now: str) -> None:
        """Velocities have jumped: wide implicit steps would damp away what that excites, explicit ones follow it."""
        if self.mixed and now == IMPLICIT:
            self.asked = EXPLICIT

    @property
    def carried(self) -> str:
        """What a motion that goes on from here begins by, where that is not what others begin by."""
        return self.back or self.now if self.mixed else ""

    def goes_on(self, by: str) -> None:
        """It goes on from a part of the motion at whose end that was `carried`."""
        self.asked = by if self.mixed else ""
        self._goes_on = bool(self.asked)

    def words(self) -> str:
        """By what it went from when on."""
        if len(self.told) <= TOLD + 1:
            return "; ".join(self.told)
        return "; ".join([*self.told[:TOLD], f"... {len(self.told) - TOLD - 1} more times ...", self.told[-1]])

    def turned(self, clock: ex.Clock, to: str, why: str) -> None:
        """It goes on by that from now on."""
        self.now = to
        if not self._goes_on:
            if not self.told:
                self.told.append(EXPLICIT if to == IMPLICIT else IMPLICIT)
            self.told.append(f"{to} from t = {clock.real.t:.6g} s on, {why}")
        self._goes_on = False
        again = sum(x.endswith(NOT_STIFF) for x in self.told)
        self.every = self.often = SELDOM if to == IMPLICIT else EVERY * PATIENCE ** min(again, 6)
        self.row, self.asked = 0, ""
        self._mark(clock)

    def stays(self) -> None:
        """It goes on by what it goes on by now, to the end."""
        self.every = NEVER

    def _speaks_for_another(self, c: Compiled, clock: ex.Clock, lately: Lately, now: str) -> bool:
        if now == EXPLICIT:
            left = STAGES * (self.t_end - float(clock.real.t)) / (lately.width * (1.0 - lately.refused))
            if left * each(c) < LONG:
                return False
            fast = fastest(c, clock, 1.0 / lately.width)
            self.rate = abs(fast)
            return limited_by(fast, clock, lately)
        return lately.width * abs(fastest(c, clock, self.rate or 1.0 / lately.width)) <= CALM

    def _lately(self, clock: ex.Clock) -> Lately:
        assert self.last is not None
        tried, done = self._since(clock), int(clock.count.accepted) - self.last[1]
        time = float(clock.real.t) - self.last[2]
        return Lately(time / max(done, 1), (tried - done) / max(tried, 1), time)

    def _since(self, clock: ex.Clock) -> int:
        assert self.last is not None
        return int(clock.count.accepted + clock.count.rejected) - self.last[0]

    def _mark(self, clock: ex.Clock) -> None:
        done = int(clock.count.accepted)
        self.last = done + int(clock.count.rejected), done, float(clock.real.t)


def each(c: Compiled) -> float:
    """What an evaluation takes, as estimated [ns]."""
    return max(LEAST, kind(c.structure)[1])


def limited_by(fast: complex, clock: ex.Clock, lately: Lately) -> bool:
    """Whether that eigenvalue, by which nothing moves that matters, limits explicit steps.

    Either these are as wide as is stable, or they are refused though nothing swings that fast: rounding does.
    """
    stretch, rtol = lately.width * abs(fast), float(clock.real.rtol)
    if stretch < ROUGH:
        return False
    swing = bend(clock) / abs(fast)
    if stretch >= EDGE:
        return swing * rtol < WHOLE
    gone = -fast.real * lately.time > GONE
    return gone and lately.refused >= OFTEN and swing < min(STILL * (EDGE / stretch) ** 3, PART / rtol)


def on_corner(c: Compiled) -> bool:
    """Whether a law is held on its corner: its side follows from accelerations, which implicit steps do not find."""
    if not len(c.system.switches.row):
        return False
    kinds, modes = c.system.switches.kind, c.work.modes.mode
    return bool(((kinds == BRANCH) & (modes != OFF)).any())


# The fastest that a motion could do about its present state, and what of it it does.


LAST = 12  # stage of dop853 that is at the end of the step, as is the one before
PRODUCTS = 6  # with derivatives
ELSE = 0.03  # part of the first vector that is in no direction
SMALL = 1e-7  # differences, as part of the state


def fastest(c: Compiled, clock: ex.Clock, pace: float) -> complex:
    """Largest eigenvalue of the derivatives of (q, v, x)' by these at the state of a motion [1/s].

    x are states of controllers; modes are what they are. Where steps are as wide as is stable their last two stages
    differ by what is fast, so that a few products find it. Nothing of the motion's own scratch is touched.

    Parameters
    ----------
    c : Compiled
    clock : Clock
        Where the motion is, with the stages of its last step.
    pace : float
        About how fast it could be [1/s]: by it velocities are compared with positions.
    """
    s, y = c.structure, clock.y[ex.NOW]
    n, parts = s.nq + s.nv + len(s.controls) - len(s.sampled), [slice(0, s.nq), slice(s.nq, s.nq + s.nv)]
    if n > s.nq + s.nv:
        parts.append(slice(s.nq + s.nv, n))
    unit, size = np.ones(n), np.maximum(np.abs(y[:n]), 1.0)
    unit[parts[1]] = pace
    rates = _rates(c, float(clock.real.t), n)
    here = rates(y)

    def product(x: np.ndarray) -> np.ndarray:
        way, out = x * unit, np.zeros(n)
        for part in parts:  # each by itself: by rates of 1e6/s and more one would be lost beside another
            most = np.max(np.abs(way[part]) / size[part], initial=0.0)
            if most > 0.0:
                moved = y.copy()
                moved[part] += SMALL / most * way[part]
                out += (rates(moved) - here) * (most / SMALL)
        return out / unit

    return largest(product, _start(clock, unit), PRODUCTS) if n else 0j


def bend(clock: ex.Clock) -> float:
    """By how much rates have changed over the last step, in units of the tolerance [1/s].

    Over the fastest rate: what swings as fast is about so large, or less.
    """
    y = clock.y
    return float(scaled(clock, clock.K[0] - y[ex.OLD_RATE], np.abs(y[ex.NOW]), int(clock.count.controlled)))


def _rates(c: Compiled, t: float, n: int) -> Callable[[np.ndarray], np.ndarray]:
    other = c.again()
    assign(other.work.modes, c.work.modes)
    assign(other.work.options, c.work.options)
    other.work.sensed[VALUE] = c.work.sensed[VALUE]

    def rates(x: np.ndarray) -> np.ndarray:
        status, dy = evaluate(other.values.system, other.work, t, x.copy(), MOTION)
        return dy[:n].copy() if status == 0 else np.full(n, np.nan)

    return rates


def _start(clock: ex.Clock, unit: np.ndarray) -> np.ndarray:
    n = len(unit)
    other = np.random.default_rng(0).uniform(-1.0, 1.0, n)
    other /= np.linalg.norm(other)
    if len(clock.K) <= LAST:
        return other
    way = (clock.K[LAST] - clock.K[LAST - 1])[:n] / unit
    size = np.linalg.norm(way)
    return way / size + ELSE * other if 0.0 < size < np.inf else other
