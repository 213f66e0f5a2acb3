"""``flyball singularities``: where a driven mechanism locks up, branches, or moves by itself."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from ..errors import ModelError
from ..methods.freedom import Freedom
from .asking import Asked, command
from .common import Plot
from .flags import Flag

RANGE = Flag(type=tuple[str, str], help='From and to, e.g. --range 0 6.28 or --range "0 deg" "360 deg".')


@command(Freedom.singularities, own={"range": RANGE}, without=("branch",))
def singularities(
    asked: Asked,
    *,
    branch: Annotated[
        str | None,
        typer.Option(help="Then go on along a branch: POINT.BRANCH of the table, points from 1, branches from 0."),
    ] = None,
    plot: Plot = None,
    brief: Annotated[bool, typer.Option("--table", help="One line a position.")] = False,
) -> None:
    """Passages, lock-ups, bifurcations and self-motions are told apart."""
    result = asked.answer()
    if branch is not None:
        result = asked.answer(branch=_branch(result, branch))
    asked.write(plot, result.plot)
    if brief and not asked.as_json:
        typer.echo(result.table())
    else:
        asked.say(result)


def _branch(result: Any, text: str) -> Any:
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
