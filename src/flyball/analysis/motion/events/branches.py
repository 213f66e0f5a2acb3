"""On which side of its corners each law is: where u passes zero, whether the motion crosses, or stays on u = 0.

The rates of all u at the corner depend on the sides s of the corners there, du/dt = d + B s: on a side s = 1 they must
not fall, on s = -1 not rise, and where both sides push towards u = 0 they are zero, with s between (Filippov,
*Differential Equations with Discontinuous Righthand Sides*, 1988, section 4).
"""

from __future__ import annotations

import numpy as np

from ....constraints.modes import BRANCH
from ....equations.guards import corner
from ....equations.rows import measured
from ....equations.surfaces import drifts
from ....equations.tasks import MOTION
from ....errors import SimulationError
from ....laws.evaluation import evaluate_jet
from ....model.words import listing
from ....numerics.integrators import clock as ex
from ....results.events import Happening
from ....tables.system import (
    DRIFT_OFF,
    G_CORNER,
    GUARD_KIND,
    GUARD_OF,
    HELD,
    INVERSE_SLOPES,
    MODE,
    OFF,
    SWITCH_LAW,
    VALUE,
)
from .instant import Instant

ROUNDING = 1e-12  # of the terms that u is the sum of: as good as zero
REACHED = 1e-9  # how near to 1 the side is where the motion leaves a corner
LEVEL = 1e-9  # part of what sides can do to du/dt, or of du/dt on both sides, that is nothing
SWEEPS = 500
AHEAD = 1e-7  # part of the time span by which it is tried where the motion goes


