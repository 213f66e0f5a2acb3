"""What derivatives are asked of, whatever analysis makes the quantities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...model.model import Model


@dataclass
class Question:
    """What is asked: of which quantities, by which parameters, where."""

    model: Model
    of: tuple[str, ...]
    to: tuple[str, ...]
    t: float
    parameters: dict[str, float]
    times: np.ndarray
    about: str | None
    rtol: float
    atol: float
    coordinates: str
