"""Subcommands for the text of model files: their ``schema`` for editors, their layout (``fmt``)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from .application import OTHER_LAYOUT, app, report_errors


@app.command(short_help="Print the JSON schema of model files, for editors.")
def schema(
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Write it to a file (.json), such as flyball.schema.json.")
    ] = None,
) -> None:
    """Print the JSON schema (draft 2020-12) of model files, by which editors complete, explain and check them."""
    with report_errors(False):
        from ..mechanism import Mechanism
        from ..model.json_schema import model_schema
        from ..model.output_files import SCHEMA, file_extension, write_file

        text = json.dumps(model_schema(Mechanism), indent=1)
        if out is None:
            typer.echo(text)
        else:
            file_extension(out, SCHEMA)
            write_file(out, text + "\n")
            typer.echo(f"{out} is written; name it in the first line of a model file: #:schema ./{out.name}")


@app.command(name="fmt", short_help="Bring model files into the layout of flyball new.")
def format_files(
    files: Annotated[list[Path], typer.Argument(help="Model files (.toml).", metavar="MODEL")],
    check: Annotated[
        bool, typer.Option("--check", help="Write nothing; exit with 1 if a file has another layout.")
    ] = False,
) -> None:
    """Bring model files into the layout of flyball new; the models and their comments remain the same.

    It arranges tables, spaces, indentation and the columns of comments. Numbers and texts keep their spelling.
    """
    with report_errors(False):
        from ..model.model_files import read_text
        from ..model.model_layout import formatted
        from ..model.output_files import DESCRIPTION, file_extension, write_file

        other = False
        for file in files:
            file_extension(file, DESCRIPTION)
            text = read_text(file)
            new = formatted(text, str(file))
            if new != text:
                other = True
                if not check:
                    write_file(file, new)
                typer.echo(f"{file} {'has another layout' if check else 'is rewritten'}")
        if check and other:
            raise typer.Exit(OTHER_LAYOUT)
