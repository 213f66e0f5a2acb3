"""A mechanism with controllers whose motion is asked about, as one that has bodies in their place (`sliders`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ...model.expressions import number
from ...model.model import Model
from ...model.wiring import wired
from ..compiled import compiled
from .sliders import Scale, Slid, beginnings, slid

LIGHT = 1e-3  # of the mechanism's mass, that of a body for a state: errors of works are judged by the mass of all


def moving_copy(model: Model, parameters: Mapping[str, float] | None, outputs: Sequence[str]) -> Slid:
    """The copy in which velocities stand for states, which begins as the model does.

    Parameters
    ----------
    model : Model
        With continuous controllers.
    parameters : mapping
        Values in place of the model's.
    outputs : sequence of str
        Curves that are asked for.
    """
    c = compiled(model, parameters=parameters)
    mass = LIGHT * float(c.values.system.bodies.mass.sum()) or 1.0
    scales = {x.name: Scale(push=mass, mass=mass) for x in wired(model)}
    begin, env = beginnings(model), model.environment(parameters)
    other = slid(model, begin, outputs, scales=scales, board=mass)
    now = {name: number(text, env, None, f"what {name!r} begins with") for name, text in begin.items()}
    return replace(other, at=now)
