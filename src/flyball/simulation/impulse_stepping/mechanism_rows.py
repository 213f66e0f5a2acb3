"""Rows and implicit springs of the jointed mechanism, with their responses to impulses.

Rows belong to its contacts; single rows to stops, ropes and joint friction:

- Stop: velocity and impulse are complementary, as at a contact; it rebounds by Newton's law.
- Rope: it is taut or slack within one step, and treated implicitly as springs are.
- Friction: bounded by its own law, at the load that follows from the reactions of the last step.

The response to a row's impulse is one solve with the factor of the joints, for several rows at once. Groups are
independent of each other, so that one solve gives the response of a row of each group. The factor is that of the last
evaluation, at the same positions.

Springs and dampers are treated implicitly, as a low-rank addition to the mass matrix. A force s along J v, with
stiffness k and damping c, is taken at

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
from ...engine.loads import dry_friction, reaction_loads, static_friction_limit
from ...engine.residual import DAMPING, DIRECTIONS, STIFFNESS, probe_direction
from ...engine.solve import apply_inverse_mass
from ...math.rotation import rotation_vector
from ...math.scalar import sqrt
from ...math.vec import add, col, dot, load3, mm, norm, sub, transpose
from ...numerics.complementarity.contact_operator import find_columns, row_product
from ...numerics.complementarity.contact_problem import FIXED_SIDE
from ...numerics.sparse_factorisation import COLUMNS, add_columns, ldl_solve_columns, load_columns, store_columns
from ...tables.table_definitions import SCHUR, STEP
from .stepping_tables import LINE_FRICTION, LINE_ROPE, LINE_STOP, TABLES_FULL

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
    found, x = A.slopes.rows, A.springs
    some, used = 0, 0
    for k in range(S.forces.F.shape[0]):
        n = max(1, int(found[k, DIRECTIONS]))
        for i in range(n):
            stiffness, damping = max(0.0, found[k, STIFFNESS + i]), max(0.0, found[k, DAMPING + i])
            if stiffness + damping > 0.0 and may_be_stiff(A, some, (k, n, i), h * (h * stiffness + damping)):
                x.stiffness[some], x.damping[some], x.force[some] = stiffness, damping, k
                x.directions[some], x.direction[some] = n, i
                some += 1
    spring_responses(A, some)
    for n in range(some):
        if keep_spring(A, h, n, used):
            used += 1
    A.count.springs = used
    factor_springs(A)


@formula
def may_be_stiff(A, n, which, added):
    """Write the gradient of a spring to row n. Returns whether it is stiff without joints, which only stiffen bodies.

    ``added``: h^2 k + h c.
    """
    J, Y = A.spring_J[n], A.spring_Y[n]
    spring_gradient(A.S, A.W, which[0], which[1], which[2], J)
    if A.S.sizes.solver != SCHUR:
        return True
    for b in range(A.S.tree.parent.shape[0]):
        apply_inverse_mass(A.S, b, J, A.S.tree.v[b], Y, A.S.tree.v[b])
    return added * dot_rows(J, Y) >= SOFT_SPRING


@formula
def spring_responses(A, count):
    """Compute the responses to the first ``count`` springs, `COLUMNS` at once where joints are solved so."""
    if not is_solved_by_schur(A):
        for n in range(count):
            impulse_response(A, A.spring_J[n], A.spring_Y[n])
        return
    nv = A.response.shape[0]
    for begin in range(0, count, COLUMNS):
        many = min(COLUMNS, count - begin)
        clear_columns(A)
        for c in range(many):
            load_column(A, A.spring_J[begin + c], 0, (0, nv), c)
        solve_columns(A)
        for d in range(nv):
            for c in range(many):
                A.spring_Y[begin + c, d] = A.response[d, c]


@formula
def keep_spring(A, h, n, to):
    """Move spring n to row ``to`` of the tables, if it is stiff enough. Returns whether it is."""
    x, J, Y = A.springs, A.spring_J[to], A.spring_Y[to]
    z = h * (h * x.stiffness[n] + x.damping[n]) * dot_rows(A.spring_J[n], A.spring_Y[n])
    if z < SOFT_SPRING:
        return False
    if to != n:
        for k in range(x.shape[1]):
            x[to, k] = x[n, k]
        for d in range(J.shape[0]):
            J[d], Y[d] = A.spring_J[n, d], A.spring_Y[n, d]
    y = (0.25 * z) * (0.25 * z)
    share = y / (1.0 + y)
    x.implicit_share[to] = share
    x.added_mass[to] = h * h * x.stiffness[to] * (0.25 + 0.75 * share) + h * x.damping[to] * (0.5 + 0.5 * share)
    d = 0
    while J[d] == 0.0:
        d += 1
    for g in range(A.queue.shape[0]):
        if A.group[g] <= d < A.group[g + 1]:
            x.first[to], x.end[to] = A.group[g], A.group[g + 1]
    return True


@formula
def spring_rate(A, i, v):
    """Return the rate of the length of spring i at velocities v."""
    s, J = 0.0, A.spring_J[i]
    for d in range(int(A.springs.first[i]), int(A.springs.end[i])):
        s += J[d] * v[d]
    return s


@formula
def add_spring_response(A, i, impulse, x):
    """Add the response to an impulse along spring i, without springs, to x."""
    Y = A.spring_Y[i]
    for d in range(int(A.springs.first[i]), int(A.springs.end[i])):
        x[d] += impulse * Y[d]


@formula
def factor_springs(A):
    """Compute the Cholesky factor of 1 / A + J M^-1 J'."""
    C = A.stiff
    for i in range(A.count.springs):
        for j in range(i + 1):
            s = spring_rate(A, i, A.spring_Y[j])
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
        t.solution[i] = spring_rate(A, i, x)
    solve_springs(A)
    for i in range(n):
        add_spring_response(A, i, -t.solution[i], x)


