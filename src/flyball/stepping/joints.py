"""The mechanism in a step by impulses, behind a door: what the loop of steps asks of it, one task after the other."""

from __future__ import annotations

from ..compiler.formulas import call, formula
from ..compiler.kernels import kernel
from ..contact.tables import Contacts, Movers
from ..equations.rows import row_times
from ..equations.tasks import ARRIVE, MOTION, POSITION, SOLVE
from ..equations.tree import retract
from ..math.vec import load3, load9, put3, put9
from ..numerics.cone.problem import Problem, State
from ..tables.system import (
    SCHUR,
)
from .contact_rows import contact_rows
from .gauges import put_right
from .implicit import dot_rows, implied, respond
from .joined import (
    ADDED,
    BEGIN,
    CHANGE,
    CONSISTENT,
    EFFORTS,
    FINISH,
    FREE,
    IMPULSE,
    KEEP,
    KICKED,
    MEAN,
    POSES,
    ROWS,
    SMOOTH,
    SPRING_C,
    SPRING_OF,
    START,
    STRUCK,
    V_AFTER,
    V_BEFORE,
    VELOCITIES,
    WAY,
    Joined,
)
from .ledger import kinetic, reactions_work, settle_account, weigh_mean
from .lines import lines_done, press, stops_only
from .smooth import free_velocities, put_aside

BARELY = 1e-12  # part of the velocities that is no change of them


@formula
def ask(A, M, C, P, X, task):
    """One task of `joined`."""
    if task == START:
        return start(A, M, X)
    if task == FREE:
        return free(A, M, X)
    if task == BEGIN:
        for d in range(A.wide.shape[1]):
            X.wide[d] = A.wide[V_BEFORE, d] + A.wide[CHANGE, d]
        for k in range(P.size[3]):
            X.line[k] = 0.0
        return 0
    if task == ROWS:
        return contact_rows(A, M, C, P)
    if task == KEEP:
        keep(A, P, X)
        return 0
    if task == MEAN:
        for i in range(A.S.sizes.coordinates):  # at half the step, from where FINISH goes on
            A.clock.y[2, i] = A.clock.y[0, i]
        for d in range(A.wide.shape[1]):
            X.wide[d] = 0.5 * (A.wide[V_BEFORE, d] + A.wide[V_AFTER, d])
        stops_only(A, P, X)
        return 0
    if task == FINISH:
        return finish(A, M, X)
    if task == POSES:
        show(A, M, True)
        return 0
    if task == CONSISTENT:
        make_consistent(A, X)
        return 0
    if task == KICKED:
        for d in range(A.wide.shape[1]):
            A.wide[IMPULSE, d] = 0.0
        contact_impulses(A, P, X, A.wide[IMPULSE])
        respond(A, A.wide[IMPULSE], A.wide[STRUCK])
        for d in range(A.wide.shape[1]):
            A.wide[WAY, d] = 0.5 * (A.wide[V_BEFORE, d] + X.wide[d])
        reactions_work(A, A.sheet.rows[3], A.wide[WAY])
        for r in range(A.lam.shape[1]):
            A.lam[2, r] += A.sheet.rows[3, r]
    if task == VELOCITIES:
        A.real.time += A.real.step
        A.count.begun = 0
        settle_account(A)
        for d in range(A.wide.shape[1]):
            X.wide[d] = A.clock.y[0, A.S.sizes.coordinates + d]
    return 0


@formula
def make_consistent(A, X):
    """Velocities before an impact made those that joints allow at half the step, where the rows are.

    Those of the start of the step are none by what joints turn in half of it. Impulses of contacts along which nothing
    can move do not end such a part, and where friction jams they would grow without bound.
    """
    rows = A.sheet.rows
    for d in range(A.wide.shape[1]):
        rows[0, d] = 0.0
    for r in range(A.S.rows.law.shape[0]):
        rows[1, r] = A.W.rows.nu[r] - row_times(A.S, A.W, r, X.wide)
    call(A.door[0], A.S, A.W, A.R, A.clock, A.sheet, SOLVE)
    for d in range(A.wide.shape[1]):
        A.wide[WAY, d] = X.wide[d] + 0.5 * rows[2, d]
        X.wide[d] += rows[2, d]
        A.wide[V_BEFORE, d] = X.wide[d]
    for r in range(A.S.rows.law.shape[0]):
        A.real.astray -= rows[3, r] * row_times(A.S, A.W, r, A.wide[WAY])


@formula
def start(A, M, X):
    """Evaluate where the motion begins, which must be on the constraints: accelerations, multipliers, efforts."""
    A.count.begun = 0
    A.clock.real.t = A.real.time
    status = call(A.door[0], A.S, A.W, A.R, A.clock, A.sheet, MOTION)
    put_aside(A, A.real.step)
    nq = A.S.sizes.coordinates
    for d in range(A.wide.shape[1]):
        X.wide[d] = A.wide[V_BEFORE, d] = A.wide[V_AFTER, d] = A.clock.y[0, nq + d]
        A.wide[STRUCK, d] = 0.0
    for r in range(A.lam.shape[1]):
        A.lam[1, r] = A.lam[2, r] = 0.0
    press(A)
    show(A, M, True)
    A.real.kinetic = -1.0
    settle_account(A)
    return status


