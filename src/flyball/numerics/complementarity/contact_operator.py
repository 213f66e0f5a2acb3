"""The operator N from impulses to velocities, its diagonal blocks, and residuals of a solution.

Velocities and impulses of a contact are tuples along its frame: normal, two tangential; of its rotation: about
the normal, about the two tangential axes. ``v`` (nn, 6 or more) and ``wide`` are any velocities of nodes and of
groups. A symmetric diagonal block is six numbers: nn, ns, nt, ss, st, tt.

The residual is that of the natural map: a solution is a fixed point of p -> P(p - s u), with P the projection on the
cone. The deviation from it, divided by s, is a velocity [m/s]; divided by the largest impulse of all contacts it is
the dimensionless force residual. Each contact has its own s: three over the trace of its diagonal block (for torques
likewise, in length units that make both blocks equally large), so that light and heavy contacts count equally. The
velocity residual is the largest of all contacts and lines. In stacks with large mass ratios a small velocity residual
may hide wrong impulses, hence the force residual.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from ...math.vec import add, cross, dot, load3, load9, mtv, mv, neg, scale, store3, sub, symmetric
from .cone_projection import least_normal_impulse, project_on_cone_above, project_on_rolling_cone
from .contact_problem import (
    FIXED_SIDE,
    LIMIT_REACHED,
    SOLVE_FAILED,
)


@formula
def point_velocity(v, i, P, c, side):
    """Velocity at the contact of the point fixed to a node."""
    return add(load3(v, i, 0), cross(load3(v, i, 3), load3(P.arm, c, 3 * side)))


@formula
def contact_velocity(P, v, wide, c):
    """D v of contact c [m/s], without bias: velocity of side 2 minus that of side 1."""
    u = node_velocity(P, v, c)
    return add(u, group_velocity(P, wide, c, 0)) if is_in_group(P, c) else u


@formula
def is_in_group(P, c):
    """Whether a side of contact c is in a group."""
    return P.at[c, 0] < FIXED_SIDE or P.at[c, 1] < FIXED_SIDE


@formula
def node_velocity(P, v, c):
    """Contribution of the nodes to `contact_velocity`."""
    i, j = P.at[c, 0], P.at[c, 1]
    u = (0.0, 0.0, 0.0)
    if j >= 0:
        u = point_velocity(v, j, P, c, 1)
    if i >= 0:
        u = sub(u, point_velocity(v, i, P, c, 0))
    return to_contact_frame(P, c, u)


@formula
def to_contact_frame(P, c, x):
    """Components of a world vector along the contact's frame."""
    return mv(load9(P.frame, c, 0), x)


@formula
def to_world_frame(P, c, n, s, t):
    """World vector with these components along the contact's frame."""
    return mtv(load9(P.frame, c, 0), (n, s, t))


@formula
def find_columns(P, e, n, rows):
    """List the columns that are not zero of the block of J at e, of ``rows`` rows of a group of n velocities.

    They are the velocities of the bodies that carry the contact or line, few of a large group.
    """
    many = 0
    for k in range(n):
        used = False
        for r in range(rows):
            used = used or P.J[e + r * n + k] != 0.0
        if used:
            P.columns[e + many] = k
            many += 1
    if many < n:
        P.columns[e + many] = -1


@formula
def row_product(P, e, n, row, x, first):
    """Product of the row of J at ``row``, of the block at e, and n numbers of x from ``first`` on."""
    s = 0.0
    for i in range(n):
        k = P.columns[e + i]
        if k < 0:
            break
        s += P.J[row + k] * x[first + k]
    return s


@formula
def group_velocity(P, wide, c, first):
    """Contribution of the groups to three velocities of a contact: rows ``first`` and following of J."""
    x, y, z = 0.0, 0.0, 0.0
    for side in range(2):
        e = P.block[c, side]
        if P.at[c, side] < FIXED_SIDE and e >= 0:
            g = -2 - P.at[c, side]
            w, n = P.group[g], P.group[g + 1] - P.group[g]
            J, v, columns = P.J[e + first * n : e + (first + 3) * n], wide[w : w + n], P.columns[e : e + n]
            for i in range(n):
                k = columns[i]
                if k < 0:
                    break
                a = v[k] if side == 1 else -v[k]
                x += J[k] * a
                y += J[n + k] * a
                z += J[2 * n + k] * a
    return x, y, z


