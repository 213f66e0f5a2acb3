"""Springs and dampers taken implicitly: what they add to the masses, as an operator of low rank.

A force s along J v, with stiffness k and damping c, is taken at

    x + (1 - b) / 4 h (r+ - r-) + b h r+   and   (1 - b) / 2 r- + (1 + b) / 2 r+

x being where it is at half the step, r- and r+ its rates at the ends of the step: J v- and J v+ less and more what the
curved way adds by itself in half of it (the bias acceleration, h / 2 of it). With b = 0 that is the trapezoidal rule,
which keeps the energy of a linear spring; with b = 1 whatever is stiff is at rest after two steps. Between them it is
stable for any h, k, c: with z = h^2 k / m the matrix of one step has the determinant (1 + (1 - b) / 4 z) / (1 + b' z),
where b' = (1 + 3 b) / 4. b goes with the square of z, so that the step stays of second order.

M + J' A J, with A = h^2 k b' + h c (1 + b) / 2, is inverted by Sherman, Morrison and Woodbury's formula.
"""

from __future__ import annotations

from ..compiler.formulas import call, formula
from ..equations.records import load
from ..equations.slopes import DAMPING, DIRECTIONS, STIFFNESS, direction
from ..equations.solve import inverse_mass
from ..equations.tasks import SLOPES, SOLVE
from ..equations.tree import project
from ..math.scalar import sqrt
from ..tables.system import SCHUR
from .joined import (
    ADDED,
    BEND,
    OF_DIRECTION,
    OF_MANY,
    SHARE,
    SOLVED,
    SPRING_C,
    SPRING_K,
    SPRING_OF,
)

SOFT = 1e-3  # h^2 k / m + h c / m: what is softer than this is left to the evaluation at half the step


@formula
def climb(S, W, b, out, at, sign, force, torque, point):
    """Add the power of a wrench on body b along all velocities that move it; ``out[at]`` is that of velocity 0."""
    while b >= 0:
        if S.tree.nv[b] > 0:
            project(S, W, b, out, at + S.tree.v[b], sign, force, torque, point)
        b = S.tree.parent[b]


@formula
def gradient(S, W, k, n, i, row):
    """What force k acts along, direction i of n, as a row over all velocities."""
    for d in range(row.shape[0]):
        row[d] = 0.0
    if S.forces.family[k] == 1:
        r = S.rows.law.shape[0] + S.forces.F[k]
        for e in range(S.row_start[r], S.row_start[r + 1]):
            row[S.column[e]] += W.G[e]
        return
    F, M = load(W.FK, S.forces.F[k]), load(W.FK, S.forces.M[k])
    axis = direction(F, M[0], n, i)
    zero = (0.0, 0.0, 0.0)
    force, torque = (axis, zero) if i < 3 else (zero, axis)
    climb(S, W, S.frame_body[S.forces.M[k]], row, 0, 1.0, force, torque, M[0])
    climb(S, W, S.frame_body[S.forces.F[k]], row, 0, -1.0, force, torque, M[0])


@formula
def dot_rows(a, b):
    """Scalar product of two rows."""
    s = 0.0
    for d in range(a.shape[0]):
        s += a[d] * b[d]
    return s


@formula
def respond(A, force, out):
    """What generalised impulses change the velocities by, rows of joints closed; springs have no say."""
    nv, nr = A.wide.shape[1], A.S.rows.law.shape[0]
    rows = A.sheet.rows
    for d in range(nv):
        rows[0, d] = force[d]
    for r in range(nr):
        rows[1, r] = 0.0
    call(A.door[0], A.S, A.W, A.R, A.clock, A.sheet, SOLVE)
    for d in range(nv):
        out[d] = rows[2, d]


@formula
def take_springs(A, h):
    """Find what is to be taken implicitly, at the state evaluated last, and factor what it adds."""
    S, W = A.S, A.W
    A.count.springs = 0
    if S.forces.F.shape[0] == 0:
        return
    call(A.door[0], S, W, A.R, A.clock, A.slopes, SLOPES)
    found = A.slopes.rows
    used = 0
    for k in range(S.forces.F.shape[0]):
        n = max(1, int(found[k, DIRECTIONS]))
        for i in range(n):
            stiffness, damping = max(0.0, found[k, STIFFNESS + i]), max(0.0, found[k, DAMPING + i])
            if stiffness + damping > 0.0 and one_spring(A, h, used, (k, n, i), stiffness, damping):
                A.spring_x[used, SPRING_OF] = k
                A.spring_x[used, OF_MANY], A.spring_x[used, OF_DIRECTION] = n, i
                used += 1
    A.count.springs = used
    factor_springs(A)


@formula
def one_spring(A, h, n, which, stiffness, damping):
    """Put a spring into row n of the tables; whether it is stiff enough to stay there."""
    J, Y, x = A.spring_J[n], A.spring_Y[n], A.spring_x[n]
    gradient(A.S, A.W, which[0], which[1], which[2], J)
    z = h * (h * stiffness + damping)
    if A.S.sizes.solver == SCHUR:  # joints make nothing lighter
        for b in range(A.S.tree.parent.shape[0]):
            inverse_mass(A.S, b, J, A.S.tree.v[b], Y, A.S.tree.v[b])
        if z * dot_rows(J, Y) < SOFT:
            return False
    respond(A, J, Y)
    z *= dot_rows(J, Y)
    if z < SOFT:
        return False
    y = (0.25 * z) * (0.25 * z)
    share = y / (1.0 + y)
    x[SPRING_K], x[SPRING_C], x[SHARE] = stiffness, damping, share
    x[ADDED] = h * h * stiffness * (0.25 + 0.75 * share) + h * damping * (0.5 + 0.5 * share)
    return True


@formula
def factor_springs(A):
    """Cholesky's factor of 1 / A + J M^-1 J'."""
    C = A.stiff
    for i in range(A.count.springs):
        for j in range(i + 1):
            s = dot_rows(A.spring_J[i], A.spring_Y[j])
            if i == j:
                s += 1.0 / A.spring_x[i, ADDED]
            for k in range(j):
                s -= C[i, k] * C[j, k]
            C[i, j] = sqrt(s) if i == j else s / C[j, j]


@formula
def stiffened(A, x):
    """Turn a response without springs into one with them, in place."""
    n, t = A.count.springs, A.spring_x
    for i in range(n):
        t[i, SOLVED] = dot_rows(A.spring_J[i], x)
    solve_springs(A)
    for i in range(n):
        for d in range(x.shape[0]):
            x[d] -= t[i, SOLVED] * A.spring_Y[i, d]


@formula
def solve_springs(A):
    """Solve with Cholesky's factor, in place."""
    n, C, t = A.count.springs, A.stiff, A.spring_x
    for i in range(n):
        s = t[i, SOLVED]
        for k in range(i):
            s -= C[i, k] * t[k, SOLVED]
        t[i, SOLVED] = s / C[i, i]
    for i in range(n - 1, -1, -1):
        s = t[i, SOLVED]
        for k in range(i + 1, n):
            s -= C[k, i] * t[k, SOLVED]
        t[i, SOLVED] = s / C[i, i]


@formula
def implied(A, h, i, before, change):
    """Impulse against spring i beyond the force at half the step and half the change of velocities."""
    x = A.spring_x[i]
    b, bend = x[SHARE], h * x[BEND]
    r, dr = dot_rows(A.spring_J[i], before) - 0.5 * bend, dot_rows(A.spring_J[i], change) + bend
    return h * h * x[SPRING_K] * (b * (r - 0.125 * bend) + (0.25 + 0.75 * b) * dr) + 0.5 * h * x[SPRING_C] * b * dr
