"""Figures recorded when a motion ends, and its kinematics at all output times.

Energies and errors, by which a motion judges itself, are recorded at some of its output times. Their number is limited
to a small part of the evaluations of the run, so that recording costs little beside it.

Kinematics of bodies and frames, terms of constraint rows and measured quantities are arrays over time, computed by the
formulas of the compiled engine: compiled for floats, in Python for complex numbers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..compiler.kernels import PooledBuffer, StructPool
from ..compiler.struct_layout import Record
from ..constraints.blocks import Row
from ..engine.entry_point import engine, idle_clock_pool, idle_tableau, no_output, pooled_work, struct_tables
from ..engine.kinematics import (
    BodyKinematics,
    BodyKinematicsOverTime,
    BodyTables,
    attached_record,
    body_motion,
    body_pose,
    kinematics_over_time,
    load_record,
    stationary_record,
    turned_angles,
    twist_column,
)
from ..engine.recorded_figures import RecordedFigures, record_motion_kernel
from ..engine.rows import COEFFICIENT, row_parameters
from ..forces import ENERGIES
from ..math.vec import add, cross, dot, load3, load9, matrix_product, mm, neg, scale, store3, sub
from ..model.body import Frame, Located
from ..model.joint import Coordinate, Joint
from ..tables.law_inputs import force_reading_count
from ..tables.structure_definition import Structure
from ..tables.table_definitions import KinematicRecords, System, Twists, Wrenches
from ..tables.values import Values

if TYPE_CHECKING:
    from .result import Result


KinematicRecord = tuple
FULL_TURN = 2.0 * np.pi


class RecordedMotion:
    """Records of bodies and frames at every output time, with true accelerations; arrays (n,) for each number.

    ``wound``: body -> full turns [rad] that its coordinates count and its angle does not (`Result.wound`). Without
    ``vdot`` accelerations are not available.
    """

    def __init__(
        self, x: Values, q: np.ndarray, v: np.ndarray, vdot: np.ndarray | None, wound: Mapping[str, float] | None = None
    ) -> None:
        self.x, self.q = x, q
        self.n = len(q)
        S = x.system
        nb, nv = len(S.tree.parent), v.shape[1]
        own = [] if vdot is None else [vdot]
        self.dtype = np.result_type(q, v, *own, S.const)  # complex for derivatives
        self.W: Any = BodyKinematicsOverTime(
            self.records(KinematicRecords, nb), self.records(Twists, nv), self.zeros(nb, 3)
        )
        if self.dtype == float:
            one = BodyKinematics(KinematicRecords.blank(nb), Twists.blank(nv), np.zeros((nb, 3)))
            q, v = np.ascontiguousarray(q), np.ascontiguousarray(v)
            kinematics_over_time(BodyTables(S.tree, S.bodies), one, q, v, self.W)
        else:
            for b in range(nb):
                body_pose(S, self.W, b, q.T)
                body_motion(S, self.W, b, v.T)
        if vdot is not None:
            self._accelerate(vdot.T)
        self._frames: dict[int, KinematicRecord] = {}
        self._names = {b: name for name, b in x.structure.place.items() if b >= 0}
        self._wound = wound or {}

    def zeros(self, *shape: int) -> np.ndarray:
        """Return zeros at every time."""
        return np.zeros((*shape, self.n), self.dtype)

    def records(self, of: type[Record], count: int) -> Any:
        """Return records of zeros at every time."""
        return self.zeros(count, of.layout.width).view(of)

    def _accelerate(self, vdot: np.ndarray) -> None:
        """Replace the bias accelerations of the bodies by true ones.

        The difference is transmitted from parent to child as in a rigid body, and every twist column adds its vdot.
        """
        S, W = self.x.system, self.W
        missing: list[tuple[tuple, tuple]] = []
        for b in range(len(S.tree.parent)):
            p, _, _, _, bias_alpha, bias_a = load_record(W.bodies, b)
            alpha = a = (0.0, 0.0, 0.0)
            parent = int(S.tree.parent[b])
            if parent >= 0:
                alpha, a = missing[parent]
                a = add(a, cross(alpha, sub(p, load3(W.bodies.position, parent, 0))))
            arm = sub(p, load3(W.O, b, 0))
            for i in range(S.tree.nv[b]):
                turn, shift = twist_column(S, W, b, i)
                s = vdot[S.tree.v[b] + i]
                alpha = add(alpha, scale(s, turn))
                a = add(a, scale(s, add(shift, cross(turn, arm))))
            missing.append((alpha, a))
        for b, (alpha, a) in enumerate(missing):
            _, _, _, _, bias_alpha, bias_a = load_record(W.bodies, b)
            store3(W.bodies.angular_acceleration, b, 0, add(bias_alpha, alpha))
            store3(W.bodies.acceleration, b, 0, add(bias_a, a))

    def body(self, b: int) -> KinematicRecord:
        """Record of body b's centre of mass."""
        return load_record(self.W.bodies, b)

    def bodies(self, b: Sequence[int] | np.ndarray) -> KinematicRecord:
        """Records of several bodies' centres of mass: arrays (bodies, n)."""
        every = self.W.bodies
        some = every if np.array_equal(b, np.arange(len(every))) else every[b]  # all of them without a copy
        return load_record(some.swapaxes(0, 1)[None], 0)

    def frame(self, k: int) -> KinematicRecord:
        """Record of frame k."""
        if k not in self._frames:
            S = self.x.system
            offset, turn = load3(S.frames.position, k, 0), load9(S.frames.rotation, k, 0)
            b = int(S.frame_body[k])
            self._frames[k] = self.attached(b, offset, turn)
        return self._frames[k]

    def forget(self) -> None:
        """Discard the cached frames; they are computed again on demand."""
        self._frames.clear()

    def attached(self, b: int, offset: tuple, turn: tuple) -> KinematicRecord:
        """Return the record of a point and axes fixed on body b (-1: ground)."""
        if b >= 0:
            return attached_record(self.body(b), offset, turn)
        zero = self.zeros()
        p, R, *rest = stationary_record(offset, turn, zero)
        return (tuple(x + zero for x in p), tuple(x + zero for x in R), *rest)

    def placed(self, name: str) -> tuple[int, tuple, tuple]:
        """Return the body (-1: ground) with a named frame, or a body's own; its origin and axes on that body."""
        p, R = self.x.poses.named(name)
        e = self.x.structure.model[name]
        body = e.body if isinstance(e, Frame) else name
        b = self.x.bodies[body]
        offset, turn = matrix_product(b.R.T, p - b.c), matrix_product(b.R.T, R)
        return self.x.structure.place[body], tuple(offset.tolist()), tuple(turn.ravel().tolist())

    def named(self, name: str) -> KinematicRecord:
        """Return the record of a named frame, or of a body's own frame."""
        return self.attached(*self.placed(name))

    def angle(self, b: int) -> np.ndarray:
        """Return the angle [rad] of body b (-1: ground) of a planar mechanism, with full turns; (n,).

        It equals the given angle in the reference configuration and is continuous, for any choice of coordinates.
        """
        if b < 0:
            return self.zeros()
        return self._angles[self._names[b]] - self._wound.get(self._names[b], 0.0)

    @cached_property
    def _angles(self) -> dict[str, np.ndarray]:
        """Return every body's angle as given by the coordinates."""
        return turned_angles(self.x, self.W, self.q.T)

    def reference_angle(self, b: int) -> float:
        """Return the reference angle [rad] of body b (-1: ground) of a planar mechanism, with full turns."""
        return 0.0 if b < 0 else self.x.bodies[self._names[b]].angle


