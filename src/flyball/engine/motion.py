"""The motion as an ordinary differential equation dy/dt = f(P(y)), y = (q, v, z), and prescribed motion.

z are works, turned angles and places on curves. Index 1: [M G^T; G 0] [vdot; -lam] = [f; gamma]. The constraints g = 0
and G v = nu are maintained by one smooth projection P, along M^-1 G^T or along dependent coordinates. The integrator
integrates f(P(y)), so its order is preserved.

Sliding motion on a nonsmooth point of a law (both sides lead towards it): the side, a number between -1 and 1, is such
that du/dt = 0 (Filippov, *Differential Equations with Discontinuous Righthand Sides*, 1988, section 4). Accelerations
depend on the side, at the cost of one more solve for each trial. It is found by Newton's method with Broyden's slopes,
which are kept from one evaluation to the next. Where du/dt does not depend on the sides and is zero, d^2u/dt^2 is kept
at zero (sliding of second order: Levant, *International Journal of Control* 58, 1993): the switch is STEADY.

Where drivers leave no freedom nothing is integrated, so nothing drifts. Positions are predicted by the cubic through
the last two velocities and accelerations and corrected by Newton's method. Where the prediction is far off the step is
halved, so that no step leads to another branch. Rows are written at all step times, with powers in place of works.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..constraints.switches.switch_kind import OFF, STEADY
from ..laws.bytecode import STACK_RESERVE, evaluate_jet, is_entire
from ..math.scalar import atan2, cos, magnitude, sin
from ..numerics.integrators.time_loop import DONE, RUNNING, STEP_FAILED, TOO_MANY_STEPS
from ..tables.table_definitions import FINISH, LOADS, REVOLUTE, SCHUR
from .calls import call_generated
from .element_dispatch import progress, remember
from .kinematics import coordinate_rates, retract
from .loads import (
    LOAD_TOLERANCE,
    LOOSE_LOAD_TOLERANCE,
    apply_efforts,
    apply_forces,
    gather_forces,
    inertial_wrenches,
    load_slopes_known,
    max_load_tries,
    returned_loads,
    update_loads,
    update_readings,
)
from .rows import BY_TIME, controller_column, count_measured, direction_column, update_controllers
from .solve import MAX_REFINEMENTS, exchange_coordinates, factor, reuse_factor, solve
from .stabilization import (
    BAUMGARTE,
    FACTOR_CURRENT,
    FACTOR_NEAR,
    FACTOR_OLD,
    STAGES,
    STALE_RESIDUAL,
    STEPS,
    TIGHT_G,
    TIGHT_V,
    add_baumgarte_terms,
    position_rounding,
    position_violation,
    project_state,
    set_prescribed,
    update_positions,
    update_shown_frames,
    update_velocities,
    velocity_violation,
)

ALONG_MOTION = -1  # derivative along the motion
MAX_CORNER_PASSES = 40
SETTLED_CHANGE = 1e-13  # change of a side that counts as none
FLAT_CHANGE = 1e-9


@formula
def held_on_corner(S, W, s):
    """Whether the motion is held on the corner of switch s."""
    return S.switches.law[s] >= 0 and W.modes.mode[s] != OFF


@formula
def held_on_any_corner(S, W):
    """Whether the motion is held on some corner."""
    count = 0
    for s in range(S.switches.row.shape[0]):
        count += 1 if held_on_corner(S, W, s) else 0
    return count > 0


@formula
def corner_rates(S, W, t):
    """Write du/dt of each corner, or for STEADY ones d^2u/dt^2, at the present accelerations to `W.modes.drift`."""
    nr = S.rows.law.shape[0]
    nm = count_measured(S)
    for m in range(nm):
        a = W.sensed.bias[m]
        for e in range(S.row_start[nr + m], S.row_start[nr + m + 1]):
            a += W.G[e] * W.velocities.solved[S.column[e]]
        W.sensed.rate[nm + m] = a
        W.sensed.bias[nm + m] = W.sensed.bias[m]
        W.sensed.bias[m] = a
    for c in range(S.control_laws.shape[0]):
        law = S.control_laws[c]
        at = controller_column(S, W, c)
        W.sensed.bias[at] = (
            evaluate_jet(S.code, S.const, law, W.stack, t, W.sensed, ALONG_MOTION)[1] if law >= 0 else 0.0
        )
    for s in range(S.switches.row.shape[0]):
        law = S.switches.law[s]
        if law >= 0:
            jet = evaluate_jet(S.code, S.const, law, W.stack, t, W.sensed, ALONG_MOTION)
            W.modes.drift[s] = jet[2] if W.modes.mode[s] == STEADY else jet[1]
    for m in range(nm):
        W.sensed.bias[m] = W.sensed.bias[nm + m]
        W.sensed.bias[nm + m] = 0.0 * W.sensed.value[m]
        W.sensed.rate[nm + m] = 0.0 * W.sensed.value[m]


@formula
def corners_settled(S, W, t, n):
    """Whether u stays zero on all corners that hold the motion; if not, update their sides. n counts the passes."""
    corner_rates(S, W, t)
    ns = S.switches.row.shape[0]
    if n > 0:
        update_corner_slopes(S, W)
    worst = 0.0
    for s in range(ns):
        if held_on_corner(S, W, s):
            change = 0.0
            for k in range(ns):
                if held_on_corner(S, W, k):
                    change += W.modes.inverse_slopes[s, k] * W.modes.drift[k]
            W.modes.moved_side[s] = change
            if not abs(change) <= worst:
                worst = abs(change)
    if worst <= SETTLED_CHANGE:
        return True
    for s in range(ns):
        if held_on_corner(S, W, s):
            at = direction_column(S, W, s)
            W.modes.previous_side[s] = W.sensed.value[at]
            W.modes.previous_drift[s] = W.modes.drift[s]
            W.sensed.value[at] -= W.modes.moved_side[s]
    return False


@formula
def update_corner_slopes(S, W):
    """Broyden's update of the inverse slopes, B += (dx - B dr) (dx^T B) / (dx^T B dr) (Broyden, 1965)."""
    ns = S.switches.row.shape[0]
    moved = 0.0
    share = 0.0
    for s in range(ns):
        W.modes.moved_side[s] = 0.0
        W.modes.given_side[s] = 0.0
    for s in range(ns):
        if held_on_corner(S, W, s):
            dx = W.sensed.value[direction_column(S, W, s)] - W.modes.previous_side[s]
            for k in range(ns):
                if held_on_corner(S, W, k):
                    b = W.modes.inverse_slopes[s, k]
                    W.modes.moved_side[s] += b * (W.modes.drift[k] - W.modes.previous_drift[k])
                    W.modes.given_side[k] += dx * b
            moved += dx * dx
            share += dx * W.modes.moved_side[s]
    if not share > FLAT_CHANGE * moved or moved < SETTLED_CHANGE * SETTLED_CHANGE:
        return
    for s in range(ns):
        if held_on_corner(S, W, s):
            dx = W.sensed.value[direction_column(S, W, s)] - W.modes.previous_side[s]
            for k in range(ns):
                if held_on_corner(S, W, k):
                    W.modes.inverse_slopes[s, k] += (dx - W.modes.moved_side[s]) * W.modes.given_side[k] / share


