"""``flyball singularities``: where a driven mechanism locks up, branches, or moves by itself."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import ModelError
from .common import Changes, Json, Model, app, print_json, reported, table
from .loading import load_mechanism, set_parameters
from .progress import announce_compiling


@app.command()
def singularities(
    model: Model,
    driver: Annotated[str, typer.Argument(help="Name of the driver whose coordinate is varied.")],
    ends: Annotated[
        tuple[str, str], typer.Option("--range", help='From and to, e.g. --range 0 6.28 or --range "0 deg" "360 deg".')
    ],
    branch: Annotated[
        str | None,
        typer.Option(help="Then go on along a branch: POINT.BRANCH of the table, points from 1, branches from 0."),
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Write pictures of the positions to a PNG, SVG or PDF file.")
    ] = None,
    brief: Annotated[bool, typer.Option("--table", help="One line a position.")] = False,
    change: Changes = None,
    as_json: Json = False,
) -> None:
    """Find the singular positions over a range of a driver: passages, lock-ups, bifurcations, self-motions."""
    with reported(as_json):
        mechanism = load_mechanism(model)
        set_parameters(mechanism, change or [])
        announce_compiling(not as_json)
        result = mechanism.singularities(driver, ends)
        if branch is not None:
            result = mechanism.singularities(driver, ends, branch=_branch(result, branch))
        if plot is not None:
            result.plot(plot)
        if as_json:
            print_json(result.as_dict())
        elif brief:
            typer.echo(result.table())
        else:
            table(result.lines())


def _branch(result, text: str):
    """The branch that POINT.BRANCH means."""
    first, _, second = text.partition(".")
    try:
        point, k = int(first) - 1, int(second or "0")
        if point < 0 or k < 0:
            raise IndexError
        return result[point].branches[k]
    except (ValueError, IndexError):
        there = ", ".join(f"{i + 1}.{k}" for i, p in enumerate(result) for k in range(len(p.branches))) or "none"
        raise ModelError(f"--branch {text!r}: there is no such branch; there are {there}") from None
