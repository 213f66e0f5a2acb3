"""A motion that goes on by steps of any method, which end on events or are sampled (else see `unwatched`).

The loops of the integrators, through the engine's door and that of a method. What guards depend on is kept at the ends
of every step, and multipliers and loads at some places within it; so between the ends guards are the same formula on
another `Work`, whose measured quantities and multipliers are expected ones.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Protocol

import numpy as np

from ..compiler.buffers import PooledBuffer, StructBuffer
from ..compiler.formulas import formula
from ..compiler.kernels import ArrayBuffer, BoundKernel, kernel
from ..compiler.layout import Array, Float2, Int1
from ..numerics.cone.shares import OPEN
from ..numerics.integrators.clock import Clock, T
from ..numerics.integrators.expected import expect
from ..numerics.integrators.loop import advance, nothing, whole
from ..numerics.integrators.tableaux import Tableau, tableau
from ..numerics.integrators.watched import begun, onward
from ..numerics.integrators.watching import ASTRAY, FASTEST, GRAIN_END, GRAIN_START, START, Watch, watching
from ..tables.specs import Structure
from ..tables.system import (
    BIAS,
    G_BACK,
    G_SHARED,
    G_TURNS,
    GUARD_KIND,
    GUARD_OF,
    GUARD_WAY,
    LAM,
    RATE,
    RETURNED,
    SWITCH_PARTNER,
    SWITCH_ROW,
    VALUE,
    X_SOLVED,
    System,
    Work,
)
from .asking import ENGINE, GROUP, OWN, R_, S_, SHEET, W_, put, report, steps, through
from .callbacks import Going, Own, levels
from .engine import engine
from .guards import FIRM, KEPT, astray, grains
from .guards import watch as guards
from .pace import quickest
from .rows import measured
from .sampled import Samples, Sampling
from .sampled import advance as from_instant_to_instant
from .scratch import tables
from .sharing import GRAIN, Sharing, guard_of_group, renewed, shares
from .tasks import MOTION, Sheet

EXPECTED = 7
LEFT = 1e-10  # of `Watch.tied`, of the fastest rate: what rows that hold leave of others


@formula
def all_guards(A, W, t, K, row):
    """Guards by what stands in W, that of the group last, to a row; then its terms."""
    S, out, last = A[S_], K.g[row], K.way.shape[0] - 1
    still(S, W, K)
    guards(S, W, t, out)
    kept_at_zero(S, W, K, out)
    if S.guard_i[last, GUARD_KIND] == G_SHARED:
        guard_of_group(S, W, t, A[GROUP], K, row)


@formula
def kept_at_zero(S, W, K, out):
    """Take from guards that what holds keeps at zero what it leaves of them."""
    fastest = -1.0
    for i in range(K.tied.shape[0]):
        if K.tied[i] > 0.0:
            least = LEFT * K.tied[i]
            if S.guard_i[i, GUARD_KIND] == G_BACK:
                fastest = quickest(S, W) if fastest < 0.0 else fastest
                least = LEFT * max(fastest, K.tied[i])
            out[i] -= min(max(out[i], -least), least)


@formula
def still(S, W, K):
    """Take from rates that laws of events name and that what holds keeps at zero what it leaves of them."""
    fastest, nm = -1.0, measured(S)
    for m in range(nm):
        if K.still[m] > 0.0:
            fastest = quickest(S, W) if fastest < 0.0 else fastest
            least = LEFT * max(fastest, K.still[m])
            x = W.sensed[VALUE, nm + m]
            W.sensed[VALUE, nm + m] -= min(max(x, -least), least)


@formula
def balanced(A):
    """Bring what is in balance by itself up to the state last evaluated."""
    renewed(A[ENGINE], A[S_], A[W_], A[R_], A[OWN], A[SHEET], A[GROUP])


@formula
def watch(t, y, A, K, row):
    """Evaluate the equations at a state, and the guards there."""
    own = A[OWN]
    put(own, t, y)
    status = through(A, MOTION)
    if status == 0:
        balanced(A)
    all_guards(A, A[W_], t, K, row)
    return status


@formula
def note(A, K, row):
    """Keep what guards depend on at the state last evaluated, and the guards there."""
    S, W = A[S_], A[W_]
    nr = S.row_i.shape[0]
    end = 0 if row == START else 1
    for m in range(measured(S)):
        a = W.sensed[BIAS, m]
        for e in range(S.row_p[nr + m], S.row_p[nr + m + 1]):
            a += W.G[e] * W.vel[X_SOLVED, S.col_i[e]]
        K.moving[end, 0, m], K.moving[end, 1, m], K.moving[end, 2, m] = W.sensed[VALUE, m], W.sensed[RATE, m], a
    levels(A, K, 0 if row == START else K.levels.shape[0] - 1)
    balanced(A)
    all_guards(A, W, A[OWN].real[T], K, row)
    grain = GRAIN_START if row == START else GRAIN_END
    K.real[FASTEST] = max(K.real[FASTEST], quickest(S, W))
    grains(S, W, A[OWN].real[T], A[EXPECTED].sensed, K.real[FASTEST], K.g[grain])
    astray(S, W, A[OWN].real[T], K.g[ASTRAY])
    last = K.grain.shape[0] - 1
    if S.guard_i[last, GUARD_KIND] == G_SHARED:
        K.g[grain, last] = GRAIN * A[GROUP].size[0]
    for i in range(K.grain.shape[0]):
        K.g[grain, i] = max(K.g[grain, i], K.least[i])
        K.grain[i] = K.g[grain, i] if K.kept[i] == 1 else min(K.g[GRAIN_START, i], K.g[grain, i])


@formula
def look(t, h, x, A, K, row):
    """Guards expected at a part x of the step that begins at t."""
    expect(K, x, h)
    all_guards(A, A[EXPECTED], t + x * h, K, row)


@kernel
def watched_kernel(
    method: Int1,
    address: int,
    S: System,
    W: Work,
    R: Tableau,
    own: Clock,
    sheet: Sheet,
    group: Sharing,
    expected: Work,
    desk: Watch,
    clock: Clock,
    out: Float2,
) -> int:
    """Go on with a watched integration; ``method``: see `kernels.call_bound`; ``address``: the engine's."""
    A = (address, S, W, R, own, sheet, group, expected)
    callbacks = (steps, method, report, begun, onward, watch, note, look)
    return advance(callbacks, A, desk, R, clock, out)


