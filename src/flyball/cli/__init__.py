"""The ``flyball`` command: entry point and registration of all subcommands.

``cli/application.py`` contains the typer application, exit codes and printing of errors; ``cli/subcommand.py`` makes a
subcommand from a method of `Mechanism`; ``cli/options.py`` turns its arguments into command-line options. The other
modules contain the subcommands of one subject each. A new subcommand is a function with the decorator `command`; its
module is imported here, and its name stands in `COMMANDS`. Slow imports are placed inside functions.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import typer

from . import analyses as analyses
from . import model_files as model_files
from . import run as run
from . import study as study
from . import view as view
from .application import app

COMMANDS = (
    *("run", "check", "view", "convert", "live", "new", "fmt", "schema", "compare", "kinematics", "inverse-dynamics"),
    *("mobility", "singularities", "equilibrium", "equilibria", "linearize", "modes", "root-locus"),
    *("study", "optimize", "sensitivity", "equations", "export", "compile"),
)
"""Every subcommand, in the order of ``flyball --help``."""
app.registered_commands.sort(key=lambda c: COMMANDS.index(c.name or c.callback.__name__))  # type: ignore[union-attr]


def main(argv: Sequence[str] | None = None) -> None:
    """Entry point of the command."""
    app(args=None if argv is None else list(argv), prog_name="flyball")


def _version(requested: bool) -> None:
    if requested:
        from .. import __version__

        typer.echo(f"flyball {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Rigid-body mechanisms: run, check and view them."""
