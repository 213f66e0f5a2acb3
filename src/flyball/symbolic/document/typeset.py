"""A document as a LaTeX file of its own, for pdflatex with the packages of every installation."""

from __future__ import annotations

from ...graph.printers.spelling import escaped
from .lines import aligned, cells, entries, fits
from .parts import Block, Cell, Display, Document, Formula, Listing, Matrix, Prose, Tex

WIDTH = 84  # letters in a line of a formula
MATRIX = 84
HEAD = r"""\documentclass[10pt,a4paper,fleqn]{article}
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


def typeset(document: Document) -> str:
    """The document in LaTeX."""
    out = [HEAD % (words(document.title), words(document.subtitle))]
    for section in document.sections:
        out.append(rf"\section*{{{words(section.title)}}}")
        out += [written(block) for block in section.blocks]
    return "\n".join(out) + "\n\\end{document}\n"


def words(text: str) -> str:
    """Plain text between LaTeX; letters that the font lacks are left out."""
    told = escaped(text.replace("\\", "/")).replace(r"\sim ", r"\textasciitilde{}").replace(r"\wedge ", r"\^{}")
    for letter, latex in UNICODE.items():
        told = told.replace(letter, latex)
    return told.encode("latin-1", "replace").decode("latin-1")


def written(block: Block) -> str:
    """A block."""
    if isinstance(block, Prose):
        return f"{words(block.text)}\n"
    if isinstance(block, Display):
        return rf"\[ {block.formula.latex} \]"
    if isinstance(block, Listing):
        return listing(block)
    if isinstance(block, Matrix):
        return matrix(block)
    note = f" \\textit{{{words(block.note)}}}" if block.note else ""
    head = f"\\paragraph{{{words(block.title)}}}{note}\\mbox{{}}\n" if block.title else ""
    return head + "\n".join(formula(f) for f in block.formulas)


def formula(f: Formula) -> str:
    """A formula in lines."""
    unit = rf"\quad \text{{{words(f.unit)}}}" if f.unit else ""
    return rf"\[ {aligned(f, WIDTH)}{unit} \]"


def matrix(m: Matrix) -> str:
    """A matrix; entry by entry if it is too wide."""
    made = cells(m)
    if len(made) <= 30 and fits(made, MATRIX):
        body = " \\\\\n".join(" & ".join(row) for row in made)
        columns = "c" * m.entries.shape[1]
        return rf"\[ {m.left.latex} = \left[\begin{{array}}{{{columns}}}" + f"\n{body}\n" + r"\end{array}\right] \]"
    return "\n".join(formula(f) for f in entries(m))


def listing(t: Listing) -> str:
    """A table that may go over pages."""
    share = 0.98 * (1.0 - 0.017 * (len(t.columns) - 1)) / len(t.columns)
    columns = "".join(rf"p{{{share:.3f}\textwidth}}" for _ in t.columns)
    head = " & ".join(rf"\textit{{{words(c)}}}" for c in t.columns)
    rows = " \\\\\n".join(" & ".join(map(cell, row)) for row in t.rows)
    start = rf"{{\small\begin{{longtable}}{{@{{}}{columns}@{{}}}}"
    return f"{start}\n\\hline\n{head} \\\\\n\\hline\n\\endhead\n{rows} \\\\\n\\hline\n\\end{{longtable}}}}"


def cell(c: Cell) -> str:
    """A cell of a table."""
    return f"${c.latex}$" if isinstance(c, Tex) else words(c)
