"""Contact solvers by name, contact islands, and the choice of a solver for each island: ``solver="auto"``.

Solvers are called by address, so that only those in use are compiled. Islands are sets of nodes and groups connected by
contacts and lines, found by union-find (`graphs`). Immovable sides (`FIXED_SIDE`) connect nothing; nodes and groups do,
even those that no impulse moves. Contacts of several islands are copied to arrays sorted by island; the islands that
sweeps solve come last and are solved as one. A new solver is a file with a kernel, and a line in ``SOLVERS``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...compiler.formulas import by_address, call, formula
from ...compiler.kernels import Kernel, kernel
from ...compiler.struct_layout import Float1, Int1, Int2
from ..graphs import find_root, unite
from ..thread_team import new_team
from .admm import admm
from .apgd import apgd, scaled_apgd
from .barzilai_borwein import barzilai_borwein
from .contact_problem import (
    BLOCK_KERNEL,
    CONVERGED,
    FIXED_SIDE,
    LIMIT_REACHED,
    SOLVE_FAILED,
    STALLED,
    STORAGE_TOO_SMALL,
    ContactProblem,
    ContactSolution,
    ContactWorkspace,
    FactorStorage,
    SolverSettings,
    allocate_solver,
    empty_problem,
)
from .friction_pyramid import lcp, lcp_storage, pyramid
from .gauss_seidel import block_kernel, gauss_seidel
from .jacobi import jacobi
from .newton import newton


class Islands(NamedTuple):
    """Contacts, lines, nodes and groups sorted by island; islands in the order of their first contacts, then lines."""

    parent: Int1  # (nn + ng,): forest over nodes, then groups; afterwards the island of each, or -1
    order: Int1  # (nc,): contacts sorted by island
    island: Int1  # (ni + 1,): as in `ContactProblem`; allocated for the largest possible number
    line_order: Int1  # (nl,): lines sorted by island
    line_p: Int1  # (ni + 1,)
    member: Int1  # (nn,): nodes of islands; the rest of the array is not used
    member_p: Int1  # (ni + 1,)
    group_order: Int1  # (ng,)
    group_p: Int1  # (ni + 1,)


@formula
def side_vertex(at, nodes):
    """Vertex number of a side among nodes, then groups, or -1."""
    return at if at >= 0 else nodes - 2 - at if at < FIXED_SIDE else -1


@formula
def contact_vertex(at, c, nodes):
    """Return a vertex on which contact c acts, -1 if there is none."""
    a = side_vertex(at[c, 0], nodes)
    return a if a >= 0 else side_vertex(at[c, 1], nodes)


@formula
def number_islands(at, line_at, sizes, I):
    """Assign numbers to the islands in ``parent`` (entry of each root: -2 - island); returns their count."""
    nc, nn, ng, nl = sizes
    for i in range(nn + ng):
        I.parent[i] = i
    for c in range(nc):
        a, b = side_vertex(at[c, 0], nn), side_vertex(at[c, 1], nn)
        if a >= 0 and b >= 0:
            unite(I.parent, a, b)
    for i in range(nn + ng):
        I.parent[i] = find_root(I.parent, i)
    count = 0
    for c in range(nc):
        count = number_root(I.parent, contact_vertex(at, c, nn), count)
    for k in range(nl):
        count = number_root(I.parent, nn + line_at[k, 0], count)
    return count


@formula
def number_root(parent, a, count):
    """Give the root of a the next number if it has none (all paths have length one); returns the new count."""
    if a < 0 or parent[a] < 0:
        return count
    r = parent[a]
    if parent[r] < 0:
        return count
    parent[r] = -2 - count
    return count + 1


@formula
def label_vertices(I, n):
    """Convert roots to island numbers; -1 for vertices without contacts and lines."""
    # a numbered root holds -2 - island, its members hold the root; a root precedes its members
    for i in range(n - 1, -1, -1):
        r = I.parent[i]
        if r >= 0:
            r = I.parent[r]
        I.parent[i] = -2 - r if r < -1 else -1


@formula
def sort_contacts(at, nc, nn, count, I):
    """Sort contacts by island, stable; those on nothing movable come last, in no island."""
    for k in range(count + 1):
        I.island[k] = 0
    for c in range(nc):
        a = contact_vertex(at, c, nn)
        if a >= 0:
            I.island[I.parent[a] + 1] += 1
    for k in range(count):
        I.island[k + 1] += I.island[k]
    rest = I.island[count]
    for c in range(nc - 1, -1, -1):
        a = contact_vertex(at, c, nn)
        if a >= 0:
            k = I.parent[a]
            I.island[k + 1] -= 1
            I.order[I.island[k + 1]] = c
    for k in range(count):
        I.island[k] = I.island[k + 1]
    I.island[count] = rest
    for c in range(nc):
        if contact_vertex(at, c, nn) < 0:
            I.order[rest] = c
            rest += 1


@formula
def sort_vertices(first, count, number, parent, order, start):
    """Sort 0 to number - 1 by the island ``parent[first + i]``, ascending; those without island are left out."""
    for k in range(count + 1):
        start[k] = 0
    for i in range(number):
        if parent[first + i] >= 0:
            start[parent[first + i] + 1] += 1
    for k in range(count):
        start[k + 1] += start[k]
    rest = start[count]
    for i in range(number - 1, -1, -1):
        k = parent[first + i]
        if k >= 0:
            start[k + 1] -= 1
            order[start[k + 1]] = i
    for k in range(count):
        start[k] = start[k + 1]
    start[count] = rest


@formula
def sort_lines(line_at, nl, nn, count, I):
    """Sort lines by island, stable."""
    for k in range(count + 1):
        I.line_p[k] = 0
    for k in range(nl):
        I.line_p[I.parent[nn + line_at[k, 0]] + 1] += 1
    for k in range(count):
        I.line_p[k + 1] += I.line_p[k]
    for e in range(nl - 1, -1, -1):
        k = I.parent[nn + line_at[e, 0]]
        I.line_p[k + 1] -= 1
        I.line_order[I.line_p[k + 1]] = e
    for k in range(count):
        I.line_p[k] = I.line_p[k + 1]
    I.line_p[count] = nl


@formula
def find_islands(at, line_at, sizes, I):
    """Find islands; see `islands_of`. Returns their count."""
    nc, nn, ng, nl = sizes
    count = number_islands(at, line_at, sizes, I)
    label_vertices(I, nn + ng)
    sort_contacts(at, nc, nn, count, I)
    sort_lines(line_at, nl, nn, count, I)
    sort_vertices(0, count, nn, I.parent, I.member, I.member_p)
    sort_vertices(nn, count, ng, I.parent, I.group_order, I.group_p)
    return count


@kernel
def islands_kernel(at: Int2, line_at: Int2, sizes: Int1, I: Islands) -> int:
    """Find islands; see `islands_of`."""
    return find_islands(at, line_at, (sizes[0], sizes[1], sizes[2], sizes[3]), I)


def allocate_islands(contacts: int, nodes: int, groups: int, lines: int) -> Islands:
    """Allocate the islands of a problem."""
    most = min(contacts + lines, nodes + groups) + 1

    def whole(n: int) -> np.ndarray:
        return np.zeros(n, np.int64)

    return Islands(
        whole(nodes + groups),
        whole(contacts),
        whole(most),
        whole(lines),
        whole(most),
        whole(nodes),
        whole(most),
        whole(groups),
        whole(most),
    )


def islands_of(at: np.ndarray, line_at: np.ndarray, nodes: int, groups: int) -> tuple[int, Islands]:
    """Find the islands of contacts and lines.

    Parameters
    ----------
    at : ndarray (nc, 2)
        Sides of contacts, as `ContactProblem.at`.
    line_at : ndarray (nl, 2)
        As `ContactProblem.line_at`.
    nodes, groups : int

    Returns
    -------
    int
        Number of islands.
    Islands
    """
    I = allocate_islands(len(at), nodes, groups, len(line_at))
    sizes = np.array([len(at), nodes, groups, len(line_at)])
    return int(islands_kernel(at, line_at, sizes, I)), I


# entries of IslandSolver.doors: addresses of the solvers of small islands and of the rest (0: all are small)
SMALL_ISLAND_SOLVER, OTHER_SOLVER, SOLVER_SLOTS = range(3)
# entries of IslandSolver.limit: largest number of contacts and of nodes of a small island; the same with uneven masses;
# number of contacts of all islands above which they are a crowd: in a crowd contacts are new in every step, and
# Newton's method has no warm start
MAX_CONTACTS, MAX_NODES, MAX_CONTACTS_UNEVEN, MAX_NODES_UNEVEN, CROWD_CONTACTS, LIMITS = range(6)
NEWTON_TOLERANCE_FACTOR = 1e-5  # residual of Newton's method, relative to the one requested
UNEVEN_MASS_RATIO = 30.0  # ratio of masses in an island above which sweeps converge too slowly
CROWD_ISLAND_CONTACTS, CROWD_ISLAND_NODES = 12, 4  # limits of a small island in a crowd
# entries of IslandSolver.statistics, summed over calls: calls, islands, islands by the small-island solver and by the
# other, islands passed on from the former to the latter, contacts by the former; contacts of the largest island
CALLS, ISLANDS, SMALL_SOLVED, OTHER_SOLVED, PASSED_ON, SMALL_CONTACTS, LARGEST_ISLAND, STATISTICS = range(8)


class IslandSolver(NamedTuple):
    """Replaces `FactorStorage`: storage for factors, a copy of the problem by islands, solver addresses, statistics."""

    numbers: Float1
    places: Int1
    team: Int1
    P: ContactProblem
    X: ContactSolution
    islands: Islands
    pick: Int1  # (ni,): islands, small ones first
    doors: Int1
    limit: Int1
    statistics: Int1


@formula
def copy_contact(P, X, Q, Y, c, k):
    """Copy contact c of (P, X) to contact k of (Q, Y)."""
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
def copy_impulse_back(X, Y, c, k, turning):
    """Copy impulses of contact k of Y to contact c of X."""
    for s in range(3):
        X.p[c, s] = Y.p[k, s]
        if turning:
            X.torque[c, s] = Y.torque[k, s]


@formula
def copy_line(P, X, Q, Y, line, k):
    """Copy line ``line`` of (P, X) to line k of (Q, Y)."""
    Q.line_at[k, 0], Q.line_at[k, 1], Y.line[k] = P.line_at[line, 0], P.line_at[line, 1], X.line[line]
    for s in range(4):
        Q.line_law[k, s] = P.line_law[line, s]


@formula
def is_small_island(P, F, I, k):
    """Whether island k goes to the solver of small islands."""
    if P.turn.shape[0] > 0:
        return False
    contacts, nodes = I.island[k + 1] - I.island[k], I.member_p[k + 1] - I.member_p[k]
    crowded = P.size[0] > F.limit[CROWD_CONTACTS] and (contacts > CROWD_ISLAND_CONTACTS or nodes > CROWD_ISLAND_NODES)
    if not crowded and contacts <= F.limit[MAX_CONTACTS] and nodes <= F.limit[MAX_NODES]:
        return True
    if contacts > F.limit[MAX_CONTACTS_UNEVEN] or nodes > F.limit[MAX_NODES_UNEVEN]:
        return False
    return I.group_p[k + 1] > I.group_p[k] or mass_ratio(P, I, k) > UNEVEN_MASS_RATIO


@formula
def mass_ratio(P, I, k):
    """Largest over smallest mass of the movable nodes of an island."""
    least, most = 1e300, 0.0
    for e in range(I.member_p[k], I.member_p[k + 1]):
        a = P.node.inverse_mass[I.member[e]]
        if a > 0.0:
            least, most = min(least, a), max(most, a)
    return most / least


@formula
def pick_islands(P, F, I, count):
    """Order the islands in ``F.pick``, small ones first; returns the number of small ones."""
    some = 0
    for k in range(count):
        F.statistics[LARGEST_ISLAND] = max(F.statistics[LARGEST_ISLAND], I.island[k + 1] - I.island[k])
        if F.doors[SMALL_ISLAND_SOLVER] != 0 and is_small_island(P, F, I, k):
            F.pick[some] = k
            some += 1
            F.statistics[SMALL_CONTACTS] += I.island[k + 1] - I.island[k]
    rest = some
    for k in range(count):
        if F.doors[SMALL_ISLAND_SOLVER] == 0 or not is_small_island(P, F, I, k):
            F.pick[rest] = k
            rest += 1
    F.statistics[CALLS] += 1
    F.statistics[ISLANDS] += count
    F.statistics[SMALL_SOLVED] += some
    F.statistics[OTHER_SOLVED] += count - some
    return some


@formula
def copy_islands(P, X, Q, Y, F, I, count, some):
    """Copy the problem by islands: the small ones, then all others as one."""
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
def copy_impulses_back(P, X, Y, F, I, count):
    """Copy the impulses back to the original order."""
    c, l, turning = 0, 0, P.turn.shape[0] > 0
    for i in range(count):
        k = F.pick[i]
        for e in range(I.island[k], I.island[k + 1]):
            copy_impulse_back(X, Y, I.order[e], c, turning)
            c += 1
        for e in range(I.line_p[k], I.line_p[k + 1]):
            X.line[I.line_order[e]] = Y.line[l]
            l += 1


@formula
def worst_outcome(O, sofar):
    """Worst of the solvers' outcomes: (residual, force residual, used, status)."""
    a, b, used, ended = sofar
    return (
        max(a, O.real.residual),
        max(b, O.real.force_residual),
        max(used, O.count.used),
        max(ended, O.count.ended),
    )


