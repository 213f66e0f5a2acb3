"""Contacts as constraints of the cone problem: rows, warm start, persistent contacts, energy account.

A persistent contact pressed in the step before and neither opens nor has an impact. It does no work if its impulse p
acts along the row D along which the mean velocity of the step vanishes: the work is p . D (v- + v+) / 2, so
D v+ = -D v-. The rows are taken in the middle of the step, where bodies are after half of it with the initial
velocities. This is the midpoint rule of constraints. Displacements close the remaining gaps and overlaps, as far as the
contact presses. The change of gravity's energy by them is the remaining error, of third order in the step.

The rule reverses the sign of the contact's velocity at the start of the step, so that residuals of impacts and solvers
would never decay. It is used where this velocity is less than the change of the rows in half a step, which is of lower
order in smooth motion. Otherwise the velocity at the start is left out, and the contact has at the end of the step only
the change of its rows. The same holds along the tangents of sliding contacts and of those that have just come to stick.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import cos, sin, sqrt
from ...math.vec import (
    add,
    axes_across,
    cross,
    dot,
    load3,
    load9,
    mm,
    mv,
    norm,
    quaternion_matrix,
    scale,
    store3,
    store9,
    sub,
)
from ...numerics.complementarity.contact_operator import (
    contact_angular_velocity,
    contact_velocity,
    to_contact_frame,
    to_world_frame,
)
from ...tables.table_definitions import ACROSS, KINETIC, ROLLING, SPINNING, STATIC
from .contact_laws import contact_stiffness, remaining_gap
from .free_bodies import rest_speed, speed_of_fall
from .stepping_tables import (
    MIDDLE_FOUND,
    MIDDLE_WANTED,
    PRESSES,
)


@formula
def fill_rows(G, M, C, P, L, state, contacts):
    """Fill the contact problem except impulses, masses and sizes; contacts: the first, and the one after the last."""
    h = state.times.step
    turns = P.turn.shape[0] > 0
    for c in range(contacts[0], contacts[1]):
        i, j = C.at.shape_1[c], C.at.shape_2[c]
        a, b = P.at[c, 0], P.at[c, 1] = movers_of_contact(G, C, c)
        point = load3(C.x.point, c, 0)
        store3(P.frame, c, 0, load3(C.x.normal, c, 0))
        apart = load3(C.x.half_separation, c, 0)
        store3(P.arm, c, 0, arm_to(M, a, sub(point, apart)))
        store3(P.arm, c, 3, arm_to(M, b, add(point, apart)))
        law = L.pair[G.shape.material[i], G.shape.material[j]]
        fill_tangents(G, M, C, P, L, c)
        gap = C.x.gap[c]
        P.bias[c, 0] = gap / h if gap > 0.0 else 0.0
        P.mu[c] = law[KINETIC]
        P.soft[c] = 0.0
        if turns:
            P.turn[c, 0], P.turn[c, 1] = law[ROLLING], law[SPINNING]


@formula
def movers_of_contact(G, C, c):
    """Return the movers of contact c."""
    return G.shape.mover[C.at.shape_1[c]], G.shape.mover[C.at.shape_2[c]]


@formula
def arm_to(M, a, point):
    """Return the vector from the origin of mover a to a point; 0 for fixed shapes."""
    return sub(point, load3(M.pose, a, 0)) if a >= 0 else (0.0, 0.0, 0.0)


@formula
def fill_tangents(G, M, C, P, L, c):
    """Set the tangents of contact c, and the velocities of moving surfaces along them."""
    i, j = C.at.shape_1[c], C.at.shape_2[c]
    a, b = G.shape.mover[i], G.shape.mover[j]
    law = L.pair[G.shape.material[i], G.shape.material[j]]
    tangent, square = tangent_direction(M, L, (i, a), (j, b), load3(P.frame, c, 0))
    write_tangents(P.frame, c, tangent, law[ACROSS] if square else 1.0, law[ACROSS])
    P.bias[c, 1] = P.bias[c, 2] = 0.0
    if L.belt.shape[0] > 0:
        add_surface_velocity(M, L, P, c, i, a, -1.0)
        add_surface_velocity(M, L, P, c, j, b, 1.0)


@formula
def tangent_direction(M, L, first, second, n):
    """Return a tangent along the grain of either shape, and whether any tangent may serve (no grain in the tangent
    plane).

    ``first`` and ``second``: shape and mover. Between two surfaces with a grain, friction does not depend on the
    direction.
    """
    if L.grain.shape[0] > 0:
        for shape, mover in (first, second):
            g = in_world_axes(M, mover, load3(L.grain, shape, 0))
            g = sub(g, scale(dot(g, n), n))
            s = dot(g, g)
            if s > 1e-12:
                return scale(1.0 / sqrt(s), g), False
    return axes_across(n)[0], True


@formula
def in_world_axes(M, a, g):
    """Return a vector in the axes of mover a, or of a fixed shape, in world axes."""
    return mv(load9(M.pose, a, 3), g) if a >= 0 else g


@formula
def write_tangents(frame, c, t, along, across):
    """Set the rows t1 = along t and t2 = across n x t; they scale a circular cone to an elliptic one."""
    store3(frame, c, 3, scale(along, t))
    store3(frame, c, 6, scale(across, cross(load3(frame, c, 0), t)))


@formula
def add_surface_velocity(M, L, P, c, shape, mover, sign):
    """Add the velocity of a surface relative to its mover, such as a conveyor's."""
    g = in_world_axes(M, mover, load3(L.belt, shape, 0))
    for k in range(2):
        P.bias[c, 1 + k] += sign * dot(load3(P.frame, c, 3 + 3 * k), g)