def extra_turns(coordinate_angles: Mapping[str, float], angles: Mapping[str, float]) -> dict[str, float]:
    """Return the full turns that coordinates count and the angles of bodies do not.

    A joint with an initial angle of two turns includes them in its coordinate; the angles of bodies do not.

    Parameters
    ----------
    coordinate_angles : mapping
        Body -> its turned angle [rad] at the start of a planar motion, as its coordinates have it.
    angles : mapping
        Body -> its turned angle there.

    Returns
    -------
    dict
        Body -> excess of its coordinates [rad]; zeros are left out.
    """
    ahead = {k: FULL_TURN * round((coordinate_angles[k] - a) / FULL_TURN) for k, a in angles.items()}
    return {name: float(more) for name, more in ahead.items() if more != 0.0}


def coordinate_records(
    records: RecordedMotion, owner: Joint | Located, what: str
) -> tuple[KinematicRecord, KinematicRecord, Coordinate]:
    """Return the records of the frames between which a coordinate of a joint, body or frame is measured."""
    c = owner.coordinates[what]
    first, second = (_turned_record(_end(records, owner, role), getattr(c, f"turn_{role}")) for role in c.frames)
    return first, second, c


def _end(records: RecordedMotion, owner: Joint | Located, role: str) -> KinematicRecord:
    if isinstance(owner, Joint):
        return records.frame(records.x.structure.frame_at[owner.name, role, ""])
    return records.named(owner.name) if role == "M" else records.attached(-1, (0.0,) * 3, tuple(np.eye(3).ravel()))


