"""``flyball sensitivity``: derivatives by parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .common import Changes, Json, Model, app, print_json, reported, table
from .loading import load_mechanism, set_parameters
from .progress import announce_compiling


@app.command()
def sensitivity(
    model: Model,
    of: Annotated[
        list[str] | None, typer.Option(help="A curve or sensor, e.g. --of slider.x; may be repeated.")
    ] = None,
    to: Annotated[list[str] | None, typer.Option(help="A parameter; all of the model's if none is given.")] = None,
    analysis: Annotated[str, typer.Option(help="instant, motion, equilibrium or modes (eigenvalues).")] = "instant",
    t: Annotated[str, typer.Option("--t", help='Time, e.g. 0.1 or "100 ms".')] = "0",
    t_end: Annotated[str | None, typer.Option(help="End of a motion.")] = None,
    outputs: Annotated[int, typer.Option(help="Number of times of a motion.")] = 51,
    about: Annotated[str | None, typer.Option(help='"equilibrium" for modes about the static equilibrium.')] = None,
    verify: Annotated[bool, typer.Option("--verify", help="Also by central differences.")] = False,
    plot: Annotated[Path | None, typer.Option(help="Write a picture to a PNG, SVG or PDF file.")] = None,
    change: Changes = None,
    as_json: Json = False,
) -> None:
    """Derivatives of kinematics, reactions, equilibria, eigenvalues or a motion by parameters."""
    with reported(as_json):
        mechanism = load_mechanism(model)
        set_parameters(mechanism, change or [])
        announce_compiling(not as_json)
        found = mechanism.sensitivity(
            of or [], to or [], analysis=analysis, t=t, t_end=t_end, outputs=outputs, about=about, verify=verify
        )
        if plot is not None:
            found.plot(plot)
        if as_json:
            print_json(found.as_dict())
        else:
            table(found.lines())