NOT_FINITE, JAMMED, SINGULAR = 3, 4, 5


@formula
def prescribed_deviation(S, W, t, q, v):
    """Largest relative deviation of prescribed coordinates and velocities from their laws.

    It is relative to the mechanism's size and speed. The coordinates come from the laws' derivatives: a deviation shows
    that a law jumps.
    """
    worst = 0.0
    for b in range(S.tree.parent.shape[0]):
        law = S.tree.law[b]
        if law >= 0:
            f, f1, _ = evaluate_jet(S.code, S.const, law, W.stack, t, W.sensed, BY_TIME)
            way = f - S.bodies.offset[b] - q[S.tree.q[b]]
            size = S.scales.length
            if S.tree.joint[b] == REVOLUTE:  # whole turns are those of the law
                way = atan2(sin(way), cos(way))
                size = 0.0 * size + 1.0
            rate = magnitude(f1 - v[S.tree.v[b]]) / (size * W.options.rate + magnitude(f1))
            worst = max(worst, magnitude(way) / size, rate)
    return worst


@formula
def accelerate(S, W, t, p, dy, factored):
    """Write the derivative of the projected state p, whose kinematics and rows are in W, to ``dy``.

    vdot and lam are left in W. Returns a status.
    """
    nq = S.sizes.coordinates
    nv = W.velocities.solved.shape[0]
    v = p[nq : nq + nv]
    work = dy[nq + nv :]
    if W.options.stabilization == BAUMGARTE:
        add_baumgarte_terms(S, W, v)
    if W.options.partitioned > 0.0:  # from here on with all masses
        W.options.partitioned = 0.0
        factored = FACTOR_OLD
    if factored == FACTOR_NEAR:
        if S.sizes.solver == SCHUR:
            reuse_factor(S, W)
        else:
            factored = FACTOR_OLD  # M has changed
    for n in range(MAX_CORNER_PASSES):
        status, factored = solve_accelerations(S, W, t, p, work, factored)
        if status != 0:
            return status
        if not held_on_any_corner(S, W) or corners_settled(S, W, t, n):
            return store_derivative(S, W, t, p, dy)
    W.counts.status = NOT_FINITE
    return NOT_FINITE


