"""Projected gradient steps for all contacts at once, used by Jacobi, Barzilai-Borwein and APGD.

The metric is that of the diagonal blocks (or 1), so a step of size 1 is comparable to one of Gauss-Seidel. Vectors
are planes of `ContactWorkspace.rows`, by visit: impulses in the first four, their velocities N p in three more, b =
D v + bias in the last; torques are eight planes further, lines in `ContactWorkspace.lines`. Impulses of spheres are
vectors in world axes; of all others along the frame. Velocities of products are in W.node_state and X.wide.

One pass takes a gradient step for all contacts and applies its impulses; another forms the product with N. Before the
iterations contacts are packed and the warm start is loaded; after them the result is written back.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from .cone_projection import fraction_within, rolling_cone_normal
from .contact_operator import (
    apply_contact_impulse,
    apply_line_impulse,
    apply_torque_impulse,
    contact_angular_velocity,
    contact_range,
    contact_velocity,
    finish_solve,
    larger_or_nan,
    line_diagonal,
    line_range,
    line_velocity,
    node_range,
    residuals,
    rolling_diagonal_block,
)
from .packed_contacts import (
    FRICTIONAL,
    SPHERE,
    apply_point_impulse,
    apply_sphere_impulse,
    copy_nodes,
    count_contact_kinds,
    frictional_velocity,
    limit_friction,
    local_step_sizes,
    pack_contacts,
    sphere_sliding_velocity,
)

BIAS_PLANE, TORQUE_OFFSET = 7, 8  # plane of b; offset of the planes of torques
ROLLING_STEPS, LINE_METRIC = 16, 8  # plane of steps of spinning and rolling; row of the diagonal of lines


@formula
def extrapolated(W, a, b, beta, s):
    """Extrapolated vector a + beta (a - b) of visit s."""
    x, y, z = W.rows[a, s, 0], W.rows[a, s, 1], W.rows[a, s, 2]
    if beta == 0.0:
        return x, y, z
    return x + beta * (x - W.rows[b, s, 0]), y + beta * (y - W.rows[b, s, 1]), z + beta * (z - W.rows[b, s, 2])


@formula
def set_vector(W, a, s, x):
    """Set vector a of visit s to x."""
    W.rows[a, s, 0], W.rows[a, s, 1], W.rows[a, s, 2] = x


@formula
def step_sphere(k, at, y, g, size, coulomb):
    """Impulse after a step from y against g; with d its difference from y, also d' M d and |M d|^2."""
    x0, x1, x2, lean, slide = (
        k.normal[at, 0],
        k.normal[at, 1],
        k.normal[at, 2],
        k.inverse_normal[at],
        k.inverse_tangential[at],
    )
    gn, yn, mu = g[0] * x0 + g[1] * x1 + g[2] * x2, y[0] * x0 + y[1] * x1 + y[2] * x2, k.mu[at]
    a, b, c = g[0] - gn * x0, g[1] - gn * x1, g[2] - gn * x2
    if coulomb:
        gn += mu * sqrt(a * a + b * b + c * c)
    n = yn - size * lean * gn
    a, b, c = y[0] - yn * x0 - size * slide * a, y[1] - yn * x1 - size * slide * b, y[2] - yn * x2 - size * slide * c
    n, part = limit_friction(n, sqrt(a * a + b * b + c * c), mu, k.ratio[at], 0, k.least[at])
    a, b, c = n * x0 + part * a, n * x1 + part * b, n * x2 + part * c
    e, f, h, n = a - y[0], b - y[1], c - y[2], n - yn
    dn, dt = n * n, e * e + f * f + h * h - n * n
    return (a, b, c), dn / lean + dt / slide, dn / (lean * lean) + dt / (slide * slide)


