"""What is asked of the start besides the drawing: initial conditions, and what drivers say of it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...model.body import Body, Driver, Frame
from ...model.element import LawOf
from ...model.expressions import Expression, number
from ...model.model import Model
from ..compiled import Compiled


def turns(c: Compiled, known: Mapping[str, float]) -> dict[str, float]:
    """What the states that count turns begin near, where coordinates are told their value."""
    out = {}
    for name in set(known) & set(c.structure.state_at):
        joint, what = c.structure.model.coordinate(name, c.structure.model.bodies[0])
        coordinate = joint.coordinates[what] if hasattr(joint, "coordinates") else None
        sign = coordinate.sign if coordinate else 1.0
        offset = joint.offset(c.values.numbers[joint.name], what) if coordinate else 0.0
        out[name] = sign * (known[name] - offset)
    return out


def wind(c: Compiled, known: Mapping[str, float], q: np.ndarray) -> None:
    """Bodies in the plane that are told their angle begin with its whole turns."""
    s = c.structure
    for name, value in known.items():
        owner, what = s.model.coordinate(name, s.model.bodies[0])
        if what != "angle" or not isinstance(owner, (Body, Frame)):
            continue
        b = s.place[s.model.carrier(owner.name, owner)]
        if b >= 0:
            whole = np.round((value - c.values.poses.turned(owner)) / (2.0 * np.pi))
            q[s.tables["tree"].q[b] + 2] += 2.0 * np.pi * whole


def told(model: Model, env: Mapping[str, float]) -> tuple[dict[str, float], dict[str, float]]:
    """Values and rates that initial conditions ask for."""
    values, rates = {}, {}
    for i in model.initial:
        unit = model.unit(i.name, i)
        if i.value is not None:
            values[i.name] = number(i.value, env, unit, f"value of {i.title}")
        if i.rate is not None:
            rates[i.name] = number(i.rate, env, f"{unit}/s", f"rate of {i.title}")
    return values, rates


def _law(model: Model, d: Driver) -> Expression:
    return model.law(d.law, LawOf(model.unit(d.coordinate, d)), f"law of {d.title}")


def driven(model: Model, t: float, env: Mapping[str, float]) -> dict[str, float]:
    """What drivers' laws ask for at time t, as far as they follow time alone."""
    out = {}
    model = model.snapshot()
    tables = {x.name: x for x in model.tables}
    laws = model.kept.get("laws of drivers", None, 1, lambda: {d.name: _law(model, d) for d in model.drivers})
    for d in model.drivers:
        law = laws[d.name]
        if law.names <= {"t", *env}:
            out[d.coordinate] = law.evaluate({**env, "t": t}, tables=tables)
    return out
