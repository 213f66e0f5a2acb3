"""Files that a mechanism names: paths relative to its model file, and how they are written to another."""

from __future__ import annotations

import os
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BeforeValidator

if TYPE_CHECKING:
    from collections.abc import Iterator

_FOLDER: ContextVar[Path | None] = ContextVar("folder", default=None)


@contextmanager
def paths_from(folder: str | os.PathLike | None) -> Iterator[None]:
    """Context manager: relative paths of what is created inside are relative to this folder, not to the current one."""
    token = _FOLDER.set(None if folder is None else Path(folder).absolute())
    try:
        yield
    finally:
        _FOLDER.reset(token)


def current_folder() -> Path:
    """Return the folder to which relative paths refer."""
    return _FOLDER.get() or Path.cwd()


def _text(value: Any) -> Any:
    return Path(value).as_posix() if isinstance(value, os.PathLike) else value


FilePath = Annotated[str | None, BeforeValidator(_text)]


class LinkedFile:
    """What has a field ``path``: two are equal if their paths lead to the same file."""

    path: str | None

    def __post_init__(self) -> None:
        """Store the folder to which a relative path refers."""
        object.__setattr__(self, "_folder", current_folder())

    def _key(self) -> tuple:
        return tuple(self.file if f.name == "path" else getattr(self, f.name) for f in fields(self))  # type: ignore[arg-type]

    def __eq__(self, other: object) -> bool:
        """Return whether all fields are equal; paths are equal if they lead to the same file."""
        return self._key() == other._key() if type(other) is type(self) else NotImplemented  # type: ignore[attr-defined]

    def __hash__(self) -> int:
        return hash(self._key())

    @property
    def file(self) -> str | None:
        """Return the absolute path of the file."""
        return self.path and os.path.normpath(os.path.join(self._folder, self.path))  # type: ignore[attr-defined]

    def path_from(self, folder: str | os.PathLike) -> str | None:
        """Return the path as a model file in that folder must contain it."""
        if self.path is None or os.path.isabs(self.path) or os.path.normpath(Path(folder, self.path)) == self.file:
            return self.path
        try:
            return Path(os.path.relpath(str(self.file), folder)).as_posix()
        except ValueError:  # on another drive
            return self.file
