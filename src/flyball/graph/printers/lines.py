"""Expressions as lines of text, in any language with infix operators.

What is used once stands where it is used, up to a width; what is used more often is a line of its own. Operations are
done in the order and association of the graph, so that every language computes the same to the last bit, as far as its
sine does.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from ..function import Function
from ..node import ADD, CALL, DIVIDE, MULTIPLY, NUMBER, SYMBOL, Node
from ..values import reached
from .routine import negated

SUM, PRODUCT, ATOM = range(3)
WIDTH = 60  # characters of what is put in place
LINE = 116  # characters of a line


@dataclass(frozen=True)
class Language:
    """What a language writes.

    Parameters
    ----------
    number : callable
        A number that reads back to the last bit.
    functions : mapping
        Function of `math/scalar.py`, or "power" -> its text, with {0}, {1}, {2} for arguments.
    call : callable
        Text of a function that is known by name only, of its arguments.
    """

    number: Callable[[float], str]
    functions: Mapping[str, str]
    call: Callable[[Function, Sequence[str]], str]


class Piece(NamedTuple):
    """Text of an expression: what binds it, and whether it is the negative of what the text says."""

    text: str
    level: int = ATOM
    negative: bool = False

    @property
    def whole(self) -> str:
        """With its sign."""
        return "-" + self.bare(PRODUCT) if self.negative else self.text

    def bare(self, level: int) -> str:
        """Without its sign, as a part of what binds as strongly as ``level``."""
        return self.text if self.level >= level else f"({self.text})"


def number(language: Language, x: float) -> Piece:
    """A number."""
    return Piece(language.number(abs(x)), ATOM, x < 0.0)


def lines(
    language: Language, nodes: Sequence[Any], symbols: Mapping[int, str], temporary: Callable[[], str]
) -> tuple[list[tuple[str, str]], list[str]]:
    """Temporaries and their texts, in order; and a text for each of ``nodes``.

    Parameters
    ----------
    language : Language
    nodes : sequence of Node or number
    symbols : mapping
        From a symbol's index to its text.
    temporary : callable
        A name for one more of them.
    """
    order = reached(nodes)
    uses = Counter(positive(a).index for x in order if not negated(x) for a in x.args)
    uses.update(positive(x).index for x in nodes if isinstance(x, Node))
    pieces: dict[int, Piece] = {}
    found = []
    for x in order:
        if x.op == SYMBOL:
            pieces[x.index] = Piece(symbols[x.index])
            continue
        piece = made(language, x, [pieces[a.index] for a in x.args])
        if x.op != NUMBER and not negated(x) and (uses[x.index] > 1 or len(piece.text) > WIDTH):
            name = temporary()
            found.append((name, piece.whole))
            piece = Piece(name)
        pieces[x.index] = piece
    return found, [pieces[x.index].whole if isinstance(x, Node) else number(language, x).whole for x in nodes]


def positive(x: Node) -> Node:
    """What stands behind a change of sign."""
    return x.args[1] if negated(x) else x


def made(language: Language, x: Node, args: Sequence[Piece]) -> Piece:
    """Text of one operation."""
    if x.op == NUMBER:
        return number(language, x.value)
    if x.op == ADD:
        return added(*args)
    if x.op == MULTIPLY:
        a, b = args
        if negated(x):
            return Piece(b.text, b.level, not b.negative)
        return Piece(f"{a.bare(PRODUCT)} * {b.bare(ATOM)}", PRODUCT, a.negative != b.negative)
    if x.op == DIVIDE:
        a, b = args
        return Piece(f"{a.bare(PRODUCT)} / {b.bare(ATOM)}", PRODUCT, a.negative != b.negative)
    texts = [a.whole for a in args]
    if x.op == CALL:
        if "constant" in x.data.told:
            return number(language, x.data.told["constant"])
        return Piece(language.call(x.data, texts))
    return Piece(language.functions[x.op].format(*texts))


def added(a: Piece, b: Piece) -> Piece:
    """Sum or difference."""
    if a.negative and b.negative:
        return Piece(f"{a.bare(SUM)} + {b.bare(PRODUCT)}", SUM, True)
    if a.negative:
        a, b = b, a
    return Piece(f"{a.bare(SUM)} {'-' if b.negative else '+'} {b.bare(PRODUCT)}", SUM)


def listed(indent: str, items: Sequence[str]) -> list[str]:
    """Items with commas behind them, in as many lines as it takes."""
    rows: list[str] = []
    row = indent
    for x in items:
        if len(row) > len(indent) and len(row) + len(x) > LINE:
            rows, row = [*rows, row.rstrip()], indent
        row += x + ", "
    return [*rows, row.rstrip()]
