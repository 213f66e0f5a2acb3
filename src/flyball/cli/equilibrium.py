"""``flyball equilibrium``: where a mechanism rests, and whether it is stable there."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .common import Changes, Json, Model, Time, app, print_json, reported, seconds, table
from .loading import load_mechanism, set_parameters
from .progress import announce_compiling


@app.command()
def equilibrium(
    model: Model,
    stable: Annotated[
        bool, typer.Option("--stable", help="Go on from an unstable equilibrium to a stable one.")
    ] = False,
    preload: Annotated[
        list[str] | None,
        typer.Option(help="Force to which is added what holds the mechanism where it is drawn; may be repeated."),
    ] = None,
    t: Time = "0",
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Page (.html) that shows the mechanism there.")
    ] = None,
    change: Changes = None,
    as_json: Json = False,
) -> None:
    """Find a static equilibrium near the mechanism as drawn, and say whether it is stable."""
    with reported(as_json):
        mechanism = load_mechanism(model)
        set_parameters(mechanism, change or [])
        announce_compiling(not as_json, "motion_kernel", "residual_kernel")
        found = mechanism.equilibrium(t=seconds(t, "--t"), stable=stable, preload=preload or ())
        files = []
        if out is not None:
            found.to_html(out)
            files.append(str(out))
        if as_json:
            print_json({"name": mechanism.name} | found.as_dict() | {"files": files})
        else:
            table([*found.lines(), *(("written", f) for f in files)])
