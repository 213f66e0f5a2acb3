"""Small motions with closed contacts: the mechanism in which these are joints, where it rests."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ...errors import AnalysisError, ModelError, SingularityError
from ...model.model import Model
from ...results.equilibrium import UNJUDGED, Equilibrium
from ...results.result import Result
from ...results.touch import LIMIT, PARTING, Touch
from ..assemble import assemble
from ..assembly.start import Assembly
from ..compiled import compiled
from ..linear.rest import Rest
from ..untouched import holding_parts
from .closed import closed
from .copy import joined_copy, open_copy
from .holds import supported
from .motion import frozen_modes, speed
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