@formula
def warm_start(C, P, X, now, before, contacts):
    """Start from the impulses of the same contacts in the step before; note which contacts stuck."""
    for c in range(contacts[0], contacts[1]):
        o = C.at.before[c]
        now.sliding[c] = before.sliding[o] if o >= 0 else -1.0
        store3(X.p, c, 0, previous_impulse(P, c, before.impulse, o))
        if X.torque.shape[0] > 0:
            store3(X.torque, c, 0, previous_impulse(P, c, before.torque, o))


@formula
def previous_impulse(P, c, stored, o):
    """Return the stored world vector of row o in the contact frame, the inverse of `to_world_frame`; 0 without row
    (-1).
    """
    if o < 0:
        return (0.0, 0.0, 0.0)
    x = to_contact_frame(P, c, load3(stored, o, 0))
    n, s, t = load3(P.frame, c, 0), load3(P.frame, c, 3), load3(P.frame, c, 6)
    return (x[0] / dot(n, n), projection_coefficient(x[1], s), projection_coefficient(x[2], t))


@formula
def projection_coefficient(x, row):
    """Return x divided by the square of a row; 0 for a zero row, where there is no friction."""
    square = dot(row, row)
    return x / square if square > 0.0 else 0.0 * x


@formula
def static_friction_of_sticking(G, C, P, L, X, state, now, contacts):
    """Set the static coefficient for contacts that stuck before, and for new ones that hardly slide."""
    slow = speed_of_fall(state, state.times.step)
    for c in range(contacts[0], contacts[1]):
        law = L.pair[G.shape.material[C.at.shape_1[c]], G.shape.material[C.at.shape_2[c]]]
        if law[STATIC] > law[KINETIC] and now.sliding[c] < 0.5:
            u = contact_velocity(P, X.v, X.wide, c)
            s, t = u[1] + P.bias[c, 1], u[2] + P.bias[c, 2]
            if now.sliding[c] == 0.0 or s * s + t * t <= slow * slow:
                P.mu[c] = law[STATIC]


SAME_NORMAL = 0.95  # least cosine between the normals at start and middle of the step of a persistent contact
LARGEST_JUMP = (
    0.3  # largest relative change of velocities by the change of rows in half a step, for a persistent contact
)
CLEAR_FACTOR = 10.0  # factor of the residual of the last solve below which a speed may be an error of it
NO_CHANGE = 1e-9  # negligible change of a normal, or rotation of a body, in a step
NO_ARM = 1e-10  # negligible part of an arm across the normal, as for spheres


