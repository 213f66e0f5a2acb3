"""What all subcommands share: the application, its exit codes, and how they say what they have to say.

Exit codes: 0 done, 2 wrong input, 3 the analysis failed, 130 interrupted.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import AnalysisError, FlyballError

DONE, BAD_INPUT, FAILED, INTERRUPTED = 0, 2, 3, 130

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
Resting = Annotated[bool, typer.Option("--equilibrium", help="About the equilibrium next to the mechanism as drawn.")]
Turning = Annotated[
    list[str] | None,
    typer.Option(help="About the steady motion in which this joint's coordinate turns evenly; may be repeated."),
]
Plot = Annotated[Path | None, typer.Option(help="Write a picture to a PNG, SVG or PDF file.")]
Page = Annotated[Path | None, typer.Option("--out", "-o", help="Write a page (.html) that shows it.")]
Out = Annotated[
    Path | None, typer.Option("--out", "-o", help="Folder for the results; by default named after the model.")
]
Without = Annotated[
    list[str] | None,
    typer.Option(help="Leave out a part, or a kind of them: --without brake, --without events; may be repeated."),
]
Changes = Annotated[list[str] | None, typer.Option("--set", help='Set a parameter: --set speed="120 rpm".')]


@contextmanager
def reported(as_json: bool) -> Iterator[None]:
    """Errors as one message to stderr (or one JSON object) and an exit code; no traceback."""
    try:
        yield
    except FlyballError as error:
        code = FAILED if isinstance(error, AnalysisError) else BAD_INPUT
        fail(as_options(str(error)), type(error).__name__, code, as_json)
    except KeyboardInterrupt:
        fail("interrupted", "KeyboardInterrupt", INTERRUPTED, as_json)


def as_options(text: str) -> str:
    """A message whose remedies are options of the command line, where they are calls in Python."""
    text = text.replace("about=m.equilibrium()", "--equilibrium")
    return re.sub(r"m\.changed\(\{(.*?)\}\)\.\w+\(\.\.\.\)", _leaving_out, text)


def _leaving_out(call: re.Match) -> str:
    names = re.findall(r"('[^']*'|\"[^\"]*\"): None", call[1])
    return " ".join(f"--without {name}" for name in names)


def fail(message: str, kind: str, code: int, as_json: bool, more: dict[str, Any] | None = None) -> None:
    """Say what is wrong and end with the code; as JSON with ``more`` beside it."""
    if as_json:
        print_json({"error": message, "kind": kind} | (more or {}))
    else:
        typer.echo(f"error: {message}", err=True)
    raise typer.Exit(code)


def print_json(data: Any) -> None:
    """Print data as one line of strict JSON."""
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


def table(lines: list[tuple[str, str]]) -> None:
    """Labels and texts, labels only where they change."""
    width = max(len(label) for label, _ in lines)
    last = ""
    for label, text in lines:
        typer.echo(f"{label if label != last else '':<{width}}  {text}")
        last = label


def make_folder(folder: Path) -> None:
    """Make a folder, its parents too."""
    from ..model.writing import make_folder as make

    make(folder)