@formula
def apply_to_groups(P, wide, c, first, p):
    """Change the velocities of groups by three impulses p of a contact; zeros, as in a plane, cost nothing."""
    for side in range(2):
        e = P.block[c, side]
        if P.at[c, side] < FIXED_SIDE and e >= 0:
            g = -2 - P.at[c, side]
            w, n = P.group[g], P.group[g + 1] - P.group[g]
            e += first * n
            sign = 2.0 * side - 1.0
            for r in range(3):
                a = sign * p[r]
                if a != 0.0:
                    add_multiple(wide[w : w + n], a, P.Y[e : e + n])
                e += n


@formula
def add_multiple(x, a, y):
    """X += a y, for arrays of one length."""
    for k in range(x.shape[0]):
        x[k] += a * y[k]


@formula
def symmetric_block(A, i, o):
    """Read a symmetric matrix stored as xx yy zz xy xz yz in row i from column o, for `math.vec.symmetric`."""
    return (A[i, o], A[i, o + 3], A[i, o + 4], A[i, o + 1], A[i, o + 5], A[i, o + 2])


@formula
def set_symmetric_block(A, i, o, a):
    """Write a symmetric matrix in the form of `math.vec.symmetric` where `symmetric_block` reads it."""
    A[i, o], A[i, o + 3], A[i, o + 4], A[i, o + 1], A[i, o + 5], A[i, o + 2] = a


@formula
def angular_response(P, i, t):
    """Change of the angular velocity of node i by an angular impulse."""
    return symmetric(symmetric_block(P.node.inverse_inertia, i, 0), t)


@formula
def apply_angular_impulse(P, v, i, t):
    """Change a node's angular velocity by an angular impulse."""
    store3(v, i, 3, add(load3(v, i, 3), angular_response(P, i, t)))


@formula
def apply_to_node(P, v, c, side, f):
    """Change a node's velocities by an impulse at the contact."""
    i = P.at[c, side]
    store3(v, i, 0, add(load3(v, i, 0), scale(P.node.inverse_mass[i], f)))
    apply_angular_impulse(P, v, i, cross(load3(P.arm, c, 3 * side), f))


@formula
def apply_contact_impulse(P, v, wide, c, p):
    """Change the velocities by the impulse p of contact c."""
    i, j = P.at[c, 0], P.at[c, 1]
    f = to_world_frame(P, c, p[0], p[1], p[2])
    if j >= 0:
        apply_to_node(P, v, c, 1, f)
    if i >= 0:
        apply_to_node(P, v, c, 0, neg(f))
    if i < FIXED_SIDE or j < FIXED_SIDE:
        apply_to_groups(P, wide, c, 0, p)


@formula
def contact_angular_velocity(P, v, wide, c):
    """Relative angular velocity of contact c [rad/s] along its frame."""
    i, j = P.at[c, 0], P.at[c, 1]
    w = (0.0, 0.0, 0.0)
    if j >= 0:
        w = load3(v, j, 3)
    if i >= 0:
        w = sub(w, load3(v, i, 3))
    w = to_contact_frame(P, c, w)
    return add(w, group_velocity(P, wide, c, 3)) if i < FIXED_SIDE or j < FIXED_SIDE else w


@formula
def apply_torque_impulse(P, v, wide, c, p):
    """Change the velocities by the torque impulse p of contact c [N m s]."""
    i, j = P.at[c, 0], P.at[c, 1]
    t = to_world_frame(P, c, p[0], p[1], p[2])
    if j >= 0:
        apply_angular_impulse(P, v, j, t)
    if i >= 0:
        apply_angular_impulse(P, v, i, neg(t))
    if i < FIXED_SIDE or j < FIXED_SIDE:
        apply_to_groups(P, wide, c, 3, p)


@formula
def line_velocity(P, wide, k):
    """J v of line k, without bias and compliance."""
    g, e = P.line_at[k, 0], P.line_at[k, 1]
    return row_product(P, e, P.group[g + 1] - P.group[g], e, wide, P.group[g])


