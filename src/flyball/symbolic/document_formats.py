"""Parts of a document of equations (sections, formulas, matrices, tables), and its output as plain text and LaTeX.

Formulas contain nodes; names, labels and headings are LaTeX or plain text. The LaTeX file is for pdflatex; formulas are
broken into lines. `view.equations_page` writes the web page.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..expression_graph.graph import Node, Symbol
from ..expression_graph.printers.formula_layout import latex_escaped, wrap_fragments
from ..expression_graph.printers.latex import BREAK, LatexPrinter
from ..expression_graph.printers.text import TextPrinter, broken_lines

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


class SectionPart:
    """A part of a section: what all kinds of blocks can do."""

    def expressions(self) -> list[Any]:
        """All expressions in the block."""
        return []

    def replace_expressions(self, given: Iterator[Any]) -> None:
        """Replace all expressions by the next ones given."""

    def text_lines(self, width: int) -> list[str]:
        """Lines of plain text."""
        raise NotImplementedError

    def latex(self) -> str:
        """LaTeX for pdflatex."""
        raise NotImplementedError


@dataclass
class Formulas(SectionPart):
    """A list of formulas with a heading."""

    title: str
    formulas: list[Formula]
    note: str = ""

    def expressions(self) -> list[Any]:
        """All expressions in the formulas."""
        return [x for f in self.formulas for x in (f.right, *(c for c, _ in f.before), *(c for c, _ in f.after))]

    def replace_expressions(self, given: Iterator[Any]) -> None:
        """Replace all expressions by the next ones given."""
        for f in self.formulas:
            f.right = next(given)
            f.before = [(next(given), x) for _, x in f.before]
            f.after = [(next(given), x) for _, x in f.after]

    def text_lines(self, width: int) -> list[str]:
        """Heading, and the lines of every formula."""
        head = [f"{self.title}: {self.note}" if self.note else self.title] if self.title else []
        return head + [line for f in self.formulas for line in text_formula(f, width)]

    def latex(self) -> str:
        """Heading, and every formula."""
        note = f" \\textit{{{latex_words(self.note)}}}" if self.note else ""
        head = f"\\paragraph{{{latex_words(self.title)}}}{note}\\mbox{{}}\n" if self.title else ""
        return head + "\n".join(latex_formula(f) for f in self.formulas)


@dataclass
class Matrix(SectionPart):
    """left = a matrix with labelled rows and columns."""

    left: Tex
    entries: np.ndarray
    rows: tuple[Tex, ...]
    columns: tuple[Tex, ...]
    symmetric: bool = False

    def expressions(self) -> list[Any]:
        """All entries."""
        return self.entries.ravel().tolist()

    def replace_expressions(self, given: Iterator[Any]) -> None:
        """Replace all entries by the next ones given."""
        for k in np.ndindex(self.entries.shape):
            self.entries[k] = next(given)

    def text_lines(self, width: int) -> list[str]:
        """The matrix under its columns' names; entry by entry if it is too wide."""
        printer = TextPrinter()
        rows = [
            [name.text, *("." if x == 0.0 else printer.expression(x) for x in row)]
            for name, row in zip(self.rows, self.entries, strict=True)
        ]
        head = ["", *(c.text for c in self.columns)]
        lines = text_table([head, *rows]) if self.columns else text_table(rows)
        if max(map(len, lines), default=0) <= width:
            return [f"  {self.left.text} =", *(f"  {line}" for line in lines)]
        return [line for f in nonzero_entries(self) for line in text_formula(f, width)]

    def latex(self) -> str:
        """The matrix; entry by entry if it is too wide."""
        made = matrix_cells(self)
        if len(made) <= 30 and fits_width(made, LATEX_MATRIX_WIDTH):
            body = " \\\\\n".join(" & ".join(row) for row in made)
            columns = "c" * self.entries.shape[1]
            array = rf"\left[\begin{{array}}{{{columns}}}" + f"\n{body}\n" + r"\end{array}\right]"
            return rf"\[ {self.left.latex} = {array} \]"
        return "\n".join(latex_formula(f) for f in nonzero_entries(self))


