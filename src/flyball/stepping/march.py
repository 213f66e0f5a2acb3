"""The loop of steps by impulses: search, solve, displace; everything large is behind doors, called by address."""

from __future__ import annotations

from ..compiler.formulas import call, formula
from ..compiler.kernels import kernel
from ..contact.broad.desk import Search
from ..contact.broad.search import FASTER, MIDWAY
from ..contact.broad.search import STEP as STEP_ON
from ..contact.surfaces import Surfaces
from ..contact.tables import (
    AHEAD,
    BEFORE,
    DONE,
    FOUND,
    FULL_CONTACTS,
    GAP,
    NORMAL,
    NUMBER,
    POINT,
    Contacts,
    Geometry,
    Movers,
)
from ..math.vec import load3, put3
from ..numerics.cone.operator import push, seen
from ..numerics.cone.problem import (
    CONVERGED,
    Choices,
    Problem,
    Scratch,
    State,
)
from .bounce import ROUNDS, bounce, hits, no_kicks
from .joined import (
    BEGIN,
    CONSISTENT,
    FINISH,
    FREE,
    KEEP,
    KICKED,
    MEAN,
    NO_ROOM,
    NO_WAY,
    POSES,
    ROWS,
    TOO_LONG,
    Joined,
)
from .joined import VELOCITIES as VELOCITIES_AFTER
from .lifts import PASSES as AGAIN
from .lifts import sunk
from .motion import begin, displace, fall, halfway, rest
from .onward import begin_contacts, half_on, keep_start, kicked, lead, middle_rows, put_back_poses
from .penalty import FEW, PASSES, aim, find_yielding, linearise, put_back, settled, start_rows, store
from .record import book, book_turning
from .rows import fill_rows, sides, static_where_stuck, warm
from .solvers import Solvers
from .tables import (
    CUTS,
    ENDLESS,
    ENOUGH_V,
    ENOUGH_X,
    FIRST_OVERLAP,
    FLAT,
    GIVEN,
    GOES_ON,
    HIT,
    IMPACTS,
    ITERATIONS,
    JOINTS,
    KICK,
    LAST_STEP,
    LEFT,
    LEFT_OVER,
    LIFTS,
    LOST_FRICTION,
    LOST_IMPACT,
    MIDDLE,
    MOST_CONTACTS,
    NUMERICAL,
    POSITIONS,
    REDUCED,
    ROUGH,
    SEARCHING,
    STEP,
    STIFF,
    SWEEPS,
    TAKEN,
    TIME,
    VELOCITIES,
    WORST_AT,
    WORST_FORCE,
    WORST_OVERLAP,
    WORST_RESIDUAL,
    YIELDING,
    Free,
    Pace,
    Tracks,
)


@formula
def solved(address, P, X, W, O, F, pace, most, enough):
    """Go through a solver's door; keeps what came of it."""
    O.count.most = most
    O.real.enough = enough
    pace.count[ITERATIONS] += call(address, P, X, W, O, F, 0)
    return O.count.ended


@formula
def held_by_joints(A, M, C, P, X, pace, task):
    """Ask something of the mechanism, if there is one; see ``joined.py``."""
    if pace.door[JOINTS] == 0:
        return DONE
    return call(pace.door[JOINTS], A, M, C, P, X, task)


@formula
def without_contact(A, M, C, P, X, N, pace):
    """Velocities that bodies would have at the end of the step if nothing touched."""
    fall(N, M, P, X, pace)
    A.real.time, A.real.step = pace.real[TIME], pace.real[STEP]
    return held_by_joints(A, M, C, P, X, pace, FREE)