@formula
def columns_with_spring_response(A):
    """Do the same for all columns of ``A.response``."""
    n, C, t, x = A.count.springs, A.stiff, A.spring_response, A.response
    zero = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for i in range(n):
        s, J = zero, A.spring_J[i]
        for d in range(int(A.springs.first[i]), int(A.springs.end[i])):
            if J[d] != 0.0:
                s = add_columns(s, J[d], load_columns(x, d))
        for k in range(i):
            s = add_columns(s, -C[i, k], load_columns(t, k))
        store_columns(t, i, add_columns(zero, 1.0 / C[i, i], s))
    for i in range(n - 1, -1, -1):
        s, Y = load_columns(t, i), A.spring_Y[i]
        for k in range(i + 1, n):
            s = add_columns(s, -C[k, i], load_columns(t, k))
        s = add_columns(zero, 1.0 / C[i, i], s)
        store_columns(t, i, s)
        for d in range(int(A.springs.first[i]), int(A.springs.end[i])):
            store_columns(x, d, add_columns(load_columns(x, d), -Y[d], s))


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
    r, dr = spring_rate(A, i, before) - 0.5 * bend, spring_rate(A, i, change) + bend
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
            told = x.length[i] + spring_rate(A, i, A.velocities.displacement) + 0.125 * h * h * x.bias[i]
            x.solution[i] = spring_length(A, i) - told
            worst = max(worst, abs(x.solution[i]) / (length_unit(A, i) + abs(told)))
        if not LENGTH_TOLERANCE < worst < 1.0:
            return
        solve_springs(A)
        for d in range(step.shape[0]):
            step[d] = 0.0
        for i in range(A.count.springs):
            add_spring_response(A, i, -A.springs.solution[i], step)
        retract(A.S, q, step)


REST_SHARE = 1e-9  # negligible rate, relative to the deceleration by friction within a step
STOP_LOOKAHEAD = 4.0  # a stop gets a row if its coordinate may reach it within this number of steps
INFINITE = 1e300


@formula
def line_group(A, k):
    """Return the group of the quantity of single row k; -1 if nothing moves it."""
    r = A.S.rows.law.shape[0] + A.line.quantity[k]
    for e in range(A.S.row_start[r], A.S.row_start[r + 1]):
        for g in range(A.queue.shape[0]):
            if A.group[g] <= A.S.column[e] < A.group[g + 1]:
                return g
    return -1


