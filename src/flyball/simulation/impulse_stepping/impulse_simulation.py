"""Motion by impulse time stepping, from the model to its result: steps to the output times, health report."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Mapping
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ...assembly.assembled_state import Assembly
from ...assembly.compiled_mechanism import CompiledMechanism, compile_mechanism
from ...assembly.positions_and_velocities import described_velocities
from ...compiler.object_files import compiled_since
from ...errors import AnalysisError, SimulationError
from ...math.vec import mtv, quaternion_matrix
from ...mobility.mobility import mobility
from ...model.contact import contact_warnings
from ...model.model import Model
from ...numerics.complementarity.solver_choice import OTHER_SOLVED, PASSED_ON, SMALL_SOLVED
from ...progress import ReportProgress
from ...results import diagnostics
from ...results.contacts import OPEN, SLIP, STICK, ContactBodies, Contacts
from ...results.energy_balance import CONTACT_ELASTIC, EXCHANGE_SIGNS
from ...results.health import ContactHealth, Health
from ...results.motion_record import record_motion
from ...results.part_views.bodies import BodySetMotion
from ...results.result import Result
from ...tables.contact_tables import ContactTables, contact_tables
from ...tables.reference_configuration import BodyState
from ..integration_intervals import PAUSED_MESSAGE, Segment, whole_motion
from ..integration_options import Stepping
from .impulse_stepper import ImpulseStepper, NoSolution
from .setup import (
    MechanismMotion,
    StepSize,
    assembled_start,
    choose_step,
    make_stepper,
    movers_of_assembly,
    partition_bodies,
    place_body_sets,
    place_movers,
    separate_mechanism,
    smallest_radius,
    values_with_stops,
    with_earlier_energy,
)
from .step_loop import solver_counts
from .stepping_tables import (
    RunSums,
)


class OutputRecorder:
    """Output rows, assembled at the end.

    Parameters
    ----------
    stepper : ImpulseStepper
    held : MechanismMotion, optional
        The jointed mechanism.
    side_of : (movers + 1,) of int
        Index in `ContactBodies` of each mover; the last one is that of ground.
    """

    def __init__(self, stepper: ImpulseStepper, held: MechanismMotion | None, side_of: np.ndarray) -> None:
        self.stepper, self.held, self.side_of = stepper, held, side_of
        self.t: list[float] = []
        self.pose: list[np.ndarray] = []
        self.turn: list[np.ndarray] = []
        self.angle: list[np.ndarray] = []  # of planar bodies, with whole turns
        self.twist: list[np.ndarray] = []
        self.acceleration: list[
            np.ndarray
        ] = []  # mean over the step that ends at the time; at the start over the first step
        self.sums: list[RunSums] = []
        self.contacts: list[dict[str, np.ndarray]] = []

    def add(self, moved: bool) -> None:
        """Record the present state, and the contacts of the last step if there was one."""
        s = self.stepper
        self.t.append(float(s.state.times.now))
        self.pose.append(s.movers.pose[: len(s.free.turn), :3].copy())
        self.turn.append(s.free.turn.copy())
        self.angle.append(s.free.angle.copy())
        self.twist.append(s.workspaces.X.v[:, :6].copy())
        sums = s.state.sums.copy()
        sums.impact_loss += s.joints.real.lost
        sums.numerical_loss += s.joints.real.joint_loss
        self.sums.append(sums)
        if self.held:
            self.held.add(s.joints, moved)
        if moved:
            self.begin()
        self.contacts.append(self._active_contacts() if moved else {})

    def first(self) -> None:
        """Record the mean accelerations of the first step for the start, and the energy stored there."""
        self.sums[0].elastic_energy = self.stepper.state.sums.elastic_at_start
        self.begin()

    def begin(self) -> None:
        """Record the mean accelerations of the last step."""
        s = self.stepper
        self.acceleration.append((s.workspaces.X.v[:, :6] - s.free.before) / s.state.times.step)

    def _active_contacts(self) -> dict[str, np.ndarray]:
        """Return the contacts with a force, and their normals, which are those of the middle of the step.

        Contact points are given by the arms with which forces were computed, from the mass centres at the start of the
        step; between two moving bodies the mean of both. The torques in the table are thus those of the motion.
        """
        s = self.stepper
        C, kept = s.last()
        n = int(C.count.found)
        impulse = kept.impulse[:n] + kept.impact_impulse[:n]
        k = np.flatnonzero((impulse != 0.0).any(axis=1))
        mover = s.geometry.shape.mover[C.at[k, :2]]
        moving = (mover >= 0)[:, :, None]
        points = np.where(moving, s.free.start[mover, :3] + s.workspaces.P.arm[k].reshape(-1, 2, 3), 0.0)
        return {
            "pair": self.side_of[mover],
            "point": points.sum(axis=1) / np.maximum(moving.sum(axis=1), 1),
            "normal": s.workspaces.P.frame[k, :3].copy(),
            "gap": C.x.gap[k],
            "force": impulse[k] / s.state.times.step,
            "state": np.where(kept.sliding[k] > 0.5, SLIP, np.where(kept.sliding[k] < -0.5, OPEN, STICK)),
            "friction": s.workspaces.P.mu[k],
        }

    def as_contacts(self, contact_bodies: ContactBodies, planar: bool) -> Contacts:
        """Return all contacts of all output times."""
        empty: dict[str, Any] = {"pair": np.zeros((0, 2), np.int64), "state": np.zeros(0, np.int64)}
        empty |= {k: np.zeros((0, 3)) for k in ("point", "normal", "force")}
        empty |= {k: np.zeros(0) for k in ("gap", "friction")}
        rows = [c or empty for c in self.contacts]
        begin = np.cumsum([0, *(len(c["gap"]) for c in rows)])
        table: dict[str, Any] = {k: np.concatenate([c[k] for c in rows]) for k in empty}
        return Contacts(t=np.array(self.t), sides=contact_bodies, begin=begin, planar=planar, **table)


def free_coordinates(
    base: Assembly, scene: ContactTables, recorder: OutputRecorder
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return absolute coordinates (n, nq), velocities and accelerations (n, nv) of free bodies over time."""
    s = base.compiled.structure
    tree = s.tables["tree"]
    n = len(recorder.t)
    q, v = np.tile(base.q, (n, 1)), np.zeros((n, s.nv))
    a = np.zeros((n, s.nv))
    pose, turn, twist = np.array(recorder.pose), np.array(recorder.turn), np.array(recorder.twist)
    change = np.array(recorder.acceleration[:n]) if recorder.acceleration else np.zeros_like(twist)
    for name, b in s.place.items():
        if b < 0 or name not in scene.carriers.slices:
            continue
        k = scene.carriers.slices[name].start
        if k >= pose.shape[1]:  # a body of the mechanism
            continue
        q0, v0, width = tree.q[b], tree.v[b], tree.nv[b]
        line = slice(v0, v0 + 2 if s.model.planar else v0 + 3)
        v[:, line], a[:, line] = twist[:, k, : line.stop - v0], change[:, k, : line.stop - v0]
        if s.model.planar:
            q[:, q0 : q0 + 2] = pose[:, k, :2]
            if width == 3:
                q[:, q0 + 2] = base.q[q0 + 2] + np.array(recorder.angle)[:, k]
                v[:, v0 + 2], a[:, v0 + 2] = twist[:, k, 5], change[:, k, 5]
            continue
        q[:, q0 : q0 + 3] = pose[:, k]
        if width == 6:
            e = turn[:, k] * (1.0 if turn[0, k] @ base.q[q0 + 3 : q0 + 7] >= 0.0 else -1.0)
            q[:, q0 + 3 : q0 + 7] = e
            R = quaternion_matrix(*e.T)
            v[:, v0 + 3 : v0 + 6] = np.stack(mtv(R, twist[:, k, 3:].T), axis=1)
            a[:, v0 + 3 : v0 + 6] = np.stack(mtv(R, change[:, k, 3:].T), axis=1)
    return q, v, a


