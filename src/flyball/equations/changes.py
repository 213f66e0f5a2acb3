"""How a state of the motion changes with one parameter: a complex residual and a solve with the motion's own factor.

    [M G^T; G 0] [dvdot; -dlam] = -[dr; da]

dr and da are what the equations of motion and the constraints miss along (dq, dv, dp). Joint friction follows the
reactions, so that dr has a part F dlam of its own: the columns of F are found by a complex step of each multiplier that
presses on a joint, and taken into account by as many unknowns (Woodbury).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiler.formulas import call, formula
from ..compiler.layout import Float1, Float2, Int1
from ..math.scalar import absolute
from .asking import ENGINE, OWN, R_, S_, SHEET, W_
from .tasks import ALONG, GAPS, SOLVE, STEPS
from .tree import quaternion_at

STEP = 1e-40  # of the parameter
# places in the tuple of what the loop works with, behind those of `asking`
RESIDUAL, SC_, WC_, BENCH = range(6, 10)
# entries of Plan.size
NQ, NZ, COUNT, POWERS = range(4)


class Plan(NamedTuple):
    """Which numbers the parameters change, and what is found on the way."""

    size: Int1  # (4,) coordinates, states, parameters; whether powers stand for works
    first: Int1  # (n + 1,) first entry of each parameter
    entry: Int1  # (entries,): place in the tables
    step: Float1  # (entries,): what stands there
    tables: Float1  # the complex tables, one behind the other, as real and imaginary parts in turn
    found: Float2  # (n, nv + nr + nv): changes of accelerations, multipliers, efforts
    effort: Float1  # (nv,) of the motion itself
    rate: Float1  # rates of the state, where a row is reported
    zero: Float1  # (nv,)
    pressing: Int1  # (m,) rows whose multipliers some friction depends on
    by_press: Float2  # (m, nv + nr + nv): what friction under a unit of each makes of all
    by_power: Float2  # (m, nz): and of the powers
    share: Float2  # (m, m + 1): scratch


@formula
def stamp(P, k, on):
    """Put the step of parameter k into the complex tables, or take it out."""
    for e in range(P.first[k], P.first[k + 1]):
        P.tables[P.entry[e]] = P.step[e] if on else 0.0


@formula
def settle_at(A, P, t, state):
    """Make the state that the engine was last evaluated at the one from which complex steps are taken."""
    W, B = A[W_], A[BENCH]
    B.t[0] = complex(t, 0.0)
    for i in range(state.shape[0]):
        B.state[i] = complex(state[i], 0.0)
    for d in range(P.effort.shape[0]):
        B.vdot[d] = complex(W.velocities.solved[d], 0.0)
        P.effort[d] = W.velocities.effort[d]
    for k in range(B.lam.shape[0]):
        B.lam[k] = complex(W.rows.multiplier[k], 0.0)


@formula
def step_along(A, dq, dv, task):
    """The residuals with a complex step of positions and velocities, and of what stands in the tables."""
    B = A[BENCH]
    nv = dq.shape[0]
    for d in range(nv):
        B.steps[0, d] = complex(0.0, STEP * dq[d])
        B.steps[0, nv + d] = complex(0.0, STEP * dv[d])
    if nv > 0:
        B.out[0, 0] = complex(np.nan, np.nan)  # what is not found is no number
    call(A[RESIDUAL], A[SC_], A[WC_], B, B, B, task)


@formula
def respond(A):
    """Solve with the motion's factor, for what stands in the first two rows of the sheet."""
    call(A[ENGINE], A[S_], A[W_], A[R_], A[OWN], A[SHEET], SOLVE)


@formula
def closed(A, P, k, dq, dv):
    """Put changes of positions and velocities on the linearised constraints, in place."""
    S, WC, B, rows = A[S_], A[WC_], A[BENCH], A[SHEET].rows
    nv, nr, nq = dq.shape[0], S.rows.law.shape[0], P.size[NQ]
    stamp(P, k, True)
    for what in range(2):
        step_along(A, dq, dv, GAPS)
        for b in range(S.tree.parent.shape[0]):
            if S.tree.law[b] >= 0:
                dq[S.tree.v[b]] = WC.y[0, S.tree.q[b]].imag / STEP
                dv[S.tree.v[b]] = WC.y[0, nq + S.tree.v[b]].imag / STEP
        if nr > 0:
            for d in range(nv):
                rows[0, d] = 0.0
            for r in range(nr):
                rows[1, r] = -B.out[0, nv + what * nr + r].imag / STEP
            respond(A)
            for d in range(nv):
                if what == 0:
                    dq[d] += rows[2, d]
                else:
                    dv[d] += rows[2, d]
    stamp(P, k, False)


