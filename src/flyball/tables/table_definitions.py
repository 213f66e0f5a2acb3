"""Table definitions: the mechanism (`System`), its workspace (`Work`), contact properties (`Surfaces`).

Uniform tables, one row for each element, sorted by kind; every loop of the engine runs over these. Integers hold
structure (incidence, places of matrix entries), floats hold values: changing a parameter changes floats only. Constants
number kinds, modes and columns.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Annotated, Any, NamedTuple, TypeVar

import numpy as np

from ..compiler.struct_layout import (
    COMPLEX,
    CodeTables1,
    Column,
    Float1,
    Float2,
    Float3,
    Int1,
    Int2,
    Number1,
    Number2,
    Record,
    Vector3,
    Vector6,
    Vector9,
)
from ..constraints.registry import BY_ADDRESS
from ..numerics.sparse_factorisation import LDLPattern

T = TypeVar("T", bound=tuple)
# kinds of tree joints, and how many coordinates and velocities each has (POINT in the plane: 2)
FREE, PLANAR, POINT, REVOLUTE, PRISMATIC, SPHERICAL, WELD = range(7)
TREE_NQ, TREE_NV = (7, 3, 3, 1, 1, 4, 0), (6, 3, 3, 1, 1, 3, 0)
BETWEEN, ALONG, SLIDING = range(3)  # families of forces: `Forces.family`
FORCE_BY_ADDRESS = 1000  # kind of forces with a code table: not the number of a built-in element
# directions of zero crossings
FALLING, EITHER, RISING = -1, 0, 1
# entries of System.flat: the length of Work.flat, then addresses; `engine/calls.py` describes each
SCRATCH, PREPARE, PLACE, MOVE, LOADS, FACTOR, REUSE, STEP, STEP_UNLOADED, REFINE, FINISH, DRIFT, SHOW, SAMPLED, FLAT = (
    range(15)
)
# reserved entries of Work.flat: size of the terms in `DRIFT`; whether the current solve is loaded; inputs of a law;
# residual of the rows after `REFINE`
TERMS, LOADED, LAW_INPUT, LAW_INPUT_RATE, ROW_RESIDUAL, FIRST_FREE = range(6)

# how the equations are solved: `Sizes.solver`
SCHUR, COUPLED, ARTICULATED = range(3)

TERM_KINDS = BY_ADDRESS + 1
FIELD_WIDTHS = {
    "inertia": 9, "inverse_inertia": 9, "excess_inertia": 9, "joint_position": 3, "joint_rotation": 9,
    "body_position": 3, "body_rotation": 9, "position": 3, "rotation": 9,
}  # fmt: skip
"""Widths of the fields with several columns."""


class Tree(NamedTuple):
    """Forest of bodies: a row (nb,) for each body, or each primitive of a tree joint, parents first."""

    parent: Int1  # the row that carries it; -1: ground
    joint: Int1  # kind of the tree joint to its parent
    q: Int1  # its first coordinate
    v: Int1  # its first velocity
    nq: Int1  # number of its coordinates
    nv: Int1  # number of its velocities
    law: Int1  # law of the driver that prescribes its one coordinate; -1: none
    work: Int1  # state of that driver's work; -1: none

    def coordinates(self, b: int) -> slice:
        """Slice of the coordinates of a row."""
        return slice(int(self.q[b]), int(self.q[b] + self.nq[b]))

    def velocities(self, b: int) -> slice:
        """Slice of the velocities of a row."""
        return slice(int(self.v[b]), int(self.v[b] + self.nv[b]))


class Bodies(NamedTuple):
    """Numbers of the rows of `Tree` [SI units, (nb, ...)]; matrices row by row."""

    mass: Number1
    inertia: Number2  # (nb, 9): about the centre of mass, in body axes
    inverse_inertia: Number2  # (nb, 9): with `excess_inertia`
    excess_inertia: Number2  # (nb, 9): added where a principal inertia is zero, and removed again by the solve
    joint_position: Number2  # (nb, 3): of the tree joint's frame on the parent, from the parent's centre of mass
    joint_rotation: Number2  # (nb, 9)
    body_position: Number2  # (nb, 3): of the centre of mass in the frame beyond the tree joint
    body_rotation: Number2  # (nb, 9)
    inverse_mass: Number1  # with `excess_mass`
    inverse_reference_inertia: Number1  # of a body of that mass as large as the reach of its frames
    offset: Number1  # value of the tree joint's coordinate in the reference configuration
    joint_turned: Number1  # 0 where `joint_rotation` is the identity: no need to multiply
    body_turned: Number1  # 0 where `body_rotation` is
    excess_mass: Number1  # added to a zero mass, and removed again by the solve
    inverse_reference_mass: Number1  # of the typical mass


class Frames(NamedTuple):
    """Frames that elements use, those on ground first [(nf, ...)]."""

    position: Number2  # (nf, 3): from the body's centre of mass, in body axes [m]
    rotation: Number2  # (nf, 9)


class Terms(NamedTuple):
    """Terms of constraint rows and measured quantities, sorted by kind [(nt,)]."""

    row: Int1  # measured quantities are counted after the rows
    F: Int1  # frame
    M: Int1  # frame
    segment: Int1  # first of its `Segments`
    segment_end: Int1
    hint: Int1  # state used for turns of an angle or a place on a curve; -1: none


class Segments(NamedTuple):
    """Which entries of the Jacobian a term adds to [(ns,)]."""

    body: Int1
    side: Int1  # +1: that of frame M, -1: of frame F
    entry: Int1  # first in `Work.G`


OF_RATE = 2
"""Value of `Rows.wrapped`: the law prescribes the rate of the quantity, which has no value."""


class Rows(NamedTuple):
    """Constraint rows [(nr,)]."""

    law: Int1  # law that its quantity follows; -1: 0
    wrapped: Int1  # 1 if it is an angle, compared up to whole turns; OF_RATE if the law is that of its rate
    work: Int1  # state of its work; -1: none


class SensorDrivers(NamedTuple):
    """Drivers whose laws name sensors: the law's slope times the sensor's gradient joins the row [(nx,)]."""

    row: Int1
    slot: Int1  # of the sensor
    to: Int1  # first entry of G
    start: Int1  # first entry of the sensor's gradient
    entries: Int1  # how many


class Forces(NamedTuple):
    """Forces, sorted by kind [(nk, ...)]."""

    F: Int1  # frame; of a force along a measured quantity the quantity, of contact friction its slips
    M: Int1  # frame
    laws: Int2  # (nk, 3)
    work: Int1  # state of its work; -1: none
    load: Int1  # column of its load in `Work.sensed`; -1: none
    kind: Int1
    family: Int1  # BETWEEN, ALONG, SLIDING
    switch: Int1  # its switch; -1: none
    state: Int1  # its first state, among those of controllers; -1: none


class Angles(NamedTuple):
    """Angles whose turns are counted [(na,)]."""

    F: Int1
    M: Int1
    state: Int1


class LoadTerms(NamedTuple):
    """Terms that make up the reaction behind a load or a force that events name [(nj,)]."""

    load: Int1  # column in `Work.sensed`
    term: Int1


class Switches(NamedTuple):
    """Rows with modes [(nw,)]."""

    row: Int1  # -1: none
    measured: Int1  # quantity
    forces: Int1  # that the row can carry: NO_ROW, ANY_FORCE, ... of `constraints.switches.switch_kind`
    force: Int1  # force that acts while it slides; -1: none
    law: Int1  # nonsmooth point of a law; -1: none
    partner: Int1  # of a slip, the slip along the other tangent; -1: none
    other: Int1  # of a slip, its gap; -1: none


class SwitchNumbers(NamedTuple):
    """Numbers of `Switches`; 0 where a kind does not have them, bounds -inf and inf [(nw,)]."""

    lower: Number1
    upper: Number1
    restitution: Number1
    stiffness: Number1
    damping: Number1
    tooth: Number1  # of a ratchet: position of a tooth
    pitch: Number1
    static_friction: Number1  # of a slip: coefficient at rest
    kinetic_friction: Number1
    strength: Number1  # largest force that the row can hold, where no force element gives it


class Guards(NamedTuple):
    """Guards: functions whose zeros are events [(ng,)]."""

    kind: Int1
    of: Int1  # switch or law
    direction: Int1  # FALLING, EITHER, RISING


class MassEntries(NamedTuple):
    """Entries of the mass matrix; only for the coupled matrix [(nM,)]."""

    row: Int1
    column: Int1
    place: Int1  # in `Work.A`


class Pairs(NamedTuple):
    """Products of blocks of G that add up to G M^-1 G^T [(np,)]."""

    first: Int1  # first entry of one block
    second: Int1
    length: Int1
    place: Int1  # in `Work.A`


class Blocks(NamedTuple):
    """Blocks of G [(ne,)]."""

    body: Int1
    entry: Int1  # first
    row: Int1


class Sizes(Record, kind="Int"):
    """Solver and numbers of rows."""

    solver: int  # SCHUR, COUPLED or ARTICULATED
    coordinates: int
    moving_frames: int  # frames that are updated at every state
    ground_frames: int  # number of those on ground


class Scales(Record, kind="Number"):
    """Scales for comparisons."""

    regularization: float  # of the solve, relative
    semidefinite: float  # 1 if some mass or inertia is zero, else 0
    length: float  # a typical length [m]
    rate: float  # characteristic rate [1/s]; 0 if neither gravity nor a speed determines it


class System(NamedTuple):
    """A mechanism in arrays. Constant during an analysis."""

    tree: Tree
    bodies: Bodies
    frame_body: Int1  # (nf,): body of each frame, -1: ground
    frames: Frames
    terms: Terms
    term_parameters: Number2  # (nt, 8): parameters of its formula, the last one its factor in the row
    term_code: CodeTables1  # (nt,): code table of a user-defined row (`ConstraintRow`); 0 of others
    segments: Segments
    rows: Rows
    row_start: Int1  # (nr + nm + 1,): first entry of each row, then of each measured quantity, in Work.G
    column: Int1  # (nG,): velocity of each entry of Work.G
    sensor_drivers: SensorDrivers
    forces: Forces
    force_parameters: Number2  # (nk, 16)
    force_code: CodeTables1  # (nk,): code table of a user-defined force; 0 of others
    angles: Angles
    load_terms: LoadTerms
    switches: Switches
    switch_numbers: SwitchNumbers
    guards: Guards
    guard_code: CodeTables1  # (ng,): code table of the guard of a user's kind of switch; 0 of others
    control_laws: Int1  # (nc,): law of the rate of each controller's state, the first of all states; -1: sampled
    kind_terms: Int1  # (TERM_KINDS + 1,): first term of each kind
    sizes: Sizes
    code: Int1  # bytecode of the laws
    const: Number1  # parameters, literals of the laws, splines, numbers of forces
    surfaces: Float1  # surfaces of roads (`math.grid_spline`)
    gravity: Number1  # (3,) [m/s^2]; where a component is a law, its value at t = 0
    gravity_laws: Int1  # (4,): law of each component, -1: constant; state of the work of their changes, -1: none
    scales: Scales
    units: Number1  # (nm,): unit of each measured quantity: the mechanism's length, or a radian
    velocity_units: Number1  # (nv,): the same of each coordinate whose rate is a velocity
    rotor_inertia: Number1  # (nv,): inertia that rotors add to the mass matrix along each velocity [kg], [kg m^2]
    row_levers: Number1  # (nr,): factor that turns the value of a row into a length: 1, or of angles the length [m]
    entry_sizes: Number1  # (nG,): size of each entry of Work.G for the length of a body
    mass_entries: MassEntries
    pairs: Pairs
    blocks: Blocks
    ldl: LDLPattern  # the sparse factor
    flat: Int1  # (15,): code generated for this mechanism: length of its scratch, addresses; all 0: there is none


NUMBERS = (
    "bodies", "frames", "term_parameters", "force_parameters", "switch_numbers", "const", "gravity", "scales", "units",
    "velocity_units", "rotor_inertia", "row_levers", "entry_sizes",
)  # fmt: skip
"""Fields of `System` that hold floats: they change with parameters, and may be complex, or expressions."""


def zero_table(of: type[T], n: int, dtype: Any) -> T:
    """Table of n rows of zeros."""
    return of(*(np.zeros((n, FIELD_WIDTHS[name]) if name in FIELD_WIDTHS else n, dtype) for name in of._fields))  # type: ignore[attr-defined]


def named_arrays(table: Any, name: str = "") -> Iterator[tuple[str, np.ndarray]]:
    """Every array of a table and of tables in it, with its name: ``"bodies.mass"``."""
    if not isinstance(table, tuple):
        yield name, table
        return
    for field, x in zip(table._fields, table, strict=True):  # type: ignore[attr-defined]
        yield from named_arrays(x, f"{name}.{field}" if name else field)


def map_arrays(function: Callable[[str, np.ndarray], Any], table: Any, name: str = "") -> Any:
    """Table with ``function(array, name)`` in place of each array."""
    if not isinstance(table, tuple):
        made = function(name, table)
        return made.view(type(table)) if isinstance(table, Record) else made
    fields = zip(table._fields, table, strict=True)  # type: ignore[attr-defined]
    return type(table)(*(map_arrays(function, x, f"{name}.{field}" if name else field) for field, x in fields))


def assign(to: Any, table: Any) -> None:
    """Copy all arrays of a table into those of another."""
    for (_, x), (_, y) in zip(named_arrays(to), named_arrays(table), strict=True):
        x[...] = y


def copied(table: Any) -> Any:
    """Return a copy of a table with arrays of its own."""
    return map_arrays(lambda _, x: x.copy(), table)


def with_numbers(S: System, function: Callable[[str, np.ndarray], Any], names: Sequence[str] = NUMBERS) -> System:
    """Table with ``function(array, name)`` in place of each array of floats."""
    return S._replace(**{name: map_arrays(function, getattr(S, name), name) for name in names})


class RowScratch(NamedTuple):
    """Workspace of the constraint rows [(nr,)]."""

    value: Number1  # g
    nu: Number1  # right-hand side of G v = nu
    gamma: Number1  # right-hand side of G vdot = gamma
    diagonal: Number1  # diagonal of the factored matrix, before regularisation
    multiplier: Number1
    scratch_1: Number1
    scratch_2: Number1
    residual: Number1
    nu_dot: Number1


class VelocityScratch(NamedTuple):
    """Workspace of the velocities [(nv,)]."""

    applied: Number1  # generalised forces
    solved: Number1  # accelerations, or another solution
    scratch_1: Number1
    scratch_2: Number1
    scratch_3: Number1
    prescribed: Number1  # accelerations that drivers prescribe
    effort: Number1  # of these drivers
    partition: Number1  # size of the coordinate: > 0 if it is dependent, < 0 if independent, 0 if it is prescribed


class Modes(NamedTuple):
    """Modes of the switches [(nw, ...)]."""

    mode: Number1  # OFF, HELD, STEADY
    hold: Number1  # value at which the quantity is held
    lower: Number1  # lower bound
    upper: Number1
    released: Number1  # whether an event has released the element
    shared: Number1  # weight of a row of a group with indeterminate forces, 0 of others (`engine/guards.py`)
    drift: Number1  # of nonsmooth points that hold the motion: du/dt
    previous_side: Number1  # side and du/dt of the pass before
    previous_drift: Number1
    moved_side: Number1  # scratch
    given_side: Number1
    inverse_slopes: Number2  # (nw, nw): sides by du/dt


class Options(Record, kind="Float"):
    """Options of the analysis, and its diagnostics."""

    stabilization: float
    position_tolerance: float
    velocity_tolerance: float
    alpha: float  # of Baumgarte's stabilization
    beta: float
    position_violation: float  # largest violation so far
    velocity_violation: float
    solve_tolerance: float  # relative residual at which a solve is accepted
    partitioned: float  # whether solves are for the dependent coordinates only
    deferred: float  # whether accelerations at output times are computed only when needed
    placed: float  # whether only positions and velocities are needed
    factored: float  # whether the factor is of the positions at which accelerations are evaluated next
    rate: float  # characteristic rate [1/s]: that of the tables, or one per duration of the motion


class Counts(Record, kind="Int"):
    """Counters of a run."""

    status: int
    guilty_row: int  # the row that caused a failure
    evaluations: int
    factorisations: int
    solves: int
    projections: int
    load_updates: int  # number of loads whose slopes are known
    exchanges: int  # exchanges of dependent coordinates


class Sensed(Record, kind="Number", vectors=True):
    """What laws and switches read.

    Its columns: the measured quantities; the rates of these as values; the loads of joints; forces that events name
    (`loads.update_readings`); controllers' states (`rows.controller_column`); the direction of each switch, which has a
    value only (`rows.direction_column`). Loads, in their columns, have entries of their own, and further rows with the
    inverse Jacobian of their gaps.
    """

    value: Column
    rate: Column
    bias: Column  # second derivative, without that by accelerations; of controllers the rate of the rate
    gap_before: Column  # gap of a load in the pass before
    broyden_product: Column  # scratch
    broyden_row: Column
    load: Annotated[np.ndarray, "value"]  # of a joint, now
    returned: Annotated[np.ndarray, "rate"]  # load that follows from the reactions
    load_before: Annotated[np.ndarray, "bias"]  # of the pass before


class KinematicRecords(Record, kind="Number", rows=True):
    """Kinematics of points with axes, in components along the world's axes."""

    position: Vector3
    rotation: Vector9  # row by row
    angular_velocity: Vector3
    velocity: Vector3
    bias_angular_acceleration: Vector3  # at vdot = 0
    bias_acceleration: Vector3
    angular_acceleration: Annotated[np.ndarray, "bias_angular_acceleration"]  # with vdot, where it was added
    acceleration: Annotated[np.ndarray, "bias_acceleration"]


