"""Compliant contacts: the law of their normal force as rows of the cone problem with compliance.

With overlap d, f = k d^n (1 + c ddot) + (d/dt) damping d, not less than 0 (Hertz 1881; Hunt and Crossley 1975). Over a
step of length h from overlap a to b, with U' = k d^n, the impulse is

    p = h ((1 - s) (U(b) - U(a)) / (b - a) + s U'(b)) (1 + c (b - a) / h) + damping (b - a),
    b = a - h ((1 - s) / 2 u- + (1 + s) / 2 u+).

With s = 0 elastic energy is conserved exactly (Gonzalez 1996) except for the losses by c and damping; the step is of
second order. With s = 1 it is the implicit Euler rule, which brings contacts to rest that are too stiff for the step;
s grows with the square of h^2 k' / m. Since p falls with u+, the problem is monotone. Newton's method linearises p(u+)
to rows u + bias + soft p >= 0. Displacements end at the overlaps b.
"""

from __future__ import annotations

from ...collision.shape_kinds import SPHERE
from ...compiler.formulas import formula
from ...math.scalar import sqrt
from ...numerics.complementarity.contact_operator import contact_velocity, diagonal_block
from ...tables.table_definitions import DAMPING, DISSIPATION, EXPONENT, MODULUS, STIFFNESS
from .free_bodies import rest_speed

LAW_ITERATIONS = 20  # Newton iterations; three or four are usual
FEW_LAW_ITERATIONS = 3  # iterations where the cone solver does not converge
LAW_TOLERANCE = 1e-2  # allowed difference of law and tangent, relative to the velocity tolerance
RESIDUAL_SHARE = 0.1  # the same relative to the residual of the solve
SMALL_CHANGE = 1e-3  # relative change of the overlap below which the mean force is a series at the middle
LARGEST_COMPLIANCE = 1e6  # compliance of open contacts, relative to the mobility
RESOLVED_STIFFNESS = 0.01  # largest h^2 k' / 4 m that resolves an impact: 20 steps for one by Hertz's law


@formula
def contact_law(G, C, L, c):
    """Return exponent, dissipation, damping, stiffness and modulus of contact c."""
    a, b = G.shape.material[C.at.shape_1[c]], G.shape.material[C.at.shape_2[c]]
    return (
        L.pair[a, b, EXPONENT],
        L.pair[a, b, DISSIPATION],
        L.pair[a, b, DAMPING],
        L.pair[a, b, STIFFNESS],
        L.pair[a, b, MODULUS],
    )


@formula
def contact_stiffness(G, C, L, c):
    """Return the stiffness of contact c, 0 if rigid; of spheres by E*: k = 4/3 E* sqrt(R), 1/R = 1/R_1 + 1/R_2."""
    _, _, _, k, modulus = contact_law(G, C, L, c)
    if modulus > 0.0:
        s = 0.0
        for i in (C.at.shape_1[c], C.at.shape_2[c]):
            if G.shape.kind[i] == SPHERE:
                s += 1.0 / G.dimensions.par[i, 0]
        return modulus / sqrt(s)
    return k


@formula
def elastic_energy(k, n, d):
    """Return the elastic energy at the overlap d."""
    return k * d ** (n + 1.0) / (n + 1.0) if d > 0.0 else 0.0


@formula
def elastic_force(k, n, d):
    """Return the elastic force and its derivative."""
    if d <= 0.0:
        return 0.0, 0.0
    f = k * d**n
    return f, n * f / d


@formula
def mean_elastic_force(k, n, a, b):
    """Return the energy difference between a and b divided by b - a, and its derivative by b."""
    m, d = 0.5 * (a + b), b - a
    if abs(d) <= SMALL_CHANGE * abs(m):
        f, slope = elastic_force(k, n, m)
        f *= 1.0 + n * (n - 1.0) / 24.0 * (d / m) * (d / m) if m > 0.0 else 1.0
        return f, 0.5 * slope * (1.0 + (n - 1.0) / 6.0 * d / m if m > 0.0 else 1.0)
    f = (elastic_energy(k, n, b) - elastic_energy(k, n, a)) / d
    return f, (elastic_force(k, n, b)[0] - f) / d


