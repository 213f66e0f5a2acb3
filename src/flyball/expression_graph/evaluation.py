"""Evaluation, differentiation and substitution of expressions.

Every node is visited once, in an order of evaluation; values may be numbers of any kind or arrays.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from .graph import ADD, CALL, DIVIDE, MULTIPLY, NUMBER, OPERATIONS, POWER, SYMBOL, Node


def nodes_in_order(nodes: Iterable[Node]) -> list[Node]:
    """All nodes of expressions, including themselves, in an order of evaluation."""
    found: dict[int, Node] = {}
    to_see = [x for x in nodes if isinstance(x, Node)]
    while to_see:
        x = to_see.pop()
        if x.index not in found:
            found[x.index] = x
            to_see.extend(x.args)
    return [found[k] for k in sorted(found)]


def symbols_of(nodes: Iterable[Node]) -> list[Node]:
    """Symbols in expressions, in order of creation."""
    return [x for x in nodes_in_order(nodes) if x.op == SYMBOL]


def expanded_symbol_count(nodes: Iterable[Any]) -> int:
    """Number of symbols in expressions that are written out without names for common subexpressions."""
    nodes = [x for x in nodes if isinstance(x, Node)]
    size: dict[int, int] = {}
    for x in nodes_in_order(nodes):
        size[x.index] = 1 + sum(size[a.index] for a in x.args)
    return sum(size[x.index] for x in nodes)


def evaluate(nodes: Sequence[Any], values: Mapping[str, Any]) -> list[Any]:
    """Values of expressions.

    Parameters
    ----------
    nodes : sequence of Node or number
    values : mapping
        Symbol's name -> number, complex number or array. Missing parameters have their own value.
    """
    known: dict[int, Any] = {}
    for x in nodes_in_order(nodes):
        if x.op == NUMBER:
            known[x.index] = x.value
        elif x.op == SYMBOL:
            if x.data.name not in values and x.moving:
                raise KeyError(f"no value is given for {x.data.name!r}")
            known[x.index] = values.get(x.data.name, x.value)
        else:
            args = [known[a.index] for a in x.args]
            known[x.index] = x.data.python(*args) if x.op == CALL else OPERATIONS[x.op](*args)
    return [known[x.index] if isinstance(x, Node) else x for x in nodes]


def evaluate_array(array: np.ndarray, values: Mapping[str, Any]) -> np.ndarray:
    """Values of an array of expressions; an axis for arrays of values comes first."""
    flat = evaluate(list(array.ravel()), values)
    wide = np.broadcast_arrays(*flat) if flat else []
    shape = wide[0].shape if wide else ()
    return np.stack(wide, axis=-1).reshape(*shape, *array.shape) if wide else np.zeros(array.shape)


DERIVATIVES: dict[str, Callable[..., Any]] = {
    "sqrt": lambda x, f: 0.5 / f,
    "sin": lambda x, f: x.apply("cos", x),
    "cos": lambda x, f: -x.apply("sin", x),
    "tan": lambda x, f: 1.0 + f * f,
    "asin": lambda x, f: 1.0 / x.apply("sqrt", (1.0 - x) * (1.0 + x)),
    "acos": lambda x, f: -1.0 / x.apply("sqrt", (1.0 - x) * (1.0 + x)),
    "atan": lambda x, f: 1.0 / (1.0 + x * x),
    "exp": lambda x, f: f,
    "log": lambda x, f: 1.0 / x,
    "sinh": lambda x, f: x.apply("cosh", x),
    "cosh": lambda x, f: x.apply("sinh", x),
    "tanh": lambda x, f: 1.0 - f * f,
    "absolute": lambda x, f: x.apply("choose", -x, -1.0, 1.0),
    "sign": lambda x, f: 0.0,
    "rounded": lambda x, f: 0.0,
}
"""f'(x) of functions of one argument; at a kink that of the branch that gives the value, as in `scalar`."""


def partial_derivatives(x: Node) -> list[Any]:
    """Partial derivatives of an operation by its arguments."""
    g, a = x.graph, x.args
    if x.op == ADD:
        return [1.0, 1.0]
    if x.op == MULTIPLY:
        return [a[1], a[0]]
    if x.op == DIVIDE:
        return [1.0 / a[1], -x / a[1]]
    if x.op == POWER:
        by_exponent = 0.0 if a[1].op == NUMBER else x * g.function("log", a[0])
        return [a[1] * a[0] ** (a[1] - 1.0), by_exponent]
    if x.op == CALL:
        return [g.call(x.data.derivative(k), *a) for k in range(len(a))]
    if x.op == "atan2":
        square = a[0] * a[0] + a[1] * a[1]
        return [a[1] / square, -a[0] / square]
    if x.op in ("minimum", "maximum"):
        first = a[0] - a[1] if x.op == "minimum" else a[1] - a[0]  # positive: the second argument is the value
        return [g.function("choose", first, 0.0, 1.0), g.function("choose", first, 1.0, 0.0)]
    if x.op == "choose":
        return [0.0, g.function("choose", a[0], 1.0, 0.0), g.function("choose", a[0], 0.0, 1.0)]
    return [DERIVATIVES[x.op](a[0], x)]


def directional_derivatives(nodes: Sequence[Any], seeds: Sequence[tuple[Node, Any]]) -> list[Any]:
    """Derivatives of expressions along a direction: ``seeds`` are nodes (symbols, as a rule) and their rates."""
    rates: dict[int, Any] = {x.index: d for x, d in seeds}
    first = min(rates, default=0)
    for x in nodes_in_order(nodes):
        if x.index in rates or x.index < first or x.op in (NUMBER, SYMBOL):
            continue
        moved = [k for k, a in enumerate(x.args) if a.index in rates]
        if not moved:
            continue
        by = partial_derivatives(x) if x.op != CALL else {k: x.graph.call(x.data.derivative(k), *x.args) for k in moved}
        total: Any = 0.0
        for k in moved:
            total = total + by[k] * rates[x.args[k].index]
        if total != 0.0:
            rates[x.index] = total
    return [rates.get(x.index, 0.0) if isinstance(x, Node) else 0.0 for x in nodes]


def jacobian(nodes: Sequence[Any], by: Sequence[Node]) -> np.ndarray:
    """Derivatives of expressions by symbols, (expressions, symbols), an array of objects."""
    out = np.zeros((len(nodes), len(by)), object)
    out[:] = 0.0
    for k, x in enumerate(by):
        out[:, k] = directional_derivatives(nodes, [(x, 1.0)])
    return out


def substitute(nodes: Sequence[Any], new: Sequence[tuple[Node, Any]]) -> list[Any]:
    """Expressions with other nodes or numbers in place of some of their nodes."""
    graph = next((x.graph for x in nodes if isinstance(x, Node)), None)
    if graph is None:
        return list(nodes)
    known: dict[int, Node] = {x.index: graph.node(y) for x, y in new}
    for x in nodes_in_order(nodes):
        if x.index in known:
            continue
        args = tuple(known[a.index] for a in x.args)
        known[x.index] = x if all(a is b for a, b in zip(args, x.args, strict=True)) else graph.rebuilt(x, args)
    return [known[x.index] if isinstance(x, Node) else x for x in nodes]