@formula
def step_frictional(k, at, y, g, size, coulomb):
    """As `step_sphere`, for any other contact, along its frame."""
    lean, slide, gn = k.inverse_nn[at], k.sliding_step[at], g[0]
    if lean == 0.0:  # immovable
        return y, 0.0, 0.0
    if coulomb:
        gn += k.mu[at] * sqrt(g[1] * g[1] + g[2] * g[2])
    n, a, b = y[0] - size * lean * gn, y[1] - size * slide * g[1], y[2] - size * slide * g[2]
    n, part = limit_friction(n, sqrt(a * a + b * b), k.mu[at], k.ratio[at], 0, k.least[at])
    a, b = part * a, part * b
    dn, dt = (n - y[0]) * (n - y[0]), (a - y[1]) * (a - y[1]) + (b - y[2]) * (b - y[2])
    if slide == 0.0:
        return (n, a, b), dn / lean, dn / (lean * lean)
    return (n, a, b), dn / lean + dt / slide, dn / (lean * lean) + dt / (slide * slide)


@formula
def step_rolling(P, k, c, at, y, g, way):
    """As `step_frictional`, for impulses and torques together: y, g hold two vectors; way: size, coulomb, steps."""
    size, coulomb, spin, roll = way
    (yn, ys, yt), (yz, yx, yy) = y
    (gn, gs, gt), (gz, gx, gy) = g
    lean, slide, mu, rho, sigma = k.inverse_nn[at], k.sliding_step[at], k.mu[at], P.turn[c, 0], P.turn[c, 1]
    if coulomb:
        gn += mu * sqrt(gs * gs + gt * gt) + rho * sqrt(gx * gx + gy * gy) + sigma * abs(gz)
    n, s, t = yn - size * lean * gn, ys - size * slide * gs, yt - size * slide * gt
    z, x, w = yz - size * spin * gz, yx - size * roll * gx, yy - size * roll * gy
    a, b, d = sqrt(lean / slide), sqrt(lean / roll), sqrt(lean / spin)  # in units in which the metric is 1
    r, q = sqrt(s * s + t * t), sqrt(x * x + w * w)
    n = max(rolling_cone_normal(mu * a, rho * b, sigma * d, n, r * a, q * b, abs(z) * d), k.least[at])
    a, b, d = fraction_within(n, mu, r), fraction_within(n, rho, q), fraction_within(n, sigma, abs(z))
    s, t, z, x, w = a * s, a * t, d * z, b * x, b * w
    dn, dt, dz = (n - yn) * (n - yn), (s - ys) * (s - ys) + (t - yt) * (t - yt), (z - yz) * (z - yz)
    dx = (x - yx) * (x - yx) + (w - yy) * (w - yy)
    dd = dn / lean + dt / slide + dz / spin + dx / roll
    return (n, s, t), (z, x, w), dd, dn / (lean * lean) + dt / (slide * slide)


@formula
def step_line(P, W, k, ids, par):
    """Step of line k, stored in ``new``; returns d' M d, g times the whole change, |M d|^2."""
    cur, prev, ucur, uprev, new = ids
    beta, size, _ = par
    y = W.lines[cur, k] + beta * (W.lines[cur, k] - W.lines[prev, k])
    g = W.lines[ucur, k] + beta * (W.lines[ucur, k] - W.lines[uprev, k]) + W.lines[BIAS_PLANE, k]
    d = W.lines[LINE_METRIC, k]
    q = min(max(y - size * g / d, P.line_law.lower[k]), P.line_law.upper[k])
    W.lines[new, k] = q
    return d * (q - y) * (q - y), g * (q - W.lines[cur, k]), d * d * (q - y) * (q - y)


@formula
def clear_velocities(P, X, W, O):
    """Set the velocities to zero."""
    begin, end = node_range(P, O)
    for e in range(begin, end):
        for k in range(6):
            W.node_state[P.member[e], k] = 0.0
    for k in range(X.wide.shape[0]):
        X.wide[k] = 0.0