@formula
def law_impulse(k, law, a, b, h, share):
    """Return the impulse, negative where the law would pull, and its derivative by b."""
    n, c, damping, _, _ = law
    mean, at_end = mean_elastic_force(k, n, a, b), elastic_force(k, n, b)
    f = (1.0 - share) * mean[0] + share * at_end[0]
    slope = (1.0 - share) * mean[1] + share * at_end[1]
    loss = 1.0 + c * (b - a) / h
    p = h * f * loss + damping * (max(b, 0.0) - max(a, 0.0))
    return p, h * slope * loss + f * c + (damping if b > 0.0 else 0.0)


@formula
def end_overlap(now, c, h, u):
    """Return the overlap at the end of the step in the contact law, given the rate u there."""
    s = now.implicit_share[c]
    return now.overlap[c] - h * (0.5 * (1.0 - s) * now.overlap_rate[c] + 0.5 * (1.0 + s) * u)


@formula
def find_compliant_contacts(G, C, P, L, X, state, now, before):
    """Store the data of compliant contacts at the start of the step. Returns whether there are any."""
    any_ = False
    gone = state.sums.elastic_energy
    for c in range(C.count.found):
        k, o = contact_stiffness(G, C, L, c), C.at.before[c]
        now.stiffness[c] = k
        if k > 0.0:
            any_ = True
            now.overlap[c] = now.law_overlap[c] = now.spring_overlap[c] = -C.x.gap[c]
            now.overlap_rate[c] = contact_velocity(P, X.v, X.wide, c)[0]
            if o >= 0:
                now.law_overlap[c], now.spring_overlap[c] = (
                    before.law_overlap[o],
                    before.spring_overlap[o],
                )
                gone -= elastic_energy(k, contact_law(G, C, L, c)[0], before.spring_overlap[o])
            elif state.counts.steps_taken > 0:
                now.spring_overlap[c] = 0.0
    state.sums.numerical_loss += gone
    if state.counts.steps_taken == 0:
        state.sums.elastic_at_start = 0.0
        for c in range(C.count.found):
            state.sums.elastic_at_start += elastic_energy(now.stiffness[c], contact_law(G, C, L, c)[0], -C.x.gap[c])
    return any_


@formula
def elastic_overlap(share, overlap, target):
    """Return the part of an overlap that stores elastic energy."""
    return overlap - share * max(0.0, overlap - max(target, 0.0))


@formula
def start_overlap(now, c, k, n, new):
    """Set the overlap of contact c at the start of the step; return the elastic energy that this adds without work.

    A contact too stiff for the step has the overlap with which its law ended. Rotation of the surfaces increases the
    overlap, which displacements remove. Appearing contact points take over the energy of disappearing ones.
    """
    s, kept = now.implicit_share[c], now.spring_overlap[c]
    now.overlap[c] = elastic_overlap(s, now.overlap[c], kept)
    if new:
        return elastic_energy(k, n, now.overlap[c])
    return s * (elastic_energy(k, n, now.overlap[c]) - elastic_energy(k, n, kept))


@formula
def expected_speed(C, now, before, c, state):
    """Return the normal speed of contact c plus its expected change in the step, as in the step before."""
    o = C.at.before[c]
    change = now.overlap_rate[c] - before.overlap_rate[o] if o >= 0 and before.stiffness[o] > 0.0 else 0.0
    part = state.times.step / state.times.last_step if state.times.last_step > 0.0 else 0.0
    return abs(now.overlap_rate[c]) + part * abs(change)


@formula
def start_compliant_rows(G, C, P, L, X, state, now, before):
    """Choose the implicit shares s by stiffness, and the first rows; ``X``: velocities without contact.

    Rows are tangent to the law at the overlap of the step before, or at that with these velocities. Returns whether the
    step must be divided because it is too long for an impact.
    """
    h, too_long = state.times.step, False
    slow = rest_speed(state, state.times.longest_step)
    for c in range(C.count.found):
        k = now.stiffness[c]
        if k > 0.0:
            n = contact_law(G, C, L, c)[0]
            u = contact_velocity(P, X.v, X.wide, c)[0]
            z = max(now.overlap[c], now.overlap[c] - h * u)
            z = 0.25 * h * h * elastic_force(k, n, z)[1] * diagonal_block(P, c)[0]
            s = now.implicit_share[c] = z * z / (1.0 + z * z)
            too_long = too_long or (z > RESOLVED_STIFFNESS and expected_speed(C, now, before, c, state) > slow)
            if state.counts.steps_taken > 0:
                state.sums.numerical_loss -= start_overlap(now, c, k, n, C.at.before[c] < 0)
            if now.law_overlap[c] > 0.0:
                u = (now.overlap[c] - now.law_overlap[c] - 0.5 * h * (1.0 - s) * now.overlap_rate[c]) / (
                    0.5 * h * (1.0 + s)
                )
            tangent_row(G, C, P, L, state, now, c, u)
    return too_long and state.options.divides_steps != 0


