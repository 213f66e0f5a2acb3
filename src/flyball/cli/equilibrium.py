"""Subcommands on equilibrium and small motions: equilibrium, equilibria, linearize, root-locus and modes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import ModelError
from ..mechanism_methods import StaticsMethods
from .application import AboutEquilibrium, PageFile, PlotFile, SteadyTurning
from .options import OptionOverride
from .subcommand import Request, command


@command(StaticsMethods.equilibrium, without=("start",))
def equilibrium(request: Request, *, out: PageFile = None) -> None:
    """Print the equilibrium position; --out writes a picture of it."""
    found = request.run_analysis()
    request.write(out, found.result.to_html)
    request.print_result(found)


@command(StaticsMethods.equilibria, without=("start",))
def equilibria(request: Request, *, plot: PlotFile = None) -> None:
    """Print the series of equilibria and its jumps."""
    found = request.run_analysis()
    request.write(plot, lambda path: found.plot(path=path))
    request.print_result(found)


LINEARIZE_OPTIONS = {"inputs": OptionOverride(names=("--input",)), "outputs": OptionOverride(names=("--output",))}


@command(StaticsMethods.linearize, overrides=LINEARIZE_OPTIONS)
def linearize(
    request: Request,
    *,
    equilibrium: AboutEquilibrium = False,
    turning: SteadyTurning = None,
    bode: Annotated[
        Path | None, typer.Option(help="Write the Bode plot of all outputs by the only input: PNG, SVG or PDF.")
    ] = None,
) -> None:
    """Print states and matrices."""
    if bode is not None and (len(request.given.get("inputs", ())) != 1 or not request.given.get("outputs")):
        raise ModelError("--bode draws outputs over one input: give one --input, and one --output or more")
    request.rest(equilibrium, turning)
    linear = request.run_analysis()
    request.write(bode, lambda path: linear.bode(path=path))
    request.print_result(linear)


@command(StaticsMethods.root_locus)
def root_locus(request: Request, *, plot: PlotFile = None) -> None:
    """Print the eigenvalues for every value, and the values at which one crosses the imaginary axis."""
    found = request.run_analysis()
    request.write(plot, found.plot)
    request.print_result(found)


@command(StaticsMethods.modes)
def modes(
    request: Request,
    *,
    equilibrium: AboutEquilibrium = False,
    turning: SteadyTurning = None,
    out: PageFile = None,
    plot: PlotFile = None,
) -> None:
    """Print a table of modes; --out writes an animation, --plot draws the eigenvalues."""
    request.rest(equilibrium, turning)
    found = request.run_analysis()
    request.write(out, found.to_html)
    request.write(plot, found.plot)
    request.print_result(found, {"name": request.mechanism.name} | found.as_dict())
