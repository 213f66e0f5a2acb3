"""Forces: wrenches on bodies, efforts along measured quantities, contact friction and joint friction.

A force element gives its wrench on frame M; the reverse acts on frame F's body at the same point. Gravity and
gyroscopic terms are the inertial wrench of the bias accelerations. Wrenches are summed on bodies and projected on the
velocities. The power of each element that needs energy accounting is returned as well.

A contact point is a STOP (its gap) and a SLIP along each of its tangents (`model/contact_point.py`). A sticking point
is held by rows. A sliding one is loaded by -mu N d, N being the multiplier of the gap and d the direction of sliding.

Joint friction depends on the joint's own reaction, which friction changes. For given loads the reactions follow from
one more solve with the same factor. The consistent loads are found by Newton's method: the load that a joint's friction
returns is a sum of norms of affine functions and so convex, and Newton's method from below leads to the smallest
solution, which is the physical one. Where the slope reaches one before that there is no solution: the joint jams.

Forces that events or laws name are written to their columns once accelerations and multipliers are known.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..constraints.switches.switch_kind import BY_RATE, G_CONE, G_EDGE, OFF, STATIC
from ..forces.joint_friction import load as pressed
from ..laws.bytecode import evaluate
from ..math.scalar import exp, magnitude, sign, sqrt
from ..math.vec import add, cross, dot, load3, load9, mtv, mv, neg, scale, store3, sub
from ..tables.table_definitions import (
    ALONG,
    BETWEEN,
    SLIDING,
    Sensed,
)
from .element_dispatch import effort, force_kind, inputs, wrench, wrench_and_rates
from .kinematics import load_record, project_wrench
from .rows import (
    characteristic_rate,
    characteristic_speed,
    controller_column,
    count_measured,
    direction_column,
    wrench_on_second,
)

INVERSE_JACOBIAN = Sensed.layout.width  # first row of the inverse Jacobian of the loads' gaps in `Work.sensed`
SLOW_SLIDING = 1e-10  # relative to the characteristic speed: slower sliding in space takes the direction of its switch
ONSET_LENGTH = 2.0  # length of the stored direction at the onset of sliding in space; sliding follows it at first
# relative to the characteristic speed: at this speed the direction mostly follows the velocity, at ONSET_END
# times it wholly
ONSET_SPEED = 3e-5
ONSET_END = 8.0
# relative to the characteristic speed: backward speed that counts as reversal; at the onset it may be rounding
REVERSAL_SPEED = 1e-11
TURN_COSINE = 0.5  # cosine of the angle by which a direction of sliding turns before the stored direction is updated
NO_GUARD = float("nan")


@formula
def is_sliding(S, W, s):
    """Whether the contact point whose first slip is switch s is closed and does not stick."""
    return W.modes.mode[s].real == OFF and W.modes.mode[S.switches.other[s]].real != OFF


@formula
def sliding_direction(S, W, sensed, s):
    """Direction of sliding along the tangents of slip s and of its partner, and the speed.

    In the plane it is the direction of the switch, in space `direction_in_space`.
    """
    way = sensed.value[direction_column(S, W, s)]
    u = sensed.rate[S.switches.measured[s]]
    other = S.switches.partner[s]
    if other < 0:
        return way, 0.0 * way, u * way
    side = sensed.value[direction_column(S, W, other)]
    v = sensed.rate[S.switches.measured[other]]
    return direction_in_space(characteristic_speed(S, W), (way, side), (u, v))


@formula
def direction_in_space(pace, directions, velocity):
    """Direction of sliding in space, and the speed along it; ``pace`` is the characteristic speed.

    It is the direction of the velocity, reversed where that has a negative component along the stored direction:
    sliding continues smoothly through rest until the event is found. At the onset of sliding the stored direction is
    used, and gradually that of the velocity as the speed grows: the velocity's own direction turns infinitely fast
    there.
    """
    (way, side), (u, v) = directions, velocity
    square = u * u + v * v
    if (way * way + side * side).real > ONSET_LENGTH:
        return onset_direction(pace, directions, velocity, square)
    slow = SLOW_SLIDING * pace
    if square.real <= slow.real * slow.real:
        return way, side, u * way + v * side
    speed = sqrt(square) if (u * way + v * side).real >= 0.0 else -sqrt(square)
    return u / speed, v / speed, speed


@formula
def onset_direction(pace, directions, velocity, square):
    """Direction and speed at the onset of sliding: velocity + c exp(-(speed / c)^2) direction.

    c is `ONSET_SPEED` times the characteristic speed.
    """
    first = ONSET_SPEED * pace
    c = first * exp(-square / (first * first)) / ONSET_LENGTH
    a, b = velocity[0] + c * directions[0], velocity[1] + c * directions[1]
    size = sqrt(a * a + b * b)
    return a / size, b / size, (velocity[0] * a + velocity[1] * b) / size


@formula
def apply_contact_friction(S, W, k, work, f):
    """Add the friction of a contact point to the generalised forces ``f``, and its power to its work rate."""
    a, b, power = contact_friction(S, W, k)
    work[S.forces.work[k]] = power
    for side in range(2):
        m = S.forces.F[k] if side == 0 else S.forces.M[k]
        if m < 0:
            continue
        r = S.rows.law.shape[0] + m
        for j in range(S.row_start[r], S.row_start[r + 1]):
            f[S.column[j]] += (a if side == 0 else b) * W.G[j]


@formula
def contact_friction(S, W, k):
    """-mu N d of a contact point sliding along d, on each tangent, and its power; N is the multiplier of the gap."""
    s = S.forces.switch[k]
    if not is_sliding(S, W, s):
        o = 0.0 * W.sensed.load[S.forces.load[k]]
        return o, o, o
    d, e, speed = sliding_direction(S, W, W.sensed, s)
    pressed, mu = W.sensed.load[S.forces.load[k]], S.switch_numbers.kinetic_friction[s]
    # between opening and the end of the step: limited, so that it does not diverge
    if pressed.real < 0.0 and mu.real > 1.0:
        mu = 1.0 + 0.0 * mu
    push = -mu * pressed
    return push * d, push * e, push * speed


@formula
def contact_guard(S, W, sensed, lam, kind, s):
    """Guard of a contact point: friction cone of sticking, direction of sliding, or edge of the contact area."""
    if kind == G_EDGE:
        held = W.modes.mode[S.switches.other[s]] != OFF
        return sensed.value[S.switches.measured[s]] if held else NO_GUARD
    other = S.switches.partner[s]
    if kind == G_CONE:
        if W.modes.mode[s] == OFF:
            return NO_GUARD
        pressed = lam[S.switches.row[S.switches.other[s]]]
        a = lam[S.switches.row[s]]
        b = lam[S.switches.row[other]] if other >= 0 else 0.0
        return S.switch_numbers.static_friction[s] * pressed - sqrt(a * a + b * b)
    if not is_sliding(S, W, s):
        return NO_GUARD
    u = sensed.rate[S.switches.measured[s]]
    v = sensed.rate[S.switches.measured[other]]
    way, side = sensed.value[direction_column(S, W, s)], sensed.value[direction_column(S, W, other)]
    speed, size = sqrt(u * u + v * v), sqrt(way * way + side * side)
    turned = (way * u + side * v) / size - TURN_COSINE * speed
    if size * size > ONSET_LENGTH:
        pace = characteristic_speed(S, W)
        return min(turned + REVERSAL_SPEED * pace, ONSET_END * ONSET_SPEED * pace - speed)
    return turned


REST_SPEED = 1e-9  # relative to the characteristic rate of a quantity: slower counts as rest


@formula
def gravity_component(S, W, t, i):
    """Component i of the acceleration of gravity."""
    law = S.gravity_laws[i]
    if law < 0:
        return S.gravity[i]
    o = 0.0 * t
    return evaluate(S.code, S.const, law, W.stack, (t, o, o), W.sensed)


@formula
def inertial_wrenches(S, W, t, work):
    """Gravity less the inertial wrench at vdot = 0: f = m (g - a), t = -(I alpha + w x I w), about the mass centre.

    Where gravity is a law of time, the power of its change since t = 0 goes to ``work``: potential energy is that of
    its value at t = 0.
    """
    gravity = (gravity_component(S, W, t, 0), gravity_component(S, W, t, 1), gravity_component(S, W, t, 2))
    if S.gravity_laws[3] >= 0:
        change = sub(gravity, (S.gravity[0], S.gravity[1], S.gravity[2]))
        power = 0.0 * change[0]
        for b in range(S.tree.parent.shape[0]):
            power += S.bodies.mass[b] * dot(change, load3(W.bodies.velocity, b, 0))
        work[S.gravity_laws[3]] = power
    for b in range(S.tree.parent.shape[0]):
        a = load3(W.bodies.bias_acceleration, b, 0)
        store3(W.body_wrenches.force, b, 0, scale(S.bodies.mass[b], sub(gravity, a)))
        R = load9(W.bodies.rotation, b, 0)
        w, alpha = load3(W.bodies.angular_velocity, b, 0), load3(W.bodies.bias_angular_acceleration, b, 0)
        t = euler_moment(load9(S.bodies.inertia, b, 0), mtv(R, w), mtv(R, alpha))
        store3(W.body_wrenches.torque, b, 0, neg(mv(R, t)))


@formula
def euler_moment(I, w, alpha):
    """I alpha + w x I w in body axes; by Euler's equations where these are principal axes."""
    if I[1] != 0.0 or I[2] != 0.0 or I[5] != 0.0:
        return add(mv(I, alpha), cross(w, mv(I, w)))
    return (
        I[0] * alpha[0] + (I[8] - I[4]) * w[1] * w[2],
        I[4] * alpha[1] + (I[0] - I[8]) * w[2] * w[0],
        I[8] * alpha[2] + (I[4] - I[0]) * w[0] * w[1],
    )


