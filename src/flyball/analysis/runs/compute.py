"""Runs of a study, one after the other: each is what the analysis makes of it by itself, and may fail by itself."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...errors import FlyballError
from ...model.model import Model
from ...numerics.integrators.tableaux import TABLEAUX
from ...results.study import DONE, FAILED
from ..motion.choice import AUTO as SUITABLE
from ..motion.engines import KEPT, has_code
from .reading import CURVE, Reading
from .single import Motion, Single

FEW = 3  # runs for which it is not worth while to look whether code pays


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


def prepared(question: Question, points: np.ndarray, runs: int) -> Question:
    """The same for so many runs, of which some points are given: code for their mechanism is made once, where it pays.

    The runs that it serves take it, the others go through the tables; the results are the same to the last bit.
    """
    o, model = question.options, question.model
    if runs <= FEW or not isinstance(question.single, Motion) or o.specialize is False:
        return question
    if model.contacts or model.bulk or o.method not in (SUITABLE, *TABLEAUX):
        return question
    for k in dict.fromkeys((0, len(points) // 2, len(points) - 1)):  # one may fail, and says why when its turn comes
        try:
            first = question.single.run(model, replace(question.at(points[k]), specialize=o.specialize is True))
        except FlyballError:
            continue
        made = o.specialize is True or has_code(first.values, first.health.evaluations, runs)
        return replace(question, options=replace(o, specialize=KEPT if made else False))
    return question


def compute(question: Question, points: np.ndarray, stopped: Callable[[], bool] = lambda: False) -> Answers:
    """The runs at some points; those that are left when ``stopped`` says so stay to be done."""
    started = time.perf_counter()
    out = question.empty(len(points))
    for k, point in enumerate(points):
        if stopped():
            break
        _run(question, point, out, k)
    out.seconds = time.perf_counter() - started
    return out


def _run(question: Question, point: np.ndarray, out: Answers, k: int) -> None:
    """One run, as number k: whatever it raises is its own, but an interrupt."""
    single = question.single
    try:
        found = single.run(question.model, question.at(point))
        for values, x in zip(out.values, single.read(found, question.asked, question.times), strict=True):
            values[k] = x
        if doubts := single.doubtful(found):
            out.doubtful[k] = "; ".join(doubts)
        if remarks := (*single.remarks(found), *doubts):
            out.remarks[k] = "; ".join(map(str, remarks))
    except Exception as error:
        out.status[k], out.reasons[k] = FAILED, _reason(error)
        return
    out.status[k] = DONE


def _reason(error: Exception) -> str:
    text = str(error) or type(error).__name__
    text = text.replace("about=m.equilibrium()", "about='equilibrium'")  # which studies take
    return text if isinstance(error, FlyballError) else f"{type(error).__name__}: {text}"
