"""The contact problem: min 1/2 p' N p + b' p, p in the cones, and N = D' K^-1 D as a product of arrays.

A contact c has three impulses p = (normal, two tangential) with |p_t| <= mu p_n, and velocities u = D v + bias;
the solution has u in the dual cone and u . p = 0 (Anitescu and Tasora 2010). It acts on up to two sides, with
opposite sign on side 1:

- a *node* has six velocities (v, w) and an inverse mass matrix of its own: (1/m) 1, and a symmetric 3 x 3
  block B. The impulse f = frame' p acts at ``arm``: it changes v by f/m and w by B (arm x f).
- a *group* has any number of velocities that are coupled (bodies connected by joints). D' of the contact's side is
  the block J (3, n); its impulses p change the group's velocities by p Y, Y (3, n) = D K^-1. If both sides are in one
  group, J and Y are those of the difference and belong to side 2. J of side 1 is the plain velocity there; solvers
  change its sign. With rolling friction (``turn``) J and Y have six rows: three of rotation.

Besides contacts there are *lines*: single impulses s in [low, high] on a group with u = J v + bias + soft s:
limits (0, inf), joint friction (-bound, bound), stiff springs (soft = 1 / (h^2 k + h c), unbounded).

Contacts of one island (connected through nodes and groups) are stored consecutively, and so are its lines; a
solver is called with one island or with all. Arrays are allocated here, outside of the compiled code.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...compiler.kernels import Kernel
from ...compiler.struct_layout import Column, Float1, Float2, Float3, Int1, Int2, Record, Vector3, Vector6, Vector9

FIXED_SIDE = -1  # in ContactProblem.at: an immovable side; n >= 0: node n; -2 - k: group k
CONVERGED, LIMIT_REACHED, STALLED, SOLVE_FAILED, STORAGE_TOO_SMALL = range(
    5
)  # SettingCounts.ended; STORAGE_TOO_SMALL: enlarge `FactorStorage`, call again
MOST_SLABS = 31
MOST_BLOCKS = 2 * MOST_SLABS + 1  # slabs, cuts between them, the rest, contacts that are solved: see `packed_contacts`
SLAB_BINS = 512
BLOCK_KERNEL = 1  # place of the address of `gauss_seidel.block_kernel` in `FactorStorage.team`


class ContactProblem(NamedTuple):
    """Data that are constant during a solve. The arrays may be longer than ``size`` states."""

    size: Int1  # (4,): contacts, nodes, groups, lines
    at: Int2  # (nc, 2): side 1, side 2
    frame: Float2  # (nc, 9): rows n (from 1 to 2), t1, t2 in the world; anisotropic friction scales t2
    arm: Float2  # (nc, 6): from the node's centre to the contact, side 1, side 2, in world axes
    bias: Float2  # (nc, 3): added to the velocities D v: max(gap, 0) / h, surface velocities
    mu: Float1  # (nc,): friction coefficient
    soft: Float1  # (nc,): compliance of the normal impulse [velocity per impulse], 0 for hard contact
    turn: Float2  # (nc, 2) or (0, 2): rolling and spinning friction [m]: torques (about t1 and t2, about n)
    least: Float1  # (nc,) or (0,): smallest normal impulse (from restitution); 0 if there is none
    node: Nodes
    group: Int1  # (ng + 1,): first velocity of each group in ContactState.wide
    block: Int2  # (nc, 2): first number of J and Y of a side that is in a group, or -1
    J: Float1
    Y: Float1
    columns: Int1  # from the first number of each block of J: its columns that are not zero, -1 after the last
    line_at: Int2  # (nl, 2): group, first number of its J and Y (n numbers each)
    line_law: LineLaws
    island: Int1  # (ni + 1,): first contact of each island; one island by default
    member: Int1  # (nn,): nodes by island
    member_p: Int1  # (ni + 1,): first node of each island in ``member``
    line_p: Int1  # (ni + 1,): first line of each island (an island may have lines and no contacts)
    half_slab: Int1  # (nn,): of each node (-1 - h: solved), see `packed_contacts`; (0,): not divided


class ContactSolution(NamedTuple):
    """Impulses and velocities. On entry: warm start and velocities without any impulse; on exit: the solution."""

    p: Float2  # (nc, 3)
    torque: Float2  # (nc, 3) or (0, 3): about n, t1, t2
    line: Float1  # (nl,)
    v: Float2  # (nn, 8): v, w in the world, two unused
    wide: Float1  # velocities of the groups


class SettingCounts(Record, kind="Int"):
    """Choices and outcome of a solve, as integers."""

    most: int  # maximum number of iterations (sweeps)
    island: int  # island to solve; -1: all
    used: int  # iterations used
    ended: int  # CONVERGED, LIMIT_REACHED, STALLED, SOLVE_FAILED, STORAGE_TOO_SMALL
    coulomb: int  # 1: Coulomb's law by De Saxce's correction, 0: the convex form
    needed_numbers: int  # required sizes of `FactorStorage`
    needed_places: int
    directions: int  # edges of a friction pyramid
    slabs: int  # number of slabs of nodes; 0: contacts are not divided among threads
    most_steps: int  # maximum steps of Newton's method if it is combined with sweeps by island; 0: equal to ``most``


class SettingReals(Record, kind="Float"):
    """Tolerance and residuals of a solve."""

    enough: float  # residual [m/s] at which a solve has converged
    residual: float  # residual reached, as a velocity [m/s],
    force_residual: float  # and as a force: missing impulse over the largest impulse [1]
    acceptable: float  # residual that suffices where rounding does not let it become smaller [m/s]


class SolverSettings(NamedTuple):
    """Choices and outcome of a solve."""

    count: SettingCounts  # type: ignore[assignment]
    real: SettingReals  # type: ignore[assignment]


class SphereContacts(Record, kind="Float", rows=True):
    """Contacts whose arms are along the normal."""

    normal: Vector3
    arm_1: Column
    arm_2: Column
    bias: Column
    soft: Column
    inverse_normal: Column  # inverse diagonal, along the normal
    inverse_tangential: Column
    mu: Column
    ratio: Column  # of both diagonals
    impulse: Column  # normal
    tangent: Vector3  # tangential impulse, in world axes
    least: Column  # normal impulse


class FrictionlessContacts(Record, kind="Float", rows=True):
    """Contacts of any nodes without friction."""

    normal: Vector3
    torque: Vector6  # of a unit impulse on both sides
    spin: Vector6  # angular velocities that they cause
    bias: Column
    soft: Column
    inverse: Column  # inverse diagonal
    impulse: Column
    least: Column


class FrictionalContacts(Record, kind="Float", rows=True):
    """Contacts with friction, and general ones."""

    frame: Vector9
    arm: Vector6  # of both sides
    bias: Vector3
    soft: Column
    inverse_nn: Column  # from here to ``ratio``: `packed_contacts.local_step_sizes`
    ns: Column
    nt: Column
    inverse_ss: Column
    inverse_st: Column
    inverse_tt: Column
    sliding_step: Column
    ratio: Column
    mu: Column
    impulse: Vector3
    least: Column  # normal impulse


class LineLaws(Record, kind="Float", rows=True):
    """Laws of the lines."""

    bias: Column
    soft: Column  # compliance
    lower: Column  # smallest impulse
    upper: Column


class Nodes(Record, kind="Float", rows=True):
    """Masses of the nodes."""

    inverse_mass: Column
    inverse_inertia: Vector6  # symmetric block xx yy zz xy xz yz in the world
    isotropic: Column  # 1 if the block is a multiple of 1


class ContactWorkspace(NamedTuple):
    """Workspace of the solvers, as large as the problem; compiled code allocates nothing."""

    rows: Float3  # (17, nc, 3): vectors of impulses and velocities; of torques from plane 8 on; the last: step sizes
    nodes: Float3  # (6, nn, 8)
    wide: Float2  # (6, nw): for the velocities of groups
    lines: Float2  # (9, nl): vectors of lines, as ``rows``
    node_state: Float2  # (nn + MOST_BLOCKS, 8): of each node v, w, 1/m, mean of its block's diagonal; the last rows are
    # immovable, one for each block of contacts
    inner: Float2  # (nn + MOST_BLOCKS, 8): inverse inertia block of each node, two unused
    free: Float2  # (nn + MOST_BLOCKS, 8): v, w without impulses, two unused
    free_wide: Float1  # velocities of the groups without impulses
    contact_nodes: Int2  # (nc, 3): in the order of sweeps the two nodes in ``node_state`` and the number of the contact
    block_order: Int1  # (nc,): contacts by block and kind
    block_start: (
        Int2  # (MOST_BLOCKS, 6): place of the first contact of each block and kind, and of the one after the last
    )
    block_terms: Float2  # (MOST_BLOCKS, 8): largest change of a velocity in a sweep, terms of the residual; two unused
    slab_bins: Int1  # (SLAB_BINS,): counts of nodes along an axis
    spheres: SphereContacts  # (nc): contacts in that order, each in the table of its kind
    frictionless: FrictionlessContacts  # (nc)
    frictional: FrictionalContacts  # (nc): also those of groups


class FactorStorage(NamedTuple):
    """Storage of solvers that factor matrices; empty for the others. Its contents last from call to call. Threads."""

    numbers: Float1
    places: Int1
    team: Int1 = np.zeros(0, np.int64)  # of threads (`thread_team.new_team`); not used where ``slabs`` is 0


def empty_problem(
    contacts: int, nodes: int = 0, groups: int = 0, lines: int = 0, numbers: int = 0, turning: bool = False
):  # type: ignore[no-untyped-def]
    """Create a problem of zeros with one island and immovable sides.

    Parameters
    ----------
    contacts, nodes, groups, lines : int
        Their numbers; capacities are equal.
    numbers : int
        Number of entries in J and in Y.
    turning : bool
        Whether there is rolling and spinning friction.

    Returns
    -------
    ContactProblem
    """
    nc, nn, whole = contacts, nodes, np.int64

    def ends(n: int) -> np.ndarray:
        return np.array([0, n], whole)

    return ContactProblem(
        size=np.array([nc, nn, groups, lines], whole),
        at=np.full((nc, 2), -1, whole),
        frame=np.tile(np.eye(3).ravel(), (nc, 1)),
        arm=np.zeros((nc, 6)),
        bias=np.zeros((nc, 3)),
        mu=np.zeros(nc),
        soft=np.zeros(nc),
        least=np.zeros(0),
        turn=np.zeros((nc if turning else 0, 2)),
        node=Nodes.blank(nn),
        group=np.zeros(groups + 1, whole),
        block=np.full((nc, 2), -1, whole),
        J=np.zeros(numbers),
        Y=np.zeros(numbers),
        columns=np.zeros(numbers, whole),
        line_at=np.zeros((lines, 2), whole),
        line_law=LineLaws.blank(lines),
        island=ends(nc),
        member=np.arange(nn),
        member_p=ends(nn),
        line_p=ends(lines),
        half_slab=np.zeros(0, whole),
    )


def cache_aligned(rows: int, columns: int) -> np.ndarray:
    """Allocate zeros aligned to a cache line of the processor, so that a row of eight numbers is in one line."""
    whole = np.zeros(rows * columns + 8)
    begin = -(whole.ctypes.data // 8) % 8
    return whole[begin : begin + rows * columns].reshape(rows, columns)


def allocate_solver(
    P: ContactProblem,
) -> tuple[ContactSolution, ContactWorkspace, SolverSettings, FactorStorage]:
    """Allocate state, workspace, settings and an empty factor storage for a problem.

    Parameters
    ----------
    P : ContactProblem

    Returns
    -------
    ContactState, ContactWorkspace, SolverSettings, FactorStorage
        The state is zero. Settings: all islands, at most 100 iterations, tolerance 1e-6 m/s, convex form.
    """
    nc, nn, nl, nw = len(P.mu), len(P.node), len(P.line_at), int(P.group[-1])
    X = ContactSolution(np.zeros((nc, 3)), np.zeros((len(P.turn), 3)), np.zeros(nl), np.zeros((nn, 8)), np.zeros(nw))
    W = ContactWorkspace(
        rows=np.zeros((17, nc, 3)),
        nodes=np.zeros((6, nn, 8)),
        wide=np.zeros((6, nw)),
        lines=np.zeros((9, nl)),
        node_state=cache_aligned(nn + MOST_BLOCKS, 8),
        inner=cache_aligned(nn + MOST_BLOCKS, 8),
        free=cache_aligned(nn + MOST_BLOCKS, 8),
        free_wide=np.zeros(nw),
        contact_nodes=np.zeros((nc, 3), np.int64),
        block_order=np.zeros(nc, np.int64),
        block_start=np.zeros((MOST_BLOCKS, 6), np.int64),
        block_terms=cache_aligned(MOST_BLOCKS, 8),
        slab_bins=np.zeros(SLAB_BINS, np.int64),
        spheres=cache_aligned(nc, SphereContacts.layout.width).view(SphereContacts),
        frictionless=cache_aligned(nc, FrictionlessContacts.layout.width).view(FrictionlessContacts),
        frictional=cache_aligned(nc, FrictionalContacts.layout.width).view(FrictionalContacts),
    )
    O = SolverSettings(SettingCounts.blank(), SettingReals.blank())
    O.count[:2] = 100, -1
    O.real[0] = 1e-6
    return X, W, O, FactorStorage(np.zeros(0), np.zeros(0, np.int64))


def solve_contacts(
    solver: Kernel, P: ContactProblem, X: ContactSolution, W: ContactWorkspace, O: SolverSettings, F: FactorStorage
) -> int:
    """Solve a contact problem in place.

    Parameters
    ----------
    solver : Kernel
        A kernel of this package: `gauss_seidel.gauss_seidel`, ...
    P, X, W, O, F : ContactProblem, ContactState, ContactWorkspace, SolverSettings, FactorStorage
        See `contact_problem` and `allocate_solver`.

    Returns
    -------
    int
        Iterations used; outcome and residuals are in O.
    """
    return int(solver(P, X, W, O, F, 0))