def coordinate_parameters(x: Values, owner: Any, row: Row) -> tuple[tuple[float, ...], np.ndarray]:
    """Return the parameters of a coordinate's formula, without its constant, and the table of constants it reads."""
    if not row.of_kind.splines:
        return (*row.par[:6], 0.0, 0.0), x.system.const
    curves = owner.curves(x.numbers[owner.name])
    return (row.par[0], 0.0, float(len(curves[0])), *(0.0,) * 5), np.concatenate(curves)


def curve_places(result: Result, owner: Any) -> np.ndarray:
    """Return the position of a joint's point on its curve over time."""
    at = result.values.structure.state_at.get(f"{owner.name}.place")
    if at is not None:
        return result.states[:, at]
    n, r = result.values.numbers[owner.name], result.motions  # of a part of a rope, where nothing acts along it
    ends = [r.frame(result.values.structure.frame_at[owner.name, role, ""]) for role in "FM"]
    p, R = ([np.stack(np.broadcast_arrays(*f[i], r.zeros()))[:-1].T for f in ends] for i in (0, 1))
    poses = zip(*(zip(x, y.reshape(-1, 3, 3), strict=True) for x, y in zip(p, R, strict=True)), strict=True)
    return np.unwrap([owner.nearest(n, *pair)[0] for pair in poses])


