"""``flyball study``: many runs at different values of parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import Interrupted, ModelError
from ..methods.design import Design
from .asking import Asked, command
from .common import FAILED, INTERRUPTED, Plot, table
from .flags import MANY, Flag, once, values


def _varied(texts: list[str], unit: str, flag: str) -> dict[str, Any]:
    """name=values (0,1,2 or first:last:how many), name=low:high or name=distribution."""
    out: dict[str, Any] = {}
    for text in texts:
        name, equals, told = (x.strip() for x in text.partition("="))
        if not equals or not told:
            raise ModelError(
                f"{flag} {text!r}: write name=values, for instance {flag} k=1e3:1e5:20; for samples name=low:high or "
                f"name=normal(mean, sd)"
            )
        once(out, name, flag, text)
        if "(" in told:
            out[name] = told
        elif told.count(MANY) == 1:
            out[name] = tuple(x.strip() for x in told.split(MANY))
        else:
            out[name] = values(told, "", flag) if MANY in told else [x.strip() for x in told.split(",")]
    return out


OWN = {
    "vary": Flag(
        type=list[str],
        read=_varied,
        help="A parameter and its values, --vary k=1e3:1e5:20 or k=1,2,5; of samples --vary k=1e3:1e5 or "
        "'k=normal(2e3, 100)'. May be repeated.",
    ),
    "analysis": Flag(
        type=str, help="What each run is: motion (if not given), kinematics, instant, equilibrium, modes or linearize."
    ),
    "of": Flag(
        type=list[str],
        help="A curve, or a number of one: --of 'max(slider.x)', end, min, mean, rms; of modes 'frequency[0]'; of "
        "linearize 'gain(slider.x, push)'. May be repeated.",
    ),
    "file": Flag(type=Path, names=("--file", "-o")),
}


@command(Design.study, own=OWN, without=("executor",))
def study(
    asked: Asked,
    *,
    csv: Annotated[Path | None, typer.Option("--csv", help="Write a table with a row for each run.")] = None,
    plot: Plot = None,
    histogram: Annotated[Path | None, typer.Option(help="Write how often values occur to a picture.")] = None,
) -> None:
    """Print how the quantities spread; with --file the study can be interrupted, and the same command goes on."""
    try:
        found = asked.answer()
    except Interrupted as ended:
        found = ended.result
    if "file" in asked.given:
        asked.files.append(str(asked.given["file"]))
    asked.write(csv, found.to_csv)
    asked.write(plot, lambda path: found.plot(path=path))
    asked.write(histogram, lambda path: found.histogram(path=path))
    if found.design == "saltelli" and not asked.as_json:
        table(found.indices().lines())
    asked.say(found)
    if not found.complete:
        raise typer.Exit(INTERRUPTED)
    if not found.done.any():
        raise typer.Exit(FAILED)
