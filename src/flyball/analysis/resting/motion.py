"""A mechanism in motion at an instant, with the modes of then: what held is a constraint, what slid goes on sliding."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...constraints.modes import BRANCH, ELASTIC, FRICTION
from ...errors import ModelError
from ...model.element import Element
from ...model.model import Model
from ...results.result import Result
from ...tables.system import OFF, VALUE
from ..assembly.start import Assembly
from ..compiled import compiled
from ..motion.start import begin
from ..untouched import holding_parts
from .holds import constraint


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
    return joined.structure.model, Assembly(joined, base.t, q, v), _notes(model, gone, parts, slides)


def _notes(model: Model, gone: dict[str, None], parts: list[Element], slides: list[str]) -> tuple[str, ...]:
    held = {p.name for p in parts}
    said = ((", ".join(model[n].title for n in held), "held"), (", ".join(slides), "taken to slide on as it does"),
            (", ".join(model[n].title for n in gone if n not in held), "open, and left out"))  # fmt: skip
    return tuple(f"{names}: {what}" for names, what in said if names)


def speed(at: Assembly) -> dict[str, float]:
    """A word for it that the state moves, if it does."""
    fastest = float(np.abs(at.v).max(initial=0.0))
    return {"motion": fastest} if fastest > 0.0 else {}