@formula
def line_lever(A, k):
    """Return the lever [m] that turns the rate of single row k into a velocity [m/s]; 1 if it is one already."""
    return A.S.scales.length / A.S.units[A.line.quantity[k]]


@formula
def line_rate(A, k, v):
    """Return the rate of the quantity of single row k at velocities v."""
    s = 0.0
    r = A.S.rows.law.shape[0] + A.line.quantity[k]
    for e in range(A.S.row_start[r], A.S.row_start[r + 1]):
        s += A.W.G[e] * v[A.S.column[e]]
    return s


@formula
def stop_gap(A, k, side):
    """Return the gap of a stop at the start of the step; side 1 is the lower stop, -1 the upper."""
    x = A.W.sensed.value[A.line.quantity[k]] - 0.5 * A.real.step * line_rate(A, k, A.velocities.before)
    return x - A.line_law.lower[k] if side > 0 else A.line_law.upper[k] - x


@formula
def line_acts(A, k, side):
    """Return whether single row k acts in this step.

    Of two stops the nearer one always does, since impacts may reach it. The other one does if the motion, or the
    correction of an overrun, may reach it.
    """
    if A.line.kind[k] != LINE_STOP:
        return side > 0
    gap, other = stop_gap(A, k, side), stop_gap(A, k, -side)
    r, dr = line_rate(A, k, A.velocities.before), line_rate(A, k, A.velocities.change)
    return gap <= other or gap < STOP_LOOKAHEAD * (A.real.step * (abs(r) + abs(dr)) + max(0.0, -other))


@formula
def line_rows(A, P, used, jobs, write):
    """Add the active single rows after those of the contacts, if ``write``. Returns (numbers, jobs, rows)."""
    n = 0
    for k in range(A.line.shape[0]):
        g = line_group(A, k)
        if g < 0:
            continue
        for turn in range(2):
            side = 1 - 2 * turn
            if not line_acts(A, k, side):
                continue
            size = A.group[g + 1] - A.group[g]
            if write:
                A.active.line[n], A.active.group[n], A.active.first[n] = side * (k + 1), g, used
                line_row(A, P, k, g, (used, size, side))
            used += size
            jobs += 1
            n += 1
    return used, jobs, n


@formula
def line_row(A, P, k, g, where):
    """Write the gradient of the quantity of single row k times its lever, reversed for an upper stop."""
    at, size, side = where
    lever = side * line_lever(A, k)
    for d in range(size):
        P.J[at + d] = 0.0
    r = A.S.rows.law.shape[0] + A.line.quantity[k]
    for e in range(A.S.row_start[r], A.S.row_start[r + 1]):
        P.J[at + A.S.column[e] - A.group[g]] += lever * A.W.G[e]
    find_columns(P, at, size, 1)


@formula
def line_laws(A, P, n):
    """Set biases, compliances and bounds of the single rows, whose responses are known."""
    h = A.real.step
    P.size[3] = n
    for i in range(n):
        k = abs(A.active.line[i]) - 1
        side = 1 if A.active.line[i] > 0 else -1
        x = P.line_law
        P.line_at[i, 0], P.line_at[i, 1] = A.active.group[i], A.active.first[i]
        x.bias[i], x.soft[i], x.lower[i], x.upper[i] = 0.0, 0.0, 0.0, INFINITE
        if A.line.kind[k] == LINE_STOP:
            lever = line_lever(A, k)
            rate, gap = lever * side * line_rate(A, k, A.velocities.before), lever * stop_gap(A, k, side)
            hit = rate < 0.0 and gap + h * rate <= 0.0
            x.bias[i] = A.line_law.restitution[k] * rate if hit else max(gap, 0.0) / h
        elif A.line.kind[k] == LINE_ROPE:
            rope_law(A, P, i, k, x)
        else:
            friction_law(A, P, i, k, x)


