"""``flyball run``: simulate, and write the motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from ..errors import Interrupted, SimulationError
from ..methods.motion import Motions
from .asking import Asked, command
from .common import FAILED, INTERRUPTED, Out, fail, make_folder, print_json, table
from .flags import Flag

if TYPE_CHECKING:
    from ..results.result import Result

CSV_NUMBERS = 5_000_000  # above, the table is left out: such a file is of no use


@command(Motions.simulate, name="run", own={"t_end": Flag(default="10"), "checkpoint": Flag(type=Path)})
def run(
    asked: Asked,
    *,
    out: Out = None,
    plots: Annotated[
        bool | None, typer.Option(help="Write pictures (PNG); by default if there is no report, which has all curves.")
    ] = None,
    no_animation: Annotated[bool, typer.Option("--no-animation", help="Write no animation page.")] = False,
    report: Annotated[
        bool | None, typer.Option(help="Write the report; by default unless there is to be no animation.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")] = False,
) -> None:
    """Write report.html, animation.html, result.csv and result.nc; pictures into plots/ where they are wanted."""
    talk, error = not (asked.as_json or quiet), None
    try:
        result = asked.answer(progress=talk)
    except SimulationError as stopped:
        if stopped.result is None:
            raise
        result, error = cast("Result", stopped.result), stopped
    except Interrupted as ended:
        result = ended.result
    reported = not no_animation if report is None else report
    pages = {"report.html": reported, "animation.html": not no_animation}
    folder = out if out is not None else Path(f"{asked.source.stem}-result")
    wanted = [name for name, asked_for in pages.items() if asked_for]
    files, notes = _write(result, folder, not reported if plots is None else plots, wanted)
    _conclude(result, error, files, notes, asked.as_json, talk)


def _conclude(
    result: Result, error: SimulationError | None, files: list[Path], notes: list[str], as_json: bool, talk: bool
) -> None:
    """Say what was done, and end with the right code."""
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
        table([*lines, *(("written", str(f)) for f in files), *(("note", n) for n in notes), *page])
    if error is not None:
        fail(str(error), type(error).__name__, FAILED, as_json, summary)
    if as_json:
        print_json(summary)
    if not result.health.success:
        raise typer.Exit(INTERRUPTED)


def _write(result: Result, folder: Path, plots: bool, pages: Sequence[str]) -> tuple[list[Path], list[str]]:
    """Write all files of a result; returns them, and remarks on what was left out."""
    files, notes = [], []
    make_folder(folder)

    def keep(name: str, write: Callable[[Path], None]) -> None:
        write(folder / name)
        files.append(folder / name)

    keep("result.nc", result.save)
    curves = 8 * len(result.model.bodies) + 5 * len(result.model.joints)
    if curves * len(result.t) <= CSV_NUMBERS:
        keep("result.csv", result.to_csv)
    else:
        notes.append(f"result.csv is left out: some {curves} curves at {len(result.t)} times; read result.nc instead")
    if not len(result.t):
        notes.append("no output time was reached: there is nothing to draw")
        return files, notes
    if plots:
        from ..view.plots import standard_plots

        make_folder(folder / "plots")
        files += standard_plots(result, folder / "plots")
    for name in pages:
        keep(name, result.to_report if name == "report.html" else result.to_html)
    return files, notes