@formula
def solve_small_island(P, X, W, O, F, f):
    """Solve an island by the solver of small ones, or by the other one if that fails.

    The tolerance is smaller by `NEWTON_TOLERANCE_FACTOR`, because Newton's last steps gain many digits; sticking
    contacts then do not creep. Missing the smaller tolerance is no failure.
    """
    enough, most = O.real.enough, O.count.most
    O.real.enough, O.real.acceptable = NEWTON_TOLERANCE_FACTOR * enough, enough
    if O.count.most_steps > 0:
        O.count.most = O.count.most_steps
    call(F.doors[SMALL_ISLAND_SOLVER], P, X, W, O, f, 0)
    O.real.enough, O.real.acceptable, O.count.most = enough, 0.0, most
    if (O.count.ended == LIMIT_REACHED or O.count.ended == STALLED) and O.real.residual <= enough:
        O.count.ended = CONVERGED
    if F.doors[OTHER_SOLVER] != 0 and (O.count.ended == STORAGE_TOO_SMALL or O.count.ended == SOLVE_FAILED):
        F.statistics[PASSED_ON] += 1
        call(F.doors[OTHER_SOLVER], P, X, W, O, f, 0)


@formula
def solve_small_islands(Q, Y, W, O, F, f, some):
    """Solve the first islands of the copy by their solvers; returns the worst outcome."""
    sofar = (0.0, 0.0, 0, 0)
    for k in range(some):
        O.count.island = k
        solve_small_island(Q, Y, W, O, F, f)
        sofar = worst_outcome(O, sofar)
    return sofar


