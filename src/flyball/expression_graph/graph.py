"""Expressions as the nodes of a graph: a number type that records how a value is computed, and its derivatives.

A formula evaluated on nodes records its operations in the graph, so that what is printed, differentiated or compiled is
exactly what is computed with numbers. Equal expressions are one node (hash consing), so common subexpressions are found
on creation. Nodes are numbered in order of creation. The arguments of a node have lower numbers, so sorting by number
gives an order of evaluation.

Only simplifications that are cheap and always correct are made on creation: numbers are folded, zeros and ones dropped,
signs and numeric factors moved to the front, equal terms of a sum joined. The others are in `simplification/`. Tables
and Python functions of the user are nodes that call a `Function`, of which the graph knows only the name.

Evaluation, differentiation and substitution visit every node once, in an order of evaluation; values may be numbers of
any kind or arrays.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..math import scalar
from ..math.spline import BREAKS, PIECE, find_piece, spline

NUMBER, SYMBOL, ADD, MULTIPLY, DIVIDE, POWER, CALL = "number", "symbol", "add", "multiply", "divide", "power", "call"

FUNCTIONS: dict[str, Callable[..., Any]] = {
    f.__name__: f
    for f in (
        scalar.sqrt, scalar.sin, scalar.cos, scalar.tan, scalar.asin, scalar.acos, scalar.atan, scalar.exp, scalar.log,
        scalar.sinh, scalar.cosh, scalar.tanh, scalar.atan2, scalar.absolute, scalar.sign, scalar.rounded,
        scalar.minimum, scalar.maximum, scalar.choose,
    )
}  # fmt: skip
"""Function names of nodes, as in `math/scalar.py`."""

ODD = ("sin", "tan", "asin", "atan", "sinh", "tanh", "sign")
EVEN = ("cos", "cosh", "absolute")

PARTIAL = (DIVIDE, POWER, CALL, "sqrt", "tan", "asin", "acos", "exp", "log", "sinh", "cosh")
"""Operations that have no finite value for some finite arguments."""

OPERATIONS: dict[str, Callable[..., Any]] = {
    ADD: lambda a, b: a + b,
    MULTIPLY: lambda a, b: a * b,
    DIVIDE: scalar.divide,
    POWER: scalar.power,
    **FUNCTIONS,
}
"""Implementation of operations for numbers of any kind."""


def decided_branch(x: Any, a: Any, b: Any) -> Any:
    """The branch that the sign of x selects, as nodes; None if undetermined (a NaN in a branch is kept as a value)."""
    if a is b:
        return a
    if x.op == NUMBER:
        return a if x.value > 0.0 else b
    if upper_bound(x) <= 0.0:
        return b
    return None


def upper_bound(x: Any) -> float:
    """Upper bound of a number or sign; infinity if unknown."""
    if x.op == ADD and NUMBER in (x.args[0].op, x.args[1].op):
        first, second = x.args if x.args[0].op == NUMBER else x.args[::-1]
        return float(first.value) + (1.0 if second.op == "sign" else math.inf)
    return 1.0 if x.op == "sign" else math.inf


SPLINE_ORDERS = 4  # value and nonzero derivatives of a cubic


class Function:
    """A function of which the graph knows only the name: a user's Python function, or a table.

    Parameters
    ----------
    name : str
    python : callable
        Computes its value for numbers.
    derivatives : callable, optional
        Maps the index of an argument to the derivative `Function`; raises `OpaqueFunction` if there is none.
    """

    def __init__(
        self,
        name: str,
        python: Callable[..., Any],
        derivatives: Callable[[int], Function] | None = None,
        **details: Any,
    ) -> None:
        self.name, self.python, self._derivatives = name, python, derivatives
        self.details = details  # data for printers

    def __call__(self, *args: Any) -> Any:
        """Value for numbers; element by element for arrays."""
        if any(np.ndim(x) for x in args):
            return np.frompyfunc(self.python, len(args), 1)(*args).astype(float)
        return self.python(*args)

    @property
    def printed_name(self) -> str:
        """Printed name; derivatives of a table have primes."""
        return self.name + "'" * self.details.get("order", 0)

    def derivative(self, k: int) -> Function:
        """Derivative by the k-th argument."""
        if self._derivatives is None:
            raise OpaqueFunction(f"the derivative of {self.name!r} is not known: it is a Python function")
        return self._derivatives(k)


class OpaqueFunction(Exception):
    """An operation is not possible for a function of which only the name is known."""


class FunctionTable:
    """The functions of one graph, without duplicates."""

    def __init__(self) -> None:
        self._found: dict[Any, Any] = {}
        self.names: dict[int, str] = {}  # names of tables, by start index
        self._references: list[Any] = []  # keeps the objects alive whose identities are keys

    def opaque(self, python: Callable[..., Any]) -> Function:
        """Function for a Python function of the user."""
        found = self._found.get(id(python))
        if found is None:
            name = getattr(python, "__name__", type(python).__name__)
            found = self._found[id(python)] = Function(name, python)
            self._references.append(python)
        return found

    def table(self, data: Any, at: int) -> tuple[Sequence[Function], list[Any]]:
        """The spline at ``data[at]``: functions for its value and derivatives, and its entries that are expressions.

        These entries are further arguments of the functions; derivatives by them are not available.
        """
        count = int(data[at + 1].real)
        end = at + BREAKS + count + PIECE * (count + 1)
        numbers = [data[k] for k in range(at, end)]
        moved = [k for k, x in enumerate(numbers) if not isinstance(x, int | float) and not getattr(x, "known", False)]
        plain = [float(x.real) for x in numbers]
        key = (at, np.array(plain).tobytes(), *[numbers[k] for k in moved])
        found = self._found.get(key)
        if found is None:
            found = self._found[key] = spline_derivatives(plain, moved, at, self.names.get(at, f"table{at}"))
        return found, [numbers[k] for k in moved]


def spline_derivatives(data: list[float], moved: list[int], at: int, name: str) -> list[Function]:
    """Value and derivatives of a spline whose numbers ``moved`` are arguments of each call."""

    def of(order: int) -> Callable[..., Any]:
        def value(x: Any, *others: Any) -> Any:
            numbers = np.array(data)
            numbers[moved] = others
            return spline(numbers, 0, x)[order] if order < 3 else third_derivative(numbers, x)

        return value

    made: list[Function] = []

    def next_of(order: int) -> Callable[[int], Function]:
        def derivative(k: int) -> Function:
            if k > 0:
                raise OpaqueFunction("derivatives by the points of a table are not known")
            return made[order + 1] if order + 1 < SPLINE_ORDERS else zero

        return derivative

    zero = Function("zero", lambda *args: 0.0 * args[0], lambda k: zero, constant=0.0)
    for order in range(SPLINE_ORDERS):
        made.append(Function(name, of(order), next_of(order), table=data, moved=moved, order=order, at=at))
        made[order].details["value"] = made[0]
    return made


def third_derivative(data: np.ndarray, x: Any) -> Any:
    """Third derivative of a spline at x: six times the last coefficient of the piece."""
    start, _ = find_piece(data, 0, x)
    return 6.0 * data[np.asarray(start) + PIECE - 1]


class UndeterminedDecision(Exception):
    """A formula branches on a quantity that depends on the state."""


@dataclass(frozen=True)
class Symbol:
    """Description of a symbol."""

    name: str
    kind: str  # "parameter", "coordinate", "velocity", "acceleration", "multiplier", "time", "state", "input", ...
    latex: str = ""
    unit: str = ""
    element: str = ""  # owner


class Node:
    """One expression of a graph. Behaves like a number in every formula; see the module docstring."""

    __slots__ = ("args", "data", "graph", "index", "moving", "op", "partial", "value")

    def __init__(
        self, graph: Graph, op: str, args: tuple[Node, ...], data: Any, index: int, moving: bool, value: float
    ) -> None:
        self.graph, self.op, self.args, self.data, self.index = graph, op, args, data, index
        self.moving = moving  # whether it depends on anything but parameters
        self.value = value  # value with the parameters' own values; NaN if it is moving
        self.partial: bool = op in PARTIAL or any(x.partial for x in args)  # whether it can lack a finite value

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
        """Value with the parameters' own values, for branching.

        Raises
        ------
        UndeterminedDecision
            If it depends on the state.
        """
        if self.moving:
            raise UndeterminedDecision(f"a formula decides by {self!r}, which moves; it has to use scalar.choose")
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
        """Assume a property and record it in `Graph.granted`: "nonzero" of a pivot, "positive"."""
        if not self.moving:
            return self.value > 0.0 if what == "positive" else self.value != 0.0 and self.value == self.value
        self.graph.granted.append((self, what))
        return True

    def conjugate(self) -> Node:
        """Itself."""
        return self

    def item(self) -> Node:
        """Itself, like an array with one entry."""
        return self

    def tabulated(self, data: Any, at: int) -> tuple[Node, Node, Node]:
        """Value and first two derivatives of a spline at this argument: see `math/spline.py`."""
        return self.graph.table(data, at, self)

    def called(self, python: Callable[..., Any], *args: Any) -> Node:
        """Call of a Python function with arguments that include this node."""
        return self.graph.call(self.graph.functions.opaque(python), *args)

    def apply(self, name: str, *args: Any) -> Node:
        """A function of `math/scalar.py` with arguments that include this node: see ``scalar``."""
        return self.graph.function(name, *args)

    def __getattr__(self, name: str) -> Any:
        """NumPy looks up its functions on array elements: ``np.sqrt(array)`` is ``x.sqrt()`` of each."""
        name = NUMPY_NAMES.get(name, name)
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


NUMPY_NAMES = {"arcsin": "asin", "arccos": "acos", "arctan": "atan"}


class Graph:
    """A graph of nodes without duplicates.

    Parameters
    ----------
    rounded : bool
        Whether expressions must round like the formulas that create them: numeric factors are joined only if they are
        powers of two, and y/x x is computed.

    Attributes
    ----------
    strict : bool
        Whether x/x, and x - x of expressions that can lack a finite value, are kept: expressions then have no value
        where the original operations have none.
    """

    def __init__(self, rounded: bool = False) -> None:
        self.rounded, self.strict = rounded, False
        self.nodes: list[Node] = []
        self.functions = FunctionTable()
        self.granted: list[tuple[Node, str]] = []  # properties that formulas assumed
        # indices of expressions of parameters on which formulas have branched
        self.decided: set[int] = set()
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
        x = float(x) + 0.0  # no negative zero
        found = self._found.get(x) if x == x else self._found.get("nan")
        if found is None:
            found = self._new(NUMBER, (), None, False, x)
            self._found[x if x == x else "nan"] = found
        return found

    def symbol(self, symbol: Symbol | str, value: float | None = None) -> Node:
        """A symbol; with a value if it is a parameter."""
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
        """Sum a + b; terms that differ by a numeric factor are joined."""
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
        return self._constructed(ADD, (a, b))

    def subtract(self, a: Any, b: Any) -> Node:
        """Difference a - b."""
        return self.add(a, self.multiply(-1.0, b))

    def multiply(self, a: Any, b: Any) -> Node:
        """Product a b, with a numeric factor in front."""
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
            return self._constructed(MULTIPLY, (self.number(a.value * c), x)) if a.value * c != 1.0 else x
        (c, x), (d, y) = self._scaled(a), self._scaled(b)
        if c != 1.0 or d != 1.0:
            return self.multiply(c * d, self.multiply(x, y))
        if a.op == DIVIDE and a.args[1] is b and not self.rounded:
            return a.args[0]
        if b.op == DIVIDE and b.args[1] is a and not self.rounded:
            return b.args[0]
        if a.index > b.index:
            a, b = b, a
        return self._constructed(MULTIPLY, (a, b))

    def _scaled(self, x: Node) -> tuple[float, Node]:
        """Numeric factor, and the remaining product."""
        if x.op == MULTIPLY and x.args[0].op == NUMBER and (not self.rounded or _is_power_of_two(x.args[0].value)):
            return x.args[0].value, x.args[1]
        return 1.0, x

    def divide(self, a: Any, b: Any) -> Node:
        """Quotient a / b, with a numeric factor in front."""
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
        return self._constructed(DIVIDE, (a, b))

    def power(self, a: Any, b: Any) -> Node:
        """Power a ** b; integer powers by repeated squaring, as in the formulas."""
        a, b = self.node(a), self.node(b)
        if a.op == NUMBER and b.op == NUMBER:
            return self.number(scalar.power(a.value, b.value))
        if b.op == NUMBER and b.value == math.floor(b.value) and abs(b.value) <= 64:
            return self.node(scalar.integer_power(a, int(b.value)))
        if b.op == NUMBER and b.value == 0.5 and not self.rounded:
            return self.function("sqrt", a)
        return self._constructed(POWER, (a, b))

    def function(self, name: str, *args: Any) -> Node:
        """A function of `math/scalar.py`."""
        nodes = tuple(self.node(x) for x in args)
        if all(x.op == NUMBER for x in nodes):
            return self.number(FUNCTIONS[name](*(x.value for x in nodes)))
        if name == "choose" and (one := decided_branch(*nodes)) is not None:
            return one
        if name in ("minimum", "maximum") and nodes[0] is nodes[1]:
            return nodes[0]
        if len(nodes) == 1 and (name in ODD or name in EVEN):
            c, x = self._scaled(nodes[0])
            if c < 0.0:
                inner = self.function(name, self.multiply(-c, x))
                return self.multiply(-1.0, inner) if name in ODD else inner
        return self._constructed(name, nodes)

    def table(self, data: Any, at: int, x: Any) -> tuple[Node, Node, Node]:
        """Value and first two derivatives at x of the spline at ``data[at]``."""
        orders, moved = self.functions.table(data, at)
        return tuple(self.call(f, x, *moved) for f in orders[:3])  # type: ignore[return-value]

    def call(self, function: Function, *args: Any) -> Node:
        """Call of a function of which only the name is known."""
        return self._constructed(CALL, tuple(self.node(x) for x in args), function)

    def rebuilt(self, x: Node, args: tuple[Node, ...]) -> Node:
        """The operation of ``x`` with other arguments, which may belong to another graph."""
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

    def _constructed(self, op: str, args: tuple[Node, ...], data: Any = None) -> Node:
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


def zero_objects(*shape: int) -> np.ndarray:
    """Object array of zeros, to be filled with expressions."""
    out = np.empty(shape, object)
    out[...] = 0.0
    return out


def object_vector(x: Sequence[Any]) -> np.ndarray:
    """A vector of objects."""
    out = np.empty(len(x), object)
    out[:] = x
    return out


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
