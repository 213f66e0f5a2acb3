"""Operating point of a linearisation: the described state, an equilibrium, or the end of a motion.

Closed contacts and active stops, ropes and friction are replaced by joints and constraints. For the end of a motion
each switching element keeps the mode that it has at that time.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ..assembly.assemble import assemble
from ..assembly.assembled_state import Assembly
from ..assembly.compiled_mechanism import compile_mechanism
from ..constraints.switches.switch_kind import NO_ROW, OFF
from ..derivatives.equation_derivatives import MechanismState
from ..errors import AnalysisError, ModelError, SingularityError
from ..model.element import Element
from ..model.expressions import number
from ..model.model import Model
from ..model.names import groups_of
from ..model.unsupported_elements import unsupported_elements
from ..results.equilibrium import ABOUT_TO_OPEN, AT_FRICTION_LIMIT, Equilibrium, Touch
from ..results.result import Result
from ..results.wording import NOT_JUDGED
from ..simulation.initial_state import choose_coordinates, find_initial_state
from ..statics.closed_contacts import find_closed_contacts
from ..statics.contact_equilibrium import REST_BALANCE, event_notes, refuse_bulk_and_events, touch_states
from ..statics.replacement_joints import (
    holding_constraint,
    is_released,
    model_with_contact_joints,
    model_without_contacts,
    support_with_friction,
    switches_at_rest,
)
from ..statics.stability import RestState

if TYPE_CHECKING:
    from .linearize import OperatingPointOptions


SizeTest = Callable[[int, int], bool]
SPARSE_REASON = "absolute: with this many velocities their equations are sparse"


def operating_state(
    model: Model,
    about: Any = None,
    *,
    t: float | str = 0.0,
    parameters: Mapping[str, float] | None = None,
    coordinates: str = "auto",
    many: SizeTest | None = None,
) -> tuple[MechanismState, str]:
    """State at the operating point, and its coordinates with the reason for their choice.

    Parameters
    ----------
    model : Model
    about : None, Result or Equilibrium
        The state as described and assembled at ``t``, the end of a motion, or an equilibrium.
    t : float [s]
        Time; used if ``about`` is None.
    parameters : mapping, optional
        Values in SI units that replace those of the model and of the equilibrium.
    coordinates : str
        ``"auto"``, ``"absolute"`` or ``"joint"``.
    many : callable, optional
        Predicate on the numbers of velocities and rows; if true, absolute coordinates are used, which stay sparse.

    Raises
    ------
    AssemblyError
        If the mechanism cannot be assembled there.
    ModelError
        If ``about`` has another type.
    """
    if isinstance(about, Result):
        start = find_initial_state(model, about.final[0], parameters, about, coordinates)
        base, a, why = start.base, start.assembly, start.coordinates
    elif isinstance(about, Equilibrium):
        told = {**about.parameters, **(parameters or {})}
        base = _assembly_at_equilibrium(model, about, told)
        a, why = _in_requested_coordinates(base, coordinates, told, many)
    elif about is None:
        base = assemble(model, t=number(t, {}, "s", "t"), parameters=parameters)
        a, why = _in_requested_coordinates(base, coordinates, parameters, many)
    else:
        raise ModelError(f"about must be a result or an equilibrium, got {type(about).__name__}")
    s = a.compiled.structure
    if many is not None and many(s.nv, len(s.rows)) and not s.rotors:
        a, why = base, SPARSE_REASON
    return MechanismState.moving(a.compiled, a.t, a.q, a.v), why


def _in_requested_coordinates(
    base: Assembly,
    coordinates: str,
    parameters: Mapping[str, float] | None,
    many: SizeTest | None,
) -> tuple[Assembly, str]:
    """Convert an assembly to the requested coordinates; large mechanisms stay in absolute coordinates."""
    s = base.compiled.structure
    if many is not None and not s.rotors_without_velocity and coordinates == "auto" and many(s.nv - len(s.rows), 0):
        return base, SPARSE_REASON
    return choose_coordinates(base, coordinates, parameters)


def _assembly_at_equilibrium(model: Model, about: Equilibrium, parameters: Mapping[str, float]) -> Assembly:
    """Assemble the model at the position of an equilibrium, without a check that it still rests there.

    Raises
    ------
    ModelError
        If the equilibrium is of another mechanism, or if the mechanism has changed since its preload was found.
    """
    old = about.assembly.compiled
    if about.preload:
        own = old.structure.model
        loaded = {x for name in about.preload for x in (*groups_of(name), name)}
        parts, others = ([e for e in m.elements() if e.name not in loaded] for m in (model, own))
        if parts != others:
            raise ModelError(f"{model.name!r} has changed since its preload was computed; compute it again")
        model = own
    if [b.name for b in model.bodies] != [b.name for b in old.structure.model.bodies]:
        raise ModelError(f"about is an equilibrium of {old.structure.model.name!r}, which has other bodies")
    c = compile_mechanism(model.snapshot(), parameters=parameters)
    t, q, v = about.assembly.t, about.assembly.q, about.assembly.v
    q, v = c.take(old, t, q, v)
    return Assembly(c, t, q, v)


O = TypeVar("O", bound="OperatingPointOptions")


def contact_operating_point(model: Model, o: O, analysis: str) -> tuple[Model, O, tuple[str, ...]]:
    """Model with closed contacts as joints, the options with this operating point, and notes for the result.

    Raises
    ------
    AnalysisError
        If forces do not balance there.
    ModelError
        If no joint moves like a closed contact, ``about`` is a motion with contacts, or an input is a parameter.
    SingularityError
        If a contact is at its friction limit.
    """
    refuse_bulk_and_events(model, analysis)
    if isinstance(o.about, Equilibrium) and o.about.broken:
        model = model.changed(dict.fromkeys(o.about.broken))
    model = model.snapshot()
    _refuse_parameter_inputs(model, getattr(o, "inputs", ()), analysis)
    if isinstance(o.about, Result):
        joined, at, notes = frozen_mode_model(model, o.about, o.parameters or {}, analysis)
        return joined, dataclasses.replace(o, about=_equilibrium_at(at), t=None), (*notes, *event_notes(model))
    base = _rest_assembly(model, o, analysis)
    own = base.compiled.parameters
    place = find_closed_contacts(model, base)
    bare, held = model_without_contacts(model, base)
    joined, missing = model_with_contact_joints(bare, place)
    if missing:
        raise ModelError(f"{analysis} does not support these contacts: {'; '.join(missing.values())}")
    c = compile_mechanism(bare, parameters=own)
    x = RestState(c, base.t, c.take(base.compiled, base.t, base.q, base.v)[0], np.zeros(len(c.structure.rows)))
    found, bears = support_with_friction(model, place, x, held)
    if found.unbalanced > REST_BALANCE:
        raise AnalysisError(
            f"{model.name!r} does not rest there: contacts, joints and locked elements leave the fraction "
            f"{found.unbalanced:.2g} of the forces unbalanced. Give about=m.equilibrium()"
        )
    notes = (*_contact_notes(touch_states(place, found, x, held, bears), base.t), *event_notes(model))
    joined = joined.changed({name: None for name, most in bears.items() if most == 0.0}).snapshot()
    c = compile_mechanism(joined, parameters=own)
    q, v = c.take(base.compiled, base.t, base.q, base.v)
    return joined, dataclasses.replace(o, about=_equilibrium_at(Assembly(c, base.t, q, v)), t=None), notes


def _refuse_parameter_inputs(model: Model, inputs: tuple[str, ...], analysis: str) -> None:
    for name in inputs:
        if name in model.parameters:
            raise ModelError(f"{analysis}: input {name!r} is a parameter, which may move contacts; give a force's law")


def _rest_assembly(model: Model, o: Any, analysis: str) -> Assembly:
    """Assembly at the position of rest."""
    if o.about is None:
        base = assemble(model, t=o.t or 0.0, parameters=o.parameters)
        if np.abs(base.v).max(initial=0.0) > 0.0:
            raise moving_error(model, analysis)
        return base
    if not isinstance(o.about, Equilibrium):
        raise ModelError(f"{analysis} with contact is about rest: give about=m.equilibrium(), not a motion")
    old = o.about.assembly
    if [b.name for b in model.bodies] != [b.name for b in old.compiled.structure.model.bodies]:
        raise ModelError(f"about is an equilibrium of {old.compiled.structure.model.name!r}, which has other bodies")
    c = compile_mechanism(model, parameters={**o.about.parameters, **(o.parameters or {})})
    return Assembly(c, old.t, *c.take(old.compiled, old.t, old.q, 0.0 * old.v))


def moving_error(model: Model, analysis: str) -> ModelError:
    """The error for switching elements in a mechanism that is described in motion."""
    other = "" if model.contacts or model.bulk else ", or about the end of a motion: about=m.simulate(...)"
    parts = ", ".join(e.title for e in unsupported_elements(model))
    return ModelError(
        f"{analysis} with {parts} is made about a position of rest, and {model.name!r} moves: give "
        f"about=m.equilibrium(){other}"
    )


def _contact_notes(touches: tuple[Touch, ...], t: float) -> tuple[str, ...]:
    """Notes on contacts that are about to open.

    Raises
    ------
    SingularityError
        If friction is at its limit: it sticks in one direction and slides in the other.
    """
    limit = tuple(k.name for k in touches if k.state == AT_FRICTION_LIMIT)
    if limit:
        raise SingularityError(
            f"{', '.join(limit)}: friction is at its limit: it sticks in one direction and slides in the other, so "
            "there is no linear model",
            t,
            limit,
        )
    parting = [k.name for k in touches if k.state == ABOUT_TO_OPEN]
    return (f"{', '.join(parting)} about to open: the results are valid while it stays closed",) if parting else ()


def _equilibrium_at(at: Assembly) -> Equilibrium:
    """Wrap an assembly in an `Equilibrium` of which only the position is used."""
    none: Any = None
    return Equilibrium(
        t=at.t, stability=NOT_JUDGED, unbalanced=0.0, method="", parameters=dict(at.compiled.parameters), result=none,
        assembly=at, speeds=motion_speed(at),
    )  # fmt: skip


# Operating point in motion with frozen modes: active elements become constraints, sliding friction goes on sliding.


def frozen_mode_model(
    model: Model, about: Result, parameters: Mapping[str, float], analysis: str
) -> tuple[Model, Assembly, tuple]:
    """Model with the elements active at the end of a motion as constraints, its state there, and notes.

    Raises
    ------
    ModelError
        If the result has no recorded modes, or the model has contacts or bulk material.
    """
    if about.phases is None or model.contacts or model.bulk:
        raise ModelError(f"{analysis} with contact is about rest: give about=m.equilibrium(), not a motion")
    base = find_initial_state(model, about.final[0], parameters, about, "absolute").base
    own, last = about.values.structure, about.phases.all[-1]
    now = switches_at_rest(model, base)
    gone: dict[str, None] = {e.name: None for e in unsupported_elements(model)}
    parts, slides = list[Element](), list[str]()
    for k, x in enumerate(own.switches):
        e, off = model[x.element.name], last.modes.mode[k] == OFF
        if x.switch.kind.forces == NO_ROW:
            continue
        if off and x.switch.kind.kinetic:
            gone.pop(e.name, None)
            slides.append(e.title)
        elif not off and not is_released(model, base, now[k]):
            parts.append(holding_constraint(e, x.switch, now[k].values, now[k].value))
    out = model.changed(gone)
    out.add(*parts)
    joined = compile_mechanism(out.snapshot(), parameters=base.compiled.parameters)
    q, v = joined.take(base.compiled, base.t, base.q, base.v)
    return joined.structure.model, Assembly(joined, base.t, q, v), _mode_notes(model, gone, parts, slides)


def _mode_notes(model: Model, removed: dict[str, None], parts: list[Element], slides: list[str]) -> tuple[str, ...]:
    held = {p.name for p in parts}
    said = ((", ".join(model[n].title for n in held), "held"), (", ".join(slides), "assumed to keep sliding"),
            (", ".join(model[n].title for n in removed if n not in held), "open, not in the model"))  # fmt: skip
    return tuple(f"{names}: {what}" for names, what in said if names)


def motion_speed(at: Assembly) -> dict[str, float]:
    """The largest speed as ``{"motion": speed}`` if the state moves, else empty."""
    fastest = float(np.abs(at.v).max(initial=0.0))
    return {"motion": fastest} if fastest > 0.0 else {}
