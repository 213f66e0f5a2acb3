"""Stops of coordinates, in numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...model.limit import Limit
from ...model.model import Model
from ...model.validity import told
from ..numbers import Numbers


@dataclass(frozen=True)
class Stop:
    """A stop of a coordinate: how far it goes [m or rad], inf where there is none, and how it bounces off."""

    element: Limit
    lower: float
    upper: float
    restitution: float


def stops(model: Model, given: Numbers) -> list[Stop]:
    """Every stop of a model."""
    out = []
    for e in model.limits:
        unit = model.unit(e.coordinate, e)
        low, high = told(e, given.env, {"lower": unit, "upper": unit})
        out.append(
            Stop(
                e,
                -np.inf if low is None else float(np.real(low)),
                np.inf if high is None else float(np.real(high)),
                float(np.real(given.of[e.name].restitution)),
            )
        )
    return out
