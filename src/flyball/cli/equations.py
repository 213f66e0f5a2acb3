"""Subcommands for symbolic equations: ``equations`` (page, LaTeX) and ``export`` (code)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..mechanism_methods import SymbolicMethods
from .application import OutputFolder
from .options import OptionOverride
from .subcommand import Request, command


@command(SymbolicMethods.symbolic, name="equations", overrides={"inputs": OptionOverride(names=("--input",))})
def equations(request: Request, *, out: OutputFolder = None) -> None:
    """Write equations.html (works offline) and equations.tex; print sizes and names."""
    found = request.run_analysis()
    folder = request.folder(out, "equations")
    request.write(folder / "equations.html", found.to_html)
    request.write(folder / "equations.tex", found.to_latex)
    request.print_result(found)


EXPORT_OPTIONS = {
    "functions": OptionOverride(names=("--function",)),
    "outputs": OptionOverride(names=("--output",)),
    "inputs": OptionOverride(names=("--input",)),
}


@command(SymbolicMethods.export, overrides=EXPORT_OPTIONS, without=("folder",))
def export(
    request: Request,
    *,
    out: Annotated[Path | None, typer.Option(help="Folder for the files; named after the model if not given.")] = None,
) -> None:
    """Print the functions with their arguments and lengths, and the files written."""
    code = request.run_analysis(folder=request.folder(out, "code"))
    request.files += [str(f) for f in code.files]
    request.print_result(code)
