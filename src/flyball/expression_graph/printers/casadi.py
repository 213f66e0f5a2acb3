"""Expressions as CasADi functions, whose derivatives are exact: for optimal control and estimation."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ...errors import ModelError, import_optional
from ...math.spline import BREAKS, PIECE
from ..graph import ADD, CALL, DIVIDE, MULTIPLY, NUMBER, SYMBOL, Function, Node, nodes_in_order
from .routines import Routine, refuse_python_functions


def casadi_function(routine: Routine) -> Any:
    """A routine as a ``casadi.Function`` of SX, which takes MX and numbers as well.

    Vectors are columns; results of more than two dimensions have their rows below one another. Of two branches both are
    computed and one is selected.

    Raises
    ------
    ModelError
        If it calls a Python function, or takes too many operations.
    """
    ca = import_optional("casadi", "casadi")
    refuse_python_functions([routine], "CasADi")
    routine.check()
    given = [ca.SX.sym(a.name, 1 if a.single else len(a.nodes)) for a in routine.arguments]
    known: dict[int, Any] = {}
    for a, x in zip(routine.arguments, given, strict=True):
        known |= {s.index: x[k] for k, s in enumerate(a.nodes)}
    functions = casadi_operations(ca)
    for x in nodes_in_order(routine.nodes):
        if x.op != SYMBOL:
            known[x.index] = _operation(ca, functions, x, [known[a.index] for a in x.args])
    results = []
    for array in routine.arrays.values():
        rows = array.reshape(-1, array.shape[-1] if array.ndim > 1 else 1)
        out = ca.SX(*rows.shape)  # entries that are not set are structural zeros
        for (i, k), x in np.ndenumerate(rows):
            x = known[x.index] if isinstance(x, Node) else float(x)
            if not (isinstance(x, float) and x == 0.0):
                out[i, k] = x
        results.append(out)
    return ca.Function(routine.name, given, results, [a.name for a in routine.arguments], list(routine.results))


def casadi_operations(ca: Any) -> dict[str, Callable[..., Any]]:
    """CasADi's functions by the names in `math/scalar.py`."""
    same = ("sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "exp", "log", "sinh", "cosh", "tanh", "atan2", "sign")
    return {name: getattr(ca, name) for name in same} | {
        "absolute": ca.fabs,
        "rounded": lambda x: ca.floor(x + 0.5),
        "minimum": lambda a, b: ca.if_else(a <= b, a, b),
        "maximum": lambda a, b: ca.if_else(a >= b, a, b),
        "choose": lambda x, a, b: ca.if_else(x > 0.0, a, b),
        "power": lambda a, b: a**b,
    }


def _operation(ca: Any, functions: dict[str, Callable[..., Any]], x: Node, args: Sequence[Any]) -> Any:
    if x.op == NUMBER:
        return x.value
    if x.op == ADD:
        return args[0] + args[1]
    if x.op == MULTIPLY:
        return args[0] * args[1]
    if x.op == DIVIDE:
        return args[0] / args[1]
    if x.op == CALL:
        return _table_value(ca, x.data, args)
    return functions[x.op](*args)


def _table_value(ca: Any, f: Function, args: Sequence[Any]) -> Any:
    """Value of a table: the segment is found by bisection."""
    if "constant" in f.details:
        return f.details["constant"]
    data: list[Any] = list(f.details["table"])
    for k, x in zip(f.details["moved"], args[1:], strict=True):
        data[k] = x
    count, order, period = int(f.details["table"][1]), f.details["order"], data[0]
    breaks = data[BREAKS : BREAKS + count]
    u, shift = args[0], 0.0
    if f.details["table"][0] > 0.0:
        shift = period * ca.floor((u - breaks[0]) / period)
        u = u - shift

    def piece(k: int) -> Any:
        c = data[BREAKS + count + PIECE * k :][:PIECE]
        return polynomial(c, u - breaks[max(k - 1, 0)], order)

    def between(first: int, last: int) -> Any:
        if first == last:
            return piece(first)
        middle = (first + last) // 2
        inside = u <= breaks[middle] if middle == count - 1 else u < breaks[middle]
        return ca.if_else(inside, between(first, middle), between(middle + 1, last))

    return between(0, count)


def polynomial(c: Sequence[Any], s: Any, order: int) -> Any:
    """Value or derivative of a cubic."""
    if any(isinstance(x, float) and not math.isfinite(x) for x in c):
        return math.nan
    if order == 0:
        return c[0] + s * (c[1] + s * (c[2] + s * c[3]))
    if order == 1:
        return c[1] + s * (2.0 * c[2] + 3.0 * c[3] * s)
    return 2.0 * c[2] + 6.0 * c[3] * s if order == 2 else 6.0 * c[3]


def casadi_functions(routines: Sequence[Routine]) -> dict[str, Any]:
    """Routines as CasADi functions by name.

    Raises
    ------
    ModelError
        If two have one name, or one cannot be written.
    """
    names = [r.name for r in routines]
    if len(set(names)) < len(names):
        raise ModelError(f"two functions of one name: {', '.join(sorted(names))}")
    return {r.name: casadi_function(r) for r in routines}