def body_sets(model: Model, scene: ContactTables, recorder: OutputRecorder) -> dict[str, BodySetMotion]:
    """Return the motions of body sets by name."""
    out = {}
    for name in scene.carriers.names:
        if name in scene.carriers.single:
            continue
        at = scene.carriers.slices[name]
        J = scene.carriers.inertia[at]
        out[name] = BodySetMotion(
            name=name,
            mass=scene.carriers.mass[at],
            inertia=J,
            com=model[name].sizes()[:, None] * scene.carriers.com[name],
            position=np.array([p[at] for p in recorder.pose]),
            quaternion=np.array([p[at] for p in recorder.turn]),
            velocity=np.array([p[at, :3] for p in recorder.twist]),
            angular_velocity=np.array([p[at, 3:] for p in recorder.twist]),
        )
    return out


INTERRUPTED_MESSAGE = "interrupted by the user at t = {:.6g} s; the motion so far is kept"
END_MESSAGE = "reached the end"


def make_impulse_result(
    base: Assembly,
    scene: ContactTables,
    stepper: ImpulseStepper,
    recorder: OutputRecorder,
    contact_bodies: ContactBodies,
    o: Stepping,
    chosen: StepSize,
    since: float,
    message: str,
) -> Result:
    """Build the result; ``message`` describes how the motion ended."""
    values, model = base.compiled.values, base.compiled.structure.model
    q, v, vdot = free_coordinates(base, scene, recorder)
    t = np.array(recorder.t)
    counts = stepper.state.counts
    contact = _contact_health(stepper, o, chosen, smallest_radius(scene, values))
    health = Health(
        success=message == END_MESSAGE,
        message=message,
        violation=0.0,
        velocity_violation=0.0,
        steps=int(counts.steps_taken),
        rejected=0,
        evaluations=int(counts.iterations),
        factorisations=0,
        seconds=time.perf_counter() - since,
        compiling=compiled_since(since),
        options={"method": dataclasses.asdict(o)},
        coordinates="absolute: impulse time stepping",
        remarks=contact_warnings(model),
        crowd=sum(b.count for b in model.bulk),
        contact=contact,
    )
    states = np.zeros((len(t), len(values.structure.states)))
    lam = np.zeros((len(t), len(values.system.rows.law)))
    if recorder.held:
        states, lam = recorder.held.write_into(values, q, v, vdot)
        health.violation, health.velocity_violation = max(recorder.held.gaps), max(recorder.held.slips)
    result = Result(model, values, t, q, v, states, vdot, lam, health)
    result.final = (float(t[-1]), np.concatenate([q[-1], v[-1], states[-1]]))
    sums = np.array(recorder.sums)
    result.exchanged = dict(zip((*EXCHANGE_SIGNS, CONTACT_ELASTIC), sums.T[:-1], strict=True))
    result.contacts = recorder.as_contacts(contact_bodies, model.planar)
    if stepper.recorder is not None:
        result.contacts = dataclasses.replace(result.contacts, history=stepper.recorder.convergence())
    result.bulk = body_sets(model, scene, recorder)
    result.record = record_motion(result, accelerations=False)
    health.late = diagnostics.impulse_judgements(result, partial(mobility, model, base))
    return result