@formula
def apply_line_impulse(P, wide, k, p):
    """Change the velocities by the impulse p of line k."""
    g, e = P.line_at[k, 0], P.line_at[k, 1]
    w, n = P.group[g], P.group[g + 1] - P.group[g]
    add_multiple(wide[w : w + n], p, P.Y[e : e + n])


@formula
def line_diagonal(P, k):
    """Velocity of line k for its own unit impulse, compliance included."""
    g, e = P.line_at[k, 0], P.line_at[k, 1]
    return P.line_law.soft[k] + row_product(P, e, P.group[g + 1] - P.group[g], e, P.Y, e)


@formula
def frame_axis(P, c, k):
    """Row k of the contact's frame."""
    return load3(P.frame, c, 3 * k)


@formula
def node_block(P, i, m, e, r):
    """Block with entries m e . e + r . B r for three axes e and three torques r."""
    x, y, z = angular_response(P, i, r[0]), angular_response(P, i, r[1]), angular_response(P, i, r[2])
    return (
        m * dot(e[0], e[0]) + dot(r[0], x),
        m * dot(e[0], e[1]) + dot(r[0], y),
        m * dot(e[0], e[2]) + dot(r[0], z),
        m * dot(e[1], e[1]) + dot(r[1], y),
        m * dot(e[1], e[2]) + dot(r[1], z),
        m * dot(e[2], e[2]) + dot(r[2], z),
    )


