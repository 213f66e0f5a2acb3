"""Impacts: restitution by Poisson's, Newton's or Moreau's law, simultaneous or one contact after the other.

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
from ...tables.table_definitions import RESTITUTION
from .compliant_contact import contact_stiffness
from .free_bodies import rest_speed
from .stepping_tables import (
    MOREAU,
    NO_RESTITUTION,
    POISSON,
)

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
