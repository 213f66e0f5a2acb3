"""Writing documents, with messages that say what is wrong."""

from __future__ import annotations

import os
from pathlib import Path

from ..errors import ModelError


def write(path: str | os.PathLike, text: str) -> None:
    """Write a text to a file.

    Raises
    ------
    ModelError
        If that cannot be done: there is no such folder, say.
    """
    try:
        Path(path).write_text(text, encoding="utf-8")
    except OSError as error:
        raise cannot(Path(path), error) from None


def cannot(path: Path, error: OSError) -> ModelError:
    """The error to raise where a file cannot be written."""
    if not path.parent.is_dir():
        why = f"there is no folder {os.fspath(path.parent)!r}; make it first, or write elsewhere"
    elif path.is_dir():
        why = f"it is a folder; name a file in it, for instance {os.fspath(path / 'page.html')!r}"
    else:
        why = error.strerror or str(error)
    return ModelError(f"cannot write {os.fspath(path)!r}: {why}")
