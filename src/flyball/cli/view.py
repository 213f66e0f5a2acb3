"""Subcommands without an analysis: ``view`` a result, write a ``new`` model file, ``compile`` all kernels."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from ..errors import ModelError
from .application import AsJson, app, print_json, report_errors

Results = Annotated[
    list[Path],
    typer.Argument(help="A result (.nc) or an animation page (.html); further results are ghosts beside the first."),
]
MeasuredFile = Annotated[
    Path | None,
    typer.Option(help="Measured curves over those of the first result, in a table (.csv)."),
]


@app.command(short_help="Show a result in the web browser, or compare several.")
def view(
    files: Results,
    measured: MeasuredFile = None,
    no_open: Annotated[bool, typer.Option("--no-open", help="Only write the page and print where it is.")] = False,
    as_json: AsJson = False,
) -> None:
    """Show a result in the web browser, or compare several: ghosts, curves over each other, a table of differences.

    The page is written beside the first result; of a comparison its name ends in -compared.
    """
    with report_errors(as_json):
        page = _page_file(files, measured)
        if as_json:
            print_json({"page": str(page)})
        else:
            typer.echo(str(page))
        if not no_open:
            import webbrowser

            webbrowser.open(page.resolve().as_uri())


@app.command(short_help="Write a result (.nc) in other formats.")
def convert(
    result: Annotated[Path, typer.Argument(help="A result (.nc).")],
    files: Annotated[list[Path], typer.Argument(help="Files to write, by their endings.", metavar="FILE")],
    as_json: AsJson = False,
) -> None:
    """Write a result in other formats, by the endings of the files.

    Tables .csv, .parquet, .mat; videos .gif, .mp4, .webm; the scene .glb, .png, .svg; the page .html.
    """
    with report_errors(as_json):
        from ..mechanism import load_result

        found = load_result(result)
        for file in files:
            found.save(file)
            if not as_json:
                typer.echo(str(file))
        if as_json:
            print_json({"files": [str(f) for f in files]})


def _page_file(files: Sequence[Path], measured: Path | None) -> Path:
    """Return the animation page of files: the file itself, or a page written beside the first result.

    If that folder is not writable, a temporary folder is used.
    """
    first, *rest = files
    compared = bool(rest or measured)
    if page := next((f for f in files if f.suffix.lower() in (".html", ".htm")), None):
        if compared:
            raise ModelError(f"{str(page)!r} is a page; a comparison needs results (.nc), as run.save('run.nc') writes")
        if not page.is_file():
            raise ModelError(f"there is no file {str(page)!r}")
        return page
    from ..mechanism import load_result

    labels = _labels(files)
    others = dict(zip(labels[1:], map(load_result, rest), strict=True))
    text = load_result(first).html(others=others, label=labels[0] if rest else "", measured=measured)
    page = first.with_name(f"{first.stem}-compared.html") if compared else first.with_suffix(".html")
    from ..model.output_files import write_file

    try:
        write_file(page, text)
    except ModelError:
        import tempfile

        page = Path(tempfile.mkdtemp(prefix="flyball-")) / page.name
        write_file(page, text)
    return page


def _labels(files: Sequence[Path]) -> list[str]:
    """Return a label of each file: its name without the suffix, or its path where names are equal.

    Raises
    ------
    ModelError
        If a file is given twice.
    """
    if twice := next((f for k, f in enumerate(files) if f in files[:k]), None):
        raise ModelError(f"{str(twice)!r} is given twice")
    stems = [f.stem for f in files]
    return stems if len(set(stems)) == len(stems) else [str(f.with_suffix("")) for f in files]


SCHEMA_FILE = "flyball.schema.json"
"""The file in which `new` expects the schema of model files."""

_PACKAGE = Path(__file__).parents[1]
_FROM_EXAMPLES = {  # name for ``new``: file in examples/, in the wheel models/ (pyproject.toml)
    "bouncing-ball": "bouncing_ball",
    "cam": "cam_follower",
    "geneva-drive": "geneva_drive",
    "governor": "governor",
    "quick-return": "quick_return",
    "ratchet": "ratchet",
    "slider-crank": "slider_crank",
    "toggle-press": "toggle_press",
    "wishbone": "double_wishbone",
}


def model_files() -> dict[str, Path]:
    """Return the model file that ``new`` writes for each name."""
    found = {p.stem: p for p in (_PACKAGE / "models").glob("*.toml")}
    examples = _PACKAGE.parents[1] / "examples"  # of a checkout
    found |= {k: examples / f"{v}.toml" for k, v in _FROM_EXAMPLES.items() if k not in found}
    return dict(sorted(found.items()))


def _shown(name: str, file: Path) -> str:
    """Return a name with the first sentence of the file's comment."""
    lines = file.read_text(encoding="utf-8").split("\nname =")[0].splitlines()
    sentence = " ".join(line.removeprefix("#").strip() for line in lines).split(". ")[0].split(": ")[0].rstrip(".")
    return f"{name:<16} {sentence}"


@app.command(short_help="Write a commented model file to begin with.")
def new(
    name: Annotated[str | None, typer.Argument(help="A name of the list, such as four-bar.")] = None,
    file: Annotated[Path | None, typer.Argument(help="The file to write; NAME.toml if not given.")] = None,
    list_names: Annotated[bool, typer.Option("--list", help="Print the names.")] = False,
) -> None:
    """Write a commented model file to begin with; without a name, list what there is.

    If flyball.schema.json (of flyball schema) is in the same folder, the first line names it for editors.
    """
    with report_errors(False):
        known = model_files()
        if list_names or name is None:
            typer.echo("\n".join(_shown(k, v) for k, v in known.items()))
            return
        from ..model.messages import suggest
        from ..model.output_files import DESCRIPTION, file_extension, write_file

        if name not in known:
            raise ModelError(f"there is no model file {name!r} to begin with{suggest(name, known)}; flyball new --list")
        target = file or Path(f"{name}.toml")
        file_extension(target, DESCRIPTION)
        if target.exists():
            raise ModelError(f"{str(target)!r} exists and is not replaced; give another file: flyball new {name} FILE")
        source = known[name]
        text = source.read_text(encoding="utf-8").replace(f"examples/{source.name}", str(target))
        if target.with_name(SCHEMA_FILE).is_file():
            text = f"#:schema ./{SCHEMA_FILE}\n{text}"
        write_file(target, text.replace(f" {source.name}", f" {target}"))
        typer.echo(f"{target} is written: flyball run {target}")


@app.command(name="compile", short_help="Compile everything that would be compiled on first use.")
def compile_kernels() -> None:
    """Compile, on all cores, everything that would be compiled on first use, and store it for this user."""
    with report_errors(False):
        from ..compiler.ahead_of_time import compile_all
        from ..compiler.object_files import cache_folder

        began = time.monotonic()

        def progress(name: str, done: int, total: int) -> None:
            rest = (time.monotonic() - began) / done * (total - done)
            typer.echo(f"{done} of {total}: {name.removeprefix('flyball.')}, about {rest:.0f} s left", err=True)

        count = compile_all(progress=progress)
        what = (
            f"{count} kernels compiled in {time.monotonic() - began:.0f} s" if count else "nothing was to be compiled"
        )
        typer.echo(f"{what}; they are in {cache_folder()}")
