"""Shared parts of the code printers: functions to print, valid identifiers, tables, and expressions as statements.

A subexpression that is used once is written in place, up to a width; one that is used more often becomes a statement.
Operations keep the order and association of the graph, so that every language computes the same bits, apart from its
elementary functions.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ...errors import ModelError
from ..graph import ADD, CALL, DIVIDE, MULTIPLY, NUMBER, SYMBOL, Function, Node, nodes_in_order


class Identifiers:
    """Assigns unique identifiers, as close to the requested names as the language allows.

    Parameters
    ----------
    reserved : iterable of str
        Identifiers of the language and of the generated code.
    """

    def __init__(self, reserved: Iterable[str] = ()) -> None:
        self._used = set(reserved)

    def __call__(self, requested: str) -> str:
        """A unique identifier."""
        name = re.sub(r"\W+", "_", requested, flags=re.ASCII).strip("_") or "x"
        if name[0].isdigit():
            name = "x" + name
        given, n = name, 2
        while given in self._used:
            given, n = f"{name}_{n}", n + 1
        self._used.add(given)
        return given


# Largest number of operations: compilers need minutes and gigabytes for more.
MAX_OPERATIONS = 200_000


@dataclass(frozen=True)
class Argument:
    """An argument of a function: a number or an array of numbers.

    Parameters
    ----------
    name : str
    symbols : Node or sequence of Node
        One symbol for a number, several for an array.
    meaning : str
    values : tuple of float
        Default values; empty if the argument is required.
    """

    name: str
    symbols: Any
    meaning: str = ""
    values: tuple[float, ...] | None = None

    @property
    def single(self) -> bool:
        """Whether it is a number, not an array."""
        return isinstance(self.symbols, Node)

    @property
    def nodes(self) -> list[Node]:
        """Its symbols."""
        return [self.symbols] if self.single else list(self.symbols)

    def described(self) -> list[str]:
        """Name and unit of each of its numbers."""
        return [f"{x.data.name} [{x.data.unit}]" if x.data.unit else x.data.name for x in self.nodes]


@dataclass(frozen=True)
class Routine:
    """A function to print.

    Parameters
    ----------
    name : str
    arguments : sequence of Argument
    results : mapping of str to Node, number or array of these
        Scalars, vectors and matrices by name.
    meaning : str
    meanings : mapping of str to str
        Meaning of each result, with shape and unit.
    """

    name: str
    arguments: Sequence[Argument]
    results: dict[str, Any]
    meaning: str = ""
    meanings: dict[str, str] = field(default_factory=dict)

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """Results as arrays of objects."""
        found = {}
        for name, x in self.results.items():
            found[name] = np.empty(np.shape(x), object)
            found[name][...] = x
        return found

    @property
    def nodes(self) -> list[Any]:
        """All numbers of all results, row by row."""
        return [x for a in self.arrays.values() for x in a.ravel()]

    @property
    def operations(self) -> int:
        """Number of operations; symbols, numbers and changes of sign do not count."""
        return operation_count(self.nodes)

    def used(self) -> list[Function]:
        """Called functions of which only the name is known."""
        return list({id(x.data): x.data for x in nodes_in_order(self.nodes) if x.op == CALL}.values())

    def check(self) -> None:
        """Refuse a routine that cannot be printed.

        Raises
        ------
        ModelError
            If a symbol is not an argument, or there are too many operations.
        """
        given = {x.index for a in self.arguments for x in a.nodes}
        foreign = [x.data.name for x in nodes_in_order(self.nodes) if x.op == SYMBOL and x.index not in given]
        if foreign:
            raise ModelError(f"{self.name} depends on {', '.join(foreign[:5])}, which is no argument of it")
        refuse_too_long(self.name, self.operations)


def refuse_too_long(name: str, operations: int) -> None:
    """Refuse code that is too long.

    Raises
    ------
    ModelError
        With the number of operations.
    """
    if operations > MAX_OPERATIONS:
        raise ModelError(
            f"{name} takes {operations} operations, and straight-line code is written up to {MAX_OPERATIONS}: try the "
            "other coordinates (absolute ones make long chains short), export functions that need less (M, f, G and "
            "gamma rather than right_hand_side), or simulate it here, where loops over its elements are compiled"
        )


def operation_count(nodes: Iterable[Any]) -> int:
    """Number of operations in expressions; common ones count once, changes of sign do not count."""
    return sum(x.op not in (NUMBER, SYMBOL) and not is_negated(x) for x in nodes_in_order(nodes))


def is_negated(x: Node) -> bool:
    """Whether it is -1 times something."""
    return x.op == MULTIPLY and x.args[0].op == NUMBER and x.args[0].value == -1.0


@dataclass(frozen=True)
class PrintedTable:
    """A spline for printing; `math/spline.py` describes its numbers."""

    name: str
    data: tuple[float, ...]
    moved: tuple[int, ...]  # indices of numbers that are arguments of each call


def spline_tables(routines: Iterable[Routine], names: Identifiers) -> dict[int, PrintedTable]:
    """Tables that routines call, by the identity of the function for their value."""
    found: dict[int, PrintedTable] = {}
    for f in called_functions(routines):
        if "table" in f.details and id(f.details["value"]) not in found:
            name = names(f"table_{len(found) + 1}")
            found[id(f.details["value"])] = PrintedTable(name, tuple(f.details["table"]), tuple(f.details["moved"]))
    return found


def python_functions_of(routines: Iterable[Routine], names: Identifiers) -> dict[int, tuple[str, Function]]:
    """Python functions that routines call: identity -> (unique name, function)."""
    found = {}
    for f in called_functions(routines):
        if "table" not in f.details and "constant" not in f.details:
            found[id(f)] = names(f.name), f
    return found


def called_functions(routines: Iterable[Routine]) -> list[Function]:
    """Called functions of which only the name is known, in the order of their first call."""
    return list({id(f): f for r in routines for f in r.used()}.values())


def refuse_python_functions(routines: Sequence[Routine], language: str) -> None:
    """Refuse Python functions.

    Raises
    ------
    ModelError
        With the name of the function and of its caller.
    """
    for r in routines:
        for f in r.used():
            if "table" not in f.details and "constant" not in f.details:
                of = f.details.get("of")
                raise ModelError(
                    f"{of + ': ' if of else ''}{f.name!r} is a Python function, and {r.name} calls it: {language} "
                    "supports expressions and tables only. Write the law as an expression, give a table of points in "
                    "its place, or export to Python, where functions are passed as arguments"
                )


SUM, PRODUCT, ATOM = range(3)
WIDTH = 60  # largest width of a subexpression written in place
LINE = 116  # characters per line


@dataclass(frozen=True)
class Language:
    """Text generators of a language.

    Parameters
    ----------
    number : callable
        Writes a number that reads back exactly.
    functions : mapping
        Function of `math/scalar.py`, or "power" -> its text, with {0}, {1}, {2} for arguments.
    call : callable
        Writes the call of a function of which only the name is known.
    """

    number: Callable[[float], str]
    functions: Mapping[str, str]
    call: Callable[[Function, Sequence[str]], str]


class CodeFragment(NamedTuple):
    """Text of an expression, its binding strength, and whether the text lacks a minus sign."""

    text: str
    level: int = ATOM
    negative: bool = False

    @property
    def whole(self) -> str:
        """Text with its sign."""
        return "-" + self.bare(PRODUCT) if self.negative else self.text

    def bare(self, level: int) -> str:
        """Text without its sign, as an operand of an operation with the binding strength ``level``."""
        return self.text if self.level >= level else f"({self.text})"


def fragment_of_number(language: Language, x: float) -> CodeFragment:
    """A number."""
    return CodeFragment(language.number(abs(x)), ATOM, x < 0.0)


def statements(
    language: Language, nodes: Sequence[Any], symbols: Mapping[int, str], temporary: Callable[[], str]
) -> tuple[list[tuple[str, str]], list[str]]:
    """Temporary variables with their texts, in order; and a text for each of ``nodes``.

    Parameters
    ----------
    language : Language
    nodes : sequence of Node or number
    symbols : mapping
        Symbol index -> text.
    temporary : callable
        Returns a new name of a temporary variable.
    """
    order = nodes_in_order(nodes)
    uses = Counter(without_sign(a).index for x in order if not is_negated(x) for a in x.args)
    uses.update(without_sign(x).index for x in nodes if isinstance(x, Node))
    pieces: dict[int, CodeFragment] = {}
    found = []
    for x in order:
        if x.op == SYMBOL:
            pieces[x.index] = CodeFragment(symbols[x.index])
            continue
        piece = operation_text(language, x, [pieces[a.index] for a in x.args])
        if x.op != NUMBER and not is_negated(x) and (uses[x.index] > 1 or len(piece.text) > WIDTH):
            name = temporary()
            found.append((name, piece.whole))
            piece = CodeFragment(name)
        pieces[x.index] = piece
    return found, [
        pieces[x.index].whole if isinstance(x, Node) else fragment_of_number(language, x).whole for x in nodes
    ]


def without_sign(x: Node) -> Node:
    """Operand of a change of sign; other nodes are returned unchanged."""
    return x.args[1] if is_negated(x) else x


def operation_text(language: Language, x: Node, args: Sequence[CodeFragment]) -> CodeFragment:
    """Text of one operation."""
    if x.op == NUMBER:
        return fragment_of_number(language, x.value)
    if x.op == ADD:
        return sum_text(*args)
    if x.op == MULTIPLY:
        a, b = args
        if is_negated(x):
            return CodeFragment(b.text, b.level, not b.negative)
        return CodeFragment(f"{a.bare(PRODUCT)} * {b.bare(ATOM)}", PRODUCT, a.negative != b.negative)
    if x.op == DIVIDE:
        a, b = args
        return CodeFragment(f"{a.bare(PRODUCT)} / {b.bare(ATOM)}", PRODUCT, a.negative != b.negative)
    texts = [a.whole for a in args]
    if x.op == CALL:
        if "constant" in x.data.details:
            return fragment_of_number(language, x.data.details["constant"])
        return CodeFragment(language.call(x.data, texts))
    return CodeFragment(language.functions[x.op].format(*texts))


def sum_text(a: CodeFragment, b: CodeFragment) -> CodeFragment:
    """Sum or difference."""
    if a.negative and b.negative:
        return CodeFragment(f"{a.bare(SUM)} + {b.bare(PRODUCT)}", SUM, True)
    if a.negative:
        a, b = b, a
    return CodeFragment(f"{a.bare(SUM)} {'-' if b.negative else '+'} {b.bare(PRODUCT)}", SUM)


def wrapped_items(indent: str, items: Sequence[str]) -> list[str]:
    """Items separated by commas, wrapped to lines."""
    rows: list[str] = []
    row = indent
    for x in items:
        if len(row) > len(indent) and len(row) + len(x) > LINE:
            rows, row = [*rows, row.rstrip()], indent
        row += x + ", "
    return [*rows, row.rstrip()]
