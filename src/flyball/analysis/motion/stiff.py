"""Whether a motion is stiff for the method that computes it, and whether it pays to go on by another.

Looked at after counts of steps, never by a clock, so that the same call gives the same motion. A motion is stiff where
steps of an explicit method are as wide as it is stable and no wider: h rho near the edge of its region of stability,
rho being the spectral radius of the right-hand side (Hairer and Wanner 1996, section IV.2), which is found by the power
method on differences of it (Sommeijer, Shampine and Verwer 1998).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...constraints.modes import BRANCH
from ...equations.engine import MOTION, evaluate
from ...numerics.integrators import clock as ex
from ...tables.system import MODE, OFF, SWITCH_KIND, VALUE
from ..compiled import Compiled
from .account import kind

AUTO, EXPLICIT, IMPLICIT = "auto", "dop853", "radau"
NEVER = 2**60  # steps
STAGES = 12  # of a step of the explicit method
EVERY = 100  # steps of it between two looks
SELDOM = 60  # steps of the implicit method
IN_A_ROW = 2  # looks that say the same
LONG = 8e7  # that the explicit method has left at least [ns], as estimated: the implicit one may have to be compiled
LEAST = 270.0  # that an evaluation takes [ns], with the loop about it
EDGE = 3.5  # h rho of wide steps that are hardly stable any more
CALM = 1.2  # h rho of implicit steps that the explicit method could take too
ROUNDS, LATEST = 14, 8  # of the power method; of these the last count
SMALL = 1e-7  # differences, as part of the state
PATIENCE = 8  # times as long it takes to go back to the implicit method once more
STIFF, NOT_STIFF, STRUCK = "where it is stiff", "where it is not stiff any more", "as velocities jumped"
TOLD = 5  # changes of the method that are told one by one


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
        self.every, self.row = EVERY, 0
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
        done = int(clock.count[ex.ACCEPTED]) - self.last[1]
        width = (float(clock.real[ex.T]) - self.last[2]) / max(done, 1)
        self._mark(clock)
        if not width > 0.0 or not self._speaks_for_another(c, clock, width, now):
            self.row = 0
            return ""
        self.row += 1
        if self.row < IN_A_ROW:
            return ""
        if now == EXPLICIT and (why := self.why_not()):
            self.told = [f"{EXPLICIT}, though it is stiff from t = {clock.real[ex.T]:.6g} s on: {why}"]
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
            self.told.append(f"{to} from t = {clock.real[ex.T]:.6g} s on, {why}")
        self._goes_on = False
        again = sum(x.endswith(NOT_STIFF) for x in self.told)
        self.every = SELDOM if to == IMPLICIT else EVERY * PATIENCE ** min(again, 6)
        self.row, self.asked = 0, ""
        self._mark(clock)

    def stays(self) -> None:
        """It goes on by what it goes on by now, to the end."""
        self.every = NEVER

    def _speaks_for_another(self, c: Compiled, clock: ex.Clock, width: float, now: str) -> bool:
        if now == EXPLICIT:
            left = STAGES * (self.t_end - float(clock.real[ex.T])) / width
            each = max(LEAST, kind(c.structure)[1])
            return left * each >= LONG and width * spectral_radius(c, clock) >= EDGE
        return width * spectral_radius(c, clock) <= CALM

    def _since(self, clock: ex.Clock) -> int:
        assert self.last is not None
        return int(clock.count[ex.ACCEPTED] + clock.count[ex.REJECTED]) - self.last[0]

    def _mark(self, clock: ex.Clock) -> None:
        done = int(clock.count[ex.ACCEPTED])
        self.last = done + int(clock.count[ex.REJECTED]), done, float(clock.real[ex.T])


def spectral_radius(c: Compiled, clock: ex.Clock) -> float:
    """Of the derivatives of (q, v, x)' by these at the state of a motion, its modes being what they are [1/s].

    x are states of controllers.

    About: within some tenths. Nothing of the motion's own scratch is touched.
    """
    s, t, y = c.structure, float(clock.real[ex.T]), clock.y[ex.NOW].copy()
    other = c.again()
    other.work.switch[:], other.work.option[:] = c.work.switch, c.work.option
    other.work.sensed[VALUE] = c.work.sensed[VALUE]
    n = s.nq + s.nv + len(s.controls) - len(s.sampled)

    def rates(x: np.ndarray) -> np.ndarray:
        status, dy = evaluate(other.values.system, other.work, t, x, MOTION)
        return dy[:n].copy() if status == 0 else np.full(n, np.nan)

    size = np.maximum(np.abs(y[:n]), 1.0)
    way = size * np.random.default_rng(0).uniform(0.5, 1.0, n)
    here, grown = rates(y.copy()), []
    for _ in range(ROUNDS):
        way *= SMALL / np.max(np.abs(way) / size)
        x = y.copy()
        x[:n] += way
        before = np.sqrt(np.square(way / size).sum())
        way = rates(x) - here
        after = np.sqrt(np.square(way / size).sum())
        if not 0.0 < after < np.inf:
            return 0.0
        grown.append(after / before)
    return float(np.exp(np.mean(np.log(grown[-LATEST:]))))


def on_corner(c: Compiled) -> bool:
    """Whether a law is held on its corner: its side follows from accelerations, which implicit steps do not find."""
    kinds, modes = c.system.switch_i[:, SWITCH_KIND], c.work.switch[MODE]
    return bool(((kinds == BRANCH) & (modes != OFF)).any())
