"""Setup of impulse time stepping: free bodies and jointed mechanism, their start, and the stepper.

Step and tolerance follow from the size and the speed of the scene where they are not given.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...assembly.assemble import assemble
from ...assembly.assembled_state import Assembly
from ...assembly.compiled_mechanism import compile_mechanism
from ...collision.tables import Movers
from ...engine.calls import OutputBuffer
from ...engine.entry_point import MOTION
from ...engine.residual import DIRECTIONS, SLOPE_WIDTH
from ...engine.stabilization import STEPS
from ...errors import ModelError
from ...forces.coordinate_spring import measuring_spring
from ...forces.limit import Limit
from ...math.vec import quaternion_matrix
from ...model.controller import IMU
from ...model.force import CoordinateForce, TwoPointForce
from ...model.geometry import matrix_to_quaternion
from ...model.model import Model
from ...model.names import curve_parts
from ...numerics.integrators.butcher_tableaux import tableau
from ...numerics.integrators.time_loop import StateVectors, StepCounts, StepReals, StepState
from ...numerics.sparse_factorisation import COLUMNS
from ...numerics.thread_team import default_threads
from ...results.events import cumulative_exchanges, energies_at_end
from ...results.health import Health
from ...results.result import Result
from ...tables import table_definitions as su
from ...tables.contact_places import rigid_stops
from ...tables.contact_tables import ContactTables
from ...tables.reference_configuration import BodyState
from ...tables.structure_definition import Structure
from ...tables.table_definitions import BETWEEN, System
from ...tables.values import Values
from ..initial_state import InitialState, find_initial_state, initial_state_at
from ..integration_intervals import Segment
from ..integration_options import DEFAULT_DIRECTIONS, PYRAMIDS, RESTITUTION_LAWS, Stepping
from .impulse_stepper import ImpulseStepper, SolveRecorder, free_bodies
from .mechanism_step import MIXED_GUESSES, MIXING_ROWS
from .stepping_tables import (
    LINE_FRICTION,
    LINE_ROPE,
    LINE_STOP,
    NO_RESTITUTION,
    ActiveRows,
    Jobs,
    MechanismCounts,
    MechanismReactions,
    MechanismReals,
    MechanismTables,
    MechanismVelocities,
    SingleRowLaws,
    SingleRows,
    Springs,
    initial_run_state,
)

# The scene has a size, the median radius of its bodies, and a speed, sqrt(g size): that of a body that has fallen by
# half its size. Steps are proportional to size / speed, tolerances to the speed, so that a scene drawn in another size,
# or in other units, is stepped alike. At 0.1 m and 9.81 m/s^2 the speed is 0.99 m/s: steps of 5 ms, and 1e-5 m/s.
STEP_FRACTION = 0.05  # step relative to size / speed
TOLERANCE_FRACTION = 1e-5  # tolerance relative to the speed
MOVING_FRACTION = 0.5  # speed of a scene relative to that of its fastest body: it moves a tenth of the size in a step
RADIUS_OF_MECHANISM = 0.1  # size of a mechanism without shapes, relative to its length
UNKNOWN_STEP, UNKNOWN_TOLERANCE = 5e-3, 1e-5  # [s], [m/s], of a scene at rest without gravity and forces


@dataclass(frozen=True)
class StepSize:
    """Longest step and tolerance of impulse time stepping.

    Attributes
    ----------
    step : float [s]
    tolerance : float [m/s]
    reason : str
        Why this step.
    """

    step: float
    tolerance: float
    reason: str

    @property
    def text(self) -> str:
        """The step and its reason, for people."""
        return f"at most {self.step:.3g} s, {self.reason}"


@dataclass(frozen=True)
class SceneScale:
    """Size [m] and speed [m/s] of a scene (0: at rest without gravity and forces), and both in words."""

    size: float
    speed: float
    text: str


def smallest_radius(scene: ContactTables, values: Values) -> float:
    """Return the radius [m] of the smallest shape; the mechanism's length if all are unbounded."""
    sizes = scene.geometry.dimensions.radius[:]
    bounded = sizes[np.isfinite(sizes)]
    return float(bounded.min() if len(bounded) else values.length)


