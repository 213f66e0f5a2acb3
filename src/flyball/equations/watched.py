"""A motion whose steps end on events: the watched loop of the integrators, through the engine's door.

What guards depend on is kept at the ends of every step, and multipliers and loads at late stages of it; so between the
ends guards are the same formula on another `Work`, whose measured quantities and multipliers are expected ones.
"""

from __future__ import annotations

import numpy as np

from ..compiler.door import enter
from ..compiler.held import held
from ..compiler.jit import formula, kernel
from ..numerics.integrators.clock import GROW, NEXT, SPAN, Clock, H, T
from ..numerics.integrators.expected import expect
from ..numerics.integrators.tableaux import Tableau
from ..numerics.integrators.watched import advance_watched
from ..numerics.integrators.watching import STAGE, START, watching
from ..tables.system import (
    BIAS,
    G_SHARED,
    GUARD_KIND,
    GUARD_WAY,
    LAM,
    RATE,
    RETURNED,
    SWITCH_ROW,
    VALUE,
    X_SOLVED,
    System,
    Work,
)
from .engine import Sheet, engine
from .guards import KEPT, grains
from .guards import watch as guards
from .rows import measured
from .sharing import GRAIN, Sharing, margin, renewed
from .tasks import ARRIVE, INSPECT, MOTION, REPORT, TANGENT

ENGINE, S_, W_, R_, OWN, SHEET, EXPECTED, GROUP = range(8)


@formula
def through(A, task):
    """Have the engine do a task at the state on its desk."""
    return enter(A[ENGINE], A[S_], A[W_], A[R_], A[OWN], A[SHEET], task)


@formula
def put(own, t, y):
    """Lay a time and a state on the engine's desk."""
    own.real[T] = t
    for i in range(y.shape[0]):
        own.y[0, i] = y[i]


@formula
def all_guards(A, W, t, out):
    """Guards by what stands in W, that of the group last."""
    S = A[S_]
    guards(S, W, t, out)
    last = out.shape[0] - 1
    if S.guard_i[last, GUARD_KIND] == G_SHARED:
        out[last] = margin(S, W, t, A[GROUP])


@formula
def balanced(A):
    """Bring what is in balance by itself up to the state last evaluated."""
    renewed(A[ENGINE], A[S_], A[W_], A[R_], A[OWN], A[SHEET], A[GROUP])


@formula
def derivative(t, y, dy, A, K):
    """The right-hand side; levels are kept at the stages chosen for it."""
    own = A[OWN]
    put(own, t, y)
    status = through(A, MOTION)
    if status == 0:
        for i in range(dy.shape[0]):
            dy[i] = own.K[0, i]
    K.count[STAGE] += 1
    for j in range(K.stages.shape[0]):
        if K.stages[j] == K.count[STAGE]:
            levels(A, K, 1 + j)
    for j in range(K.met.shape[0]):
        if K.met[j] == K.count[STAGE]:
            all_guards(A, A[W_], t, K.met_g[j])
    return status


@formula
def arrive(t, y, dy, A, K):
    """Put y on the constraints, in place, and evaluate there; how far it moved."""
    own = A[OWN]
    put(own, t, y)
    status = through(A, ARRIVE)
    if status == 0:
        for i in range(dy.shape[0]):
            y[i] = own.y[0, i]
            dy[i] = own.K[0, i]
    return status, A[SHEET].rows[0, 0]


@formula
def tangent(y, e, A, K):
    """Take from an error what the projection takes."""
    own = A[OWN]
    put(own, own.real[T], y)
    for i in range(e.shape[0]):
        own.K[0, i] = e[i]
    through(A, TANGENT)
    for i in range(e.shape[0]):
        e[i] = own.K[0, i]


@formula
def inspect(t, h, span, first, seen, A, K):
    """What laws do within a step; see ``within.inspect``."""
    if seen.shape[1] == 0:
        return 0, 0.0, 0.0
    own = A[OWN]
    own.real[T], own.real[H], own.real[SPAN] = t, h, span
    own.count[NEXT] = first
    through(A, INSPECT)
    return own.count[NEXT], own.real[H], own.real[GROW]


