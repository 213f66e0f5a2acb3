"""The errors a user can meet. Each message names the element, the value, the rule and a remedy."""

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
)  # characters of a long message that are kept: where it is, and what the rule and the remedy are
_LONG_WORD = re.compile(r"\S{201,}")


def shortened_message(message: str) -> str:
    """A message whose longest words, and as a whole what is longest, are shortened in the middle.

    Names, formulas and lists that a user wrote may have any length.
    """
    text = _LONG_WORD.sub(lambda m: f"{m[0][:120]}...{m[0][-60:]}", message)
    return text if len(text) <= HEAD_LENGTH + TAIL_LENGTH else f"{text[:HEAD_LENGTH]} ... {text[-TAIL_LENGTH:]}"


class FlyballError(Exception):
    """Any error raised by flyball on purpose."""

    def __init__(self, message: str = "") -> None:
        super().__init__(shortened_message(message))


class ModelError(FlyballError, ValueError):
    """The description of a mechanism is wrong."""


class UnitError(ModelError):
    """A quantity has a unit that does not exist or does not fit what is wanted."""


class ExpressionError(ModelError):
    """An expression cannot be read, or uses a name that is not known."""


def cannot_write(path: str | os.PathLike, error: OSError) -> ModelError:
    """The error to raise where a file cannot be written."""
    path = Path(path)
    if not path.parent.is_dir():
        why = f"there is no folder {os.fspath(path.parent)!r}; make it first, or write elsewhere"
    elif path.is_dir():
        why = f"it is a folder; name a file in it, for instance {os.fspath(path / 'page.html')!r}"
    else:
        why = error.strerror or str(error)
    return ModelError(f"cannot write {os.fspath(path)!r}: {why}")


def warn_user(text: str, category: type[Warning]) -> None:
    """Warn at the line outside flyball that asked."""
    depth, frame = 1, sys._getframe(0)
    while frame.f_back is not None and Path(frame.f_code.co_filename).is_relative_to(PACKAGE):
        depth, frame = depth + 1, frame.f_back
    warnings.warn(shortened_message(text), category, stacklevel=depth)


def import_optional(package: str, extra: str) -> Any:
    """A package that not everybody has.

    Raises
    ------
    ImportError
        With what to install, if it is not there.
    """
    try:
        return importlib.import_module(package)
    except ImportError as error:
        raise ImportError(f"this needs the package {package}: pip install 'flyball[{extra}]'") from error


class PerformanceNotice(UserWarning):
    """Something works, but far slower than it could."""


class StartWarning(UserWarning):
    """A velocity that was described is not the one that a motion starts with: the constraints do not allow it."""


class Interrupted(KeyboardInterrupt):
    """The user interrupted an analysis. ``result`` holds what was computed up to then.

    It is a ``KeyboardInterrupt``: scripts and loops end by it, as by any other.
    """

    def __init__(self, message: str, result: Any = None) -> None:
        super().__init__(message if result is None else f"{message} (``result`` of this exception has it)")
        self.result = result


class SingularOrientationError(FlyballError, ValueError):
    """Coordinates of an orientation do not exist, or have no finite rates, where it was asked for them.

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
    """Coordinates of an orientation are not determined by it, and a choice was made."""


class AnalysisError(FlyballError):
    """An analysis cannot be done or cannot go on."""


class AssemblyError(AnalysisError):
    """No position or velocity fulfils all constraints.

    ``gaps`` holds, for each element that disagrees, how far it is from closed; ``best`` the best position found.
    """

    def __init__(self, message: str, gaps: dict | None = None, best: Any = None) -> None:
        super().__init__(message)
        self.gaps = gaps or {}
        self.best = best


class SimulationError(AnalysisError):
    """An integration cannot go on. ``result`` holds what was computed up to then, ``t`` the time it stopped."""

    def __init__(self, message: str, result: object = None, t: float = float("nan")) -> None:
        super().__init__(message)
        self.result = result
        self.t = t


class MobilityError(AnalysisError):
    """A mechanism has more or fewer freedoms than an analysis can do with.

    ``free`` names bodies or joints that can still move, ``redundant`` elements that prescribe the same thing twice.
    """

    def __init__(self, message: str, free: tuple[str, ...] = (), redundant: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.free = free
        self.redundant = redundant


class SingularityError(AnalysisError):
    """An analysis was asked for at, or has run into, a singular position.

    ``where`` is the value of what was varied there (time [s] or a driver's coordinate), ``elements`` names those whose
    constraints lose their independence, ``result`` holds what was computed up to there, if anything.
    """

    def __init__(
        self, message: str, where: float = float("nan"), elements: tuple[str, ...] = (), result: object = None
    ) -> None:
        super().__init__(message)
        self.where = where
        self.elements = elements
        self.result = result


class NotConverged(AnalysisError):
    """An iteration found no solution. ``residuals`` holds, for each body or element concerned, what is left.

    ``series`` holds what a series reached before.
    """

    def __init__(self, message: str, residuals: dict | None = None, series: object = None) -> None:
        super().__init__(message)
        self.residuals = residuals or {}
        self.series = series