@formula
def side_of_contact(P, M, G, C, c, side):
    """Return the mover on a side of contact c, its arm, and the part of the arm across the normal (0 if negligible)."""
    a = G.shape.mover[C.at.shape_1[c] if side == 0 else C.at.shape_2[c]]
    n, r = load3(P.frame, c, 0), load3(P.arm, c, 3 * side)
    s = sub(r, scale(dot(r, n), n))
    if dot(s, s) <= NO_ARM * NO_ARM * dot(r, r):
        s = (0.0, 0.0, 0.0)
    return a, r, s


@formula
def arms_along_normal(P, M, G, C, c):
    """Return whether both arms are along the normal."""
    s, t = side_of_contact(P, M, G, C, c, 0)[2], side_of_contact(P, M, G, C, c, 1)[2]
    return dot(s, s) + dot(t, t) == 0.0


@formula
def rows_change(G, M, C, D, P, c, h):
    """Return whether the rows of contact c change within the step, by rotation of normals or of bodies with transverse
    arms.
    """
    change = norm(sub(load3(C.x.normal, c, 0), load3(D.x.normal, C.at.before[c], 0)))
    for side in range(2):
        a, _, s = side_of_contact(P, M, G, C, c, side)
        if a >= 0 and dot(s, s) > 0.0:
            change += h * norm(load3(M.twist, a, 3))
    return change > NO_CHANGE


@formula
def point_velocity(M, a, r):
    """Return the velocity of the point at r from the origin of mover a."""
    return add(load3(M.twist, a, 0), cross(load3(M.twist, a, 3), r)) if a >= 0 else (0.0, 0.0, 0.0)


@formula
def contact_jumps(M, P, c, movers, arms):
    """Return whether other arms of contact c change the velocities by more than a part of the bodies' speeds."""
    fast, way = 0.0, (0.0, 0.0, 0.0)
    for side in range(2):
        a, r = movers[side], load3(P.arm, c, 3 * side)
        v = point_velocity(M, a, r)
        way = add(way, scale(2.0 * side - 1.0, sub(point_velocity(M, a, arms[side]), v)))
        fast += norm(v) + (norm(sub(v, load3(M.twist, a, 0))) if a >= 0 else 0.0)
    return norm(way) > LARGEST_JUMP * fast


@formula
def save_start(N, M, X):
    """Store poses and twists; at the start of a step ``M`` has the present twists of the mechanism's bodies only."""
    for k in range(M.pose.shape[0]):
        for i in range(12):
            N.start[k, i] = M.pose[k, i]
        for i in range(6):
            N.start[k, 12 + i] = X.v[k, i] if k < N.body.shape[0] else M.twist[k, i]


@formula
def start_velocity(G, C, N, P, X, c):
    """Return the relative velocity of contact c at the start of the step, in world axes."""
    u = (0.0, 0.0, 0.0)
    for side in range(2):
        a = G.shape.mover[C.at.shape_1[c] if side == 0 else C.at.shape_2[c]]
        if a >= 0:
            v, w = start_twist(N, X, a)
            u = add(u, scale(2.0 * side - 1.0, add(v, cross(w, load3(P.arm, c, 3 * side)))))
    return u


@formula
def start_twist(N, X, a):
    """Return the velocities of mover a at the start of the step."""
    if a < N.body.shape[0]:
        return load3(X.v, a, 0), load3(X.v, a, 3)
    return load3(N.start, a, 12), load3(N.start, a, 15)


@formula
def speed_is_clear(G, C, N, P, X, c, state):
    """Return whether the bodies' speeds at contact c exceed the residual of the last solve."""
    fast, way = 0.0, (0.0, 0.0, 0.0)
    for side in range(2):
        a = G.shape.mover[C.at.shape_1[c] if side == 0 else C.at.shape_2[c]]
        if a >= 0:
            v, w = start_twist(N, X, a)
            fast += norm(cross(w, load3(P.arm, c, 3 * side)))
            way = add(way, scale(2.0 * side - 1.0, v))
    return fast + norm(way) > CLEAR_FACTOR * state.worst.last_residual


@formula
def had_impact(now, c):
    """Return whether contact c had an impact before the step."""
    return now.impact_impulse[c, 0] != 0.0 or now.impact_impulse[c, 1] != 0.0 or now.impact_impulse[c, 2] != 0.0