@formula
def by_steps(X, rows):
    """The loop in which nothing is watched."""
    callbacks, A, K, R, c = X
    return advance(callbacks, A, K, R, c, rows)


@kernel
def sampled_steps_kernel(
    method: Int1,
    address: int,
    S: System,
    W: Work,
    R: Tableau,
    own: Clock,
    sheet: Sheet,
    desk: Watch,
    clock: Clock,
    P: Samples,
    part: Float2,
    out: Float2,
) -> int:
    """Go on with an integration in which nothing is watched, from instant to instant of what is sampled.

    ``part``: rows of output between two of them.
    """
    A = (address, S, W, R, own, sheet)
    X = ((steps, method, report, nothing, whole), A, desk, R, clock)
    return from_instant_to_instant(by_steps, X, (address, S, W, R, clock, sheet, P), part, out)


class Steps(Protocol):
    """Steps of a method behind a door."""

    R: Tableau
    c: np.ndarray  # where in a step guards may be seen, as stages of a method
    stages: int  # how many of these there are
    failed: Exception | None  # why it does not go on, where that is the method's own reason

    def bind(
        self, tables: StructBuffer, scratch: StructBuffer, own: StructBuffer, going: StructBuffer, doors: np.ndarray
    ) -> BoundKernel:
        """The door bound to a System, a Work, an `Own` and a `Going`; ``doors``: of `Own`, its second to be set."""


def keeps(S: System) -> np.ndarray:
    """1 for guards that are above zero as long as modes are right, 2 for those of distances and rates, (ng,).

    A slip in the plane is one of them: what begins at rest goes its way. One in space turns where it likes.
    """
    kinds, of = S.guard_i[:, GUARD_KIND], S.guard_i[:, GUARD_OF]
    slips = np.flatnonzero(kinds == G_TURNS)
    kept = np.isin(kinds, KEPT)
    kept[slips[S.switch_i[of[slips], SWITCH_PARTNER] < 0]] = True
    return np.where(kept, np.where(np.isin(kinds, FIRM), 2, 1), 0)