@formula
def solve_accelerations(S, W, t, p, work, factored):
    """Accelerations and multipliers into W, with consistent loads of friction. Returns (status, factored)."""
    x = W.velocities.solved
    change = 1e300
    # friction loads depend on the solution: iterate until they are consistent
    most = 2 * max_load_tries(W)
    for attempt in range(most):
        update_controllers(S, W, t, p[S.sizes.coordinates + W.velocities.solved.shape[0] :], work)
        apply_all_forces(S, W, t, p, work)
        if (
            factored == FACTOR_OLD
            or solve(S, W, W.velocities.applied, W.rows.gamma, x, W.rows.multiplier, True, MAX_REFINEMENTS)
            > STALE_RESIDUAL * W.options.solve_tolerance
        ):
            if factor(S, W) != 0:
                W.counts.status = SINGULAR
                return SINGULAR, factored
            factored = FACTOR_CURRENT
            solve(S, W, W.velocities.applied, W.rows.gamma, x, W.rows.multiplier, True, MAX_REFINEMENTS)
        if S.load_terms.load.shape[0] == 0:
            break
        last = change
        change = returned_loads(S, W)
        if change <= LOAD_TOLERANCE or (
            change <= LOOSE_LOAD_TOLERANCE and change > 0.5 * last and load_slopes_known(S, W)
        ):
            break
        if attempt == most - 1:
            W.counts.status = JAMMED if finite_status(x) == 0 else NOT_FINITE
            return W.counts.status, factored
        update_loads(S, W, attempt)
    return 0, factored


@formula
def apply_all_forces(S, W, t, p, work):
    """Generalised forces into `W.velocities.applied`, and the powers of accounted forces into ``work``."""
    if W.generated[LOADS] != 0:
        call_generated(W.generated[LOADS], S, W, t, p, work, p, work)
        return
    inertial_wrenches(S, W, t, work)
    apply_forces(S, W, t, work)
    gather_forces(S, W, W.velocities.applied)
    apply_efforts(S, W, t, work, W.velocities.applied)


@formula
def store_derivative(S, W, t, p, dy):
    """Write the derivative of the state p, from the solution in W, to ``dy``. Returns a status."""
    nq = S.sizes.coordinates
    nv = W.velocities.solved.shape[0]
    x = W.velocities.solved
    v = p[nq : nq + nv]
    work = dy[nq + nv :]
    if W.generated[FINISH] != 0:
        W.counts.status = (
            0 if call_generated(W.generated[FINISH], S, W, t, p, dy, x, W.rows.multiplier) == 0.0 else NOT_FINITE
        )
        return W.counts.status
    coordinate_rates(S, p, v, dy)
    for d in range(nv):
        dy[nq + d] = x[d]
    for k in range(S.rows.law.shape[0]):
        if S.rows.work[k] >= 0:
            work[S.rows.work[k]] = W.rows.multiplier[k] * W.rows.nu[k]
    for b in range(S.tree.parent.shape[0]):
        if S.tree.law[b] >= 0:
            d = S.tree.v[b]
            work[S.tree.work[b]] = W.velocities.effort[d] * v[d]
    progress(S, W, p[nq + nv :], work)
    update_readings(S, W, t)
    W.counts.status = finite_status(dy)
    return W.counts.status


