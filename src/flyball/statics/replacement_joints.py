"""Replacement joints: closed contacts and active stops, ropes, latches and friction as joints and constraints.

With these joints the linear equations and Newton's method include what holds the mechanism, exactly to second order,
as the stiffness requires. A sticking contact is a common point if one side is sharp, and rolls if it is round; a
frictionless contact keeps its height. Constraints that can push in one direction only have a sign, friction has a
capacity. The joints are defined by their frames in the reference configuration, and are constraint rows in any
coordinates.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ..assembly.assembled_state import Assembly
from ..assembly.compiled_mechanism import compile_mechanism
from ..constraints.blocks import COMMON_POINT, CONSTANT_DISTANCE, IN_PLANE, ON_PLANE, Row, no_slip
from ..constraints.switches.switch_kind import G_LOWER, G_UPPER, INTERVAL, NO_ROW, STATIC, SwitchKind
from ..derivatives.equation_derivatives import MechanismState
from ..derivatives.output_derivatives import snapshot
from ..engine.entry_point import MOTION
from ..engine.kinematics import load_record as record
from ..engine.loads import force_row
from ..errors import ModelError
from ..joints.coupler import Coupler
from ..laws.bytecode import STACK_RESERVE, evaluate
from ..model.body import GROUND
from ..model.element import Element, element
from ..model.force import Switch
from ..model.joint import Joint, WorldFrame
from ..model.model import Model
from ..model.unsupported_elements import unsupported_elements
from ..results.result import Result
from ..simulation.impulse_stepping.setup import movers_of_assembly
from ..tables.structure_definition import FrameSpec
from ..tables.values import Values
from .closed_contacts import (
    BALL,
    CLOSED_GAP,
    CORNER,
    DISK,
    FLAT,
    FORM_WORDS,
    SHARP,
    ContactState,
    StaticContact,
    SupportForces,
    SurfaceForm,
    support_forces,
    surface_form,
)
from .stability import RestState

Rows = tuple[tuple[float, ...], ...]


@element
class ContactJoint(Joint):
    """A closed contact between frames F on ``body_i`` and M on ``body_j``.

    Parameters
    ----------
    name : str
    body_i, body_j : str
    frames : two tuples of 12 numbers
        F and M in world axes in the reference configuration: origin, then rotation row by row.
    radii : tuple of two numbers [m]
        Radius of a disk, and of a ball; or the length of a link.
    """

    frames: tuple[tuple[float, ...], tuple[float, ...]]
    radii: tuple[float, float] = (0.0, 0.0)

    in_files: ClassVar[bool] = False
    planar_normal: ClassVar[str] = "y"  # z is the normal of the contact
    symbol: ClassVar[str] = "point_in_plane"

    def placed(self, n: SimpleNamespace, planar: bool) -> dict[str, WorldFrame]:
        """World frames F and M of the joint."""
        F, M = (
            (np.array(x[:3], float), np.array(x[3:], float).reshape(3, 3)) for x in (self.frames[0], self.frames[1])
        )
        return {"F": F, "M": M}


@element
class CommonPoint(ContactJoint):
    """Sticking contact with a sharp side: a common point."""

    blocks: ClassVar = COMMON_POINT
    symbol: ClassVar[str] = "spherical"


@element
class PointOnFlat(ContactJoint):
    """Point M that slides on the plane z = 0 of F; for a ball, its centre at the height of its radius."""

    blocks: ClassVar = (IN_PLANE,)

    def constants(self, n: SimpleNamespace, row: Row, F: WorldFrame, M: WorldFrame) -> tuple[float, ...]:
        """The height."""
        return (*row.par[:6], self.radii[1])


@element
class SlidingDisk(ContactJoint):
    """Disk M that slides on the plane z = 0 of F."""

    blocks: ClassVar[tuple[Row, ...]] = (ON_PLANE,)

    def constants(self, n: SimpleNamespace, row: Row, F: WorldFrame, M: WorldFrame) -> tuple[float, ...]:
        """The radii."""
        return (*row.par[:3], *self.radii, row.par[5], 0.0)


@element
class Rolling(SlidingDisk):
    """Ball or disk M that rolls on the plane z = 0 of F."""

    blocks: ClassVar[tuple[Row, ...]] = (ON_PLANE, no_slip("x"), no_slip("y"))
    symbol: ClassVar[str] = "rolling"


@element
class Centres(ContactJoint):
    """Two balls, or a ball and a corner, that slide on each other: the distance of the centres is constant."""

    blocks: ClassVar = CONSTANT_DISTANCE
    symbol: ClassVar[str] = "link"

    def constants(self, n: SimpleNamespace, row: Row, F: WorldFrame, M: WorldFrame) -> tuple[float, ...]:
        """The distance."""
        return (*row.par[:6], self.radii[1])


FRICTION_ITERATIONS, FRICTION_TOLERANCE = (
    30,
    1e-10,
)  # iterations for load-dependent friction, and relative change that counts as none


@element
class HeldCoordinate(Coupler):
    """Constraint that keeps the weighted sum of one or more coordinates constant."""

    in_files: ClassVar[bool] = False

    def check(self, n: Any) -> None:
        """Check nothing: the element that it replaces was checked."""


@dataclass
class ActiveConstraints:
    """Constraints that hold a mechanism at a position.

    Attributes
    ----------
    parts : tuple of Element
        Constraints in place of the active elements, with the names of these elements.
    leads : dict
        Name -> weight of the first coordinate in the quantity that it holds. The multiplier of its row is the effort
        along the quantity times this weight, as the row's first weight is 1.
    signs : dict
        Name -> +1 if its multiplier can only be positive, -1 only negative, 0 both.
    friction_elements : dict
        Active friction elements whose limit follows from a law: name -> element.
    strengths : dict
        Largest efforts of other elements that hold either way up to a limit: name -> number.
    units : dict
        Name -> unit of its effort, ``"N"`` or ``"N*m"``.
    """

    parts: list[Element] = field(default_factory=list)
    leads: dict[str, float] = field(default_factory=dict)
    signs: dict[str, float] = field(default_factory=dict)
    friction_elements: dict[str, Element] = field(default_factory=dict)
    strengths: dict[str, float] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)


def active_constraints(model: Model, at: Assembly) -> ActiveConstraints:
    """Constraints in place of the switching elements that are active at rest at a position.

    Raises
    ------
    ModelError
        If an active element has no equivalent constraint, or a user-defined kind does not say whether it holds.
    """
    out = ActiveConstraints()
    for x in switches_at_rest(model, at):
        e, kind = x.element, x.switch.kind
        _refuse_undecided(e, kind)
        sign = kind.push_direction(x.value, x.bounds, x.near)
        if sign is not None and not is_released(model, at, x):
            part = holding_constraint(e, x.switch, x.values, x.value)
            lead = float(part.weights[0]) if isinstance(part, HeldCoordinate) else 1.0
            out.parts.append(part)
            out.leads[e.name], out.units[e.name] = lead, x.unit
            out.signs[e.name] = sign * float(np.sign(lead))
            if kind.forces == INTERVAL and e.acts():
                out.friction_elements[e.name] = e
            elif kind.forces == INTERVAL:
                out.strengths[e.name] = x.strength
    return out


def is_released(model: Model, at: Assembly, x: SwitchAtRest) -> bool:
    """Whether an element that holds by friction has no capacity at all: an open clutch, a brake that is not applied."""
    if x.switch.kind.forces != INTERVAL:
        return False
    if not x.element.acts():
        return x.strength == 0.0
    unit = (1.0, 1.0, 1.0)  # any load: friction in proportion to it
    return friction_capacity(model, at, x.element, lambda joint: (unit, unit)) == 0.0


def stops_beyond(model: Model, at: Assembly) -> list[str]:
    """Names of the stops, plays, ropes and latches that are beyond a bound at a position."""
    out = []
    for x in switches_at_rest(model, at):
        guards = x.switch.kind.guards
        below = G_LOWER in guards and x.value < x.bounds[0] - x.near
        above = G_UPPER in guards and x.value > x.bounds[1] + x.near
        if below or above:
            out.append(x.element.name)
    return out


class SwitchAtRest(NamedTuple):
    """A switch at rest at a position: its element, the measured value, its bounds, and what is near to these."""

    element: Any
    switch: Switch
    values: Values
    value: float
    bounds: tuple[float, float]
    near: float
    strength: float
    unit: str  # of its effort

    def curves(self, effort: float, side: float) -> dict[str, float]:
        """Values of the element's curves at rest, by name, for the effort of its constraint.

        ``side`` is 1 or -1 where it holds on a side, 0 where it is open.
        """
        e = self.element
        seen = e.outward(self.values.numbers[e.name])
        side = abs(side) if "taut" in e.outputs else side
        found = zip(e.outputs, (seen * self.value, 0.0, e.sign * seen * effort, side), strict=False)
        return {f"{e.name}.{what}": x + 0.0 for what, x in found}


def switches_at_rest(model: Model, at: Assembly) -> list[SwitchAtRest]:
    """All switches of a model at a position."""
    if not any(e.switches() for e in unsupported_elements(model)):
        return []
    c = compile_mechanism(model, parameters=at.compiled.parameters, switches=True)
    q, v = c.take(at.compiled, at.t, at.q, 0.0 * at.v)
    c.at(at.t, q, v)
    n = c.values.system.switch_numbers
    out = []
    for k, x in enumerate(c.structure.switches):
        value = float(c.work.sensed.value[x.measured])
        turns = _is_rotation(model, x.element, x.switch)
        near, unit = (CLOSED_GAP, "N*m") if turns else (CLOSED_GAP * c.values.length, "N")
        bounds = float(n.lower[k]), float(n.upper[k])
        out.append(SwitchAtRest(x.element, x.switch, c.values, value, bounds, near, float(n.strength[k]), unit))
    return out


def _refuse_undecided(e: Element, kind: SwitchKind) -> None:
    """Refuse a user-defined kind with a row that does not define whether it holds at rest."""
    user_defined = not type(kind).__module__.startswith("flyball.")
    if user_defined and kind.forces != NO_ROW and type(kind).push_direction is SwitchKind.push_direction:
        raise ModelError(
            f"{e.title}: {type(kind).__name__} does not say whether it holds at rest; define push_direction(self, x, "
            "bounds, near): 1, -1 or 0 (either way) where it holds, None where it is open"
        )


def _is_rotation(model: Model, e: Element, w: Switch) -> bool:
    return bool(w.along) and model.unit(w.along[0], e) == "rad"


def holding_constraint(e: Any, w: Switch, x: Values, value: float) -> Element:
    """Constraint that keeps the quantity of a switch at its present value."""
    if w.along:
        n = x.numbers[e.name]
        weights = e.switch_weights(n, w.label) if w.summed else (1.0,)
        middle = e.total(n) if hasattr(e, "total") else None  # from which the quantity is measured
        value += 0.0 if middle is None else float(np.real(middle))
        return HeldCoordinate(e.name, w.along, weights=tuple(float(np.real(x)) for x in weights), value=value)
    if len(w.path) == 1:
        ends = [x.poses.world(FrameSpec(0, e, role)) for role in e.ends()]
        frames = [tuple(np.real(np.r_[p, np.ravel(R)]).tolist()) for p, R, _ in ends]
        at = frames[0][: 2 if x.structure.model.planar else 3]
        return Centres(e.name, *e.bodies, at=at, frames=(frames[0], frames[1]), radii=(0.0, value))
    more = len(w.path) - 1
    points = "a point" if more == 1 else f"{more} points"
    raise ModelError(
        f"{e.title} is taut, and runs over {points} between its ends; this analysis has no constraint for the sum of "
        "its lengths. Give it a stiffness"
    )


def friction_capacity(model: Model, at: Assembly, e: Any, reaction: Callable[[str], tuple]) -> float:
    """Static friction capacity of an element [N] or [N m]; ``reaction`` gives a joint's force and torque, (3,) each."""
    c = compile_mechanism(model, parameters=at.compiled.parameters)
    q, v = c.take(at.compiled, at.t, at.q, 0.0 * at.v)
    c.at(at.t, q, v, MOTION)
    s, S, W = c.structure, c.values.system, c.work
    k = next(i for i, f in enumerate(s.forces) if f is e)
    par, first = force_row(S.force_parameters, k), int(S.forces.laws[k, 0])
    x, load, law = float(W.sensed.value[S.forces.F[k]]), 0.0, 0.0
    if S.forces.load[k] >= 0:
        load = float(e.load(par, record(W.frames, int(S.forces.M[k])), *reaction(e.joint)))
    if first >= 0:
        stack = np.zeros((s.depth + 1 + STACK_RESERVE, 3))
        law = float(evaluate(S.code, S.const, first, stack, (at.t, x, 0.0), W.sensed))
    return abs(float(e.effort(par, x, 0.0, (law, 0.0, STATIC), load)))


