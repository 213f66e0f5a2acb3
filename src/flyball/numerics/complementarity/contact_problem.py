"""The contact problem: min 1/2 p' N p + b' p, p in the cones, and N = D' K^-1 D as a product of arrays.

A contact c has three impulses p = (normal, two tangential) with |p_t| <= mu p_n, and velocities u = D v + bias;
the solution has u in the dual cone and u . p = 0 (Anitescu and Tasora 2010). It acts on up to two sides with
velocities of their own, reversed on side 1:

- a *node* has six velocities (v, w) and an inverse mass matrix of its own: (1/m) 1, and a symmetric 3 x 3
  block. The impulse f = frame' p acts at ``arm``: it changes v by f/m and w by B (arm x f).
- a *group* has any number of velocities that depend on each other (what joints hold together): D' of the
  contact's side is the block J (3, n), and what its impulses change the group's velocities by is p Y, Y (3, n)
  = D K^-1. Where both sides are in one group, J and Y are those of the difference, and stand on side 2. J of
  side 1 is the plain velocity there: solvers reverse it. With rolling friction (``turn``) J and Y have six
  rows: three of rotation.

Besides contacts there are *lines*: single impulses s in [low, high] on a group with u = J v + bias + soft s:
limits (0, inf), joint friction (-bound, bound), stiff springs (soft = 1 / (h^2 k + h c), unbounded).

Contacts of one island (what touches each other, over whatever nodes and groups) stand together, and so do its
lines; a solver is called with one island or with all. Arrays are allocated here, outside of the compiled code.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...compiler.kernels import Kernel
from ...compiler.struct_layout import Float1, Float2, Float3, Int1, Int2, Record

FIXED_SIDE = -1  # in Problem.at: nothing there moves; n >= 0: node n; -2 - k: group k
# columns of Problem.node
INVERSE_MASS, INVERSE_INERTIA, IS_ISOTROPIC = 0, 1, 7
# columns of Problem.line_x
LINE_BIAS, LINE_SOFT, LINE_LOW, LINE_HIGH = range(4)
CONVERGED, LIMIT_REACHED, STALLED, SOLVE_FAILED, STORAGE_TOO_SMALL = range(
    5
)  # ChoiceCounts.ended; SMALL: enlarge what is needed, call again
# columns of Choices.history
HISTORY_ITERATION, HISTORY_VELOCITY, HISTORY_FORCE, HISTORY_OBJECTIVE = range(4)


class ContactProblem(NamedTuple):
    """What does not change while impulses are looked for. Capacity may be larger than ``size`` says."""

    size: Int1  # (4,): contacts, nodes, groups, lines
    at: Int2  # (nc, 2): side 1, side 2
    frame: Float2  # (nc, 9): rows n (from 1 to 2), t1, t2 in the world; anisotropic friction scales t2
    arm: Float2  # (nc, 6): from the node's centre to the contact, side 1, side 2, in the world
    bias: Float2  # (nc, 3): what is added to the velocities D v: max(gap, 0) / h, surface velocities
    mu: Float1  # (nc,): friction coefficient
    soft: Float1  # (nc,): compliance of the normal impulse [velocity per impulse], 0 if it is hard
    turn: Float2  # (nc, 2) or (0, 2): rolling and spinning friction [m]: torques (about t1 and t2, about n)
    least: Float1  # (nc,) or (0,): least normal impulse (what a restitution gives back); 0 if there is none
    node: Float2  # (nn, 8): 1/m, symmetric block xx yy zz xy xz yz in the world, 1 if the block is a multiple of 1
    group: Int1  # (ng + 1,): first velocity of each group in State.wide
    block: Int2  # (nc, 2): where J and Y of a side that is in a group begin, or -1
    J: Float1
    Y: Float1
    line_at: Int2  # (nl, 2): group, where its J and Y (n numbers each) begin
    line_x: Float2  # (nl, 4): bias, compliance, least, largest impulse
    island: Int1  # (ni + 1,): first contact of each island; one island if nothing is known
    member: Int1  # (nn,): nodes by island
    member_p: Int1  # (ni + 1,): where those of an island begin in ``member``
    line_p: Int1  # (ni + 1,): first line of each island (an island may have lines and no contacts)


class ContactState(NamedTuple):
    """Impulses and velocities; on entry the warm start and the velocities without any impulse, on exit both solved."""

    p: Float2  # (nc, 3)
    torque: Float2  # (nc, 3) or (0, 3): about n, t1, t2
    line: Float1  # (nl,)
    v: Float2  # (nn, 8): v, w in the world, two unused
    wide: Float1  # velocities of the groups


class SettingCounts(Record, kind="Int"):
    """How a problem is solved, and how that ended."""

    most: int  # iterations (sweeps)
    island: int  # that is meant; -1: all
    history: int  # whether it is kept
    used: int  # iterations
    ended: int  # CONVERGED, CUT, STALLED, BROKEN, SMALL
    written: int  # rows of the history
    coulomb: int  # 1: Coulomb's law by De Saxce's correction, 0: the convex form
    needed_numbers: int  # how large `FactorStorage` must be
    needed_places: int
    directions: int  # of a friction pyramid
    most_steps: int  # of Newton's method where it takes islands in turn with sweeps; 0: as many as these


class SettingReals(Record, kind="Float"):
    """How well."""

    enough: float  # residual [m/s] that is enough
    residual: float  # reached, as a velocity [m/s],
    force_residual: float  # and as a force: what is left of an impulse over the largest impulse [1]


class SolverSettings(NamedTuple):
    """How it is solved, and what came of it."""

    count: SettingCounts  # type: ignore[assignment]
    real: SettingReals  # type: ignore[assignment]
    history: Float2  # (rows, 4): iteration, velocity residual, force residual, objective


class ContactWorkspace(NamedTuple):
    """Rooms to work in, as large as the problem; compiled code allocates nothing."""

    rows: Float3  # (17, nc, 3): vectors of impulses and velocities; of torques from the eighth on; the last: steps
    nodes: Float3  # (6, nn, 8)
    wide: Float2  # (6, nw): of the groups' velocities
    lines: Float2  # (9, nl): the same of lines
    own: Float2  # (nn + 1, 8): of each node v, w, 1/m, mean of its block; the last is what stands still
    inner: Float2  # (nn + 1, 8): its block, two unused
    free: Float2  # (nn + 1, 8): v, w without impulses, two unused
    free_wide: Float1  # velocities of the groups without impulses
    packed: Float1  # (32 nc,): contacts in the order of sweeps, each all in one place
    sides: Int2  # (nc, 3): in that order its nodes in ``own``, and which it is


class FactorStorage(NamedTuple):
    """Rooms of solvers that factor matrices; empty for the others. What stands in them lasts from call to call."""

    numbers: Float1
    places: Int1


PACKED_NUMBERS = 32  # numbers of `ContactWorkspace.packed` for each contact


def empty_problem(
    contacts: int, nodes: int = 0, groups: int = 0, lines: int = 0, numbers: int = 0, turning: bool = False
):  # type: ignore[no-untyped-def]
    """A problem of zeros, one island, with all its sides on what stands still.

    Parameters
    ----------
    contacts, nodes, groups, lines : int
        How many there are; capacities are the same.
    numbers : int
        Numbers in J and in Y.
    turning : bool
        Whether there is rolling and spinning friction.

    Returns
    -------
    Problem
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
        node=np.zeros((nn, 8)),
        group=np.zeros(groups + 1, whole),
        block=np.full((nc, 2), -1, whole),
        J=np.zeros(numbers),
        Y=np.zeros(numbers),
        line_at=np.zeros((lines, 2), whole),
        line_x=np.zeros((lines, 4)),
        island=ends(nc),
        member=np.arange(nn),
        member_p=ends(nn),
        line_p=ends(lines),
    )


