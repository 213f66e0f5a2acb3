"""How the runs of a study are computed: with all that they share, or each by itself."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

import numpy as np

from .compute import Answers, Question, compute
from .lean import Lean, shared
from .single import Motion

FEW = 3  # runs for which it is not worth while to look for what they share
Runner = Callable[[np.ndarray, Callable[[], bool]], Answers]
"""(points, whether to stop) -> answers."""


def timed(run: Runner, points: np.ndarray, stopped: Callable[[], bool]) -> Answers:
    """What it answers, and how long that took."""
    started = time.perf_counter()
    found = run(points, stopped)
    found.seconds = time.perf_counter() - started
    return found


def runner(question: Question, points: np.ndarray, runs: int = 0) -> Runner:
    """What computes the runs of a question, of which some points are given: all, or the first of so many ``runs``."""
    runs = max(len(points), runs)
    if runs > FEW and isinstance(question.single, Motion):
        for k in (0, len(points) // 2, len(points) - 1):  # one may fail
            if (found := shared(question, points[k], points, runs)) is not None:
                return Lean(found).compute
    return partial(compute, question)