@formula
def tangent_row(G, C, P, L, state, now, c, u):
    """Linearise row c at the velocity u; return the impulse there."""
    h, mobility = state.times.step, diagonal_block(P, c)[0]
    now.law_overlap[c] = end_overlap(now, c, h, u)
    law = contact_law(G, C, L, c)
    p, slope = law_impulse(now.stiffness[c], law, now.overlap[c], now.law_overlap[c], h, now.implicit_share[c])
    slope *= 0.5 * h * (1.0 + now.implicit_share[c])
    P.soft[c] = 1.0 / slope if slope * LARGEST_COMPLIANCE * mobility > 1.0 else LARGEST_COMPLIANCE * mobility
    P.bias[c, 0] = -u - P.soft[c] * p
    return p


@formula
def linearise_compliant_rows(G, C, P, L, X, state, now):
    """Linearise compliant rows at the velocities of ``X``; return the largest error of the previous rows [m/s]."""
    worst = 0.0
    for c in range(C.count.found):
        if now.stiffness[c] > 0.0:
            u = contact_velocity(P, X.v, X.wide, c)[0]
            row = -(u + P.bias[c, 0]) / P.soft[c] if P.soft[c] > 0.0 else 0.0
            p = tangent_row(G, C, P, L, state, now, c, u)
            worst = max(worst, diagonal_block(P, c)[0] * abs(max(p, 0.0) - max(row, 0.0)))
    return worst


@formula
def restore_free_velocities(N, M, X):
    """Restore the velocities without contact, from which the rows are solved again."""
    for k in range(N.body.shape[0]):
        for i in range(6):
            X.v[k, i] = M.twist[k, i]


@formula
def remaining_gap(now, c, gap):
    """Return the gap at the end of the step beyond that at which the law of contact c ends, if it is compliant."""
    if now.stiffness[c] > 0.0:
        now.end_gap[c] = gap
        return gap + max(now.law_overlap[c], 0.0)
    return gap


@formula
def dissipated_energy(k, law, now, c, h, pressed):
    """Return the energy that the law dissipates in the step; all stored energy where the law would pull."""
    n, dissipation, damping, _, _ = law
    a, b = now.overlap[c], now.law_overlap[c]
    if dissipation == 0.0 and damping == 0.0:
        return 0.0
    if not pressed:
        return max(0.0, elastic_energy(k, n, a) - elastic_energy(k, n, b))
    return (
        (mean_elastic_force(k, n, a, b)[0] * dissipation * (b - a) + damping * (max(b, 0.0) - max(a, 0.0)))
        * (b - a)
        / h
    )


@formula
def store_elastic_energy(G, C, P, L, X, Y, state, now):
    """Update the elastic energy of contacts at the end of the step, and the energy dissipated or lost numerically."""
    h = state.times.step
    state.sums.elastic_energy = 0.0
    for c in range(C.count.found):
        if now.stiffness[c] > 0.0:
            k, n = now.stiffness[c], contact_law(G, C, L, c)[0]
            overlap = -now.end_gap[c] - h * contact_velocity(P, Y.v, Y.wide, c)[0]
            now.spring_overlap[c] = elastic_overlap(now.implicit_share[c], overlap, now.law_overlap[c])
            after = elastic_energy(k, n, now.spring_overlap[c])
            state.sums.elastic_energy += after
            lost = dissipated_energy(k, contact_law(G, C, L, c), now, c, h, X.p[c, 0] > 0.0)
            state.sums.impact_loss += lost
            state.sums.numerical_loss -= after - elastic_energy(k, n, now.overlap[c]) + lost


@formula
def law_is_met(worst, residual, state):
    """Return whether rows agree with the law to the velocity tolerance, or to the residual of the solve."""
    return worst <= max(LAW_TOLERANCE * state.tolerances.velocity, RESIDUAL_SHARE * residual)