@formula
def solve_islands(P, X, Y, W, O, F, f, count, some):
    """Solve each island of the copy by its solver."""
    Q, I = F.P, F.islands
    copy_islands(P, X, Q, Y, F, I, count, some)
    sofar = solve_small_islands(Q, Y, W, O, F, f, some)
    if some < count:
        O.count.island = some
        call(F.doors[OTHER_SOLVER], Q, Y, W, O, f, 0)
        sofar = worst_outcome(O, sofar)
    O.count.island = -1
    O.real.residual, O.real.force_residual, O.count.used, O.count.ended = sofar
    copy_impulses_back(P, X, Y, F, I, count)


@formula
def mark_solved_nodes(P, I, F, some):
    """Mark the nodes of the small islands as solved, for `packed_contacts.block_of_contact`; or end that."""
    for i in range(some):
        k = F.pick[i]
        for e in range(I.member_p[k], I.member_p[k + 1]):
            P.half_slab[I.member[e]] = -1 - P.half_slab[I.member[e]]


@formula
def solve_divided(P, X, Y, W, O, F, f, some):
    """As `solve_islands` where contacts are divided into blocks, without groups: only small islands are copied."""
    Q, I = F.P, F.islands
    copy_islands(P, X, Q, Y, F, I, some, some)
    sofar = solve_small_islands(Q, Y, W, O, F, f, some)
    O.count.island = -1
    mark_solved_nodes(P, I, F, some)
    call(F.doors[OTHER_SOLVER], P, X, W, O, f, 0)
    mark_solved_nodes(P, I, F, some)
    O.real.residual, O.real.force_residual, O.count.used, O.count.ended = worst_outcome(O, sofar)
    copy_impulses_back(P, X, Y, F, I, some)


