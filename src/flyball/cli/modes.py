"""``flyball modes``: frequencies, damping and shapes of natural motions."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .common import Changes, Json, Model, Resting, Time, app, print_json, reported, seconds, table
from .loading import load_mechanism, set_parameters
from .progress import announce_compiling


@app.command()
def modes(
    model: Model,
    equilibrium: Resting = False,
    count: Annotated[int | None, typer.Option(help="How many, slowest first; by default all of them.")] = None,
    t: Time = "0",
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Page (.html) in which the modes move.")] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Write the eigenvalues in the complex plane: PNG, SVG or PDF.")
    ] = None,
    change: Changes = None,
    as_json: Json = False,
) -> None:
    """List modes about an equilibrium or a steady motion, and write a page in which they move."""
    with reported(as_json):
        mechanism = load_mechanism(model)
        set_parameters(mechanism, change or [])
        announce_compiling(not as_json, "motion_kernel", "residual_kernel")
        when = seconds(t, "--t")
        about = mechanism.equilibrium(t=when) if equilibrium else None
        found = mechanism.modes(about=about, t=when, count=count)
        files = []
        for path, write in ((out, found.to_html), (plot, found.plot)):
            if path is not None:
                write(path)
                files.append(str(path))
        if as_json:
            print_json({"name": mechanism.name} | found.as_dict() | {"files": files})
        else:
            table([*found.lines(), *(("written", f) for f in files)])
