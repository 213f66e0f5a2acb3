"""Expressions of a mechanism (scalar, vector or matrix): display, derivatives and values.

`SymbolTable` gives an expression its symbols by name.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import ModelError
from ..expression_graph.graph import (
    SYMBOL,
    Graph,
    Node,
    OpaqueFunction,
    evaluate,
    evaluate_array,
    jacobian,
    nodes_in_order,
    substitute,
)
from ..expression_graph.printers import latex, text
from ..expression_graph.printers.sympy import SympyPrinter
from ..expression_graph.simplification.factors import symbol_count
from ..expression_graph.simplification.simplify import (
    ArctangentSubstitution,
    simplified,
    simplified_with_symbols,
    without_absolute_values,
)
from ..model.messages import listing, suggest

MAX_LETTERS = 6000  # that are printed
LINE_WIDTH = 100  # characters per line
MAX_OPERATIONS = 4000  # from so many operations on nothing is simplified
TOO_LONG = "too long to read: {} operations; .at(values) evaluates it, and export() of the equations writes code"


def node_count(nodes: Sequence[Any]) -> int:
    """Number of operations, each counted once."""
    return sum(bool(x.args) for x in nodes_in_order(nodes))


def formula_lines(rows: Sequence[tuple[str, Any]], units: Sequence[Sequence[Node]] = ()) -> list[str]:
    """Lines ``name = formula``, with definitions under ``where``; none if they are too long to be read."""
    if node_count([x for _, x in rows]) > MAX_OPERATIONS:
        return []
    rest, definitions = simplified_with_symbols([x for _, x in rows], units)
    if symbol_count([*rest, *(y for _, y in definitions)]) > MAX_LETTERS / 2:
        return []
    lines = [f"{name} = {text.text(x)}" if name else text.text(x) for (name, _), x in zip(rows, rest, strict=True)]
    lines += ["where", *(f"{text.text(w)} = {text.text(y)}" for w, y in definitions)] if definitions else []
    found = [line for whole in lines for line in _broken(whole)]
    return found if sum(map(len, found)) <= MAX_LETTERS else []


def _broken(line: str) -> list[str]:
    first, *others = text.broken_lines(line, LINE_WIDTH)
    return [first, *(f"    {x}" for x in others)]


class SymbolTable:
    """Symbols by name, with printing and evaluation of expressions in them."""

    graph: Graph

    @property
    def title(self) -> str:
        """Owner of the expressions, for messages."""
        raise NotImplementedError

    @property
    def named(self) -> dict[str, Node]:
        """Every symbol by its name."""
        raise NotImplementedError

    @property
    def units(self) -> Sequence[Sequence[Node]]:
        """Symbols of each quaternion: their squares add up to one."""
        return ()

    @cached_property
    def printer(self) -> SympyPrinter:
        """Printer of SymPy expressions; it maps SymPy symbols back to nodes."""
        return SympyPrinter()

    def symbol(self, x: Any) -> Node:
        """The node of a symbol, by its name, or as an expression that is one.

        Raises
        ------
        ModelError
            If the name is unknown.
        """
        x = getattr(x, "nodes", x)
        x = x[()] if getattr(x, "shape", None) == () else x
        if isinstance(x, Node) and x.op == SYMBOL:
            return x
        named = self.named
        if not isinstance(x, str) or x not in named:
            raise ModelError(f"{self.title} has no symbol {x!r}{suggest(str(x), named)}; {listing(list(named))}")
        return named[x]

    def checked(self, values: Mapping[str, Any], requested: Mapping[str, Node]) -> dict[str, Any]:
        """Check values of symbols; wrong or missing ones are refused by name."""
        named = self.named
        for name in values:
            if name not in named:
                raise ModelError(f"{self.title} has no symbol {name!r}{suggest(str(name), named)}")
        lacking = [k for k, x in requested.items() if x.moving and k not in values]
        if lacking:
            raise ModelError(f"no value is given for {', '.join(lacking)}")
        return dict(values)


MAX_READ = 400  # operations up to which expressions are simplified to be shown
MAX_WIDTH = 160  # characters of a line up to which a matrix is printed as a matrix


class Expressions:
    """One expression, a vector or a matrix of a mechanism's equations.

    Sums, products (``*`` by element, ``@`` of matrices) and indices give further ones, with the same symbol names as
    in `Equations`.

    Attributes
    ----------
    nodes : ndarray of object
        The nodes of the expression graph, or numbers; of shape () for one expression.
    rows, columns : tuple of str
        Names of rows and columns, where known.
    unit : str
    """

    __array_ufunc__ = None

    def __init__(
        self,
        symbol_table: SymbolTable,
        nodes: Any,
        rows: Sequence[str] = (),
        columns: Sequence[str] = (),
        unit: str = "",
    ) -> None:
        self.symbol_table = symbol_table
        if isinstance(nodes, np.ndarray):
            self.nodes = nodes
        else:
            self.nodes = np.empty((), object)
            self.nodes[()] = nodes
        self.rows, self.columns, self.unit = tuple(rows), tuple(columns), unit

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape; () for one expression."""
        return self.nodes.shape

    @property
    def symbols(self) -> dict[str, Node]:
        """Symbols in the expressions, by name, in order of creation."""
        return {x.data.name: x for x in nodes_in_order(self.list()) if x.op == SYMBOL}

    @property
    def operations(self) -> int:
        """Number of operations to evaluate it, each counted once."""
        return node_count(self.list())

    def list(self) -> list[Any]:
        """All entries, row by row."""
        return self.nodes.ravel().tolist()  # type: ignore[no-any-return]

    # -- numbers

    def at(self, values: Mapping[str, Any]) -> np.ndarray:
        """Numbers at values of the symbols.

        Parameters
        ----------
        values : mapping
            Symbol's name -> number, complex number or array. By default parameters have their own value, inputs are 0,
            and curve parameters of followers are computed.

        Returns
        -------
        ndarray
            The same shape; if arrays are given, the time axis comes first.

        Raises
        ------
        ModelError
            If a name is unknown, or the value of a symbol is missing.
        """
        known = self.symbol_table.checked(values, self.symbols)
        if not self.shape:
            return np.asarray(evaluate(self.list(), known)[0])
        return evaluate_array(self.nodes, known) if self.nodes.size else np.zeros(self.shape)

    def __float__(self) -> float:
        if self.shape:
            raise TypeError(f"{self!r} is no single number")
        return float(self.at({}))

    # -- other forms

    def sympy(self) -> Any:
        """As SymPy expression, or ``Matrix``, simplified if it is not too long; symbols have the mechanism's names.

        Raises
        ------
        ImportError
            If SymPy is not installed (extra ``symbolic``).
        """
        printer = self.symbol_table.printer
        shown = self._read.nodes
        return printer(shown if self.shape else shown[()])

    def simplified(self) -> Expressions:
        """An equal expression in a form that is shorter to read, as far as quickly found."""
        made = simplified(self.nodes.reshape(-1), units=self.symbol_table.units)
        return Expressions(self.symbol_table, made.reshape(self.shape), self.rows, self.columns, self.unit)

    @cached_property
    def _read(self) -> Expressions:
        """Expressions as displayed: simplified if short enough to be read, sines of arctangents as algebra."""
        if self.operations > MAX_OPERATIONS or not self.nodes.size:
            return self
        plain = self.simplified() if self.operations <= MAX_READ else self
        flat = self.list()
        if not any(x.op == "atan2" for x in nodes_in_order(flat)):
            return plain
        made = ArctangentSubstitution()(flat)
        if node_count(made) > MAX_READ:
            return plain
        out = np.empty(self.shape, object)
        out.ravel()[:] = without_absolute_values(simplified(made, units=self.symbol_table.units))
        way = Expressions(self.symbol_table, out, self.rows, self.columns, self.unit)
        return min(way, plain, key=lambda x: symbol_count(x.list()))

    @property
    def readable(self) -> Sequence[Any]:
        """Entries as displayed."""
        return self._read.list()

    def texts(self) -> Any:
        """As text, simplified if short enough; nested lists with one level per dimension."""
        return np.vectorize(text.text, otypes=[object])(self._read.nodes).tolist() if self.nodes.size else []

    def latex(self) -> str:
        """As LaTeX, simplified if it is not too long for that; a vector is a column."""
        shown = self._read.nodes
        if not self.shape:
            return latex.latex(shown[()])
        if not shown.size:
            return r"\left[\;\right]"
        return latex.matrix(shown if len(self.shape) > 1 else shown[:, None])

    def _repr_latex_(self) -> str | None:
        return f"$\\displaystyle {self.latex()}$" if self.operations <= MAX_READ else None

    def __str__(self) -> str:
        if self.operations > MAX_OPERATIONS:
            return self._refused
        if not self.nodes.size:
            return "none" if len(self.shape) == 1 else f"no entries: {self.shape[0]} x {self.shape[1]}"
        shown = self._read
        if symbol_count(shown.list()) > LINE_WIDTH:
            return self._entry_lines
        if len(self.shape) < 2:
            names = (self.rows or tuple(map(str, range(self.shape[0])))) if self.shape else ("",)
            wide = max(map(len, names)) + 2 if self.shape else 0
            texts = [text.text(x) for x in shown.list()]
            if texts == list(names):  # symbols are their own names
                return "\n".join(names)
            made = "\n".join(f"{n:{wide}}{x}" for n, x in zip(names, texts, strict=True))
        else:
            made = text.matrix(shown.nodes)
        return made if max(map(len, made.split("\n"))) <= MAX_WIDTH else self._entry_lines

    @property
    def _refused(self) -> str:
        return f"{self!r}: {TOO_LONG.format(self.operations)}"

    @cached_property
    def _entry_lines(self) -> str:
        """Entry by entry, with names for common subexpressions."""
        labels = [", ".join(x) for x in itertools.product(*self._names())]
        rows = [(a, x) for a, x in zip(labels, self.readable, strict=True) if x != 0.0]
        return "\n".join(formula_lines(rows, self.symbol_table.units)) or self._refused

    def _names(self) -> Sequence[tuple[str, ...]]:
        """Names of rows and columns, or numbers."""
        found = (self.rows, self.columns)
        return [(found[k] if k < 2 else ()) or tuple(map(str, range(n))) for k, n in enumerate(self.shape)]

    def __repr__(self) -> str:
        what = " x ".join(map(str, self.shape)) if self.shape else "one expression"
        return f"<{what}, {self.operations} operations, of {', '.join(self.symbols) or 'no symbol'}>"

    # -- calculus

    def diff(self, by: str | Expressions) -> Expressions:
        """Derivative by one symbol.

        Raises
        ------
        ModelError
            If there is no such symbol, or a Python function has no known derivative.
        """
        return self._new(self._derived([by])[..., 0], self.rows, self.columns)

    def jacobian(self, by: Iterable[str] | Expressions) -> Expressions:
        """Derivatives of a vector (or of one expression) by several symbols, (entries, symbols)."""
        if len(self.shape) > 1:
            raise ModelError("the Jacobian of a matrix is no matrix; take that of one of its columns, or diff")
        names = list(by) if not isinstance(by, Expressions) else by.list()
        made = self._derived(names)
        columns = [n if isinstance(n, str) else n.data.name for n in names]
        return self._new(made, self.rows, columns)

    def _derived(self, by: Sequence[Any]) -> np.ndarray:
        symbols = [self.symbol_table.symbol(x) for x in by]
        try:
            return jacobian(self.list(), symbols).reshape(*self.shape, len(symbols))
        except OpaqueFunction as error:
            raise ModelError(f"{error}; give the law as a text, or its values as a table") from None

    def replaced(self, values: Mapping[str, Any]) -> Expressions:
        """Replace symbols by numbers or other expressions."""
        home = self.symbol_table
        new = [(home.symbol(name), _node(x)) for name, x in values.items()]
        out = np.empty(self.shape, object)
        out.ravel()[:] = substitute(self.list(), new)
        return self._new(out, self.rows, self.columns)

    # -- arithmetic

    def __add__(self, other: Any) -> Expressions:
        return self._new(self.nodes + _node(other), self.rows, self.columns)

    def __radd__(self, other: Any) -> Expressions:
        return self._new(_node(other) + self.nodes, self.rows, self.columns)

    def __sub__(self, other: Any) -> Expressions:
        return self._new(self.nodes - _node(other), self.rows, self.columns)

    def __rsub__(self, other: Any) -> Expressions:
        return self._new(_node(other) - self.nodes, self.rows, self.columns)

    def __mul__(self, other: Any) -> Expressions:
        return self._new(self.nodes * _node(other), self.rows, self.columns)

    def __rmul__(self, other: Any) -> Expressions:
        return self._new(_node(other) * self.nodes, self.rows, self.columns)

    def __truediv__(self, other: Any) -> Expressions:
        return self._new(self.nodes / _node(other), self.rows, self.columns)

    def __rtruediv__(self, other: Any) -> Expressions:
        return self._new(_node(other) / self.nodes, self.rows, self.columns)

    def __pow__(self, other: Any) -> Expressions:
        return self._new(self.nodes ** _node(other), self.rows, self.columns)

    def __neg__(self) -> Expressions:
        return self._new(-self.nodes, self.rows, self.columns)

    def __matmul__(self, other: Expressions) -> Expressions:
        a, b = self.nodes, np.asarray(_node(other))
        made = a @ b if a.shape[-1] else np.zeros((*a.shape[:-1], *b.shape[1:]), object)
        return self._new(made, self.rows, other.columns if isinstance(other, Expressions) else ())

    @property
    def T(self) -> Expressions:
        """Transposed."""
        return self._new(self.nodes.T, self.columns or (), self.rows) if len(self.shape) > 1 else self

    def __getitem__(self, k: Any) -> Expressions:
        """An entry, a row, a slice; rows and columns by name too."""
        key = k if isinstance(k, tuple) else (k,)
        names = (self.rows, self.columns)
        at = tuple(names[n].index(x) if isinstance(x, str) and x in names[n] else x for n, x in enumerate(key))
        wrong = [x for x in at if isinstance(x, str)]
        if wrong:
            raise ModelError(f"there is no entry {wrong[0]!r}; there are {', '.join(self.rows + self.columns)}")
        made = self.nodes[at]
        return self._new(made, *_remaining_labels(self, at))

    def __len__(self) -> int:
        return len(self.nodes)

    def __iter__(self) -> Iterator[Expressions]:
        return (self[k] for k in range(len(self)))

    def _new(self, nodes: Any, rows: Sequence[str] = (), columns: Sequence[str] = ()) -> Expressions:
        return Expressions(self.symbol_table, nodes, rows, columns)


def _node(x: Any) -> Any:
    return (x.nodes if x.shape else x.nodes[()]) if isinstance(x, Expressions) else x


def _remaining_labels(x: Expressions, at: tuple[Any, ...]) -> list[tuple[str, ...]]:
    """Names of the remaining rows and columns."""
    out = []
    for n, names in enumerate((x.rows, x.columns)):
        if n >= len(at):
            out.append(names)
        elif isinstance(at[n], slice):
            out.append(names[at[n]])
    return out