def _desk(S: System, expected: Work, c: np.ndarray, stages: int) -> Watch:
    """What a loop keeps that watches."""
    nm = len(S.row_p) - 1 - len(S.row_i)
    rows = np.unique(S.switch_i[S.switch_i[:, SWITCH_ROW] >= 0, SWITCH_ROW])
    columns = np.arange(2 * nm, expected.sensed.shape[1])
    loads = columns[: len(columns) - len(S.switch_i)]
    spots = [(VALUE, m) for m in columns] + [(RETURNED, m) for m in loads]
    there = expected.sensed, expected.row[LAM]
    guarded = S.guard_i[:, GUARD_WAY], keeps(S)
    return watching(*guarded, c, stages, nm, rows, np.array(spots, int), there, 3 * len(S.switch_i))


@lru_cache(maxsize=16)
def idle_watch(c: bytes, stages: int) -> StructBuffer:
    """What a loop keeps where there is nothing to watch, for all of them."""
    none, empty = np.zeros(0, np.int64), (np.zeros((RETURNED + 1, 0)), np.zeros(0))
    return StructBuffer(watching(none, none, np.frombuffer(c).copy(), stages, 0, none, none, empty))


@lru_cache(maxsize=1)
def idle_tableau() -> StructBuffer:
    """A tableau that the engine does not look at."""
    return StructBuffer(tableau("rk45"))


class Loop:
    """A motion by steps of a method that is watched, or sampled: the compiled loop and what it keeps.

    Parameters
    ----------
    steps : Steps
    clock : Clock
        Of the integration.
    s : Structure
    S : System
    scratch : PooledBuffer
        The Work.
    width : int
        Of a row of output, and of what the method has the engine write.
    group : Sharing
        What holds together.
    """

    def __init__(
        self, steps: Any, clock: Clock, s: Structure, S: System, scratch: PooledBuffer, width: int, group: Sharing
    ) -> None:
        self.steps, self.clock, self.s, self.S, self.scratch = steps, clock, s, S, scratch
        W = scratch.fields
        self._known = [idle_tableau()]
        if len(S.guard_i):
            self.expected = W._replace(sensed=W.sensed.copy(), row=W.row.copy())
            self.desk = _desk(S, self.expected, steps.c, steps.stages)
        else:  # nobody looks at it, or writes to it
            self.expected = W
            idle = idle_watch(steps.c.tobytes(), steps.stages)
            self.desk = idle.fields
            self._known.append(idle)
        ny = clock.y.shape[1]
        own = Clock(
            clock.real.copy(), clock.count.copy(), clock.times, np.zeros((3, ny)), np.zeros((1, ny)), clock.accounts,
            clock.seen,
        )  # fmt: skip
        self.group, nv = group, W.vel.shape[1]
        sheet = Sheet(np.zeros((4, max(width, len(S.guard_i), nv, len(S.row_i), 1))))
        self.own = Own(own, sheet, self._known[0].fields, np.zeros(2, np.int64))
        self._bound: BoundKernel | None = None
        self._clock, self._watch, self._group = (StructBuffer(x) for x in (clock, self.desk, group))
        self._expected = StructBuffer(self.expected)
        self._own = [self._known[0], StructBuffer(own), StructBuffer(sheet)]

    def go_on(self, S: System, out: np.ndarray, sampling: Sampling | None = None) -> int:
        """Go on until an event, the end, or what else `loop.advance` returns for. Returns rows written.

        Where nothing is watched, what ``sampling`` says is sampled on the way.
        """
        x = self.own
        if self._bound is None or S is not self.S:
            x.doors[0] = engine.address
            own, going = (StructBuffer(f, *self._known) for f in (x, Going(self.clock, self.desk, self.group)))
            written = tables(self.s, S)
            self.S, self._bound = S, self.steps.bind(written, self.scratch, own, going, x.doors)
            method = ArrayBuffer(self._bound.words, Array("i8", 1), "method")
            self._asked = method, engine.address, written, self.scratch, *self._own
        if self.group.Q.count[OPEN] and not self.group.door[0]:
            self.group.door[0] = shares.address
        asked = self._asked
        if not len(S.guard_i) and sampling is not None:
            plan, part = sampling.plan, sampling.sheet.rows
            return int(sampled_steps_kernel(*asked, self._watch, self._clock, plan, part, out))
        return int(watched_kernel(*asked, self._group, self._expected, self._watch, self._clock, out))

    @property
    def fired(self) -> tuple[int, ...]:
        """The guards that the last step ended on."""
        return tuple(np.flatnonzero(self.desk.fired).tolist())