class Wrenches(Record, kind="Number", rows=True):
    """Wrenches on bodies, in components along the world's axes."""

    force: Vector3
    torque: Vector3
    acceleration: Annotated[np.ndarray, "force"]  # by vdot alone, as scratch of `recorded_figures`
    angular_acceleration: Annotated[np.ndarray, "torque"]


class Twists(Record, kind="Number", rows=True):
    """Twists per unit of velocities, in components along the world's axes."""

    angular: Vector3
    linear: Vector3


class CompositeBodies(Record, kind="Number", rows=True):
    """Subtrees as rigid bodies, about the reference points of their roots."""

    mass: Column
    first_moment: Vector3
    inertia: Vector6  # xx, xy, xz, yy, yz, zz
    offset: Vector3  # from the reference point of the root's parent


class ArticulatedBodies(Record, kind="Number", rows=True):
    """Articulated inertias that bodies' children have stored, and what is passed along branches in solves."""

    rotational: Vector6  # J, H, K of `engine/articulated_body.py`
    coupling: Vector9
    linear: Vector6
    eliminated: Column  # part of the trace of J
    mass: Column
    stored: Column  # 1 where there is such an inertia
    torque: Vector3
    force: Vector3
    angular_acceleration: Annotated[np.ndarray, "torque"]
    acceleration: Annotated[np.ndarray, "force"]