def body_radii(scene: ContactTables) -> np.ndarray:
    """Return the radius of each mover's bounding sphere about its mass centre, (n,); 0 without shapes, or unbounded."""
    shapes = scene.geometry.dimensions
    out = np.zeros(len(scene.carriers.mass))
    mover = scene.geometry.shape.mover[:]
    reach = np.sqrt((shapes.place[:] ** 2).sum(axis=1)) + shapes.radius[:]
    known = (mover >= 0) & np.isfinite(reach)
    np.maximum.at(out, mover[known], reach[known])
    return out


def scene_scale(scene: ContactTables, M: Movers, values: Values, held: InitialState | None) -> SceneScale:
    """Return the size and the speed of a scene at its start; ``held`` is the start of its jointed mechanism."""
    radii = body_radii(scene)
    if (radii > 0.0).any():
        size = float(np.median(radii[radii > 0.0]))
        what = f"bodies of radius {size:.3g} m"
    else:
        size = RADIUS_OF_MECHANISM * values.length
        what = f"a mechanism of {values.length:.3g} m"
    v, w = (np.sqrt((x**2).sum(axis=1)) for x in (M.twist[:, :3], M.twist[:, 3:]))
    fastest = float((v + w * radii).max(initial=0.0))
    g, cause = float(np.linalg.norm(values.system.gravity)), "under gravity"
    if held is not None:
        fastest = max(fastest, _largest(held, held.assembly.v))
        if g == 0.0 and (g := _initial_acceleration(held)) > 0.0:
            cause = f"at {g:.3g} m/s^2 at the start"
    falling, moving = math.sqrt(g * size), MOVING_FRACTION * fastest
    return SceneScale(
        size, max(falling, moving), f"{what} {cause if falling >= moving else f'at {fastest:.3g} m/s at the start'}"
    )


def _largest(start: InitialState, rates: np.ndarray) -> float:
    """Return the largest of velocities or accelerations; angular ones times the mechanism's length."""
    c = start.assembly.compiled
    return float(np.abs(rates * c.values.length / c.sizes).max(initial=0.0))


def _initial_acceleration(start: InitialState) -> float:
    """Return the largest acceleration of a mechanism at its start; 0 if the equations have no solution there."""
    a = start.assembly
    c = a.compiled
    solved = c.at(a.t, a.q, a.v, MOTION)[0] == 0
    return _largest(start, c.work.velocities.solved) if solved else 0.0


def choose_step(
    o: Stepping,
    scene: ContactTables,
    M: Movers,
    values: Values,
    held: InitialState | None = None,
    before: Health | None = None,
) -> StepSize:
    """Return the longest step and the tolerance: as given, of the earlier motion, or by the scale of the scene.

    Parameters
    ----------
    o : Stepping
    scene : ContactTables
    M : Movers
        At the start.
    values : Values
    held : InitialState, optional
        Start of the jointed mechanism.
    before : Health, optional
        Of the motion that this one continues.
    """
    found = _earlier_choice(before) or _choice_by_scale(scene_scale(scene, M, values, held))
    if o.step is not None:
        found = dataclasses.replace(found, step=float(o.step), reason="as given")
    elif o.limit < found.step:
        found = dataclasses.replace(found, step=o.limit, reason="by max_step")
    return found if o.tolerance is None else dataclasses.replace(found, tolerance=o.tolerance)


def _choice_by_scale(x: SceneScale) -> StepSize:
    if x.speed == 0.0:
        why = "the usual step, since without gravity and motion at the start the scene has no duration"
        return StepSize(UNKNOWN_STEP, UNKNOWN_TOLERANCE, why)
    return StepSize(STEP_FRACTION * x.size / x.speed, TOLERANCE_FRACTION * x.speed, f"for {x.text}")


def _earlier_choice(before: Health | None) -> StepSize | None:
    """Return the choice of the earlier motion if that made one."""
    if before is None or before.contact is None or not before.contact.step:
        return None
    given = before.options["method"]
    if given["step"] is not None or given["tolerance"] is not None:
        return None
    return StepSize(before.contact.step, before.contact.tolerance, "as in the motion that this one continues")


