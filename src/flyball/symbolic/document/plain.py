"""A document as plain text."""

from __future__ import annotations

from collections.abc import Sequence

from ...graph.printers.text import TextPrinter, broken
from .lines import entries, joint
from .parts import Block, Cell, Display, Document, Formula, Listing, Matrix, Prose, Tex

WIDTH = 100


def plain(document: Document, width: int = WIDTH) -> str:
    """The document, for printing."""
    out = [document.title, "=" * len(document.title), document.subtitle]
    for section in document.sections:
        out += ["", section.title, "-" * len(section.title)]
        for block in section.blocks:
            out += written(block, width)
    return "\n".join(out) + "\n"


def written(block: Block, width: int) -> list[str]:
    """Lines of a block."""
    if isinstance(block, Prose):
        return [block.text]
    if isinstance(block, Display):
        return [block.formula.plain]
    if isinstance(block, Listing):
        return table([block.columns, *block.rows])
    if isinstance(block, Matrix):
        return matrix(block, width)
    head = [f"{block.title}: {block.note}" if block.note else block.title] if block.title else []
    return head + [line for f in block.formulas for line in formula(f, width)]


def formula(f: Formula, width: int) -> list[str]:
    """A formula in lines."""
    printer = TextPrinter()
    before = f.left.plain if not f.before else printer.products(f.before)
    after = printer.expression(f.right)
    if f.after:
        more = printer.products(f.after)
        after = more if f.right == 0.0 else after + joint(more)
    line = f"{before} = {after}{f'  [{f.unit}]' if f.unit else ''}"
    first, *others = broken(line, width - 6)
    return [f"  {first}", *(f"      {x}" for x in others)]


def matrix(m: Matrix, width: int) -> list[str]:
    """A matrix under its columns' names; entry by entry if it is too wide."""
    printer = TextPrinter()
    rows = [
        [m.rows[i].plain, *("." if x == 0.0 else printer.expression(x) for x in row)] for i, row in enumerate(m.entries)
    ]
    head = ["", *(c.plain for c in m.columns)]
    lines = table([head, *rows]) if m.columns else table(rows)
    if max(map(len, lines), default=0) <= width:
        return [f"  {m.left.plain} =", *(f"  {line}" for line in lines)]
    return [line for f in entries(m) for line in formula(f, width)]


def table(rows: Sequence[Sequence[Cell]]) -> list[str]:
    """Rows with their columns under one another."""
    texts = [[c.plain if isinstance(c, Tex) else c for c in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*texts, strict=True)]
    return ["  " + "  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip() for row in texts]
