"""Mechanisms from model files, with parameters changed."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from contextlib import redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import FlyballError, ModelError

if TYPE_CHECKING:
    from ..mechanism import Mechanism


def load_mechanism(path: Path) -> Mechanism:
    """The mechanism of a model file."""
    if path.suffix.lower() == ".py":
        return _from_python(path)
    from ..files import load

    return load(path)


def _from_python(path: Path) -> Mechanism:
    """Run a Python file and take its mechanism; what it prints goes to stderr."""
    import runpy

    from ..mechanism import Mechanism

    if not path.is_file():
        raise ModelError(f"there is no file {str(path)!r}")
    sys.path.insert(0, str(path.resolve().parent))
    try:
        with redirect_stdout(sys.stderr):
            names = runpy.run_path(str(path))
            found = [names.get(k) for k in ("m", "mechanism")]
            made = [x if isinstance(x, Mechanism) else x() for x in found if isinstance(x, Mechanism) or callable(x)]
    except ModelError as error:
        raise type(error)(f"{path}{_line_in(path, error)}: {error}") from None
    except FlyballError:
        raise
    except (Exception, SystemExit) as error:
        raise ModelError(f"{path}{_line_in(path, error)}: {type(error).__name__}: {error}") from None
    finally:
        sys.path.pop(0)
    for m in made:
        if isinstance(m, Mechanism):
            return m
    raise ModelError(f"{path} defines no mechanism: name one m or mechanism, or define a function mechanism()")


def _line_in(path: Path, error: BaseException) -> str:
    """', line n' of the last line of that file that had a part in the error."""
    if isinstance(error, SyntaxError) and error.lineno:
        return f", line {error.lineno}"
    line = ""
    trace = error.__traceback__
    while trace is not None:
        if os.path.basename(trace.tb_frame.f_code.co_filename) == path.name:
            line = f", line {trace.tb_lineno}"
        trace = trace.tb_next
    return line


def set_parameters(mechanism: Mechanism, changes: Sequence[str]) -> None:
    """Give parameters other values, and check again all that depends on them."""
    from ..model.model import listing, suggest

    for text in changes:
        name, equals, value = (x.strip() for x in text.partition("="))
        if not equals or not value:
            raise ModelError(f"--set {text!r}: write name=value, for instance --set mass=2 or --set speed='120 rpm'")
        known = list(mechanism.parameters)
        if name not in known:
            problem = f"{mechanism.name!r} has no parameter {name!r}{suggest(name, known)}"
            raise ModelError(f"--set {text!r}: {problem}; {listing(known) if known else 'it has none'}")
        try:
            new: float | str = float(value)
        except ValueError:
            new = value
        try:
            mechanism.environment({name: new})
        except ModelError as error:
            raise type(error)(f"--set {text!r}: {error}") from None
        mechanism.parameters[name] = new
    if changes:
        env = mechanism.environment()
        for e in mechanism.elements():
            mechanism.validate(e, env)
