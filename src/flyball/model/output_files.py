"""Writing of output files: complete or not at all, with an extension that matches the content."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from ..errors import ModelError, cannot_write

RESULT, TABLE, PAGE, LATEX = (".nc", ".nc4", ".h5", ".hdf5"), (".csv", ".txt"), (".html", ".htm"), (".tex",)
PICTURE, DESCRIPTION, SCENE, SCHEMA = (".png", ".svg", ".pdf"), (".toml",), (".glb",), (".json",)
VIDEO = (".gif", ".mp4", ".webm")
PARQUET, MATLAB, SCENE_PICTURE = (".parquet",), (".mat",), (".png", ".svg")
ROBOT = (".urdf", ".xml", ".mjcf")
OTHER_METHODS = {
    SCENE: "save",
    VIDEO: "save",
    PARQUET: "save",
    MATLAB: "save",
    RESULT: "save",
    TABLE: "to_csv",
    PAGE: "to_html",
    LATEX: "to_latex",
    PICTURE: "plot(path=...)",
}
"""The methods that write files with other extensions."""


def file_extension(path: str | os.PathLike, known: Sequence[str]) -> str:
    """Return the extension of a path in lower case, which must be known; "" for a device, which needs none.

    Raises
    ------
    ModelError
        If it is unknown, or the path is invalid.
    """
    at = _path(path)
    found = at.suffix.lower()
    if found in known:
        return found
    if _device(at):
        return ""
    if at.is_dir():
        raise cannot_write(at, IsADirectoryError())
    said = f"the ending {found!r} is not known here" if found else "its name has no ending"
    other = next((f"; {how} writes {found}" for kinds, how in OTHER_METHODS.items() if found in kinds), "")
    raise ModelError(f"cannot write {os.fspath(path)!r}: {said}; it must be {' or '.join(known)}{other}")


def _path(path: str | os.PathLike) -> Path:
    """Return a valid file path."""
    try:
        os.fsencode(path)
        if "\0" in os.fspath(path):
            raise ValueError
        return Path(path)
    except (TypeError, ValueError):
        raise ModelError(f"the path of a file is a text or a path, not {path!r}") from None


def make_folder(path: str | os.PathLike) -> Path:
    """Create a folder and its parents.

    Raises
    ------
    ModelError
        If that is not possible.
    """
    folder = _path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ModelError(f"cannot make the folder {str(folder)!r}: {error.strerror}") from None
    return folder


def _device(path: Path) -> bool:
    """Return whether the path is neither a file nor a folder, such as /dev/stdout."""
    return path.exists() and not path.is_file() and not path.is_dir()


@contextmanager
def replacing_file(path: str | os.PathLike, known: Sequence[str] = ()) -> Iterator[BinaryIO]:
    """Context manager for a temporary file beside the target, which it replaces once complete; removed on failure.

    A previous file stays until then. ``known``: permitted extensions; any if not given.

    Raises
    ------
    ModelError
        If the file cannot be written (no such folder, no space left, ...), or has another extension.
    """
    if known:
        file_extension(path, known)
    place = _path(path).resolve()
    try:
        if _device(place):
            with open(place, "wb") as file:
                yield file
            return
        part = place.with_name(f".{place.name}.{os.getpid()}.part")
        try:
            with open(part, "wb") as file:
                yield file
            if place.exists():
                shutil.copymode(place, part)
            part.replace(place)
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        raise cannot_write(path, error) from None


def write_file(path: str | os.PathLike, data: str | bytes | memoryview, known: Sequence[str] = ()) -> None:
    """Write a text or bytes to a file; see `replacing_file`."""
    with replacing_file(path, known) as file:
        file.write(data.encode() if isinstance(data, str) else data)