@formula
def solve_all_islands(P, X, W, O, F):
    """Solve all islands; see `auto`."""
    f, I = by_address(FactorStorage(F.numbers[:], F.places[:], F.team[:])), F.islands
    O.count.used, O.count.ended, O.count.island = 0, CONVERGED, -1
    O.real.residual, O.real.force_residual = 0.0, 0.0
    nc, nn, ng, nl = P.size[0], P.size[1], P.size[2], P.size[3]
    count = find_islands(P.at, P.line_at, (nc, nn, ng, nl), I)
    some = pick_islands(P, F, I, count)
    if count == 0:
        return 0
    if some == 0:
        call(F.doors[OTHER_SOLVER], P, X, W, O, f, 0)
    elif count == 1:
        solve_small_island(P, X, W, O, F, f)
    else:
        Y = by_address(ContactSolution(F.X.p[:], F.X.torque[:], F.X.line[:], X.v[:], X.wide[:]))
        if O.count.slabs > 1 and ng == 0 and some < count:
            solve_divided(P, X, Y, W, O, F, f, some)
        else:
            solve_islands(P, X, Y, W, O, F, f, count, some)
    return O.count.used


@kernel
def auto(
    P: ContactProblem, X: ContactSolution, W: ContactWorkspace, O: SolverSettings, F: IslandSolver, task: int
) -> int:
    """Solve every island by the solver chosen for it; returns the most iterations of any. F is an `IslandSolver`."""
    return solve_all_islands(P, X, W, O, F)


