"""``flyball linearize``, ``flyball root-locus``: linear equations of motion, and their eigenvalues over a parameter."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import ModelError
from ..methods.statics import Statics
from .asking import Asked, command
from .common import Plot, Resting, Turning
from .flags import Flag

OWN = {"inputs": Flag(names=("--input",)), "outputs": Flag(names=("--output",))}


@command(Statics.linearize, own=OWN)
def linearize(
    asked: Asked,
    *,
    equilibrium: Resting = False,
    turning: Turning = None,
    bode: Annotated[
        Path | None, typer.Option(help="Write the Bode plot of all outputs by the only input: PNG, SVG or PDF.")
    ] = None,
) -> None:
    """Print states and matrices."""
    if bode is not None and (len(asked.given.get("inputs", ())) != 1 or not asked.given.get("outputs")):
        raise ModelError("--bode draws outputs over one input: give one --input, and one --output or more")
    asked.rest(equilibrium, turning)
    linear = asked.answer()
    asked.write(bode, lambda path: linear.bode(path=path))
    asked.say(linear)


@command(Statics.root_locus)
def root_locus(asked: Asked, *, plot: Plot = None) -> None:
    """Print the eigenvalues at every value, and the values where one crosses the imaginary axis."""
    found = asked.answer()
    asked.write(plot, found.plot)
    asked.say(found)