@formula
def velocities(G, A, C, P, X, W, O, F, N, M, L, pace, now, before):
    """Velocities at the end of the step: the cone problem, and its residual into the sums.

    Returns DONE, or TOO_LONG for contacts that give way, before anything is solved.
    """
    warm(C, P, X, now, before)
    static_where_stuck(G, C, P, L, X, pace, now)
    yielding = pace.count[YIELDING] != 0 and find_yielding(G, C, P, L, X, pace, now, before)
    begin(N, M, X)
    held_by_joints(A, M, C, P, X, pace, BEGIN)
    if yielding and start_rows(G, C, P, L, X, pace, now, before):
        return TOO_LONG
    ended = solved(pace.door[VELOCITIES], P, X, W, O, F.velocities, pace, pace.count[SWEEPS], pace.real[ENOUGH_V])
    for n in range(PASSES if yielding else 0):
        if settled(linearise(G, C, P, L, X, pace, now), O.real.residual, pace) or (ended != CONVERGED and n == FEW):
            break
        put_back(N, M, X)
        held_by_joints(A, M, C, P, X, pace, BEGIN)
        ended = solved(pace.door[VELOCITIES], P, X, W, O, F.velocities, pace, pace.count[SWEEPS], pace.real[ENOUGH_V])
    if ended != CONVERGED and O.real.residual > pace.real[ROUGH] * pace.real[STEP]:
        pace.count[CUTS] += 1
    pace.real[LEFT_OVER] = O.real.residual
    if O.real.residual > pace.real[WORST_RESIDUAL]:
        pace.real[WORST_RESIDUAL] = O.real.residual
        pace.real[WORST_AT] = pace.real[TIME] + pace.real[STEP]
    pace.real[WORST_FORCE] = max(pace.real[WORST_FORCE], O.real.force_residual)
    held_by_joints(A, M, C, P, X, pace, KEEP)
    return DONE


@formula
def positions(G, A, M, C, P, Q, R, X, Y, W, O, F, N, L, pace, now):
    """Displacements that leave no overlap, and no gap of what goes on, from those of the mean velocities.

    See ``motion.displace``.

    min 1/2 d' M d over d with gap + h n . (u(v+ + move) + u(d)) >= 0: the cone problem without friction. On the way
    impulses are booked, since the mean velocities are at hand.
    """
    h = pace.real[STEP]
    halfway(N, X, Y)
    held_by_joints(A, M, C, P, Y, pace, MEAN)
    deepest = A.real.overrun if pace.door[JOINTS] != 0 else 0.0
    for c in range(C.count[FOUND]):
        u = seen(P, Y.v, Y.wide, c)
        gap = C.x[c, GAP] + h * u[0]
        if now[c, STIFF] > 0.0:
            gap = aim(now, c, gap)
        else:
            pace.real[WORST_OVERLAP] = min(pace.real[WORST_OVERLAP], C.x[c, GAP])
        deepest = min(deepest, -abs(gap) if now[c, GOES_ON] == MIDDLE else gap)
        Q.bias[c, 0] = R.bias[c, 0] = gap / h
        book(P, X, c, u, pace, now)
        if P.turn.shape[0] > 0:
            book_turning(P, X, Y, c, pace, now)
        for i in range(3):
            Y.p[c, i] = 0.0
    if pace.count[TAKEN] == 0:
        pace.real[FIRST_OVERLAP] = pace.real[WORST_OVERLAP]
    rest(Y)
    if deepest < -pace.real[FLAT]:
        hold_down(C, P, X, Y, now)
        Q.size[0] = C.count[FOUND]
        solved(pace.door[POSITIONS], Q, Y, W, O, F.positions, pace, pace.count[LIFTS], pace.real[ENOUGH_X])
    if pace.count[YIELDING] != 0:
        store(G, C, P, L, X, Y, pace, now)


@formula
def hold_down(C, P, X, Y, now):
    """Let displacements close gaps of the contacts that go on: as far as these press, which is what they start from."""
    for c in range(C.count[FOUND]):
        if now[c, GOES_ON] == MIDDLE:
            push(P, Y.v, Y.wide, c, (-X.p[c, 0], 0.0, 0.0))
            Y.p[c, 0] = X.p[c, 0]


@formula
def onto_joints(G, A, M, C, P, Q, R, X, Y, W, O, F, pace, now):
    """End the mechanism's step on its joints, and lift again where that made contacts overlap. Returns a status."""
    for n in range(AGAIN + 1):
        if held_by_joints(A, M, C, P, Y, pace, FINISH) != DONE:
            return NO_WAY
        if pace.door[JOINTS] == 0 or pace.count[YIELDING] != 0 or n == AGAIN:
            break
        if not sunk(G, A, M, C, P, Q, Y, R.bias, pace):
            break
        rest(Y)
        hold_down(C, P, X, Y, now)
        solved(pace.door[POSITIONS], Q, Y, W, O, F.positions, pace, pace.count[LIFTS], pace.real[ENOUGH_X])
    return DONE


@formula
def ledger(A, pace):
    """Energies that contacts, stops and joints exchanged so far, and those that the method took; counts of impacts."""
    real, count = pace.real, pace.count
    energies = real[LOST_IMPACT], real[LOST_FRICTION], real[GIVEN], real[NUMERICAL], A.real.lost, A.real.astray
    return energies, (count[IMPACTS], count[REDUCED], count[ENDLESS])