SOLVERS: dict[str, Kernel] = {
    "gauss-seidel": gauss_seidel,
    "newton": newton,
    "jacobi": jacobi,
    "barzilai-borwein": barzilai_borwein,
    "apgd": apgd,
    "apgd-lean": scaled_apgd,
    "admm": admm,
    "pyramid": pyramid,
    "lcp": lcp,
}
PIVOTING_SOLVER = "lcp"  # is called island by island, and no other solver replaces it
FACTORISING_SOLVERS = {
    "newton",
    "admm",
    PIVOTING_SOLVER,
}  # solvers that need `FactorStorage`: called island by island; sweeps solve islands they cannot

# largest islands for Newton's method (contacts, nodes): with similar masses, where 50 sweeps take as long as five
# Newton steps, and with uneven masses or joints, where sweeps do not converge
EVEN_ISLAND, UNEVEN_ISLAND = (200, 40), (800, 150)
CROWD_LIMIT = 400  # contacts above which all islands are a crowd
PLACES_PER_ITEM, NUMBERS_PER_ITEM = (
    60,
    250,
)  # size of `FactorStorage` per contact and node of the largest island to be factored


class PreparedSolver(NamedTuple):
    """A solver with its storage."""

    kernel: Kernel
    F: IslandSolver
    statistics: np.ndarray  # statistics, see `STATISTICS`; empty for a solver that handles all islands at once


def solver_names() -> tuple[str, ...]:
    """Names of the solvers."""
    return ("auto", *SOLVERS)


