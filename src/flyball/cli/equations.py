"""``flyball equations``: the equations of motion as formulas, on a page and in LaTeX."""

from __future__ import annotations

from ..methods.symbols import Symbols
from .asking import Asked, command
from .common import Out
from .flags import Flag


@command(Symbols.symbolic, name="equations", own={"inputs": Flag(names=("--input",))})
def equations(asked: Asked, *, out: Out = None) -> None:
    """Write equations.html, which opens offline, and equations.tex; print sizes and names."""
    found = asked.answer()
    folder = asked.folder(out, "equations")
    asked.write(folder / "equations.html", found.to_html)
    asked.write(folder / "equations.tex", found.to_latex)
    asked.say(found)
