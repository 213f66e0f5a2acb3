"""Limits of controllers that have crossed: there is no output between them, and whatever asks for it ends."""

from __future__ import annotations

import numpy as np

from ...errors import AnalysisError
from ...laws.evaluation import evaluate
from ..compiled import Compiled

NEAR = 1e-6  # of their sizes: limits closer than this cross where something has just ended


def crossed(c: Compiled, t: float, near: float = NEAR) -> str:
    """The controller whose limits cross at the kinematics last evaluated, in words; else nothing."""
    S, W = c.values.system, c.work
    stack = np.zeros_like(W.stack)
    with np.errstate(all="ignore"):
        for e, names, laws in c.structure.ordered:
            low, high = (float(evaluate(S.code, S.const, at, stack, (t, 0.0 * t, 0.0 * t), W.sensed)) for at in laws)
            if low > high - near * (abs(low) + abs(high)):
                first, last = names
                return (
                    f"{e.title} has no output: its limits cross, {first} is {low:.6g} and {last} {high:.6g}. Give "
                    f"limits of which {first} stays below {last}"
                )
    return ""


def refuse_crossed(c: Compiled, t: float) -> None:
    """Refuse controllers whose limits cross at the kinematics last evaluated.

    Raises
    ------
    AnalysisError
        Naming one, its limits and the time.
    """
    if text := crossed(c, t, 0.0):
        raise AnalysisError(f"{c.structure.model.name!r}: at t = {t:.6g} s, {text}")