@formula
def gradient_step(P, X, W, O, many, ids, par):
    """Take a step from y = cur + beta (cur - prev) to ``new``, and apply its impulses to the velocities.

    Parameters
    ----------
    many : tuple
        Contacts of each kind.
    ids : tuple
        Vectors cur, prev, their N p, and new.
    par : tuple
        beta, size of the step, whether Coulomb's law is used.

    Returns
    -------
    tuple
        d' M d with d = new - y; g . (new - cur); the largest |M d|^2 of a contact.
    """
    cur, prev, ucur, uprev, new = ids
    beta, size, coulomb = par
    dd, gs, worst = 0.0, 0.0, 0.0
    clear_velocities(P, X, W, O)
    for s in range(many[SPHERE] + many[FRICTIONAL]):
        ball = s < many[SPHERE]
        y, u, b = (
            extrapolated(W, cur, prev, beta, s),
            extrapolated(W, ucur, uprev, beta, s),
            extrapolated(W, BIAS_PLANE, BIAS_PLANE, 0.0, s),
        )
        g, i, j = (u[0] + b[0], u[1] + b[1], u[2] + b[2]), W.contact_nodes[s, 0], W.contact_nodes[s, 1]
        if ball:
            x, more, square = step_sphere(W.spheres, s, y, g, size, coulomb)
            apply_sphere_impulse(W.spheres, W.node_state, i, j, s, (0.0, x[0], x[1], x[2]))
        else:
            x, more, square = step_frictional(W.frictional, s, y, g, size, coulomb)
            apply_frictional_impulse(W.frictional, W.node_state, W.inner, i, j, s, x)
        set_vector(W, new, s, x)
        dd, worst = dd + more, larger_or_nan(worst, square)
        gs += g[0] * (x[0] - W.rows[cur, s, 0]) + g[1] * (x[1] - W.rows[cur, s, 1]) + g[2] * (x[2] - W.rows[cur, s, 2])
    return gradient_step_general(P, X, W, O, many, ids, par, (dd, gs, worst))


@formula
def apply_vector(P, X, W, O, many, a):
    """Apply vector a, without torques and lines, to the velocities."""
    clear_velocities(P, X, W, O)
    for s in range(many[SPHERE] + many[FRICTIONAL]):
        i, j, x = W.contact_nodes[s, 0], W.contact_nodes[s, 1], extrapolated(W, a, a, 0.0, s)
        if s < many[SPHERE]:
            apply_sphere_impulse(W.spheres, W.node_state, i, j, s, (0.0, x[0], x[1], x[2]))
        else:
            apply_frictional_impulse(W.frictional, W.node_state, W.inner, i, j, s, x)
    begin = general_start(many)
    for s in range(begin, begin + many[4]):
        apply_contact_impulse(P, W.node_state, X.wide, W.contact_nodes[s, 2], extrapolated(W, a, a, 0.0, s))


@formula
def apply_frictional_impulse(k, v, B, i, j, at, p):
    """Apply an impulse along the frame of a frictional contact."""
    x = k.frame[at, 0] * p[0] + k.frame[at, 3] * p[1] + k.frame[at, 6] * p[2]
    y = k.frame[at, 1] * p[0] + k.frame[at, 4] * p[1] + k.frame[at, 7] * p[2]
    z = k.frame[at, 2] * p[0] + k.frame[at, 5] * p[1] + k.frame[at, 8] * p[2]
    apply_point_impulse(k, v, B, j, at, 1, x, y, z)
    apply_point_impulse(k, v, B, i, at, 0, -x, -y, -z)


@formula
def general_start(many):
    """First visit of contacts of groups."""
    return many[SPHERE] + many[FRICTIONAL]