@formula
def was_in_impact(G, C, now, c, first):
    """Return whether contact c, or a mechanism that it is on, had an impact before the step.

    first: first mover of a mechanism with impacts.
    """
    a, b = movers_of_contact(G, C, c)
    return had_impact(now, c) or max(a, b) >= first


@formula
def find_persistent_contacts(G, M, C, D, N, P, X, L, state, now, before, contacts):
    """Find persistent contacts, and the relative velocities at the start. Returns whether rows in the middle are
    needed.
    """
    h, wanted = state.times.step, False
    slow, struck = rest_speed(state, h), state.counts.first_struck
    for c in range(contacts[0], contacts[1]):
        o, u = C.at.before[c], start_velocity(G, C, N, P, X, c)
        store3(now.middle_bias, c, 0, (0.0, 0.0, 0.0))
        store3(now.start_velocity, c, 0, u)
        now.persistence[c] = 0.0
        if o < 0 or not before.sliding[o] >= 0.0:
            continue
        soft = state.options.compliant != 0 and contact_stiffness(G, C, L, c) > 0.0
        closing = -dot(load3(C.x.normal, c, 0), u)
        if soft or closing <= state.tolerances.velocity:
            now.persistence[c] = PRESSES
        steady = closing <= slow and not was_in_impact(G, C, now, c, struck) and speed_is_clear(G, C, N, P, X, c, state)
        if not soft and steady and rows_change(G, M, C, D, P, c, h):
            now.persistence[c] = MIDDLE_WANTED
            wanted = True
    return wanted


@formula
def move_half_step(N, M, X, h):
    """Move free bodies by half the step with the velocities at its start."""
    for k in range(N.body.shape[0]):
        w = load3(X.v, k, 3)
        store3(M.pose, k, 0, add(load3(M.pose, k, 0), scale(0.5 * h, load3(X.v, k, 0))))
        turn = 0.25 * h * norm(w)
        if turn > 0.0:
            e = scale(0.25 * h * sin(turn) / turn, w)
            store9(M.pose, k, 3, mm(quaternion_matrix(cos(turn), e[0], e[1], e[2]), load9(N.start, k, 3)))


@formula
def restore_poses(N, M):
    """Restore the poses at the start of the step."""
    for k in range(M.pose.shape[0]):
        for i in range(12):
            M.pose[k, i] = N.start[k, i]


@formula
def middle_rows(G, M, C, H, P, L, now):
    """Set the rows of persistent contacts from poses and contacts ``H`` in the middle; return whether there are any."""
    found = False
    for k in range(H.count.found):
        c = H.at.before[k]
        if c < 0 or now.persistence[c] != MIDDLE_WANTED or C.at.feature[c] != H.at.feature[k]:
            continue
        n, point = load3(H.x.normal, k, 0), load3(H.x.point, k, 0)
        a, b = movers_of_contact(G, C, c)
        r, s = arm_to(M, a, point), arm_to(M, b, point)
        if dot(n, load3(P.frame, c, 0)) < SAME_NORMAL or contact_jumps(M, P, c, (a, b), (r, s)):
            continue
        if arms_along_normal(P, M, G, C, c):  # keep it exact
            r, s = scale(dot(r, n), n), scale(dot(s, n), n)
        store3(P.frame, c, 0, n)
        store3(P.arm, c, 0, r)
        store3(P.arm, c, 3, s)
        fill_tangents(G, M, C, P, L, c)
        now.persistence[c] = MIDDLE_FOUND
        found = True
    return found


