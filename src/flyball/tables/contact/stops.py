"""Stops of coordinates, in numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...forces.limit import Limit
from ...model.model import Model
from ..numbers import Numbers


@dataclass(frozen=True)
class Stop:
    """A stop of a coordinate: how far it goes [m or rad], inf where there is none, and how it bounces off."""

    element: Limit
    lower: float
    upper: float
    restitution: float


def stops(model: Model, given: Numbers) -> list[Stop]:
    """Every rigid stop of a model."""
    out = []
    for e in model.limits:
        if isinstance(e, Limit) and not e.acts():
            lower, upper, bounce, *_ = e.switched(given.of[e.name], "", 0.0)
            out.append(Stop(e, float(np.real(lower)), float(np.real(upper)), float(np.real(bounce))))
    return out
