"""The ``flyball`` command: one file a subcommand. Whatever takes long to import is imported where it is needed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import typer

from . import (  # noqa: F401  (each adds its subcommand)
    check,
    compare,
    compile,
    equations,
    equilibrium,
    export,
    inverse_dynamics,
    kinematics,
    linearize,
    mobility,
    modes,
    optimize,
    run,
    sensitivity,
    singularities,
    study,
    view,
)
from .common import app


def main(argv: Sequence[str] | None = None) -> None:
    """Entry point of the command."""
    app(args=None if argv is None else list(argv), prog_name="flyball")


def _version(wanted: bool) -> None:
    if wanted:
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