def support_with_friction(
    model: Model, place: ContactState, x: RestState, held: ActiveConstraints
) -> tuple[SupportForces, dict[str, float]]:
    """Forces that carry a mechanism at rest, and the capacity of each sticking element under these loads.

    Capacities are those of the multipliers.
    """
    found, bears = support_forces(place, x, held.signs), dict[str, float]()
    for _ in range(FRICTION_ITERATIONS):
        result = snapshot(MechanismState.resting(x.c, x.t, x.q, found.lam))
        reaction = _joint_reactions(result)
        capacity = {k: friction_capacity(model, place.at, e, reaction) for k, e in held.friction_elements.items()}
        capacity |= held.strengths
        before, bears = bears, {k: most * abs(held.leads[k]) for k, most in capacity.items()}
        if all(abs(b - before.get(k, np.inf)) <= FRICTION_TOLERANCE * b for k, b in bears.items()):
            break
        found = support_forces(place, x, held.signs, bears)
    return found, bears


def _joint_reactions(result: Result) -> Callable[[str], tuple]:
    """Function that returns the force and torque of a joint in a result with one time."""

    def of(joint: str) -> tuple:
        return tuple(tuple(float(np.ravel(x)[0]) for x in part) for part in result.reactions.of(joint))

    return of


def model_without_contacts(model: Model, at: Assembly) -> tuple[Model, ActiveConstraints]:
    """The model without contacts, with `active_constraints` in place of the elements active at rest, and these."""
    gone = {e.name: None for e in (*model.contacts, *unsupported_elements(model))}
    out, held = model.changed(gone), active_constraints(model, at)
    out.add(*held.parts)
    return out.snapshot(), held