@formula
def apply_wrench(W, b, sign, force, torque, point):
    """Add ``sign`` times a wrench about ``point`` to body b."""
    t = add(torque, cross(sub(point, load3(W.bodies.position, b, 0)), force))
    for i in range(3):
        W.body_wrenches.force[b, i] += sign * force[i]
        W.body_wrenches.torque[b, i] += sign * t[i]


@formula
def force_law(S, W, k, slot, x):
    """Value of one of the element's laws for the inputs x = (t, a, b); zero where there is none."""
    at = S.forces.laws[k, slot]
    if at < 0:
        return 0.0 * x[0]
    return evaluate(S.code, S.const, at, W.stack, x, W.sensed)


@formula
def force_row(T, k):
    """The sixteen parameters of row k of the force table."""
    return (
        T[k, 0],
        T[k, 1],
        T[k, 2],
        T[k, 3],
        T[k, 4],
        T[k, 5],
        T[k, 6],
        T[k, 7],
        T[k, 8],
        T[k, 9],
        T[k, 10],
        T[k, 11],
        T[k, 12],
        T[k, 13],
        T[k, 14],
        T[k, 15],
    )


@formula
def wrench_at(S, W, t, k, F, M):
    """Wrench of force k between frames on M about M's origin, for these records; rates of its two states, or zeros."""
    kind = force_kind(S, k)
    par = force_row(S.force_parameters, k)
    if S.forces.state[k] >= 0:
        c = controller_column(S, W, S.forces.state[k])
        states = (W.sensed.value[c], W.sensed.value[c + 1])
        return wrench_and_rates(kind, par, F, M, states, S.const, S.surfaces)
    a, b = inputs(kind, par, F, M)
    x = (t + 0.0 * a, a, b)
    laws = (force_law(S, W, k, 0, x), force_law(S, W, k, 1, x), force_law(S, W, k, 2, x))
    force, torque = wrench(kind, par, F, M, laws, (a, b), S.const)
    o = 0.0 * force[0]
    return force, torque, (o, o)