@formula
def back(N, M, A, X, pace, sums):
    """Poses, velocities, energies and counts of the start of the step again, before its impacts."""
    put_back_poses(N, M)
    for k in range(N.body.shape[0]):
        for i in range(6):
            X.v[k, i] = N.start[k, 12 + i]
    for d in range(X.wide.shape[0]):
        X.wide[d] = A.clock.y[1, A.S.sizes.coordinates + d]
    for r in range(A.lam.shape[1]):
        A.lam[2, r] = 0.0
    real, count = pace.real, pace.count
    energies, counts = sums
    real[LOST_IMPACT], real[LOST_FRICTION], real[GIVEN], real[NUMERICAL], A.real.lost, A.real.astray = energies
    count[IMPACTS], count[REDUCED], count[ENDLESS] = counts


@formula
def search_again(G, M, C, H, B, Z, pace, now):
    """Contacts with the velocities after impacts, which may meet what nothing moved towards before. Returns a status.

    What was hit, and is none any more or has another normal or place, stays a contact: its impulse acts where it did.
    """
    status, most = call(pace.door[SEARCHING], G, M, H, C, B, FASTER), H.at.shape[0]
    n = H.count[FOUND]
    if status != DONE:
        C.count[FOUND] = n
        return status
    C.count[NUMBER] = H.count[NUMBER]
    for k in range(n):
        o = H.at[k, BEFORE]
        same = o >= 0 and not (kicked(now, o) and moved(C, o, H, k))
        put3(Z.p, k, 0, load3(now, o, KICK) if same else (0.0, 0.0, 0.0))
        if same:
            now[o, HIT] = -1.0
        if o >= 0:
            H.at[k, BEFORE] = C.at[o, BEFORE]
    for o in range(C.count[FOUND]):
        if kicked(now, o) and now[o, HIT] >= 0.0:
            if n < most:
                put3(Z.p, n, 0, load3(now, o, KICK))
                copy_contact(C, o, H, n)
                H.at[n, BEFORE] = -1
            n += 1
    if n > most:
        C.count[FOUND] = n
        return FULL_CONTACTS
    for k in range(n):
        copy_contact(H, k, C, k)
        put3(now, k, KICK, load3(Z.p, k, 0))
    C.count[FOUND] = n
    return DONE


@formula
def moved(C, o, H, k):
    """Whether contact k of H has another normal or place than contact o of C."""
    return load3(C.x, o, NORMAL) != load3(H.x, k, NORMAL) or load3(C.x, o, POINT) != load3(H.x, k, POINT)


@formula
def copy_contact(C, c, H, k):
    """Contact c of C becomes contact k of H."""
    for i in range(C.at.shape[1]):
        H.at[k, i] = C.at[c, i]
    for i in range(C.x.shape[1]):
        H.x[k, i] = C.x[c, i]


@formula
def impacts(G, A, M, C, H, B, P, R, X, Z, E, W, O, F, N, L, pace, now):
    """Impacts until nothing more is hit: what is hit may hit what is near. Returns a status."""
    no_kicks(C, now)
    for _ in range(ROUNDS):
        if not hits(G, C, P.at, P.bias, R, X, L, pace, now):
            return DONE
        if pace.door[JOINTS] != 0:
            held_by_joints(A, M, C, P, X, pace, CONSISTENT)
            hits(G, C, P.at, P.bias, R, X, L, pace, now)
        bounce(G, C, P.bias, R, Z, E, X, W, O, F, L, pace, now)
        held_by_joints(A, M, C, P, Z, pace, KICKED)
        if without_contact(A, M, C, P, X, N, pace) != DONE:
            return NO_WAY
        status = search_again(G, M, C, H, B, Z, pace, now)
        if status != DONE:
            return status
        fill_rows(G, M, C, P, L, pace)
        if held_by_joints(A, M, C, P, X, pace, ROWS) != DONE:
            return NO_ROOM
    pace.count[ENDLESS] += 1
    return DONE


