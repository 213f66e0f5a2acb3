"""Projected Gauss-Seidel: contacts one after the other, in alternating forward and backward sweeps.

Jean and Moreau 1992 (as non-smooth contact dynamics), Tasora and Anitescu 2011 (in the convex form). Updates of
packed contacts are in `packed_contacts`; contacts of groups, contacts with rolling friction, and lines are updated
here through `contact_operator`. Residuals are computed from the packed numbers, much faster than by
`contact_operator.residuals`: functions of one contact return the square of the missing impulse, its step, the
square of the impulse, and its terms of b' p and of p' N p.

A solve that ends at the iteration limit returns its impulses scaled down if they would be worse than no impulse at
all: p' N p / 2 + b' p is never positive, so that no energy is generated.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...compiler.kernels import kernel
from ...math.scalar import sqrt
from .cone_projection import fraction_within, project_on_cone_above, rolling_cone_normal
from .contact_operator import (
    ZERO_RESIDUAL,
    accumulate_line_residuals,
    accumulate_residual,
    apply_contact_impulse,
    apply_line_impulse,
    apply_torque_impulse,
    contact_angular_velocity,
    contact_range,
    contact_terms,
    contact_velocity,
    finish_solve,
    line_diagonal,
    line_range,
    line_velocity,
    node_range,
    residual_summary,
    rolling_diagonal_block,
)
from .contact_problem import (
    CONVERGED,
    LIMIT_REACHED,
    LINE_HIGH,
    LINE_LOW,
    ContactProblem,
    ContactState,
    ContactWorkspace,
    FactorStorage,
    SolverSettings,
)
from .contact_problem import LINE_BIAS as LINE_BIAS
from .contact_problem import LINE_SOFT as LINE_SOFT
from .packed_contacts import (
    BIAS,
    CONTACT_KINDS,
    FRICTIONAL,
    FRICTIONLESS,
    FRICTIONLESS_BIAS,
    FRICTIONLESS_INVERSE,
    FRICTIONLESS_LEAST,
    FRICTIONLESS_NORMAL,
    FRICTIONLESS_SOFT,
    FRICTIONLESS_WIDTH,
    IMPULSE,
    INVERSE_NN,
    LEAST_NORMAL,
    MU,
    SLIDING_STEP,
    SMOOTH_SPHERE,
    SOFT,
    SPHERE,
    SPHERE_BIAS,
    SPHERE_INVERSE_N,
    SPHERE_INVERSE_T,
    SPHERE_LEAST,
    SPHERE_MU,
    SPHERE_NORMAL,
    SPHERE_SOFT,
    SPHERE_TANGENT,
    SPHERE_WIDTH,
    copy_nodes,
    count_contact_kinds,
    frictional_velocity,
    frictionless_velocity,
    local_impulse,
    local_step_sizes,
    pack_contacts,
    packed_width,
    sphere_sliding_velocity,
    update_frictional,
    update_frictionless,
    update_smooth_sphere,
    update_sphere,
)


@formula
def update_general(P, X, W, O, c, at):
    """Update a contact of nodes and groups."""
    k = W.packed
    n, s, t = k[at + IMPULSE], k[at + IMPULSE + 1], k[at + IMPULSE + 2]
    if P.turn.shape[0] > 0:
        update_rolling(P, X, W, O, c, at)
    else:
        q = local_impulse(k, at, contact_velocity(P, W.own, X.wide, c), O.count.coulomb)
        set_impulse(P, X, W, c, at, q)
    d = abs(k[at + IMPULSE] - n) + abs(k[at + IMPULSE + 1] - s) + abs(k[at + IMPULSE + 2] - t)
    return d / k[at + INVERSE_NN] if d > 0.0 else 0.0


@formula
def set_impulse(P, X, W, c, at, q):
    """Set the impulse to q, and update the velocities."""
    k = W.packed
    d = q[0] - k[at + IMPULSE], q[1] - k[at + IMPULSE + 1], q[2] - k[at + IMPULSE + 2]
    if d[0] != 0.0 or d[1] != 0.0 or d[2] != 0.0:
        k[at + IMPULSE], k[at + IMPULSE + 1], k[at + IMPULSE + 2] = q
        apply_contact_impulse(P, W.own, X.wide, c, d)


@formula
def set_torque_impulse(P, X, W, c, z, x, y):
    """Set the torque impulse, and update the velocities."""
    d = z - X.torque[c, 0], x - X.torque[c, 1], y - X.torque[c, 2]
    X.torque[c, 0], X.torque[c, 1], X.torque[c, 2] = z, x, y
    apply_torque_impulse(P, W.own, X.wide, c, d)


@formula
def update_rolling(P, X, W, O, c, at):
    """Update a contact with rolling and spinning friction.

    With Coulomb's law the torques are bounded by the normal impulse found just before. In the convex form all six
    impulses are projected on the cone, in the metric of twice the diagonal blocks.
    """
    steps = local_step_sizes(rolling_diagonal_block(P, c), 0.0, 0)
    spin, roll = steps[0], steps[6]
    u = contact_velocity(P, W.own, X.wide, c)
    if O.count.coulomb:
        set_impulse(P, X, W, c, at, local_impulse(W.packed, at, u, 1))
        n = W.packed[at + IMPULSE]
        w = contact_angular_velocity(P, W.own, X.wide, c)
        z, x, y = X.torque[c, 0] - spin * w[0], X.torque[c, 1] - roll * w[1], X.torque[c, 2] - roll * w[2]
        a, b = fraction_within(n, P.turn[c, 0], sqrt(x * x + y * y)), fraction_within(n, P.turn[c, 1], abs(z))
        set_torque_impulse(P, X, W, c, b * z, a * x, a * y)
    else:
        q, o = project_rolling_step(
            P, X, W.packed, c, at, u, contact_angular_velocity(P, W.own, X.wide, c), (spin, roll)
        )
        set_impulse(P, X, W, c, at, q)
        set_torque_impulse(P, X, W, c, o[0], o[1], o[2])


@formula
def project_rolling_step(P, X, k, c, at, u, w, steps):
    """Impulse and torque of the convex form after a step at velocities u and w."""
    spin, roll, slide, press = 0.5 * steps[0], 0.5 * steps[1], 0.5 * k[at + SLIDING_STEP], 0.5 * k[at + INVERSE_NN]
    n = k[at + IMPULSE] - press * (u[0] + k[at + BIAS] + k[at + SOFT] * k[at + IMPULSE])
    s = k[at + IMPULSE + 1] - slide * (u[1] + k[at + BIAS + 1])
    t = k[at + IMPULSE + 2] - slide * (u[2] + k[at + BIAS + 2])
    z, x, y = X.torque[c, 0] - spin * w[0], X.torque[c, 1] - roll * w[1], X.torque[c, 2] - roll * w[2]
    r, q, mu, rho, sigma = sqrt(s * s + t * t), sqrt(x * x + y * y), k[at + MU], P.turn[c, 0], P.turn[c, 1]
    # in units in which the metric is 1
    a, b, d = metric_factor(press, slide), metric_factor(press, roll), metric_factor(press, spin)
    near = rolling_cone_normal(mu * a, rho * b, sigma * d, n, r * a, q * b, abs(z) * d)
    near = max(near, k[at + LEAST_NORMAL])
    a, b, d = fraction_within(near, mu, r), fraction_within(near, rho, q), fraction_within(near, sigma, abs(z))
    return (near, a * s, a * t), (d * z, b * x, b * y)


@formula
def metric_factor(a, b):
    """Square root of a / b; 0 if nothing moves that way."""
    return sqrt(a / b) if b > 0.0 else 0.0


@formula
def update_line(P, X, k):
    """Update a line: a single impulse on a group."""
    p, d = X.line[k], line_diagonal(P, k)
    if not d > 0.0:
        return 0.0
    q = p - (line_velocity(P, X.wide, k) + P.line_x[k, LINE_BIAS] + P.line_x[k, LINE_SOFT] * p) / d
    q = min(max(q, P.line_x[k, LINE_LOW]), P.line_x[k, LINE_HIGH])
    X.line[k] = q
    apply_line_impulse(P, X.wide, k, q - p)
    return abs(q - p) * d


@formula
def centre_velocity(k, v, i, j, at):
    """Relative velocity of the centres of spheres, and its normal part."""
    a, b, c = v[j, 0] - v[i, 0], v[j, 1] - v[i, 1], v[j, 2] - v[i, 2]
    return a, b, c, k[at] * a + k[at + 1] * b + k[at + 2] * c


@formula
def normal_terms(p, u, before, step, least):
    """Residual terms of a normal impulse; u without bias; step: inverse diagonal, bias and compliance."""
    inverse, bias, soft = step
    q = p - (u + bias + soft * p) * inverse
    d = (least if q < least else q) - p  # nan stays nan
    return d * d, inverse, p * p, p * (before + bias), p * (u - before + soft * p)


@formula
def smooth_sphere_terms(k, v, free, i, j, at):
    """Residual terms of a contact of spheres without friction."""
    u, before = centre_velocity(k, v, i, j, at)[3], centre_velocity(k, free, i, j, at)[3]
    return normal_terms(
        k[at + SPHERE_NORMAL],
        u,
        before,
        (k[at + SPHERE_INVERSE_N], k[at + SPHERE_BIAS], k[at + SPHERE_SOFT]),
        k[at + SPHERE_LEAST],
    )


@formula
def frictionless_terms(k, v, free, i, j, at):
    """Residual terms of a frictionless contact of any nodes."""
    u, before = frictionless_velocity(k, v, i, j, at), frictionless_velocity(k, free, i, j, at)
    return normal_terms(
        k[at + FRICTIONLESS_NORMAL],
        u,
        before,
        (k[at + FRICTIONLESS_INVERSE], k[at + FRICTIONLESS_BIAS], k[at + FRICTIONLESS_SOFT]),
        k[at + FRICTIONLESS_LEAST],
    )


@formula
def sphere_terms(k, v, free, i, j, at, coulomb):
    """Residual terms of a contact of spheres."""
    d, f = centre_velocity(k, v, i, j, at), centre_velocity(k, free, i, j, at)
    x, y, z = sphere_sliding_velocity(k, v, i, j, at, d)
    e, g, h = sphere_sliding_velocity(k, free, i, j, at, f)
    p, a, b, c, mu = (
        k[at + SPHERE_NORMAL],
        k[at + SPHERE_TANGENT],
        k[at + SPHERE_TANGENT + 1],
        k[at + SPHERE_TANGENT + 2],
        k[at + SPHERE_MU],
    )
    linear = p * (f[3] + k[at + SPHERE_BIAS]) + a * e + b * g + c * h
    square = p * (d[3] - f[3] + k[at + SPHERE_SOFT] * p) + a * (x - e) + b * (y - g) + c * (z - h)
    size = p * p + a * a + b * b + c * c
    s = (
        3.0
        * k[at + SPHERE_INVERSE_N]
        * k[at + SPHERE_INVERSE_T]
        / (k[at + SPHERE_INVERSE_T] + 2.0 * k[at + SPHERE_INVERSE_N])
    )
    u = d[3] + k[at + SPHERE_BIAS] + k[at + SPHERE_SOFT] * p + coulomb * mu * sqrt(x * x + y * y + z * z)
    e, g, h = a - s * x, b - s * y, c - s * z
    r = sqrt(e * e + g * g + h * h)
    q, slip, _ = project_on_cone_above(mu, k[at + SPHERE_LEAST], p - s * u, r, 0.0)
    part = slip / r if r > 0.0 else 0.0
    e, g, h, q = part * e - a, part * g - b, part * h - c, q - p
    return e * e + g * g + h * h + q * q, s, size, linear, square


@formula
def frictional_terms(k, v, free, i, j, at, s, coulomb):
    """Residual terms of a frictional contact of any nodes; s: the step."""
    u, f = frictional_velocity(k, v, i, j, at), frictional_velocity(k, free, i, j, at)
    p, a, b, mu = k[at + IMPULSE], k[at + IMPULSE + 1], k[at + IMPULSE + 2], k[at + MU]
    x, y, z = k[at + BIAS], k[at + BIAS + 1], k[at + BIAS + 2]
    linear = p * (f[0] + x) + a * (f[1] + y) + b * (f[2] + z)
    square = p * (u[0] - f[0] + k[at + SOFT] * p) + a * (u[1] - f[1]) + b * (u[2] - f[2])
    size = p * p + a * a + b * b
    e, g = u[1] + y, u[2] + z
    n = p - s * (u[0] + x + k[at + SOFT] * p + coulomb * mu * sqrt(e * e + g * g))
    n, e, g = project_on_cone_above(mu, k[at + LEAST_NORMAL], n, a - s * e, b - s * g)
    n, e, g = n - p, e - a, g - b
    return n * n + e * e + g * g, s, size, linear, square


@formula
def packed_terms(P, X, W, O, kind, s, at):
    """Residual terms of the contact of a kind at visit s."""
    i, j, c = W.sides[s, 0], W.sides[s, 1], W.sides[s, 2]
    if kind == SMOOTH_SPHERE:
        return smooth_sphere_terms(W.packed, W.own, W.free, i, j, at)
    if kind == SPHERE:
        return sphere_terms(W.packed, W.own, W.free, i, j, at, O.count.coulomb)
    if kind == FRICTIONLESS:
        return frictionless_terms(W.packed, W.own, W.free, i, j, at)
    if kind == FRICTIONAL:
        return frictional_terms(W.packed, W.own, W.free, i, j, at, W.rows[1, c, 0], O.count.coulomb)
    return contact_terms(P, X, O, (W.own, X.wide, X.v, W.free_wide), c)


@formula
def packed_residuals(P, X, W, O, many):
    """Compute what `residuals` returns from packed contacts; impulses must also be in X."""
    sofar, begin, at = ZERO_RESIDUAL, 0, 0
    for kind in range(CONTACT_KINDS):
        for s in range(begin, begin + many[kind]):
            sofar = accumulate_residual(sofar, packed_terms(P, X, W, O, kind, s, at))
            at += packed_width(kind)
        begin += many[kind]
    return residual_summary(accumulate_line_residuals(P, X, O, X.wide, W.free_wide, sofar))


@formula
def visit_index(e, m, backwards):
    """Index of the e-th of m visits; counted from the end in a backward sweep."""
    return m - 1 - e if backwards else e


@formula
def sweep_spheres(W, O, many, backwards):
    """Update all contacts of spheres."""
    worst = 0.0
    for e in range(many[SMOOTH_SPHERE]):
        s = visit_index(e, many[SMOOTH_SPHERE], backwards)
        worst = max(worst, update_smooth_sphere(W.packed, W.own, W.sides[s, 0], W.sides[s, 1], SPHERE_WIDTH * s))
    begin = many[SMOOTH_SPHERE]
    for e in range(many[SPHERE]):
        s = begin + visit_index(e, many[SPHERE], backwards)
        worst = max(
            worst, update_sphere(W.packed, W.own, W.sides[s, 0], W.sides[s, 1], SPHERE_WIDTH * s, O.count.coulomb)
        )
    return worst


@formula
def sweep_other_contacts(P, X, W, O, many, backwards):
    """Update all other contacts."""
    worst, begin = 0.0, many[SMOOTH_SPHERE] + many[SPHERE]
    at = SPHERE_WIDTH * begin
    for e in range(many[FRICTIONLESS]):
        s = visit_index(e, many[FRICTIONLESS], backwards)
        i, j = W.sides[begin + s, 0], W.sides[begin + s, 1]
        worst = max(worst, update_frictionless(W.packed, W.own, i, j, at + FRICTIONLESS_WIDTH * s))
    begin, at = begin + many[FRICTIONLESS], at + FRICTIONLESS_WIDTH * many[FRICTIONLESS]
    for e in range(many[FRICTIONAL]):
        s = visit_index(e, many[FRICTIONAL], backwards)
        i, j = W.sides[begin + s, 0], W.sides[begin + s, 1]
        worst = max(worst, update_frictional(W.packed, W.own, W.inner, i, j, at + 32 * s, O.count.coulomb))
    begin, at = begin + many[FRICTIONAL], at + 32 * many[FRICTIONAL]
    for e in range(many[4]):
        s = visit_index(e, many[4], backwards)
        worst = max(worst, update_general(P, X, W, O, W.sides[begin + s, 2], at + 32 * s))
    return worst


@formula
def sweep_lines(P, X, O, backwards):
    """Update all lines."""
    worst = 0.0
    first, last = line_range(P, O)
    for e in range(last - first):
        worst = max(worst, update_line(P, X, first + visit_index(e, last - first, backwards)))
    return worst


@formula
def sweep(P, X, W, O, many, backwards):
    """Update all contacts and lines once; returns the largest change of a velocity."""
    if backwards:
        a = sweep_lines(P, X, O, backwards)
        b = sweep_other_contacts(P, X, W, O, many, backwards)
        return max(max(a, b), sweep_spheres(W, O, many, backwards))
    a = sweep_spheres(W, O, many, backwards)
    b = sweep_other_contacts(P, X, W, O, many, backwards)
    return max(max(a, b), sweep_lines(P, X, O, backwards))


@formula
def unpack_impulses(P, X, W, many):
    """Copy packed impulses back to X."""
    at = 0
    for s in range(many[0] + many[1] + many[2] + many[3] + many[4]):
        c = W.sides[s, 2]
        if s < many[0] + many[1]:
            a, b, d = (
                W.packed[at + SPHERE_TANGENT],
                W.packed[at + SPHERE_TANGENT + 1],
                W.packed[at + SPHERE_TANGENT + 2],
            )
            X.p[c, 0] = W.packed[at + SPHERE_NORMAL]
            if s < many[0]:
                X.p[c, 1], X.p[c, 2] = 0.0, 0.0
            else:
                X.p[c, 1] = P.frame[c, 3] * a + P.frame[c, 4] * b + P.frame[c, 5] * d
                X.p[c, 2] = P.frame[c, 6] * a + P.frame[c, 7] * b + P.frame[c, 8] * d
            at += SPHERE_WIDTH
        elif s < many[0] + many[1] + many[2]:
            X.p[c, 0], X.p[c, 1], X.p[c, 2] = W.packed[at + FRICTIONLESS_NORMAL], 0.0, 0.0
            at += FRICTIONLESS_WIDTH
        else:
            for k in range(3):
                X.p[c, k] = W.packed[at + IMPULSE + k]
            at += 32


@formula
def prepare_sweeps(P, X, W, O):
    """Pack all contacts, and apply the initial impulses; returns the number of contacts of each kind."""
    first, last = contact_range(P, O)
    copy_nodes(P, X, W, node_range(P, O))
    for k in range(X.wide.shape[0]):
        W.free_wide[k] = X.wide[k]
    many = count_contact_kinds(P, W, first, last, 0)
    pack_contacts(P, X, W, O.count.coulomb, first, many)
    begin, end = line_range(P, O)
    for k in range(begin, end):
        apply_line_impulse(P, X.wide, k, X.line[k])
    return many


@kernel
def gauss_seidel(
    P: ContactProblem, X: ContactState, W: ContactWorkspace, O: SolverSettings, F: FactorStorage, task: int
) -> int:
    """Sweep until velocities change by less than O.real.enough, at most O.count.most times; returns the sweeps."""
    many = prepare_sweeps(P, X, W, O)
    used, O.count.ended, O.count.written = 0, LIMIT_REACHED, 0
    while used < O.count.most:
        worst = sweep(P, X, W, O, many, used % 2 == 1)
        used += 1
        if O.count.history:
            unpack_impulses(P, X, W, many)
            finish_solve(P, X, W, O, packed_residuals(P, X, W, O, many), used, False)
        if worst <= O.real.enough:
            O.count.ended = CONVERGED
            break
    O.count.used = used
    unpack_impulses(P, X, W, many)
    finish_solve(P, X, W, O, packed_residuals(P, X, W, O, many), used, True)
    return used
