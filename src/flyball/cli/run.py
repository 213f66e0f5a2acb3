"""Subcommands that compute motions: ``run``, ``live``, ``compare``, ``kinematics`` and ``inverse-dynamics``."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from ..errors import Interrupted, ModelError, SimulationError, SingularityError
from ..mechanism_methods import MotionMethods
from .application import (
    FAILED,
    INTERRUPTED,
    OutputFolder,
    PlotFile,
    exit_with_error,
    make_folder,
    print_json,
    print_table,
    with_option_names,
)
from .options import OptionOverride, read_assignments, read_steps, read_values, refuse_duplicate
from .subcommand import Request, command

if TYPE_CHECKING:
    from ..results.result import Result


STEPPING = "Impulse time stepping (--method impulse): "
Solver = Annotated[
    str | None,
    typer.Option(
        help=f"{STEPPING}solver of the cone problem: auto, gauss-seidel, newton, jacobi, barzilai-borwein, apgd, "
        "apgd-lean, admm, pyramid, lcp. [auto if not given]"
    ),
]
Iterations = Annotated[int | None, typer.Option(help=f"{STEPPING}largest number of iterations of a velocity solve.")]
Tolerance = Annotated[float | None, typer.Option(help=f"{STEPPING}residual [m/s] at which iterations stop.")]
Directions = Annotated[int | None, typer.Option(help=f"{STEPPING}edges of the pyramid of --solver pyramid, lcp. [8]")]
Coulomb = Annotated[
    bool | None, typer.Option(help=f"{STEPPING}Coulomb's law, or its convex approximation. [Coulomb's law]")
]
HistorySteps = Annotated[
    str | None,
    typer.Option(
        help=f"{STEPPING}steps whose residuals over the iterations are kept, and drawn in residuals.png: all, 10 "
        "(every tenth step), or 0.5,0.6 (range of time)."
    ),
]
MAX_CSV_NUMBERS = 5_000_000  # above this size the table is not written: such a file is of no use


@command(
    MotionMethods.simulate,
    name="run",
    overrides={"t_end": OptionOverride(default="10"), "checkpoint": OptionOverride(type=Path)},
)
def run(
    request: Request,
    *,
    out: OutputFolder = None,
    plots: Annotated[
        bool | None, typer.Option(help="Write pictures (PNG); by default if there is no report, which has all curves.")
    ] = None,
    no_animation: Annotated[bool, typer.Option("--no-animation", help="Write no animation page.")] = False,
    spectrum: Annotated[
        list[str] | None,
        typer.Option(help='Curve or sensor, such as "A.rate", of which spectrum.png is drawn; may be repeated.'),
    ] = None,
    save: Annotated[
        list[Path] | None,
        typer.Option(help="Write one more file, by its ending, as flyball convert does; may be repeated."),
    ] = None,
    report: Annotated[
        bool | None, typer.Option(help="Write the report; by default unless there is to be no animation.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")] = False,
    solver: Solver = None,
    iterations: Iterations = None,
    tolerance: Tolerance = None,
    directions: Directions = None,
    coulomb: Coulomb = None,
    history: HistorySteps = None,
) -> None:
    """Write report.html, animation.html, result.csv and result.nc; pictures into plots/ on request."""
    steps = None if history is None else read_steps(history, "s", "--history")
    choose_stepping(
        request, solver=solver, iterations=iterations, tolerance=tolerance, directions=directions, coulomb=coulomb,
        history=steps,
    )  # fmt: skip
    talk, error = not (request.as_json or quiet), None
    try:
        result = request.run_analysis(progress=talk)
    except SimulationError as stopped:
        if stopped.result is None:
            raise
        result, error = cast("Result", stopped.result), stopped
    except Interrupted as ended:
        result = ended.result
    reported = not no_animation if report is None else report
    pages = {"report.html": reported, "animation.html": not no_animation}
    folder = out if out is not None else Path(f"{request.source.stem}-result")
    wanted = [name for name, asked_for in pages.items() if asked_for]
    files, notes = _write_run_files(result, folder, not reported if plots is None else plots, wanted)
    for path in save or ():
        result.save(path)
        files.append(path)
    if steps is not None and result.contacts is not None and result.contacts.history:
        result.contacts.history.plot(folder / "residuals.png")
        files.append(folder / "residuals.png")
    if spectrum and len(result.t):
        found = result.spectrum(*spectrum)
        found.plot(folder / "spectrum.png")
        files.append(folder / "spectrum.png")
        notes += [f"spectrum of {label}: {text}" for label, text in found.lines() if label in found.names]
    _print_summary(result, error, files, notes, request.as_json, talk)


def choose_stepping(request: Request, **options: object) -> None:
    """Make the method impulse time stepping with the options that were given, and the step.

    Raises
    ------
    ModelError
        If they are given with another method, or one of them is wrong.
    """
    from ..simulation.integration_options import Stepping

    options = {k: x for k, x in options.items() if x is not None}
    given = request.given
    if given.get("method") == "impulse":
        step = {"step": given.pop("step")} if "step" in given else {}
        given["method"] = Stepping(**step, **options)  # type: ignore[arg-type]
    elif options:
        raise ModelError(
            f"--{next(iter(options))} is an option of impulse time stepping: give --method impulse with it"
        )


def _print_summary(
    result: Result, error: SimulationError | None, files: list[Path], notes: list[str], as_json: bool, talk: bool
) -> None:
    """Print a summary of the run, and end with the appropriate exit code."""
    summary = {
        "name": result.model.name,
        "success": result.health.success,
        "message": result.health.message,
        "ended_early": result.health.ended_early,
        "doubtful": list(result.health.doubtful),
        "t": float(result.t[-1]) if len(result.t) else None,
        "health": result.health.as_dict(),
        "files": [str(f) for f in files],
        "notes": notes,
    }
    if talk:
        lines = result.health.lines()
        if error is not None:
            lines[0] = ("status", f"stopped at t = {error.t:.6g} s")
        page = [("open this", str(f)) for f in files if f.name == "report.html"]
        if len(result.events):
            typer.echo(f"{result.events!r}\n")
        print_table([*lines, *(("written", str(f)) for f in files), *(("note", n) for n in notes), *page])
    if error is not None:
        exit_with_error(str(error), type(error).__name__, FAILED, as_json, summary)
    if as_json:
        print_json(summary)
    if not result.health.success:
        raise typer.Exit(INTERRUPTED)


def _write_run_files(result: Result, folder: Path, plots: bool, pages: Sequence[str]) -> tuple[list[Path], list[str]]:
    """Write all files of a result; return them, and remarks on files that were left out."""
    files, notes = [], []
    make_folder(folder)

    def keep(name: str, write: Callable[[Path], None]) -> None:
        write(folder / name)
        files.append(folder / name)

    keep("result.nc", result.save)
    curves = 8 * len(result.model.bodies) + 5 * len(result.model.joints)
    if curves * len(result.t) <= MAX_CSV_NUMBERS:
        keep("result.csv", result.to_csv)
    else:
        notes.append(f"result.csv is left out: some {curves} curves at {len(result.t)} times; read result.nc instead")
    if not len(result.t):
        notes.append("no output time was reached: there is nothing to plot")
        return files, notes
    if plots:
        from ..view.result_plots import write_standard_plots

        make_folder(folder / "plots")
        files += write_standard_plots(result, folder / "plots")
    for name in pages:
        keep(name, result.to_report if name == "report.html" else result.to_html)
    return files, notes


COMPARE_OPTIONS = {"t_end": OptionOverride(default="10"), "formulations": OptionOverride(names=("--only",))}


@command(MotionMethods.compare, overrides=COMPARE_OPTIONS)
def compare(request: Request, *, plot: PlotFile = None) -> None:
    """Print a table; --plot draws curves and bars."""
    result = request.run_analysis()
    request.write(plot, result.plot)
    request.print_result(result)


DEFAULT_END = "1"  # end of the motion [s] if nothing specifies it
TIME_OPTIONS = {
    "times": OptionOverride(names=("--outputs", "--times")),
    "t_end": OptionOverride(default_text=DEFAULT_END),
}


@command(MotionMethods.kinematics, overrides=TIME_OPTIONS)
def kinematics(
    request: Request,
    *,
    point: Annotated[
        list[str] | None, typer.Option(help='Body, frame, or "body:x,y" whose path is plotted; may be repeated.')
    ] = None,
    out: OutputFolder = None,
) -> None:
    """Write result.csv, result.nc and paths.png."""
    set_default_end(request)
    try:
        result = request.run_analysis()
    except SingularityError as error:
        more = {"t": error.where, "elements": list(error.elements)}
        exit_with_error(str(error), type(error).__name__, FAILED, request.as_json, more)
    folder = request.folder(out, "kinematics")
    request.write(folder / "result.csv", result.to_csv)
    request.write(folder / "result.nc", result.save)
    request.write(folder / "paths.png", lambda path: result.plot_path(*map(read_point, point or []), path=path))
    request.print_result(result.health, {"name": request.mechanism.name, "times": len(result.t),
                              "t": result.t[[0, -1]].tolist(), "health": result.health.as_dict()})  # fmt: skip


def set_default_end(request: Request) -> None:
    """Set the end to one second if a number of times is given without an end."""
    if not isinstance(request.given.get("times"), list):
        request.given.setdefault("t_end", DEFAULT_END)


def read_point(text: str) -> str | tuple[str, list[float]]:
    """Parse a point of the command line: a name, or ``body:x,y``."""
    name, colon, rest = text.partition(":")
    return (name, read_values(rest, "m", "--point")) if colon else text


MOTION_OPTION = OptionOverride(
    type=list[str],
    read=read_assignments,
    help='How a coordinate moves: --motion "A.angle=0.3*sin(2*t)"; may be repeated.',
)


@command(MotionMethods.inverse_dynamics, overrides={**TIME_OPTIONS, "motion": MOTION_OPTION})
def inverse_dynamics(request: Request, *, out: OutputFolder = None) -> None:
    """Write inverse_dynamics.csv, inverse_dynamics.png and result.nc."""
    set_default_end(request)
    found = request.run_analysis()
    folder = request.folder(out, "inverse-dynamics")
    request.write(folder / "inverse_dynamics.csv", found.to_csv)
    request.write(folder / "inverse_dynamics.png", found.plot)
    request.write(folder / "result.nc", found.result.save)
    request.print_result(found)


def _read_ranges(texts: Sequence[str], unit: str, flag: str) -> dict[str, tuple[float | str, float | str]]:
    """Parse ranges, each written as ``name=least:largest``."""
    out: dict[str, tuple[float | str, float | str]] = {}
    for text in texts:
        name, equals, ends = (x.strip() for x in text.partition("="))
        low, colon, high = (x.strip() for x in ends.partition(":"))
        if not (equals and colon and low and high):
            raise ModelError(f"{flag} {text!r}: write name=least:largest, for instance {flag} 'speed=30 rpm:90 rpm'")
        refuse_duplicate(out, name, flag, text)
        out[name] = (_number_or_quantity(low), _number_or_quantity(high))
    return out


def _number_or_quantity(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


RANGES = OptionOverride(
    type=list[str],
    read=_read_ranges,
    names=("--range",),
    help="Range of a slider: --range 'speed=30 rpm:90 rpm'; may be repeated. Others are chosen about the value.",
)


@command(MotionMethods.live, overrides={"ranges": RANGES})
def live(request: Request) -> None:
    """Ctrl-C ends it. An edit of the model file is shown at once."""
    from ..live.options import LiveOptions
    from ..live.server import serve_model

    usual = {k: p.default for k, p in inspect.signature(MotionMethods.live).parameters.items() if k != "self"}
    o = LiveOptions.from_arguments(usual | request.given)

    def show(address: str, note: str) -> None:
        if request.as_json:
            print_json({"address": address})
        else:
            typer.echo(f"{address}\n{note}")

    serve_model(request.load, o, show, request.source, with_option_names)