@formula
def wrench_between_frames(S, W, t, k):
    """Records of frames F and M of force k between frames, its wrench on M about M's origin, rates of its states."""
    F = load_record(W.frames, S.forces.F[k])
    M = load_record(W.frames, S.forces.M[k])
    force, torque, rates = wrench_at(S, W, t, k, F, M)
    return F, M, force, torque, rates


@formula
def apply_forces(S, W, t, work):
    """Apply every force between frames to its bodies; write powers of accounted forces, and rates of forces' states."""
    for k in range(S.forces.F.shape[0]):
        if S.forces.family[k] != BETWEEN:
            continue
        i = S.forces.F[k]
        j = S.forces.M[k]
        F, M, force, torque, rates = wrench_between_frames(S, W, t, k)
        if S.frame_body[j] >= 0:
            apply_wrench(W, S.frame_body[j], 1.0, force, torque, M[0])
        if S.frame_body[i] >= 0:
            apply_wrench(W, S.frame_body[i], -1.0, force, torque, M[0])
        if S.forces.work[k] >= 0:
            work[S.forces.work[k]] = wrench_power(F, M, force, torque)
        if S.forces.state[k] >= 0:
            work[S.forces.state[k]] = rates[0]
            work[S.forces.state[k] + 1] = rates[1]


