"""Springs and dampers of the mechanism treated implicitly, as a low-rank addition to the mass matrix.

A force s along J v, with stiffness k and damping c, is taken at

    x + (1 - b) / 4 h (r+ - r-) + b h r+   and   (1 - b) / 2 r- + (1 + b) / 2 r+

where x is the position at half the step, and r- and r+ are the rates at the ends of the step: J v- and J v+ less and
plus h / 2 times the bias acceleration. With b = 0 this is the trapezoidal rule, which conserves the energy of a linear
spring; with b = 1 a stiff spring is at rest after two steps. In between it is stable for any h, k, c: with z = h^2 k /
m the matrix of one step has the determinant (1 + (1 - b) / 4 z) / (1 + b' z), where b' = (1 + 3 b) / 4. b grows with
the square of z, so that the step stays of second order. M + J' A J, with A = h^2 k b' + h c (1 + b) / 2, is inverted by
the Sherman-Morrison-Woodbury formula.

The end of a rotating stiff spring leaves the line along which the spring was linearised by w^2 h^2 / 8 of its length,
more than a stiff spring ever deflects. Its length at the end of the step is therefore corrected along its own response.
"""

from __future__ import annotations

from ...compiler.formulas import call, formula
from ...engine.calls import POSITION, SLOPES, SOLVE
from ...engine.kinematics import load_record, project_wrench, retract
from ...engine.residual import DAMPING, DIRECTIONS, STIFFNESS, probe_direction
from ...engine.solve import apply_inverse_mass
from ...math.rotation import rotation_vector
from ...math.scalar import sqrt
from ...math.vec import col, dot, mm, norm, sub, transpose
from ...tables.table_definitions import SCHUR

SOFT_SPRING = 1e-3  # h^2 k / m + h c / m below which a spring is evaluated explicitly at half the step


@formula
def add_wrench_power(S, W, b, out, at, sign, force, torque, point):
    """Add the power of a wrench on body b for unit velocities of all bodies that carry it; ``out[at]`` is that of
    velocity 0.
    """
    while b >= 0:
        if S.tree.nv[b] > 0:
            project_wrench(S, W, b, out, at + S.tree.v[b], sign, force, torque, point)
        b = S.tree.parent[b]


@formula
def spring_gradient(S, W, k, n, i, row):
    """Compute the gradient of direction i of n of force k, as a row over all velocities."""
    for d in range(row.shape[0]):
        row[d] = 0.0
    if S.forces.family[k] == 1:
        r = S.rows.law.shape[0] + S.forces.F[k]
        for e in range(S.row_start[r], S.row_start[r + 1]):
            row[S.column[e]] += W.G[e]
        return
    F, M = load_record(W.frames, S.forces.F[k]), load_record(W.frames, S.forces.M[k])
    axis = probe_direction(F, M[0], n, i)
    zero = (0.0, 0.0, 0.0)
    force, torque = (axis, zero) if i < 3 else (zero, axis)
    add_wrench_power(S, W, S.frame_body[S.forces.M[k]], row, 0, 1.0, force, torque, M[0])
    add_wrench_power(S, W, S.frame_body[S.forces.F[k]], row, 0, -1.0, force, torque, M[0])


@formula
def dot_rows(a, b):
    """Scalar product of two rows."""
    s = 0.0
    for d in range(a.shape[0]):
        s += a[d] * b[d]
    return s


@formula
def impulse_response(A, force, out):
    """Compute the change of velocities by generalised impulses with closed joints, without implicit springs."""
    nv, nr = A.velocities.before.shape[0], A.S.rows.law.shape[0]
    rows = A.output.rows
    for d in range(nv):
        rows[0, d] = force[d]
    for r in range(nr):
        rows[1, r] = 0.0
    call(A.door[0], A.S, A.W, A.R, A.clock, A.output, SOLVE)
    for d in range(nv):
        out[d] = rows[2, d]


@formula
def find_implicit_springs(A, h):
    """Find the springs to be treated implicitly, at the state evaluated last, and factorise their contribution."""
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
            if stiffness + damping > 0.0 and add_spring(A, h, used, (k, n, i), stiffness, damping):
                A.springs.force[used] = k
                A.springs.directions[used], A.springs.direction[used] = n, i
                used += 1
    A.count.springs = used
    factor_springs(A)


@formula
def add_spring(A, h, n, which, stiffness, damping):
    """Write a spring into row n of the tables. Returns whether it is stiff enough to be kept."""
    J, Y, x = A.spring_J[n], A.spring_Y[n], A.springs
    spring_gradient(A.S, A.W, which[0], which[1], which[2], J)
    z = h * (h * stiffness + damping)
    if A.S.sizes.solver == SCHUR:  # joints never increase the response
        for b in range(A.S.tree.parent.shape[0]):
            apply_inverse_mass(A.S, b, J, A.S.tree.v[b], Y, A.S.tree.v[b])
        if z * dot_rows(J, Y) < SOFT_SPRING:
            return False
    impulse_response(A, J, Y)
    z *= dot_rows(J, Y)
    if z < SOFT_SPRING:
        return False
    y = (0.25 * z) * (0.25 * z)
    share = y / (1.0 + y)
    x.stiffness[n], x.damping[n], x.implicit_share[n] = stiffness, damping, share
    x.added_mass[n] = h * h * stiffness * (0.25 + 0.75 * share) + h * damping * (0.5 + 0.5 * share)
    return True