class Pivots(Record, kind="Number", rows=True):
    """Velocities eliminated from articulated inertias."""

    torque: Vector3  # U = I X: the wrench per unit acceleration
    force: Vector3
    inertia: Column  # D = X . U
    inverse_inertia: Column


class FactorVectors(Record, kind="Number", vectors=True):
    """Vectors of the factored matrix and of solves with it."""

    inverse_diagonal: Float1
    scratch: Float1
    right_hand_side: Float1


class TrialState(Record, kind="Number", vectors=True):
    """State at which equations are evaluated."""

    state: Float1
    rate: Float1


class Work(NamedTuple):
    """Workspace of one run on one thread: nothing is allocated inside the loops."""

    bodies: KinematicRecords  # (nb,): of the centres of mass
    frames: KinematicRecords  # (nf,): of the origins
    twists: Twists  # (nv,): of each velocity, at its body's reference point
    O: Number2  # (nb, 3): that reference point
    body_wrenches: Wrenches  # (nb,): on each body, about its centre of mass
    composites: CompositeBodies  # (nb,)
    articulated: ArticulatedBodies  # (nb,)
    pivots: Pivots  # (nv,)
    M: Number1  # (nM,): mass matrix entries
    G: Number1  # (nG,): constraint Jacobian, then gradients of the measured quantities
    H: Number1  # (nG,): M^-1 G^T
    term_wrenches: Wrenches  # (nt,): of each term on M, where loads are needed; else (0,)
    rows: RowScratch
    velocities: VelocityScratch
    sensed: Sensed  # (2 nm + nl + ne + nc + nw)
    modes: Modes
    A: Number1  # matrix to be factored
    L: Number1  # its factor
    ldl: FactorVectors  # (3, n)
    stack: Number2  # law evaluation
    trial: TrialState  # (2, ny)
    options: Options
    counts: Counts
    generated: Int1  # (15,): while generated code is in use, its addresses as in `System.flat`; else 0
    flat: Number1  # scratch of the generated code


ComplexSystem = Annotated[System, COMPLEX]
ComplexWork = Annotated[Work, COMPLEX]


# columns of Surfaces.pair
STATIC, KINETIC, RESTITUTION, ROLLING, SPINNING, ACROSS, STIFFNESS, MODULUS, EXPONENT, DISSIPATION, DAMPING = range(11)
SURFACE_COLUMNS = 12


class Surfaces(NamedTuple):
    """Properties of every pair of surfaces; the surface of a shape is its MATERIAL in the geometry.

    With a grain, friction is the value along it. Where the grain is perpendicular to the surface, the value across it
    applies in all directions.
    """

    # (k, k, 12): static and kinetic friction, restitution, rolling and spinning friction [m], ratio of both frictions
    # across to along the grain of one of the two (1: no grain); of the compliant normal force (0 if rigid): stiffness,
    # or 4/3 E* [Pa] from which it follows, exponent of the overlap, dissipation [s/m], damping [N s/m]; nan: no contact
    pair: Float3
    belt: Float2  # (ns, 3): velocity [m/s] of a shape's surface relative to its mover, in the mover's axes
    grain: Float2  # (ns, 3): direction (a unit vector, or 0) of its grain, in the mover's axes
