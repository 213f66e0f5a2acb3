"""Velocities of the mechanism after a step without contact: forces at half the step, where drivers are then.

Positions go half a step on with the velocities before. There everything is evaluated, at the mean of the velocities
before and after: a step that is symmetric in time, so of second order; it keeps the energy of what turns (gyroscopic
terms) at any step. The mean is found by Anderson's mixing (1965; Walker and Ni 2011), which for one that depends
linearly on itself is as good as GMRES; springs and dampers that are stiff are solved for with the masses.
"""

from __future__ import annotations

from ..compiler.formulas import call, formula
from ..equations.tasks import MOTION
from ..equations.tree import retract
from ..math.scalar import sqrt
from .gauges import note_bends, note_lengths
from .implicit import implied, stiffened, take_springs
from .joined import CHANGE, EFFORTS, NOT_SETTLED, SMOOTH, V_BEFORE

MIXED = 5  # evaluations that the next guess is made of
MOST = 40
CLOSE = 1e-10  # part of the velocities, or of their change, by which the last guess may be off
# rows of Joined.mixing: of each guess in memory what it missed, and the guess; then what is missed now, and half a way
MISSED, GUESSED, NOW, HALF, MIXING = 0, MIXED, 2 * MIXED, 2 * MIXED + 1, 2 * MIXED + 2
NOTHING = 1e-12  # part of a column that is left of it: it says nothing new


@formula
def free_velocities(A):
    """Go half a step on, and find there how the velocities change by all but contact. Returns a status."""
    nq, nv = A.S.sizes.coordinates, A.wide.shape[1]
    y, h = A.clock.y, A.real.step
    before, change, half = A.wide[V_BEFORE], A.wide[CHANGE], A.mixing[HALF]
    for d in range(nv):
        before[d] = y[0, nq + d]
        change[d] = 0.0
        half[d] = 0.5 * h * before[d]
    retract(A.S, y[0, :nq], half)
    A.clock.real.t = A.real.time + 0.5 * h
    for n in range(MOST):
        for d in range(nv):
            y[0, nq + d] = before[d] + 0.5 * change[d]
        status = call(A.door[0], A.S, A.W, A.R, A.clock, A.sheet, MOTION)
        A.count.evaluated += 1
        if status != 0:
            return status
        put_aside(A, h)
        if n == 0:
            take_springs(A, h)
            note_lengths(A)
        note_bends(A)
        miss(A, h)
        if close(A):
            return 0
        if n < MOST - 1:
            guess(A, n)
    A.count.unsettled += 1
    return 0 if A.count.anyhow != 0 else NOT_SETTLED


@formula
def put_aside(A, h):
    """What the evaluation found: h vdot, multipliers, efforts of drivers. Solving for others writes over it."""
    nq = A.S.sizes.coordinates
    for d in range(A.wide.shape[1]):
        A.wide[SMOOTH, d] = h * A.clock.K[0, nq + d]
        A.wide[EFFORTS, d] = A.W.velocities.effort[d]
    for r in range(A.lam.shape[1]):
        A.lam[0, r] = A.W.rows.multiplier[r]


@formula
def miss(A, h):
    """By how much the change of velocities is not what it makes of itself."""
    now, change = A.mixing[NOW], A.wide[CHANGE]
    for d in range(now.shape[0]):
        now[d] = A.wide[SMOOTH, d] - change[d]
    for i in range(A.count.springs):
        s = implied(A, h, i, A.wide[V_BEFORE], change)
        for d in range(now.shape[0]):
            now[d] -= s * A.spring_Y[i, d]
    stiffened(A, now)


@formula
def close(A):
    """Whether the change of velocities is what it makes of itself; then it is made so to the last digit."""
    size = 1e-300
    worst = 0.0
    for d in range(A.wide.shape[1]):
        size = max(size, abs(A.wide[V_BEFORE, d]) + abs(A.wide[CHANGE, d]))
        worst = max(worst, abs(A.mixing[NOW, d]))
    return worst <= CLOSE * size


@formula
def guess(A, n):
    """The next change of velocities: what the last ones would miss least of, mixed, and what it makes of itself."""
    mixing, C, change = A.mixing, A.weight, A.wide[CHANGE]
    now = mixing[NOW]
    kept = min(n, MIXED)
    for i in range(kept):  # normal equations of |now - sum w_i (now - missed_i)|
        for j in range(i + 1):
            C[i, j] = 0.0
        C[i, MIXED] = 0.0
        for d in range(now.shape[0]):
            a = now[d] - mixing[MISSED + i, d]
            C[i, MIXED] += a * now[d]
            for j in range(i + 1):
                C[i, j] += a * (now[d] - mixing[MISSED + j, d])
    weigh(C, kept)
    slot = n % MIXED
    for d in range(now.shape[0]):
        to = change[d] + now[d]
        for i in range(kept):
            to -= C[i, MIXED] * (change[d] - mixing[GUESSED + i, d] + now[d] - mixing[MISSED + i, d])
        mixing[GUESSED + slot, d] = change[d]
        mixing[MISSED + slot, d] = now[d]
        change[d] = to


@formula
def weigh(C, n):
    """Solve n normal equations by Cholesky's factor, in place; what says nothing new has no weight."""
    for i in range(n):
        whole = C[i, i]
        for j in range(i + 1):
            s = C[i, j]
            for k in range(j):
                s -= C[i, k] * C[j, k]
            if j < i:
                C[i, j] = s / C[j, j] if C[j, j] > 0.0 else 0.0
            else:
                C[i, i] = sqrt(s) if s > NOTHING * whole else 0.0
        s = C[i, MIXED]
        for k in range(i):
            s -= C[i, k] * C[k, MIXED]
        C[i, MIXED] = s / C[i, i] if C[i, i] > 0.0 else 0.0
    for i in range(n - 1, -1, -1):
        s = C[i, MIXED]
        for k in range(i + 1, n):
            s -= C[k, i] * C[k, MIXED]
        C[i, MIXED] = s / C[i, i] if C[i, i] > 0.0 else 0.0