@formula
def solve_response(S, W, f, gamma, x, lam):
    """Solve for accelerations x and multipliers due to forces f and right-hand sides gamma at the state in W.

    Prescribed velocities do not change; the efforts needed for that are left in `W.velocities.effort`.
    """
    for d in range(x.shape[0]):
        W.velocities.prescribed[d] = 0.0
    if (
        solve(S, W, f, gamma, x, lam, True, MAX_REFINEMENTS) > STALE_RESIDUAL * W.options.solve_tolerance
        and factor(S, W) == 0
    ):
        solve(S, W, f, gamma, x, lam, True, MAX_REFINEMENTS)


@formula
def finite_status(dy):
    """0, or NOT_FINITE if an entry is not finite."""
    s = 0.0
    for i in range(dy.shape[0]):
        s += (dy[i] - dy[i]).real
    return 0 if s == 0.0 else NOT_FINITE


@formula
def derivative(t, y, dy, S, W):
    """dy/dt = f(P(y)) with the projection P; ``y`` is not changed. Returns 0 or a status."""
    nq = S.sizes.coordinates
    p = W.trial.state
    for i in range(y.shape[0]):
        p[i] = y[i]
    q = p[:nq]
    v = p[nq : nq + W.velocities.solved.shape[0]]
    z = p[nq + W.velocities.solved.shape[0] :]
    set_prescribed(S, W, t, q, v)
    factored = FACTOR_CURRENT if W.options.factored > 0.0 else FACTOR_OLD
    if W.options.stabilization >= STAGES:
        status, _, factored = project_state(
            S, W, t, q, v, z, W.options.position_tolerance, W.options.velocity_tolerance
        )
        if status != 0:
            W.counts.status = status
            return status
    else:
        update_positions(S, W, t, q, z)
        update_velocities(S, W, t, v, z)
    return accelerate(S, W, t, p, dy, factored)


@formula
def project_and_evaluate(t, y, dy, S, W):
    """Project the state y in place, to rounding, and evaluate there. Returns (0 or status, relative violation)."""
    nq = S.sizes.coordinates
    q = y[:nq]
    v = y[nq : nq + W.velocities.solved.shape[0]]
    z = y[nq + W.velocities.solved.shape[0] :]
    astray_by = prescribed_deviation(S, W, t, q, v)
    found = 0.0
    factored = FACTOR_OLD
    fault = W.stack.shape[0] - STACK_RESERVE
    if W.stack[fault, 0].real > 0.0:  # overcome: the step with the fault was repeated with a shorter one
        W.stack[fault, 0] = -W.stack[fault, 0]
    set_prescribed(S, W, t, q, v)
    if W.options.stabilization >= STEPS:
        status, found, factored = project_state(S, W, t, q, v, z, TIGHT_G * S.scales.length, TIGHT_V)
        if status != 0:
            W.counts.status = status
            return status, found
        found = max(0.0, found - position_rounding(S, W, q) / S.scales.length)
        if W.options.partitioned > 0.0:
            exchange_coordinates(S, W)
    else:
        update_positions(S, W, t, q, z)
        update_velocities(S, W, t, v, z)
        update_shown_frames(S, W, q)
    remember(S, W, z)
    if W.options.placed > 0.0:
        return 0, max(found, astray_by)
    return accelerate(S, W, t, y, dy, factored), max(found, astray_by)


@formula
def report_state(t, y, out, S, W):
    """Write t, the state (projected first), vdot and lam to a row of the output.

    Where accelerations are deferred, vdot and lam are not written.
    """
    W.options.placed = W.options.deferred
    status, _ = project_and_evaluate(t, y, W.trial.rate, S, W)
    W.options.placed = 0.0
    write_row(t, y, out, S, W)
    return status


