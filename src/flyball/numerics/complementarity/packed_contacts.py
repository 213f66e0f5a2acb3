"""Contacts packed by kind in visiting order, all numbers of each together, and their local updates.

Contacts are grouped by kind, the kinds with the least work first: spheres without friction, spheres, others without
friction, others with friction, and general ones (groups, rolling friction). Within a kind, successive contacts are
taken from distant places of the list, so that they share no body and the processor works on several at once.

Contacts of many nodes are divided into blocks, so that several threads can work on them. Space is divided into slabs
with equally many nodes, each of two half slabs (`ContactProblem.half_slab`). A block holds the contacts within a slab,
or those of a cut, between the last half of a slab and the first half of the next one. Slabs have no node in common, nor
have cuts; all other contacts, of groups too, are in the last block, the rest. A sweep visits all slabs at the same
time, then all cuts, then the rest; contacts of islands that are solved are left out. The blocks depend on places only,
so that any number of threads gives the same bits.

A local update returns the largest change of a velocity that its new impulse causes [m/s]. With Coulomb's law the
normal impulse is found first, then the tangential one within mu times that. In the convex form (``coulomb`` 0) the
impulse after a step is projected on the cone, in the metric of the diagonal block.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from ...math.vec import cross, dot
from .cone_projection import fraction_within, least_normal_impulse
from .contact_operator import (
    angular_response,
    apply_contact_impulse,
    apply_torque_impulse,
    contact_range,
    diagonal_block,
    frame_axis,
)
from .contact_problem import FIXED_SIDE

SMOOTH_SPHERE, SPHERE, FRICTIONLESS, FRICTIONAL, GENERAL, CONTACT_KINDS = range(6)
INTERLEAVED_STREAMS = 4
PARALLEL_TOLERANCE = (
    1e-20  # largest squared sine of the angle between an arm and the normal; poses far from the origin are rounded
)
# columns of ContactWorkspace.own
INVERSE_MASS_COLUMN, MEAN_INERTIA_COLUMN = 6, 7  # 1/m, mean of the block's diagonal


@formula
def copy_nodes(P, X, W, nodes):
    """Copy velocities and inverse masses of the nodes ``member[first:last]`` to the workspace."""
    for e in range(nodes[0], nodes[1]):
        i = P.member[e]
        for k in range(6):
            W.node_state[i, k] = X.v[i, k]
            W.free[i, k] = X.v[i, k]
            W.inner[i, k] = P.node.inverse_inertia[i, k]
        W.node_state[i, INVERSE_MASS_COLUMN] = P.node.inverse_mass[i]
        W.node_state[i, MEAN_INERTIA_COLUMN] = (
            P.node.inverse_inertia[i, 0] + P.node.inverse_inertia[i, 1] + P.node.inverse_inertia[i, 2]
        ) / 3.0
    for k in range(8):
        W.node_state[P.size[1], k], W.inner[P.size[1], k], W.free[P.size[1], k] = 0.0, 0.0, 0.0


@formula
def arm_along_normal(P, c, side):
    """Whether the arm is parallel to the normal, and its length along the normal."""
    a, b, d = P.arm[c, 3 * side], P.arm[c, 3 * side + 1], P.arm[c, 3 * side + 2]
    x, y, z = P.frame[c, 0], P.frame[c, 1], P.frame[c, 2]
    r = a * x + b * y + d * z
    a, b, d = a - r * x, b - r * y, d - r * z
    return a * a + b * b + d * d <= PARALLEL_TOLERANCE * r * r, r


@formula
def contact_kind(P, W, c, friction_level):
    """Kind of a contact; writes the arms of spheres to W.rows[0].

    ``friction_level``: 1: no contact counts as frictionless; 2: no contact counts as one of spheres either.
    """
    i, j = P.at[c, 0], P.at[c, 1]
    if i < FIXED_SIDE or j < FIXED_SIDE or P.turn.shape[0] > 0:
        return GENERAL
    if friction_level > 1:
        return FRICTIONAL
    first, second = True, True
    W.rows[0, c, 1], W.rows[0, c, 2] = 0.0, 0.0
    if i >= 0:
        first, W.rows[0, c, 1] = arm_along_normal(P, c, 0)
    if j >= 0:
        second, W.rows[0, c, 2] = arm_along_normal(P, c, 1)
    if P.mu[c] == 0.0 and not friction_level:
        return SMOOTH_SPHERE if first and second else FRICTIONLESS
    if not (first and second) or P.bias[c, 1] != 0.0 or P.bias[c, 2] != 0.0:
        return FRICTIONAL
    if (i < 0 or P.node.inverse_mass[i] == 0.0) and (j < 0 or P.node.inverse_mass[j] == 0.0):
        return FRICTIONAL
    alike = (i < 0 or P.node.isotropic[i] == 1.0) and (j < 0 or P.node.isotropic[j] == 1.0)
    x, y, z = P.frame[c, 6], P.frame[c, 7], P.frame[c, 8]
    return SPHERE if alike and abs(x * x + y * y + z * z - 1.0) < 1e-12 else FRICTIONAL


@formula
def interleaved_place(e, m):
    """Place of the e-th of m contacts in a sweep."""
    q = m // INTERLEAVED_STREAMS
    if e < q * INTERLEAVED_STREAMS:
        return (e % q) * INTERLEAVED_STREAMS + e // q
    return e


@formula
def last_block(O):
    """Number of the last block, the rest."""
    return 2 * max(O.count.slabs, 1) - 1


@formula
def block_of_contact(P, c, slabs):
    """Block of contact c: slab k, the cut slabs + k between slabs k and k + 1, the rest; one more if it is solved."""
    i, j = P.at[c, 0], P.at[c, 1]
    rest = 2 * max(slabs, 1) - 1
    if slabs < 2 or i < FIXED_SIDE or j < FIXED_SIDE or max(i, j) < 0:
        return rest
    a = P.half_slab[i if i >= 0 else j]
    b = P.half_slab[j if j >= 0 else i]
    low, high = min(a, b), max(a, b)
    if low < 0:
        return rest + 1
    if low // 2 == high // 2:
        return low // 2
    return slabs + low // 2 if high == low + 1 else rest


@formula
def find_blocks(P, W, O, part):
    """Write block and kind of each contact of a part of the list, one part for each block, to W.rows[0, c, 0]."""
    first, last = contact_range(P, O)
    parts, slabs = last_block(O) + 1, O.count.slabs
    begin, end = first + (last - first) * part // parts, first + (last - first) * (part + 1) // parts
    for c in range(begin if slabs > 1 else first, end):
        W.rows[0, c, 0] = block_of_contact(P, c, slabs) * CONTACT_KINDS + contact_kind(P, W, c, 0)


@formula
def order_by_block(W, O, first, last):
    """Sort contacts by block and kind into ``W.block_order``, stable; sets ``W.block_start``."""
    blocks = last_block(O) + 2  # the last one of contacts that are solved
    for b in range(blocks):
        for kind in range(CONTACT_KINDS + 1):
            W.block_start[b, kind] = 0
    for c in range(first, last):
        code = int(W.rows[0, c, 0])
        W.block_start[code // CONTACT_KINDS, code % CONTACT_KINDS] += 1
    place = 0
    for b in range(blocks):
        for kind in range(CONTACT_KINDS):
            many = W.block_start[b, kind]
            W.block_start[b, kind] = place
            place += many
    for c in range(first, last):
        code = int(W.rows[0, c, 0])
        b, kind = code // CONTACT_KINDS, code % CONTACT_KINDS
        W.block_order[W.block_start[b, kind]] = c
        W.block_start[b, kind] += 1
    place = 0
    for b in range(blocks):
        for kind in range(CONTACT_KINDS):
            end = W.block_start[b, kind]
            W.block_start[b, kind] = place
            place = end
        W.block_start[b, CONTACT_KINDS] = place


@formula
def pack_sphere(P, X, W, c, place):
    """Pack a contact of spheres."""
    k, i, j, r1, r2 = W.spheres, P.at[c, 0], P.at[c, 1], W.rows[0, c, 1], -W.rows[0, c, 2]
    dn, dt, p, q = 0.0, 0.0, X.p[c, 1], X.p[c, 2]
    for s in range(3):
        k.normal[place, s] = P.frame[c, s]
        k.tangent[place, s] = P.frame[c, 3 + s] * p + P.frame[c, 6 + s] * q
    if i >= 0:
        dn, dt = dn + P.node.inverse_mass[i], dt + r1 * r1 * P.node.inverse_inertia[i, 0]
    if j >= 0:
        dn, dt = dn + P.node.inverse_mass[j], dt + r2 * r2 * P.node.inverse_inertia[j, 0]
    dt += dn
    k.arm_1[place], k.arm_2[place] = r1, r2
    k.bias[place], k.soft[place] = P.bias[c, 0], P.soft[c]
    k.inverse_normal[place] = 1.0 / (dn + P.soft[c]) if dn > 0.0 else 0.0
    k.inverse_tangential[place] = 1.0 / dt if dt > 0.0 else 0.0
    k.mu[place], k.ratio[place] = P.mu[c], dt * k.inverse_normal[place]
    k.impulse[place], k.least[place] = X.p[c, 0], least_normal_impulse(P, c)


@formula
def pack_frictionless(P, W, c, place):
    """Pack a contact without friction between any nodes."""
    k, n = W.frictionless, frame_axis(P, c, 0)
    d = P.soft[c]
    for side in range(2):
        i = P.at[c, side]
        a = P.arm[c, 3 * side], P.arm[c, 3 * side + 1], P.arm[c, 3 * side + 2]
        r, g = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        if i >= 0:
            r = cross(a, n)
            g = angular_response(P, i, r)
            d += P.node.inverse_mass[i] + dot(r, g)
        for s in range(3):
            k.normal[place, s] = n[s]
            k.torque[place, 3 * side + s] = r[s]
            k.spin[place, 3 * side + s] = g[s]
    k.bias[place], k.soft[place] = P.bias[c, 0], P.soft[c]
    k.inverse[place] = 1.0 / d if d > P.soft[c] else 0.0


@formula
def pack_frictional(P, coulomb, W, c, place):
    """Pack a contact with friction, of nodes or groups."""
    k, D = W.frictional, diagonal_block(P, c)
    for s in range(9):
        k.frame[place, s] = P.frame[c, s]
    for s in range(6):
        k.arm[place, s] = P.arm[c, s]
    for s in range(3):
        k.bias[place, s] = P.bias[c, s]
    k.soft[place], k.mu[place] = P.soft[c], P.mu[c]
    size = D[0] + D[3] + D[5]
    W.rows[1, c, 0] = 3.0 / (size + P.soft[c]) if size > 0.0 else 0.0
    (
        k.inverse_nn[place],
        k.ns[place],
        k.nt[place],
        k.inverse_ss[place],
        k.inverse_st[place],
        k.inverse_tt[place],
        k.sliding_step[place],
        k.ratio[place],
    ) = local_step_sizes(D, P.soft[c], coulomb)


@formula
def local_step_sizes(D, soft, coulomb):
    """Inverse of nn, ns, nt, the inverse of the tangential block, a common tangential step, its ratio to nn.

    For the convex form (``coulomb`` 0) of a diagonal matrix that bounds D from above: with c = |(ns, nt)| and l
    the larger eigenvalue of the tangential block, D <= (1 + c / sqrt(nn l)) diag(nn, l, l).
    """
    nn, ns, nt, ss, st, tt = D[0] + soft, D[1], D[2], D[3], D[4], D[5]
    if not nn > soft:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    half = 0.5 * (ss - tt)
    most = 0.5 * (ss + tt) + sqrt(half * half + st * st)
    if most <= 1e-12 * nn:
        return 1.0 / nn, ns, nt, 0.0, 0.0, 0.0, 0.0, 0.0
    if not coulomb:
        more = 1.0 + sqrt((ns * ns + nt * nt) / (nn * most))
        return 1.0 / (more * nn), ns, nt, 0.0, 0.0, 0.0, 1.0 / (more * most), most / nn
    det = ss * tt - st * st
    if det <= 1e-12 * most * most:  # sliding is possible in one direction only
        det, ss, st, tt = most * most, tt, -st, ss
    return 1.0 / nn, ns, nt, tt / det, -st / det, ss / det, 1.0 / most, most / nn


@formula
def count_contact_kinds(P, W, first, last, friction_level):
    """Count the contacts of each kind; writes the kind of each to W.rows[0, c, 0]."""
    a, b, d, e, f = 0, 0, 0, 0, 0
    for c in range(first, last):
        kind = contact_kind(P, W, c, friction_level)
        W.rows[0, c, 0] = kind
        if kind == SMOOTH_SPHERE:
            a += 1
        elif kind == SPHERE:
            b += 1
        elif kind == FRICTIONLESS:
            d += 1
        elif kind == FRICTIONAL:
            e += 1
        else:
            f += 1
    return a, b, d, e, f


@formula
def pack_contacts(P, X, W, coulomb, first, many):
    """Pack contacts in visiting order, and apply their impulses to the velocities in W.node_state and X.wide."""
    begin = 0  # first visit of a kind
    last = first + many[0] + many[1] + many[2] + many[3] + many[4]
    for kind in range(CONTACT_KINDS):
        e, m = 0, many[kind]
        for c in range(first, last if m > 0 else first):
            if W.rows[0, c, 0] == kind:
                visit = interleaved_place(e, m)
                e += 1
                pack_contact(P, X, W, coulomb, c, kind, begin + visit, P.size[1])
        begin += m


@formula
def make_admissible(P, X, c):
    """Make the initial impulse admissible: nonnegative normal part, friction reduced to its cone."""
    n = X.p[c, 0] if X.p[c, 0] > 0.0 else 0.0  # nan too
    n = max(n, least_normal_impulse(P, c))
    a, b = X.p[c, 1], X.p[c, 2]
    r = sqrt(a * a + b * b)
    part = fraction_within(n, P.mu[c], r) if n > 0.0 and r == r else 0.0
    X.p[c, 0], X.p[c, 1], X.p[c, 2] = n, part * a if part > 0.0 else 0.0, part * b if part > 0.0 else 0.0
    if P.turn.shape[0] > 0:
        z, a, b = X.torque[c, 0], X.torque[c, 1], X.torque[c, 2]
        roll = fraction_within(n, P.turn[c, 0], sqrt(a * a + b * b)) if n > 0.0 else 0.0
        spin = fraction_within(n, P.turn[c, 1], abs(z)) if n > 0.0 else 0.0
        X.torque[c, 0], X.torque[c, 1], X.torque[c, 2] = spin * z, roll * a, roll * b


@formula
def pack_contact(P, X, W, coulomb, c, kind, place, still):
    """Pack one contact, and apply its impulse; still: row of ``W.node_state`` for an immovable side."""
    i, j = P.at[c, 0], P.at[c, 1]
    i, j = i if i >= 0 else still, j if j >= 0 else still
    W.contact_nodes[place, 0], W.contact_nodes[place, 1], W.contact_nodes[place, 2] = i, j, c
    make_admissible(P, X, c)
    if kind == SMOOTH_SPHERE or kind == SPHERE:
        pack_sphere(P, X, W, c, place)
        if W.spheres.impulse[place] != 0.0:
            apply_sphere_impulse(
                W.spheres,
                W.node_state,
                i,
                j,
                place,
                (
                    W.spheres.impulse[place],
                    W.spheres.tangent[place, 0],
                    W.spheres.tangent[place, 1],
                    W.spheres.tangent[place, 2],
                ),
            )
        return
    p = X.p[c, 0], X.p[c, 1], X.p[c, 2]
    if kind == FRICTIONLESS:
        pack_frictionless(P, W, c, place)
        W.frictionless.impulse[place], W.frictionless.least[place] = p[0], least_normal_impulse(P, c)
    else:
        pack_frictional(P, coulomb, W, c, place)
        W.frictional.least[place] = least_normal_impulse(P, c)
        for s in range(3):
            W.frictional.impulse[place, s] = p[s]
    if p[0] != 0.0 or p[1] != 0.0 or p[2] != 0.0:
        apply_contact_impulse(P, W.node_state, X.wide, c, p)
    if P.turn.shape[0] > 0:
        apply_torque_impulse(P, W.node_state, X.wide, c, (X.torque[c, 0], X.torque[c, 1], X.torque[c, 2]))


@formula
def apply_sphere_impulse(k, v, i, j, at, p):
    """Apply an impulse of a contact of spheres: normal part, tangential vector in world axes."""
    x, y, z, r1, r2 = k.normal[at, 0], k.normal[at, 1], k.normal[at, 2], k.arm_1[at], k.arm_2[at]
    n, a, b, c = p
    e, f, g = y * c - z * b, z * a - x * c, x * b - y * a  # n x tangential
    a, b, c = a + n * x, b + n * y, c + n * z
    m, r = v[j, INVERSE_MASS_COLUMN], r2 * v[j, MEAN_INERTIA_COLUMN]
    v[j, 0] += m * a
    v[j, 1] += m * b
    v[j, 2] += m * c
    v[j, 3] -= r * e
    v[j, 4] -= r * f
    v[j, 5] -= r * g
    m, r = v[i, INVERSE_MASS_COLUMN], r1 * v[i, MEAN_INERTIA_COLUMN]
    v[i, 0] -= m * a
    v[i, 1] -= m * b
    v[i, 2] -= m * c
    v[i, 3] -= r * e
    v[i, 4] -= r * f
    v[i, 5] -= r * g


@formula
def limit_friction(n, r, mu, ratio, coulomb, least):
    """Limit a step to (n, r): normal impulse, and the factor of the tangential one; see the module docstring."""
    near = n if n > least else least
    if r <= mu * near:
        return near, 1.0
    if not coulomb:
        near = (n + ratio * mu * r) / (1.0 + ratio * mu * mu)
        near = near if near > least else least
    return near, mu * near / r


@formula
def update_smooth_sphere(k, v, i, j, at):
    """Update a contact of spheres without friction: only velocities along the normal change."""
    x, y, z, p = k.normal[at, 0], k.normal[at, 1], k.normal[at, 2], k.impulse[at]
    u = x * (v[j, 0] - v[i, 0]) + y * (v[j, 1] - v[i, 1]) + z * (v[j, 2] - v[i, 2])
    q = p - (u + k.bias[at] + k.soft[at] * p) * k.inverse_normal[at]
    q = q if q > k.least[at] else k.least[at]
    d = q - p
    if d == 0.0:
        return 0.0
    k.impulse[at] = q
    a, b = d * v[j, INVERSE_MASS_COLUMN], d * v[i, INVERSE_MASS_COLUMN]
    v[j, 0] += a * x
    v[j, 1] += a * y
    v[j, 2] += a * z
    v[i, 0] -= b * x
    v[i, 1] -= b * y
    v[i, 2] -= b * z
    return abs(a + b)


@formula
def frictionless_velocity(k, v, i, j, at):
    """Return the normal velocity of a frictionless contact, without bias."""
    u = (
        k.normal[at, 0] * (v[j, 0] - v[i, 0])
        + k.normal[at, 1] * (v[j, 1] - v[i, 1])
        + k.normal[at, 2] * (v[j, 2] - v[i, 2])
    )
    u += k.torque[at, 3] * v[j, 3] + k.torque[at, 4] * v[j, 4] + k.torque[at, 5] * v[j, 5]
    return u - (k.torque[at, 0] * v[i, 3] + k.torque[at, 1] * v[i, 4] + k.torque[at, 2] * v[i, 5])


@formula
def update_frictionless(k, v, i, j, at):
    """Update a frictionless contact of any nodes."""
    x, y, z, p = k.normal[at, 0], k.normal[at, 1], k.normal[at, 2], k.impulse[at]
    u = frictionless_velocity(k, v, i, j, at)
    q = p - (u + k.bias[at] + k.soft[at] * p) * k.inverse[at]
    q = q if q > k.least[at] else k.least[at]
    d = q - p
    if d == 0.0:
        return 0.0
    k.impulse[at] = q
    a, b = d * v[j, INVERSE_MASS_COLUMN], d * v[i, INVERSE_MASS_COLUMN]
    v[j, 0] += a * x
    v[j, 1] += a * y
    v[j, 2] += a * z
    v[j, 3] += d * k.spin[at, 3]
    v[j, 4] += d * k.spin[at, 4]
    v[j, 5] += d * k.spin[at, 5]
    v[i, 0] -= b * x
    v[i, 1] -= b * y
    v[i, 2] -= b * z
    v[i, 3] -= d * k.spin[at, 0]
    v[i, 4] -= d * k.spin[at, 1]
    v[i, 5] -= d * k.spin[at, 2]
    return abs(d) / k.inverse[at]


@formula
def sphere_sliding_velocity(k, v, i, j, at, d):
    """Tangential velocity of spheres in world axes; d: relative velocity of the centres and its normal part."""
    x, y, z, r1, r2 = k.normal[at, 0], k.normal[at, 1], k.normal[at, 2], k.arm_1[at], k.arm_2[at]
    e, f, g = r2 * v[j, 3], r2 * v[j, 4], r2 * v[j, 5]
    e, f, g = e + r1 * v[i, 3], f + r1 * v[i, 4], g + r1 * v[i, 5]
    # u = v2 - v1 - (r2 w2 + r1 w1) x n, minus its normal part
    a, b, c, n = d
    return a - n * x - (f * z - g * y), b - n * y - (g * x - e * z), c - n * z - (e * y - f * x)


@formula
def update_sphere(k, v, i, j, at, coulomb):
    """Update a contact of spheres: the tangential impulse is a vector in world axes, uncoupled from the normal one."""
    a, b, c, p = v[j, 0] - v[i, 0], v[j, 1] - v[i, 1], v[j, 2] - v[i, 2], k.impulse[at]
    un = k.normal[at, 0] * a + k.normal[at, 1] * b + k.normal[at, 2] * c
    n = p - (un + k.bias[at] + k.soft[at] * p) * k.inverse_normal[at]
    if n <= 0.0 and p == 0.0 and coulomb and k.least[at] == 0.0:
        return 0.0
    a, b, c = sphere_sliding_velocity(k, v, i, j, at, (a, b, c, un))
    it, s, t, w = (
        k.inverse_tangential[at],
        k.tangent[at, 0],
        k.tangent[at, 1],
        k.tangent[at, 2],
    )
    a, b, c = s - it * a, t - it * b, w - it * c
    q, part = limit_friction(n, sqrt(a * a + b * b + c * c), k.mu[at], k.ratio[at], coulomb, k.least[at])
    a, b, c = part * a, part * b, part * c
    k.impulse[at], k.tangent[at, 0], k.tangent[at, 1], k.tangent[at, 2] = q, a, b, c
    n, a, b, c = q - p, a - s, b - t, c - w
    apply_sphere_impulse(k, v, i, j, at, (n, a, b, c))
    return (abs(n) + abs(a) + abs(b) + abs(c)) / it


@formula
def packed_point_velocity(k, v, i, at, side):
    """Velocity of node i at the contact that it is on a side of."""
    a, b, c = k.arm[at, 3 * side], k.arm[at, 3 * side + 1], k.arm[at, 3 * side + 2]
    e, f, g = v[i, 3], v[i, 4], v[i, 5]
    return v[i, 0] + f * c - g * b, v[i, 1] + g * a - e * c, v[i, 2] + e * b - f * a


@formula
def frictional_velocity(k, v, i, j, at):
    """Velocity of a frictional contact along its frame, without bias."""
    a, b, c = packed_point_velocity(k, v, j, at, 1)
    e, f, g = packed_point_velocity(k, v, i, at, 0)
    a, b, c = a - e, b - f, c - g
    return (
        k.frame[at, 0] * a + k.frame[at, 1] * b + k.frame[at, 2] * c,
        k.frame[at, 3] * a + k.frame[at, 4] * b + k.frame[at, 5] * c,
        k.frame[at, 6] * a + k.frame[at, 7] * b + k.frame[at, 8] * c,
    )


@formula
def apply_point_impulse(k, v, B, i, at, side, x, y, z):
    """Apply an impulse at that point to node i."""
    a, b, c, m = k.arm[at, 3 * side], k.arm[at, 3 * side + 1], k.arm[at, 3 * side + 2], v[i, INVERSE_MASS_COLUMN]
    e, f, g = b * z - c * y, c * x - a * z, a * y - b * x
    v[i, 0] += m * x
    v[i, 1] += m * y
    v[i, 2] += m * z
    v[i, 3] += B[i, 0] * e + B[i, 3] * f + B[i, 4] * g
    v[i, 4] += B[i, 3] * e + B[i, 1] * f + B[i, 5] * g
    v[i, 5] += B[i, 4] * e + B[i, 5] * f + B[i, 2] * g


@formula
def local_impulse(k, at, u, coulomb):
    """Return the new impulse of a frictional contact at velocities u without bias; the old impulse is still in k."""
    p, s, t = k.impulse[at, 0], k.impulse[at, 1], k.impulse[at, 2]
    n = p - (u[0] + k.bias[at, 0] + k.soft[at] * p) * k.inverse_nn[at]
    us, ut = u[1] + k.bias[at, 1], u[2] + k.bias[at, 2]
    if coulomb:
        n = n if n > k.least[at] else k.least[at]
        us += k.ns[at] * (n - p)
        ut += k.nt[at] * (n - p)
        a = s - (k.inverse_ss[at] * us + k.inverse_st[at] * ut)
        b = t - (k.inverse_st[at] * us + k.inverse_tt[at] * ut)
        if a * a + b * b <= k.mu[at] * k.mu[at] * n * n:
            return n, a, b
    # sliding: only an equal step in all directions converges to friction opposite to the velocity
    a, b = s - k.sliding_step[at] * us, t - k.sliding_step[at] * ut
    q, part = limit_friction(n, sqrt(a * a + b * b), k.mu[at], k.ratio[at], coulomb, k.least[at])
    return q, part * a, part * b


@formula
def update_frictional(k, v, B, i, j, at, coulomb):
    """Update a frictional contact of any nodes."""
    u = frictional_velocity(k, v, i, j, at)
    n, s, t = local_impulse(k, at, u, coulomb)
    dn, ds, dt = n - k.impulse[at, 0], s - k.impulse[at, 1], t - k.impulse[at, 2]
    if dn == 0.0 and ds == 0.0 and dt == 0.0:
        return 0.0
    k.impulse[at, 0], k.impulse[at, 1], k.impulse[at, 2] = n, s, t
    x = k.frame[at, 0] * dn + k.frame[at, 3] * ds + k.frame[at, 6] * dt
    y = k.frame[at, 1] * dn + k.frame[at, 4] * ds + k.frame[at, 7] * dt
    z = k.frame[at, 2] * dn + k.frame[at, 5] * ds + k.frame[at, 8] * dt
    apply_point_impulse(k, v, B, j, at, 1, x, y, z)
    apply_point_impulse(k, v, B, i, at, 0, -x, -y, -z)
    return (abs(dn) + abs(ds) + abs(dt)) / k.inverse_nn[at]
