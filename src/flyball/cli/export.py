"""``flyball export``: equations of motion as C, Python, CasADi or Numba code."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..methods.symbols import Symbols
from .asking import Asked, command
from .flags import Flag

OWN = {
    "functions": Flag(names=("--function",)),
    "outputs": Flag(names=("--output",)),
    "inputs": Flag(names=("--input",)),
}


@command(Symbols.export, own=OWN, without=("folder",))
def export(
    asked: Asked,
    *,
    out: Annotated[Path | None, typer.Option(help="Folder for the files; named after the model if not given.")] = None,
) -> None:
    """Print the functions with their arguments and how long they are, and the files written."""
    code = asked.answer(folder=asked.folder(out, "code"))
    asked.files += [str(f) for f in code.files]
    asked.say(code)
