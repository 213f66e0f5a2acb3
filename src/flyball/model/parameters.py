"""Values of named parameters, which may be numbers, quantities, or expressions of each other in any order."""

from __future__ import annotations

import keyword
from collections.abc import Mapping
from typing import Any

from ..errors import ExpressionError
from .expressions import Expression, law_expression, number
from .grammar import CONSTANTS, FUNCTIONS
from .units import split_quantity


def resolve_parameters(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Values of named parameters, which may be numbers, quantities, or expressions of each other in any order.

    Raises
    ------
    ExpressionError
        If parameters depend on each other in a circle, or a name is not allowed or not known.
    UnitError
        If a quantity has no known unit.
    """
    for name in parameters:
        _check_parameter_name(name)
    formulas: dict[str, Expression] = {}
    values: dict[str, Any] = {}
    for name, value in parameters.items():
        if isinstance(value, Expression) or (isinstance(value, str) and split_quantity(value) is None):
            formulas[name] = law_expression(value, None, f"parameter '{name}'")
        else:
            values[name] = number(value, {}, None, f"parameter '{name}'", parameters.keys())
    for name, formula in formulas.items():
        try:
            formula.require(parameters.keys())
        except ExpressionError as error:
            raise ExpressionError(f"parameter '{name}': {error}") from None
    for name in _in_order(formulas):
        values[name] = number(formulas[name], values, None, f"parameter '{name}'")
    return {name: values[name] for name in parameters}


def parameter_formulas(parameters: Mapping[str, Any]) -> dict[str, Expression]:
    """Those of parameters that can be resolved which depend on others, each after those that it uses."""
    formulas = {
        name: law_expression(value, None, f"parameter '{name}'")
        for name, value in parameters.items()
        if isinstance(value, Expression) or (isinstance(value, str) and split_quantity(value) is None)
    }
    return {name: formulas[name] for name in _in_order(formulas)}


def resolve_changed(
    known: Mapping[str, Any], formulas: Mapping[str, Expression], changed: Mapping[str, Any]
) -> dict[str, Any]:
    """`resolve_parameters` with some changed to numbers: only these are found anew, and what depends on them.

    ``known`` are all values as they were, ``formulas`` those of `parameter_formulas`.
    """
    out = dict(known)
    for name, value in changed.items():
        out[name] = number(value, {}, None, f"parameter '{name}'", known.keys())
    reached = set(changed)
    for name, formula in formulas.items():
        if name not in changed and not reached.isdisjoint(formula.names):
            out[name] = number(formula, out, None, f"parameter '{name}'")
            reached.add(name)
    return out


def _in_order(formulas: Mapping[str, Expression]) -> list[str]:
    """Names sorted so that each comes after those it uses."""
    order: dict[str, None] = {}
    for first in formulas:
        path = [first]
        while path:
            missing = sorted(n for n in formulas[path[-1]].names if n in formulas and n not in order)
            if not missing:
                order[path.pop()] = None
            elif missing[0] in path:
                circle = " -> ".join([*path[path.index(missing[0]) :], missing[0]])
                raise ExpressionError(
                    f"parameters depend on each other in a circle: {circle}; give one of them a value"
                )
            else:
                path.append(missing[0])
    return list(order)


def _check_parameter_name(name: Any) -> None:
    if not isinstance(name, str) or not name.isidentifier() or keyword.iskeyword(name):
        reason = "is a word of the expression language" if keyword.iskeyword(name) else "is not a plain name"
        raise ExpressionError(f"parameter {name!r}: {reason}; use letters, digits and _, e.g. 'spring_rate'")
    kind = "a function" if name in FUNCTIONS else "a constant" if name in CONSTANTS else "time"
    if name in FUNCTIONS or name in CONSTANTS or name == "t":
        raise ExpressionError(f"parameter '{name}': the name is taken, it means {kind}; rename it, e.g. '{name}_0'")
