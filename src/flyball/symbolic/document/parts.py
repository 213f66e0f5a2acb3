"""The parts of a document of equations: sections, formulas, matrices, tables; and descriptions of symbols.

Formulas contain nodes; names, labels and headings are LaTeX or plain text.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...expression_graph.graph import Node, Symbol

KINDS = {
    "parameter": "parameter",
    "coordinate": "coordinate",
    "velocity": "velocity",
    "acceleration": "acceleration",
    "multiplier": "multiplier",
    "time": "time",
    "state": "state",
    "input": "input",
    "load": "normal force between the surfaces",
}
MEANINGS = {
    "angle": "angle",
    "displacement": "displacement",
    "x": "position of the reference point along x",
    "y": "position of the reference point along y",
    "z": "position of the reference point along z",
    "com_x": "position of the mass centre along x",
    "com_y": "position of the mass centre along y",
    "com_z": "position of the mass centre along z",
    "w_x": "angular velocity about its own x axis",
    "w_y": "angular velocity about its own y axis",
    "w_z": "angular velocity about its own z axis",
    "effort": "effort",
    **{f"e{k}": f"Euler parameter {k}" for k in range(4)},
}


def symbol_meaning(symbol: Symbol) -> str:
    """Meaning of a symbol."""
    what = symbol.name.removeprefix(f"{symbol.element}.") if symbol.element else ""
    plain = what.rstrip("'")
    order = ("", "rate of the ", "second rate of the ")[min(len(what) - len(plain), 2)]
    if plain in MEANINGS:
        return f"{order}{MEANINGS[plain]} of {symbol.element}"
    kind = KINDS.get(symbol.kind, symbol.kind)
    return f"{kind} of {symbol.element}" if symbol.element else kind


def unit_text(text: str) -> str:
    """Unit in readable form."""
    return "" if text in ("", "1") else text.replace("*", " ").replace("^2", "²")


def connected_parts(e: Any) -> str:
    """Parts that an element connects or acts on."""
    if hasattr(e, "body_i"):
        return f"{e.body_i} – {e.body_j}"
    if hasattr(e, "bodies"):
        return " – ".join(e.bodies)
    if hasattr(e, "law") and hasattr(e, "coordinate"):
        return f"{e.coordinate} = {e.law}"
    for name in ("body", "joint", "coordinate"):
        if isinstance(getattr(e, name, None), str):
            return f"on {getattr(e, name)}"
    coupled = getattr(e, "coupled", None) or getattr(e, "along", None)
    return ", ".join(coupled()) if callable(coupled) else ""


def inertia_labels(inertia: Any, planar: bool) -> list[Any]:
    """Moments of inertia, then products."""
    return [inertia[k] for k in ((8,) if planar else (0, 4, 8, 1, 2, 5))]


@dataclass(frozen=True)
class Tex:
    """A formula in a cell of a table, or a label; ``text`` is the same as text."""

    latex: str
    text: str


Cell = str | Tex


Products = list[tuple[Any, Node]]
"""Expressions and the symbols that multiply them."""


@dataclass
class Formula:
    """A formula: left = right, or a sum of products = right + a sum of products."""

    left: Tex
    right: Any
    unit: str = ""
    before: Products = field(default_factory=list)
    after: Products = field(default_factory=list)
    parts: list[Formula] = field(default_factory=list)  # formulas whose right-hand sides add up to this one


@dataclass
class Formulas:
    """A list of formulas with a heading."""

    title: str
    formulas: list[Formula]
    note: str = ""


@dataclass
class Matrix:
    """left = a matrix with labelled rows and columns."""

    left: Tex
    entries: np.ndarray
    rows: tuple[Tex, ...]
    columns: tuple[Tex, ...]
    symmetric: bool = False


@dataclass(frozen=True)
class DataTable:
    """A table."""

    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]


@dataclass(frozen=True)
class Paragraph:
    """A paragraph."""

    text: str


@dataclass(frozen=True)
class Display:
    """A formula given as text."""

    formula: Tex


Block = Formulas | Matrix | DataTable | Paragraph | Display


@dataclass
class Section:
    """A heading with its blocks."""

    name: str
    title: str
    blocks: list[Block] = field(default_factory=list)


@dataclass
class Document:
    """A document: title, subtitle, sections."""

    title: str
    subtitle: str
    sections: list[Section]

    def expressions(self) -> list[Any]:
        """All expressions in the document."""
        out: list[Any] = []
        for block in self._blocks():
            if isinstance(block, Matrix):
                out += block.entries.ravel().tolist()
            else:
                for f in block.formulas:
                    out += [f.right, *(c for c, _ in f.before), *(c for c, _ in f.after)]
        return out

    def put(self, expressions: list[Any]) -> None:
        """Replace all expressions."""
        given = iter(expressions)
        for block in self._blocks():
            if isinstance(block, Matrix):
                for k in np.ndindex(block.entries.shape):
                    block.entries[k] = next(given)
            else:
                for f in block.formulas:
                    f.right = next(given)
                    f.before = [(next(given), x) for _, x in f.before]
                    f.after = [(next(given), x) for _, x in f.after]

    def _blocks(self) -> Iterator[Formulas | Matrix]:
        for section in self.sections:
            yield from (b for b in section.blocks if isinstance(b, Formulas | Matrix))
