"""Small motions with closed contacts: the mechanism in which these are joints, where it rests."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ...constraints.modes import BRANCH, ELASTIC, FRICTION
from ...errors import AnalysisError, ModelError, SingularityError
from ...model.element import Element
from ...model.model import Model
from ...results.equilibrium import UNJUDGED, Equilibrium
from ...results.result import Result
from ...results.touch import LIMIT, PARTING, Touch
from ...tables.system import OFF, VALUE
from ..assemble import assemble
from ..assembly.start import Assembly
from ..compiled import compiled
from ..linear.rest import Rest
from ..motion.start import begin
from ..untouched import holding_parts
from .closed import closed
from .copy import joined_copy, open_copy
from .holds import constraint, supported
from .rest import BALANCED, refuse_bulk, touching

if TYPE_CHECKING:
    from ..linearize import InstantOptions

O = TypeVar("O", bound="InstantOptions")


def closed_instant(model: Model, o: O, analysis: str) -> tuple[Model, O, tuple[str, ...]]:
    """The mechanism with closed contacts as joints, the options about where it rests, and what has to be said.

    Raises
    ------
    AnalysisError
        If forces do not balance there.
    ModelError
        If a closed contact moves in a way that no joint does, it is asked about a motion, or an input is a parameter.
    SingularityError
        If a contact is at its friction limit.
    """
    refuse_bulk(model, analysis)
    model = model.snapshot()
    _refuse_parameters(model, getattr(o, "inputs", ()), analysis)
    if isinstance(o.about, Result):
        joined, at, notes = frozen_modes(model, o.about, o.parameters or {}, analysis)
        return joined, dataclasses.replace(o, about=_about(at), t=None), notes
    base = _base(model, o, analysis)
    own = base.compiled.parameters
    place = closed(model, base)
    bare, held = open_copy(model, base)
    joined, missing = joined_copy(bare, place)
    if missing:
        raise ModelError(f"{analysis} does not know how contacts move: {'; '.join(missing.values())}")
    c = compiled(bare, parameters=own)
    x = Rest(c, base.t, c.take(base.compiled, base.t, base.q, base.v)[0], np.zeros(len(c.structure.rows)))
    found, bears = supported(model, place, x, held)
    if found.unbalanced > BALANCED:
        raise AnalysisError(
            f"{model.name!r} does not rest there: contacts, joints and what holds leave {found.unbalanced:.2g} of what "
            f"acts unbalanced. Ask about=m.equilibrium()"
        )
    notes = _notes(touching(place, found, x, held, bears), base.t)
    joined = joined.changed({name: None for name, most in bears.items() if most == 0.0}).snapshot()
    c = compiled(joined, parameters=own)
    q, v = c.take(base.compiled, base.t, base.q, base.v)
    return joined, dataclasses.replace(o, about=_about(Assembly(c, base.t, q, v)), t=None), notes


def _refuse_parameters(model: Model, inputs: tuple[str, ...], analysis: str) -> None:
    for name in inputs:
        if name in model.parameters:
            raise ModelError(f"{analysis}: input {name!r} is a parameter, which may move contacts; give a force's law")


def _base(model: Model, o: Any, analysis: str) -> Assembly:
    """Where it rests."""
    if o.about is None:
        base = assemble(model, t=o.t or 0.0, parameters=o.parameters)
        if np.abs(base.v).max(initial=0.0) > 0.0:
            raise moves(model, analysis)
        return base
    if not isinstance(o.about, Equilibrium):
        raise ModelError(f"{analysis} with contact is about rest: give about=m.equilibrium(), not a motion")
    old = o.about.assembly
    if [b.name for b in model.bodies] != [b.name for b in old.compiled.structure.model.bodies]:
        raise ModelError(f"about is an equilibrium of {old.compiled.structure.model.name!r}, which has other bodies")
    c = compiled(model, parameters={**o.about.parameters, **(o.parameters or {})})
    return Assembly(c, old.t, *c.take(old.compiled, old.t, old.q, 0.0 * old.v))


def moves(model: Model, analysis: str) -> ModelError:
    """What to say of parts that hold at times, where a mechanism is described in motion."""
    other = "" if model.contacts or model.bulk else ", or about the end of a motion: about=m.simulate(...)"
    parts = ", ".join(e.title for e in holding_parts(model))
    return ModelError(
        f"{analysis} with {parts} is about rest, and {model.name!r} moves: ask about=m.equilibrium(){other}"
    )


def _notes(touches: tuple[Touch, ...], t: float) -> tuple[str, ...]:
    """What holds for one side only.

    Raises
    ------
    SingularityError
        If friction is at its limit: one way it sticks, the other way it slides.
    """
    limit = tuple(k.name for k in touches if k.state == LIMIT)
    if limit:
        raise SingularityError(
            f"{', '.join(limit)}: friction is at its limit, so that it sticks one way and slides the other, and there "
            f"is no linear model",
            t,
            limit,
        )
    parting = [k.name for k in touches if k.state == PARTING]
    return (f"{', '.join(parting)} about to part: what is said holds while it stays closed",) if parting else ()


def _about(at: Assembly) -> Equilibrium:
    """The place, for those who look at nothing else of an equilibrium."""
    none: Any = None
    return Equilibrium(
        t=at.t, stability=UNJUDGED, freedoms=(), stiffness=np.zeros((0, 0)), weakest={}, least=float("nan"),
        unbalanced=0.0, method="", parameters=dict(at.compiled.parameters), result=none, assembly=at, speeds=speed(at),
    )  # fmt: skip


# A mechanism in motion at an instant, with the modes of then: what held is a constraint, what slid goes on sliding.


def frozen_modes(
    model: Model, about: Result, parameters: Mapping[str, float], analysis: str
) -> tuple[Model, Assembly, tuple]:
    """The model with what held where a motion ended as constraints, that state of it, and what has to be said.

    Raises
    ------
    ModelError
        If the motion does not tell what held, or something of another kind did.
    """
    if about.stretches is None or model.contacts or model.bulk:
        raise ModelError(f"{analysis} with contact is about rest: give about=m.equilibrium(), not a motion")
    base = begin(model, about.final[0], parameters, about, "absolute").base
    own, last = about.values.structure, about.stretches.all[-1]
    c = compiled(model, parameters=base.compiled.parameters, switches=True)
    c.at(base.t, *c.take(base.compiled, base.t, base.q, base.v))
    gone: dict[str, None] = {e.name: None for e in holding_parts(model)}
    parts, slides = list[Element](), list[str]()
    for k, x in enumerate(own.switches):
        e, off = model[x.element.name], last.modes.mode[k] == OFF
        if x.switch.kind in (ELASTIC, BRANCH):
            continue
        if off and x.switch.kind == FRICTION:
            gone.pop(e.name, None)
            slides.append(e.title)
        elif not off:
            value = float(c.work.sensed[VALUE, c.structure.switches[k].measured])
            parts.append(constraint(e, x.switch, c.values, value))
    out = model.changed(gone)
    out.add(*parts)
    joined = compiled(out.snapshot(), parameters=base.compiled.parameters)
    q, v = joined.take(base.compiled, base.t, base.q, base.v)
    return joined.structure.model, Assembly(joined, base.t, q, v), _losses(model, gone, parts, slides)


def _losses(model: Model, gone: dict[str, None], parts: list[Element], slides: list[str]) -> tuple[str, ...]:
    held = {p.name for p in parts}
    said = ((", ".join(model[n].title for n in held), "held"), (", ".join(slides), "taken to slide on as it does"),
            (", ".join(model[n].title for n in gone if n not in held), "open, and left out"))  # fmt: skip
    return tuple(f"{names}: {what}" for names, what in said if names)


def speed(at: Assembly) -> dict[str, float]:
    """A word for it that the state moves, if it does."""
    fastest = float(np.abs(at.v).max(initial=0.0))
    return {"motion": fastest} if fastest > 0.0 else {}
