"""The mechanism as drawn, read like any result: for pictures before anything is computed."""

from __future__ import annotations

import numpy as np

from ..model.model import Model
from ..tables.structure import structure
from ..tables.values import values
from .health import Health
from .result import Result


def drawn(model: Model) -> Result:
    """The mechanism where it is drawn, at rest and without loads, as a result with one time.

    Nothing is assembled and nothing compiled: bodies are where the description puts them, joints may be open.

    Raises
    ------
    ModelError
        If the description cannot be made into tables.
    """
    model = model.snapshot()
    x = values(structure(model), model.environment())
    s = x.structure
    still, loads = np.zeros((1, s.nv)), np.zeros((1, len(s.rows) + len(s.prescribed)))
    health = Health(True, "as drawn", 0.0, 0.0, 0, 0, 0, 0, 0.0)
    return Result(model, x, np.zeros(1), x.q[None], still, np.zeros((1, len(s.states))), still, loads, health)