@formula
def wrench_power(F, M, force, torque):
    """Power [W] of a wrench on M at M's origin, and of its reverse on F's body at the same point."""
    u = sub(sub(M[3], F[3]), cross(F[2], sub(M[0], F[0])))
    return dot(force, u) + dot(torque, sub(M[2], F[2]))


@formula
def rest_rate(S, W, m):
    """Rate of quantity m up to which sliding counts as rest."""
    return REST_SPEED * characteristic_rate(S, W, m).real


@formula
def sliding_sign(S, W, k, rate):
    """Direction of sliding of force k along its quantity: that of its switch, or else the sign of the rate."""
    s = S.forces.switch[k]
    if s < 0:
        return sign(rate)
    told = W.sensed.value[direction_column(S, W, s)]
    if told.real == BY_RATE:
        return sign(rate) if magnitude(rate) > rest_rate(S, W, S.forces.F[k]) else 0.0 * told
    return told


@formula
def effort_along(S, W, t, k):
    """Effort of force k along its measured quantity, and the rate of that quantity."""
    m = S.forces.F[k]
    x = W.sensed.value[m]
    rate = W.sensed.rate[m]
    o = 0.0 * x
    pressed = W.sensed.load[S.forces.load[k]] if S.forces.load[k] >= 0 else o
    laws = (force_law(S, W, k, 0, (t + o, x, rate)), o, sliding_sign(S, W, k, rate))
    return effort(force_kind(S, k), force_row(S.force_parameters, k), x, rate, laws, pressed), rate


@formula
def apply_efforts(S, W, t, work, f):
    """Add every force along a measured quantity to the generalised forces ``f``; account power as in `apply_forces`."""
    for k in range(S.forces.F.shape[0]):
        if S.forces.family[k] != ALONG:
            if S.forces.family[k] == SLIDING:
                apply_contact_friction(S, W, k, work, f)
            continue
        s, rate = effort_along(S, W, t, k)
        r = S.rows.law.shape[0] + S.forces.F[k]
        for e in range(S.row_start[r], S.row_start[r + 1]):
            f[S.column[e]] += s * W.G[e]
        if S.forces.work[k] >= 0:
            work[S.forces.work[k]] = s * rate


@formula
def gather_forces(S, W, f):
    """Add the body wrenches to the generalised forces: a backward sweep, children to parents."""
    for d in range(f.shape[0]):
        f[d] = 0.0
    for b in range(S.tree.parent.shape[0] - 1, -1, -1):
        force = load3(W.body_wrenches.force, b, 0)
        torque = load3(W.body_wrenches.torque, b, 0)
        point = load3(W.bodies.position, b, 0)
        if S.tree.nv[b] > 0:
            project_wrench(S, W, b, f, S.tree.v[b], 1.0, force, torque, point)
        if S.tree.parent[b] >= 0:
            apply_wrench(W, S.tree.parent[b], 1.0, force, torque, point)


MAX_LOAD_NEWTON = 40  # Newton iterations, once the slopes are known
LOAD_TOLERANCE = 1e-12  # accepted relative change of a load
NEGLIGIBLE_LOAD = 0.1  # relative to the largest force and LOAD_TOLERANCE: smaller changes of loads are neglected
TRIAL_STEP = 0.05  # fraction of the way to the returned load that is taken to measure a slope
# a step that changes the gap by less than this fraction of the expected change does not update the slopes
FLAT_STEP = 1e-6
SLOPES_UNKNOWN = -1
LOOSE_LOAD_TOLERANCE = (
    1e-6  # accepted where redundancy leaves a reaction undetermined: rounding over the regularisation
)


@formula
def loads_end(S, W):
    """Column of W.sensed behind the loads."""
    return 2 * count_measured(S) + W.sensed.shape[0] - INVERSE_JACOBIAN