@dataclass(frozen=True)
class BodyPartition:
    """Names of the moving bodies.

    Attributes
    ----------
    free : tuple of str
        Bodies and sets of bodies on which only gravity and contact act.
    held : tuple of str
        The other bodies, those of one group after each other; see `velocity_groups`.
    """

    free: tuple[str, ...]
    held: tuple[str, ...]


def partition_bodies(model: Model, values: Values) -> BodyPartition:
    """Separate free bodies from those of the mechanism, by the tables of absolute coordinates."""
    S = values.system
    between = S.forces.family == BETWEEN
    frames = np.concatenate([S.terms.F, S.terms.M, S.forces.F[between], S.forces.M[between]])
    used = set(S.frame_body[frames[frames >= 0]].tolist())
    place = values.structure.place
    changing = bool((S.gravity_laws >= 0).any())
    if changing and model.bulk:
        raise ModelError(
            f"{model.bulk[0].title}: sets of bodies need constant gravity, and that of {model.name!r} is a law of "
            f"time; add each body as a Body"
        )
    held = [b.name for b in model.bodies if changing or place[b.name] in used]
    of, movers = connected_velocities(S, values.structure.nv)
    held.sort(key=lambda name: next((of[d] for d in movers[place[name]]), -1) if place[name] >= 0 else -1)
    return BodyPartition(
        (*(b.name for b in model.bodies if b.name not in held), *(b.name for b in model.bulk)), tuple(held)
    )


StopBounds = tuple[float, float, float]


def mechanism_tables(
    start: InitialState, bodies: Sequence[str], first: int, h: float, stops: Mapping[str, StopBounds] | None = None
) -> MechanismTables:
    """Create the mechanism's tables for steps of h seconds, at its start.

    Parameters
    ----------
    start : InitialState
        Of the mechanism alone.
    bodies : sequence of str
        Those that are movers, in the order of the movers from number ``first`` on.
    first : int
    h : float [s]
    stops : mapping, optional
        Forces without effect that represent stops of the coordinates along which they act: name to (lower end, upper
        end, restitution).
    """
    c = start.assembly.compiled
    s, S = c.structure, c.values.system
    of, group = velocity_groups(S, s.nv)
    rows = [s.place[name] for name in bodies]
    y = StateVectors.blank(len(start.y))
    y[0] = start.y
    width = max(len(start.y) + 1, s.nv, len(S.rows.law), 1)
    clock = StepState(
        StepReals.blank(), StepCounts.blank(), np.zeros(0), y, np.zeros((1, len(start.y))), np.zeros(0, np.int64)
    )
    slopes = np.zeros((len(s.forces), SLOPE_WIDTH))
    slopes[:, DIRECTIONS] = [force_directions(f) for f in s.forces]
    springs = int(slopes[:, DIRECTIONS].sum())
    c.work.options.stabilization, c.work.options.deferred = STEPS, 0.0
    S = S._replace(force_parameters=S.force_parameters.copy(), const=S.const.copy())
    line, law = single_rows(s, S, stops or {})
    A = MechanismTables(
        S, c.work, tableau("rk45"), clock, OutputBuffer(np.zeros((4, width))), OutputBuffer(slopes),
        np.zeros(1, np.int64),
        real=MechanismReals.blank(), count=MechanismCounts.blank(),
        mover=np.array([(b, of[b]) for b in rows], np.int64).reshape(-1, 2),
        group=group, velocities=MechanismVelocities(*np.zeros((8, s.nv))),
        reactions=MechanismReactions(*np.zeros((3, len(S.rows.law)))),
        springs=Springs.blank(springs), spring_J=np.zeros((springs, s.nv)), spring_Y=np.zeros((springs, s.nv)),
        stiff=np.zeros((springs, springs)), mixing=np.zeros((MIXING_ROWS, s.nv)),
        weight=np.zeros((MIXED_GUESSES + 1, MIXED_GUESSES + 1)),
        line=line, line_law=law, active=ActiveRows.blank(2 * len(line)),
        job=Jobs.blank(0), queue=np.zeros(len(group) - 1, np.int64),
        queued_row=np.zeros(len(group) - 1, np.int64), column=np.zeros((len(group) - 1, COLUMNS), np.int64),
        response=np.zeros((s.nv, COLUMNS)), response_impulse=np.zeros((len(S.rows.law), COLUMNS)),
        spring_response=np.zeros((springs, COLUMNS)), loaded=np.zeros(len(S.tree.parent), np.int64),
        pose=np.zeros((len(rows), 12)),
    )  # fmt: skip
    A.count.first = first
    A.real.time, A.real.step = start.assembly.t, h
    return A


