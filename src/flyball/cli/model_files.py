"""Subcommands for the text of model files: their ``schema`` for editors."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from .application import app, report_errors


@app.command(short_help="Print the JSON schema of model files, for editors.")
def schema(
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Write it to a file (.json).")] = None,
) -> None:
    """Print the JSON schema (draft 2020-12) of model files, by which editors complete, explain and check them."""
    with report_errors(False):
        from ..mechanism import Mechanism
        from ..model.model_schema import model_schema
        from ..model.output_files import SCHEMA, file_extension, write_file

        text = json.dumps(model_schema(Mechanism), indent=1)
        if out is None:
            typer.echo(text)
        else:
            file_extension(out, SCHEMA)
            write_file(out, text + "\n")
            typer.echo(f"{out} is written; name it in the first line of a model file: #:schema ./{out.name}")