@formula
def reaction_loads(S, W):
    """Write the loads that follow from the reactions now in W to ``returned``."""
    for k in range(S.forces.F.shape[0]):
        n = S.forces.load[k]
        if n < 0:
            continue
        if S.forces.family[k] == SLIDING:
            s = S.forces.switch[k]
            W.sensed.returned[n] = W.rows.multiplier[S.switches.row[S.switches.other[s]]]
            if not is_sliding(S, W, s):  # no friction, so no load is needed
                W.sensed.load[n] = W.sensed.returned[n]
            continue
        o = 0.0 * W.rows.multiplier[0]
        force = (o, o, o)
        torque = (o, o, o)
        for x in range(S.load_terms.load.shape[0]):
            if S.load_terms.load[x] == n:
                f, m = wrench_on_second(S, W, S.load_terms.term[x])
                force, torque = add(force, f), add(torque, m)
        W.sensed.returned[n] = pressed(
            force_row(S.force_parameters, k), load_record(W.frames, S.forces.M[k]), force, torque
        )


@formula
def static_friction_limit(S, W, k, t, arm, load):
    """Largest force that friction k can hold along its quantity at rest, with this arm and load."""
    return load_dependent_friction(S, W, k, (t, W.sensed.value[S.forces.F[k]], 0.0), arm, load, STATIC)


@formula
def dry_friction(S, W, k, t, rate, arm, load):
    """Magnitude of the sliding friction without its viscous part."""
    return load_dependent_friction(S, W, k, (t, W.sensed.value[S.forces.F[k]], rate), arm, load, sign(rate))


@formula
def load_dependent_friction(S, W, k, x, arm, load, direction):
    """Part of the effort of force k due to the arm, for the inputs x = (t, value, rate) of its law."""
    par, kind = force_row(S.force_parameters, k), force_kind(S, k)
    laws = (force_law(S, W, k, 0, x), 0.0, direction)
    whole = effort(kind, (arm, *par[1:]), x[1], x[2], laws, load)
    return abs(whole - effort(kind, (0.0, *par[1:]), x[1], x[2], laws, load))


@formula
def may_be_negative(S, n):
    """Whether load n may be negative: a contact point pulls from its opening to the end of the step."""
    for x in range(S.load_terms.load.shape[0]):
        if S.load_terms.load[x] == n:
            return S.load_terms.term[x] < 0
    return False


@formula
def returned_loads(S, W):
    """Write the loads that follow from the reactions now in W to ``returned``; return the largest relative change."""
    reaction_loads(S, W)
    worst = 0.0
    small = NEGLIGIBLE_LOAD * force_scale(S, W)
    for k in range(S.forces.F.shape[0]):
        n = S.forces.load[k]
        if n < 0:
            continue
        new = W.sensed.returned[n]
        change = abs(new - W.sensed.load[n]) / (small + abs(new) + abs(W.sensed.load[n]))
        if not change <= worst:
            worst = change
            W.counts.guilty_row = k
    return worst


@formula
def force_scale(S, W):
    """Largest force that moves a body or would be needed to satisfy a constraint, as a scale of loads [N]."""
    size = 1e-300
    for d in range(W.velocities.solved.shape[0]):
        size = max(size, abs(W.velocities.applied[d]) * S.velocity_units[d] / S.scales.length)
    for k in range(S.rows.law.shape[0]):
        if W.rows.diagonal[k] > 0.0:
            size = max(size, abs(W.rows.gamma[k]) / (W.rows.diagonal[k] * S.row_levers[k]))
    return size


@formula
def max_load_tries(W):
    """Number of solves after which the load iteration restarts from zero loads: one for each slope, then Newton's."""
    return W.sensed.shape[0] - INVERSE_JACOBIAN + MAX_LOAD_NEWTON