@formula
def free(A, M, X):
    """Velocities without contact, from those in State.wide; asked once more it begins at the same place again."""
    y, nq = A.clock.y, A.S.sizes.coordinates
    if A.count.begun == 0:
        for i in range(y.shape[1]):
            y[1, i] = y[0, i]
        for r in range(A.lam.shape[1]):
            A.lam[2, r] = 0.0
        A.count.begun = 1
    for i in range(y.shape[1]):
        y[0, i] = y[1, i]
    for d in range(A.wide.shape[1]):
        y[0, nq + d] = X.wide[d]
    status = free_velocities(A)
    show(A, M, False)
    return status


@formula
def show(A, M, poses):
    """Velocities of the bodies for what looks for contacts, and poses if these are asked for, as last evaluated."""
    for k in range(A.mover.shape[0]):
        b, to = A.mover[k, 0], A.count.first + k
        if poses:
            put3(M.pose, to, 0, load3(A.W.BK, b, 0))
            put9(M.pose, to, 3, load9(A.W.BK, b, 3))
        put3(M.twist, to, 0, load3(A.W.BK, b, 15))
        put3(M.twist, to, 3, load3(A.W.BK, b, 12))


@formula
def keep(A, P, X):
    """Velocities after the step, from the impulses that were found; what these do to joints and drivers.

    They follow from one solve for all impulses: joints are exact to rounding, whatever the cone solver left.
    """
    nv, h = A.wide.shape[1], A.real.step
    before, total = A.wide[V_BEFORE], A.wide[IMPULSE]
    for d in range(nv):
        total[d] = 0.0
        A.wide[WAY, d] = X.wide[d] - before[d] - A.wide[CHANGE, d]
    contact_impulses(A, P, X, total)
    for i in range(A.count.springs):
        s = implied(A, h, i, before, A.wide[CHANGE])
        s += A.spring_x[i, ADDED] * dot_rows(A.spring_J[i], A.wide[WAY])
        for d in range(nv):
            total[d] -= s * A.spring_J[i, d]
    respond(A, total, A.wide[STRUCK])
    for r in range(A.lam.shape[1]):
        A.lam[1, r] = A.sheet.rows[3, r]
    for d in range(nv):
        A.wide[EFFORTS, d] += A.W.velocities.effort[d] / h
        A.wide[V_AFTER, d] = before[d] + A.wide[SMOOTH, d] + A.wide[STRUCK, d]
        A.wide[STRUCK, d] = A.wide[V_AFTER, d] - before[d] - A.wide[CHANGE, d]  # by contact and lines
    for d in range(nv):
        A.wide[WAY, d] = 0.5 * (before[d] + A.wide[V_AFTER, d])
    reactions_work(A, A.lam[1], A.wide[WAY])
    account(A, h)
    lines_done(A, P, X)
    turn_on(A, h)
    for d in range(nv):
        X.wide[d] = A.wide[V_AFTER, d]


@formula
def struck(A):
    """Whether contact or lines changed the velocities."""
    size, change = 1e-300, 0.0
    for d in range(A.wide.shape[1]):
        size = max(size, abs(A.wide[V_BEFORE, d]) + abs(A.wide[V_AFTER, d]))
        change = max(change, abs(A.wide[STRUCK, d]))
    return change > BARELY * size


@formula
def evaluate_again(A, part):
    """Evaluate at half the step once more, at the mean velocities with a part of what impacts changed."""
    nq = A.S.sizes.coordinates
    for d in range(A.wide.shape[1]):
        mean = A.wide[V_BEFORE, d] + 0.5 * A.wide[CHANGE, d]
        A.clock.y[0, nq + d] = mean + part * A.wide[STRUCK, d]
    return call(A.door[0], A.S, A.W, A.R, A.clock, A.sheet, MOTION)


@formula
def turn_on(A, h):
    """Velocity-dependent forces of the second half of the step at velocities after impacts, in joint coordinates.

    Coriolis' terms make up for masses that change along the way: with those of the velocities before, impacts would
    give energy. In absolute coordinates the projection that ends the step does that.
    """
    y, z = A.clock.y, A.S.sizes.coordinates + A.wide.shape[1]
    if A.S.sizes.solver == SCHUR or not struck(A):
        return
    for i in range(z, y.shape[1]):
        y[2, i] = A.clock.K[0, i]
    if evaluate_again(A, 1.0) == 0:
        for d in range(A.wide.shape[1]):
            vdot = A.clock.K[0, A.S.sizes.coordinates + d]
            A.wide[V_AFTER, d] += 0.5 * (h * vdot - A.wide[SMOOTH, d])
        for i in range(A.count.springs):  # their dampers are taken at the velocities after impacts already
            s = 0.5 * h * A.spring_x[i, SPRING_C] * dot_rows(A.spring_J[i], A.wide[STRUCK])
            for d in range(A.wide.shape[1]):
                A.wide[V_AFTER, d] += s * A.spring_Y[i, d]
    for i in range(z, y.shape[1]):
        A.clock.K[0, i] = y[2, i]


