"""Mechanisms described by Python files."""

from __future__ import annotations

import os
import sys
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any, TypeVar

from ..errors import FlyballError, ModelError
from .messages import suggest
from .model import Model

M = TypeVar("M", bound=Model)


def load_python(path: Path, cls: type[M]) -> M:
    """Execute a Python file; return its ``m``, ``mechanism`` or ``mechanism()``, a mechanism of class ``cls``.

    Its output is redirected to stderr.

    Raises
    ------
    ModelError
        If there is no such file, it fails (with its line), or it defines no mechanism.
    """
    import runpy

    if not path.is_file():
        there = [p.name for p in path.parent.glob("*.py")] if path.parent.is_dir() else []
        raise ModelError(f"there is no file {os.fspath(path)!r}{suggest(path.name, there)}")
    sys.path.insert(0, str(path.resolve().parent))
    try:
        with redirect_stdout(sys.stderr):
            names = runpy.run_path(str(path))
            found: list[Any] = [names.get(k) for k in ("m", "mechanism")]
            made = [x if isinstance(x, cls) else x() for x in found if isinstance(x, cls) or callable(x)]
    except ModelError as error:
        raise type(error)(f"{path}{_line_in(path, error)}: {error}") from None
    except FlyballError:
        raise
    except (Exception, SystemExit) as error:
        raise ModelError(f"{path}{_line_in(path, error)}: {type(error).__name__}: {error}") from None
    finally:
        sys.path.pop(0)
    for m in made:
        if isinstance(m, cls):
            return m
    raise ModelError(f"{path} defines no mechanism: name one m or mechanism, or define a function mechanism()")


def _line_in(path: Path, error: BaseException) -> str:
    """Return ', line n' of the last line of that file in the error's traceback."""
    if isinstance(error, SyntaxError) and error.lineno:
        return f", line {error.lineno}"
    line = ""
    trace = error.__traceback__
    while trace is not None:
        if os.path.abspath(trace.tb_frame.f_code.co_filename) == os.path.abspath(path):
            line = f", line {trace.tb_lineno}"
        trace = trace.tb_next
    return line