@formula
def write_row(t, y, out, S, W):
    """Write t, the state y at which W was last evaluated, vdot, lam and the efforts of prescribed coordinates."""
    nq = S.sizes.coordinates
    nv = W.velocities.solved.shape[0]
    ny = y.shape[0]
    if S.rows.law.shape[0] > 0:
        W.options.position_violation = max(W.options.position_violation, position_violation(S, W, W.rows.scratch_2))
        W.options.velocity_violation = max(
            W.options.velocity_violation, velocity_violation(S, W, y[nq : nq + nv], W.rows.scratch_2)[0]
        )
    out[0] = t
    for i in range(ny):
        out[1 + i] = y[i]
    for d in range(nv):
        out[1 + ny + d] = W.velocities.solved[d]
    to = 1 + ny + nv
    for k in range(S.rows.law.shape[0]):
        out[to + k] = W.rows.multiplier[k]
    to += S.rows.law.shape[0]
    for b in range(S.tree.parent.shape[0]):
        if S.tree.law[b] >= 0:
            out[to] = W.velocities.effort[S.tree.v[b]]
            to += 1


STEP_REMAINDER = 1.0 - 1e-6
LAW_TOLERANCE = 1e-6  # relative deviation of a law's change from the integral of its derivatives that is accepted
JUMP_WIDTH, JUMP_SLOPE = (
    1e-10,
    10.0,
)  # a jump is a change within this fraction of the time span by more than this factor times the slope
TINY_CHANGE, TINY_RATE = (
    1e-12,
    1e-9,
)  # negligible changes of laws: relative to the mechanism's size, and to that per time span
FAR_PREDICTION = 1e-2  # a relative error of the predicted positions or velocities above this: the step was too long


@formula
def follow_drivers(S, W, c, out):
    """Continue the prescribed motion until the end, or until ``out`` is full or the quota is used.

    ``c`` is the integrator state; rows 0 and 1 of ``c.K`` hold the derivatives now and at the step before. Returns the
    number of rows written.
    """
    used = 0
    c.count.status = RUNNING
    if c.count.started == 0:
        status, _ = project_and_evaluate(c.real.t, c.y[0], c.K[0], S, W)
        if status != 0:
            c.count.status = STEP_FAILED
            return used
        write_prescribed_row(c, out[used], S, W)
        used += 1
        c.count.started = 1
        c.real.h = 0.0
        c.real.max_growth = 1.0
        while c.count.next < c.times.shape[0] and c.times[c.count.next] <= c.real.t:
            c.count.next += 1
    steps = 0
    while c.real.t < c.real.t_end:
        if used == out.shape[0] or steps >= c.count.quota:
            return used
        if c.count.accepted + c.count.rejected >= c.count.limit:
            c.count.status = TOO_MANY_STEPS
            return used
        goal = c.times[c.count.next] if c.count.next < c.times.shape[0] else c.real.t_end
        left = goal - c.real.t
        h = c.real.max_growth * min(left, c.real.h_max)
        lands = h > STEP_REMAINDER * left  # no tiny remainder is left for the next step
        if lands:
            h = left
        if h < 1e-14 * max(abs(c.real.t), c.real.largest):
            c.count.status = STEP_FAILED
            return used
        t = goal if lands else c.real.t + h
        predict_state(S, c, h)
        status, found = project_and_evaluate(t, c.y[1], c.K[2], S, W)
        steps += 1
        if status != 0 or not found <= FAR_PREDICTION or any_law_jumps(S, W, c.real.t, h, c.real.largest):
            c.count.rejected += 1
            c.real.max_growth *= 0.5
            continue
        accept_prescribed_step(c, t, h)
        write_prescribed_row(c, out[used], S, W)
        used += 1
        if t >= goal:
            c.count.next += 1
        c.real.max_growth = min(1.0, 2.0 * c.real.max_growth)
    c.count.status = DONE
    return used


@formula
def any_law_jumps(S, W, t, h, span):
    """Whether a driver's law may jump or have a kink within a step: its derivatives do not explain its change."""
    for b in range(S.tree.parent.shape[0]):
        law = S.tree.law[b]
        if law >= 0 and law_jumps(S, W, law, t, h, span, S.tree.joint[b] == REVOLUTE):
            return True
    for k in range(S.rows.law.shape[0]):
        law = S.rows.law[k]
        if law >= 0 and law_jumps(S, W, law, t, h, span, S.rows.wrapped[k] == 1):
            return True
    return False


