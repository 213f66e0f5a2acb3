"""Rows of the jointed mechanism: its contacts, and single rows (stops, ropes, joint friction), with their responses.

- Stop: velocity and impulse are complementary, as at a contact; it rebounds by Newton's law.
- Rope: it is taut or slack within one step, and treated implicitly as springs are.
- Friction: bounded by its own law, at the load that follows from the reactions of the last step.

The response to a row's impulse is one solve with the factor of the joints. Groups are independent of each other, so
that one solve gives the response of a row of each group.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...engine.loads import dry_friction, reaction_loads, static_friction_limit
from ...math.vec import add, load3
from ...numerics.complementarity.contact_problem import FIXED_SIDE
from .implicit_springs import add_wrench_power, impulse_response, with_spring_response
from .stepping_tables import (
    LINE_FRICTION,
    LINE_ROPE,
    LINE_STOP,
    TABLES_FULL,
)

REST_SHARE = 1e-9  # negligible rate, relative to the deceleration by friction within a step
STOP_LOOKAHEAD = 4.0  # a stop gets a row if its coordinate may reach it within this number of steps
INFINITE = 1e300


@formula
def line_group(A, k):
    """Return the group of the quantity of single row k; -1 if nothing moves it."""
    r = A.S.rows.law.shape[0] + A.line.quantity[k]
    for e in range(A.S.row_start[r], A.S.row_start[r + 1]):
        for g in range(A.queue.shape[0]):
            if A.group[g] <= A.S.column[e] < A.group[g + 1]:
                return g
    return -1


@formula
def line_lever(A, k):
    """Return the lever [m] that turns the rate of single row k into a velocity [m/s]; 1 if it is one already."""
    return A.S.scales.length / A.S.units[A.line.quantity[k]]


@formula
def line_rate(A, k, v):
    """Return the rate of the quantity of single row k at velocities v."""
    s = 0.0
    r = A.S.rows.law.shape[0] + A.line.quantity[k]
    for e in range(A.S.row_start[r], A.S.row_start[r + 1]):
        s += A.W.G[e] * v[A.S.column[e]]
    return s


@formula
def stop_gap(A, k, side):
    """Return the gap of a stop at the start of the step; side 1 is the lower stop, -1 the upper."""
    x = A.W.sensed.value[A.line.quantity[k]] - 0.5 * A.real.step * line_rate(A, k, A.velocities.before)
    return x - A.line_law.lower[k] if side > 0 else A.line_law.upper[k] - x


@formula
def line_acts(A, k, side):
    """Return whether single row k acts in this step.

    Of two stops the nearer one always does, since impacts may reach it. The other one does if the motion, or the
    correction of an overrun, may reach it.
    """
    if A.line.kind[k] != LINE_STOP:
        return side > 0
    gap, other = stop_gap(A, k, side), stop_gap(A, k, -side)
    r, dr = line_rate(A, k, A.velocities.before), line_rate(A, k, A.velocities.change)
    return gap <= other or gap < STOP_LOOKAHEAD * (A.real.step * (abs(r) + abs(dr)) + max(0.0, -other))


@formula
def line_rows(A, P, used, jobs, write):
    """Add the active single rows after those of the contacts, if ``write``. Returns (numbers, jobs, rows)."""
    n = 0
    for k in range(A.line.shape[0]):
        g = line_group(A, k)
        if g < 0:
            continue
        for turn in range(2):
            side = 1 - 2 * turn
            if not line_acts(A, k, side):
                continue
            size = A.group[g + 1] - A.group[g]
            if write:
                A.active.line[n], A.active.group[n], A.active.first[n] = side * (k + 1), g, used
                line_row(A, P, k, g, (used, size, side))
            used += size
            jobs += 1
            n += 1
    return used, jobs, n


@formula
def line_row(A, P, k, g, where):
    """Write the gradient of the quantity of single row k times its lever, reversed for an upper stop."""
    at, size, side = where
    lever = side * line_lever(A, k)
    for d in range(size):
        P.J[at + d] = 0.0
    r = A.S.rows.law.shape[0] + A.line.quantity[k]
    for e in range(A.S.row_start[r], A.S.row_start[r + 1]):
        P.J[at + A.S.column[e] - A.group[g]] += lever * A.W.G[e]


@formula
def line_laws(A, P, n):
    """Set biases, compliances and bounds of the single rows, whose responses are known."""
    h = A.real.step
    P.size[3] = n
    for i in range(n):
        k = abs(A.active.line[i]) - 1
        side = 1 if A.active.line[i] > 0 else -1
        x = P.line_law
        P.line_at[i, 0], P.line_at[i, 1] = A.active.group[i], A.active.first[i]
        x.bias[i], x.soft[i], x.lower[i], x.upper[i] = 0.0, 0.0, 0.0, INFINITE
        if A.line.kind[k] == LINE_STOP:
            lever = line_lever(A, k)
            rate, gap = lever * side * line_rate(A, k, A.velocities.before), lever * stop_gap(A, k, side)
            hit = rate < 0.0 and gap + h * rate <= 0.0
            x.bias[i] = A.line_law.restitution[k] * rate if hit else max(gap, 0.0) / h
        elif A.line.kind[k] == LINE_ROPE:
            rope_law(A, P, i, k, x)
        else:
            friction_law(A, P, i, k, x)


@formula
def friction_law(A, P, i, k, x):
    """Bound friction by -h F and h F; where the rate is zero to rounding, by the static limit."""
    h, lever = A.real.step, line_lever(A, k)
    g, at = A.active.group[i], A.active.first[i]
    w = 0.0
    for d in range(A.group[g + 1] - A.group[g]):
        w += P.J[at + d] * P.Y[at + d]
    t, arm, load = A.real.time + 0.5 * h, A.line_law.arm[k], A.line_law.load[k]
    rate = line_rate(A, k, A.velocities.before)
    held = h * static_friction_limit(A.S, A.W, A.line.force[k], t, arm, load)
    if lever * abs(rate) > REST_SHARE * held / lever * w:
        held = h * dry_friction(A.S, A.W, A.line.force[k], t, rate, arm, load)
    x.lower[i], x.upper[i] = -held / lever, held / lever


@formula
def rope_law(A, P, i, k, x):
    """Set the law of a rope, -s = h (K (x - x0) + C r), at position and rate as in `implicit_springs`; it never
    pushes.
    """
    h = A.real.step
    K, C = A.line_law.stiffness[k], A.line_law.damping[k]
    g, at = A.active.group[i], A.active.first[i]
    w = 0.0
    for d in range(A.group[g + 1] - A.group[g]):
        w += P.J[at + d] * P.Y[at + d]
    z = 0.25 * h * (h * K + C) * w
    b = z * z / (1.0 + z * z)
    added = h * h * K * (0.25 + 0.75 * b) + h * C * (0.5 + 0.5 * b)
    bend = h * A.W.sensed.bias[A.line.quantity[k]]
    r = line_rate(A, k, A.velocities.before) - 0.5 * bend
    stretch = A.W.sensed.value[A.line.quantity[k]] - A.line_law.length[k] - 0.125 * b * h * bend
    force = h * K * (stretch - 0.25 * (1.0 - b) * h * r) + 0.5 * h * C * (1.0 - b) * r
    x.bias[i], x.soft[i], x.lower[i], x.upper[i] = 0.5 * bend + force / added, 1.0 / added, -INFINITE, 0.0


@formula
def account_lines(A, P, X):
    """Account for the works of the single rows, and update the loads of joint friction for the next step."""
    for i in range(P.size[3]):
        k = abs(A.active.line[i]) - 1
        side = 1.0 if A.active.line[i] > 0 else -1.0
        impulse = X.line[i] * side * line_lever(A, k)
        work = impulse * 0.5 * (line_rate(A, k, A.velocities.before) + line_rate(A, k, A.velocities.after))
        if A.line.kind[k] == LINE_STOP:
            A.real.lost -= work
        else:
            f = A.line.force[k]
            if A.S.forces.work[f] >= 0:
                z = A.S.sizes.coordinates + A.velocities.before.shape[0] + A.S.forces.work[f]
                A.clock.K[0, z] += work / A.real.step
            A.line_law.reaction[k] = impulse / A.real.step
    update_friction_loads(A)


@formula
def update_friction_loads(A):
    """Compute the loads of joints with friction from the reactions of the step."""
    if A.S.load_terms.load.shape[0] == 0:
        return
    for r in range(A.reactions.smooth.shape[0]):
        A.W.rows.multiplier[r] = A.reactions.smooth[r] + (A.reactions.impulse[r] + A.reactions.impact[r]) / A.real.step
    reaction_loads(A.S, A.W)
    for k in range(A.line.shape[0]):
        if A.line.kind[k] == LINE_FRICTION and A.S.forces.load[A.line.force[k]] >= 0:
            A.line_law.load[k] = A.W.sensed.returned[A.S.forces.load[A.line.force[k]]]


@formula
def keep_stops_only(A, P, X):
    """For the position solve: stops correct their overrun, and no other single row acts."""
    A.real.overrun = 0.0
    for i in range(P.size[3]):
        k = abs(A.active.line[i]) - 1
        side = 1 if A.active.line[i] > 0 else -1
        x = P.line_law
        X.line[i] = 0.0
        x.soft[i] = x.lower[i] = x.upper[i] = 0.0
        if A.line.kind[k] == LINE_STOP:
            mean = 0.5 * (line_rate(A, k, A.velocities.before) + line_rate(A, k, A.velocities.after))
            gap = line_lever(A, k) * (stop_gap(A, k, side) + A.real.step * side * mean)
            A.real.overrun = min(A.real.overrun, gap)
            x.bias[i], x.upper[i] = gap / A.real.step, INFINITE


@formula
def mechanism_contact_rows(A, M, C, P):
    """Write the rows of all contacts on the mechanism into ``P``; the movers in its sides become groups.

    Returns 0, or TABLES_FULL where J and Y, or the table of jobs, are too small for ``A.count.needed`` and
    ``A.count.jobs``.
    """
    first = A.count.first
    rows = 6 if P.turn.shape[0] > 0 else 3
    used, jobs = table_sizes(A, P, rows)
    used, jobs, lines = line_rows(A, P, used, jobs, False)
    A.count.needed, A.count.jobs = used, jobs
    if used > min(P.J.shape[0], P.Y.shape[0]) or jobs > A.job.shape[0] or lines > P.line_at.shape[0]:
        return TABLES_FULL
    for g in range(A.queue.shape[0]):
        A.queue[g] = -1
    used = 0
    jobs = 0
    for c in range(P.size[0]):
        last = -1
        for side in range(2):
            P.block[c, side] = -1
            mover = P.at[c, side]
            if mover < first:
                continue
            b, g = A.mover[mover - first, 0], A.mover[mover - first, 1]
            if g < 0:  # joints fix it to ground
                P.at[c, side] = FIXED_SIDE
                continue
            n = A.group[g + 1] - A.group[g]
            if g == last:  # both sides in one group: the difference
                at = P.block[c, 0]
                for i in range(rows * n):
                    P.J[at + i] = -P.J[at + i]
                P.block[c, 0], P.at[c, 0] = -1, FIXED_SIDE
            else:
                at = used
                for i in range(rows * n):
                    P.J[at + i] = 0.0
                used += rows * n
                queue_row(A, g, jobs, at, rows)
                jobs += 1
            point = add(load3(A.W.bodies.position, b, 0), load3(P.arm, c, 3 * side))
            side_rows(A, P, c, (b, at - A.group[g], n), point, rows)
            P.block[c, side], P.at[c, side] = at, -2 - g
            last = g
    line_rows(A, P, used, jobs, True)
    for i in range(lines):
        queue_row(A, A.active.group[i], jobs + i, A.active.first[i], 1)
    row_responses(A, P)
    line_laws(A, P, lines)
    return 0


@formula
def table_sizes(A, P, rows):
    """Return how many numbers J and Y hold, and the number of jobs."""
    used = 0
    jobs = 0
    for c in range(P.size[0]):
        last = -1
        for side in range(2):
            mover = P.at[c, side]
            if mover >= A.count.first:
                g = A.mover[mover - A.count.first, 1]
                if g != last and g >= 0:
                    used += rows * (A.group[g + 1] - A.group[g])
                    jobs += 1
                last = g
    return used, jobs


@formula
def queue_row(A, g, job, at, rows):
    """Queue a job: the responses to rows of group g."""
    A.job.first[job], A.job.rows[job], A.job.next[job] = at, rows, A.queue[g]
    A.queue[g] = job


@formula
def side_rows(A, P, c, where, point, rows):
    """Add velocities of a point of body b along the frame of contact c; with six rows also its angular velocity."""
    b, at, n = where
    zero = (0.0, 0.0, 0.0)
    for i in range(rows):
        axis = load3(P.frame, c, 3 * (i % 3))
        force, torque = (axis, zero) if i < 3 else (zero, axis)
        add_wrench_power(A.S, A.W, b, P.J, at + i * n, 1.0, force, torque, point)


@formula
def row_responses(A, P):
    """Compute the responses Y to all queued rows: one row of each group per solve."""
    force, out = A.velocities.impulse, A.velocities.impulsive
    busy = True
    while busy:
        busy = False
        for i in range(6):
            asked = fill_impulses(A, P, i, force)
            if asked == 0:
                break
            busy = True
            impulse_response(A, force, out)
            with_spring_response(A, out)
            read_responses(A, P, i, out)
        for g in range(A.queue.shape[0]):
            if A.queue[g] >= 0:
                A.queue[g] = A.job.next[A.queue[g]]


@formula
def fill_impulses(A, P, i, force):
    """Set the impulse of row i of the next job of each group; return how many groups have one."""
    asked = 0
    for d in range(force.shape[0]):
        force[d] = 0.0
    for g in range(A.queue.shape[0]):
        k = A.queue[g]
        if k >= 0 and i < A.job.rows[k]:
            asked += 1
            a = A.group[g]
            n = A.group[g + 1] - a
            at = A.job.first[k] + i * n
            for d in range(n):
                force[a + d] = P.J[at + d]
    return asked


@formula
def read_responses(A, P, i, out):
    """Read the responses to the impulses of `fill_impulses`."""
    for g in range(A.queue.shape[0]):
        k = A.queue[g]
        if k >= 0 and i < A.job.rows[k]:
            a = A.group[g]
            n = A.group[g + 1] - a
            at = A.job.first[k] + i * n
            for d in range(n):
                P.Y[at + d] = out[a + d]