@formula
def add_blocks(a, b):
    """Sum of two blocks."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5]


@formula
def group_block(P, c, side, first):
    """Diagonal block of three rows of J and Y."""
    g, block = -2 - P.at[c, side], P.block[c, side]
    n = P.group[g + 1] - P.group[g]
    e = block + first * n
    nn, ns, nt, ss, st, tt = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        k = P.columns[block + i]
        if k < 0:
            break
        x, y, z = P.Y[e + k], P.Y[e + n + k], P.Y[e + 2 * n + k]
        nn += P.J[e + k] * x
        ns += P.J[e + k] * y
        nt += P.J[e + k] * z
        ss += P.J[e + n + k] * y
        st += P.J[e + n + k] * z
        tt += P.J[e + 2 * n + k] * z
    return nn, ns, nt, ss, st, tt


@formula
def diagonal_block(P, c):
    """Diagonal block of contact c, without compliance."""
    D = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    e = frame_axis(P, c, 0), frame_axis(P, c, 1), frame_axis(P, c, 2)
    for side in range(2):
        i = P.at[c, side]
        if i >= 0:
            a = load3(P.arm, c, 3 * side)
            D = add_blocks(
                D, node_block(P, i, P.node.inverse_mass[i], e, (cross(a, e[0]), cross(a, e[1]), cross(a, e[2])))
            )
        elif i < FIXED_SIDE and P.block[c, side] >= 0:
            D = add_blocks(D, group_block(P, c, side, 0))
    return D


@formula
def rolling_diagonal_block(P, c):
    """Diagonal block of the torques of contact c."""
    D = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    e = frame_axis(P, c, 0), frame_axis(P, c, 1), frame_axis(P, c, 2)
    for side in range(2):
        i = P.at[c, side]
        if i >= 0:
            D = add_blocks(D, node_block(P, i, 0.0, e, e))
        elif i < FIXED_SIDE and P.block[c, side] >= 0:
            D = add_blocks(D, group_block(P, c, side, 3))
    return D


ZERO_RESIDUAL = (0.0, 0.0, 0.0, 0.0, 0.0)  # residual, missing impulse, square of the largest impulse, b' p, p' N p


@formula
def island_range(begin, whole, O):
    """First and end index in the selected island, or in all; islands begin at the entries of ``begin``."""
    k = O.count.island
    if k < 0:
        return 0, whole
    return begin[k], begin[k + 1]


@formula
def contact_range(P, O):
    """First and end index of the selected contacts."""
    return island_range(P.island, P.size[0], O)


@formula
def node_range(P, O):
    """First and end index of the selected nodes, in ``member``."""
    return island_range(P.member_p, P.size[1], O)


@formula
def line_range(P, O):
    """First and end index of the selected lines."""
    return island_range(P.line_p, P.size[3], O)


@formula
def larger_or_nan(a, b):
    """Larger of two numbers; nan if either is nan."""
    return a if a >= b or a != a else b


@formula
def contact_residual(P, X, c, u, coulomb):
    """Square of the missing impulse of contact c, its step s, square of the impulse; without rolling friction."""
    D = diagonal_block(P, c)
    s = D[0] + D[3] + D[5]
    s = 3.0 / (s + P.soft[c]) if s > 0.0 else 0.0
    n, a, b = X.p[c, 0], X.p[c, 1], X.p[c, 2]
    more = coulomb * P.mu[c] * sqrt(u[1] * u[1] + u[2] * u[2])  # De Saxce and Feng 1998
    x, y, z = project_on_cone_above(
        P.mu[c], least_normal_impulse(P, c), n - s * (u[0] + more), a - s * u[1], b - s * u[2]
    )
    lack = (x - n) * (x - n) + (y - a) * (y - a) + (z - b) * (z - b)
    return lack, s, n * n + a * a + b * b


@formula
def rolling_residual(P, X, c, u, w, coulomb):
    """As `contact_residual`, for a contact with rolling and spinning friction."""
    D, E = diagonal_block(P, c), rolling_diagonal_block(P, c)
    whole = D[0] + D[3] + D[5] + P.soft[c]
    s, size = 3.0 / whole, sqrt(whole / (E[0] + E[3] + E[5]))  # torques count as size * force
    n, a, b = X.p[c, 0], X.p[c, 1], X.p[c, 2]
    k, l, m = X.torque[c, 0] / size, X.torque[c, 1] / size, X.torque[c, 2] / size
    mu, rho, sigma = P.mu[c], P.turn[c, 0] / size, P.turn[c, 1] / size
    w = w[0] * size, w[1] * size, w[2] * size
    more = mu * sqrt(u[1] * u[1] + u[2] * u[2]) + rho * sqrt(w[1] * w[1] + w[2] * w[2]) + sigma * abs(w[0])
    f = n - s * (u[0] + coulomb * more), a - s * u[1], b - s * u[2]
    q = k - s * w[0], l - s * w[1], m - s * w[2]
    p, q = project_on_rolling_cone(mu, rho, sigma, least_normal_impulse(P, c), f, q)
    lack = (p[0] - n) * (p[0] - n) + (p[1] - a) * (p[1] - a) + (p[2] - b) * (p[2] - b)
    lack += (q[0] - k) * (q[0] - k) + (q[1] - l) * (q[1] - l) + (q[2] - m) * (q[2] - m)
    return lack, s, n * n + a * a + b * b


@formula
def biased_velocity(P, X, c, u):
    """Velocity of contact c including bias and compliance."""
    return u[0] + P.bias[c, 0] + P.soft[c] * X.p[c, 0], u[1] + P.bias[c, 1], u[2] + P.bias[c, 2]


@formula
def accumulate_residual(sofar, more):
    """Accumulate largest residual, missing impulse and square of the impulse; sums of b' p and p' N p.

    more: square of the missing impulse, step, square of the impulse, b' p, p' N p of one contact or line.
    """
    lack = sqrt(more[0])
    rate = lack / more[1] if more[1] > 0.0 else lack
    a, b, c = larger_or_nan(sofar[0], rate), larger_or_nan(sofar[1], lack), larger_or_nan(sofar[2], more[2])
    return a, b, c, sofar[3] + more[3], sofar[4] + more[4]


@formula
def residual_summary(sofar):
    """Residual [m/s], force residual [1], b . p and p' N p from accumulated values."""
    worst, lacking, largest, linear, square = sofar
    return worst, lacking / sqrt(largest) if largest > 0.0 else lacking, linear, square


