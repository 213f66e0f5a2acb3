"""The ``flyball`` command: run, check and view mechanisms from files.

Exit codes: 0 done, 2 wrong input, 3 the analysis failed, 130 interrupted. Whatever takes long to import is imported
where it is needed.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from .errors import AnalysisError, FlyballError, ModelError, SimulationError

if TYPE_CHECKING:
    from .mechanism import Mechanism
    from .results.result import Result

DONE, BAD_INPUT, FAILED, INTERRUPTED = 0, 2, 3, 130
CSV_NUMBERS = 5_000_000  # above, the table is left out: such a file is of no use

app = typer.Typer(
    name="flyball",
    help="Rigid-body mechanisms: run, check and view them.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

Model = Annotated[Path, typer.Argument(help="A model file: .toml, or .py that defines m, mechanism or mechanism().")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]


def main(argv: Sequence[str] | None = None) -> None:
    """Entry point of the command."""
    app(args=None if argv is None else list(argv), prog_name="flyball")


def _version(wanted: bool) -> None:
    if wanted:
        from . import __version__

        typer.echo(f"flyball {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Rigid-body mechanisms: run, check and view them."""


@contextmanager
def _reported(as_json: bool) -> Iterator[None]:
    """Errors as one message to stderr (or one JSON object) and an exit code; no traceback."""
    try:
        yield
    except FlyballError as error:
        code = FAILED if isinstance(error, AnalysisError) else BAD_INPUT
        _fail(str(error), type(error).__name__, code, as_json)
    except KeyboardInterrupt:
        _fail("interrupted", "KeyboardInterrupt", INTERRUPTED, as_json)


def _fail(message: str, kind: str, code: int, as_json: bool, more: dict[str, Any] | None = None) -> None:
    if as_json:
        _print_json({"error": message, "kind": kind} | (more or {}))
    else:
        typer.echo(f"error: {message}", err=True)
    raise typer.Exit(code)


def _print_json(data: Any) -> None:
    typer.echo(json.dumps(_strict(data), allow_nan=False))