def _solvers_in_words(stepper: ImpulseStepper, solver: str) -> str:
    """Describe the solver, and how many islands each solver solved."""
    picked = solver_counts(stepper.workspaces.F)
    if not len(picked):
        return solver
    newton, sweeps = int(picked[SMALL_SOLVED] - picked[PASSED_ON]), int(picked[OTHER_SOLVED] + picked[PASSED_ON])
    if solver != "auto":
        return f"{solver}; {sweeps} of {newton + sweeps} islands by Gauss-Seidel" if sweeps else solver
    return f"auto: {newton} islands of bodies that touch by Newton's method, {sweeps} by Gauss-Seidel"


def _contact_health(stepper: ImpulseStepper, o: Stepping, chosen: StepSize, size: float) -> ContactHealth:
    worst, counts = stepper.state.worst, stepper.state.counts
    return ContactHealth(
        solver=_solvers_in_words(stepper, o.solver),
        impacts=f"{o.restitution.title()}, {o.impacts}" if counts.impacts else "",
        most=int(counts.most_contacts),
        worst_overlap=max(0.0, -float(worst.overlap)),
        overlap_at_start=max(0.0, -float(worst.overlap_at_start)),
        residual=float(worst.residual),
        force_residual=float(worst.force_residual),
        tolerance=chosen.tolerance,
        step=chosen.step,
        step_reason=chosen.reason,
        solves=int(counts.steps_taken),
        iterations=int(counts.iterations),
        unconverged=int(counts.unconverged),
        worst_at=float(worst.time),
        size=size,
        halved=int(stepper.halved),
        reduced=int(counts.reduced_expansions),
        impacted=int(counts.impacts),
        endless=int(counts.endless_impacts),
    )