def single_rows(s: Structure, S: System, stops: Mapping[str, StopBounds]) -> tuple[SingleRows, SingleRowLaws]:
    """Return the tables of single rows (stops, ropes, joint friction), and remove these from the forces."""
    line, laws = [], []
    for k, e in enumerate(s.forces):
        law = SingleRowLaws.blank(1)
        if e.name in stops:
            kind = LINE_STOP
            law.lower, law.upper, law.restitution = stops[e.name]
        elif e.single == "rope":
            kind = LINE_ROPE
            law.stiffness, law.damping, law.length = S.force_parameters[k, :3]
            S.force_parameters[k, :2] = 0.0
        elif e.single == "friction":
            kind = LINE_FRICTION
            law.arm = S.force_parameters[k, 0]
            S.force_parameters[k, 0] = 0.0
        else:
            continue
        line.append((kind, S.forces.F[k], k))
        laws.append(law)
    return (
        np.array(line, np.int64).reshape(-1, SingleRows.layout.width).view(SingleRows),
        np.concatenate([SingleRowLaws.blank(0), *laws]).view(SingleRowLaws),
    )


def force_directions(force) -> int:
    """Return the number of directions of a force's stiffness: see `engine.residual.force_slopes`."""
    return 1 if isinstance(force, (CoordinateForce, TwoPointForce)) else 6