def _strict(value: Any) -> Any:
    """Plain JSON: what is not finite becomes null."""
    if isinstance(value, dict):
        return {str(k): _strict(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_strict(v) for v in value]
    if isinstance(value, float) and value - value != 0.0:
        return None
    return value if isinstance(value, (str, int, float, bool, type(None))) else str(value)


@app.command()
def run(
    model: Model,
    t_end: Annotated[str, typer.Option(help='End of the motion, e.g. 10 or "500 ms".')] = "10",
    out: Annotated[Path | None, typer.Option(help="Folder for the results; by default named after the model.")] = None,
    outputs: Annotated[int, typer.Option(help="Number of output times.")] = 501,
    rtol: Annotated[float | None, typer.Option(help="Relative tolerance.")] = None,
    atol: Annotated[float | None, typer.Option(help="Absolute tolerance.")] = None,
    method: Annotated[str | None, typer.Option(help="Integration method.")] = None,
    coordinates: Annotated[str, typer.Option(help="absolute, joint, or auto: those that cost less.")] = "auto",
    change: Annotated[list[str] | None, typer.Option("--set", help='Set a parameter: --set speed="120 rpm".')] = None,
    no_plots: Annotated[bool, typer.Option("--no-plots", help="Write no pictures.")] = False,
    no_animation: Annotated[bool, typer.Option("--no-animation", help="Write no animation page.")] = False,
    report: Annotated[
        bool | None, typer.Option(help="Write the report; by default unless there is to be no animation.")
    ] = None,
    as_json: Json = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")] = False,
) -> None:
    """Simulate a mechanism and write its motion: report.html, animation.html, plots, result.csv and result.nc."""
    with _reported(as_json):
        mechanism = _mechanism(model)
        _set(mechanism, change or [])
        end = _seconds(t_end)
        folder = out if out is not None else Path(f"{model.stem}-result")
        chosen = {"rtol": rtol, "atol": atol, "method": method, "coordinates": coordinates}
        options = {k: v for k, v in chosen.items() if v is not None}
        talk = not (as_json or quiet)
        error = None
        try:
            with _progress(talk) as progress:
                result = mechanism.simulate(end, outputs=outputs, progress=progress, **options)
        except SimulationError as stopped:
            if stopped.result is None:
                raise
            result, error = cast("Result", stopped.result), stopped
        pages = {"report.html": not no_animation if report is None else report, "animation.html": not no_animation}
        files, notes = _write(result, folder, not no_plots, [name for name, wanted in pages.items() if wanted])
        _conclude(result, error, files, notes, as_json, talk)


def _conclude(
    result: Result, error: SimulationError | None, files: list[Path], notes: list[str], as_json: bool, talk: bool
) -> None:
    """Say what was done, and end with the right code."""
    summary = {
        "name": result.model.name,
        "success": result.health.success,
        "message": result.health.message,
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
        _table([*lines, *(("written", str(f)) for f in files), *(("note", n) for n in notes), *page])
    if error is not None:
        _fail(str(error), type(error).__name__, FAILED, as_json, summary)
    if as_json:
        _print_json(summary)
    if not result.health.success:
        raise typer.Exit(INTERRUPTED)


def _table(lines: list[tuple[str, str]]) -> None:
    """Labels and texts, labels only where they change."""
    width = max(len(label) for label, _ in lines)
    last = ""
    for label, text in lines:
        typer.echo(f"{label if label != last else '':<{width}}  {text}")
        last = label


def _write(result: Result, folder: Path, plots: bool, pages: Sequence[str]) -> tuple[list[Path], list[str]]:
    """Write all files of a result; returns them, and remarks on what was left out."""
    files, notes = [], []
    _make(folder)

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
        from .view.plots import standard_plots

        _make(folder / "plots")
        files += standard_plots(result, folder / "plots")
    for name in pages:
        keep(name, result.to_report if name == "report.html" else result.to_html)
    return files, notes


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ModelError(f"cannot make the folder {str(folder)!r}: {error.strerror}") from None


@app.command()
def check(model: Model, as_json: Json = False) -> None:
    """Freedoms, redundant joints, assembly, mass properties and warnings, without simulating."""
    with _reported(as_json):
        mechanism = _mechanism(model)
        _announce_compiling(not as_json)
        report = mechanism.check()
        if as_json:
            _print_json(report.as_dict())
        else:
            _table(report.lines())


@app.command()
def view(
    file: Annotated[Path, typer.Argument(help="A result (.nc) or an animation page (.html).")],
    no_open: Annotated[bool, typer.Option("--no-open", help="Only write the page and print where it is.")] = False,
    as_json: Json = False,
) -> None:
    """Show a result in the web browser."""
    with _reported(as_json):
        page = _page(file)
        if as_json:
            _print_json({"page": str(page)})
        else:
            typer.echo(str(page))
        if not no_open:
            import webbrowser

            webbrowser.open(page.resolve().as_uri())


def _page(file: Path) -> Path:
    """The animation page of a file: itself, or written beside the result (in a temporary folder if need be)."""
    if file.suffix.lower() in (".html", ".htm"):
        if not file.is_file():
            raise ModelError(f"there is no file {str(file)!r}")
        return file
    from .files import load_result

    text = load_result(file).html()
    page = file.with_suffix(".html")
    try:
        page.write_text(text, encoding="utf-8")
    except OSError:
        import tempfile

        page = Path(tempfile.mkdtemp(prefix="flyball-")) / page.name
        page.write_text(text, encoding="utf-8")
    return page


def _mechanism(path: Path) -> Mechanism:
    """The mechanism of a model file."""
    if path.suffix.lower() == ".py":
        return _from_python(path)
    from .files import load

    return load(path)


def _from_python(path: Path) -> Mechanism:
    """Run a Python file and take its mechanism; what it prints goes to stderr."""
    import runpy

    from .mechanism import Mechanism

    if not path.is_file():
        raise ModelError(f"there is no file {str(path)!r}")
    sys.path.insert(0, str(path.resolve().parent))
    try:
        with redirect_stdout(sys.stderr):
            names = runpy.run_path(str(path))
            found = [names.get(k) for k in ("m", "mechanism")]
            made = [x if isinstance(x, Mechanism) else x() for x in found if isinstance(x, Mechanism) or callable(x)]
    except ModelError as error:
        raise type(error)(f"{path}{_line_in(path, error)}: {error}") from None
    except FlyballError:
        raise
    except (Exception, SystemExit) as error:
        raise ModelError(f"{path}{_line_in(path, error)}: {type(error).__name__}: {error}") from None
    finally:
        sys.path.pop(0)
    for m in made:
        if isinstance(m, Mechanism):
            return m
    raise ModelError(f"{path} defines no mechanism: name one m or mechanism, or define a function mechanism()")


def _line_in(path: Path, error: BaseException) -> str:
    """', line n' of the last line of that file that had a part in the error."""
    if isinstance(error, SyntaxError) and error.lineno:
        return f", line {error.lineno}"
    line = ""
    trace = error.__traceback__
    while trace is not None:
        if os.path.basename(trace.tb_frame.f_code.co_filename) == path.name:
            line = f", line {trace.tb_lineno}"
        trace = trace.tb_next
    return line


def _set(mechanism: Mechanism, changes: Sequence[str]) -> None:
    """Give parameters other values, and check again all that depends on them."""
    from .model.model import listing, suggest

    for text in changes:
        name, equals, value = (x.strip() for x in text.partition("="))
        if not equals or not value:
            raise ModelError(f"--set {text!r}: write name=value, for instance --set mass=2 or --set speed='120 rpm'")
        known = list(mechanism.parameters)
        if name not in known:
            problem = f"{mechanism.name!r} has no parameter {name!r}{suggest(name, known)}"
            raise ModelError(f"--set {text!r}: {problem}; {listing(known) if known else 'it has none'}")
        try:
            mechanism.parameters[name] = float(value)
        except ValueError:
            mechanism.parameters[name] = value
    if changes:
        env = mechanism.environment()
        for e in mechanism.elements():
            mechanism.validate(e, env)


def _seconds(text: str) -> float:
    from .model.expressions import number

    return float(number(text, {}, "s", "--t-end"))


def _announce_compiling(talk: bool) -> None:
    """On a terminal, say that the first use takes long, if it is the first use."""
    if talk and sys.stderr.isatty() and _will_compile():
        typer.echo("compiling for this machine, once: about half a minute", err=True)


def _will_compile() -> bool:
    """Whether no compiled code of this version is in the cache."""
    from .analysis.entry import motion_kernel

    try:
        return not motion_kernel.dispatcher._cache._cache_file._load_index()  # type: ignore[attr-defined]
    except Exception:  # internals of Numba: where they differ, say nothing
        return False


@contextmanager
def _progress(talk: bool) -> Iterator[Callable[[float], None] | None]:
    """A progress bar on a terminal, once the run has taken a second; else nothing."""
    if not (talk and sys.stderr.isatty()):
        yield None
        return
    _announce_compiling(talk)
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("simulating"), BarColumn(), TextColumn("{task.percentage:>3.0f} %"), TimeRemainingColumn())
    bar = Progress(*columns, console=Console(stderr=True), transient=True)
    task = bar.add_task("", total=1.0)
    begin: list[float] = []

    def progress(fraction: float) -> None:
        if not begin:
            begin.append(time.monotonic())
        if not bar.live.is_started and time.monotonic() - begin[0] > 1.0:
            bar.start()
        bar.update(task, completed=fraction)

    try:
        yield progress
    finally:
        if bar.live.is_started:
            bar.stop()