@formula
def law_jumps(S, W, law, t, h, span, turns):
    """Whether value and rate of a law change over a step by something else than the integral of their derivatives.

    By Hermite's and Simpson's rules, to `LAW_TOLERANCE`. Over a step that cannot be much shorter: by more than the
    largest derivatives allow.
    """
    if is_entire(S.code, law):
        return False
    f0, v0, a0 = evaluate_jet(S.code, S.const, law, W.stack, t, W.sensed, BY_TIME)
    _, vm, am = evaluate_jet(S.code, S.const, law, W.stack, t + 0.5 * h, W.sensed, BY_TIME)
    f1, v1, a1 = evaluate_jet(S.code, S.const, law, W.stack, t + h, W.sensed, BY_TIME)
    way = f1 - f0 - h / 30.0 * (7.0 * v0 + 16.0 * vm + 7.0 * v1) - h * h / 60.0 * (a0 - a1)
    size = S.scales.length
    if turns:
        way = atan2(sin(way), cos(way))
        size = 0.0 * size + 1.0
    rate = v1 - v0 - h / 6.0 * (a0 + 4.0 * am + a1)
    v = max(magnitude(v0), magnitude(vm), magnitude(v1))
    a = max(magnitude(a0), magnitude(am), magnitude(a1))
    part = LAW_TOLERANCE if h > JUMP_WIDTH * span else JUMP_SLOPE
    as_told = magnitude(way) <= part * h * (v + h * a) + TINY_CHANGE * (magnitude(f0) + magnitude(f1) + size)
    return not (as_told and magnitude(rate) <= LAW_TOLERANCE * v + part * h * a + TINY_RATE * size / span)


@formula
def predict_state(S, c, h):
    """Predict the state after h in c.y[1]: velocities by the cubic through the last two, positions by its integral."""
    nq = S.sizes.coordinates
    y, new, now, before = c.y[0], c.y[1], c.K[0], c.K[1]
    last = c.real.h
    way = c.y[2]
    for i in range(y.shape[0]):
        new[i] = y[i]
    nv = S.tree.v[-1] + S.tree.nv[-1]
    u = 1.0 + h / last if last > 0.0 else 1.0
    a, b, d = u * u, u * u * u, u * u * u * u
    for i in range(nv):
        v, vdot = y[nq + i], now[nq + i]
        if last > 0.0:
            # Hermite's cubic in u = (t - t0) / last through (v, vdot) at u = 0 and u = 1, and its integral from u = 1
            v0, vdot0 = c.K[3, nq + i], before[nq + i]
            new[nq + i] = (
                (2.0 * b - 3.0 * a + 1.0) * v0
                + (b - 2.0 * a + u) * last * vdot0
                + (3.0 * a - 2.0 * b) * v
                + (b - a) * last * vdot
            )
            way[i] = last * (
                (0.5 * d - b + u - 0.5) * v0
                + (0.25 * d - 2.0 / 3.0 * b + 0.5 * a - 1.0 / 12.0) * last * vdot0
                + (b - 0.5 * d - 0.5) * v
                + (0.25 * d - b / 3.0 + 1.0 / 12.0) * last * vdot
            )
        else:
            new[nq + i] = v + h * vdot
            way[i] = h * v + 0.5 * h * h * vdot
    retract(S, new[:nq], way)
    for i in range(nq + nv, y.shape[0]):
        new[i] = y[i] + h * now[i]


@formula
def write_prescribed_row(c, out, S, W):
    """Write a row of the output at the present state, with powers in place of works."""
    write_row(c.real.t, c.y[0], out, S, W)
    for k in range(c.integrals.shape[0]):
        out[1 + c.integrals[k]] = c.K[0, c.integrals[k]]


@formula
def accept_prescribed_step(c, t, h):
    """Replace the present state by the trial state."""
    for i in range(c.y.shape[1]):
        c.K[1, i] = c.K[0, i]
        c.K[3, i] = c.y[0, i]
        c.K[0, i] = c.K[2, i]
        c.y[0, i] = c.y[1, i]
    c.real.h = h
    c.real.t = t
    c.count.accepted += 1
