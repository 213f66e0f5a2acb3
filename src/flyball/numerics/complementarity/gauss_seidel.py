"""Projected Gauss-Seidel: contacts one after the other, in alternating forward and backward sweeps.

Jean and Moreau 1992 (as non-smooth contact dynamics), Tasora and Anitescu 2011 (in the convex form). Updates of
packed contacts are in `packed_contacts`; contacts of groups, contacts with rolling friction, and lines are updated
here through `contact_operator`. Residuals are computed from the packed numbers, much faster than by
`contact_operator.residuals`: functions of one contact return the square of the missing impulse, its step, the
square of the impulse, and its terms of b' p and of p' N p.

Contacts are worked on block by block (`packed_contacts`), on several threads if there are many: all tasks of a solve
but the ordering of contacts and the copies of node velocities.

A solve that ends at the iteration limit returns its impulses scaled down if they would be worse than no impulse at
all: p' N p / 2 + b' p is never positive, so that no energy is generated.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...compiler.kernels import vectorised_kernel
from ...math.scalar import sqrt
from ..thread_team import call_chunks
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
    larger_or_nan,
    line_diagonal,
    line_range,
    line_velocity,
    node_range,
    residual_summary,
    rolling_diagonal_block,
)
from .contact_problem import (
    BLOCK_KERNEL,
    CONVERGED,
    LIMIT_REACHED,
    MOST_BLOCKS,
    ContactProblem,
    ContactSolution,
    ContactWorkspace,
    FactorStorage,
    SolverSettings,
)
from .packed_contacts import (
    CONTACT_KINDS,
    FRICTIONAL,
    FRICTIONLESS,
    GENERAL,
    SMOOTH_SPHERE,
    SPHERE,
    copy_nodes,
    find_blocks,
    frictional_velocity,
    frictionless_velocity,
    interleaved_place,
    last_block,
    local_impulse,
    local_step_sizes,
    order_by_block,
    pack_contact,
    sphere_sliding_velocity,
    update_frictional,
    update_frictionless,
    update_smooth_sphere,
    update_sphere,
)


@formula
def update_general(P, X, W, O, c, at):
    """Update a contact of nodes and groups."""
    k = W.frictional
    n, s, t = k.impulse[at, 0], k.impulse[at, 1], k.impulse[at, 2]
    if P.turn.shape[0] > 0:
        update_rolling(P, X, W, O, c, at)
    else:
        q = local_impulse(k, at, contact_velocity(P, W.node_state, X.wide, c), O.count.coulomb)
        set_impulse(P, X, W, c, at, q)
    d = abs(k.impulse[at, 0] - n) + abs(k.impulse[at, 1] - s) + abs(k.impulse[at, 2] - t)
    return d / k.inverse_nn[at] if d > 0.0 else 0.0


@formula
def set_impulse(P, X, W, c, at, q):
    """Set the impulse to q, and update the velocities."""
    k = W.frictional
    d = q[0] - k.impulse[at, 0], q[1] - k.impulse[at, 1], q[2] - k.impulse[at, 2]
    if d[0] != 0.0 or d[1] != 0.0 or d[2] != 0.0:
        k.impulse[at, 0], k.impulse[at, 1], k.impulse[at, 2] = q
        apply_contact_impulse(P, W.node_state, X.wide, c, d)


@formula
def set_torque_impulse(P, X, W, c, z, x, y):
    """Set the torque impulse, and update the velocities."""
    d = z - X.torque[c, 0], x - X.torque[c, 1], y - X.torque[c, 2]
    X.torque[c, 0], X.torque[c, 1], X.torque[c, 2] = z, x, y
    apply_torque_impulse(P, W.node_state, X.wide, c, d)


@formula
def update_rolling(P, X, W, O, c, at):
    """Update a contact with rolling and spinning friction.

    With Coulomb's law the torques are bounded by the normal impulse found just before. In the convex form all six
    impulses are projected on the cone, in the metric of twice the diagonal blocks.
    """
    steps = local_step_sizes(rolling_diagonal_block(P, c), 0.0, 0)
    spin, roll = steps[0], steps[6]
    u = contact_velocity(P, W.node_state, X.wide, c)
    if O.count.coulomb:
        set_impulse(P, X, W, c, at, local_impulse(W.frictional, at, u, 1))
        n = W.frictional.impulse[at, 0]
        w = contact_angular_velocity(P, W.node_state, X.wide, c)
        z, x, y = X.torque[c, 0] - spin * w[0], X.torque[c, 1] - roll * w[1], X.torque[c, 2] - roll * w[2]
        a, b = fraction_within(n, P.turn[c, 0], sqrt(x * x + y * y)), fraction_within(n, P.turn[c, 1], abs(z))
        set_torque_impulse(P, X, W, c, b * z, a * x, a * y)
    else:
        q, o = project_rolling_step(
            P, X, W.frictional, c, at, u, contact_angular_velocity(P, W.node_state, X.wide, c), (spin, roll)
        )
        set_impulse(P, X, W, c, at, q)
        set_torque_impulse(P, X, W, c, o[0], o[1], o[2])


@formula
def project_rolling_step(P, X, k, c, at, u, w, steps):
    """Impulse and torque of the convex form after a step at velocities u and w."""
    spin, roll, slide, press = 0.5 * steps[0], 0.5 * steps[1], 0.5 * k.sliding_step[at], 0.5 * k.inverse_nn[at]
    n = k.impulse[at, 0] - press * (u[0] + k.bias[at, 0] + k.soft[at] * k.impulse[at, 0])
    s = k.impulse[at, 1] - slide * (u[1] + k.bias[at, 1])
    t = k.impulse[at, 2] - slide * (u[2] + k.bias[at, 2])
    z, x, y = X.torque[c, 0] - spin * w[0], X.torque[c, 1] - roll * w[1], X.torque[c, 2] - roll * w[2]
    r, q, mu, rho, sigma = sqrt(s * s + t * t), sqrt(x * x + y * y), k.mu[at], P.turn[c, 0], P.turn[c, 1]
    # in units in which the metric is 1
    a, b, d = metric_factor(press, slide), metric_factor(press, roll), metric_factor(press, spin)
    near = rolling_cone_normal(mu * a, rho * b, sigma * d, n, r * a, q * b, abs(z) * d)
    near = max(near, k.least[at])
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
    q = p - (line_velocity(P, X.wide, k) + P.line_law.bias[k] + P.line_law.soft[k] * p) / d
    q = min(max(q, P.line_law.lower[k]), P.line_law.upper[k])
    X.line[k] = q
    apply_line_impulse(P, X.wide, k, q - p)
    return abs(q - p) * d


@formula
def centre_velocity(k, v, i, j, at):
    """Relative velocity of the centres of spheres, and its normal part."""
    a, b, c = v[j, 0] - v[i, 0], v[j, 1] - v[i, 1], v[j, 2] - v[i, 2]
    return a, b, c, k.normal[at, 0] * a + k.normal[at, 1] * b + k.normal[at, 2] * c


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
        k.impulse[at],
        u,
        before,
        (k.inverse_normal[at], k.bias[at], k.soft[at]),
        k.least[at],
    )


@formula
def frictionless_terms(k, v, free, i, j, at):
    """Residual terms of a frictionless contact of any nodes."""
    u, before = frictionless_velocity(k, v, i, j, at), frictionless_velocity(k, free, i, j, at)
    return normal_terms(
        k.impulse[at],
        u,
        before,
        (k.inverse[at], k.bias[at], k.soft[at]),
        k.least[at],
    )


@formula
def sphere_terms(k, v, free, i, j, at, coulomb):
    """Residual terms of a contact of spheres."""
    d, f = centre_velocity(k, v, i, j, at), centre_velocity(k, free, i, j, at)
    x, y, z = sphere_sliding_velocity(k, v, i, j, at, d)
    e, g, h = sphere_sliding_velocity(k, free, i, j, at, f)
    p, a, b, c, mu = (
        k.impulse[at],
        k.tangent[at, 0],
        k.tangent[at, 1],
        k.tangent[at, 2],
        k.mu[at],
    )
    linear = p * (f[3] + k.bias[at]) + a * e + b * g + c * h
    square = p * (d[3] - f[3] + k.soft[at] * p) + a * (x - e) + b * (y - g) + c * (z - h)
    size = p * p + a * a + b * b + c * c
    s = 3.0 * k.inverse_normal[at] * k.inverse_tangential[at] / (k.inverse_tangential[at] + 2.0 * k.inverse_normal[at])
    u = d[3] + k.bias[at] + k.soft[at] * p + coulomb * mu * sqrt(x * x + y * y + z * z)
    e, g, h = a - s * x, b - s * y, c - s * z
    r = sqrt(e * e + g * g + h * h)
    q, slip, _ = project_on_cone_above(mu, k.least[at], p - s * u, r, 0.0)
    part = slip / r if r > 0.0 else 0.0
    e, g, h, q = part * e - a, part * g - b, part * h - c, q - p
    return e * e + g * g + h * h + q * q, s, size, linear, square


@formula
def frictional_terms(k, v, free, i, j, at, s, coulomb):
    """Residual terms of a frictional contact of any nodes; s: the step."""
    u, f = frictional_velocity(k, v, i, j, at), frictional_velocity(k, free, i, j, at)
    p, a, b, mu = k.impulse[at, 0], k.impulse[at, 1], k.impulse[at, 2], k.mu[at]
    x, y, z = k.bias[at, 0], k.bias[at, 1], k.bias[at, 2]
    linear = p * (f[0] + x) + a * (f[1] + y) + b * (f[2] + z)
    square = p * (u[0] - f[0] + k.soft[at] * p) + a * (u[1] - f[1]) + b * (u[2] - f[2])
    size = p * p + a * a + b * b
    e, g = u[1] + y, u[2] + z
    n = p - s * (u[0] + x + k.soft[at] * p + coulomb * mu * sqrt(e * e + g * g))
    n, e, g = project_on_cone_above(mu, k.least[at], n, a - s * e, b - s * g)
    n, e, g = n - p, e - a, g - b
    return n * n + e * e + g * g, s, size, linear, square


@formula
def packed_terms(P, X, W, O, kind, s):
    """Residual terms of the contact of a kind at visit s."""
    i, j, c = W.contact_nodes[s, 0], W.contact_nodes[s, 1], W.contact_nodes[s, 2]
    if kind == SMOOTH_SPHERE:
        return smooth_sphere_terms(W.spheres, W.node_state, W.free, i, j, s)
    if kind == SPHERE:
        return sphere_terms(W.spheres, W.node_state, W.free, i, j, s, O.count.coulomb)
    if kind == FRICTIONLESS:
        return frictionless_terms(W.frictionless, W.node_state, W.free, i, j, s)
    if kind == FRICTIONAL:
        return frictional_terms(W.frictional, W.node_state, W.free, i, j, s, W.rows[1, c, 0], O.count.coulomb)
    return contact_terms(P, X, O, (W.node_state, X.wide, X.v, W.free_wide), c)


@formula
def visit_index(e, m, backwards):
    """Index of the e-th of m visits; counted from the end in a backward sweep."""
    return m - 1 - e if backwards else e


@formula
def sweep_spheres(W, O, block, backwards):
    """Update all contacts of spheres of a block."""
    worst, first = 0.0, W.block_start[block]
    begin, many = first[SMOOTH_SPHERE], first[SMOOTH_SPHERE + 1] - first[SMOOTH_SPHERE]
    for e in range(many):
        s = begin + visit_index(e, many, backwards)
        i, j = W.contact_nodes[s, 0], W.contact_nodes[s, 1]
        worst = max(worst, update_smooth_sphere(W.spheres, W.node_state, i, j, s))
    begin, many = first[SPHERE], first[SPHERE + 1] - first[SPHERE]
    for e in range(many):
        s = begin + visit_index(e, many, backwards)
        i, j = W.contact_nodes[s, 0], W.contact_nodes[s, 1]
        worst = max(worst, update_sphere(W.spheres, W.node_state, i, j, s, O.count.coulomb))
    return worst


@formula
def sweep_other_contacts(P, X, W, O, block, backwards):
    """Update all other contacts of a block."""
    worst, first = 0.0, W.block_start[block]
    begin, many = first[FRICTIONLESS], first[FRICTIONLESS + 1] - first[FRICTIONLESS]
    for e in range(many):
        s = begin + visit_index(e, many, backwards)
        i, j = W.contact_nodes[s, 0], W.contact_nodes[s, 1]
        worst = max(worst, update_frictionless(W.frictionless, W.node_state, i, j, s))
    begin, many = first[FRICTIONAL], first[FRICTIONAL + 1] - first[FRICTIONAL]
    for e in range(many):
        s = begin + visit_index(e, many, backwards)
        i, j = W.contact_nodes[s, 0], W.contact_nodes[s, 1]
        worst = max(worst, update_frictional(W.frictional, W.node_state, W.inner, i, j, s, O.count.coulomb))
    begin, many = first[GENERAL], first[GENERAL + 1] - first[GENERAL]
    for e in range(many):
        s = begin + visit_index(e, many, backwards)
        worst = max(worst, update_general(P, X, W, O, W.contact_nodes[s, 2], s))
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
def sweep_block(P, X, W, O, block, backwards):
    """Update all contacts of a block, of the last block the lines too; returns the largest change of a velocity."""
    last = block == last_block(O)
    if backwards:
        a = sweep_lines(P, X, O, backwards) if last else 0.0
        b = sweep_other_contacts(P, X, W, O, block, backwards)
        return max(max(a, b), sweep_spheres(W, O, block, backwards))
    a = sweep_spheres(W, O, block, backwards)
    b = sweep_other_contacts(P, X, W, O, block, backwards)
    return max(max(a, b), sweep_lines(P, X, O, backwards) if last else 0.0)


@formula
def pack_block(P, X, W, O, block):
    """Pack the contacts of a block, and apply their initial impulses."""
    for kind in range(CONTACT_KINDS):
        begin, many = W.block_start[block, kind], W.block_start[block, kind + 1] - W.block_start[block, kind]
        for e in range(many):
            c = W.block_order[begin + e]
            pack_contact(P, X, W, O.count.coulomb, c, kind, begin + interleaved_place(e, many), P.size[1] + block)


@formula
def finish_block(P, X, W, O, block):
    """Copy the packed impulses of a block back to X, and store its terms of the residual."""
    sofar = ZERO_RESIDUAL
    for kind in range(CONTACT_KINDS):
        for at in range(W.block_start[block, kind], W.block_start[block, kind + 1]):
            unpack_impulse(P, X, W, kind, at)
            sofar = accumulate_residual(sofar, packed_terms(P, X, W, O, kind, at))
    for k in range(5):
        W.block_terms[block, 1 + k] = sofar[k]


@formula
def unpack_impulse(P, X, W, kind, at):
    """Copy a packed impulse back to X."""
    c = W.contact_nodes[at, 2]
    if kind == SMOOTH_SPHERE:
        X.p[c, 0], X.p[c, 1], X.p[c, 2] = W.spheres.impulse[at], 0.0, 0.0
    elif kind == SPHERE:
        a, b, d = W.spheres.tangent[at, 0], W.spheres.tangent[at, 1], W.spheres.tangent[at, 2]
        X.p[c, 0] = W.spheres.impulse[at]
        X.p[c, 1] = P.frame[c, 3] * a + P.frame[c, 4] * b + P.frame[c, 5] * d
        X.p[c, 2] = P.frame[c, 6] * a + P.frame[c, 7] * b + P.frame[c, 8] * d
    elif kind == FRICTIONLESS:
        X.p[c, 0], X.p[c, 1], X.p[c, 2] = W.frictionless.impulse[at], 0.0, 0.0
    else:
        for k in range(3):
            X.p[c, k] = W.frictional.impulse[at, k]


FIND, PACK, FORWARDS, BACKWARDS, FINISH = range(5)  # tasks


@formula
def work_on_block(P, X, W, O, work, block):
    """Do a task for a block."""
    if work == FIND:
        find_blocks(P, W, O, block)
    elif work == PACK:
        pack_block(P, X, W, O, block)
    elif work == FINISH:
        finish_block(P, X, W, O, block)
    else:
        W.block_terms[block, 0] = sweep_block(P, X, W, O, block, work == BACKWARDS)


@vectorised_kernel
def block_kernel(
    P: ContactProblem, X: ContactSolution, W: ContactWorkspace, O: SolverSettings, F: FactorStorage, task: int
) -> int:
    """Do task // MOST_BLOCKS for block task % MOST_BLOCKS."""
    work_on_block(P, X, W, O, task // MOST_BLOCKS, task % MOST_BLOCKS)
    return 0


@formula
def work_on_blocks(P, X, W, O, F, work):
    """Do a task for all blocks: for slabs at the same time, for cuts at the same time, for the rest; or backwards."""
    slabs = O.count.slabs
    for k in range(3):
        stage = 2 - k if work == BACKWARDS else k
        if stage == 2:
            work_on_block(P, X, W, O, work, last_block(O))
        elif slabs > 1:
            call_chunks(
                F.team, F.team[BLOCK_KERNEL], (P, X, W, O, F), work * MOST_BLOCKS + stage * slabs, slabs - stage
            )


@formula
def largest_change(W, O):
    """Largest change of a velocity in a sweep, of all blocks; nan if any is."""
    last = last_block(O)
    worst = W.block_terms[last, 0]
    for block in range(last if O.count.slabs > 1 else 0):
        worst = larger_or_nan(worst, W.block_terms[block, 0])
    return worst


@formula
def residual_of_blocks(P, X, W, O):
    """Compute what `residuals` returns from the terms of the blocks."""
    last = last_block(O)
    sofar = ZERO_RESIDUAL
    for block in range(0 if O.count.slabs > 1 else last, last + 1):
        t = W.block_terms[block]
        a, b, c = larger_or_nan(sofar[0], t[1]), larger_or_nan(sofar[1], t[2]), larger_or_nan(sofar[2], t[3])
        sofar = (a, b, c, sofar[3] + t[4], sofar[4] + t[5])
    return residual_summary(accumulate_line_residuals(P, X, O, X.wide, W.free_wide, sofar))


@formula
def prepare_sweeps(P, X, W, O, F):
    """Pack all contacts, and apply the initial impulses."""
    first, last = contact_range(P, O)
    copy_nodes(P, X, W, node_range(P, O))
    for i in range(P.size[1] + 1, P.size[1] + last_block(O) + 1):
        for k in range(8):
            W.node_state[i, k] = 0.0
    for k in range(X.wide.shape[0]):
        W.free_wide[k] = X.wide[k]
    work_on_blocks(P, X, W, O, F, FIND)
    order_by_block(W, O, first, last)
    work_on_blocks(P, X, W, O, F, PACK)
    begin, end = line_range(P, O)
    for k in range(begin, end):
        apply_line_impulse(P, X.wide, k, X.line[k])


@vectorised_kernel
def gauss_seidel(
    P: ContactProblem, X: ContactSolution, W: ContactWorkspace, O: SolverSettings, F: FactorStorage, task: int
) -> int:
    """Sweep until velocities change by less than O.real.enough, at most O.count.most times; returns the sweeps."""
    prepare_sweeps(P, X, W, O, F)
    used, O.count.ended = 0, LIMIT_REACHED
    while used < O.count.most:
        work_on_blocks(P, X, W, O, F, FORWARDS if used % 2 == 0 else BACKWARDS)
        used += 1
        if largest_change(W, O) <= O.real.enough:
            O.count.ended = CONVERGED
            break
    O.count.used = used
    work_on_blocks(P, X, W, O, F, FINISH)
    finish_solve(P, X, W, O, residual_of_blocks(P, X, W, O))
    return used
