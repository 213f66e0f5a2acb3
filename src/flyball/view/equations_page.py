"""The page of a mechanism's equations: formulas as MathML, which browsers draw by themselves, offline."""

from __future__ import annotations

from html import escape

from ..expression_graph.printers.mathml import formula as math
from ..symbolic.document_formats import (
    Block,
    Cell,
    DataTable,
    Display,
    Document,
    Formula,
    Matrix,
    Paragraph,
    Tex,
    aligned_lines,
    fits_width,
    matrix_cells,
    nonzero_entries,
)
from .page import fill_template, static

FORMULA_WIDTH = 112  # characters in a line of a formula
CELL_WIDTH = 46  # characters in an entry of a matrix, which may scroll
FOLDED_FROM = 40  # tables with at least this number of rows are folded


def equations_page(document: Document) -> str:
    """Return the document as one self-contained HTML file.

    Parameters
    ----------
    document : Document
    """
    links = "".join(f'<a href="#{s.name}">{escape(s.title)}</a>' for s in document.sections)
    body = "".join(
        f'<section id="{s.name}" class="listing"><h2>{escape(s.title)}</h2>'
        f"{''.join(map(block_html, s.blocks))}</section>\n"
        for s in document.sections
    )
    parts = {
        "title": escape(document.title),
        "style": static("page.css") + static("equations.css"),
        "subtitle": escape(document.subtitle),
        "links": links,
        "content": body,
        "by": escape(_version_note()),
    }
    return fill_template(static("equations.html"), parts)


def block_html(block: Block) -> str:
    """Return the markup of a block."""
    if isinstance(block, Paragraph):
        return f"<p class='prose'>{escape(block.text)}</p>"
    if isinstance(block, Display):
        return f'<div class="formula told">{math(block.formula.latex, True)}</div>'
    if isinstance(block, DataTable):
        return listing_html(block)
    if isinstance(block, Matrix):
        return matrix_html(block)
    note = f' <span class="note">{escape(block.note)}</span>' if block.note else ""
    head = f"<h3>{escape(block.title)}{note}</h3>" if block.title else ""
    return f'<div class="group">{head}{"".join(formula_html(f) for f in block.formulas)}</div>'


def formula_html(f: Formula) -> str:
    """Return the markup of a formula in lines."""
    unit = f'<span class="unit">{escape(f.unit)}</span>' if f.unit else ""
    return f'<div class="formula">{math(aligned_lines(f, FORMULA_WIDTH), True)}{unit}</div>'


def matrix_html(m: Matrix) -> str:
    """Return the markup of a matrix with labels of rows and columns; as a list if its entries are long."""
    made = matrix_cells(m)
    if not fits_width([[c] for row in made for c in row], CELL_WIDTH):
        return f'<div class="group">{"".join(formula_html(f) for f in nonzero_entries(m))}</div>'
    head = "".join(f"<th>{math(c.latex)}</th>" for c in m.columns)
    rows = "".join(
        f"<tr><th>{math(name.latex)}</th>{bracket_html('opens')}"
        + "".join("<td class='zero'>·</td>" if c == r"\cdot" else f"<td>{math(c)}</td>" for c in row)
        + f"{bracket_html('closes')}</tr>"
        for name, row in zip(m.rows, made, strict=True)
    )
    left, gap = math(f"{m.left.latex} ="), '<th class="gap"> </th>'
    return (
        f'<div class="matrix"><div class="whose">{left}</div><div class="scroll"><table>'
        f"<thead><tr><th> </th>{gap}{head}{gap}</tr></thead><tbody>{rows}</tbody></table></div></div>"
    )


def bracket_html(side: str) -> str:
    """Return a row's part of the bracket on one side of a matrix."""
    return f'<td class="bracket {side}"></td>'


def listing_html(t: DataTable) -> str:
    """Return the markup of a table; folded if it is long."""
    head = "".join(f"<th>{escape(c)}</th>" for c in t.columns)
    rows = "".join("<tr>" + "".join(f"<td>{cell_html(c)}</td>" for c in row) + "</tr>" for row in t.rows)
    made = f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>'
    if len(t.rows) < FOLDED_FROM:
        return made
    return f"<details><summary>{len(t.rows)} rows</summary>{made}</details>"


def cell_html(c: Cell) -> str:
    """Return the markup of a table cell."""
    return math(c.latex) if isinstance(c, Tex) else escape(c)


def _version_note() -> str:
    from .. import __version__

    return f"Made by flyball {__version__}"