@formula
def friction_law(A, P, i, k, x):
    """Bound friction by -h F and h F; where the rate is zero to rounding, by the static limit."""
    h, lever = A.real.step, line_lever(A, k)
    g, at = A.active.group[i], A.active.first[i]
    w = row_product(P, at, A.group[g + 1] - A.group[g], at, P.Y, at)
    t, arm, load = A.real.time + 0.5 * h, A.line_law.arm[k], A.line_law.load[k]
    rate = line_rate(A, k, A.velocities.before)
    held = h * static_friction_limit(A.S, A.W, A.line.force[k], t, arm, load)
    if lever * abs(rate) > REST_SHARE * held / lever * w:
        held = h * dry_friction(A.S, A.W, A.line.force[k], t, rate, arm, load)
    x.lower[i], x.upper[i] = -held / lever, held / lever


@formula
def rope_law(A, P, i, k, x):
    """Set the law of a rope, -s = h (K (x - x0) + C r), at position and rate as for springs; it never
    pushes.
    """
    h = A.real.step
    K, C = A.line_law.stiffness[k], A.line_law.damping[k]
    g, at = A.active.group[i], A.active.first[i]
    w = row_product(P, at, A.group[g + 1] - A.group[g], at, P.Y, at)
    z = 0.25 * h * (h * K + C) * w
    b = z * z / (1.0 + z * z)
    added = h * h * K * (0.25 + 0.75 * b) + h * C * (0.5 + 0.5 * b)
    bend = h * A.W.sensed.bias[A.line.quantity[k]]
    r = line_rate(A, k, A.velocities.before) - 0.5 * bend
    stretch = A.W.sensed.value[A.line.quantity[k]] - A.line_law.length[k] - 0.125 * b * h * bend
    force = h * K * (stretch - 0.25 * (1.0 - b) * h * r) + 0.5 * h * C * (1.0 - b) * r
    x.bias[i], x.soft[i], x.lower[i], x.upper[i] = 0.5 * bend + force / added, 1.0 / added, -INFINITE, 0.0


@formula
def account_lines(A, P, X):
    """Account for the works of the single rows, and update the loads of joint friction for the next step."""
    for i in range(P.size[3]):
        k = abs(A.active.line[i]) - 1
        side = 1.0 if A.active.line[i] > 0 else -1.0
        impulse = X.line[i] * side * line_lever(A, k)
        work = impulse * 0.5 * (line_rate(A, k, A.velocities.before) + line_rate(A, k, A.velocities.after))
        if A.line.kind[k] == LINE_STOP:
            A.real.lost -= work
        else:
            f = A.line.force[k]
            if A.S.forces.work[f] >= 0:
                z = A.S.sizes.coordinates + A.velocities.before.shape[0] + A.S.forces.work[f]
                A.clock.K[0, z] += work / A.real.step
            A.line_law.reaction[k] = impulse / A.real.step
    update_friction_loads(A)


@formula
def update_friction_loads(A):
    """Compute the loads of joints with friction from the reactions of the step."""
    if A.S.load_terms.load.shape[0] == 0:
        return
    for r in range(A.reactions.smooth.shape[0]):
        A.W.rows.multiplier[r] = A.reactions.smooth[r] + (A.reactions.impulse[r] + A.reactions.impact[r]) / A.real.step
    reaction_loads(A.S, A.W)
    for k in range(A.line.shape[0]):
        if A.line.kind[k] == LINE_FRICTION and A.S.forces.load[A.line.force[k]] >= 0:
            A.line_law.load[k] = A.W.sensed.returned[A.S.forces.load[A.line.force[k]]]


@formula
def keep_stops_only(A, P, X):
    """For the position solve: stops correct their overrun, and no other single row acts."""
    A.real.overrun = 0.0
    for i in range(P.size[3]):
        k = abs(A.active.line[i]) - 1
        side = 1 if A.active.line[i] > 0 else -1
        x = P.line_law
        X.line[i] = 0.0
        x.soft[i] = x.lower[i] = x.upper[i] = 0.0
        if A.line.kind[k] == LINE_STOP:
            mean = 0.5 * (line_rate(A, k, A.velocities.before) + line_rate(A, k, A.velocities.after))
            gap = line_lever(A, k) * (stop_gap(A, k, side) + A.real.step * side * mean)
            A.real.overrun = min(A.real.overrun, gap)
            x.bias[i], x.upper[i] = gap / A.real.step, INFINITE