class Corners:
    """The corners of laws at an instant.

    Attributes
    ----------
    all : ndarray of int
        Switches that are corners, inner ones first.
    at : set of int
        Those whose u is zero here.
    """

    def __init__(self, n: Instant) -> None:
        self.n = n
        self.all = np.flatnonzero(n.kind == BRANCH)
        self.at: set[int] = set()
        self.old = n.W.switch[MODE].copy()

    def begin(self) -> None:
        """Sides as the motion begins."""
        self.n.ask(MOTION)
        for s in self.all.tolist():
            u, least = self.value(s)
            self.n.ways()[s] = 1.0 if u >= 0.0 else -1.0
            if abs(u) <= least:
                self.at.add(s)
        self.n.ask(MOTION)

    def fired(self, guards: np.ndarray) -> None:
        """Take note of guards that fired."""
        rows = self.n.S.guard_i[guards]
        self.at |= set(rows[rows[:, GUARD_KIND] == G_CORNER, GUARD_OF].tolist())

    def settle(self) -> bool:
        """Decide all sides. Returns whether forces jump by that."""
        if not len(self.all):
            return False
        n, ways = self.n, self.n.ways()
        before = ways[self.all].copy()
        n.ask(MOTION)
        for s in self.all.tolist():
            if s in self.at:
                continue
            u, least = self.value(s)
            if n.W.switch[MODE, s] == HELD:
                if abs(u) <= 1e3 * least:
                    self.at.add(s)
                    continue
                n.W.switch[MODE, s] = OFF
            if abs(u) > least:
                ways[s] = np.sign(u)
        jumps = self.decide() if self.at else False
        jumps = jumps or bool((np.abs(ways[self.all] - before) > 1e-6).any() and self._not_at(before))
        n.here.fresh = n.here.fresh or jumps
        return jumps

    def _not_at(self, before: np.ndarray) -> bool:
        """Whether a side changed away from zero: a jump of velocities made it."""
        return any(s not in self.at and w != self.n.ways()[s] for s, w in zip(self.all.tolist(), before, strict=True))

    def value(self, s: int) -> tuple[float, float]:
        """The u of a corner at the state last evaluated, and what of it is rounding."""
        S, W, t = self.n.S, self.n.W, self.n.here.t
        law, nm = int(S.switch_i[s, SWITCH_LAW]), measured(S)
        size = abs(t * self._jet(law, -2)[1])
        for m in range(2 * nm):
            size += abs(W.sensed[VALUE, m] * self._jet(law, m)[1])
        return float(corner(S, W, t, s)), ROUNDING * float(size)

    def _jet(self, law: int, seed: int) -> tuple[float, float, float]:
        n = self.n
        return evaluate_jet(n.S.code, n.S.const, law, n.W.stack, n.here.t, n.W.sensed, seed)

    def rates(self, which: list[int], sides: np.ndarray) -> np.ndarray:
        """How fast u of these corners changes with these sides."""
        n = self.n
        n.ways()[which] = sides
        n.ask(MOTION)
        drifts(n.S, n.W, n.here.t)
        return n.W.switch[DRIFT_OFF, which].copy()

    def decide(self) -> bool:
        """Sides of the corners that the motion is at. Returns whether forces depend on them."""
        n, W = self.n, self.n.W
        which = sorted(self.at)
        old = n.ways()[which].copy()
        W.switch[MODE, which] = OFF
        d = self.rates(which, np.zeros(len(which)))
        B = np.column_stack([self.rates(which, e) - d for e in np.eye(len(which))])
        size = np.abs(d) + np.abs(B).sum(axis=1)
        B[np.abs(B) <= LEVEL * size[:, None]] = 0.0
        left = np.array([self.old[s] == HELD for s in which]) & (np.abs(np.abs(old) - 1.0) <= REACHED)
        sides = _sides(d, B, old)
        sides = np.where(left & (np.abs(sides) > 0.5), np.sign(old), sides)
        held = np.abs(sides) < 1.0
        n.ways()[which] = sides
        flat = ~held & (np.abs(d + B @ sides) <= LEVEL * size)
        if held.any():
            self._hold([s for s, h in zip(which, held, strict=True) if h], B[np.ix_(held, held)])
        for k in np.flatnonzero(flat & ~left):
            self._tried(which, int(k), sides, old)
        if len(which) > 1:
            self._goes_on([s for s, h in zip(which, held, strict=True) if not h])
        n.ask(MOTION)
        self._tell(which)
        return bool(B.any())

    def _hold(self, which: list[int], B: np.ndarray) -> None:
        """Hold the motion on these corners: u is put to zero by what moves it least, and the slopes are known."""
        n, W = self.n, self.n.W
        inverse = np.linalg.inv(B)
        W.switch[MODE, which] = HELD
        for i, s in enumerate(which):
            W.switch[INVERSE_SLOPES + np.array(which), s] = inverse[:, i]
        S, nv, nm = n.S, n.here.structure.nv, measured(n.S)
        n.ask(MOTION)
        D = np.zeros((len(which), nv))
        for i, s in enumerate(which):
            for m in range(nm):
                slope = self._jet(int(S.switch_i[s, SWITCH_LAW]), nm + m)[1]
                at = slice(S.row_p[len(S.row_i) + m], S.row_p[len(S.row_i) + m + 1])
                D[i, S.col_i[at]] += slope * W.G[at]
        u = np.array([self.value(s)[0] for s in which])
        Y = np.column_stack([n.response(row)[0] for row in D])
        A = D @ Y
        if np.linalg.matrix_rank(A) == len(which):
            n.here.v[:] -= Y @ np.linalg.solve(A, u)

    def _tried(self, which: list[int], k: int, sides: np.ndarray, old: np.ndarray) -> None:
        """The side on which the motion goes on where u does not change at once: it is tried."""
        n, s = self.n, which[k]
        y, h = n.here.y.copy(), AHEAD * float(n.here.clock.real[ex.SPAN])
        fits = []
        for side in (1.0, -1.0):
            n.ways()[s] = side
            n.ask(MOTION)
            n.here.y[:] = y + 0.5 * h * n.desk.K[0]
            n.ask(MOTION)
            n.here.y[:] = y + h * n.desk.K[0]
            n.ask(MOTION)
            if side * corner(n.S, n.W, n.here.t, s) > 0.0:
                fits.append(side)
            n.here.y[:] = y
        n.ways()[s] = fits[0] if len(fits) == 1 else (np.sign(old[k]) or 1.0)

    def _goes_on(self, which: list[int]) -> None:
        """Refuse a point where several corners meet and sides lead back at once: none of them is one to go on."""
        n = self.n
        y, h = n.here.y.copy(), AHEAD * float(n.here.clock.real[ex.SPAN])
        for part in (0.5, 1.0):
            n.ask(MOTION)
            n.here.y[:] = y + part * h * n.desk.K[0]
        n.ask(MOTION)
        back = [s for s in which if n.ways()[s] * self.value(s)[0] < -self.value(s)[1]]
        n.here.y[:] = y
        if back:
            t = n.here.t
            raise SimulationError(
                f"at t = {t:.9g} s corners of {listing(list(dict.fromkeys(n.name(s) for s in back)))} meet where their "
                f"laws push back from every side: how the motion goes on along several such corners, of which one is a "
                f"rate of another, is not known here; make one of them smooth: max(-1, min(1, x / width)) for sign(x)",
                t=t,
            )

    def _tell(self, which: list[int]) -> None:
        n = self.n
        for s in which:
            now = n.W.switch[MODE, s]
            if now != self.old[s]:
                said = "stays on the corner of its law" if now == HELD else "leaves the corner of its law"
                y = n.here.y.copy()
                kind = "hold" if now == HELD else "leave"
                n.here.records.append(Happening(n.here.t, n.name(s), kind, (said,), 0.0, {}, y, y))
                self.old[s] = now


def _sides(d: np.ndarray, B: np.ndarray, old: np.ndarray) -> np.ndarray:
    """Sides with which no u leaves the side that its law is on: by projected relaxation, row by row.

    Where both ways lead away from a corner the motion goes on across it.
    """
    out = np.where(np.abs(old) == 1.0, -np.sign(old), 0.0)
    for _ in range(SWEEPS):
        last = out.copy()
        for k in range(len(d)):
            rest = d[k] + B[k] @ out - B[k, k] * out[k]
            if B[k, k] < 0.0:
                out[k] = np.clip(-rest / B[k, k], -1.0, 1.0)
            elif B[k, k] > 0.0 and abs(rest) <= B[k, k]:
                out[k] = out[k] if abs(out[k]) == 1.0 else 1.0
            elif rest != 0.0:
                out[k] = np.sign(rest)
        if np.abs(out - last).max() <= 1e-15:
            break
    return out
