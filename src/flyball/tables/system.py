"""The compiled mechanism: a few constant arrays, and the scratch arrays of one run.

Uniform tables, one row per element, sorted by kind; every loop of the house runs over these. Integers hold structure
(who touches whom, where an entry goes), floats hold values: changing a parameter changes floats only.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from ..compiler.layout import COMPLEX, CodeTables1, Float1, Int1, Int2, Number1, Number2
from ..constraints.registry import BY_ADDRESS
from ..numerics.ldl import Pattern

# columns of System.body_i
# (law and work state: of the driver that prescribes the body's one coordinate, or -1)
PARENT, TREE, Q0, V0, NQ, NV, BODY_LAW, BODY_WORK = range(8)
# kinds of tree joints, and how many coordinates and velocities each has (POINT in the plane: 2)
FREE, PLANAR, POINT, REVOLUTE, PRISMATIC, SPHERICAL, WELD = range(7)
TREE_NQ, TREE_NV = (7, 3, 3, 1, 1, 4, 0), (6, 3, 3, 1, 1, 3, 0)
# columns of System.body_x
MASS, INERTIA, INVERSE, EXCESS, TREE_P, TREE_R, BODY_P, BODY_R = 0, 1, 10, 19, 28, 31, 40, 43
# (whether TREE_R and BODY_R differ from the identity: what does not need not be multiplied)
PER_MASS, PER_COMPACT, OFFSET, TREE_TURNS, BODY_TURNS = 52, 53, 54, 55, 56
# (what was added to a mass that is none, and the inverse of what its body would weigh if it were like the others)
EXCESS_MASS, PER_BULK, BODY_WIDTH = 57, 58, 59
# columns of System.term_i
TERM_ROW, TERM_F, TERM_M, TERM_SEG, TERM_SEG_END, TERM_HINT = range(6)
# columns of System.row_i
ROW_LAW, ROW_WRAP, ROW_WORK = range(3)
# columns of System.mix_i
MIX_ROW, MIX_SLOT, MIX_TO, MIX_FROM, MIX_COUNT = range(5)
# columns of System.force_i; forces along a measured quantity have its slot in place of frame F
BETWEEN, ALONG, SLIDING = range(3)  # families of forces: FORCE_ALONG
FORCE_F, FORCE_M, FORCE_LAW, FORCE_WORK, FORCE_LOAD, FORCE_KIND, FORCE_ALONG, FORCE_SWITCH = 0, 1, 2, 5, 6, 7, 8, 9
FORCE_BY_ADDRESS = 1000  # the kind of forces that have a code table: no built-in element's number
# columns of System.switch_i, and of switch_x; kinds of switches: see `model/switch.py`
SWITCH_ROW, SWITCH_MEASURED, SWITCH_KIND, SWITCH_FORCE, SWITCH_LAW, SWITCH_OTHER = range(6)
SWITCH_PARTNER = SWITCH_LAW  # of a slip: that along the other tangent, or -1
SWITCH_LOWER, SWITCH_UPPER, SWITCH_BOUNCE, SWITCH_STIFFNESS, SWITCH_DAMPING = range(5)
SWITCH_TOOTH, SWITCH_PITCH = 0, 1  # of a ratchet
SWITCH_REST, SWITCH_SLIDING = range(2)  # coefficients of friction of a slip
# rows of Work.switch; and modes: the row counts for nothing, holds its quantity where it is, or at rest
MODE, HOLD, LOWER, UPPER, SPARE = range(5)
# (weight of a row of a group that shares what it holds, 0 of others: `equations/sharing.py`)
SHARED = 5
# (of corners of laws that hold the motion: du/dt; side and du/dt of the pass before; scratch; sides by du/dt)
DRIFT_OFF, SIDE_BEFORE, DRIFT_BEFORE, SIDE_MOVED, SIDE_TOLD, INVERSE_SLOPES = range(6, 12)
OFF, HELD, STEADY = 0.0, 1.0, 2.0
# columns of System.guard_i; kinds of guards; what a guard's zero is watched for
GUARD_KIND, GUARD_OF, GUARD_WAY = range(3)
G_LAW, G_LOWER, G_UPPER, G_PULL, G_HOLDS, G_SLIDES, G_BACK, G_CORNER, G_PRESS_LOWER, G_PRESS_UPPER = range(10)
G_CONE, G_TURNS, G_ASTRAY, G_SHARED = range(10, 14)
FALLING, EITHER, RISING = -1, 0, 1
# columns of System.control_i: the law of a state's rate (-1: it is held between instants)
CONTROL_RATE = 0
# rows of Work.row, each (nr,)
G_VALUE, NU, GAMMA, DIAGONAL, LAM, R1, R2, RESIDUAL, NU_DOT = range(9)
# rows of Work.vel, each (nv,)
# (in the last: of each coordinate the size, > 0 if it depends on the others, < 0 if not, 0 if it is prescribed)
F_APPLIED, X_SOLVED, V1, V2, V3, GIVEN, EFFORT, PARTITION = range(8)
# rows of Work.sensed: of each measured quantity; then, columns of their own, of its rate as a value
VALUE, RATE, BIAS = range(3)
# in the columns after those, of each load of a joint: the load now, the one returned; load and gap of the pass before;
# scratch; and the inverse Jacobian of the gaps. Then forces that events name (`readings`). Then value, rate and its
# rate of each controller's state (`control.column_of`). Then, in row VALUE, the way of each switch (`rows.way_of`)
LOAD, RETURNED, LOAD_BEFORE, GAP_BEFORE, MOVED, TOLD, INVERSE_JACOBIAN = range(7)
# entries of Work.option
STABILIZE, TOL_G, TOL_V, ALPHA, BETA, WORST_G, WORST_V, PASS, PARTED, LATER, PLACED = range(11)
# entries of Work.info
STATUS, GUILTY, EVALUATIONS, FACTORISATIONS, SOLVES, PROJECTIONS, LEARNT, EXCHANGES = range(8)
# from there on, while code made for the mechanism is in use, its addresses; 0: the loops over the tables do it
MADE = 8
# entries of System.flat: the length of Work.flat, then addresses; what each does is said in `equations/made.py`
SCRATCH, PREPARE, PLACE, MOVE, LOADS, FACTOR, REUSE, STEP, STEP_UNLOADED, REFINE, FINISH, DRIFT, SHOW, SAMPLED, FLAT = (
    range(15)
)

# entries of System.kinds from its end, and what may stand in the first: how the equations are solved
SOLVER, COORDINATES, FRAMES, GROUND_FRAMES = -4, -3, -2, -1
SCHUR, COUPLED, ARTICULATED = range(3)
# entries of System.glob after the three of gravity
REGULARISE, SEMIDEFINITE, LENGTH = 3, 4, 5
# (a rate of its own [1/s]: see `tempo`; from there on what each measured quantity is compared with: that length, or a
# radian)
TEMPO, UNIT = 6, 7

TERM_KINDS = BY_ADDRESS + 1


class System(NamedTuple):
    """A mechanism in arrays. Nothing in it changes during an analysis."""

    body_i: Int2  # (nb, 8): parent, tree joint kind, first q, first v, number of q, of v, law, its work
    body_x: Number2  # (nb, 59): mass properties, their inverses and stand-ins; frames of tree joints, their offset
    frame_i: Int1  # (nf,): body; frames on ground (-1) come first
    frame_x: Number2  # (nf, 12): position from the body's centre of mass and rotation, in body axes
    term_i: Int2  # (nt, 6): row (measured quantities after the rows), frame F, M, segments, state it leans on
    term_x: Number2  # (nt, 8): parameters of the formula, the last one the coefficient in the row
    term_code: CodeTables1  # (nt,): code table of a row of a user's own (`ConstraintRow`); 0 of others
    seg_i: Int2  # (ns, 3): body, side (+1 M, -1 F), first entry in Work.G
    row_i: Int2  # (nr, 3): law or -1, wrapped angle or not, work state or -1
    row_p: Int1  # (nr + nm + 1,): first entry of each row, then of each measured quantity, in Work.G
    col_i: Int1  # (nG,): velocity of each entry of Work.G
    mix_i: Int2  # (nx, 5): drivers that follow sensors: row, slot, entries of G to and from, count
    force_i: Int2  # (nk, 10): F, M, three laws, state of its work, its load (or -1), kind, family, switch or -1
    force_x: Number2  # (nk, 16): parameters of the formula
    force_code: CodeTables1  # (nk,): code table of a force of a user's own; 0 of others
    angle_i: Int2  # (na, 3): frame F, frame M, state that counts its turns
    load_i: Int2  # (nj, 2): terms that make up the reaction behind a load: load, term; see `reads` too
    switch_i: Int2  # (nw, 6): rows with modes: row, measured quantity, kind, force that slides, law, another
    switch_x: Number2  # (nw, 8): parameters of each, by its kind
    guard_i: Int2  # (ng, 3): what is watched for zeros: kind, switch or law, which way
    control_i: Int2  # (nc, 1): states of controllers, the first of all states: law of the rate
    # first row of each kind of term; solver; number of q; frames that are kept up to date, those of them on ground
    kinds: Int1
    code: Int1  # bytecode of the laws
    const: Number1  # parameters, literals of the laws, splines
    glob: Number1  # (7 + nm,): gravity, relative regularisation, semidefinite mass or not, size, pace (`UNIT`)
    mass_i: Int2  # (nM, 3): entries of M: row, column, place in A; only for the coupled matrix
    pair_i: Int2  # (np, 4): products of G blocks that add up to S: first, second entry, length, place in A
    block_i: Int2  # (ne, 3): blocks of G: body, first entry, row
    ldl: Pattern  # the sparse factor
    flat: Int1  # (15,): code made for this mechanism: length of its scratch, addresses; all 0: there is none


class Work(NamedTuple):
    """Scratch of one run on one thread: nothing is allocated inside the loops."""

    BK: Number2  # (nb, 24): kinematics of the bodies
    FK: Number2  # (nf, 24): kinematics of the frames
    X: Number2  # (nv, 14): world twist column of each velocity, at its body's reference point; then its factor
    O: Number2  # (nb, 3): that reference point
    FB: Number2  # (nb, 6): force on each body, torque about its centre of mass
    IC: Number2  # (nb, 30): composite inertias; articulated inertias, and what solves with them pass on
    M: Number1  # (nM,): mass matrix entries
    G: Number1  # (nG,): constraint Jacobian, then gradients of the measured quantities
    H: Number1  # (nG,): M^-1 G^T
    T: Number2  # (nt, 6): wrench of each term on M, where loads are wanted; else (0, 6)
    row: Number2  # (9, nr)
    vel: Number2  # (8, nv)
    sensed: Number2  # (6 + nl, 2 nm + nl + ne + nc + nw): value, rate, bias measured; loads; forces; controls; ways
    switch: Number2  # (12 + nw, nw): of each row with modes: its mode, where it is held, how far it may go; slopes
    A: Number1  # matrix to be factored
    L: Number1  # its factor
    D: Number2  # (3, n): inverse diagonal, scratch, right-hand side
    stack: Number2  # law evaluation
    y: Number2  # (3, ny): states in the making
    option: Float1  # (11,): choices of the analysis, largest violations reported, what is solved for
    info: Int1  # (23,): status, guilty row, counters, how many loads' slopes are known, one more; addresses
    flat: Number1  # scratch of code made for the mechanism


ComplexSystem = Annotated[System, COMPLEX]
ComplexWork = Annotated[Work, COMPLEX]
# kinematic record of a body or frame: p 0:3, R 3:12, w 12:15, v 15:18, alpha_bias 18:21, a_bias 21:24
