"""``flyball compile``: everything that is compiled on first use, now."""

from __future__ import annotations

import time

import typer

from .common import app, reported


@app.command(name="compile")
def compile_kernels() -> None:
    """Compile everything that would be compiled on first use, on all cores, and keep it for this user."""
    with reported(False):
        from ..compiler.ahead import compile_all
        from ..compiler.store import cache_folder

        began = time.monotonic()

        def progress(name: str, done: int, total: int) -> None:
            rest = (time.monotonic() - began) / done * (total - done)
            typer.echo(f"{done} of {total}: {name.removeprefix('flyball.')}, about {rest:.0f} s left", err=True)

        count = compile_all(progress=progress)
        what = (
            f"{count} kernels compiled in {time.monotonic() - began:.0f} s" if count else "nothing was to be compiled"
        )
        typer.echo(f"{what}; they are in {cache_folder()}")
