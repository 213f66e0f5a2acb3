"""``flyball view``: a result in the web browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import ModelError
from .common import Json, app, print_json, reported


@app.command()
def view(
    file: Annotated[Path, typer.Argument(help="A result (.nc) or an animation page (.html).")],
    no_open: Annotated[bool, typer.Option("--no-open", help="Only write the page and print where it is.")] = False,
    as_json: Json = False,
) -> None:
    """Show a result in the web browser."""
    with reported(as_json):
        page = _page(file)
        if as_json:
            print_json({"page": str(page)})
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
    from ..files import load_result

    text = load_result(file).html()
    page = file.with_suffix(".html")
    from ..model.writing import write

    try:
        write(page, text)
    except ModelError:
        import tempfile

        page = Path(tempfile.mkdtemp(prefix="flyball-")) / page.name
        write(page, text)
    return page
