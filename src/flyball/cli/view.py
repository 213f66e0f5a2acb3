"""Subcommands without an analysis: ``view`` opens a result in the web browser, ``compile`` compiles all kernels."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from ..errors import ModelError
from .application import AsJson, app, print_json, report_errors


@app.command()
def view(
    file: Annotated[Path, typer.Argument(help="A result (.nc) or an animation page (.html).")],
    no_open: Annotated[bool, typer.Option("--no-open", help="Only write the page and print where it is.")] = False,
    as_json: AsJson = False,
) -> None:
    """Show a result in the web browser."""
    with report_errors(as_json):
        page = _page_file(file)
        if as_json:
            print_json({"page": str(page)})
        else:
            typer.echo(str(page))
        if not no_open:
            import webbrowser

            webbrowser.open(page.resolve().as_uri())


def _page_file(file: Path) -> Path:
    """Return the animation page of a file: the file itself, or a page written beside the result.

    If that folder is not writable, a temporary folder is used.
    """
    if file.suffix.lower() in (".html", ".htm"):
        if not file.is_file():
            raise ModelError(f"there is no file {str(file)!r}")
        return file
    from ..mechanism import load_result

    text = load_result(file).html()
    page = file.with_suffix(".html")
    from ..model.output_files import write_file

    try:
        write_file(page, text)
    except ModelError:
        import tempfile

        page = Path(tempfile.mkdtemp(prefix="flyball-")) / page.name
        write_file(page, text)
    return page


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