def prepare_solver(
    name: str,
    P: ContactProblem,
    X: ContactSolution,
    W: ContactWorkspace,
    O: SolverSettings,
    team: np.ndarray | None = None,
) -> PreparedSolver:
    """Prepare a solver for problems of these capacities; compiles what it needs.

    Parameters
    ----------
    name : str
        One of `solver_names`.
    P, X, W, O : ContactProblem, ContactState, ContactWorkspace, SolverSettings
        With their final capacities.
    team : ndarray, optional
        Of threads (`thread_team.new_team`).

    Returns
    -------
    PreparedSolver
        To be prepared again when the capacities grow.

    Raises
    ------
    KeyError
        If the name is unknown.
    """
    team = new_team() if team is None else team
    if O.count.slabs > 1:
        team[BLOCK_KERNEL] = block_kernel.address
    if name != "auto" and name not in FACTORISING_SOLVERS:
        made = allocate_island_solver(P, False, team)
        made.doors[OTHER_SOLVER] = SOLVERS[name].address
        return PreparedSolver(auto, made, np.zeros(0, np.int64))
    whole = name != "auto"
    made = allocate_island_solver(P, whole, team)
    if name == PIVOTING_SOLVER:
        made = made._replace(**lcp_storage()._replace(team=team)._asdict())
    first = SOLVERS["newton" if name == "auto" else name]
    made.doors[SMALL_ISLAND_SOLVER] = first.address
    if name == "auto" and newton_suffices(len(P.node), len(P.group) - 1, len(P.turn) > 0):
        made.limit[:] = unlimited_islands(P)  # few bodies: nothing is left for sweeps
    elif name != PIVOTING_SOLVER:
        made.doors[OTHER_SOLVER] = gauss_seidel.address
    return PreparedSolver(auto, made, made.statistics)


def newton_suffices(nodes: int, groups: int, turning: bool) -> bool:
    """Whether Newton's method alone solves every island for `auto`."""
    return nodes <= EVEN_ISLAND[1] and groups == 0 and not turning


def unlimited_islands(P: ContactProblem) -> tuple[int, ...]:
    """Limits with which every island of such problems is small."""
    nc, nn = len(P.mu), len(P.node)
    return nc, nn, nc, nn, nc


def allocate_island_solver(P: ContactProblem, whole: bool, team: np.ndarray) -> IslandSolver:
    """Allocate the storage of `auto`; ``whole``: for islands of any size."""
    nc, nn, ng, nl = len(P.mu), len(P.node), len(P.group) - 1, len(P.line_at)
    limit = np.zeros(LIMITS, np.int64)
    limit[:] = unlimited_islands(P) if whole or nn <= EVEN_ISLAND[1] else (*EVEN_ISLAND, *UNEVEN_ISLAND, CROWD_LIMIT)
    contacts, nodes = min(nc, int(limit[MAX_CONTACTS_UNEVEN])), min(nn, int(limit[MAX_NODES_UNEVEN]))
    wide = int(P.group[-1]) + 6 * ng
    islands = allocate_islands(nc, nn, ng, nl)
    most = len(islands.island) + 1
    Q = empty_problem(nc, nn, ng, nl, 0, len(P.turn) > 0)._replace(
        node=P.node, half_slab=P.half_slab, group=P.group, J=P.J, Y=P.Y, columns=P.columns,
        least=np.zeros(len(P.least)),
        **{k: np.zeros(most, np.int64) for k in ("island", "member_p", "line_p")},
    )  # fmt: skip
    size = contacts + nodes + nl + wide
    fill = min(nodes * nodes // 2, 40 * nodes)
    return IslandSolver(
        np.zeros(NUMBERS_PER_ITEM * size + 72 * fill),
        np.zeros(PLACES_PER_ITEM * size + 4 * fill + nn + 3 * ng, np.int64),
        team, Q, allocate_solver(Q)[0], islands, np.zeros(most, np.int64),
        np.zeros(SOLVER_SLOTS, np.int64), limit, np.zeros(STATISTICS, np.int64),
    )  # fmt: skip
