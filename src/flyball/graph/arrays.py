"""Arrays of expressions and numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np


def zeros(*shape: int) -> np.ndarray:
    """Plain zeros among which expressions may stand."""
    out = np.empty(shape, object)
    out[...] = 0.0
    return out


def objects(x: Sequence[Any]) -> np.ndarray:
    """A vector of objects."""
    out = np.empty(len(x), object)
    out[:] = x
    return out
