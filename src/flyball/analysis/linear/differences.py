"""Central differences by a parameter: of sixth order where a derivative is wanted, of second where one is checked.

What is differenced is solved to rounding and smooth in the parameter, so that the sixth order's error is some 1e-11 of
the derivative.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ...model.model import Model

STEP, CHECK = 2e-3, 1e-5  # of the parameter
WEIGHTS = {1: 0.75, 2: -0.15, 3: 1.0 / 60.0}

Found = Callable[[Mapping[str, float]], np.ndarray]


def derivative(model: Model, parameters: Mapping[str, float], name: str, found: Found) -> np.ndarray:
    """Derivative by a parameter of what a function makes of the parameters; sixth order."""
    h, at = _step(model, parameters, name, STEP)
    return sum(w * (found(at(k)) - found(at(-k))) for k, w in WEIGHTS.items()) / h  # type: ignore[return-value]


def check(model: Model, parameters: Mapping[str, float], name: str, found: Found) -> np.ndarray:
    """The same, second order."""
    h, at = _step(model, parameters, name, CHECK)
    return (found(at(1)) - found(at(-1))) / (2.0 * h)


def _step(
    model: Model, parameters: Mapping[str, float], name: str, part: float
) -> tuple[float, Callable[[int], Mapping[str, float]]]:
    value = model.environment(parameters)[name]
    h = part * (abs(value) or 1.0)
    return h, lambda k: {**parameters, name: value + k * h}