def model_with_contact_joints(bare: Model, place: ContactState) -> tuple[Model, dict[str, str]]:
    """Copy of the model without contacts in which closed contacts are joints.

    Returns
    -------
    model : Model
    missing : dict
        Contact -> reason why no joint is equivalent to it.
    """
    out, missing = bare.copy(), dict[str, str]()
    M = movers_of_assembly(place.scene, place.at)
    at = _ReferenceFrames(place)
    for c in place.contacts:
        G = place.scene.geometry
        a, b = surface_form(G, M, c.shapes[0], c.point, c.normal), surface_form(G, M, c.shapes[1], c.point, -c.normal)
        joint = _contact_joint(c, a, b, at)
        if isinstance(joint, str):
            missing[c.name] = joint
        else:
            out.add(joint)
    return out.snapshot(), missing


class _ReferenceFrames:
    """Transforms frames from the present position of the bodies to the reference configuration."""

    def __init__(self, place: ContactState) -> None:
        self.axes = 2 if place.at.compiled.structure.model.planar else 3
        self.here, self.drawn = place.bodies, place.at.compiled.values.given.bodies

    def __call__(self, body: str, p: np.ndarray, R: np.ndarray) -> tuple[float, ...]:
        """Origin and rotation of a frame on a body in the reference configuration."""
        if body != GROUND:
            x, d = self.here[body], self.drawn[body]
            p, R = np.real(d.c) + np.real(d.R) @ (x.R.T @ (p - x.p)), np.real(d.R) @ (x.R.T @ R)
        return tuple(float(v) for v in (*p, *R.ravel()))