@dataclass(frozen=True)
class DataTable(SectionPart):
    """A table."""

    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]

    def text_lines(self, width: int) -> list[str]:
        """Rows with their columns under one another."""
        return text_table([self.columns, *self.rows])

    def latex(self) -> str:
        """A table that may go over pages."""
        share = 0.98 * (1.0 - 0.017 * (len(self.columns) - 1)) / len(self.columns)
        columns = "".join(rf"p{{{share:.3f}\textwidth}}" for _ in self.columns)
        head = " & ".join(rf"\textit{{{latex_words(c)}}}" for c in self.columns)
        rows = " \\\\\n".join(" & ".join(map(latex_cell, row)) for row in self.rows)
        start = rf"{{\small\begin{{longtable}}{{@{{}}{columns}@{{}}}}"
        return f"{start}\n\\hline\n{head} \\\\\n\\hline\n\\endhead\n{rows} \\\\\n\\hline\n\\end{{longtable}}}}"


@dataclass(frozen=True)
class Paragraph(SectionPart):
    """A paragraph."""

    text: str

    def text_lines(self, width: int) -> list[str]:
        """The text, in one line."""
        return [self.text]

    def latex(self) -> str:
        """The text, in letters that the font has."""
        return f"{latex_words(self.text)}\n"


@dataclass(frozen=True)
class Display(SectionPart):
    """A formula given as text."""

    formula: Tex

    def text_lines(self, width: int) -> list[str]:
        """The formula as text."""
        return [self.formula.text]

    def latex(self) -> str:
        """The formula in a line of its own."""
        return rf"\[ {self.formula.latex} \]"


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
        return [x for section in self.sections for block in section.blocks for x in block.expressions()]

    def replace_expressions(self, expressions: list[Any]) -> None:
        """Replace all expressions."""
        given = iter(expressions)
        for section in self.sections:
            for block in section.blocks:
                block.replace_expressions(given)


ZERO = Tex("0", "0")


def formula_width(latex: str) -> int:
    """Approximate width of a formula in characters; those of indices count less."""
    told = re.sub(r"\\(begin|end)\{\w+\}|\\(left|right|quad|,|mathbf|boldsymbol|sqrt|ddot|dot)", "", latex)
    told = re.sub(r"\\(text|mathrm|operatorname)\{", "{", told)
    told = re.sub(r"\\(sin|cos|tan)", r"\1", told)
    told = re.sub(r"\\[A-Za-z]+", "x", told)
    small = sum(
        len(re.sub(r"[{}\s]", "", m[1] or m[2])) for m in re.finditer(r"[_^](?:\{((?:[^{}]|\{[^{}]*\})*)\}|(.))", told)
    )
    signs = told.count(" + ") + told.count(" - ") + told.count(" = ")
    return round(len(re.sub(r"[{}_^\s&\\\x1f]", "", told)) - 0.35 * small + 0.8 * signs)


def aligned_lines(formula: Formula, most: int) -> str:
    """A formula in LaTeX, in lines of about ``most`` letters."""
    printer = LatexPrinter()
    before = formula.left.latex if not formula.before else printer.products(formula.before)
    after = printer.delimited(formula.right) if formula.after else printer.expression(formula.right)
    if formula.after:
        more = printer.products(formula.after)
        after = more if formula.right == 0.0 else f"{after}{BREAK}{joined_terms(more)}"
    pieces = [*before.split(BREAK), *f" = {after}".split(BREAK)]
    rows = wrap_fragments(pieces, most, formula_width)
    if len(rows) == 1:
        return rows[0]
    rows = [("&" if k == 0 else r"&\quad {}") + row for k, row in enumerate(rows)]
    return r"\begin{aligned} " + " \\\\\n".join(rows) + r" \end{aligned}"


def joined_terms(more: str) -> str:
    """Added terms with their signs."""
    return f" - {more[1:]}" if more.startswith("-") else f" + {more}"


def nonzero_entries(matrix: Matrix) -> list[Formula]:
    """Nonzero entries of a matrix, as formulas."""
    out = []
    for k, x in _matrix_entries(matrix):
        if matrix.symmetric and k[0] > k[-1]:
            continue
        if x != 0.0:
            where = ",".join(str(i + 1) for i in k)
            out.append(
                Formula(Tex(f"{_entry_letter(matrix.left.latex)}_{{{where}}}", f"{matrix.left.text}[{where}]"), x)
            )
    return out


