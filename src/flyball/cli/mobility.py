"""Subcommands about mobility: ``check``, ``mobility`` and ``singularities``."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from ..errors import ModelError
from ..mechanism_methods import MobilityMethods
from .application import PlotFile
from .options import OptionOverride
from .subcommand import Request, command


@command(MobilityMethods.check)
def check(request: Request) -> None:
    """Print the report."""
    request.print_result(request.run_analysis())


@command(MobilityMethods.mobility)
def mobility(request: Request) -> None:
    """Print degrees of freedom and sets of redundant constraints."""
    request.print_result(request.run_analysis())


RANGE_OPTION = OptionOverride(
    type=tuple[str, str], help='From and to, e.g. --range 0 6.28 or --range "0 deg" "360 deg".'
)


@command(MobilityMethods.singularities, overrides={"range": RANGE_OPTION}, without=("branch",))
def singularities(
    request: Request,
    *,
    branch: Annotated[
        str | None,
        typer.Option(help="Then follow a branch: POINT.BRANCH of the table, points from 1, branches from 0."),
    ] = None,
    plot: PlotFile = None,
    brief: Annotated[bool, typer.Option("--table", help="One line a position.")] = False,
) -> None:
    """Print singular positions, classified as passages, lock-ups, bifurcations and self-motions."""
    result = request.run_analysis()
    if branch is not None:
        result = request.run_analysis(branch=_find_branch(result, branch))
    request.write(plot, result.plot)
    if brief and not request.as_json:
        typer.echo(result.table())
    else:
        request.print_result(result)


def _find_branch(result: Any, text: str) -> Any:
    """Return the branch with the number POINT.BRANCH."""
    first, _, second = text.partition(".")
    try:
        point, k = int(first) - 1, int(second or "0")
        if point < 0 or k < 0:
            raise IndexError
        return result[point].branches[k]
    except (ValueError, IndexError):
        there = ", ".join(f"{i + 1}.{k}" for i, p in enumerate(result) for k in range(len(p.branches))) or "none"
        raise ModelError(f"--branch {text!r}: there is no such branch; there are {there}") from None