def _contact_joint(c: StaticContact, a: SurfaceForm, b: SurfaceForm, at: _ReferenceFrames) -> ContactJoint | str:
    """The joint that is equivalent to a contact, or the reason why there is none."""
    bodies, up = c.bodies, c.normal
    if b.form == FLAT and a.form != FLAT:  # F is on the flat side
        a, b, bodies, up = b, a, (bodies[1], bodies[0]), -c.normal
    kind, centre, radii = _joint_kind(c.friction > 0.0, a, b)
    if kind is None:
        how = "sticking" if c.friction > 0.0 else "sliding"
        return f"{c.name} is a {how} contact between {FORM_WORDS[a.form]} and {FORM_WORDS[b.form]}"
    axle = b.axle if b.form == DISK else up
    first = a.centre if kind is Centres and a.form == BALL else c.point
    second = c.point if centre is None else centre
    frames = at(bodies[0], first, _normal_axes(up, c)), at(bodies[1], second, _axes_with_z(axle))
    return kind(c.name, bodies[0], bodies[1], at=tuple(c.point[: at.axes].tolist()), frames=frames, radii=radii)


def _joint_kind(
    sticks: bool, a: SurfaceForm, b: SurfaceForm
) -> tuple[type[ContactJoint] | None, np.ndarray | None, tuple[float, float]]:
    """Joint class, second origin (None: the contact point), and radii; ``a`` is flat if one side is."""
    forms = {a.form, b.form}
    if sticks:
        if CORNER in forms or forms <= set(SHARP):
            return CommonPoint, None, (0.0, 0.0)
        if a.form == FLAT and b.form in (BALL, DISK):
            return Rolling, b.centre, (0.0, b.radius) if b.form == BALL else (b.radius, 0.0)
        return None, None, (0.0, 0.0)
    if a.form == FLAT and b.form in SHARP:
        return PointOnFlat, None, (0.0, 0.0)
    if a.form == FLAT and b.form == BALL:
        return PointOnFlat, b.centre, (0.0, b.radius)
    if a.form == FLAT and b.form == DISK:
        return SlidingDisk, b.centre, (b.radius, 0.0)
    if forms <= {BALL, CORNER} and BALL in forms:
        return Centres, b.centre if b.form == BALL else None, (0.0, a.radius + b.radius)
    return None, None, (0.0, 0.0)


def _normal_axes(up: np.ndarray, c: StaticContact) -> np.ndarray:
    """Axes of a frame: z along the contact normal; in a planar model y is normal to the plane."""
    t = c.frame[1]
    return np.column_stack([t, np.cross(up, t), up])


def _axes_with_z(z: np.ndarray) -> np.ndarray:
    """Orthonormal axes with the given z axis."""
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def missing_joints_text(missing: Mapping[str, str]) -> str:
    """Text with the reasons why contacts have no equivalent joints."""
    return "; ".join(missing.values())
