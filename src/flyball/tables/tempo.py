"""How fast things go in a mechanism, by its description: what rates are compared with that are as good as none.

That is no matter of how long it is computed: what happens does not depend on that, and a motion that goes on finds
the same.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..math.products import inner
from ..math.scalar import real_parts
from ..model.body import GROUND
from ..model.expressions import number
from ..model.model import Model
from .numbers import Numbers

A_SECOND = 1.0  # [1/s]: where neither gravity nor any speed tells


def tempo(given: Numbers, model: Model, gravity: np.ndarray, length: Any) -> Any:
    """A rate of the mechanism's own [1/s]: of half swings of a pendulum as long as it, sqrt(g / length) / pi.

    Without gravity: of the fastest body or coordinate at the start, per length, or turning; a second, where all rests.
    """
    if (g := _size(gravity)).real > 0.0:
        return np.sqrt(g / length) / np.pi
    moving = [d for name, d in given.bodies.items() if name != GROUND]
    speeds = [x for d in moving for x in (_size(d.v) / length, _size(d.w))]
    for e in model.initial:
        if (rate := getattr(given.of.get(e.name), "rate", None)) is not None:
            unit = model.unit(e.name, e)
            size = _size(np.array([number(rate, given.env, f"{unit}/s", f"rate of {e.title}"), 0.0, 0.0]))
            speeds.append(size / length if unit == "m" else size)
    fastest = max(speeds, key=lambda x: x.real, default=0.0)
    return fastest if fastest.real > 0.0 else A_SECOND


def _size(x: np.ndarray) -> Any:
    """Length of a vector (3,); zero of what is zero, where a root has no derivative."""
    return np.sqrt(inner(x, x)) if real_parts(x).any() else 0.0
