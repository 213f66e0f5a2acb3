"""Files in: a mechanism from a model file, a result from a result file."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from .errors import ModelError
from .mechanism import Mechanism

if TYPE_CHECKING:
    from .results.result import Result


def load(path: str | os.PathLike) -> Mechanism:
    """Read a mechanism from a model file: TOML as `Mechanism.save` writes it, or Python.

    A file ``*.py`` is run, as the command runs it; it defines ``m``, ``mechanism`` or ``mechanism()``.

    Raises
    ------
    ModelError
        If there is no such file or it describes no valid mechanism; the message names the file, the line and the
        element.
    """
    try:
        given = Path(path)
    except TypeError:
        raise ModelError(f"the path of a model file is a text or a path, not {path!r}") from None
    if given.suffix.lower() == ".py":
        from .model.python_file import load_python

        return load_python(given, Mechanism)
    from .model.io import load

    return load(given, Mechanism)


def load_result(path: str | os.PathLike) -> Result:
    """Read a result from a NetCDF file, as `Result.save` writes it: nothing is simulated again, nothing compiled.

    Raises
    ------
    ModelError
        If there is no such file, or it is no result of flyball.
    """
    from .results.reading import load_result

    try:
        given = Path(path)
    except TypeError:
        raise ModelError(f"the path of a result file is a text or a path, not {path!r}") from None
    return load_result(given, Mechanism)
