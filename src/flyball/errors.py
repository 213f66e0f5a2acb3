"""Exceptions and warnings of flyball. Each message states the element, the value, the rule and a remedy."""

from __future__ import annotations

import importlib
import os
import re
import sys
import warnings
from pathlib import Path
from typing import Any

PACKAGE = Path(__file__).parent
HEAD_LENGTH, TAIL_LENGTH = (
    1200,
    500,
)  # characters kept of a long message: at its beginning (the place) and at its end (the rule and the remedy)
_LONG_WORD = re.compile(r"\S{201,}")


def shortened_message(message: str) -> str:
    """Shorten long words of a message, and then the whole message, in the middle.

    Names, formulas and lists written by the user may have any length.
    """
    text = _LONG_WORD.sub(lambda m: f"{m[0][:120]}...{m[0][-60:]}", message)
    return text if len(text) <= HEAD_LENGTH + TAIL_LENGTH else f"{text[:HEAD_LENGTH]} ... {text[-TAIL_LENGTH:]}"


class FlyballError(Exception):
    """Base class of all errors that flyball raises on purpose."""

    def __init__(self, message: str = "") -> None:
        super().__init__(shortened_message(message))


class ModelError(FlyballError, ValueError):
    """The description of a mechanism is invalid."""


class UnitError(ModelError):
    """A quantity has an unknown unit, or one of the wrong dimension."""


class ExpressionError(ModelError):
    """An expression cannot be parsed, or uses an unknown name."""


def cannot_write(path: str | os.PathLike, error: OSError) -> ModelError:
    """Return the error to raise if a file cannot be written."""
    path = Path(path)
    if not path.parent.is_dir():
        why = f"there is no folder {os.fspath(path.parent)!r}; make it first, or write elsewhere"
    elif path.is_dir():
        why = f"it is a folder; name a file in it, for instance {os.fspath(path / 'page.html')!r}"
    else:
        why = error.strerror or str(error)
    return ModelError(f"cannot write {os.fspath(path)!r}: {why}")


def warn_user(text: str, category: type[Warning]) -> None:
    """Issue a warning at the line of the user's code that called flyball."""
    depth, frame = 1, sys._getframe(0)
    while frame.f_back is not None and Path(frame.f_code.co_filename).is_relative_to(PACKAGE):
        depth, frame = depth + 1, frame.f_back
    warnings.warn(shortened_message(text), category, stacklevel=depth)


def import_optional(package: str, extra: str) -> Any:
    """Import an optional package.

    Raises
    ------
    ImportError
        If it is not installed; the message says what to install.
    """
    try:
        return importlib.import_module(package)
    except ImportError as error:
        raise ImportError(f"this needs the package {package}: pip install 'flyball[{extra}]'") from error


class ModelWarning(UserWarning):
    """Something in a model file of another program has no meaning here, and is not used."""


class PerformanceNotice(UserWarning):
    """A calculation works, but far more slowly than possible."""


class StartWarning(UserWarning):
    """The initial velocity differs from the described one, because the constraints do not allow the latter."""


class Interrupted(KeyboardInterrupt):
    """The user interrupted an analysis. ``result`` contains what was computed up to then.

    It is a ``KeyboardInterrupt``: scripts and loops end by it as by any other.
    """

    def __init__(self, message: str, result: Any = None) -> None:
        super().__init__(message if result is None else f"{message} (``result`` of this exception has it)")
        self.result = result


class SingularOrientationError(FlyballError, ValueError):
    """Coordinates of an orientation do not exist, or have no finite rates, at this orientation.

    ``sequence`` names the Euler angles ("" for other coordinates), ``angle`` is the middle angle (of other coordinates
    the angle of the turn) and ``distance`` how far it is from the singular one, both in rad.
    """

    def __init__(
        self, message: str, sequence: str = "", angle: float = float("nan"), distance: float = float("nan")
    ) -> None:
        super().__init__(message)
        self.sequence = sequence
        self.angle = angle
        self.distance = distance


class SingularOrientationWarning(UserWarning):
    """The coordinates of an orientation are not unique; one choice was made."""


class AnalysisError(FlyballError):
    """An analysis is not possible or cannot continue."""


class AssemblyError(AnalysisError):
    """No position or velocity satisfies all constraints.

    ``gaps`` contains the constraint error of each inconsistent element; ``best`` is the best position found.
    """

    def __init__(self, message: str, gaps: dict | None = None, best: Any = None) -> None:
        super().__init__(message)
        self.gaps = gaps or {}
        self.best = best


class SimulationError(AnalysisError):
    """An integration cannot continue. ``t`` is the time it stopped, ``result`` what was computed up to then."""

    def __init__(self, message: str, result: object = None, t: float = float("nan")) -> None:
        super().__init__(message)
        self.result = result
        self.t = t


class MobilityError(AnalysisError):
    """A mechanism has more or fewer degrees of freedom than an analysis requires.

    ``free`` names bodies or joints that can still move, ``redundant`` elements that prescribe the same motion twice.
    """

    def __init__(self, message: str, free: tuple[str, ...] = (), redundant: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.free = free
        self.redundant = redundant


class SingularityError(AnalysisError):
    """An analysis was started at, or has reached, a singular position.

    ``where`` is the value of the varied quantity there (time [s] or a driver's coordinate), ``elements`` names those
    whose constraints become dependent, ``result`` contains what was computed up to there, if anything.
    """

    def __init__(
        self, message: str, where: float = float("nan"), elements: tuple[str, ...] = (), result: object = None
    ) -> None:
        super().__init__(message)
        self.where = where
        self.elements = elements
        self.result = result


class NotConverged(AnalysisError):
    """An iteration found no solution. ``residuals`` gives the remaining residual of each body or element concerned.

    ``series`` contains the part of a series that was computed before.
    """

    def __init__(self, message: str, residuals: dict | None = None, series: object = None) -> None:
        super().__init__(message)
        self.residuals = residuals or {}
        self.series = series
