"""``flyball kinematics``: the motion that drivers prescribe."""

from __future__ import annotations

from typing import Annotated

import typer

from ..errors import SingularityError
from ..methods.motion import Motions
from .asking import Asked, command
from .common import FAILED, Out, fail
from .flags import Flag, values

ONE = "1"  # s, the end of the motion if nothing says when
TIMES = {"times": Flag(names=("--outputs", "--times")), "t_end": Flag(shown=ONE)}


@command(Motions.kinematics, own=TIMES)
def kinematics(
    asked: Asked,
    *,
    point: Annotated[
        list[str] | None, typer.Option(help='Body, frame, or "body:x,y" whose path is drawn; may be repeated.')
    ] = None,
    out: Out = None,
) -> None:
    """Write result.csv, result.nc and paths.png."""
    to_the_end(asked)
    try:
        result = asked.answer()
    except SingularityError as error:
        more = {"t": error.where, "elements": list(error.elements)}
        fail(str(error), type(error).__name__, FAILED, asked.as_json, more)
    folder = asked.folder(out, "kinematics")
    asked.write(folder / "result.csv", result.to_csv)
    asked.write(folder / "result.nc", result.save)
    asked.write(folder / "paths.png", lambda path: result.plot_path(*map(asked_point, point or []), path=path))
    asked.say(result.health, {"name": asked.mechanism.name, "times": len(result.t), "t": result.t[[0, -1]].tolist(),
                              "health": result.health.as_dict()})  # fmt: skip


def to_the_end(asked: Asked) -> None:
    """A number of times without an end goes on for a second."""
    if not isinstance(asked.given.get("times"), list):
        asked.given.setdefault("t_end", ONE)


def asked_point(text: str) -> str | tuple[str, list[float]]:
    """A point from the command line: a name, or ``body:x,y``."""
    name, colon, rest = text.partition(":")
    return (name, values(rest, "m", "--point")) if colon else text
