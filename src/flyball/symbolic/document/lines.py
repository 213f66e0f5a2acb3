"""Formulas broken into lines where they are longer than these."""

from __future__ import annotations

import re

from ...graph.printers.latex import BREAK, LatexPrinter
from ...graph.printers.wrapping import wrapped
from .parts import Formula, Matrix, Tex

ZERO = Tex("0", "0")


def width(latex: str) -> int:
    """About how many letters wide a formula is; those of indices count less."""
    told = re.sub(r"\\(begin|end)\{\w+\}|\\(left|right|quad|,|mathbf|boldsymbol|sqrt|ddot|dot)", "", latex)
    told = re.sub(r"\\(text|mathrm|operatorname)\{", "{", told)
    told = re.sub(r"\\(sin|cos|tan)", r"\1", told)
    told = re.sub(r"\\[A-Za-z]+", "x", told)
    small = sum(
        len(re.sub(r"[{}\s]", "", m[1] or m[2])) for m in re.finditer(r"[_^](?:\{((?:[^{}]|\{[^{}]*\})*)\}|(.))", told)
    )
    signs = told.count(" + ") + told.count(" - ") + told.count(" = ")
    return round(len(re.sub(r"[{}_^\s&\\\x1f]", "", told)) - 0.35 * small + 0.8 * signs)


def aligned(formula: Formula, most: int) -> str:
    """A formula in LaTeX, in lines of about ``most`` letters."""
    printer = LatexPrinter()
    before = formula.left.latex if not formula.before else printer.products(formula.before)
    after = printer.apart(formula.right) if formula.after else printer.expression(formula.right)
    if formula.after:
        more = printer.products(formula.after)
        after = more if formula.right == 0.0 else f"{after}{BREAK}{joint(more)}"
    pieces = [*before.split(BREAK), *f" = {after}".split(BREAK)]
    rows = wrapped(pieces, most, width)
    if len(rows) == 1:
        return rows[0]
    rows = [("&" if k == 0 else r"&\quad {}") + row for k, row in enumerate(rows)]
    return r"\begin{aligned} " + " \\\\\n".join(rows) + r" \end{aligned}"


def joint(more: str) -> str:
    """What is added to something, with its sign."""
    return f" - {more[1:]}" if more.startswith("-") else f" + {more}"


def entries(matrix: Matrix) -> list[Formula]:
    """What stands in a matrix that is not zero, entry by entry."""
    out = []
    for k, x in _all(matrix):
        if matrix.symmetric and k[0] > k[-1]:
            continue
        if x != 0.0:
            where = ",".join(str(i + 1) for i in k)
            out.append(Formula(Tex(f"{_light(matrix.left.latex)}_{{{where}}}", f"{matrix.left.plain}[{where}]"), x))
    return out


def _all(matrix: Matrix) -> list[tuple[tuple[int, ...], object]]:
    shape = matrix.entries.shape
    return [((i, j), matrix.entries[i, j]) for i in range(shape[0]) for j in range(shape[1])]


def _light(latex: str) -> str:
    """The letter of a matrix as that of its entries."""
    found = re.fullmatch(r"\\mathbf\{(\w)\}", latex)
    return found[1] if found else latex


def cells(matrix: Matrix) -> list[list[str]]:
    """Entries in LaTeX; zeros are dots."""
    printer = LatexPrinter()
    return [[r"\cdot" if x == 0.0 else printer.expression(x).replace(BREAK, "") for x in row] for row in matrix.entries]


def fits(made: list[list[str]], most: int) -> bool:
    """Whether a matrix is no wider than ``most`` letters."""
    return sum(max((width(c) for c in column), default=0) + 2 for column in zip(*made, strict=True)) <= most