@formula
def gradient_step_general(P, X, W, O, many, ids, par, sums):
    """Take the step of contacts of groups, of rolling friction and of lines."""
    cur, prev, ucur, uprev, new = ids
    beta, size, coulomb = par
    dd, gs, worst = sums
    begin = general_start(many)
    for s in range(begin, begin + many[4]):
        c = W.contact_nodes[s, 2]
        y, u, b = (
            extrapolated(W, cur, prev, beta, s),
            extrapolated(W, ucur, uprev, beta, s),
            extrapolated(W, BIAS_PLANE, BIAS_PLANE, 0.0, s),
        )
        g = u[0] + b[0], u[1] + b[1], u[2] + b[2]
        if P.turn.shape[0] > 0:
            z, u = (
                extrapolated(W, TORQUE_OFFSET + cur, TORQUE_OFFSET + prev, beta, s),
                extrapolated(W, TORQUE_OFFSET + ucur, TORQUE_OFFSET + uprev, beta, s),
            )
            b = extrapolated(W, TORQUE_OFFSET + BIAS_PLANE, BIAS_PLANE, 0.0, s)
            h = u[0] + b[0], u[1] + b[1], u[2] + b[2]
            way = size, coulomb, W.rows[ROLLING_STEPS, s, 0], W.rows[ROLLING_STEPS, s, 1]
            x, q, more, square = step_rolling(P, W.frictional, c, s, (y, z), (g, h), way)
            for e in range(3):
                gs += h[e] * (q[e] - W.rows[TORQUE_OFFSET + cur, s, e])
            set_vector(W, TORQUE_OFFSET + new, s, q)
            apply_torque_impulse(P, W.node_state, X.wide, c, q)
        else:
            x, more, square = step_frictional(W.frictional, s, y, g, size, coulomb)
        set_vector(W, new, s, x)
        apply_contact_impulse(P, W.node_state, X.wide, c, x)
        dd, worst = dd + more, larger_or_nan(worst, square)
        gs += g[0] * (x[0] - W.rows[cur, s, 0]) + g[1] * (x[1] - W.rows[cur, s, 1]) + g[2] * (x[2] - W.rows[cur, s, 2])
    first, last = line_range(P, O)
    for e in range(first, last):
        more, rise, square = step_line(P, W, e, ids, par)
        apply_line_impulse(P, X.wide, e, W.lines[new, e])
        dd, gs, worst = dd + more, gs + rise, larger_or_nan(worst, square)
    return dd, gs, worst


@formula
def visit_velocity(P, X, W, at, ball, new):
    """N x of visit ``at`` for vector ``new``, without torque."""
    v, i, j = W.node_state, W.contact_nodes[at, 0], W.contact_nodes[at, 1]
    x = extrapolated(W, new, new, 0.0, at)
    if ball:
        u = sphere_sliding_velocity(
            W.spheres, v, i, j, at, (v[j, 0] - v[i, 0], v[j, 1] - v[i, 1], v[j, 2] - v[i, 2], 0.0)
        )
        n = W.spheres.soft[at] * (
            W.spheres.normal[at, 0] * x[0] + W.spheres.normal[at, 1] * x[1] + W.spheres.normal[at, 2] * x[2]
        )
        return (
            u[0] + n * W.spheres.normal[at, 0],
            u[1] + n * W.spheres.normal[at, 1],
            u[2] + n * W.spheres.normal[at, 2],
        )
    u = frictional_velocity(W.frictional, v, i, j, at)
    return u[0] + W.frictional.soft[at] * x[0], u[1], u[2]


@formula
def difference_product(a, b, c):
    """Return (a - b) . c for vectors."""
    return (a[0] - b[0]) * c[0] + (a[1] - b[1]) * c[1] + (a[2] - b[2]) * c[2]


@formula
def apply_operator(P, X, W, O, many, ids, unew, beta):
    """Write N new to ``unew``; returns d' N d with d = new - y, and |N d|^2 in the inverse metric (without rolling)."""
    cur, prev, ucur, uprev, new = ids
    total, square = 0.0, 0.0
    for s in range(many[SPHERE] + many[FRICTIONAL]):
        ball = s < many[SPHERE]
        u = visit_velocity(P, X, W, s, ball, new)
        set_vector(W, unew, s, u)
        x, y, w = (
            extrapolated(W, new, new, 0.0, s),
            extrapolated(W, cur, prev, beta, s),
            extrapolated(W, ucur, uprev, beta, s),
        )
        w = u[0] - w[0], u[1] - w[1], u[2] - w[2]
        total += difference_product(x, y, w)
        n = (
            W.spheres.normal[s, 0] * w[0] + W.spheres.normal[s, 1] * w[1] + W.spheres.normal[s, 2] * w[2]
            if ball
            else w[0]
        )
        lean, slide = (
            (W.spheres.inverse_normal[s], W.spheres.inverse_tangential[s])
            if ball
            else (W.frictional.inverse_nn[s], W.frictional.sliding_step[s])
        )
        square += lean * n * n + slide * (w[0] * w[0] + w[1] * w[1] + w[2] * w[2] - n * n)
    return apply_operator_general(P, X, W, O, many, ids, unew, beta, (total, square))