@formula
def onward(G, A, M, C, D, H, B, N, P, X, L, pace, now, before, hit):
    """Contacts that go on, with their rows in the middle of the step; see ``onward.py``. Returns a status.

    hit: whether there were impacts.
    """
    if not begin_contacts(G, M, C, D, N, P, X, L, pace, now, before, (A.count.first, hit)):
        return DONE
    half_on(N, M, X, pace.real[STEP])
    held_by_joints(A, M, C, P, X, pace, POSES)
    status = call(pace.door[SEARCHING], G, M, H, C, B, MIDWAY)
    found = status == DONE and middle_rows(G, M, C, H, P, L, now)
    put_back_poses(N, M)
    if status != DONE:
        C.count[FOUND] = H.count[FOUND]
        return status
    if found:
        for c in range(C.count[FOUND]):
            P.at[c, 0], P.at[c, 1] = sides(G, C, c)
        held_by_joints(A, M, C, P, X, pace, ROWS)
        lead(G, M, C, P, X, now, before)
    return DONE


@formula
def step(G, A, M, C, D, H, B, P, Q, R, X, Y, Z, E, W, O, F, N, L, pace, now, before):
    """One step of time; where it cannot be taken, for what is returned, everything is as it was at its start."""
    keep_start(N, M, X)
    sums = ledger(A, pace)
    status = taken(G, A, M, C, D, H, B, P, Q, R, X, Y, Z, E, W, O, F, N, L, pace, now, before)
    if status != DONE:
        back(N, M, A, X, pace, sums)
    return status


@formula
def taken(G, A, M, C, D, H, B, P, Q, R, X, Y, Z, E, W, O, F, N, L, pace, now, before):
    """Impacts, velocities, and the way, for `step`; a status."""
    if without_contact(A, M, C, P, X, N, pace) != DONE:
        return NO_WAY
    B.real[AHEAD] = pace.real[STEP]
    status = call(pace.door[SEARCHING], G, M, C, D, B, STEP_ON)
    if status != DONE:
        return status
    fill_rows(G, M, C, P, L, pace)
    if held_by_joints(A, M, C, P, X, pace, ROWS) != DONE:
        return NO_ROOM
    before_impacts = pace.count[IMPACTS]
    status = impacts(G, A, M, C, H, B, P, R, X, Z, E, W, O, F, N, L, pace, now)
    if status != DONE:
        return status
    status = onward(G, A, M, C, D, H, B, N, P, X, L, pace, now, before, pace.count[IMPACTS] > before_impacts)
    if status != DONE:
        return status
    status = velocities(G, A, C, P, X, W, O, F, N, M, L, pace, now, before)
    if status != DONE:
        return status
    positions(G, A, M, C, P, Q, R, X, Y, W, O, F, N, L, pace, now)
    if onto_joints(G, A, M, C, P, Q, R, X, Y, W, O, F, pace, now) != DONE:
        return NO_WAY
    displace(N, M, X, Y.v, pace)
    held_by_joints(A, M, C, P, X, pace, VELOCITIES_AFTER)
    pace.real[TIME] += pace.real[STEP]
    pace.real[LAST_STEP] = pace.real[STEP]
    pace.count[TAKEN] += 1
    pace.count[LEFT] -= 1
    pace.count[MOST_CONTACTS] = max(pace.count[MOST_CONTACTS], C.count[FOUND])
    return DONE


@formula
def march(G, A, M, C, D, H, B, P, Q, R, X, Y, Z, E, W, O, F, N, L, pace, T, U):
    """See `march_kernel`."""
    while pace.count[LEFT] > 0:
        if pace.count[TAKEN] % 2 == 0:
            status = step(G, A, M, C, D, H, B, P, Q, R, X, Y, Z, E, W, O, F, N, L, pace, T.kept, U.kept)
        else:
            status = step(G, A, M, D, C, H, B, P, Q, R, X, Y, Z, E, W, O, F, N, L, pace, U.kept, T.kept)
        if status != DONE:
            return status
    return DONE


@kernel
def march_kernel(
    G: Geometry,
    A: Joined,
    M: Movers,
    C: Contacts,
    D: Contacts,
    H: Contacts,
    B: Search,
    P: Problem,
    Q: Problem,
    R: Problem,
    X: State,
    Y: State,
    Z: State,
    E: State,
    W: Scratch,
    O: Choices,
    F: Solvers,
    N: Free,
    L: Surfaces,
    pace: Pace,
    T: Tracks,
    U: Tracks,
) -> int:
    """Take ``pace.count[LEFT]`` steps. Returns what the search said last, NO_ROOM, NO_WAY, or TOO_LONG."""
    return march(G, A, M, C, D, H, B, P, Q, R, X, Y, Z, E, W, O, F, N, L, pace, T, U)
