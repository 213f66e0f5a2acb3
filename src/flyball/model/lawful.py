"""Laws as expressions: which names they may use, and what they must not."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

from ..errors import ExpressionError, ModelError
from . import wiring
from .carried import carried
from .element import LawOf, limited
from .examine import Curve, measured
from .expressions import Expression, folded, law_expression
from .function import function_name
from .sensor import Sensor
from .validity import refuse_twins

if TYPE_CHECKING:
    from .model import Model


def law_of(
    model: Model, value: Any, of: LawOf, where: str, driver: bool = False, whole: bool = True
) -> Expression | None:
    """A law as an expression of t, its inputs, sensors, tables and parameters; refused if it uses other names.

    Formulas of controllers' signals stand in the places of their names, if ``whole``.
    """
    if value is None:
        return None
    if driver and callable(value):
        raise ExpressionError(
            f"{where} is the Python function '{function_name(value)}', whose derivatives a driver cannot know; "
            f"give an expression, or a Table that is called in one"
        )
    tables = {x.name: x for x in model.tables}
    names = model.names_in_laws(of)
    try:
        signals = wiring.names(model)
        expression = law_expression(value, of.dimension, where, tables, names, of.curves or bool(signals))
        if not of.curves and any("." in k and k not in signals for k in expression.names - set(names)):
            wiring.refuse_unknown(model, expression)
            law_expression(value, of.dimension, where, tables, names)  # which refuses curves of other parts
        expression = dataclasses.replace(expression, where=where)
        if expression.tree.kind == "number":
            limited(expression.tree.value, of.dimension, where)
        sensors = {k: x for k in expression.names if isinstance(x := model.find(k), Sensor)}
        if signals:
            wiring.refuse_unknown(model, expression)
        curves = {k for k in expression.names if "." in k and k not in signals} if of.curves else set()
        expression.require({*names, *curves})
        folded(expression.tree, expression.text)
        refuse_twins(expression.names, of.inputs, {*sensors, *(k for k in signals if "." not in k)}, model.parameters)
    except ExpressionError as error:
        text = str(error)
        raise ExpressionError(text if text.startswith(where) else f"{where}: {text}") from None
    for name in sorted(sensors):
        _check_sensed(model, sensors[name], where, driver)
    for name in sorted(curves):
        _check_curve(model, name, where, of)
    if not signals:
        return expression
    if driver:
        wiring.refuse_in_driver(model, expression, where)
    try:
        return wiring.inlined(model, expression, of) if whole else expression
    except ExpressionError as error:
        raise ExpressionError(f"{where}: {error}") from None


def _check_sensed(model: Model, e: Sensor, where: str, driver: bool) -> None:
    """Whether a law may use a sensor."""
    found = model.measured(e)
    if found is None:
        raise ModelError(
            f"{where}: sensor {e.name!r} measures {e.of!r}, which is known only after the accelerations are; laws "
            f"can use positions, angles, lengths and their rates"
        )
    if driver and found[2] > 0:
        raise ModelError(
            f"{where}: sensor {e.name!r} measures {e.of!r}, a rate; a driver follows positions and angles only. "
            f"For a controller use an Actuator or a Motor"
        )


def _check_curve(model: Model, name: str, where: str, of: LawOf) -> None:
    """Whether a curve is one of positions or velocities, or, for an event, what a part carries."""
    if of.forces and carried(model, name):
        return
    if measured(model, Curve(where, name)) is None:
        raise ModelError(
            f"{where}: {name!r} is known only after the accelerations are; use positions, angles, lengths and their "
            f"rates" + (", or what joints, drivers and forces along coordinates carry" if of.forces else "")
        )