@formula
def change(A, P, k, dq, dv, rate, powers):
    """Rates (2 nv,) of changes of positions and velocities with parameter k, and changes (nz,) of powers.

    Changes of accelerations, multipliers and efforts go to ``P.found[k]``.
    """
    S, W, WC = A[S_], A[W_], A[WC_]
    nv, nr = dq.shape[0], S.rows.law.shape[0]
    found = P.found[k]
    stamp(P, k, True)
    step_along(A, dq, dv, ALONG)
    stamp(P, k, False)
    solved(A, P, found, 1.0)
    for i in range(powers.shape[0]):
        powers[i] = 0.0
    for f in range(S.forces.F.shape[0]):
        if S.forces.work[f] >= 0:
            powers[S.forces.work[f]] = WC.y[1, S.forces.work[f]].imag / STEP
    if P.pressing.shape[0] > 0:
        shared(P, found, powers, nv)
    for r in range(nr):
        if S.rows.work[r] >= 0:
            nu = WC.rows.nu[r]
            powers[S.rows.work[r]] = found[nv + r] * nu.real + W.rows.multiplier[r] * nu.imag / STEP
    for b in range(S.tree.parent.shape[0]):
        if S.tree.law[b] >= 0:
            d = S.tree.v[b]
            found[d] = WC.velocities.prescribed[d].imag / STEP
            powers[S.tree.work[b]] = found[nv + nr + d] * A[BENCH].state[P.size[NQ] + d].real + P.effort[d] * dv[d]
    for d in range(nv):
        rate[d] = dv[d]
        rate[nv + d] = found[d]
    turned(S, A[BENCH].state, P.size[NQ], dq, rate)


@formula
def solved(A, P, found, sign):
    """Accelerations, multipliers and efforts that take away what the residuals miss along the last complex step."""
    S, W, B, rows = A[S_], A[W_], A[BENCH], A[SHEET].rows
    nv, nr = P.zero.shape[0], S.rows.law.shape[0]
    for d in range(nv):
        rows[0, d] = -B.out[0, d].imag / STEP
    for r in range(nr):
        rows[1, r] = -B.out[0, nv + 2 * nr + r].imag / STEP * sign
    respond(A)
    for d in range(nv):
        found[d] = rows[2, d]
        found[nv + nr + d] = W.velocities.effort[d]
    for r in range(nr):
        found[nv + r] = rows[3, r]


@formula
def turned(S, state, nq, dq, rate):
    """Add N dq: changes of rotations have components along axes that turn."""
    for b in range(S.tree.parent.shape[0]):
        _, w = quaternion_at(S, b)
        if w >= 0:
            x, y, z = state[nq + w].real, state[nq + w + 1].real, state[nq + w + 2].real
            rate[w] += z * dq[w + 1] - y * dq[w + 2]
            rate[w + 1] += x * dq[w + 2] - z * dq[w]
            rate[w + 2] += y * dq[w] - x * dq[w + 1]


@formula
def press(A, P):
    """What friction under a unit of each multiplier that it depends on makes of everything."""
    S, W, WC, B = A[S_], A[W_], A[WC_], A[BENCH]
    for j in range(P.pressing.shape[0]):
        r = P.pressing[j]
        B.lam[r] = complex(W.rows.multiplier[r], STEP)
        step_along(A, P.zero, P.zero, STEPS)
        B.lam[r] = complex(W.rows.multiplier[r], 0.0)
        for e in range(S.row_start[r], S.row_start[r + 1]):  # less what the reaction itself does
            B.out[0, S.column[e]] += complex(0.0, STEP * W.G[e])
        solved(A, P, P.by_press[j], 0.0)
        for i in range(P.by_power.shape[1]):
            P.by_power[j, i] = 0.0
        for f in range(S.forces.F.shape[0]):
            i = S.forces.work[f]
            if i >= 0:
                P.by_power[j, i] = WC.y[1, i].imag / STEP


@formula
def shared(P, found, powers, nv):
    """Add what friction makes of the changes of reactions that it makes itself."""
    m = P.pressing.shape[0]
    for j in range(m):
        at = nv + P.pressing[j]
        for i in range(m):
            P.share[j, i] = -P.by_press[i, at]
        P.share[j, j] += 1.0
        P.share[j, m] = found[at]
    eliminate(P.share)
    for j in range(m):
        x = P.share[j, m]
        for i in range(found.shape[0]):
            found[i] += x * P.by_press[j, i]
        for i in range(powers.shape[0]):
            powers[i] += x * P.by_power[j, i]


@formula
def eliminate(A):
    """Solve the equations [A | b] in place (Gauss and Jordan, with row pivots); the solution is the last column."""
    m = A.shape[0]
    for j in range(m):
        best = j
        for i in range(j + 1, m):
            if absolute(A[i, j]) > absolute(A[best, j]):
                best = i
        for i in range(j, m + 1):
            A[j, i], A[best, i] = A[best, i], A[j, i]
        for i in range(m):
            if i != j:
                x = A[i, j] / A[j, j]
                for n in range(j, m + 1):
                    A[i, n] -= x * A[j, n]
        x = A[j, j]
        for n in range(j, m + 1):
            A[j, n] /= x
