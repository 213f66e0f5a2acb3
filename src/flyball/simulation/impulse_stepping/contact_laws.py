"""Laws of contact: compliant contacts as rows of the cone problem, and restitution at impacts.

The normal force of a compliant contact with overlap d is f = k d^n (1 + c ddot) + (d/dt) damping d, not less than 0
(Hertz 1881; Hunt and Crossley 1975). Over a step of length h from overlap a to b, with U' = k d^n, the impulse is

    p = h ((1 - s) (U(b) - U(a)) / (b - a) + s U'(b)) (1 + c (b - a) / h) + damping (b - a),
    b = a - h ((1 - s) / 2 u- + (1 + s) / 2 u+).

With s = 0 elastic energy is conserved exactly (Gonzalez 1996) except for the losses by c and damping; the step is of
second order. With s = 1 it is the implicit Euler rule, which brings contacts to rest that are too stiff for the step;
s grows with the square of h^2 k' / m. Since p falls with u+, the problem is monotone. Newton's method linearises p(u+)
to rows u + bias + soft p >= 0. Displacements end at the overlaps b.

Impacts are completed before a step begins. Contacts that would close within the step, faster than smooth forces cause,
have an impact with the velocities at the start:

- Poisson: compression (an inelastic impact with impulses p_c), then expansion with normal impulses of at least e p_c
  and the corresponding friction (Pfeiffer and Glocker, 1996, section 8.3);
- Newton: u+ >= -e u- normal to the contact; Moreau: the same along all three directions.

No law may add energy: the expansion is reduced to what the energy lost in the inelastic impact allows (Newton's law
with friction could add energy: Kane and Levinson, 1985). Impacts are repeated until no contact has an impact.

Sequential impacts, as in Newton's cradle: the contact that closes fastest has the first impact, by Poisson's law, until
none closes.
"""

from __future__ import annotations

from ...collision.shape_kinds import SPHERE
from ...compiler.formulas import call, formula
from ...math.scalar import sqrt
from ...math.vec import add, dot, load3, scale, store3, sub
from ...numerics.complementarity.contact_operator import (
    apply_contact_impulse,
    contact_angular_velocity,
    contact_velocity,
    diagonal_block,
    to_world_frame,
)
from ...numerics.complementarity.contact_problem import CONVERGED, FIXED_SIDE
from ...tables.table_definitions import DAMPING, DISSIPATION, EXPONENT, MODULUS, RESTITUTION, STIFFNESS
from .free_bodies import rest_speed
from .stepping_tables import MOREAU, NO_RESTITUTION, POISSON

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


IMPACTS_PER_CONTACT = 200  # impacts per contact, after which closing contacts are left to the step
NO_MOBILITY = 1e-13  # negligible mobility along a direction, relative to the sum of all three
NO_CLOSING = 1e-12  # negligible closing speed, relative to the largest


@formula
def sequential_impacts(R, Z, X, C, state, now):
    """Compute sequential impacts; impulses in ``Z.p``, velocities in ``X``. Returns whether all are completed.

    ``R.least`` holds their restitutions. Contacts that close within the step because of other impacts have one too.
    """
    n = C.count.found
    for c in range(n):
        for i in range(3):
            Z.p[c, i] = 0.0
    fastest = 0.0
    for c in range(n):
        if now.hit[c] > 0.0:
            fastest = max(fastest, -now.impact_velocity[c, 0])
    for _ in range(IMPACTS_PER_CONTACT * n):
        first, most = -1, NO_CLOSING * fastest
        for c in range(n):
            if now.hit[c] > 0.0 or R.least[c] > 0.0:
                u = contact_velocity(R, X.v, X.wide, c)
                there = now.hit[c] > 0.0 or C.x.gap[c] + state.times.step * u[0] <= state.tolerances.overlap
                if there and -u[0] > most:
                    first, most = c, -u[0]
        if first < 0:
            return True
        now.hit[first] = 1.0
        single_impact(R, Z, X, first, R.least[first])
    return False


@formula
def single_impact(R, Z, X, c, e):
    """Compute the impact of one contact."""
    D = diagonal_block(R, c)
    n = compression_impulse(R, Z, X, c, D)
    u = contact_velocity(R, X.v, X.wide, c)
    p = expansion_impulse(R, c, D, e * n, u)
    apply_impulse(R, Z, X, c, p)