@formula
def mechanism_contact_rows(A, M, C, P):
    """Write the rows of all contacts on the mechanism into ``P``; the movers in its sides become groups.

    Returns 0, or TABLES_FULL where J and Y, or the table of jobs, are too small for ``A.count.needed`` and
    ``A.count.jobs``.
    """
    first = A.count.first
    rows = 6 if P.turn.shape[0] > 0 else 3
    used, jobs = table_sizes(A, P, rows)
    used, jobs, lines = line_rows(A, P, used, jobs, False)
    A.count.needed, A.count.jobs = used, jobs
    if used > min(P.J.shape[0], P.Y.shape[0]) or jobs > A.job.shape[0] or lines > P.line_at.shape[0]:
        return TABLES_FULL
    for g in range(A.queue.shape[0]):
        A.queue[g] = -1
    used = 0
    jobs = 0
    for c in range(P.size[0]):
        last = -1
        for side in range(2):
            P.block[c, side] = -1
            mover = P.at[c, side]
            if mover < first:
                continue
            b, g = A.mover[mover - first, 0], A.mover[mover - first, 1]
            if g < 0:  # joints fix it to ground
                P.at[c, side] = FIXED_SIDE
                continue
            n = A.group[g + 1] - A.group[g]
            if g == last:  # both sides in one group: the difference
                at = P.block[c, 0]
                for i in range(rows * n):
                    P.J[at + i] = -P.J[at + i]
                P.block[c, 0], P.at[c, 0] = -1, FIXED_SIDE
            else:
                at = used
                for i in range(rows * n):
                    P.J[at + i] = 0.0
                used += rows * n
                queue_row(A, g, jobs, at, rows)
                jobs += 1
            point = add(load3(A.W.bodies.position, b, 0), load3(P.arm, c, 3 * side))
            side_rows(A, P, c, (b, at - A.group[g], n), point, rows)
            find_columns(P, at, n, rows)
            P.block[c, side], P.at[c, side] = at, -2 - g
            last = g
    line_rows(A, P, used, jobs, True)
    for i in range(lines):
        queue_row(A, A.active.group[i], jobs + i, A.active.first[i], 1)
    row_responses(A, P)
    line_laws(A, P, lines)
    return 0


@formula
def table_sizes(A, P, rows):
    """Return how many numbers J and Y hold, and the number of jobs."""
    used = 0
    jobs = 0
    for c in range(P.size[0]):
        last = -1
        for side in range(2):
            mover = P.at[c, side]
            if mover >= A.count.first:
                g = A.mover[mover - A.count.first, 1]
                if g != last and g >= 0:
                    used += rows * (A.group[g + 1] - A.group[g])
                    jobs += 1
                last = g
    return used, jobs


@formula
def queue_row(A, g, job, at, rows):
    """Queue a job: the responses to rows of group g."""
    A.job.first[job], A.job.rows[job], A.job.next[job] = at, rows, A.queue[g]
    A.queue[g] = job


@formula
def side_rows(A, P, c, where, point, rows):
    """Add velocities of a point of body b along the frame of contact c; with six rows also its angular velocity."""
    b, at, n = where
    zero = (0.0, 0.0, 0.0)
    for i in range(rows):
        axis = load3(P.frame, c, 3 * (i % 3))
        force, torque = (axis, zero) if i < 3 else (zero, axis)
        add_wrench_power(A.S, A.W, b, P.J, at + i * n, 1.0, force, torque, point)


@formula
def row_responses(A, P):
    """Compute the responses Y to all queued rows, `COLUMNS` at once, with one row of each group in a column."""
    schur = is_solved_by_schur(A)
    for g in range(A.queue.shape[0]):
        A.queued_row[g] = 0
    columns = queue_columns(A, P, schur)
    while columns > 0:
        if schur:
            solve_columns(A)
        columns_with_spring_response(A)
        read_responses(A, P, columns)
        columns = queue_columns(A, P, schur)


@formula
def is_solved_by_schur(A):
    """Return whether responses follow from the factor of G M^-1 G^T without refinement, and without generated code."""
    return A.S.sizes.solver == SCHUR and A.W.generated[STEP] == 0 and not A.S.scales.semidefinite > 0.0


