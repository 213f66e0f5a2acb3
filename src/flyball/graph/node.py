"""The number type that remembers how it was made: nodes of one graph in which equal expressions are one node.

A formula run on nodes leaves its operations in the graph, so that what is printed, differentiated or compiled is what
the numbers run on. Each operation looks up what it would make (hash consing): common subexpressions are found by being
made. Nodes are numbered as they are made, so that a node's arguments have lower numbers, and sorting by number is an
order of evaluation.

Simplified on the way is only what is cheap and never wrong: numbers are folded, zeros and ones dropped, signs and
numeric factors brought to the front, equal terms of a sum joined. What makes expressions readable is in `simplify/`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..math import scalar
from .branch import taken
from .function import Function, Functions
from .operations import ADD, CALL, DIVIDE, EVEN, FUNCTIONS, MULTIPLY, NUMBER, ODD, OPERATIONS, PARTIAL, POWER, SYMBOL


class Undecided(Exception):
    """A formula decides by a quantity that is not known before the mechanism moves."""


@dataclass(frozen=True)
class Symbol:
    """What a symbol stands for."""

    name: str
    kind: str  # "parameter", "coordinate", "velocity", "acceleration", "multiplier", "time", "state", "input", ...
    latex: str = ""
    unit: str = ""
    element: str = ""  # whose it is


class Node:
    """One expression of a graph. Behaves like a number in every formula; see the head of this file."""

    __slots__ = ("args", "data", "graph", "index", "moving", "op", "partial", "value")

    def __init__(
        self, graph: Graph, op: str, args: tuple[Node, ...], data: Any, index: int, moving: bool, value: float
    ) -> None:
        self.graph, self.op, self.args, self.data, self.index = graph, op, args, data, index
        self.moving = moving  # whether it depends on more than parameters
        self.value = value  # with the parameters' own values; nan if it moves
        self.partial: bool = op in PARTIAL or any(x.partial for x in args)  # whether it may have no finite value

    def __add__(self, other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else self.graph.add(self, other)

    def __radd__(self, other: Any) -> Any:
        return self.graph.add(other, self)

    def __sub__(self, other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else self.graph.subtract(self, other)

    def __rsub__(self, other: Any) -> Any:
        return self.graph.subtract(other, self)

    def __mul__(self, other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else self.graph.multiply(self, other)

    def __rmul__(self, other: Any) -> Any:
        return self.graph.multiply(other, self)

    def __truediv__(self, other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else self.graph.divide(self, other)

    def __rtruediv__(self, other: Any) -> Any:
        return self.graph.divide(other, self)

    def __pow__(self, other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else self.graph.power(self, other)

    def __rpow__(self, other: Any) -> Any:
        return self.graph.power(other, self)

    def __neg__(self) -> Node:
        return self.graph.multiply(-1.0, self)

    def __pos__(self) -> Node:
        return self

    def __and__(self, other: Any) -> Node:
        return self.graph.multiply(self, other)

    def __or__(self, other: Any) -> Node:
        return self.graph.function("maximum", self, other)

    def __invert__(self) -> Node:
        return self.graph.subtract(1.0, self)

    def __abs__(self) -> Node:
        return self.graph.function("absolute", self)

    def __eq__(self, other: object) -> bool:
        if isinstance(other, Node):
            return self is other
        return self.op == NUMBER and self.value == other

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __hash__(self) -> int:
        return self.index

    def __lt__(self, other: Any) -> bool:
        return self.real < other.real

    def __le__(self, other: Any) -> bool:
        return self.real <= other.real

    def __gt__(self, other: Any) -> bool:
        return self.real > other.real

    def __ge__(self, other: Any) -> bool:
        return self.real >= other.real

    def __float__(self) -> float:
        if self.op != NUMBER:
            raise TypeError(f"{self!r} is no number")
        return self.value

    @property
    def real(self) -> float:
        """Its value with the parameters' own values, to decide by.

        Raises
        ------
        Undecided
            If it depends on where the mechanism is.
        """
        if self.moving:
            raise Undecided(f"a formula decides by {self!r}, which moves; it has to use scalar.choose")
        if self.op != NUMBER:
            self.graph.decided.add(self.index)
        return self.value

    @property
    def imag(self) -> float:
        """Zero."""
        return 0.0

    @property
    def known(self) -> bool:
        """Whether it is a plain number."""
        return self.op == NUMBER

    def granted(self, what: str) -> bool:
        """Taken for granted, and noted in `Graph.granted`: "nonzero" of a pivot, "positive"."""
        if not self.moving:
            return self.value > 0.0 if what == "positive" else self.value != 0.0 and self.value == self.value
        self.graph.granted.append((self, what))
        return True

    def conjugate(self) -> Node:
        """Itself."""
        return self

    def item(self) -> Node:
        """Itself, as of an array of one."""
        return self

    def tabulated(self, data: Any, at: int) -> tuple[Node, Node, Node]:
        """Value and first two derivatives of a spline at this argument: see `math/spline.py`."""
        return self.graph.table(data, at, self)

    def called(self, python: Callable[..., Any], *args: Any) -> Node:
        """A Python function of arguments, of which this is one."""
        return self.graph.call(self.graph.functions.opaque(python), *args)

    def apply(self, name: str, *args: Any) -> Node:
        """A function of `math/scalar.py` of arguments, of which this is one: see ``scalar``."""
        return self.graph.function(name, *args)

    def __getattr__(self, name: str) -> Any:
        """NumPy asks elements of arrays for its functions: ``np.sqrt(array)`` is ``x.sqrt()`` of each."""
        name = NUMPY.get(name, name)
        if name in FUNCTIONS:
            return lambda: self.graph.function(name, self)
        raise AttributeError(name)

    def __format__(self, how: str) -> str:
        return repr(self) if self.moving else format(self.value, how)

    def __repr__(self) -> str:
        if self.op == NUMBER:
            return f"{self.value:g}"
        if self.op == SYMBOL:
            return self.data.name
        return f"<{self.op} {self.index}>"


NUMPY = {"arcsin": "asin", "arccos": "acos", "arctan": "atan"}


class Graph:
    """Nodes of which no two are equal.

    Parameters
    ----------
    rounded : bool
        Whether expressions are to round as the formulas do that make them: numeric factors are joined only where they
        are powers of two, and y/x x is computed.

    Attributes
    ----------
    strict : bool
        Whether x/x, and x - x of what may have no finite value, stay as they are: then expressions have no value where
        the operations that they were made by have none.
    """

    def __init__(self, rounded: bool = False) -> None:
        self.rounded, self.strict = rounded, False
        self.nodes: list[Node] = []
        self.functions = Functions()
        self.granted: list[tuple[Node, str]] = []  # what formulas could not decide
        self.decided: set[int] = set()  # numbers of expressions in parameters that formulas have decided by
        self._found: dict[Any, Node] = {}

    def __len__(self) -> int:
        return len(self.nodes)

    def __iter__(self) -> Iterator[Node]:
        return iter(self.nodes)

    def __repr__(self) -> str:
        return f"<graph of {len(self.nodes)} expressions>"

    def __reduce__(self) -> Any:
        raise TypeError("a graph of expressions is not stored; store what is made of it")

    # -- leaves

    def number(self, x: Any) -> Node:
        """A plain number."""
        x = float(x) + 0.0  # one zero
        found = self._found.get(x) if x == x else self._found.get("nan")
        if found is None:
            found = self._new(NUMBER, (), None, False, x)
            self._found[x if x == x else "nan"] = found
        return found

    def symbol(self, symbol: Symbol | str, value: float | None = None) -> Node:
        """A symbol; with a value if it is known before anything moves: a parameter."""
        if isinstance(symbol, str):
            symbol = Symbol(symbol, "coordinate" if value is None else "parameter")
        key = (SYMBOL, symbol.name)
        found = self._found.get(key)
        if found is None:
            found = self._found[key] = self._new(
                SYMBOL, (), symbol, value is None, math.nan if value is None else float(value)
            )
        elif found.data != symbol:
            raise ValueError(f"{symbol.name!r} is a symbol for something else already")
        return found

    def node(self, x: Any) -> Node:
        """A node of this graph from a node or a number."""
        if isinstance(x, Node):
            if x.graph is not self:
                raise ValueError(f"{x!r} belongs to another graph")
            return x
        return self.number(x)

    # -- operations

    def add(self, a: Any, b: Any) -> Node:
        """A + b; terms that differ by a numeric factor are joined."""
        a, b = self.node(a), self.node(b)
        if a.op == NUMBER and b.op == NUMBER:
            return self.number(a.value + b.value)
        if a.op == NUMBER and a.value == 0.0:
            return b
        if b.op == NUMBER and b.value == 0.0:
            return a
        (c, x), (d, y) = self._scaled(a), self._scaled(b)
        if x is y and a.op != NUMBER and not (self.strict and c + d == 0.0 and x.partial):
            return self.multiply(c + d, x)
        if a.index > b.index:
            a, b = b, a
        return self._made(ADD, (a, b))

    def subtract(self, a: Any, b: Any) -> Node:
        """A - b."""
        return self.add(a, self.multiply(-1.0, b))

    def multiply(self, a: Any, b: Any) -> Node:
        """A b, with a numeric factor in front."""
        a, b = self.node(a), self.node(b)
        if a.op == NUMBER and b.op == NUMBER:
            return self.number(a.value * b.value)
        if b.op == NUMBER:
            a, b = b, a
        if a.op == NUMBER:
            if a.value == 0.0:
                return self.number(0.0)
            if a.value == 1.0:
                return b
            c, x = self._scaled(b)
            return self._made(MULTIPLY, (self.number(a.value * c), x)) if a.value * c != 1.0 else x
        (c, x), (d, y) = self._scaled(a), self._scaled(b)
        if c != 1.0 or d != 1.0:
            return self.multiply(c * d, self.multiply(x, y))
        if a.op == DIVIDE and a.args[1] is b and not self.rounded:
            return a.args[0]
        if b.op == DIVIDE and b.args[1] is a and not self.rounded:
            return b.args[0]
        if a.index > b.index:
            a, b = b, a
        return self._made(MULTIPLY, (a, b))

    def _scaled(self, x: Node) -> tuple[float, Node]:
        """Numeric factor and the rest."""
        if x.op == MULTIPLY and x.args[0].op == NUMBER and (not self.rounded or _is_power_of_two(x.args[0].value)):
            return x.args[0].value, x.args[1]
        return 1.0, x

    def divide(self, a: Any, b: Any) -> Node:
        """A / b, with a numeric factor in front."""
        a, b = self.node(a), self.node(b)
        if b.op == NUMBER:
            if a.op == NUMBER:
                return self.number(scalar.divide(a.value, b.value))
            if not self.rounded or _is_power_of_two(b.value):
                return self.multiply(scalar.divide(1.0, b.value), a)
        if a.op == NUMBER and a.value == 0.0:
            return a
        (c, x), (d, y) = self._scaled(a), self._scaled(b)
        if x is y and a.op != NUMBER and not self.strict:
            return self.number(c / d)
        if a.op == NUMBER:
            c, x = 1.0, a
        if c != 1.0 or d != 1.0:
            return self.multiply(c / d, self.divide(x, y))
        return self._made(DIVIDE, (a, b))

    def power(self, a: Any, b: Any) -> Node:
        """A ** b; whole powers by repeated squaring, as in the formulas."""
        a, b = self.node(a), self.node(b)
        if a.op == NUMBER and b.op == NUMBER:
            return self.number(scalar.power(a.value, b.value))
        if b.op == NUMBER and b.value == math.floor(b.value) and abs(b.value) <= 64:
            return self.node(scalar.integer_power(a, int(b.value)))
        if b.op == NUMBER and b.value == 0.5 and not self.rounded:
            return self.function("sqrt", a)
        return self._made(POWER, (a, b))

    def function(self, name: str, *args: Any) -> Node:
        """A function of `math/scalar.py`."""
        nodes = tuple(self.node(x) for x in args)
        if all(x.op == NUMBER for x in nodes):
            return self.number(FUNCTIONS[name](*(x.value for x in nodes)))
        if name == "choose" and (one := taken(*nodes)) is not None:
            return one
        if name in ("minimum", "maximum") and nodes[0] is nodes[1]:
            return nodes[0]
        if len(nodes) == 1 and (name in ODD or name in EVEN):
            c, x = self._scaled(nodes[0])
            if c < 0.0:
                inner = self.function(name, self.multiply(-c, x))
                return self.multiply(-1.0, inner) if name in ODD else inner
        return self._made(name, nodes)

    def table(self, data: Any, at: int, x: Any) -> tuple[Node, Node, Node]:
        """Value and first two derivatives at x of the spline at ``data[at]``."""
        orders, moved = self.functions.table(data, at)
        return tuple(self.call(f, x, *moved) for f in orders[:3])  # type: ignore[return-value]

    def call(self, function: Function, *args: Any) -> Node:
        """A function that is known by name only."""
        return self._made(CALL, tuple(self.node(x) for x in args), function)

    def rebuilt(self, x: Node, args: tuple[Node, ...]) -> Node:
        """The operation of ``x`` on other arguments, which may be of another graph than ``x``."""
        if x.op == NUMBER:
            return self.number(x.value)
        if x.op == SYMBOL:
            return self.symbol(x.data, None if x.moving else x.value)
        if x.op == CALL:
            return self.call(x.data, *args)
        if x.op in FUNCTIONS:
            return self.function(x.op, *args)
        return getattr(self, x.op)(*args)  # type: ignore[no-any-return]

    # -- the table

    def _made(self, op: str, args: tuple[Node, ...], data: Any = None) -> Node:
        key = (op, *[x.index for x in args]) if data is None else (op, id(data), *[x.index for x in args])
        found = self._found.get(key)
        if found is None:
            moving = any(x.moving for x in args)
            value = math.nan if moving else _value(op, args, data)
            found = self._found[key] = self._new(op, args, data, moving, value)
        return found

    def _new(self, op: str, args: tuple[Node, ...], data: Any, moving: bool, value: float) -> Node:
        made = Node(self, op, args, data, len(self.nodes), moving, value)
        self.nodes.append(made)
        return made


def _value(op: str, args: tuple[Node, ...], data: Any) -> float:
    values = [x.value for x in args]
    return float(data.python(*values) if op == CALL else OPERATIONS[op](*values))


def _is_power_of_two(x: float) -> bool:
    """Whether products with x are exact."""
    return abs(math.frexp(x)[0]) == 0.5