def measured_coordinate(
    records: RecordedMotion, owner: Joint | Located, what: str, turns: Any = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a coordinate without its offset, its rate, and its acceleration if the records have true ones.

    ``turns`` approximates an angle that counts whole turns; if it is None, the angle is continuous as far as the output
    times resolve it.
    """
    F, M, c = coordinate_records(records, owner, what)
    par, data = coordinate_parameters(records.x, owner, c.row)
    counts = c.row.of_kind.turns and turns is not None
    hint = turns if counts or c.row.of_kind.place else 0.0
    with np.errstate(all="ignore"):  # at a singular position
        value, f, tM, tF, second = c.row.of_kind.row((1.0, *par[1:]) if counts else par, F, M, hint, data)
        rate = dot(f, sub(M[3], F[3])) + dot(tM, M[2]) + dot(tF, F[2])
    if c.row.of_kind.turns and not counts:
        value = value + np.unwrap(np.real(value)) - np.real(value)
    return c.sign * value, c.sign * rate, c.sign * second


def _turned_record(record: KinematicRecord, turn: Any) -> KinematicRecord:
    """Return the record with its axes turned by a constant rotation, if there is one."""
    if not len(turn):
        return record
    return (record[0], mm(record[1], tuple(np.asarray(turn).ravel())), *record[2:])


Wrench = tuple[tuple, tuple]


def gravity_over_time(result: Result) -> tuple[Any, ...]:
    """Return the components of the acceleration of gravity [m/s^2]: numbers, or over time."""
    known = {**result.values.env, "t": result.t}
    laws = result.values.structure.model.gravity_laws()
    constant = result.values.system.gravity
    return tuple(g if law is None else law.evaluate(known) for g, law in zip(constant, laws, strict=True))


def term_over_time(result: Result, k: int) -> tuple[KinematicRecord, KinematicRecord, tuple]:
    """Return the records of frames F and M of term k, and the result of its formula.

    The result is value, force on M at M's origin (the reverse acts at F's on F's body), torque on M's body, torque on
    F's body, acceleration bias; without its coefficient. The records have no accelerations but those with every vdot
    zero.
    """
    x = result.values
    t = x.structure.terms[k]
    F, M = result.motions.frame(t.F), result.motions.frame(t.M)
    hint: Any = result.states[:, t.hint] if t.hint >= 0 else 0.0
    kind, par = t.formula.of_kind, row_parameters(x.system.term_parameters, k)
    if kind.single:
        return F, M, _time_by_time(kind.row, par, (F, M, hint + result.motions.zeros()), x.system.const)
    return F, M, kind.row(par, F, M, hint, x.system.const)


def _time_by_time(
    row: Any, par: tuple, over: tuple[KinematicRecord, KinematicRecord, np.ndarray], const: np.ndarray
) -> tuple:
    """Return a formula evaluated at one time after another, as arrays over time."""
    F, M, hint = over
    n = len(hint)
    sides = [[tuple(np.broadcast_to(np.stack(np.broadcast_arrays(*x), -1), (n, len(x)))) for x in r] for r in (F, M)]
    one = [row(par, *(tuple(tuple(x[i]) for x in r) for r in sides), hint[i], const) for i in range(n)]
    parts = zip(*one, strict=True) if one else ((), (), (), (), ())
    value, force, on_M, on_F, bias = (np.array(x, hint.dtype) for x in parts)
    return value, *(tuple(x.reshape(n, 3).T) for x in (force, on_M, on_F)), bias


def term_coefficient(result: Result, k: int) -> float:
    """Return the coefficient of term k in its row or measured quantity."""
    return result.values.system.term_parameters[k, COEFFICIENT]


def unit_effort_wrench(result: Result, owner: Joint | Located, what: str) -> Wrench:
    """Return the wrench on ``body_j``, or on the body, about M's origin, of a unit effort along a coordinate."""
    F, M, c = coordinate_records(result.motions, owner, what)
    par, data = coordinate_parameters(result.values, owner, c.row)
    hint = curve_places(result, owner) if c.row.of_kind.place else 0.0
    _, f, tM, tF, _ = c.row.of_kind.row(par, F, M, hint, data)
    force, torque = (f, tM) if c.frames[1] == "M" else (neg(f), tF)
    return scale(c.sign, force), scale(c.sign, torque)


def zero_wrenches(records: RecordedMotion) -> Any:
    """Return zero wrenches on all bodies at every time, `Wrenches`."""
    return records.records(Wrenches, len(records.x.system.tree.parent))


def zero_wrench(records: RecordedMotion) -> Wrench:
    """Return a zero wrench at every time."""
    zero = records.zeros()
    return (zero,) * 3, (zero,) * 3


class MeasuredQuantities:
    """Quantities along which forces act and which laws use."""

    def __init__(self, result: Result) -> None:
        self._result = result
        self._known: dict[int, tuple[np.ndarray, np.ndarray]] = {}

    def quantity(self, m: int) -> tuple[np.ndarray, np.ndarray]:
        """Return value and rate of quantity m over time."""
        if m not in self._known:
            self._known[m] = self._found(m)
        return self._known[m]

    @cached_property
    def _terms(self) -> dict[int, list[int]]:
        """Return the terms of every quantity."""
        s = self._result.values.structure
        out: dict[int, list[int]] = {m: [] for m in range(len(s.measured))}
        for k, t in enumerate(s.terms):
            if t.measured:
                out[t.row - len(s.rows)].append(k)
        return out

    def _found(self, m: int) -> tuple[np.ndarray, np.ndarray]:
        value, rate = self._result.motions.zeros(), self._result.motions.zeros()
        for k in self._terms[m]:
            F, M, (g, f, tM, tF, _) = term_over_time(self._result, k)
            c = term_coefficient(self._result, k)
            value = value + c * g
            rate = rate + c * (dot(f, sub(M[3], F[3])) + dot(tM, M[2]) + dot(tF, F[2]))
        return value, rate

    @cached_property
    def slots(self) -> np.ndarray:
        """Return the inputs of laws, (3, slots, n).

        They are values, rates as values of their own, loads and forces (not included), states of controllers, and
        sliding directions of switches.
        """
        s = self._result.values.structure
        n, switches = len(s.measured), len(s.switches)
        first = 2 * n + len(s.loads) + force_reading_count(s)
        out = self._result.motions.zeros(3, first + len(s.controls) + switches)
        if s.controls:
            out[0, first : first + len(s.controls)] = self._result.states[:, : len(s.controls)].T
        if s.slots or switches:
            for m in range(n):
                out[0, m], out[1, m] = self.quantity(m)
                out[0, n + m] = out[1, m]
        if switches and self._result.phases is not None:
            out[0, -switches:] = self._result.phases.sigma
        return out


SHORTEST_SPAN = 1e-150  # [s]: the square of a shorter one underflows
SOLVE_TOLERANCE = 1e-13  # relative residual of a solve
MIN_TIMES, MIN_SOLVED, MAX_SOLVED = 32, 16, 100  # least number of recorded times; least and largest with accelerations
EVALUATIONS_PER_TIME, EVALUATIONS_PER_SOLVE = 40, 100  # of the run
NEGLIGIBLE_ACCELERATION = (
    1e-14  # relative to the mechanism's length (or a radian) over the squared duration; smaller ones are rounding
)


class MotionRecord:
    """Recorded figures.

    Attributes
    ----------
    rows : ndarray of int (n,)
        Numbers of the output times.
    solved : bool
        Whether the equations of motion had a solution wherever accelerations were checked.
    deferred : bool
        Whether the accelerations at other output times had not been computed.
    """

    def __init__(self, rows: np.ndarray, solved: bool, deferred: bool, written: PooledBuffer) -> None:
        self.rows, self.solved, self.deferred, self._written = rows, solved, deferred, written

    @cached_property
    def figures(self) -> RecordedFigures:
        """The figures."""
        return self._written.fields  # type: ignore[no-any-return]

    @property
    def violation(self) -> float:
        """Largest |G vdot - gamma| relative to its terms."""
        found = self.figures.violation
        return float(np.max(found, where=np.isfinite(found), initial=0.0))

    def __getstate__(self) -> dict[str, Any]:
        """Without the addresses that compiled code was given."""
        return {name: getattr(self, name) for name in ("rows", "solved", "deferred", "figures")}


def record_motion(
    result: Result,
    work: PooledBuffer | None = None,
    accelerations: bool = True,
    system: System | None = None,
) -> MotionRecord:
    """Evaluate a motion at some of its output times.

    Parameters
    ----------
    result : Result
    work : PooledBuffer
        Workspace with the options of the run. Not given: a new one, without stabilization.
    accelerations : bool
        Whether to check accelerations.
    system : System
        Tables that the run used if one set of parameters held throughout, which compiled code has been given already.
    """
    n, count, steps = len(result.t), result.health.evaluations, result.health.steps
    s, S, deferred = result.values.structure, result.values.system, result.deferred_accelerations is not None
    conservative = s.cache.get("conservative", None, 1, lambda: not any(x.endswith(".work") for x in s.states))
    least_times = steps if conservative and steps <= n else MIN_TIMES  # enough for the time error of a swing
    times = min(n, max(MIN_TIMES, least_times, count // EVALUATIONS_PER_TIME))
    rows = np.arange(times) * (n - 1) // max(times - 1, 1)
    stride = -(-times // min(MAX_SOLVED, max(MIN_SOLVED, count // EVALUATIONS_PER_SOLVE))) if accelerations else 0
    switched = result.phases is not None and bool(s.switches)
    out = s.cache.get("figures", (times, switched), 2, lambda: _pool(s, S, times, switched)).new()
    if work is None:
        work = pooled_work(s, S, S.const.dtype)
        work.array("options").solve_tolerance = SOLVE_TOLERANCE
    states, at = out.array("states"), 1
    states[:, 0] = result.t[rows]
    for x in (result.q, result.v, result.hints, *([] if deferred else [result.vdot])):
        states[:, at : at + x.shape[1]] = x[rows]
        at += x.shape[1]
    released = np.zeros((0, 0))
    if switched:
        switch = result.phases.over("switch")[:, :, rows]  # type: ignore[union-attr]
        out.array("modes")[:] = np.concatenate([*switch[:2], result.phases.sigma[:, rows]]).T  # type: ignore[union-attr]
        released = switch[4]
    span = float(result.t[-1] - result.t[0]) if n else 0.0
    least = NEGLIGIBLE_ACCELERATION / max(span, SHORTEST_SPAN) ** 2 if span > 0.0 else 0.0
    buffers = work, idle_tableau(), idle_clock_pool(states.shape[1] - 1 - s.nv).new(), no_output(), out
    for part, first, last in _systems(result, rows, system):
        tables = struct_tables(s, part)
        record_motion_kernel(engine.address, tables, *buffers, least, stride, deferred, first, last)
    for k in s.cache.get("own energies", None, 1, lambda: _forces_with_python_energy(s)):
        f = s.forces[k]
        out.array("elastic")[:, k] = 0.0 if f.energy is None else result[f.name].energy[rows]
    if released.any():
        _remove_released(s, released, out.array("elastic"))
    solved = not stride or bool(np.isfinite(out.array("violation")[::stride]).all())
    return MotionRecord(rows, solved, deferred, out)


def _pool(s: Structure, S: System, n: int, switched: bool) -> StructPool:
    """Pool of figures of n times."""
    nb, nk, nv, ny = len(S.tree.parent), len(S.forces.F), s.nv, s.nq + s.nv + len(s.states)
    metric = np.zeros(len(s.rows))
    metric[[t.row for t in s.terms if not t.measured and t.formula.measure == "m"]] = 1.0
    modes = np.zeros((n, 3 * len(s.switches)) if switched else (0, 0))
    shapes = ((n, nb), (n, nb), (n, nk), (n, nb, 3), (n, nb), (n, nb), (n, nv), (n,))
    return StructPool(RecordedFigures(np.zeros((n, 1 + ny + nv)), modes, metric, *map(np.zeros, shapes)))


def _systems(result: Result, rows: np.ndarray, system: System | None) -> list[tuple[System, int, int]]:
    """Return the tables with the parameters of each part of the recorded times, and its first and last time."""
    if result.phases is None:
        return [(system or result.values.system, 0, len(rows))]
    cuts = [(at.stop, phases.all[0].values.system) for at, phases in result.phases.equal_parameter_phases()]
    ends = np.searchsorted(rows, [stop for stop, _ in cuts]).tolist()
    return [(S, first, last) for (_, S), first, last in zip(cuts, [0, *ends], ends, strict=False)]


def _forces_with_python_energy(s: Structure) -> list[int]:
    """Return the forces whose energy differs from that of the compiled formula of their kind."""
    return [k for k, f in enumerate(s.forces) if ENERGIES.get(getattr(f, "kind", -1)) is not f.energy]


def _remove_released(s: Structure, released: np.ndarray, elastic: np.ndarray) -> None:
    """Set the energy of elements to zero where events have released them; ``released``: (switches, n)."""
    for k, f in enumerate(s.forces):
        own = [i for i, x in enumerate(s.switches) if x.element is f]
        if own:
            elastic[released[own[0]] != 0.0, k] = 0.0