@formula
def clear_columns(A):
    """Set all columns of ``A.response`` to zero."""
    zero = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for d in range(A.response.shape[0]):
        store_columns(A.response, d, zero)
    for b in range(A.loaded.shape[0]):
        A.loaded[b] = 0


@formula
def load_column(A, J, at, span, c):
    """Write M^-1 J' of a row over the velocities of ``span`` to column c; the row begins at J[at]."""
    S, out = A.S, A.velocities.impulsive
    for b in range(S.tree.parent.shape[0]):
        v, n = S.tree.v[b], S.tree.nv[b]
        if span[0] <= v < span[1]:
            own, used = at + v - span[0], False
            for i in range(n):
                used = used or J[own + i] != 0.0
            if used:
                A.loaded[b] = 1
                apply_inverse_mass(S, b, J, own, out, v)
                for i in range(n):
                    A.response[v + i, c] = out[v + i]


@formula
def queue_columns(A, P, schur):
    """Take the next rows of all groups, and fill the columns with their responses, of `solve_columns` without joints.

    Returns the number of columns.
    """
    clear_columns(A)
    for columns in range(COLUMNS):
        used = False
        for g in range(A.queue.shape[0]):
            at = next_row(A, P, g)
            A.column[g, columns] = at
            used = used or at >= 0
            if schur and at >= 0:
                load_column(A, P.J, at, (A.group[g], A.group[g + 1]), columns)
        if not used:
            return columns
        if not schur:
            fill_impulses(A, P, columns)
            impulse_response(A, A.velocities.impulse, A.velocities.impulsive)
            for d in range(A.response.shape[0]):
                A.response[d, columns] = A.velocities.impulsive[d]
    return COLUMNS


@formula
def next_row(A, P, g):
    """Return the start of the next row of group g whose response is not zero, or -1 if there is none left."""
    n = A.group[g + 1] - A.group[g]
    while A.queue[g] >= 0:
        k = A.queue[g]
        block = A.job.first[k]
        at = block + A.queued_row[g] * n
        A.queued_row[g] += 1
        if A.queued_row[g] == A.job.rows[k]:
            A.queue[g], A.queued_row[g] = A.job.next[k], 0
        for i in range(n):
            if P.columns[block + i] < 0:
                break
            if P.J[at + P.columns[block + i]] != 0.0:
                return at
        for d in range(n):
            P.Y[at + d] = 0.0
    return -1


@formula
def fill_impulses(A, P, c):
    """Set the impulses of the rows in column c."""
    force = A.velocities.impulse
    for d in range(force.shape[0]):
        force[d] = 0.0
    for g in range(A.queue.shape[0]):
        at, a = A.column[g, c], A.group[g]
        if at >= 0:
            for d in range(A.group[g + 1] - a):
                force[a + d] = P.J[at + d]


@formula
def solve_columns(A):
    """Change responses without joints to those with joints: x + M^-1 G^T z with G M^-1 G^T z = -G x."""
    x, z, first, column, place = A.response, A.response_impulse, A.S.row_start, A.S.column, A.S.ldl.perm
    G, H, blocks = A.W.G, A.W.H, A.S.blocks
    for k in range(z.shape[0]):
        store_columns(z, k, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    for e in range(blocks.body.shape[0]):
        b = blocks.body[e]
        if A.loaded[b] != 0:
            k, at, v = place[blocks.row[e]], blocks.entry[e], A.S.tree.v[b]
            s = load_columns(z, k)
            for i in range(A.S.tree.nv[b]):
                s = add_columns(s, -G[at + i], load_columns(x, v + i))
            store_columns(z, k, s)
    ldl_solve_columns(A.S.ldl, A.W.L, A.W.ldl.inverse_diagonal, z)
    for k in range(z.shape[0]):
        s = load_columns(z, place[k])
        for e in range(first[k], first[k + 1]):
            store_columns(x, column[e], add_columns(load_columns(x, column[e]), H[e], s))


@formula
def read_responses(A, P, columns):
    """Read the responses to the rows in the columns."""
    for g in range(A.queue.shape[0]):
        a = A.group[g]
        for d in range(A.group[g + 1] - a):
            for c in range(columns):
                at = A.column[g, c]
                if at >= 0:
                    P.Y[at + d] = A.response[a + d, c]
