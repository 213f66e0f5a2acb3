"""Equilibrium with contact: settling by impulse steps, the forces that carry the mechanism, and its stability.

Whenever the kinetic energy has passed a peak, all velocities are set to zero (kinetic damping: Cundall 1976). An
oscillation then settles within a few swings, and what sticks never moves. Time is constant for all laws meanwhile.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from ..assembly.assemble import assemble
from ..assembly.assembled_state import Assembly
from ..assembly.compiled_mechanism import CompiledMechanism, compile_mechanism
from ..derivatives.equation_derivatives import MechanismState
from ..derivatives.output_derivatives import snapshot
from ..errors import AnalysisError, ModelError, NotConverged
from ..model.contact import not_for_impulse_stepping
from ..model.event import Action, Lock, Release, Set
from ..model.model import Model
from ..model.names import curve_parts
from ..results.equilibrium import ABOUT_TO_OPEN, AT_FRICTION_LIMIT, CLOSED, FRICTIONLESS, STICKS, Equilibrium, Touch
from ..results.wording import MARGINAL, NOT_JUDGED
from ..simulation.impulse_stepping.impulse_simulation import OutputRecorder, free_coordinates
from ..simulation.impulse_stepping.impulse_stepper import ImpulseStepper, NoSolution
from ..simulation.impulse_stepping.setup import (
    MechanismMotion,
    StepSize,
    make_stepper,
    movers_of_assembly,
    partition_bodies,
    separate_mechanism,
    smallest_radius,
    values_with_stops,
)
from ..simulation.impulse_stepping.stepping_tables import NO_RESTITUTION
from ..simulation.integration_options import Stepping
from ..tables.contact_tables import ContactTables, contact_tables
from ..tables.structure_definition import velocity_names
from .closed_contacts import FRICTION_LIMIT as NEAR
from .closed_contacts import PARTING_LIMIT as NOTHING
from .closed_contacts import ContactState, SupportForces, contact_table, find_closed_contacts, refuse_unknown_surfaces
from .equilibrium_search import equilibrium_result, newton_search
from .replacement_joints import (
    ActiveConstraints,
    active_constraints,
    missing_joints_text,
    model_with_contact_joints,
    model_without_contacts,
    stops_beyond,
    support_with_friction,
    switches_at_rest,
)
from .stability import RestState

SETTLING_STEPS = 40_000
SETTLING_TRAVEL = 20.0  # travel, in lengths of the mechanism, after which settling has failed
# Step size relative to the time in which the smallest shape falls by its own size (without gravity: to that of the
# characteristic rate), and residual of velocities relative to the speed of that fall in a step.
STEP_FRACTION, VELOCITY_RESIDUAL = 0.04, 1e-9
REST_ACCELERATION = 1e-7  # acceleration at rest, relative to the acceleration without contact
SETTLING_ITERATIONS = 400


def settled_assembly(model: Model, base: Assembly, parameters: Mapping[str, float] | None) -> Assembly:
    """Let a mechanism settle; returns the assembly at rest, in absolute coordinates.

    Parameters
    ----------
    model : Model
        The model with its contacts.
    base : Assembly
        The initial position, as assembled.
    parameters : mapping, optional

    Raises
    ------
    NotConverged
        If it does not come to rest.
    """
    values = base.compiled.values
    found = partition_bodies(model, values_with_stops(model, values, parameters))
    scene = contact_tables(model, values.given, (*found.free, *found.held))
    refuse_unknown_surfaces(scene)
    free = len(scene.carriers.mass) - len(found.held)
    held = separate_mechanism(values, base.t, parameters, found, free)
    size, rate = smallest_radius(scene, values), float(base.compiled.work.options.rate)
    fall = float(np.linalg.norm(values.system.gravity)) or size * rate * rate
    h = STEP_FRACTION * math.sqrt(size / fall)
    o = Stepping(step=h, iterations=SETTLING_ITERATIONS, position_iterations=SETTLING_ITERATIONS)
    chosen = StepSize(h, VELOCITY_RESIDUAL * fall * h, "")
    still = Assembly(base.compiled, base.t, base.q, 0.0 * base.v)
    if held:
        own = held.start.assembly.compiled
        held.joints.clock.y.current[: own.structure.nq] = own.take(base.compiled, base.t, still.q, still.v)[0]
    try:
        stepper = make_stepper(scene, movers_of_assembly(scene, still), values, o, chosen, held)
        stepper.state.options.restitution_law = NO_RESTITUTION
        _Settling(scene, stepper, held, h, base).walk(model.name)
    except NoSolution:
        raise AnalysisError(
            f"{model.name!r} does not come to rest: its equations have no solution during the settling motion"
        ) from None
    kept = OutputRecorder(stepper, held, np.zeros(len(scene.carriers.mass) + 1, np.int64))
    kept.add(False)
    q, v, vdot = free_coordinates(base, scene, kept)
    if held:
        held.write_into(values, q, v, vdot)
    return Assembly(base.compiled, base.t, q[-1], 0.0 * base.v)


class _Settling:
    """Settling of a mechanism by impulse steps.

    Parameters
    ----------
    scene : ContactTables
    stepper : ImpulseStepper
    held : MechanismMotion, optional
    h : float [s]
    base : Assembly
        The initial position.
    """

    def __init__(
        self, scene: ContactTables, stepper: ImpulseStepper, held: MechanismMotion | None, h: float, base: Assembly
    ) -> None:
        self.scene, self.stepper, self.held, self.t, self.h = scene, stepper, held, base.t, h
        c = base.compiled
        self.size = c.values.length
        vdot = MechanismState.moving(c, base.t, base.q, 0.0 * base.v, rotors=False).vdot
        self.usual = float(np.abs(vdot * self.size / c.sizes).max(initial=0.0))  # acceleration without contact

    def walk(self, name: str) -> None:
        """Step until a step from rest causes no motion."""
        before, rested, begun = 0.0, True, self.stepper.movers.pose[:, :3].copy()
        self._stop()
        for _ in range(SETTLING_STEPS):
            self._step()
            now = self._energy()
            if rested:
                acceleration = max(self._speeds().values(), default=0.0) / self.h
                self.usual = max(self.usual, acceleration)
                if acceleration <= REST_ACCELERATION * self.usual:
                    return
                if (
                    float(np.abs(self.stepper.movers.pose[:, :3] - begun).max(initial=0.0))
                    > SETTLING_TRAVEL * self.size
                ):
                    break
            rested = now <= before
            before = 0.0 if rested else now
            if rested:
                self._stop()
        raise self._failure(name)

    def _step(self) -> None:
        s = self.stepper
        s.state.times.now = self.t
        s.joints.real.time = self.t
        s.run(1, self.h)

    def _stop(self) -> None:
        """Set all velocities to zero."""
        s = self.stepper
        s.workspaces.X.v[:], s.workspaces.X.wide[:], s.movers.twist[:] = 0.0, 0.0, 0.0
        if self.held:
            self._mechanism_velocities()[:] = 0.0

    def _energy(self) -> float:
        s, at = self.stepper, self.scene.carriers
        n = len(s.free.turn)
        v = s.workspaces.X.v[:n]
        w = np.einsum("kji,kj->ki", s.movers.pose[:n, 3:].reshape(-1, 3, 3), v[:, 3:6])
        own = at.mass[:n] * (v[:, :3] ** 2).sum(axis=1) + np.einsum("ki,kij,kj->k", w, at.inertia[:n], w)
        return 0.5 * float(own.sum()) + (
            self._mechanism().kinetic_energy(self._mechanism_velocities()) if self.held else 0.0
        )

    def _mechanism(self) -> CompiledMechanism:
        return self.held.start.assembly.compiled  # type: ignore[union-attr]

    def _mechanism_velocities(self) -> np.ndarray:
        """View of the velocities of the mechanism."""
        own = self._mechanism().structure
        return self.stepper.joints.clock.y.current[own.nq : own.nq + own.nv]

    def _speeds(self) -> dict[str, float]:
        """Speed of every body [m/s]: of its centre, and of its rotation at the radius of gyration."""
        s, at = self.stepper, self.scene.carriers
        n = len(s.free.turn)
        v = s.workspaces.X.v[:n]
        radius = np.sqrt(np.trace(at.inertia[:n], axis1=1, axis2=2) / np.where(at.mass[:n] > 0.0, at.mass[:n], 1.0))
        free = np.hypot(np.linalg.norm(v[:, :3], axis=1), radius * np.linalg.norm(v[:, 3:6], axis=1))
        out = {at.name(k): float(free[k]) for k in range(n)}
        if self.held:
            c = self._mechanism()
            for own, x in zip(
                velocity_names(c.structure), self._mechanism_velocities() * c.values.length / c.sizes, strict=True
            ):
                name = curve_parts(own.name)[0]
                out[name] = max(out.get(name, 0.0), abs(float(x)))
        return out

    def _failure(self, name: str) -> NotConverged:
        speed = self._speeds()
        who = max(speed, key=lambda k: speed[k])
        return NotConverged(
            f"{name!r} does not come to rest: after {SETTLING_STEPS * self.h:.3g} s {who!r} still moves at "
            f"{speed[who]:.3g} m/s: it falls, slides or rolls away. Add friction, a stop or a spring, or start nearer "
            "to its position of rest",
            speed,
        )


HoldingParts = tuple[ActiveConstraints, Mapping[str, float]]
"""Active constraints besides contacts, and the capacity of each sticking part."""
# Largest correction of the settled position by Newton's method [rad, or relative to the mechanism's length].
CORRECTION_LIMIT = 0.02
LOAD_ROUNDING = 1e-12  # a force below this part of all that acts on the mechanism is rounding
SETTLING_METHOD = "impulse time stepping"
START_REMEDY = "describe it nearer to its position of rest, or give start= a motion at whose end it rests"
Search = Callable[[Model, Assembly], Equilibrium]
REST_BALANCE = 1e-6  # largest residual of a state at rest, relative to the applied forces


def contact_equilibrium(
    model: Model, begin: Assembly, parameters: Mapping[str, float] | None, search: Search
) -> Equilibrium:
    """Find where a mechanism comes to rest, and the forces that carry it there.

    It rests as described, or where impulse steps lead it; with elements that these do not support, where ``search``
    finds a balance of forces with the contacts and stops that are closed as described.

    Parameters
    ----------
    model : Model
        With its contacts.
    begin : Assembly
        The initial position.
    parameters : mapping, optional
    search : callable
        Finds an equilibrium of a smooth model near an assembly.

    Raises
    ------
    ModelError
        If the model has bulk material or surfaces that statics does not support.
    NotConverged
        If it does not come to rest.
    """
    refuse_bulk_and_events(model, "equilibrium")
    model = model.snapshot()
    place = _rest_contacts(model, begin, parameters)
    if place is None:
        return closed_contact_equilibrium(model, begin, parameters, search)
    bare, held = model_without_contacts(model, place.at)
    place, judged, missing = _stability_with_joints(model, bare, place, parameters)
    x = _rest_state(bare, place, parameters)
    found, bears = support_with_friction(model, place, x, held)
    if found.unbalanced > REST_BALANCE:
        raise NotConverged(
            f"{model.name!r} came to rest where contacts and joints leave the fraction {found.unbalanced:.2g} of the "
            "forces unbalanced; start nearer to its position of rest",
            {},
        )
    return _contact_equilibrium_result(model, x, place, found, judged, missing, (held, bears))


def closed_contact_equilibrium(
    model: Model, begin: Assembly, parameters: Mapping[str, float] | None, search: Search
) -> Equilibrium:
    """Equilibrium with the contacts and stops that are closed at the initial position; for the arguments see above.

    Raises
    ------
    ModelError
        If the model has bulk material or events, or no joint is equivalent to a closed contact.
    NotConverged
        If other contacts or stops are closed at the equilibrium, or if they would have to pull or to slide.
    """
    refuse_bulk_and_events(model, "equilibrium")
    model = model.snapshot()
    place = find_closed_contacts(model, begin)
    bare, held = model_without_contacts(model, begin)
    joined, missing = model_with_contact_joints(bare, place)
    if missing:
        raise ModelError(
            f"{model.name!r} has elements whose equilibrium needs a joint in place of every closed contact: "
            f"{missing_joints_text(missing)}"
        )
    c = compile_mechanism(joined, parameters=parameters)
    q, v = c.take(begin.compiled, begin.t, begin.q, 0.0 * begin.v)
    smooth = search(joined, Assembly(c, begin.t, q, v))
    place = _with_the_same_contacts(model, place, held, smooth.assembly)
    x = _rest_state(bare, place, parameters)
    found, bears = support_with_friction(model, place, x, held)
    if found.unbalanced > REST_BALANCE:
        names = ", ".join([c.name for c in place.contacts] + [e.name for e in held.parts])
        raise NotConverged(
            f"{model.name!r} does not rest with {names} closed: they would have to pull, or to carry more friction "
            f"than they can; {START_REMEDY}",
            {},
        )
    return _contact_equilibrium_result(model, x, place, found, smooth, "", (held, bears))


def _with_the_same_contacts(model: Model, place: ContactState, held: ActiveConstraints, at: Assembly) -> ContactState:
    """The contacts at an assembly of the model with joints; refused if others are closed than in ``place``."""
    own = place.at.compiled
    moved = Assembly(own, at.t, own.take(at.compiled, at.t, at.q, 0.0 * at.v)[0], np.zeros(own.structure.nv))
    there = find_closed_contacts(model, moved)
    before = {*(c.name for c in place.contacts), *(e.name for e in held.parts)}
    now = {*(c.name for c in there.contacts), *(e.name for e in active_constraints(model, moved).parts)}
    if changed := before ^ now.union(stops_beyond(model, moved)):
        raise NotConverged(
            f"{model.name!r} has no equilibrium with the contacts and stops that are closed where the search starts: "
            f"{', '.join(sorted(changed))} would open or close; {START_REMEDY}",
            {},
        )
    return there


def _rest_contacts(model: Model, begin: Assembly, parameters: Mapping[str, float] | None) -> ContactState | None:
    """Contacts at the position of rest: as described if forces balance there, else found by impulse steps.

    None if it does not rest as described and has parts that impulse stepping does not support.
    """
    place = find_closed_contacts(model, begin)
    bare, held = model_without_contacts(model, place.at)
    left = support_with_friction(model, place, _rest_state(bare, place, parameters), held)[0].unbalanced
    if left <= REST_BALANCE:
        return place
    if not_for_impulse_stepping(model):
        return None
    return find_closed_contacts(model, settled_assembly(model, begin, parameters))


def _rest_state(bare: Model, place: ContactState, parameters: Mapping[str, float] | None) -> RestState:
    """State at rest of the model without contacts, with active constraints, at a position."""
    c = compile_mechanism(bare, parameters=parameters)
    q, _ = c.take(place.at.compiled, place.at.t, place.at.q, 0.0 * place.at.v)
    return RestState(c, place.at.t, q, np.zeros(len(c.structure.rows)))


def refuse_bulk_and_events(model: Model, analysis: str) -> None:
    """Refuse bulk material, and events that change the mechanism: that lock, release, or set a parameter.

    Other events change states and velocities only, at instants that have no effect on a state of rest.
    """
    changing = [e for e in model.events if any(_changes_mechanism(model, a) for a in e.do)]
    if changing:
        without = ", ".join(f"{e.name!r}: None" for e in changing)
        raise ModelError(
            f"{analysis} does not support events that lock, release or set parameters, and {model.name!r} has "
            f"{', '.join(e.title for e in changing)}; simulate does. Without them: "
            f"m.changed({{{without}}}).{analysis}(...)"
        )
    if model.bulk:
        names = ", ".join(e.title for e in model.bulk)
        raise ModelError(
            f"{analysis} does not support {names}; describe bodies in contact one by one, or simulate the mechanism"
        )


def event_notes(model: Model) -> tuple[str, ...]:
    """Note on events, which are left out at rest."""
    return (f"{', '.join(e.title for e in model.events)}: left out",) if model.events else ()


def _changes_mechanism(model: Model, action: Action) -> bool:
    """Whether an action changes constraints or parameters."""
    return isinstance(action, (Lock, Release)) or (isinstance(action, Set) and action.parameter in model.parameters)


def contacts_as_described(model: Model, t: float, parameters: Mapping[str, float] | None) -> ContactState:
    """Contacts in the described position."""
    return find_closed_contacts(model, assemble(model, t=t, parameters=parameters))


def _stability_with_joints(
    model: Model, bare: Model, place: ContactState, parameters: Mapping[str, float] | None
) -> tuple[ContactState, Equilibrium | None, str]:
    """Correct the position with closed contacts as joints; (position, its equilibrium or None, missing joints)."""
    joined, missing = model_with_contact_joints(bare, place)
    if missing:
        return place, None, missing_joints_text(missing)
    c = compile_mechanism(joined, parameters=parameters)
    q, _ = c.take(place.at.compiled, place.at.t, place.at.q, 0.0 * place.at.v)
    start = RestState(c, place.at.t, q, np.zeros(len(c.structure.rows)))
    try:
        arrived = newton_search(start)
        if arrived is None:
            return place, None, "Newton's method does not settle with the closed contacts as joints"
        far = c.values.length * CORRECTION_LIMIT
        own, still = place.at.compiled, np.zeros(c.structure.nv)
        moved = Assembly(own, place.at.t, own.take(c, place.at.t, arrived.q, still)[0], still)
        now = own.moving(moved.t, moved.q, moved.v)
        if max(float(np.abs(now[k].p - b.p).max()) for k, b in place.bodies.items()) > far:
            return place, None, "the balance of forces is elsewhere with the closed contacts as joints"
        again = find_closed_contacts(model, moved)
        if [k.name for k in again.contacts] != [k.name for k in place.contacts]:
            return place, None, "contacts open where forces balance"
        return again, equilibrium_result(arrived, {}, ""), ""
    except AnalysisError as error:
        return place, None, str(error)


def _contact_equilibrium_result(
    model: Model,
    x: RestState,
    place: ContactState,
    found: SupportForces,
    smooth_result: Equilibrium | None,
    missing: str,
    held: HoldingParts,
) -> Equilibrium:
    c = x.c
    touches = touch_states(place, found, x, *held)
    result = snapshot(MechanismState.resting(c, x.t, x.q, found.lam))
    result.contacts = contact_table(place, found.force)
    smooth_notes = smooth_result.notes if smooth_result else ()
    notes = (*_equilibrium_notes(touches, found, missing), *event_notes(model), *smooth_notes)
    kind = smooth_result.stability if smooth_result else NOT_JUDGED
    if smooth_result and any(k.state in (AT_FRICTION_LIMIT, ABOUT_TO_OPEN) for k in touches) and kind != "unstable":
        kind = MARGINAL
    own = smooth_result or Equilibrium(
        t=x.t, stability=NOT_JUDGED, unbalanced=0.0, method="", parameters={}, result=result, assembly=None,
    )  # fmt: skip
    return replace(
        own,
        stability=kind,
        unbalanced=found.unbalanced,
        method=SETTLING_METHOD if smooth_result is None else own.method or f"{SETTLING_METHOD}, then Newton's method",
        parameters=dict(c.parameters),
        result=result,
        assembly=Assembly(c, x.t, x.q, np.zeros(len(x.scale))),
        touching=touches,
        notes=notes,
        switch_curves=_switch_curves(model, place, x, found.lam, held[0]),
    )


def touch_states(
    place: ContactState, found: SupportForces, x: RestState, held: ActiveConstraints, bears: Mapping[str, float]
) -> tuple[Touch, ...]:
    """State of every closed contact and of every other active constraint."""
    out = []
    lam = {name: float(found.lam[x.c.structure.slices[name]].sum()) for name in held.signs}
    stops = {
        name: sign * lam[name] if sign else abs(lam[name])  # what holds either way cannot open
        for name, sign in held.signs.items()
        if name not in bears
    }
    lever = {name: 1.0 / x.row_scale[x.c.structure.slices[name]].max() for name in stops}  # efforts times it: energies
    rounding = LOAD_ROUNDING * x.size / NOTHING  # energies
    heaviest = max([rounding, *(lever[name] * abs(effort) for name, effort in stops.items())])
    most = max([rounding / x.c.values.length, *found.force[:, 0].tolist()])
    for c, f in zip(place.contacts, found.force, strict=True):
        slides = float(np.hypot(f[1], f[2]))
        most_of_it = c.friction * float(f[0])
        used = slides / most_of_it if most_of_it > 0.0 else 0.0
        state = ABOUT_TO_OPEN if f[0] <= NOTHING * most else FRICTIONLESS if c.friction == 0.0 else STICKS
        state = AT_FRICTION_LIMIT if state == STICKS and used >= 1.0 - NEAR else state
        out.append(Touch(c.name, state, float(f[0]), slides, used, c.gap))
    for name, bound in bears.items():
        used = abs(lam[name]) / bound if bound > 0.0 else 0.0
        state = AT_FRICTION_LIMIT if used >= 1.0 - NEAR else STICKS
        lead = abs(held.leads[name])
        out.append(Touch(name, state, bound / lead, abs(lam[name]) / lead, used, unit=held.units[name], capacity=True))
    for name, effort in stops.items():
        opens = held.signs[name] and lever[name] * effort <= NOTHING * heaviest
        out.append(
            Touch(name, ABOUT_TO_OPEN if opens else CLOSED, effort / abs(held.leads[name]), unit=held.units[name])
        )
    return tuple(out)


def _switch_curves(model: Model, place: ContactState, x: RestState, lam: np.ndarray, held: ActiveConstraints) -> dict:
    """Curves of stops, ropes, latches and brakes at rest, by name."""
    out: dict[str, float] = {}
    for k in switches_at_rest(model, place.at):
        name = k.element.name
        effort, side = 0.0, 0.0
        if name in held.signs:
            lead = held.leads[name]
            effort, side = float(lam[x.c.structure.slices[name]].sum()) / lead, np.sign(lead) * held.signs[name] or 1.0
        out |= k.curves(effort, side)
    return out


def _equilibrium_notes(touches: tuple[Touch, ...], found: SupportForces, missing: str) -> tuple[str, ...]:
    """Notes for the result."""
    out = []
    for state, rule in (
        (ABOUT_TO_OPEN, "it carries no force; the results are valid while it stays closed"),
        (AT_FRICTION_LIMIT, "any more load along it would make it slide"),
    ):
        names = [k.name for k in touches if k.state == state]
        if names:
            out.append(f"{', '.join(names)} {state}: {rule}")
    if any(k.state in (STICKS, AT_FRICTION_LIMIT) for k in touches):
        out.append(
            "friction keeps it at rest: positions nearby are equilibria too, and this is the one reached from the "
            "start; its stability is that with sticking contacts"
        )
    if not found.unique:
        out.append(
            "the distribution of the load on contacts and joints is not unique: their forces are one of several "
            "solutions"
        )
    if missing:
        out.append(f"stability is not judged: {missing}")
    return tuple(out)