@formula
def update_loads(S, W, attempt):
    """Next loads. ``attempt`` counts from 0 within one evaluation.

    Newton's method on load - returned load = 0 with Broyden's inverse Jacobian. It is initialised by a small step of
    each load by itself and kept from one evaluation to the next.
    """
    first, last = 2 * count_measured(S), loads_end(S, W)
    if attempt == max_load_tries(W):
        W.counts.load_updates = SLOPES_UNKNOWN
        for n in range(first, last):
            W.sensed.load[n] = 0.0
        return
    if W.counts.load_updates == SLOPES_UNKNOWN or (attempt == 0 and W.counts.load_updates == 0):
        W.counts.load_updates = 0
        for n in range(first, last):
            for k in range(first, last):
                W.sensed[INVERSE_JACOBIAN + n - first, k] = 1.0 if n == k else 0.0
    elif attempt > 0:
        update_inverse_jacobian(W, first, last)
    for n in range(first, last):
        W.sensed.load_before[n] = W.sensed.load[n]
        W.sensed.gap_before[n] = W.sensed.load[n] - W.sensed.returned[n]
    if W.counts.load_updates < last - first:
        n = first + W.counts.load_updates
        W.sensed.load[n] -= TRIAL_STEP * W.sensed.gap_before[n]
        W.counts.load_updates += 1
        return
    for n in range(first, last):
        new = W.sensed.load[n]
        for k in range(first, last):
            new -= W.sensed[INVERSE_JACOBIAN + n - first, k] * W.sensed.gap_before[k]
        W.sensed.load[n] = new if new > 0.0 or may_be_negative(S, n) else 0.0


@formula
def load_slopes_known(S, W):
    """Whether the slopes of all loads are known; before that, steps are small and do not indicate convergence."""
    return W.counts.load_updates >= W.sensed.shape[0] - INVERSE_JACOBIAN


@formula
def update_inverse_jacobian(W, first, last):
    """Broyden's update B += (dx - B dr) (dx^T B) / (dx^T B dr), r = load - returned load (Broyden, 1965)."""
    moved = 0.0
    along = 0.0
    for n in range(first, last):
        W.sensed.broyden_product[n] = 0.0
        W.sensed.broyden_row[n] = 0.0
    for n in range(first, last):
        dx = W.sensed.load[n] - W.sensed.load_before[n]
        for k in range(first, last):
            b = W.sensed[INVERSE_JACOBIAN + n - first, k]
            gap = W.sensed.load[k] - W.sensed.returned[k]
            W.sensed.broyden_product[n] += b * (gap - W.sensed.gap_before[k])
            W.sensed.broyden_row[k] += dx * b
        moved += dx * dx
        along += dx * W.sensed.broyden_product[n]
    if not abs(along) > FLAT_STEP * moved:
        return
    for n in range(first, last):
        dx = W.sensed.load[n] - W.sensed.load_before[n]
        for k in range(first, last):
            W.sensed[INVERSE_JACOBIAN + n - first, k] += (
                (dx - W.sensed.broyden_product[n]) * W.sensed.broyden_row[k] / along
            )


FORCE_SIZE, TORQUE_SIZE = 6, 7  # columns of the magnitudes, after those of the components


@formula
def update_readings(S, W, t):
    """Fill in the columns of forces that events or laws name, from the solution in W."""
    first = loads_end(S, W)
    if first == controller_column(S, W, 0):
        return
    for m in range(first, controller_column(S, W, 0)):
        W.sensed.value[m] = 0.0 * t
    for x in range(S.load_terms.load.shape[0]):
        at, what = S.load_terms.load[x], S.load_terms.term[x]
        if at >= first:
            if what >= 0:
                add_joint_wrench(S, W, at, what)
            else:
                W.sensed.value[at] += reading_along(S, W, t, -2 - what)
                W.sensed.value[at + 1] = -W.sensed.value[at]


@formula
def add_joint_wrench(S, W, at, what):
    """Add the effect of term ``what`` of a joint's rows to the joint's wrench, on its second body, about M's origin."""
    force, torque = wrench_on_second(S, W, what)
    for i in range(3):
        W.sensed.value[at + i] += force[i]
        W.sensed.value[at + 3 + i] += torque[i]
    for i in range(2):
        a, b, d = W.sensed.value[at + 3 * i], W.sensed.value[at + 3 * i + 1], W.sensed.value[at + 3 * i + 2]
        W.sensed.value[at + (FORCE_SIZE if i == 0 else TORQUE_SIZE)] = sqrt(a * a + b * b + d * d)


@formula
def reading_along(S, W, t, what):
    """Effort along its quantity of a row, of a force along a quantity, or of a driver that prescribes a coordinate."""
    nr, nk = S.rows.law.shape[0], S.forces.F.shape[0]
    if what < nr:
        return W.rows.multiplier[what]
    if what < nr + nk:
        return effort_along(S, W, t, what - nr)[0]
    return W.velocities.effort[what - nr - nk]
