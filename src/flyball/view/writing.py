"""Writing documents, with messages that say what is wrong."""

from __future__ import annotations

import os
from pathlib import Path

from ..errors import cannot_write


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
        raise cannot_write(path, error) from None
