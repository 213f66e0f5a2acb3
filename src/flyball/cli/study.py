"""Subcommands that vary parameters: ``study``, ``optimize`` and ``sensitivity``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import Interrupted, ModelError
from ..mechanism_methods import DesignMethods
from .application import FAILED, INTERRUPTED, PlotFile, print_table
from .options import RANGE_SEPARATOR, OptionOverride, read_quantity, read_values, refuse_duplicate
from .subcommand import Request, command


def _read_variations(texts: list[str], unit: str, flag: str) -> dict[str, Any]:
    """Parse variations: name=values (0,1,2 or first:last:count), name=low:high or name=distribution."""
    out: dict[str, Any] = {}
    for text in texts:
        name, equals, told = (x.strip() for x in text.partition("="))
        if not equals or not told:
            raise ModelError(
                f"{flag} {text!r}: write name=values, for instance {flag} k=1e3:1e5:20; for samples name=low:high or "
                f"name=normal(mean, sd)"
            )
        refuse_duplicate(out, name, flag, text)
        if "(" in told:
            out[name] = told
        elif told.count(RANGE_SEPARATOR) == 1:
            out[name] = tuple(x.strip() for x in told.split(RANGE_SEPARATOR))
        else:
            out[name] = read_values(told, "", flag) if RANGE_SEPARATOR in told else [x.strip() for x in told.split(",")]
    return out


STUDY_OPTIONS = {
    "vary": OptionOverride(
        type=list[str],
        read=_read_variations,
        help="A parameter and its values, --vary k=1e3:1e5:20 or k=1,2,5; of samples --vary k=1e3:1e5 or "
        "'k=normal(2e3, 100)'. May be repeated.",
    ),
    "analysis": OptionOverride(
        type=str, help="What each run is: motion (if not given), kinematics, instant, equilibrium, modes or linearize."
    ),
    "of": OptionOverride(
        type=list[str],
        help="A curve, or a number of one: --of 'max(slider.x)', end, min, mean, rms; of modes 'frequency[0]'; of "
        "linearize 'gain(slider.x, push)'. May be repeated.",
    ),
    "file": OptionOverride(type=Path, names=("--file", "-o")),
}


@command(DesignMethods.study, overrides=STUDY_OPTIONS, without=("executor",))
def study(
    request: Request,
    *,
    csv: Annotated[Path | None, typer.Option("--csv", help="Write a table with a row for each run.")] = None,
    plot: PlotFile = None,
    histogram: Annotated[Path | None, typer.Option(help="Write how often values occur to a picture.")] = None,
) -> None:
    """Print how the quantities vary; a study with --file can be interrupted and continued by the same command."""
    try:
        found = request.run_analysis()
    except Interrupted as ended:
        found = ended.result
    if "file" in request.given:
        request.files.append(str(request.given["file"]))
    request.write(csv, found.to_csv)
    request.write(plot, lambda path: found.plot(path=path))
    request.write(histogram, lambda path: found.histogram(path=path))
    if found.design == "saltelli" and not request.as_json:
        print_table(found.indices().lines())
    request.print_result(found)
    if not found.complete:
        raise typer.Exit(INTERRUPTED)
    if not found.done.any():
        raise typer.Exit(FAILED)


def _read_bounds(texts: list[str], unit: str, flag: str) -> dict[str, tuple[str | None, str | None]]:
    """Parse bounds: name, or name=low:high with either limit left out."""
    out: dict[str, tuple[str | None, str | None]] = {}
    for text in texts:
        name, equals, bounds = text.partition("=")
        low, colon, high = bounds.partition(":")
        if equals and not colon:
            raise ModelError(f"{flag} {text!r}: write name=low:high, for instance {flag} crank=0.1:0.3")
        refuse_duplicate(out, name.strip(), flag, text)
        out[name.strip()] = (low.strip() or None, high.strip() or None)
    return out


OPTIMIZE_OPTIONS = {
    "to": OptionOverride(
        type=list[str], read=_read_bounds, help="A parameter, with bounds if wanted: --to crank=0.1:0.3."
    ),
    "target": OptionOverride(
        type=list[str],
        help="What each quantity should be, in SI units or with a unit; or a CSV file with a column for each.",
    ),
    "weights": OptionOverride(type=str, read=read_values, help="A weight for each quantity, as 1,0.5."),
}


@command(DesignMethods.optimize, overrides=OPTIMIZE_OPTIONS, without=("minimize",))
def optimize(request: Request) -> None:
    """Print the best parameters."""
    goal = _read_target(request.given.pop("target", []), len(request.given["of"]))
    if request.given.get("analysis") == "motion":
        request.given.setdefault("outputs", len(goal))
    request.print_result(request.run_analysis(target=goal))


def _read_target(texts: list[str], count: int) -> Any:
    """Parse target values: numbers, or the columns of a file; shape (times, quantities)."""
    import numpy as np

    if len(texts) == 1 and Path(texts[0]).suffix.lower() == ".csv":
        try:
            found = np.genfromtxt(texts[0], delimiter=",", ndmin=2)
        except (OSError, ValueError) as error:
            raise ModelError(f"cannot read {texts[0]!r}: {error}") from None
        found = found[~np.isnan(found).all(axis=1)]  # header line
        if found.shape[1] != count or not len(found) or np.isnan(found).any():
            raise ModelError(f"{texts[0]!r} needs a column of numbers for each of the {count} quantities")
        return found
    if len(texts) != count:
        raise ModelError(f"{count} quantities need as many targets, got {len(texts)}")
    return np.array([[read_quantity(x, "", "--target") for x in texts]])


@command(DesignMethods.sensitivity)
def sensitivity(request: Request, *, plot: PlotFile = None) -> None:
    """Print the derivatives."""
    found = request.run_analysis()
    request.write(plot, found.plot)
    request.print_result(found)
