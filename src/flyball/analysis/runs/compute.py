"""Some runs of a study, one after the other: each is what the analysis makes of it, failures by themselves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from ...errors import FlyballError
from ...model.model import Model
from ...results.study import DONE, FAILED
from .reading import CURVE, Reading
from .single import Single


@dataclass(frozen=True)
class Question:
    """What each run of a study is asked: the analysis and its options, and what is read of it.

    ``model`` is a snapshot, ``names`` are the parameters that are varied, ``times`` the output times [s].
    """

    model: Model
    single: Single
    options: Any
    names: tuple[str, ...]
    asked: tuple[Reading, ...]
    times: np.ndarray

    def at(self, point: np.ndarray) -> Any:
        """The options of the run at a point."""
        values = dict(zip(self.names, point.tolist(), strict=True))
        return replace(self.options, parameters={**(self.options.parameters or {}), **values})

    def empty(self, n: int) -> Answers:
        """Answers of n runs that are not there yet."""
        shapes = [(n, len(self.times)) if r.how == CURVE else (n,) for r in self.asked]
        return Answers([np.full(s, np.nan) for s in shapes], np.zeros(n, np.int8))


@dataclass
class Answers:
    """Values (runs, ...) of each quantity, how far each run is; by numbers of runs why they failed or are doubtful,
    and remarks.
    """

    values: list[np.ndarray]
    status: np.ndarray
    reasons: dict[int, str] = field(default_factory=dict)
    remarks: dict[int, str] = field(default_factory=dict)
    doubtful: dict[int, str] = field(default_factory=dict)
    seconds: float = 0.0  # that it took to find them

    def take(self, at: np.ndarray, other: Answers) -> None:
        """Write those of some runs, ``at`` being their numbers here."""
        for mine, its in zip(self.values, other.values, strict=True):
            mine[at] = its
        self.status[at] = other.status
        for name in ("reasons", "remarks", "doubtful"):
            getattr(self, name).update({int(at[k]): text for k, text in getattr(other, name).items()})


def compute(question: Question, points: np.ndarray, stopped: Callable[[], bool] = lambda: False) -> Answers:
    """The runs at some points; those that are left when ``stopped`` says so stay to be done."""
    out = question.empty(len(points))
    for k, point in enumerate(points):
        if stopped():
            break
        alone(question, point, out, k)
    return out


def alone(question: Question, point: np.ndarray, out: Answers, k: int) -> None:
    """One run by itself, as number k."""
    guarded(out, k, partial(_told, question, point, out, k))


def guarded(out: Answers, k: int, run: Callable[[], Sequence[np.ndarray]]) -> None:
    """Write what a run makes, or why it fails: whatever it raises is its own, but an interrupt."""
    try:
        for values, found in zip(out.values, run(), strict=True):
            values[k] = found
    except Exception as error:
        out.status[k], out.reasons[k] = FAILED, _reason(error)
        return
    out.status[k] = DONE


def _told(question: Question, point: np.ndarray, out: Answers, k: int) -> list[np.ndarray]:
    single = question.single
    found = single.run(question.model, question.at(point))
    values = single.read(found, question.asked, question.times)
    if doubts := single.doubtful(found):
        out.doubtful[k] = "; ".join(doubts)
    if remarks := (*single.remarks(found), *doubts):
        out.remarks[k] = "; ".join(map(str, remarks))
    return values


def _reason(error: Exception) -> str:
    text = str(error) or type(error).__name__
    text = text.replace("about=m.equilibrium()", "about='equilibrium'")  # which studies take
    return text if isinstance(error, FlyballError) else f"{type(error).__name__}: {text}"