def velocity_groups(S: System, nv: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the group of each row of the body table (-1: immovable), and the start of each group's velocities.

    All velocities form one group if those of some group are not contiguous.
    """
    of, movers = connected_velocities(S, nv)
    first = np.flatnonzero(np.r_[True, of[1:] != of[:-1]]) if nv else np.zeros(0, np.int64)
    if len(first) != len(np.unique(of)):
        of, first = np.zeros(nv, np.int64), np.zeros(1, np.int64)
    number = np.searchsorted(first, np.arange(nv), side="right") - 1
    return np.array([number[m[0]] if m else -1 for m in movers], np.int64), np.r_[first, nv].astype(np.int64)


def connected_velocities(S: System, nv: int) -> tuple[np.ndarray, list[list[int]]]:
    """Return the first velocity connected to each velocity, and the velocities that move each row of the body table.

    Rows, measured quantities and forces connect velocities.
    """
    part = np.arange(nv)

    def root(d: int) -> int:
        while part[d] != d:
            part[d] = d = part[part[d]]
        return d

    def join(several) -> None:
        several = list(several)
        for d in several[1:]:
            a, b = sorted((root(several[0]), root(d)))
            part[b] = a

    movers = [_moving_velocities(S, b) for b in range(len(S.tree.parent))]
    for own in movers:
        join(own)
    for r in range(len(S.row_start) - 1):
        join(S.column[S.row_start[r] : S.row_start[r + 1]])
    for k in np.flatnonzero(S.forces.family == BETWEEN):
        ends = [S.frame_body[S.forces.F[k]], S.frame_body[S.forces.M[k]]]
        join(d for b in ends if b >= 0 for d in movers[b])
    return np.array([root(d) for d in range(nv)], np.int64), movers


def _moving_velocities(S: System, b: int) -> list[int]:
    """Return the velocities that move a body."""
    out: list[int] = []
    while b >= 0:
        out += range(S.tree.v[b], S.tree.v[b] + S.tree.nv[b])
        b = S.tree.parent[b]
    return out


def assembled_start(model: Model, t: float, parameters: Mapping[str, float] | None, before: Result | None) -> Assembly:
    """Return all single bodies at the start, in absolute coordinates.

    Raises
    ------
    ModelError
        If the earlier result is of another mechanism.
    """
    if before is None:
        return assemble(model, t=t, parameters=parameters)
    return find_initial_state(model, t, parameters, before, "absolute").base


def with_earlier_energy(result: Result, before: Result | None, part: Segment) -> Result:
    """Add the energy exchanged in an earlier result, unless this is a later segment of one motion."""
    if before is not None and not part.later:
        result.begun.done = energies_at_end(before)
        result.exchanged = cumulative_exchanges(result)
    return result


def start_of_submodel(base: Assembly, model: Model, parameters: Mapping[str, float] | None) -> InitialState:
    """Return the start of a model of some of the bodies, at their state in ``base``."""
    c, whole = compile_mechanism(model, parameters=parameters), base.compiled.structure
    s = c.structure
    q, v, z = np.zeros(s.nq), np.zeros(s.nv), c.z.copy()
    for name, b in s.place.items():
        if b >= 0:
            here, there, k = s.tables["tree"], whole.tables["tree"], whole.place[name]
            q[here.coordinates(b)] = base.q[there.coordinates(k)]
            v[here.velocities(b)] = base.v[there.velocities(k)]
    for name, k in s.state_at.items():
        if name in whole.state_at:
            z[k] = base.compiled.z[whole.state_at[name]]
    c.z = z
    return initial_state_at(Assembly(c, base.t, q, v), parameters, "absolute")


def place_body_sets(scene: ContactTables, M: Movers, before: Result) -> None:
    """Place sets of bodies where the earlier result left them.

    Raises
    ------
    ModelError
        If it has other ones.
    """
    names = [n for n in scene.carriers.names if n not in scene.carriers.single]
    for name in names:
        at, b = scene.carriers.slices[name], before.bulk.get(name)
        if b is None or len(b) != at.stop - at.start:
            raise ModelError(f"the result cannot be continued: it has no bodies {name!r}, or another number of them")
        M.pose[at, :3] = b.position[-1]
        M.pose[at, 3:] = np.stack(quaternion_matrix(*b.quaternion[-1].T), axis=1)
        M.twist[at, :3], M.twist[at, 3:] = b.velocity[-1], b.angular_velocity[-1]


@dataclass
class MechanismMotion:
    """The jointed mechanism of a motion with contact.

    Attributes
    ----------
    start : InitialState
        Its start, of a model without the free bodies.
    joints : MechanismTables
        Its tables in the step.
    """

    start: InitialState
    joints: MechanismTables
    y: list[np.ndarray] = field(default_factory=list)
    vdot: list[np.ndarray] = field(default_factory=list)
    lam: list[np.ndarray] = field(default_factory=list)
    gaps: list[float] = field(default_factory=list)
    slips: list[float] = field(default_factory=list)

    def add(self, A: MechanismTables, moved: bool) -> None:
        """Record the present state, and mean accelerations and multipliers of the last step if there was one."""
        h = float(A.real.step) if moved else 1.0
        self.y.append(A.clock.y.current.copy())
        self.vdot.append((A.velocities.after - A.velocities.before) / h)
        self.lam.append(A.reactions.smooth + (A.reactions.impulse + A.reactions.impact) / h)
        s = self.start.assembly.compiled.structure
        W = self.start.assembly.compiled.work
        lost = self.start.assembly.compiled.jacobian() @ A.clock.y.current[s.nq : s.nq + s.nv] - W.rows.nu
        self.gaps.append(float(np.abs(W.rows.value).max(initial=0.0)))
        self.slips.append(float(np.abs(lost).max(initial=0.0)))

    def write_into(
        self, whole: Values, q: np.ndarray, v: np.ndarray, vdot: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Write its coordinates, velocities and accelerations into those of the whole model; return its states and
        multipliers.

        All are in absolute coordinates.
        """
        own, s = self.start.assembly.compiled.structure, whole.structure
        y, lam = np.array(self.y), np.array(self.lam)
        for name, b in own.place.items():
            if b >= 0:
                here, there, k = own.tables["tree"], s.tables["tree"], s.place[name]
                q[:, there.coordinates(k)] = y[:, here.coordinates(b)]
                v[:, there.velocities(k)] = y[:, own.nq :][:, here.velocities(b)]
                vdot[:, there.velocities(k)] = np.array(self.vdot)[:, here.velocities(b)]
        states = np.zeros((len(y), len(s.states)))
        for name, k in s.state_at.items():
            if name in own.state_at:
                states[:, k] = y[:, own.nq + own.nv + own.state_at[name]]
        out = np.zeros((len(y), len(whole.system.rows.law)))
        for name, rows in s.slices.items():
            out[:, rows] = lam[:, own.slices[name]]
        return states, out


def separate_mechanism(
    whole: Values,
    t: float,
    parameters: Mapping[str, float] | None,
    found: BodyPartition,
    first: int,
    base: Assembly | None = None,
) -> MechanismMotion | None:
    """Return the jointed mechanism of a model, if joints, forces or stops act on any bodies; ``first`` is its first
    mover.

    It starts at the state ``base``, or as described.
    """
    if not found.held:
        return None
    model = whole.structure.model
    own = mechanism_model(stops_as_springs(model), found.held)
    start = (
        start_of_submodel(base, own, parameters) if base else find_initial_state(own, t, parameters, None, "absolute")
    )
    return MechanismMotion(start, mechanism_tables(start, found.held, first, 1.0, stop_bounds(model, whole)))


def values_with_stops(model: Model, values: Values, parameters: Mapping[str, float] | None) -> Values:
    """Return tables in which stops are forces, so that their bodies count as held."""
    if all(e.acts() for e in model.limits):
        return values
    from ...assembly.compiled_mechanism import compile_mechanism

    return compile_mechanism(stops_as_springs(model), parameters=parameters).values


# The mechanism without the free bodies and without contact is a separate model, whose stops are forces without effect.
#
# A stop needs value and gradient of its coordinate; a spring of zero stiffness along it provides both.


def stops_as_springs(model: Model) -> Model:
    """Return a copy in which springs of zero stiffness replace stops."""
    out = model.copy()
    rigid = [e for e in out.limits if isinstance(e, Limit) and not e.acts()]
    out.limits = [e for e in out.limits if e.acts()]
    for e in rigid:
        del out.by_name[e.name]
        out.add(measuring_spring(e))
    return out.snapshot()


def stop_bounds(model: Model, values: Values) -> dict[str, StopBounds]:
    """Return the bounds and restitution of stops by name."""
    return {s.element.name: (s.lower, s.upper, s.restitution) for s in rigid_stops(model, values.given)}


def mechanism_model(model: Model, held: Sequence[str]) -> Model:
    """Return the part of a model (stops replaced by springs) that concerns the bodies ``held``, in this order, without
    contact shapes.
    """
    out = model.copy()
    gone = {b.name for b in out.bodies} - set(held)
    gone |= {f.name for f in out.frames if f.body in gone}
    for name in ("contacts", "bulk", "ground", "materials", "material_pairs"):
        gone |= {e.name for e in getattr(out, name)}
        setattr(out, name, [])
    out.bodies = [out.by_name[name] for name in held]
    out.frames = [f for f in out.frames if f.name not in gone]
    out.initial = [e for e in out.initial if curve_parts(e.name)[0] not in gone]
    lost = [s for s in out.sensors if any(body in gone for body in _sensor_bodies(s))]
    out.sensors = [s for s in out.sensors if s not in lost]
    for name in (*gone, *(s.name for s in lost)):
        out.by_name.pop(name, None)
    return out.snapshot()


def _sensor_bodies(sensor) -> list[str]:
    """Return the names of the elements that a sensor measures."""
    return [sensor.frame] if isinstance(sensor, IMU) else [curve_parts(sensor.of)[0]]


CONTACT_MARGIN = 0.01  # gap up to which non-approaching shapes are in contact, relative to the smallest shape
NO_OVERLAP = 1e-9  # negligible overlap, relative to the smallest shape
SLOW_CONTACT = 0.1  # speed below which nothing bounces, whatever gravity is, relative to the tolerance of velocities
DEFAULT_ITERATIONS = {"auto": 30, "newton": 100, "gauss-seidel": 50, "admm": 200}
"""Default largest number of iterations by solver; `OTHER_ITERATIONS` for the others."""
COARSE_FACTOR = 100.0  # factor of the tolerance up to which the residual of an unconverged solve is not reported
OTHER_ITERATIONS, DEFAULT_POSITION_ITERATIONS, DEFAULT_SOLVER_STEPS = 150, 25, 100


def movers_of_assembly(scene: ContactTables, base: Assembly) -> Movers:
    """Return the movers at the assembled positions; sets of bodies are as described."""
    return place_movers(scene, base.compiled.moving(base.t, base.q, base.v))


def place_movers(scene: ContactTables, bodies: Mapping[str, BodyState]) -> Movers:
    """Return the movers at the poses of the single bodies; sets of bodies are as described."""
    M = Movers(scene.carriers.movers.pose.copy(), scene.carriers.movers.twist.copy())
    for name, b in bodies.items():
        k = scene.carriers.slices[name].start
        M.pose[k] = np.r_[b.p, b.R.ravel()]
        M.twist[k] = np.r_[b.v, b.w]
    return M


def make_stepper(
    scene: ContactTables,
    M: Movers,
    values: Values,
    o: Stepping,
    chosen: StepSize,
    held: MechanismMotion | None = None,
) -> ImpulseStepper:
    """Create the stepper at the start, for steps as chosen."""
    planar = values.structure.model.planar
    state = initial_run_state(values.system.gravity)
    options, tolerances = state.options, state.tolerances
    size = smallest_radius(scene, values)
    tolerances.rebound_speed, tolerances.overlap = SLOW_CONTACT * chosen.tolerance, NO_OVERLAP * size
    tolerances.velocity = tolerances.position = chosen.tolerance
    gravity = float(np.sqrt((state.gravity**2).sum()))
    tolerances.reported = max(gravity, COARSE_FACTOR * chosen.tolerance / chosen.step)
    usual = DEFAULT_ITERATIONS.get(o.solver, OTHER_ITERATIONS)
    options.velocity_iterations = o.iterations or usual
    options.position_iterations = o.position_iterations or max(DEFAULT_POSITION_ITERATIONS, usual // 2)
    law = RESTITUTION_LAWS.index(o.restitution) + 1
    options.restitution_law = (
        law if (np.nan_to_num(scene.surfaces.pair[..., su.RESTITUTION]) > 0.0).any() else NO_RESTITUTION
    )
    n = len(M.pose) - (len(held.joints.mover) if held else 0)
    turn = matrix_to_quaternion(M.pose[:n, 3:].reshape(-1, 3, 3))
    free = free_bodies(scene.carriers.mass[:n], scene.carriers.inertia[:n], turn, planar)
    options.divides_steps = o.step is None
    options.sequential = o.impacts == "sequential"
    options.compliant = (np.nan_to_num(scene.surfaces.pair[..., [su.STIFFNESS, su.MODULUS]]) > 0.0).any()
    joints = held.joints if held else None
    at, twist, margin = M.pose[:n, :3], M.twist[:n], CONTACT_MARGIN * size
    stepper = ImpulseStepper(
        scene.geometry, free, at, twist, scene.surfaces, state, margin, o.solver, joints, o.threads or default_threads()
    )
    if o.solver in PYRAMIDS and stepper.turning:
        raise ModelError(
            f"solver {o.solver!r} of Stepping has no rolling or spinning friction; leave rolling_friction and "
            "spinning_friction out, or choose another solver"
        )
    if o.history is not None:
        stepper.recorder = SolveRecorder(stepper, o.history)
    choices = stepper.workspaces.O.count
    choices.coulomb = o.coulomb
    choices.directions = o.directions or DEFAULT_DIRECTIONS
    choices.most_steps = DEFAULT_SOLVER_STEPS if o.iterations is None else 0
    return stepper