@formula
def apply_operator_general(P, X, W, O, many, ids, unew, beta, sums):
    """As `apply_operator`, for contacts of groups, rolling friction and lines."""
    cur, prev, ucur, uprev, new = ids
    total, square = sums
    begin = general_start(many)
    for s in range(begin, begin + many[4]):
        c = W.contact_nodes[s, 2]
        x, y, w = (
            extrapolated(W, new, new, 0.0, s),
            extrapolated(W, cur, prev, beta, s),
            extrapolated(W, ucur, uprev, beta, s),
        )
        u = contact_velocity(P, W.node_state, X.wide, c)
        u = u[0] + P.soft[c] * x[0], u[1], u[2]
        set_vector(W, unew, s, u)
        w = u[0] - w[0], u[1] - w[1], u[2] - w[2]
        total += difference_product(x, y, w)
        square += W.frictional.inverse_nn[s] * w[0] * w[0] + W.frictional.sliding_step[s] * (w[1] * w[1] + w[2] * w[2])
        if P.turn.shape[0] > 0:
            x, y = (
                extrapolated(W, TORQUE_OFFSET + new, TORQUE_OFFSET + new, 0.0, s),
                extrapolated(W, TORQUE_OFFSET + cur, TORQUE_OFFSET + prev, beta, s),
            )
            u, w = (
                contact_angular_velocity(P, W.node_state, X.wide, c),
                extrapolated(W, TORQUE_OFFSET + ucur, TORQUE_OFFSET + uprev, beta, s),
            )
            set_vector(W, TORQUE_OFFSET + unew, s, u)
            total += difference_product(x, y, u) - difference_product(x, y, w)
    first, last = line_range(P, O)
    for e in range(first, last):
        u = line_velocity(P, X.wide, e) + P.line_law.soft[e] * W.lines[new, e]
        y = W.lines[cur, e] + beta * (W.lines[cur, e] - W.lines[prev, e])
        w = W.lines[ucur, e] + beta * (W.lines[ucur, e] - W.lines[uprev, e])
        W.lines[unew, e] = u
        total += (u - w) * (W.lines[new, e] - y)
        square += (u - w) * (u - w) / W.lines[LINE_METRIC, e]
    return total, square


@formula
def begin_iterations(P, X, W, O, unit_metric):
    """Pack contacts: impulses to vector 0, N p to vector 4, b to its plane. Returns the number of contacts by kind.

    The metric is 1 if ``unit_metric``.
    """
    first, last = contact_range(P, O)
    copy_nodes(P, X, W, node_range(P, O))
    for k in range(X.wide.shape[0]):
        W.free_wide[k] = X.wide[k]
    many = count_contact_kinds(P, W, first, last, 1)
    pack_contacts(P, X, W, 0, first, many)
    for s in range(last - first):
        load_visit(P, X, W, many, s)
        if P.turn.shape[0] > 0:
            steps = local_step_sizes(rolling_diagonal_block(P, W.contact_nodes[s, 2]), 0.0, 0)
            W.rows[ROLLING_STEPS, s, 0], W.rows[ROLLING_STEPS, s, 1] = (
                (1.0, 1.0) if unit_metric else (steps[0], steps[6])
            )
        if unit_metric:
            if s < many[SPHERE]:
                W.spheres.inverse_normal[s], W.spheres.inverse_tangential[s], W.spheres.ratio[s] = (
                    1.0,
                    1.0,
                    1.0,
                )
            elif W.frictional.inverse_nn[s] > 0.0:  # otherwise immovable
                W.frictional.inverse_nn[s], W.frictional.sliding_step[s], W.frictional.ratio[s] = 1.0, 1.0, 1.0
    start, end = line_range(P, O)
    for k in range(start, end):
        W.lines[0, k] = X.line[k]
        W.lines[BIAS_PLANE, k] = line_velocity(P, W.free_wide, k) + P.line_law.bias[k]
        W.lines[LINE_METRIC, k] = 1.0 if unit_metric else line_diagonal(P, k)
        apply_line_impulse(P, X.wide, k, X.line[k])
    subtract_free_velocities(P, X, W, O)
    apply_operator(P, X, W, O, many, (0, 0, 0, 0, 0), 4, 0.0)
    return many