@formula
def factor_springs(A):
    """Compute the Cholesky factor of 1 / A + J M^-1 J'."""
    C = A.stiff
    for i in range(A.count.springs):
        for j in range(i + 1):
            s = dot_rows(A.spring_J[i], A.spring_Y[j])
            if i == j:
                s += 1.0 / A.springs.added_mass[i]
            for k in range(j):
                s -= C[i, k] * C[j, k]
            C[i, j] = sqrt(s) if i == j else s / C[j, j]


@formula
def with_spring_response(A, x):
    """Change a response without springs to one with them, in place."""
    n, t = A.count.springs, A.springs
    for i in range(n):
        t.solution[i] = dot_rows(A.spring_J[i], x)
    solve_springs(A)
    for i in range(n):
        for d in range(x.shape[0]):
            x[d] -= t.solution[i] * A.spring_Y[i, d]


@formula
def solve_springs(A):
    """Solve with the Cholesky factor, in place."""
    n, C, t = A.count.springs, A.stiff, A.springs
    for i in range(n):
        s = t.solution[i]
        for k in range(i):
            s -= C[i, k] * t.solution[k]
        t.solution[i] = s / C[i, i]
    for i in range(n - 1, -1, -1):
        s = t.solution[i]
        for k in range(i + 1, n):
            s -= C[k, i] * t.solution[k]
        t.solution[i] = s / C[i, i]


@formula
def spring_impulse(A, h, i, before, change):
    """Return the impulse of spring i beyond that of the force at half the step, for this change of velocities."""
    x = A.springs
    b, bend = x.implicit_share[i], h * x.bias[i]
    r, dr = dot_rows(A.spring_J[i], before) - 0.5 * bend, dot_rows(A.spring_J[i], change) + bend
    return h * h * x.stiffness[i] * (b * (r - 0.125 * bend) + (0.25 + 0.75 * b) * dr) + 0.5 * h * x.damping[i] * b * dr


LENGTH_ITERATIONS = 3
STIFF_SHARE = 1e-3  # implicit share b above which the length of a spring is corrected
LENGTH_TOLERANCE = (
    1e-12  # negligible change of a spring's length, relative to itself and to the mechanism's length or a radian
)


@formula
def force_length(S, W, k, n, i):
    """Return the length of force k along its direction i of n, at the kinematics in W."""
    if S.forces.family[k] == 1:
        return W.sensed.value[S.forces.F[k]]
    F, M = load_record(W.frames, S.forces.F[k]), load_record(W.frames, S.forces.M[k])
    line = sub(M[0], F[0])
    if n == 1:
        return norm(line)
    if i < 3:
        return dot(col(F[1], i), line)
    return rotation_vector(mm(transpose(F[1]), M[1]))[i - 3]


@formula
def spring_length(A, i):
    """`force_length` of spring i of the step."""
    x = A.springs
    return force_length(A.S, A.W, int(x.force[i]), int(x.directions[i]), int(x.direction[i]))


@formula
def length_unit(A, i):
    """Return the mechanism's length, or a radian if `spring_length` of spring i is an angle."""
    k = int(A.springs.force[i])
    if A.S.forces.family[k] == 1:
        return A.S.units[A.S.forces.F[k]]
    return A.S.scales.length if A.springs.direction[i] < 3.0 else 1.0


@formula
def save_spring_biases(A):
    """Store the bias accelerations of the springs' lengths."""
    for i in range(A.count.springs):
        x = A.springs
        k = int(x.force[i])
        x.bias[i] = 0.0
        if A.S.forces.family[k] == 1:
            x.bias[i] = A.W.sensed.bias[A.S.forces.F[k]]
        elif x.directions[i] < 2.0:
            x.bias[i] = distance_bias(
                load_record(A.W.frames, A.S.forces.F[k]), load_record(A.W.frames, A.S.forces.M[k])
            )


@formula
def distance_bias(F, M):
    """Return the bias acceleration of the distance of two origins."""
    d, u = sub(M[0], F[0]), sub(M[3], F[3])
    far = norm(d)
    if not far > 0.0:
        return 0.0
    rate = dot(d, u) / far
    return (dot(u, u) - rate * rate + dot(d, sub(M[5], F[5]))) / far


@formula
def save_spring_lengths(A):
    """Store the lengths of the springs at half the step."""
    for i in range(A.count.springs):
        A.springs.length[i] = spring_length(A, i)


@formula
def correct_spring_lengths(A):
    """Correct the positions at the end of the step, so that spring lengths agree with their linearised values."""
    stiff = False
    for i in range(A.count.springs):
        stiff = stiff or A.springs.implicit_share[i] > STIFF_SHARE
    if not stiff:
        return
    h = A.real.step
    q = A.clock.y.current[: A.S.sizes.coordinates]
    step = A.mixing[0]
    for _ in range(LENGTH_ITERATIONS):
        call(A.door[0], A.S, A.W, A.R, A.clock, A.output, POSITION)
        worst = 0.0
        for i in range(A.count.springs):
            x = A.springs
            told = x.length[i] + dot_rows(A.spring_J[i], A.velocities.displacement) + 0.125 * h * h * x.bias[i]
            x.solution[i] = spring_length(A, i) - told
            worst = max(worst, abs(x.solution[i]) / (length_unit(A, i) + abs(told)))
        if not LENGTH_TOLERANCE < worst < 1.0:
            return
        solve_springs(A)
        for d in range(step.shape[0]):
            step[d] = 0.0
        for i in range(A.count.springs):
            for d in range(step.shape[0]):
                step[d] -= A.springs.solution[i] * A.spring_Y[i, d]
        retract(A.S, q, step)
