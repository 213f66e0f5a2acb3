"""What is read of a run: a curve over the output times, one number of it, or what a function makes of the result."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import ModelError
from ...model.model import Model
from ...model.quantities import one
from ...results.result import Result

CURVE, END, FUNCTION = "curve", "end", "function"
REDUCED = re.compile(r"\s*(end|max|min|mean|rms)\s*\((.+)\)\s*")


@dataclass(frozen=True)
class Reading:
    """One quantity of a study: ``how`` it is read off the curve ``name``, or off the result by a function."""

    title: str
    how: str
    name: str
    unit: str
    function: Callable[[Result], Any] | None = None


def readings(model: Model, of: Sequence[str] | Mapping[str, Callable[[Result], Any]]) -> tuple[Reading, ...]:
    """What is asked for.

    Raises
    ------
    ModelError
        If there is no such quantity, or it is no number.
    """
    if isinstance(of, Mapping):
        for title, function in of.items():
            if not isinstance(title, str) or not callable(function):
                raise ModelError(f"of maps names to functions of a result, not {title!r} to {function!r}")
        return tuple(Reading(title, FUNCTION, title, "", function) for title, function in of.items())
    if isinstance(of, str) or not isinstance(of, (Sequence, np.ndarray)):
        raise ModelError(f"of is a list of names, for instance of=['max(slider.x)'], not {of!r}")
    if len(set(of)) < len(of):
        raise ModelError(f"of names something twice: {', '.join(map(str, of))}")
    return tuple(_reading(model, text) for text in of)


def _reading(model: Model, text: str) -> Reading:
    found = REDUCED.fullmatch(text) if isinstance(text, str) else None
    how, name = (found[1], found[2].strip()) if found else (CURVE, text)
    return Reading(text, how, name, one(model, name).unit)


def ends_only(asked: Sequence[Reading]) -> bool:
    """Whether nothing but the ends of motions is looked at."""
    return all(r.how == END for r in asked)


def read(result: Result, asked: Sequence[Reading], times: np.ndarray) -> list[np.ndarray]:
    """What is asked for of one run: (times,) for a curve, else ()."""
    return [
        _of_function(r, result) if r.function else reduced(r.how, result.t, _curve(result, r), times) for r in asked
    ]


def _curve(result: Result, r: Reading) -> np.ndarray:
    return result.curve(r.name)[1]


def reduced(how: str, t: np.ndarray, y: np.ndarray, times: np.ndarray) -> np.ndarray:
    """A curve at the times of the study (nan where the motion has ended before), or one number of it."""
    if how == CURVE:
        out = np.full(len(times), np.nan)
        at = np.searchsorted(times, t)
        there = at < len(times)
        there[there] = times[at[there]] == t[there]
        out[at[there]] = y[there]
        return out
    if not len(t):
        return np.array(np.nan)
    if how == END:
        return np.array(y[-1])
    if how in ("max", "min"):
        return np.array(getattr(np, how)(y))
    y = y if how == "mean" else y**2
    span = t[-1] - t[0]
    mean = float(np.sum(0.5 * (y[1:] + y[:-1]) * np.diff(t)) / span) if span > 0.0 else float(y[-1])
    return np.array(mean if how == "mean" else np.sqrt(mean))


def _of_function(r: Reading, result: Result) -> np.ndarray:
    """What a user's function makes of a result: one number."""
    found = np.asarray(r.function(result))  # type: ignore[misc]
    if found.ndim or found.dtype.kind not in "fiub":
        raise ModelError(f"the function {r.title!r} returned {found!r}; one number is wanted")
    return found.astype(float)