def cache_aligned(rows: int, columns: int) -> np.ndarray:
    """Zeros that begin where a line of the processor's cache does: a row of eight numbers is then in one line."""
    whole = np.zeros(rows * columns + 8)
    begin = -(whole.ctypes.data // 8) % 8
    return whole[begin : begin + rows * columns].reshape(rows, columns)


def allocate_solver(
    P: ContactProblem, history: int = 0
) -> tuple[ContactState, ContactWorkspace, SolverSettings, FactorStorage]:
    """State, scratch, choices and an empty factor for a problem.

    Parameters
    ----------
    P : Problem
    history : int
        Rows of the history of residuals; none is kept if 0.

    Returns
    -------
    State, Scratch, Choices, Factor
        The state is zero; the choices say: all islands, 100 iterations at most, 1e-6 m/s is enough, the convex form.
    """
    nc, nn, nl, nw = len(P.mu), len(P.node), len(P.line_at), int(P.group[-1])
    X = ContactState(np.zeros((nc, 3)), np.zeros((len(P.turn), 3)), np.zeros(nl), np.zeros((nn, 8)), np.zeros(nw))
    W = ContactWorkspace(
        rows=np.zeros((17, nc, 3)),
        nodes=np.zeros((6, nn, 8)),
        wide=np.zeros((6, nw)),
        lines=np.zeros((9, nl)),
        own=cache_aligned(nn + 1, 8),
        inner=cache_aligned(nn + 1, 8),
        free=cache_aligned(nn + 1, 8),
        free_wide=np.zeros(nw),
        packed=cache_aligned(nc, PACKED_NUMBERS).ravel(),
        sides=np.zeros((nc, 3), np.int64),
    )
    O = SolverSettings(SettingCounts.blank(), SettingReals.blank(), np.zeros((history, 4)))
    O.count[:3] = 100, -1, history > 0
    O.real[0] = 1e-6
    return X, W, O, FactorStorage(np.zeros(0), np.zeros(0, np.int64))


def solve_contacts(
    solver: Kernel, P: ContactProblem, X: ContactState, W: ContactWorkspace, O: SolverSettings, F: FactorStorage
) -> int:
    """Solve in place.

    Parameters
    ----------
    solver : Kernel
        Of a file of this folder: `gauss_seidel.gauss_seidel`, ...
    P, X, W, O, F : Problem, State, Scratch, Choices, Factor
        See `problem` and `allocate_solver`.

    Returns
    -------
    int
        Iterations used; how it ended, and how well, stands in O.
    """
    return int(solver(P, X, W, O, F, 0))