@formula
def reciprocal_mobility(d, D):
    """Return 1 / d of a diagonal entry d of D; 0 for a direction that joints lock."""
    return 1.0 / d if d > NO_MOBILITY * (D[0] + D[3] + D[5]) else 0.0


@formula
def compression_impulse(R, Z, X, c, D):
    """Apply the impulses that end the approach; return the normal one.

    Normal and tangential impulses affect each other's velocities: they are computed alternately until they converge.
    """
    total = 0.0
    s, t = 0.0, 0.0
    for _ in range(IMPACTS_PER_CONTACT):
        u = contact_velocity(R, X.v, X.wide, c)
        d = -u[0] * reciprocal_mobility(D[0], D)
        if total + d < 0.0:
            d = -total
        apply_impulse(R, Z, X, c, (d, 0.0, 0.0))
        total += d
        u = contact_velocity(R, X.v, X.wide, c)
        ps = s - (u[1] + R.bias[c, 1]) * reciprocal_mobility(D[3], D)
        pt = t - (u[2] + R.bias[c, 2]) * reciprocal_mobility(D[5], D)
        size = sqrt(ps * ps + pt * pt)
        if size > R.mu[c] * total:
            ps, pt = ps * R.mu[c] * total / size, pt * R.mu[c] * total / size
        apply_impulse(R, Z, X, c, (0.0, ps - s, pt - t))
        change = abs(d) + abs(ps - s) + abs(pt - t)
        s, t = ps, pt
        if change <= 1e-14 * total:
            break
    return total


@formula
def expansion_impulse(R, c, D, n, u):
    """Return the impulses of expansion: n along the normal, and tangential ones that stop sliding, within the cone."""
    a, b = -(u[1] + R.bias[c, 1] + D[1] * n), -(u[2] + R.bias[c, 2] + D[2] * n)
    s, t = a * reciprocal_mobility(D[3], D), b * reciprocal_mobility(D[5], D)
    d = D[3] * D[5] - D[4] * D[4]
    if d > NO_MOBILITY * D[3] * D[5] and s != 0.0 and t != 0.0:
        s, t = (D[5] * a - D[4] * b) / d, (D[3] * b - D[4] * a) / d
    size = sqrt(s * s + t * t)
    if size > R.mu[c] * n:
        s, t = s * R.mu[c] * n / size, t * R.mu[c] * n / size
    return (n, s, t)


@formula
def apply_impulse(R, Z, X, c, p):
    """Apply an impulse at contact c."""
    apply_contact_impulse(R, X.v, X.wide, c, p)
    for i in range(3):
        Z.p[c, i] += p[i]


IMPACT_ROUNDS = 1000  # rounds of impacts in one step; contacts that still close after them come to rest
NEAR_GAPS = 1e3  # gaps up to this multiple of the negligible one take part in the same impact
REDUCED_BELOW = 1.0 - 1e-6  # part of an expansion below which its reduction is reported
ITERATION_FACTOR = 4  # iterations relative to those of velocity solves, which are warm started


@formula
def restitution_of(G, C, L, c):
    """Return the coefficient of restitution of contact c."""
    return L.pair[G.shape.material[C.at.shape_1[c]], G.shape.material[C.at.shape_2[c]], RESTITUTION]


@formula
def resolve_impacts(G, C, bias, R, Z, E, X, W, O, F, L, state, now):
    """Resolve the impacts found by `find_impacts`; ``X.v`` and ``X.wide`` become the velocities after them.

    ``R`` is the problem with its own biases and least normal impulses, ``Z`` the state of compression, which shares its
    velocities with ``X``, ``E`` that of expansion.
    """
    if state.options.sequential != 0:
        for c in range(C.count.found):
            R.least[c] = restitution_of(G, C, L, c)
        if not sequential_impacts(R, Z, X, C, state, now):
            state.counts.reduced_expansions += 1
    elif state.options.restitution_law == POISSON:
        poisson_impacts(G, C, bias, R, Z, E, X, W, O, F, L, state, now)
    else:
        newton_impacts(C, bias, R, Z, E, X, W, O, F, state, now)
    account_impacts(R, bias, Z, X, C, state, now)


@formula
def clear_impact_impulses(C, now):
    """Clear the impact impulses of the step."""
    for c in range(C.count.found):
        for i in range(3):
            now.impact_impulse[c, i] = 0.0


