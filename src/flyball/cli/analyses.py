"""Subcommands about mobility, equilibrium and small motions, and symbolic equations: all but motions and studies."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import ModelError
from ..mechanism_methods import MobilityMethods, StaticsMethods, SymbolicMethods
from .application import AboutEquilibrium, OutputFolder, PageFile, PlotFile, SteadyTurning
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


@command(SymbolicMethods.symbolic, name="equations", overrides={"inputs": OptionOverride(names=("--input",))})
def equations(request: Request, *, out: OutputFolder = None) -> None:
    """Write equations.html (works offline) and equations.tex; print sizes and names."""
    found = request.run_analysis()
    folder = request.folder(out, "equations")
    request.write(folder / "equations.html", found.to_html)
    request.write(folder / "equations.tex", found.to_latex)
    request.print_result(found)


EXPORT_OPTIONS = {
    "functions": OptionOverride(names=("--function",)),
    "outputs": OptionOverride(names=("--output",)),
    "inputs": OptionOverride(names=("--input",)),
}


@command(SymbolicMethods.export, overrides=EXPORT_OPTIONS, without=("folder",))
def export(
    request: Request,
    *,
    out: Annotated[Path | None, typer.Option(help="Folder for the files; named after the model if not given.")] = None,
) -> None:
    """Print the functions with their arguments and lengths, and the files written."""
    code = request.run_analysis(folder=request.folder(out, "code"))
    request.files += [str(f) for f in code.files]
    request.print_result(code)