@formula
def report(t, y, out, A, K):
    """Write a row of output."""
    own = A[OWN]
    put(own, t, y)
    status = through(A, REPORT)
    for i in range(y.shape[0]):
        y[i] = own.y[0, i]
    for i in range(out.shape[0]):
        out[i] = A[SHEET].rows[0, i]
    return status


@formula
def watch(t, y, A, K, row):
    """Evaluate the equations at a state, and the guards there."""
    own = A[OWN]
    put(own, t, y)
    status = through(A, MOTION)
    if status == 0:
        balanced(A)
    all_guards(A, A[W_], t, K.g[row])
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
    all_guards(A, W, A[OWN].real[T], K.g[row])
    grains(S, W, K.grain)
    last = K.grain.shape[0] - 1
    if S.guard_i[last, GUARD_KIND] == G_SHARED:
        K.grain[last] = GRAIN * A[GROUP].size[0]


@formula
def levels(A, K, at):
    """Keep what has no known rate."""
    W = A[W_]
    n = K.rows.shape[0]
    for k in range(n):
        K.levels[at, k] = W.row[LAM, K.rows[k]]
    for k in range(K.spots.shape[0]):
        K.levels[at, n + k] = W.sensed[K.spots[k, 0], K.spots[k, 1]]


@formula
def look(t, h, x, A, K, row):
    """Guards expected at a part x of the step that begins at t."""
    expect(K, x, h)
    all_guards(A, A[EXPECTED], t + x * h, K.g[row])


@kernel
def watched_kernel(address, S, W, R, own, sheet, expected, desk, clock, group, out):
    """Go on with a watched integration; see `watched`."""
    A = (address, held(S), held(W), held(R), held(own), held(sheet), held(expected), held(group))
    callbacks = (derivative, arrive, tangent, watch, note, look)
    return advance_watched(callbacks, inspect, report, A, held(desk), held(R), held(clock), out)


class Watched:
    """A motion that is watched: the compiled loop and what it keeps.

    Parameters
    ----------
    R : Tableau
    clock : Clock
        Of the integration.
    S, W : System, Work
    width : int
        Of a row of output.
    group : Sharing
        What holds together.
    """

    def __init__(self, R: Tableau, clock: Clock, S: System, W: Work, width: int, group: Sharing) -> None:
        nm = len(S.row_p) - 1 - len(S.row_i)
        self.R, self.clock, self.W = R, clock, W
        rows = np.unique(S.switch_i[S.switch_i[:, SWITCH_ROW] >= 0, SWITCH_ROW])
        columns = np.arange(2 * nm, W.sensed.shape[1])
        loads = columns[: len(columns) - len(S.switch_i)]
        spots = [(VALUE, m) for m in columns] + [(RETURNED, m) for m in loads]
        self.expected = W._replace(sensed=W.sensed.copy(), row=W.row.copy())
        there = self.expected.sensed, self.expected.row[LAM]
        guarded = S.guard_i[:, GUARD_WAY], np.isin(S.guard_i[:, GUARD_KIND], KEPT)
        self.desk = watching(*guarded, R.c, int(R.order_i[1]), nm, rows, np.array(spots, int), there)
        ny = clock.y.shape[1]
        self.own = Clock(
            clock.real.copy(), clock.count.copy(), clock.times, np.zeros((3, ny)), np.zeros((1, ny)), clock.accounts,
            clock.seen,
        )  # fmt: skip
        self.sheet, self.group = Sheet(np.zeros((4, max(width, W.vel.shape[1], len(S.row_i), 1)))), group

    def go_on(self, S: System, W: Work, out: np.ndarray) -> int:
        """Go on until an event, the end, or what else `explicit.advance` returns for. Returns rows written."""
        address = engine.address(S, W, self.R, self.own, self.sheet)
        return watched_kernel(
            address, S, W, self.R, self.own, self.sheet, self.expected, self.desk, self.clock, self.group, out
        )  # fmt: skip

    @property
    def fired(self) -> tuple[int, ...]:
        """The guards that the last step ended on."""
        return tuple(np.flatnonzero(self.desk.fired).tolist())