NO_WAY_MESSAGE = (
    "a force or a law gives no finite number, the equations have no solution, or joints cannot be closed: give shorter "
    "steps, method=fb.Stepping(step=...)"
)
MOST_STEPS_PER_CALL, CALL_SECONDS = (
    1000,
    1.0,
)  # steps between two progress reports, and their largest duration


class ImpulseStart(NamedTuple):
    """A motion by impulse time stepping at its start."""

    base: Assembly
    scene: ContactTables
    stepper: ImpulseStepper
    held: MechanismMotion | None  # the jointed mechanism
    chosen: StepSize


def begin_by_impulses(
    model: Model, t: float, o: Stepping, parameters: Mapping[str, float] | None, before: Result | None = None
) -> ImpulseStart:
    """Return the motion of a model at time t, as described or at the end of an earlier result.

    Raises
    ------
    ModelError
        If the contact scene is invalid.
    AnalysisError
        If the start has no solution.
    """
    plain = compile_mechanism(model, parameters=parameters)
    values = plain.values
    found = partition_bodies(model, values_with_stops(model, values, parameters))
    scene = contact_tables(model, values.given, (*found.free, *found.held))
    free = len(scene.carriers.mass) - len(found.held)
    drawn = unassembled_start(plain, t) if before is None else None
    base = drawn or assembled_start(model, t, parameters, before)
    held = separate_mechanism(values, t, parameters, found, free, base if before is not None else None)
    at = place_movers(scene, body_states(drawn)) if drawn else movers_of_assembly(scene, base)
    if before is not None:
        place_body_sets(scene, at, before)
    chosen = choose_step(o, scene, at, values, held.start if held else None, before.health if before else None)
    try:
        return ImpulseStart(base, scene, make_stepper(scene, at, values, o, chosen, held), held, chosen)
    except NoSolution:
        raise AnalysisError(f"{model.name!r} cannot start: {NO_WAY_MESSAGE}") from None


