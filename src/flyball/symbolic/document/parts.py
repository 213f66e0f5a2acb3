"""What a document of equations is made of. Formulas hold nodes; names, labels and headings are LaTeX or plain text."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...graph.node import Node


@dataclass(frozen=True)
class Tex:
    """A formula in a cell of a table, or a label; ``plain`` is the same as text."""

    latex: str
    plain: str


Cell = str | Tex


Products = list[tuple[Any, Node]]
"""Expressions and the symbols that they are multiplied with."""


@dataclass
class Formula:
    """A formula: left = right, or a sum of products = right + a sum of products."""

    left: Tex
    right: Any
    unit: str = ""
    before: Products = field(default_factory=list)
    after: Products = field(default_factory=list)
    parts: list[Formula] = field(default_factory=list)  # those whose right sides add up to this one's


@dataclass
class Formulas:
    """Formulas under one another, with a heading of their own."""

    title: str
    formulas: list[Formula]
    note: str = ""


@dataclass
class Matrix:
    """left = a matrix whose rows and columns belong to something."""

    left: Tex
    entries: np.ndarray
    rows: tuple[Tex, ...]
    columns: tuple[Tex, ...]
    symmetric: bool = False


@dataclass(frozen=True)
class Listing:
    """A table."""

    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]


@dataclass(frozen=True)
class Prose:
    """A paragraph."""

    text: str


@dataclass(frozen=True)
class Display:
    """A formula that is told, not computed."""

    formula: Tex


Block = Formulas | Matrix | Listing | Prose | Display


@dataclass
class Section:
    """A heading and what stands below it."""

    name: str
    title: str
    blocks: list[Block] = field(default_factory=list)


@dataclass
class Document:
    """Title, a line below it, sections."""

    title: str
    subtitle: str
    sections: list[Section]

    def expressions(self) -> list[Any]:
        """All expressions in it."""
        out: list[Any] = []
        for block in self._blocks():
            if isinstance(block, Matrix):
                out += block.entries.ravel().tolist()
            else:
                for f in block.formulas:
                    out += [f.right, *(c for c, _ in f.before), *(c for c, _ in f.after)]
        return out

    def put(self, expressions: list[Any]) -> None:
        """Others in their places."""
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