def _matrix_entries(matrix: Matrix) -> list[tuple[tuple[int, ...], object]]:
    shape = matrix.entries.shape
    return [((i, j), matrix.entries[i, j]) for i in range(shape[0]) for j in range(shape[1])]


def _entry_letter(latex: str) -> str:
    """Letter of the entries of a matrix."""
    found = re.fullmatch(r"\\mathbf\{(\w)\}", latex)
    return found[1] if found else latex


def matrix_cells(matrix: Matrix) -> list[list[str]]:
    """Entries in LaTeX; zeros are dots."""
    printer = LatexPrinter()
    return [[r"\cdot" if x == 0.0 else printer.expression(x).replace(BREAK, "") for x in row] for row in matrix.entries]


def fits_width(made: list[list[str]], most: int) -> bool:
    """Whether a matrix is no wider than ``most`` letters."""
    return sum(max((formula_width(c) for c in column), default=0) + 2 for column in zip(*made, strict=True)) <= most


TEXT_WIDTH = 100


def text_document(document: Document, width: int = TEXT_WIDTH) -> str:
    """The document as plain text."""
    out = [document.title, "=" * len(document.title), document.subtitle]
    for section in document.sections:
        out += ["", section.title, "-" * len(section.title)]
        for block in section.blocks:
            out += block.text_lines(width)
    return "\n".join(out) + "\n"


def text_formula(f: Formula, width: int) -> list[str]:
    """A formula in lines."""
    printer = TextPrinter()
    before = f.left.text if not f.before else printer.products(f.before)
    after = printer.expression(f.right)
    if f.after:
        more = printer.products(f.after)
        after = more if f.right == 0.0 else after + joined_terms(more)
    line = f"{before} = {after}{f'  [{f.unit}]' if f.unit else ''}"
    first, *others = broken_lines(line, width - 6)
    return [f"  {first}", *(f"      {x}" for x in others)]


def text_table(rows: Sequence[Sequence[Cell]]) -> list[str]:
    """Rows with their columns under one another."""
    texts = [[c.text if isinstance(c, Tex) else c for c in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*texts, strict=True)]
    return ["  " + "  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip() for row in texts]


LATEX_WIDTH = 84  # characters per line of a formula
LATEX_MATRIX_WIDTH = 84
LATEX_PREAMBLE = r"""\documentclass[10pt,a4paper,fleqn]{article}
\usepackage[utf8]{inputenc}
\usepackage{amsmath,amssymb}
\usepackage[margin=18mm]{geometry}
\usepackage{longtable}
\allowdisplaybreaks
\setlength{\parindent}{0pt}
\setlength{\parskip}{4pt}
\setlength{\tabcolsep}{4pt}
\setlength{\LTleft}{0pt}
\title{%s}
\author{}
\date{%s}
\begin{document}
\maketitle
"""
UNICODE = {"–": "--", "²": r"\textsuperscript{2}", "³": r"\textsuperscript{3}", "°": r"\textdegree{}", "μ": r"$\mu$"}


def latex_document(document: Document) -> str:
    """The document in LaTeX."""
    out = [LATEX_PREAMBLE % (latex_words(document.title), latex_words(document.subtitle))]
    for section in document.sections:
        out.append(rf"\section*{{{latex_words(section.title)}}}")
        out += [block.latex() for block in section.blocks]
    return "\n".join(out) + "\n\\end{document}\n"


def latex_words(text: str) -> str:
    """Plain text between LaTeX; letters that the font lacks are left out."""
    told = latex_escaped(text.replace("\\", "/")).replace(r"\sim ", r"\textasciitilde{}").replace(r"\wedge ", r"\^{}")
    for letter, latex in UNICODE.items():
        told = told.replace(letter, latex)
    return told.encode("latin-1", "replace").decode("latin-1")


def latex_formula(f: Formula) -> str:
    """A formula in lines."""
    unit = rf"\quad \text{{{latex_words(f.unit)}}}" if f.unit else ""
    return rf"\[ {aligned_lines(f, LATEX_WIDTH)}{unit} \]"


def latex_cell(c: Cell) -> str:
    """A cell of a table."""
    return f"${c.latex}$" if isinstance(c, Tex) else latex_words(c)