@formula
def poisson_impacts(G, C, bias, R, Z, E, X, W, O, F, L, state, now):
    """Apply Poisson's law: an inelastic impact, then expansion."""
    solve_from_zero(state.addresses.impacts, R, Z, W, O, F, state)
    for c in range(C.count.found):
        R.least[c] = restitution_of(G, C, L, c) * Z.p[c, 0] if now.hit[c] > 0.0 else 0.0
    copy_velocities(X, E)
    solve_from_zero(state.addresses.impacts, R, E, W, O, F, state)
    add_expansion(R, bias, Z, E, X, C, state, now)


@formula
def newton_impacts(C, bias, R, Z, E, X, W, O, F, state, now):
    """Apply Newton's or Moreau's law; where it would add energy, reduced to what an inelastic impact leaves."""
    copy_velocities(X, E)
    solve_from_zero(state.addresses.impacts, R, E, W, O, F, state)
    if impulse_energy(R, bias, E, E, C, now) <= 0.0:
        copy_velocities(E, X)
        for c in range(C.count.found):
            add_impulses(Z, 0.0, E, 1.0, c)
        return
    for c in range(C.count.found):
        for i in range(3):
            R.bias[c, i] = 0.0 if i == 0 and now.hit[c] > 0.0 else bias[c, i]
    solve_from_zero(state.addresses.impacts, R, Z, W, O, F, state)
    for c in range(C.count.found):
        add_impulses(E, 1.0, Z, -1.0, c)
    add_expansion(R, bias, Z, E, X, C, state, now)


@formula
def add_impulses(Z, z, E, e, c):
    """Set the impulses of Z to z times those of Z plus e times those of E."""
    store3(Z.p, c, 0, add(scale(z, load3(Z.p, c, 0)), scale(e, load3(E.p, c, 0))))
    if Z.torque.shape[0] > 0:
        store3(Z.torque, c, 0, add(scale(z, load3(Z.torque, c, 0)), scale(e, load3(E.torque, c, 0))))


@formula
def copy_velocities(X, E):
    """Copy the velocities of X to E."""
    for k in range(X.v.shape[0]):
        for i in range(6):
            E.v[k, i] = X.v[k, i]
    for k in range(X.wide.shape[0]):
        E.wide[k] = X.wide[k]


@formula
def find_impacts(G, C, at, bias, R, X, L, state, now):
    """Return whether there are impacts; set the biases of their contacts, and store their velocities in ``now``."""
    if state.options.restitution_law == NO_RESTITUTION:
        return False
    h = state.times.step
    slowest = rest_speed(state, h)
    found = False
    law = state.options.restitution_law
    for c in range(C.count.found):
        R.least[c] = 0.0
        gives_way = state.options.compliant != 0 and contact_stiffness(G, C, L, c) > 0.0
        for i in range(2):  # compliant contacts have no instantaneous impulse
            R.at[c, i] = FIXED_SIDE if gives_way else at[c, i]
        u = contact_velocity(R, X.v, X.wide, c)
        store3(now.impact_velocity, c, 0, u)
        store3(R.bias, c, 0, load3(bias, c, 0))
        if R.turn.shape[0] > 0:
            store3(now.impact_spin, c, 0, contact_angular_velocity(R, X.v, X.wide, c))
        e = restitution_of(G, C, L, c)
        now.hit[c] = 0.0
        plain = state.options.sequential != 0 and C.x.gap[c] <= state.tolerances.overlap
        if gives_way:
            R.bias[c, 0] = 0.0
            continue
        if (e > 0.0 or plain) and C.x.gap[c] + h * u[
            0
        ] <= state.tolerances.overlap:  # also contacts resting against a body that has an impact
            now.hit[c] = 1.0
            found = found or (e > 0.0 and u[0] < -slowest)
            R.bias[c, 0] = 0.0
            if law != POISSON and u[0] < 0.0:
                R.bias[c, 0] = e * u[0]
                for i in range(1, 3 if law == MOREAU else 1):
                    R.bias[c, i] += e * u[i]
        elif C.x.gap[c] > NEAR_GAPS * state.tolerances.overlap:
            for i in range(2):  # it cannot close during an impact, which takes no time: it is left to the next round
                R.at[c, i] = FIXED_SIDE
    return found


