"""Laws of forces and drivers: inputs added to them, and refusal of laws that may jump.

An input is a term added to the law of a force or a driver, or to a parameter. It becomes a parameter of a copy of the
model, with the value zero, so that the derivative with respect to an input is one with respect to a parameter, for any
element.

When a motion meets a jump of a force at an instant that depends on the motion, its derivative changes by a further term
there (the saltation matrix: Aizerman and Gantmakher 1958). Sensitivities do not include this term: such laws are
refused.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from ..errors import ModelError
from .body import Driver
from .controller_signals import controller_states
from .element import LawOf, fields_with
from .expressions import Expression
from .force import CoordinateForce, Force
from .model import Model, listing, suggest

AXES = "xyz"


@dataclass(frozen=True)
class Input:
    """An input: its parameter in the copied model, its unit, and the driver that it moves, if any."""

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
    known = possible_inputs(model)
    for k, name in enumerate(names):
        if name in model.parameters:
            inputs.append(Input(name, name, "SI"))
            continue
        if name not in known:
            there = [*known, *model.parameters]
            raise ModelError(f"{model.name!r} has no input {name!r}{suggest(name, there)}; {listing(there)}")
        e, field, at, of = known[name]
        parameter = f"input_{k}_of_{''.join(c if c.isalnum() else '_' for c in name)}"
        while parameter in out.parameters:  # input of a preload
            parameter += "_"
        out.parameters[parameter] = 0.0
        _replace_law(out, e, field, at, of, parameter)
        inputs.append(Input(name, parameter, _input_unit(model, e, of), e.name if isinstance(e, Driver) else ""))
    return out, inputs


def _input_unit(model: Model, e: Driver | Force, of: LawOf) -> str:
    """Return the unit of the added term; an effort along a coordinate is a force or a torque."""
    if of.dimension:
        return of.dimension
    along = e.along() if isinstance(e, CoordinateForce) else (e.coordinate,) if isinstance(e, Driver) else ()
    return {"m": "N", "rad": "N*m"}.get(model.unit(along[0], e), "SI") if along else "SI"


def possible_inputs(model: Model) -> dict[str, tuple[Any, str, int, LawOf]]:
    """Return the inputs besides the parameters: name -> (element, field of the law, component, measured quantity)."""
    out: dict[str, tuple[Any, str, int, LawOf]] = {}
    for d in (x for x in model.drivers if not x.of_rate):
        out[d.name] = (d, "law", -1, LawOf(model.unit(d.coordinate, d)))
    for e in (x for x in model.forces if x.acts()):
        laws = fields_with(e.__class__, LawOf)
        for field, of in laws.items():
            value = getattr(e, field)
            name = e.name if len(laws) == 1 else f"{e.name}.{field}"
            if isinstance(value, tuple):
                out |= {f"{name}.{AXES[i]}": (e, field, i, of) for i in range(len(value))}
            elif not callable(value):
                out[name] = (e, field, -1, of)
    return out


def _replace_law(model: Model, e: Driver | Force, field: str, at: int, of: LawOf, parameter: str) -> None:
    """Replace the element by a copy with the parameter added to its law."""
    current = model[e.name]
    value = getattr(current, field)
    if at >= 0:
        new: Any = tuple(_law_with_input(model, e, x, of, parameter) if i == at else x for i, x in enumerate(value))
    else:
        new = _law_with_input(model, e, value, of, parameter)
    model.replace(dataclasses.replace(current, **{field: new}))


def _law_with_input(model: Model, e: Driver | Force, law: Any, of: LawOf, parameter: str) -> str:
    """Return the law with the parameter added; both in SI units."""
    known = model.law(law, of, e.title, driver=isinstance(e, Driver))
    return parameter if known is None else f"({known}) + {parameter}"


DECIDING_OPERATORS = ("<", "<=", "sign")
SMOOTH_ALTERNATIVES = (
    "Write a smooth law, for instance step(x, x0, y0, x1, y1) or tanh(x/width), and max(0, x) for a force that "
    "begins at 0"
)


def refuse_jumping_laws(model: Model, to: Sequence[str]) -> None:
    """Refuse laws that branch on the motion, or at a time that depends on one of the given parameters.

    Raises
    ------
    ModelError
        Naming the element and the deciding quantity.
    """
    for title, law in force_and_driver_laws(model):
        if by := _deciding_quantity(law, model, to):
            raise ModelError(
                f"{title}: its law {law.text!r} decides by {by!r}, so it may jump at an instant that the parameters "
                f"shift, and the sensitivity of a motion does not follow jumps. {SMOOTH_ALTERNATIVES}"
            )


def refuse_jumping_rates(model: Model, to: Sequence[str]) -> None:
    """Refuse such laws for the rates of controllers' states; sampled ones act at instants that do not shift."""
    for x in controller_states(model):
        if not x.controller.sampled and (by := _deciding_quantity(x.law, model, to)):
            instead = x.controller.smoother(x.state) or SMOOTH_ALTERNATIVES
            raise ModelError(
                f"{x.controller.title}: the rate of {x.name!r} decides by {by!r}, so it may jump at an instant that "
                f"the parameters shift, and the sensitivity of a motion does not follow jumps. {instead}"
            )


def _deciding_quantity(law: Expression, model: Model, to: Sequence[str]) -> str:
    """Return the quantity that a law branches on at instants that parameters shift; empty if there is none."""
    for node in law.tree.walk():
        if node.kind in DECIDING_OPERATORS:
            names = {n.value for n in node.walk() if n.kind == "name"}
            state = sorted(names - {"t"} - set(model.parameters))
            moved = sorted(names & set(to)) if "t" in names else []
            if state or moved:
                return str((state or moved)[0])
    return ""


def force_and_driver_laws(model: Model) -> Iterator[tuple[str, Expression]]:
    """Return the titles of forces, couplings and drivers with their laws."""
    given: list[tuple[Any, Any, LawOf]] = [(d, d.law, LawOf(model.unit(d.coordinate, d))) for d in model.drivers]
    for e in model.forces:
        for field, of in fields_with(e.__class__, LawOf).items():
            value = getattr(e, field)
            given += [(e, law, of) for law in (value if isinstance(value, tuple) else (value,)) if law is not None]
    for c in model.couplings:
        if (equation := c.equation(model)) is not None:
            yield c.title, equation
    for e, law, of in given:
        if (found := model.law(law, of, e.title)) is not None:
            yield e.title, found
