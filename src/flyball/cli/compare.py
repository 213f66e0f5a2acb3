"""``flyball compare``: one motion by several formulations of its equations."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .common import Changes, Json, Model, app, print_json, reported, seconds, table
from .loading import load_mechanism, set_parameters
from .progress import progress_bar


@app.command()
def compare(
    model: Model,
    t_end: Annotated[str, typer.Option(help='End of the motion, e.g. 10 or "500 ms".')] = "10",
    outputs: Annotated[int, typer.Option(help="Number of times at which drift is looked at.")] = 201,
    only: Annotated[list[str] | None, typer.Option(help="A formulation; give it once for each.")] = None,
    repeats: Annotated[int, typer.Option(help="Runs of each for its cost; 0 for none.")] = 5,
    rtol: Annotated[float | None, typer.Option(help="Relative tolerance.")] = None,
    atol: Annotated[float | None, typer.Option(help="Absolute tolerance.")] = None,
    method: Annotated[str | None, typer.Option(help="Integration method.")] = None,
    rates: Annotated[
        tuple[float, float] | None, typer.Option(help="Baumgarte's alpha and beta [1/s].", metavar="ALPHA BETA")
    ] = None,
    plot: Annotated[Path | None, typer.Option(help="Write curves and bars to a PNG, SVG or PDF file.")] = None,
    change: Changes = None,
    as_json: Json = False,
) -> None:
    """Compare formulations of the same motion: Baumgarte, projections, partitioning, coordinates, solvers."""
    with reported(as_json):
        mechanism = load_mechanism(model)
        set_parameters(mechanism, change or [])
        end = seconds(t_end)
        chosen: dict[str, object] = {"rtol": rtol, "atol": atol, "method": method}
        if rates is not None:
            chosen |= {"alpha": rates[0], "beta": rates[1]}
        options = {k: v for k, v in chosen.items() if v is not None}
        with progress_bar(not as_json) as progress:
            result = mechanism.compare(
                end, outputs=outputs, formulations=only or None, repeats=repeats, progress=progress, **options
            )
        if plot is not None:
            result.plot(plot)
        if as_json:
            print_json(result.as_dict())
        else:
            table(result.lines())
