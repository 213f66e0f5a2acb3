"""Steps of implicit methods behind a door, for the loops of all integrators: see `callbacks`.

Stages are asked of the engine's own residual, Jacobians of the same formulas by complex steps (``residual.py``); ends
of steps and rows of output are the engine's, projected and solved as everywhere.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiler.formulas import call, formula
from ..compiler.kernels import kernel
from ..compiler.layout import Float1, Int1, Int2
from ..math.cayley import rate
from ..numerics.integrators.clock import ASIDE, NOW
from ..numerics.integrators.implicit.asked import answer, rates_at_begin
from ..numerics.integrators.implicit.desk import START, Desk
from ..numerics.integrators.implicit.radau import attempt, refuse
from ..numerics.integrators.implicit.radau import enter as enter_radau
from ..numerics.integrators.implicit.step import between as between_radau
from ..numerics.integrators.loop import BEGIN
from ..tables.system import (
    STEADY,
    VALUE,
    ComplexSystem,
    ComplexWork,
    System,
    Work,
)
from .asking import OWN, S_, SHEET, W_, inspect, through
from .asking import arrive as arrive_there
from .callbacks import Going, Own, meet
from .dispatch import progress
from .rows import way_of
from .tasks import PARTS, POSITION, PUSHES, RESIDUAL, STEPS, WATCH, Bench
from .tree import retract

STEP = 1e-40
FAR = 12.0  # square of an increment 2 tan(angle / 2): a third of a turn in a step is the most
RESIDUALS, SC_, WC_, MOVED, PUSHED, PRESSED, PLAN, GOING, BETWEEN = range(7, 16)
# entries of Plan.first: numbers of the Jacobian that begin there
PICKED, PICKED_MASS, ROWS, ROWS_METRIC, ROWS_HELD, SIZES, TURNS, PRESSES, END = range(9)


class Plan(NamedTuple):
    """Where the numbers of the Jacobian come from."""

    first: Int1  # (END + 1,)
    pick: Int2  # (n, 3): by positions and velocities: number, step, place in what is found; sums of these
    mass: Int2  # (n, 3): the same by accelerations
    metric: Float1  # (nv,): D
    holonomic: Int1  # (nr,): whether a row restrains positions
    valued: Int1  # (nr,): and does so in its present mode
    turns: Int1  # first angular velocity of each quaternion
    pressing: Int1  # rows whose multipliers some friction depends on
    fixed: Int1  # (1,): whether the mass matrix does not change
    negative: Int1  # numbers whose negatives stand behind all others and a -1
    light: Float1  # (nv,): inertia that bodies without any have in the Jacobian, or nothing
    own_mass: Int1  # (nv,): numbers of the inertia of each velocity alone


class Workshop(NamedTuple):
    """What steps of an implicit method write to, and what they read it by."""

    WC: ComplexWork
    moved: Bench  # with steps of positions and velocities
    pushed: Bench  # of accelerations
    pressed: Bench  # without
    plan: Plan
    desk: Desk  # of the method


class Means(NamedTuple):
    """What steps of an implicit method work with."""

    SC: ComplexSystem
    own: Workshop


@formula
def compose(y, d, v, z, out, A):
    """The state with positions an increment d from those of y, and velocities v."""
    nq = A[S_].sizes.coordinates
    nv = v.shape[0]
    for i in range(nq):
        out[i] = y[i]
    retract(A[S_], out[:nq], d)
    for i in range(nv):
        out[nq + i] = v[i]
    for i in range(z.shape[0]):
        out[nq + nv + i] = z[i]


@formula
def residual(t, k, A, K, c):
    """What the equations miss at stage k, into its row; rates of integrals there. Returns a status."""
    status = missed(t, k, A, K, c)
    out = K.out[k]
    turned(A[PLAN], K.d[k], out)
    for i in range(K.v.shape[1]):
        out[i] = K.dd[k, i] - out[i]
    if status == 0:
        powers(A, K, k)
    return status


@formula
def missed(t, k, A, K, c):
    """The same, but that the first rows are v + D G^T mu, which increments follow. Returns a status.

    The last rows are x' - f, x being states of controllers. Of index 3 only positions are held to the constraints, and
    mu is none.
    """
    S, W, P, own, rows = A[S_], A[W_], A[PLAN], A[OWN], A[SHEET].rows
    nv, nr = K.v.shape[1], K.lam.shape[1]
    own.real.t = t
    compose(c.y[NOW], K.d[k], K.v[k], K.z[k], own.y[0], A)
    for i in range(nv):
        rows[1, i] = K.a[k, i]
    for i in range(nr):
        rows[2, i] = K.lam[k, i]
    through(A, RESIDUAL)
    out = K.out[k]
    bad = 0.0
    for i in range(nv):
        out[i] = K.v[k, i]
        out[nv + i] = rows[0, i]
        bad += rows[0, i] - rows[0, i]
    for r in range(nr):
        out[2 * nv + r] = rows[0, nv + nr + r]
        out[2 * nv + nr + r] = rows[0, nv + r] if P.valued[r] == 1 else K.mu[k, r]
        bad += rows[0, nv + r] - rows[0, nv + r]
        if P.valued[r] == 1 and K.count.index_3 == 1:
            out[2 * nv + r], out[2 * nv + nr + r] = rows[0, nv + r], K.mu[k, r]
        elif P.valued[r] == 1 and K.mu[k, r] != 0.0:
            for e in range(S.row_start[r], S.row_start[r + 1]):
                i = S.column[e]
                out[i] += P.metric[i] * W.G[e] * K.mu[k, r]
    for n in range(K.tol_x.shape[0]):
        out[2 * nv + 2 * nr + n] = K.xd[k, n] - W.y[1, n]
        bad += W.y[1, n] - W.y[1, n]
    return 0 if bad == 0.0 and not far(P, K.d[k]) else 1


@formula
def far(P, d):
    """Whether a quaternion is turned by more than a step may: near half a turn its increment has no bounds."""
    for n in range(P.turns.shape[0]):
        i = P.turns[n]
        if d[i] * d[i] + d[i + 1] * d[i + 1] + d[i + 2] * d[i + 2] > FAR:
            return True
    return False


@formula
def turned(P, d, w):
    """Velocities w into rates of increments, in place."""
    for n in range(P.turns.shape[0]):
        i = P.turns[n]
        out = rate((d[i], d[i + 1], d[i + 2]), (w[i], w[i + 1], w[i + 2]))
        for k in range(3):
            w[i + k] = out[k]


@formula
def powers(A, K, k):
    """Rates of the integrals at the stage last evaluated."""
    if K.z.shape[1] == 0:
        return
    S, W = A[S_], A[W_]
    rate = K.rate[k]
    for n in range(S.control_laws.shape[0]):
        rate[n] = W.y[1, n]
    for f in range(S.forces.F.shape[0]):
        i = S.forces.work[f]
        if i >= 0:
            rate[i] = W.y[1, i]
    for r in range(S.rows.law.shape[0]):
        if S.rows.work[r] >= 0:
            rate[S.rows.work[r]] = K.lam[k, r] * W.rows.nu[r]
    progress(S, W, K.z[k], rate)


@formula
def linearise(t, k, A, K, c):
    """The numbers of the Jacobian at stage k, or at the state at which the step begins. Returns a status."""
    S, W, P, own = A[S_], A[W_], A[PLAN], A[OWN]
    own.real.t = t
    compose(c.y[NOW], K.d[k], K.v[k], K.z[k], own.y[0], A)
    lay(own.y[0], k, A, A[MOVED], K)
    through(A, POSITION)
    rows_of(S, W, K, P, k)
    first, last = P.first[PICKED_MASS], P.first[ROWS]
    status = differentiate(A, A[MOVED], PARTS, P.pick, K.J[k, P.first[PICKED] : first])
    if P.fixed[0] == 0 or K.count.jacobians == 0:
        lay(own.y[0], k, A, A[PUSHED], K)
        status += differentiate(A, A[PUSHED], PUSHES, P.mass, K.J[k, first:last])
        for i in range(P.light.shape[0]):
            K.J[k, P.own_mass[i]] += P.light[i]
    elif k != START:
        for e in range(first, last):
            K.J[k, e] = K.J[START, e]
    for n in range(P.turns.shape[0]):  # - d(T(d) w)/dd at d = 0, column by column
        i = P.turns[n]
        p, q, r = 0.5 * K.v[k, i], 0.5 * K.v[k, i + 1], 0.5 * K.v[k, i + 2]
        J = K.J[k, P.first[TURNS] + 9 * n : P.first[TURNS] + 9 * n + 9]
        J[0], J[1], J[2] = 0.0, r, -q
        J[3], J[4], J[5] = -r, 0.0, p
        J[6], J[7], J[8] = q, -p, 0.0
    for n in range(P.pressing.shape[0]):
        status += press(A, K, k, n)
    return status


@formula
def rows_of(S, W, K, P, k):
    """Entries of the rows, those along the metric of the stabilisation, and natural sizes of rows.

    The sizes are those of the engine's own solve, as it last factored: so redundant rows share as they do there, and
    rows of nothing but rounding weigh enough to hold nothing.
    """
    J = K.J[k]
    for r in range(S.rows.law.shape[0]):
        for e in range(S.row_start[r], S.row_start[r + 1]):
            g = W.G[e]
            J[P.first[ROWS] + e] = g
            J[P.first[ROWS_METRIC] + e] = -P.metric[S.column[e]] * g * P.valued[r]
            J[P.first[ROWS_HELD] + e] = g * P.valued[r]
        size = W.rows.diagonal[r]
        J[P.first[SIZES] + r] = K.real.soft * (size if size > 0.0 else 1.0)
    for n in range(P.negative.shape[0]):
        J[P.first[END] + 1 + n] = -J[P.negative[n]]


@formula
def lay(y, k, A, B, K):
    """Put stage k on a bench of the residuals, its state being y."""
    B.t[0] = complex(A[OWN].real.t, 0.0)
    for i in range(B.state.shape[0]):
        B.state[i] = complex(y[i], 0.0)
    for i in range(K.v.shape[1]):
        B.vdot[i] = complex(K.a[k, i], 0.0)
    for r in range(K.lam.shape[1]):
        B.lam[r] = complex(K.lam[k, r], 0.0)
    for n in range(B.out.shape[0]):
        B.out[n, 0] = complex(np.nan, np.nan)  # what is not found is no number


@formula
def differentiate(A, B, task, pick, numbers):
    """Numbers of the Jacobian, by the steps on that bench. Returns a status."""
    call(A[RESIDUALS], A[SC_], A[WC_], B, B, B, task)
    for e in range(numbers.shape[0]):
        numbers[e] = 0.0
    for e in range(pick.shape[0]):
        numbers[pick[e, 0]] += B.out[pick[e, 1], pick[e, 2]].imag
    bad = 0.0
    for e in range(numbers.shape[0]):
        numbers[e] /= STEP
        bad += numbers[e] - numbers[e]
    return 0 if bad == 0.0 else 1


@formula
def press(A, K, k, n):
    """How the equations of motion change with a multiplier that some friction depends on. Returns a status."""
    P, B, nv = A[PLAN], A[PRESSED], K.v.shape[1]
    r = P.pressing[n]
    lay(A[OWN].y[0], k, A, B, K)
    B.lam[r] = complex(K.lam[k, r], STEP)
    call(A[RESIDUALS], A[SC_], A[WC_], B, B, B, STEPS)
    bad = 0.0
    for i in range(nv):
        x = B.out[0, i].imag / STEP
        K.J[k, P.first[PRESSES] + n * nv + i] = x
        bad += x - x
    return 0 if bad == 0.0 else 1


@formula
def arrive(t, y, dy, A, K):
    """Put y on the constraints, in place, and evaluate there; how far it moved. Multipliers go to ``K.found``."""
    status, moved = arrive_there(t, y, dy, A, K)
    if status == 0:
        for r in range(K.found.shape[0]):
            K.found[r] = A[W_].rows.multiplier[r]
    return status, moved


@formula
def land(t, y, dy, A, K):
    """`arrive`; at the end of a step guards are kept within it first."""
    own, c, watch = A[OWN], A[GOING].clock, A[GOING].watch
    h, begin = c.real.tried, c.real.t
    rates_at_begin(K, c)
    for j in range(watch.met.shape[0] if watch.way.shape[0] > 0 and c.count.started == 1 else 0):
        x = watch.met_at[j]
        z = c.y[ASIDE, : K.z.shape[1]]
        A[BETWEEN](K, x, h, K.d[START], K.a[START], z)
        compose(c.y[NOW], K.d[START], K.a[START], z, own.y[0], A)
        own.real.t = begin + x * h
        if through(A, WATCH) != 0:
            return 1, 0.0
        meet(A, watch, j)
    return arrive(t, y, dy, A, K)


@formula
def as_modes_are(A):
    """Tell the residuals the present modes and ways, and which rows restrain positions: between steps they stay."""
    S, W, WC, P = A[S_], A[W_], A[WC_], A[PLAN]
    for s in range(S.switches.row.shape[0]):
        WC.modes.mode[s], WC.modes.hold[s] = complex(W.modes.mode[s], 0.0), complex(W.modes.hold[s], 0.0)
        m = way_of(S, W, s)
        WC.sensed[VALUE, m] = complex(W.sensed[VALUE, m], 0.0)
        r = S.switches.row[s]
        if r >= 0:
            P.valued[r] = 0 if W.modes.mode[s] == STEADY else P.holonomic[r]


@formula
def perform(method, callbacks, S, W, M, own, going, task):
    """What a loop asks of an implicit method."""
    A = (
        own.doors[0], S, W, own.R, own.clock, own.sheet, going.group, own.doors[1], M.SC, M.own.WC, M.own.moved,
        M.own.pushed, M.own.pressed, M.own.plan, going, method[1],
    )  # fmt: skip
    if task == BEGIN:
        as_modes_are(A)
    return answer(method, callbacks, A, M.own.desk, going.clock, task)


@formula
def by_radau(S, W, M, own, going, task):
    """Radau IIA of order 5."""
    method = (attempt, between_radau, enter_radau, refuse)
    return perform(method, (residual, linearise, compose, land, inspect, arrive_there), S, W, M, own, going, task)


@kernel
def radau_steps(S: System, W: Work, M: Means, own: Own, going: Going, task: int) -> int:
    """`by_radau` behind an address."""
    return by_radau(S, W, M, own, going, task)