def simulate_by_impulses(
    model: Model,
    span: tuple[float, float],
    times: np.ndarray,
    o: Stepping,
    parameters: Mapping[str, float] | None,
    report: ReportProgress,
    before: Result | None = None,
    part: Segment | None = None,
) -> Result:
    """Simulate by impulse time stepping over a time span; see `Mechanism.simulate`.

    Raises
    ------
    ModelError
        If the contact scene is invalid.
    SimulationError
        If the stepping cannot continue.
    """
    since, part = time.perf_counter(), part or whole_motion()
    o.refuse_history_outside(*span)
    model = model.snapshot()
    base, scene, stepper, held, chosen = begin_by_impulses(model, span[0], o, parameters, before)
    names = [*scene.carriers.names, "ground"]
    counts = [-1 if n in scene.carriers.single or n == "ground" else _set_size(scene, n) for n in names]
    sides = ContactBodies(names, counts)
    kept = OutputRecorder(stepper, held, np.arange(len(scene.carriers.mass) + 1))
    part.begin_by_impulses(len(scene.carriers.mass))
    try:
        interrupted = step_to_outputs(stepper, span, times, chosen.step, kept, report, part)
    except NoSolution:
        made = make_impulse_result(base, scene, stepper, kept, sides, o, chosen, since, "")
        result = with_earlier_energy(made, before, part)
        t = float(stepper.state.times.now)
        result.health.message = f"{model.name!r} cannot continue at t = {t:.6g} s: {NO_WAY_MESSAGE}"
        raise SimulationError(result.health.message, result, t) from None
    message = INTERRUPTED_MESSAGE if interrupted else PAUSED_MESSAGE if part.paused else END_MESSAGE
    message = message.format(float(stepper.state.times.now))
    made = make_impulse_result(base, scene, stepper, kept, sides, o, chosen, since, message)
    return with_earlier_energy(made, before, part)


def _set_size(scene: ContactTables, name: str) -> int:
    at = scene.carriers.slices[name]
    return at.stop - at.start


def step_to_outputs(
    stepper: ImpulseStepper,
    span: tuple[float, float],
    times: np.ndarray,
    longest: float,
    recorder: OutputRecorder,
    report: ReportProgress,
    part: Segment,
) -> bool:
    """Take steps of at most ``longest`` seconds that end at the output times, as equal as these allow.

    At the end of the segment there is always an output row. Returns whether the user interrupted.
    """
    first, last = span
    times_of_run, each = stepper.state.times, 1
    times_of_run.now = first
    if len(times) and times[0] == first:
        recorder.add(False)
    try:
        for t in (*times[times > first].tolist(), last):
            way = t - float(times_of_run.now)
            steps = math.ceil(way / longest * (1.0 - 1e-9) - 1e-12)
            if steps > 0:
                stepper.run(1, way / steps)
                if recorder.t and not recorder.acceleration:
                    recorder.first()
                part.count_steps(1)
                left = steps - 1
                while left and not part.over():
                    n, began = part.most(min(each, left)), time.perf_counter()
                    stepper.run(n, way / steps)
                    part.count_steps(n)
                    each = max(
                        1, min(MOST_STEPS_PER_CALL, int(n * CALL_SECONDS / max(time.perf_counter() - began, 1e-9)))
                    )
                    left -= n
                    report((float(times_of_run.now) - first) / (last - first))
                if left:
                    recorder.add(True)
                    return False
            times_of_run.now = t
            if len(recorder.t) < len(times):
                recorder.add(True)
            report((t - first) / (last - first))
            if t < last and part.over():
                if recorder.t[-1] < t:
                    recorder.add(True)
                return False
    except KeyboardInterrupt:
        return True
    return False


# The start of free bodies is the reference configuration itself; the engine need not be compiled for it.


def unassembled_start(c: CompiledMechanism, t: float) -> Assembly | None:
    """Return the assembled start if there is nothing to assemble; None otherwise."""
    s, model = c.structure, c.structure.model
    if s.rows or s.terms or s.states or len(s.forces) or model.initial:
        return None
    q = c.values.q.copy()
    return Assembly(c, t, q, described_velocities(c.values, q))


def body_states(base: Assembly) -> dict[str, BodyState]:
    """Return pose and velocity of every body at that start."""
    values, out = base.compiled.values, {}
    tree = values.structure.tables["tree"]
    for name, b in values.structure.place.items():
        if b >= 0:
            d = values.bodies[name]
            u = base.v[tree.velocities(b)]
            if values.structure.model.planar:
                v, w = np.r_[u[:2], 0.0], np.r_[0.0, 0.0, u[2:] if len(u) > 2 else 0.0]
            else:
                v, w = u[:3], d.R @ u[3:] if len(u) > 3 else np.zeros(3)
            out[name] = BodyState(d.c, d.R, v, w, d.angle)
    return out
