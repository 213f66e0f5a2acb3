"""Which solver takes which island, and the door that does all of them: ``solver="auto"``.

Solvers are called by addresses, so that only those in use are compiled. Contacts of several islands are copied into
rooms of their own where each island's stand together, those that sweeps take at the end as one.
"""

from __future__ import annotations

from typing import NamedTuple

from ...compiler.formulas import by_address, call, formula
from ...compiler.kernels import kernel
from ...compiler.layout import Float1, Int1
from .islands import Islands, find_islands
from .problem import (
    BROKEN,
    CONVERGED,
    CUT,
    SMALL,
    STALLED,
    Choices,
    Factor,
    Problem,
    Scratch,
    State,
)

# entries of Auto.doors: addresses of what takes small islands and of what takes the rest (0: all are small)
SMALL_ISLANDS, THE_REST, DOORS = range(3)
# entries of Auto.limit: most contacts and most nodes of an island that is small; the same where masses are UNEVEN;
# contacts of all islands above which it is a CROWD: what falls together hits anew in every step, and Newton's method
# has no warm start there
MOST_CONTACTS, MOST_NODES, MOST_CONTACTS_UNEVEN, MOST_NODES_UNEVEN, CROWD, LIMITS = range(6)
FINER, FINEST = 1e-5, 1e-10  # times the residual that is enough; but no finer than this [m/s], which rounding may hide
UNEVEN = 30.0  # ratio of masses in an island from which on sweeps take too long
FEW_CONTACTS, FEW_NODES = 12, 4  # of an island that is small in a crowd
# entries of Auto.told, added up over calls: calls, islands, islands by the one and by the other, what the one had to
# hand on to the other, contacts by the one; the largest island's contacts
CALLS, ISLANDS, BY_ONE, BY_OTHER, HANDED_ON, CONTACTS_BY_ONE, LARGEST, TOLD = range(8)


class Auto(NamedTuple):
    """In place of `Factor`: rooms for factors, a copy of the problem by islands, addresses, what was picked."""

    numbers: Float1
    places: Int1
    P: Problem
    X: State
    islands: Islands
    pick: Int1  # (ni,): islands, the small ones first
    doors: Int1
    limit: Int1
    told: Int1


@formula
def copy_contact(P, X, Q, Y, c, k):
    """Contact c of (P, X) becomes contact k of (Q, Y)."""
    for s in range(2):
        Q.at[k, s], Q.block[k, s] = P.at[c, s], P.block[c, s]
    for s in range(9):
        Q.frame[k, s] = P.frame[c, s]
    for s in range(6):
        Q.arm[k, s] = P.arm[c, s]
    for s in range(3):
        Q.bias[k, s], Y.p[k, s] = P.bias[c, s], X.p[c, s]
    Q.mu[k], Q.soft[k] = P.mu[c], P.soft[c]
    if P.least.shape[0] > 0:
        Q.least[k] = P.least[c]
    if P.turn.shape[0] > 0:
        Q.turn[k, 0], Q.turn[k, 1] = P.turn[c, 0], P.turn[c, 1]
        for s in range(3):
            Y.torque[k, s] = X.torque[c, s]


@formula
def take_back(X, Y, c, k, turning):
    """Impulses of contact k of Y become those of contact c of X."""
    for s in range(3):
        X.p[c, s] = Y.p[k, s]
        if turning:
            X.torque[c, s] = Y.torque[k, s]


@formula
def copy_line(P, X, Q, Y, line, k):
    """Line ``line`` of (P, X) becomes line k of (Q, Y)."""
    Q.line_at[k, 0], Q.line_at[k, 1], Y.line[k] = P.line_at[line, 0], P.line_at[line, 1], X.line[line]
    for s in range(4):
        Q.line_x[k, s] = P.line_x[line, s]


@formula
def small(P, F, I, k):
    """Whether island k is for the solver of small islands."""
    if P.turn.shape[0] > 0:
        return False
    contacts, nodes = I.island[k + 1] - I.island[k], I.member_p[k + 1] - I.member_p[k]
    crowded = P.size[0] > F.limit[CROWD] and (contacts > FEW_CONTACTS or nodes > FEW_NODES)
    if not crowded and contacts <= F.limit[MOST_CONTACTS] and nodes <= F.limit[MOST_NODES]:
        return True
    if contacts > F.limit[MOST_CONTACTS_UNEVEN] or nodes > F.limit[MOST_NODES_UNEVEN]:
        return False
    return I.team_p[k + 1] > I.team_p[k] or unevenness(P, I, k) > UNEVEN


@formula
def unevenness(P, I, k):
    """Largest over smallest mass of the nodes of an island that impulses move."""
    least, most = 1e300, 0.0
    for e in range(I.member_p[k], I.member_p[k + 1]):
        a = P.node[I.member[e], 0]
        if a > 0.0:
            least, most = min(least, a), max(most, a)
    return most / least