@formula
def solve_from_zero(address, R, Z, W, O, F, state):
    """Solve starting from zero impulses."""
    for c in range(R.size[0]):
        for i in range(3):
            Z.p[c, i] = 0.0
        for i in range(3 if Z.torque.shape[0] > 0 else 0):
            Z.torque[c, i] = 0.0
    for k in range(R.size[3]):
        Z.line[k] = 0.0
    O.count.most = ITERATION_FACTOR * state.options.velocity_iterations
    O.real.enough = state.tolerances.velocity
    call(address, R, Z, W, O, F.impacts, 0)
    if O.count.ended != CONVERGED and O.real.residual > state.tolerances.reported * state.times.step:
        state.counts.unconverged += 1


@formula
def impulse_energy(R, bias, Z, X, C, now):
    """Return the energy supplied by impulses of ``Z`` that led to velocities of ``X``: p . (u- + u+) / 2 over all
    contacts.

    It includes moving surfaces (``bias`` along the tangents), which may supply energy.
    """
    total = 0.0
    for c in range(C.count.found):
        u = contact_velocity(R, X.v, X.wide, c)
        for i in range(3):
            own = bias[c, i] if i > 0 else 0.0
            total += Z.p[c, i] * (0.5 * (u[i] + now.impact_velocity[c, i]) + own)
        total += torque_impulse_energy(R, Z, X, c, now)
    return total


@formula
def torque_impulse_energy(R, Z, X, c, now):
    """Return the energy supplied by the torque impulse at contact c."""
    if R.turn.shape[0] == 0:
        return 0.0
    return 0.5 * dot(
        load3(Z.torque, c, 0), add(contact_angular_velocity(R, X.v, X.wide, c), load3(now.impact_spin, c, 0))
    )


@formula
def add_expansion(R, bias, Z, E, X, C, state, now):
    """Add the impulses E.p to Z.p and move X's velocities towards those of ``E``, as far as the energy allows.

    At the part s of the way from X to E the energy has grown by a s + b s^2, with a = p . u, b = p . (u+ - u) / 2. All
    points of the way satisfy the constraints, which are convex.
    """
    there = max(0.0, -impulse_energy(R, bias, Z, X, C, now))
    a, b = 0.0, 0.0
    for c in range(C.count.found):
        u = contact_velocity(R, X.v, X.wide, c)
        w = contact_velocity(R, E.v, E.wide, c)
        for i in range(3):
            own = bias[c, i] if i > 0 else 0.0
            a += E.p[c, i] * (u[i] + own)
            b += 0.5 * E.p[c, i] * (w[i] - u[i])
        if R.turn.shape[0] > 0:
            u, w, t = (
                contact_angular_velocity(R, X.v, X.wide, c),
                contact_angular_velocity(R, E.v, E.wide, c),
                load3(E.torque, c, 0),
            )
            a, b = a + dot(t, u), b + 0.5 * dot(t, sub(w, u))
    s = 1.0
    if a + b > there and b > 0.0:
        s = (sqrt(a * a + 4.0 * b * there) - a) / (2.0 * b)
        s = min(1.0, max(0.0, s))
        if s < REDUCED_BELOW:
            state.counts.reduced_expansions += 1
    for k in range(X.v.shape[0]):
        for i in range(6):
            X.v[k, i] += s * (E.v[k, i] - X.v[k, i])
    for k in range(X.wide.shape[0]):
        X.wide[k] += s * (E.wide[k] - X.wide[k])
    for c in range(C.count.found):
        add_impulses(Z, 1.0, E, s, c)


@formula
def account_impacts(R, bias, Z, X, C, state, now):
    """Store the impulses of the impacts, and account for the energy lost."""
    for c in range(C.count.found):
        u = contact_velocity(R, X.v, X.wide, c)
        worn = -torque_impulse_energy(R, Z, X, c, now)
        for i in range(3):
            mean = 0.5 * (u[i] + now.impact_velocity[c, i])
            if i == 0:
                state.sums.impact_loss -= Z.p[c, 0] * mean
            else:  # the bias of a moving surface is its own velocity
                worn -= Z.p[c, i] * (mean + bias[c, i])
                state.sums.surface_work -= Z.p[c, i] * bias[c, i]
        # a negative mean, where the slip reverses in the impact, is counted as impact; the sum of both is exact
        if worn >= 0.0:
            state.sums.friction_loss += worn
        else:
            state.sums.impact_loss += worn
        store3(
            now.impact_impulse,
            c,
            0,
            add(load3(now.impact_impulse, c, 0), to_world_frame(R, c, Z.p[c, 0], Z.p[c, 1], Z.p[c, 2])),
        )
    state.counts.impacts += 1
