"""``flyball compare``: one motion by several formulations of its equations."""

from __future__ import annotations

from ..methods.motion import Motions
from .asking import Asked, command
from .common import Plot
from .flags import Flag

OWN = {"t_end": Flag(default="10"), "formulations": Flag(names=("--only",))}


@command(Motions.compare, own=OWN)
def compare(asked: Asked, *, plot: Plot = None) -> None:
    """Print a table; --plot draws curves and bars."""
    result = asked.answer()
    asked.write(plot, result.plot)
    asked.say(result)
