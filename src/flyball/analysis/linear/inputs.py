"""Inputs by name: something added to a force's or a driver's law, or to a parameter.

What is added becomes a parameter of a copy of the model, zero there, so that the derivative by an input is one by a
parameter: nothing needs to be known of the element.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ...errors import ModelError
from ...model.body import Driver
from ...model.element import LawOf, fields_with
from ...model.force import Force
from ...model.model import Model, listing, suggest

AXES = "xyz"


@dataclass(frozen=True)
class Input:
    """An input: the parameter of the copied model that it is, its unit, and the driver that it moves, if any."""

    name: str
    parameter: str
    unit: str
    driver: str = ""


def with_inputs(model: Model, names: Sequence[str]) -> tuple[Model, list[Input]]:
    """A copy of the model in which the inputs are parameters.

    Parameters
    ----------
    model : Model
    names : sequence of str
        Drivers; forces and motors that have a law, ``"push.x"`` where it has components; parameters.

    Raises
    ------
    ModelError
        If there is no such input; the message lists what there is.
    """
    out = model.copy()
    inputs = []
    known = possible(model)
    for k, name in enumerate(names):
        if name in model.parameters:
            inputs.append(Input(name, name, "SI"))
            continue
        if name not in known:
            there = [*known, *model.parameters]
            raise ModelError(f"{model.name!r} has no input {name!r}{suggest(name, there)}; {listing(there)}")
        e, field, at, of = known[name]
        parameter = f"input_{k}_of_{''.join(c if c.isalnum() else '_' for c in name)}"
        while parameter in out.parameters:  # a preload's
            parameter += "_"
        out.parameters[parameter] = 0.0
        _replace(out, e, field, at, of, parameter)
        inputs.append(Input(name, parameter, _unit(model, e, of), e.name if isinstance(e, Driver) else ""))
    return out, inputs


def _unit(model: Model, e: Driver | Force, of: LawOf) -> str:
    """Of what is added; the effort along a coordinate is a force or a torque."""
    if of.dimension:
        return of.dimension
    along = getattr(e, "coordinate", None)
    return "SI" if along is None else {"m": "N", "rad": "N*m"}.get(model.unit(along, e), "SI")


def possible(model: Model) -> dict[str, tuple[Any, str, int, LawOf]]:
    """Inputs of a mechanism besides its parameters: name -> (element, field of the law, which component, what of)."""
    out: dict[str, tuple[Any, str, int, LawOf]] = {}
    for d in model.drivers:
        out[d.name] = (d, "law", -1, LawOf(model.unit(d.coordinate, d)))
    for e in model.forces:
        laws = fields_with(e.__class__, LawOf)
        for field, of in laws.items():
            value = getattr(e, field)
            name = e.name if len(laws) == 1 else f"{e.name}.{field}"
            if isinstance(value, tuple):
                out |= {f"{name}.{AXES[i]}": (e, field, i, of) for i in range(len(value))}
            elif not callable(value):
                out[name] = (e, field, -1, of)
    return out


def _replace(model: Model, e: Driver | Force, field: str, at: int, of: LawOf, parameter: str) -> None:
    """Put a copy of the element, to whose law the parameter is added, in its place."""
    current = model[e.name]
    value = getattr(current, field)
    if at >= 0:
        new: Any = tuple(_plus(model, e, x, of, parameter) if i == at else x for i, x in enumerate(value))
    else:
        new = _plus(model, e, value, of, parameter)
    model.replace(dataclasses.replace(current, **{field: new}))


def _plus(model: Model, e: Driver | Force, law: Any, of: LawOf, parameter: str) -> str:
    """The law with the parameter added; both in SI units."""
    known = model.law(law, of, e.title, driver=isinstance(e, Driver))
    return parameter if known is None else f"({known}) + {parameter}"