@formula
def contact_terms(P, X, O, velocities, c):
    """Terms of contact c for `accumulate_residual`."""
    v, wide, free, free_wide = velocities
    n, a, b, coulomb = X.p[c, 0], X.p[c, 1], X.p[c, 2], 1.0 * O.count.coulomb
    d, e = contact_velocity(P, v, wide, c), contact_velocity(P, free, free_wide, c)
    u = biased_velocity(P, X, c, d)
    linear = n * (e[0] + P.bias[c, 0]) + a * (e[1] + P.bias[c, 1]) + b * (e[2] + P.bias[c, 2])
    square = n * (d[0] - e[0] + P.soft[c] * n) + a * (d[1] - e[1]) + b * (d[2] - e[2])
    if P.turn.shape[0] > 0:
        w, o = contact_angular_velocity(P, v, wide, c), contact_angular_velocity(P, free, free_wide, c)
        for k in range(3):
            linear += X.torque[c, k] * o[k]
            square += X.torque[c, k] * (w[k] - o[k])
        lack, s, size = rolling_residual(P, X, c, u, w, coulomb)
    else:
        lack, s, size = contact_residual(P, X, c, u, coulomb)
    return lack, s, size, linear, square


@formula
def residuals(P, X, O, velocities):
    """Residual [m/s], force residual [1], b . p and p' N p of the impulses in X.

    Parameters
    ----------
    velocities : tuple
        Of nodes and groups with the impulses, then of nodes and groups without them.
    """
    sofar = ZERO_RESIDUAL
    first, last = contact_range(P, O)
    for c in range(first, last):
        sofar = accumulate_residual(sofar, contact_terms(P, X, O, velocities, c))
    return residual_summary(accumulate_line_residuals(P, X, O, velocities[1], velocities[3], sofar))


@formula
def accumulate_line_residuals(P, X, O, wide, free_wide, sofar):
    """Add the lines to accumulated residuals."""
    first, last = line_range(P, O)
    for k in range(first, last):
        p, d, e = X.line[k], line_velocity(P, wide, k), line_velocity(P, free_wide, k)
        s = line_diagonal(P, k)
        s = 1.0 / s if s > 0.0 else 0.0
        q = p - s * (d + P.line_law.bias[k] + P.line_law.soft[k] * p)
        q = min(max(q, P.line_law.lower[k]), P.line_law.upper[k]) - p
        linear, square = p * (e + P.line_law.bias[k]), p * (d - e + P.line_law.soft[k] * p)
        sofar = accumulate_residual(sofar, (q * q, s, p * p, linear, square))
    return sofar


@formula
def finish_solve(P, X, W, O, residual):
    """Store the residuals of the impulses after the last iteration, limit the impulses and write the solution.

    The impulses are in X, the velocities with them in W.node_state and X.wide, those without in X.v and W.free_wide;
    ``residual`` is the result of `residuals`.
    """
    velocity, force, linear, square = residual
    O.real.residual, O.real.force_residual = velocity, force
    part = 1.0
    if not (velocity == velocity and square == square):
        part, O.count.ended = 0.0, SOLVE_FAILED
    elif 0.5 * square + linear > 0.0 and O.count.ended == LIMIT_REACHED and P.least.shape[0] == 0:
        part = 0.0 if linear >= 0.0 else -linear / square  # scaling with the smallest objective
    write_back(P, X, W, O, part)


@formula
def blend(part, a, b):
    """Interpolate from a (part 0) to b (part 1); exact at the ends even if the other is nan."""
    if part == 1.0:
        return b
    return a + part * (b - a) if part > 0.0 else a


@formula
def write_back(P, X, W, O, part):
    """Write velocities, and impulses scaled by ``part``, to X."""
    begin, end = node_range(P, O)
    for e in range(begin, end):
        i = P.member[e]
        for s in range(6):
            X.v[i, s] = blend(part, X.v[i, s], W.node_state[i, s])
    if part == 1.0:
        return
    for s in range(X.wide.shape[0]):
        X.wide[s] = blend(part, W.free_wide[s], X.wide[s])
    first, last = contact_range(P, O)
    for c in range(first, last):
        for s in range(3):
            X.p[c, s] = blend(part, 0.0, X.p[c, s])
        if P.turn.shape[0] > 0:
            for s in range(3):
                X.torque[c, s] = blend(part, 0.0, X.torque[c, s])
    first, last = line_range(P, O)
    for e in range(first, last):
        X.line[e] = blend(part, 0.0, X.line[e])
