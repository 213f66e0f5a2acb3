"""The command-line application: shared options, exit codes, error messages, JSON and table output.

Exit codes: 0 done, 1 files of another layout (``fmt --check``), 2 wrong input, 3 the analysis failed, 130 interrupted.
"""

from __future__ import annotations

import json
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import AnalysisError, FlyballError, PerformanceNotice

DONE, OTHER_LAYOUT, BAD_INPUT, FAILED, INTERRUPTED = 0, 1, 2, 3, 130

app = typer.Typer(
    name="flyball",
    help="Rigid-body mechanisms: run, check and view them.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

ModelFile = Annotated[
    Path, typer.Argument(help="A model file: .toml, .urdf, or .py that defines m, mechanism or mechanism().")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
AboutEquilibrium = Annotated[
    bool, typer.Option("--equilibrium", help="About the equilibrium near the reference configuration.")
]
SteadyTurning = Annotated[
    list[str] | None,
    typer.Option(help="About the steady motion in which this joint's coordinate turns evenly; may be repeated."),
]
PlotFile = Annotated[Path | None, typer.Option(help="Write a picture to a PNG, SVG or PDF file.")]
PageFile = Annotated[Path | None, typer.Option("--out", "-o", help="Write a page (.html) that shows it.")]
OutputFolder = Annotated[
    Path | None, typer.Option("--out", "-o", help="Folder for the results; by default named after the model.")
]
ExcludedParts = Annotated[
    list[str] | None,
    typer.Option(help="Leave out a part, or a kind of them: --without brake, --without events; may be repeated."),
]
ParameterChanges = Annotated[list[str] | None, typer.Option("--set", help='Set a parameter: --set speed="120 rpm".')]


@contextmanager
def report_errors(as_json: bool) -> Iterator[None]:
    """Context manager that prints errors as one message to stderr (or one JSON object) and exits; without traceback."""
    try:
        yield
    except FlyballError as error:
        code = FAILED if isinstance(error, AnalysisError) else BAD_INPUT
        exit_with_error(with_option_names(str(error)), type(error).__name__, code, as_json)
    except KeyboardInterrupt:
        exit_with_error("interrupted", "KeyboardInterrupt", INTERRUPTED, as_json)


def with_option_names(text: str) -> str:
    """Replace remedies written as Python calls in a message by command-line options."""
    text = text.replace("about=m.equilibrium()", "--equilibrium")
    return re.sub(r"m\.changed\(\{(.*?)\}\)\.\w+\(\.\.\.\)", _without_options, text)


def _without_options(call: re.Match) -> str:
    names = re.findall(r"('[^']*'|\"[^\"]*\"): None", call[1])
    return " ".join(f"--without {name}" for name in names)


def exit_with_error(message: str, kind: str, code: int, as_json: bool, more: dict[str, Any] | None = None) -> None:
    """Print the error and exit with the code; as JSON with ``more`` included."""
    if as_json:
        print_json({"error": message, "kind": kind} | (more or {}))
    else:
        typer.echo(f"error: {message}", err=True)
    raise typer.Exit(code)


def print_json(data: Any) -> None:
    """Print data as one line of strict JSON."""
    typer.echo(json.dumps(_json_data(data), allow_nan=False))


def _json_data(value: Any) -> Any:
    """Convert data to plain JSON; non-finite numbers become null."""
    if isinstance(value, dict):
        return {str(k): _json_data(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_json_data(v) for v in value]
    if isinstance(value, float) and value - value != 0.0:
        return None
    return value if isinstance(value, (str, int, float, bool, type(None))) else str(value)


def print_table(lines: list[tuple[str, str]]) -> None:
    """Print a table of labels and texts; a repeated label is printed once."""
    width = max(len(label) for label, _ in lines)
    last = ""
    for label, text in lines:
        typer.echo(f"{label if label != last else '':<{width}}  {text}")
        last = label


def make_folder(folder: Path) -> None:
    """Create a folder and its parents."""
    from ..model.output_files import make_folder as make

    make(folder)


def show_notices(verbose: bool) -> None:
    """Print notices when they are issued, without the source line; without ``verbose`` none is printed."""
    if not verbose:
        warnings.filterwarnings("ignore", "compiling ", PerformanceNotice)
        return
    warnings.filterwarnings("always", "compiling ", PerformanceNotice)
    usual = warnings.showwarning

    def show(message: Any, category: type[Warning], *more: Any, **where: Any) -> None:
        if issubclass(category, PerformanceNotice):
            typer.echo(str(message), err=True)
        else:
            usual(message, category, *more, **where)

    if getattr(usual, "__name__", "") != show.__name__:
        warnings.showwarning = show