@formula
def contact_impulses(A, P, X, total):
    """Add the generalised impulses of all contacts and lines."""
    for c in range(P.size[0]):
        for side in range(2):
            at = P.block[c, side]
            if P.at[c, side] <= -2 and at >= 0:
                g = -2 - P.at[c, side]
                a = A.group[g]
                n = A.group[g + 1] - a
                sign = 1.0 if side == 1 else -1.0
                for i in range(6 if P.turn.shape[0] > 0 else 3):
                    s = sign * (X.p[c, i] if i < 3 else X.torque[c, i - 3])
                    for d in range(n):
                        total[a + d] += s * P.J[at + i * n + d]
    for k in range(P.size[3]):
        g, at = P.line_at[k, 0], P.line_at[k, 1]
        for d in range(A.group[g + 1] - A.group[g]):
            total[A.group[g] + d] += X.line[k] * P.J[at + d]


@formula
def account(A, h):
    """Rates of the works over the step, in the clock: forces at the mean velocities, drivers with all they gave."""
    S, W = A.S, A.W
    if struck(A):
        evaluate_again(A, 0.5)
    weigh_mean(A, h)
    work = A.clock.K[0, S.sizes.coordinates + A.wide.shape[1] :]
    for r in range(S.rows.law.shape[0]):
        if S.rows.work[r] >= 0:
            work[S.rows.work[r]] = (A.lam[0, r] + A.lam[1, r] / h) * W.rows.nu[r]
    for b in range(S.tree.parent.shape[0]):
        if S.tree.law[b] >= 0:
            d = S.tree.v[b]
            mean = 0.5 * (A.wide[V_BEFORE, d] + A.wide[V_AFTER, d])
            work[S.tree.work[b]] = A.wide[EFFORTS, d] * mean
    for d in range(A.wide.shape[1]):
        A.wide[WAY, d] = A.wide[V_AFTER, d] - A.wide[V_BEFORE, d]
    for i in range(A.count.springs):
        k = int(A.spring_x[i, SPRING_OF])
        if S.forces.work[k] >= 0:
            rate = dot_rows(A.spring_J[i], A.wide[V_BEFORE]) + 0.5 * dot_rows(A.spring_J[i], A.wide[WAY])
            work[S.forces.work[k]] -= implied(A, h, i, A.wide[V_BEFORE], A.wide[WAY]) / h * rate


@formula
def put_aside_poses(A):
    """Poses of the movers as evaluated last."""
    for k in range(A.mover.shape[0]):
        put3(A.pose, k, 0, load3(A.W.BK, A.mover[k, 0], 0))
        put9(A.pose, k, 3, load9(A.W.BK, A.mover[k, 0], 3))


@formula
def moved(lifts):
    """Whether there are any."""
    found = False
    for d in range(lifts.shape[0]):
        found = found or lifts[d] != 0.0
    return found


@formula
def finish(A, M, X):
    """Go on with the mean velocities and those in State.wide beside them, onto the constraints. Returns a status.

    It may be asked again, with others beside them.
    """
    S, nq, nv, h = A.S, A.S.sizes.coordinates, A.wide.shape[1], A.real.step
    y, way = A.clock.y, A.wide[WAY]
    for d in range(nv):
        way[d] = 0.5 * h * A.wide[V_AFTER, d] + h * X.wide[d]
        y[0, nq + d] = A.wide[V_AFTER, d]
    for i in range(nq):
        y[0, i] = y[2, i]
    retract(S, y[0, :nq], way)
    for i in range(nq + nv, y.shape[1]):
        y[0, i] = y[1, i] + h * A.clock.K[0, i]
    A.clock.real.t = A.real.time + h
    put_right(A)
    A.real.kinetic = -1.0
    if struck(A) or moved(X.wide):
        call(A.door[0], S, A.W, A.R, A.clock, A.sheet, POSITION)
        A.real.kinetic = kinetic(A)
        put_aside_poses(A)
    A.W.options.placed = 1.0
    status = call(A.door[0], S, A.W, A.R, A.clock, A.sheet, ARRIVE)
    A.W.options.placed = 0.0
    if status != 0:
        return status
    call(A.door[0], S, A.W, A.R, A.clock, A.sheet, POSITION)
    show(A, M, True)
    return 0


@kernel
def joined(A: Joined, M: Movers, C: Contacts, P: Problem, X: State, task: int) -> int:
    """The mechanism: ``A`` as `Joined`, then movers, contacts, problem and state of the step; see ``joined.py``.

    Returns 0, NO_ROOM, or the engine's status.
    """
    return ask(A, M, C, P, X, task)