@formula
def pick(P, F, I, count):
    """Islands in a new order, in ``F.pick``: the small ones first; returns how many these are."""
    some = 0
    for k in range(count):
        F.told[LARGEST] = max(F.told[LARGEST], I.island[k + 1] - I.island[k])
        if F.doors[SMALL_ISLANDS] != 0 and small(P, F, I, k):
            F.pick[some] = k
            some += 1
            F.told[CONTACTS_BY_ONE] += I.island[k + 1] - I.island[k]
    rest = some
    for k in range(count):
        if F.doors[SMALL_ISLANDS] == 0 or not small(P, F, I, k):
            F.pick[rest] = k
            rest += 1
    F.told[CALLS] += 1
    F.told[ISLANDS] += count
    F.told[BY_ONE] += some
    F.told[BY_OTHER] += count - some
    return some


@formula
def lay_out(P, X, Q, Y, F, I, count, some):
    """Copy by islands: the small ones, then the others as one."""
    c, l, m = 0, 0, 0
    Q.island[0] = Q.line_p[0] = Q.member_p[0] = 0
    for i in range(count):
        k = F.pick[i]
        for e in range(I.island[k], I.island[k + 1]):
            copy_contact(P, X, Q, Y, I.order[e], c)
            c += 1
        for e in range(I.line_p[k], I.line_p[k + 1]):
            copy_line(P, X, Q, Y, I.line_order[e], l)
            l += 1
        for e in range(I.member_p[k], I.member_p[k + 1]):
            Q.member[m] = I.member[e]
            m += 1
        end = min(i, some) + 1
        Q.island[end], Q.line_p[end], Q.member_p[end] = c, l, m
    Q.size[0], Q.size[1], Q.size[2], Q.size[3] = c, P.size[1], P.size[2], l


@formula
def take_all_back(P, X, Y, F, I, count):
    """Impulses back to where they came from."""
    c, l, turning = 0, 0, P.turn.shape[0] > 0
    for i in range(count):
        k = F.pick[i]
        for e in range(I.island[k], I.island[k + 1]):
            take_back(X, Y, I.order[e], c, turning)
            c += 1
        for e in range(I.line_p[k], I.line_p[k + 1]):
            X.line[I.line_order[e]] = Y.line[l]
            l += 1


@formula
def gather(O, sofar):
    """The worst of what solvers said: (residual, force residual, used, status)."""
    a, b, used, ended = sofar
    return (
        max(a, O.real.residual),
        max(b, O.real.force_residual),
        max(used, O.count.used),
        max(ended, O.count.ended),
    )


@formula
def by_one(P, X, W, O, F, f):
    """An island by the solver of small ones, or by the other where that cannot.

    It is asked for ``FINER`` digits than are enough, since Newton's last steps bring many of them: what sticks then
    does not creep. That it has not got them all is no fault.
    """
    enough, most = O.real.enough, O.count.most
    O.real.enough = max(FINER * enough, min(enough, FINEST))
    if O.count.most_steps > 0:
        O.count.most = O.count.most_steps
    call(F.doors[SMALL_ISLANDS], P, X, W, O, f, 0)
    O.real.enough, O.count.most = enough, most
    if (O.count.ended == CUT or O.count.ended == STALLED) and O.real.residual <= enough:
        O.count.ended = CONVERGED
    if F.doors[THE_REST] != 0 and (O.count.ended == SMALL or O.count.ended == BROKEN):
        F.told[HANDED_ON] += 1
        call(F.doors[THE_REST], P, X, W, O, f, 0)


@formula
def one_by_one(P, X, Y, W, O, F, f, count, some):
    """Islands each by its solver, on the copy."""
    Q, I = F.P, F.islands
    lay_out(P, X, Q, Y, F, I, count, some)
    sofar = (0.0, 0.0, 0, 0)
    for k in range(some):
        O.count.island = k
        by_one(Q, Y, W, O, F, f)
        sofar = gather(O, sofar)
    if some < count:
        O.count.island = some
        call(F.doors[THE_REST], Q, Y, W, O, f, 0)
        sofar = gather(O, sofar)
    O.count.island = -1
    O.real.residual, O.real.force_residual, O.count.used, O.count.ended = sofar
    take_all_back(P, X, Y, F, I, count)


@formula
def solve_all(P, X, W, O, F):
    """See `auto`."""
    f, I = by_address(Factor(F.numbers[:], F.places[:])), F.islands
    O.count.used, O.count.ended, O.count.island = 0, CONVERGED, -1
    O.real.residual, O.real.force_residual = 0.0, 0.0
    nc, nn, ng, nl = P.size[0], P.size[1], P.size[2], P.size[3]
    count = find_islands(P.at, P.line_at, (nc, nn, ng, nl), I)
    some = pick(P, F, I, count)
    if count == 0:
        return 0
    if some == 0:
        call(F.doors[THE_REST], P, X, W, O, f, 0)
    elif count == 1:
        by_one(P, X, W, O, F, f)
    else:
        one_by_one(
            P, X, by_address(State(F.X.p[:], F.X.torque[:], F.X.line[:], X.v[:], X.wide[:])), W, O, F, f, count, some
        )
    return O.count.used


@kernel
def auto(P: Problem, X: State, W: Scratch, O: Choices, F: Auto, task: int) -> int:
    """Every island by the solver picked for it; returns the most iterations that one took. F is `Auto`."""
    return solve_all(P, X, W, O, F)
