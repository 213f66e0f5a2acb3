"""What is read of a run: a curve over the output times, one number of it, or what a function makes of the answer."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import ModelError

CURVE, END, FUNCTION, VALUE = "curve", "end", "function", "value"


@dataclass(frozen=True)
class Reading:
    """One quantity of a study: ``how`` it is read off what is called ``name``, or off the answer by a function."""

    title: str
    how: str
    name: str
    unit: str
    function: Callable[[Any], Any] | None = None
    of: tuple[Any, ...] = ()  # what else its name says


def readings(
    of: Sequence[str] | Mapping[str, Callable[[Any], Any]], named: Callable[[Any], Reading]
) -> tuple[Reading, ...]:
    """What is asked for.

    Raises
    ------
    ModelError
        If there is no such quantity, or it is no number.
    """
    if isinstance(of, Mapping):
        for title, function in of.items():
            if not isinstance(title, str) or not callable(function):
                raise ModelError(f"of maps names to functions of a run's answer, not {title!r} to {function!r}")
        return tuple(Reading(title, FUNCTION, title, "", function) for title, function in of.items())
    if isinstance(of, (str, bytes)) or not isinstance(of, Sequence) or not all(isinstance(x, str) for x in of):
        raise ModelError(f"of is a list of names, for instance of=['max(slider.x)'], not {of!r}")
    if len(set(of)) < len(of):
        raise ModelError(f"of names something twice: {', '.join(map(str, of))}")
    return tuple(named(text) for text in of)


def ends_only(asked: Sequence[Reading]) -> bool:
    """Whether nothing but the ends of motions is looked at."""
    return all(r.how == END for r in asked)


def reduced(how: str, t: np.ndarray, y: np.ndarray, times: np.ndarray) -> np.ndarray:
    """A curve at the times of the study (nan where the motion has ended before), or one number of it."""
    if how == CURVE and t is times:
        return y
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