@formula
def bias_persistent_contacts(G, M, C, P, X, now, before):
    """Set the biases of contacts with rows in the middle of the step; see the module docstring."""
    for c in range(C.count.found):
        if now.persistence[c] != MIDDLE_FOUND:
            continue
        u = contact_velocity(P, X.v, X.wide, c)
        first = to_contact_frame(P, c, load3(now.start_velocity, c, 0))
        more = sub(u, first)
        mean = abs(first[0]) <= abs(more[0])
        ahead = (u[0] if mean else more[0], 0.0, 0.0)
        if not arms_along_normal(P, M, G, C, c):
            s, t = more[1], more[2]
            own = P.bias[c, 1], P.bias[c, 2]
            a, b = first[1] + own[0], first[2] + own[1]
            if before.sliding[C.at.before[c]] == 0.0 and a * a + b * b <= s * s + t * t:
                s, t = u[1] + own[0], u[2] + own[1]
            ahead = (ahead[0], s, t)
        store3(now.middle_bias, c, 0, ahead)
        if mean:  # its gap is closed by displacements
            P.bias[c, 0] = 0.0
        else:
            now.persistence[c] = MIDDLE_WANTED
        store3(P.bias, c, 0, add(load3(P.bias, c, 0), ahead))


CONE_TOLERANCE = 1e-9  # relative distance from the friction cone within which an impulse is on it


NO_LOSS = (0.0, 0.0, 0.0, 0.0)  # lost by friction, in impacts, work of surfaces, lost numerically [J]


@formula
def account_contact(P, X, c, u, now):
    """Store the impulse of contact c for the next step; return its energies (`NO_LOSS`) at the mean velocities u.

    For a persistent contact, work along the normal is a numerical error, and so is work along its tangents if it sticks
    before and after. Friction never supplies energy: a negative mean loss is added to the other account, whose sum with
    it is exact.
    """
    n, s, t = X.p[c, 0], X.p[c, 1], X.p[c, 2]
    store3(now.impulse, c, 0, to_world_frame(P, c, n, s, t))
    if not n > 0.0:
        now.sliding[c] = -1.0
        return NO_LOSS
    belt = (P.bias[c, 1] - now.middle_bias[c, 1]) * s + (P.bias[c, 2] - now.middle_bias[c, 2]) * t
    numerical = now.persistence[c] > 0.0 or now.stiffness[c] > 0.0
    slides = sqrt(s * s + t * t) >= (1.0 - CONE_TOLERANCE) * P.mu[c] * n
    worn = -(s * u[1] + t * u[2] + belt)
    sticks = now.persistence[c] > 0.0 and now.sliding[c] == 0.0 and not slides
    lost = -(n * u[0]) + (worn if sticks or worn < 0.0 else 0.0)
    now.sliding[c] = 1.0 if slides else 0.0
    return 0.0 if sticks or worn < 0.0 else worn, 0.0 if numerical else lost, -belt, lost if numerical else 0.0


@formula
def account_rolling(P, X, Y, c, now):
    """Store the impulse of rolling and spinning friction at contact c; return its energies at mean velocities ``Y``."""
    t = load3(X.torque, c, 0)
    store3(now.torque, c, 0, to_world_frame(P, c, t[0], t[1], t[2]))
    worn = -dot(t, contact_angular_velocity(P, Y.v, Y.wide, c))
    return max(worn, 0.0), 0.0, 0.0, min(worn, 0.0)


@formula
def account_contacts(C, P, Q, R, X, Y, state, now, part, contacts):
    """Set the gaps of the position solve, and account for the works of contacts; results in row ``part`` of
    ``state.parts``.
    """
    h, sums, deepest, overlap = state.times.step, NO_LOSS, 0.0, 0.0
    for c in range(contacts[0], contacts[1]):
        u = contact_velocity(P, Y.v, Y.wide, c)
        gap = C.x.gap[c] + h * u[0]
        if now.stiffness[c] > 0.0:
            gap = remaining_gap(now, c, gap)
        else:
            overlap = min(overlap, C.x.gap[c])
        deepest = min(deepest, -abs(gap) if now.persistence[c] == MIDDLE_FOUND else gap)
        Q.bias[c, 0] = R.bias[c, 0] = gap / h
        sums = add4(sums, account_contact(P, X, c, u, now))
        if P.turn.shape[0] > 0:
            sums = add4(sums, account_rolling(P, X, Y, c, now))
        store3(Y.p, c, 0, (0.0, 0.0, 0.0))
    parts = state.parts
    parts.friction_loss[part], parts.impact_loss[part], parts.surface_work[part], parts.numerical_loss[part] = sums
    parts.deepest[part], parts.overlap[part] = deepest, overlap


@formula
def add4(a, b):
    """Sum of two tuples of four numbers."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]