@formula
def load_visit(P, X, W, many, at):
    """Load impulses and b of visit ``at``."""
    i, j, c, v = W.contact_nodes[at, 0], W.contact_nodes[at, 1], W.contact_nodes[at, 2], W.free
    if at < many[SPHERE]:
        a, b, d, n = W.spheres.normal[at, 0], W.spheres.normal[at, 1], W.spheres.normal[at, 2], W.spheres.impulse[at]
        set_vector(
            W,
            0,
            at,
            (n * a + W.spheres.tangent[at, 0], n * b + W.spheres.tangent[at, 1], n * d + W.spheres.tangent[at, 2]),
        )
        u = sphere_sliding_velocity(
            W.spheres, v, i, j, at, (v[j, 0] - v[i, 0], v[j, 1] - v[i, 1], v[j, 2] - v[i, 2], 0.0)
        )
        n = W.spheres.bias[at]
        set_vector(W, BIAS_PLANE, at, (u[0] + n * a, u[1] + n * b, u[2] + n * d))
        return
    set_vector(W, 0, at, (W.frictional.impulse[at, 0], W.frictional.impulse[at, 1], W.frictional.impulse[at, 2]))
    u = (
        frictional_velocity(W.frictional, v, i, j, at)
        if at < many[SPHERE] + many[FRICTIONAL]
        else contact_velocity(P, v, W.free_wide, c)
    )
    set_vector(
        W,
        BIAS_PLANE,
        at,
        (u[0] + W.frictional.bias[at, 0], u[1] + W.frictional.bias[at, 1], u[2] + W.frictional.bias[at, 2]),
    )
    if P.turn.shape[0] > 0:
        set_vector(W, TORQUE_OFFSET, at, (X.torque[c, 0], X.torque[c, 1], X.torque[c, 2]))
        set_vector(W, TORQUE_OFFSET + BIAS_PLANE, at, contact_angular_velocity(P, v, W.free_wide, c))


@formula
def subtract_free_velocities(P, X, W, O):
    """Leave only the velocities caused by impulses in W.node_state and X.wide."""
    first, last = node_range(P, O)
    for e in range(first, last):
        i = P.member[e]
        for k in range(6):
            W.node_state[i, k] -= W.free[i, k]
    for k in range(X.wide.shape[0]):
        X.wide[k] -= W.free_wide[k]


@formula
def write_result(P, X, W, O, many, best, used):
    """Write the impulses of a vector to X, their velocities, and the result of the solve."""
    first, end = node_range(P, O)
    for e in range(first, end):
        for k in range(6):
            W.node_state[P.member[e], k] = W.free[P.member[e], k]
    for k in range(X.wide.shape[0]):
        X.wide[k] = W.free_wide[k]
    for s in range(many[0] + many[1] + many[2] + many[3] + many[4]):
        c, x, y, z = W.contact_nodes[s, 2], W.rows[best, s, 0], W.rows[best, s, 1], W.rows[best, s, 2]
        for k in range(3):
            X.p[c, k] = W.rows[best, s, k]
            if s < many[SPHERE]:
                X.p[c, k] = P.frame[c, 3 * k] * x + P.frame[c, 3 * k + 1] * y + P.frame[c, 3 * k + 2] * z
        apply_contact_impulse(P, W.node_state, X.wide, c, (X.p[c, 0], X.p[c, 1], X.p[c, 2]))
        if P.turn.shape[0] > 0:
            for k in range(3):
                X.torque[c, k] = W.rows[TORQUE_OFFSET + best, s, k]
            apply_torque_impulse(P, W.node_state, X.wide, c, (X.torque[c, 0], X.torque[c, 1], X.torque[c, 2]))
    first, end = line_range(P, O)
    for k in range(first, end):
        X.line[k] = W.lines[best, k]
        apply_line_impulse(P, X.wide, k, X.line[k])
    O.count.used = used
    finish_solve(P, X, W, O, residuals(P, X, O, (W.node_state, X.wide, W.free, W.free_wide)))


@formula
def unused_index(a, b, c, first):
    """First number from ``first`` on that differs from all three."""
    for k in range(4):
        if first + k != a and first + k != b and first + k != c:
            return first + k
    return first
