"""The page of a mechanism's equations: formulas as MathML, which browsers draw by themselves, offline."""

from __future__ import annotations

from html import escape

from ..graph.printers.mathml import formula as math
from ..symbolic.document.lines import aligned, cells, entries, fits
from ..symbolic.document.parts import Block, Cell, Display, Document, Formula, Listing, Matrix, Prose, Tex
from .static_files import filled, static

WIDTH = 112  # letters in a line of a formula
CELL = 46  # letters in an entry of a matrix, which may be wide altogether: it scrolls
FOLDED = 40  # rows of a table from which on it is folded


def page(document: Document) -> str:
    """The document as one HTML file that needs nothing else.

    Parameters
    ----------
    document : Document
    """
    links = "".join(f'<a href="#{s.name}">{escape(s.title)}</a>' for s in document.sections)
    body = "".join(
        f'<section id="{s.name}" class="listing"><h2>{escape(s.title)}</h2>'
        f"{''.join(map(written, s.blocks))}</section>\n"
        for s in document.sections
    )
    parts = {
        "title": escape(document.title),
        "style": static("page.css") + static("equations.css"),
        "subtitle": escape(document.subtitle),
        "links": links,
        "content": body,
        "by": escape(_made_by()),
    }
    return filled(static("equations.html"), parts)


def written(block: Block) -> str:
    """A block."""
    if isinstance(block, Prose):
        return f"<p class='prose'>{escape(block.text)}</p>"
    if isinstance(block, Display):
        return f'<div class="formula told">{math(block.formula.latex, True)}</div>'
    if isinstance(block, Listing):
        return listing(block)
    if isinstance(block, Matrix):
        return matrix(block)
    note = f' <span class="note">{escape(block.note)}</span>' if block.note else ""
    head = f"<h3>{escape(block.title)}{note}</h3>" if block.title else ""
    return f'<div class="group">{head}{"".join(formula(f) for f in block.formulas)}</div>'


def formula(f: Formula) -> str:
    """A formula in lines."""
    unit = f'<span class="unit">{escape(f.unit)}</span>' if f.unit else ""
    return f'<div class="formula">{math(aligned(f, WIDTH), True)}{unit}</div>'


def matrix(m: Matrix) -> str:
    """A matrix with what its rows and columns belong to; entry by entry where the entries are long."""
    made = cells(m)
    if not fits([[c] for row in made for c in row], CELL):
        return f'<div class="group">{"".join(formula(f) for f in entries(m))}</div>'
    head = "".join(f"<th>{math(c.latex)}</th>" for c in m.columns)
    rows = "".join(
        f"<tr><th>{math(name.latex)}</th>{bracket('opens')}"
        + "".join("<td class='zero'>·</td>" if c == r"\cdot" else f"<td>{math(c)}</td>" for c in row)
        + f"{bracket('closes')}</tr>"
        for name, row in zip(m.rows, made, strict=True)
    )
    left, gap = math(f"{m.left.latex} ="), '<th class="gap"> </th>'
    return (
        f'<div class="matrix"><div class="whose">{left}</div><div class="scroll"><table>'
        f"<thead><tr><th> </th>{gap}{head}{gap}</tr></thead><tbody>{rows}</tbody></table></div></div>"
    )


def bracket(side: str) -> str:
    """A part of the bracket on one side of a matrix: its row's."""
    return f'<td class="bracket {side}"></td>'


def listing(t: Listing) -> str:
    """A table; folded where it is long."""
    head = "".join(f"<th>{escape(c)}</th>" for c in t.columns)
    rows = "".join("<tr>" + "".join(f"<td>{cell(c)}</td>" for c in row) + "</tr>" for row in t.rows)
    made = f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>'
    if len(t.rows) < FOLDED:
        return made
    return f"<details><summary>{len(t.rows)} rows</summary>{made}</details>"


def cell(c: Cell) -> str:
    """A cell of a table."""
    return math(c.latex) if isinstance(c, Tex) else escape(c)


def _made_by() -> str:
    from .. import __version__

    return f"Made by flyball {__version__}"
