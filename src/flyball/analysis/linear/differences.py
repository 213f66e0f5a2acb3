"""Central differences by a parameter: of sixth order where a derivative is wanted, of second where one is checked.

The step begins as a part of the parameter, or of the change of it that would change the mechanism by the whole, and is
made smaller or larger until the differences of sixth and of fourth order agree best: what is differenced is solved to
rounding, so that the error is some 1e-11 of the derivative.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ...errors import AnalysisError, ModelError
from ...model.model import Model
from ...tables.names import velocity_names
from ...tables.system import arrays
from ...tables.values import values
from ..compiled import compiled
from .loads import STEP as COMPLEX

STEP, CHECK = 2e-3, 1e-5  # of the parameter
SIXTH = np.array([0.75, -0.15, 1.0 / 60.0])
FOURTH = np.array([2.0 / 3.0, -1.0 / 12.0, 0.0])
AGREED = 1e-9  # of the derivative
ROUNDED = 1e-11  # of what is differenced
TRIES = 7

Found = Callable[[Mapping[str, float]], np.ndarray]


def derivative(model: Model, parameters: Mapping[str, float], name: str, found: Found) -> np.ndarray:
    """Derivative by a parameter of what a function makes of the parameters; sixth order.

    Raises
    ------
    AnalysisError, ModelError
        That of the function, if it fails however small the step is.
    """
    value = model.environment(parameters)[name]

    def at(h: float) -> tuple[float, np.ndarray, bool]:
        sides = [[found({**parameters, name: value + s * k * h}) for s in (1, -1)] for k in (1, 2, 3)]
        D = np.array([a - b for a, b in sides])
        best, other = (np.tensordot(weights, D, 1) / h for weights in (SIXTH, FOURTH))
        error, size = (float(np.abs(X).max(initial=0.0)) for X in (best - other, best))
        largest = max(float(np.abs(a).max(initial=0.0)) for pair in sides for a in pair)
        if error <= AGREED * size:
            error = 0.0
        return error, best, error * h <= ROUNDED * largest

    h = STEP * whole(model, parameters, name)
    best: tuple[float, np.ndarray] | None = None
    way = 0.1
    for _ in range(TRIES):
        try:
            error, found_, rounded = at(h)
        except (AnalysisError, ModelError) as error_:  # of a model: what a parameter so far off makes of it is none
            if type(error_) is AnalysisError:  # what is asked for is not there aside: no smaller step makes it so
                raise AnalysisError(f"a little to the side of {name!r} = {value:g}, {error_}") from None
            if way > 1.0:
                break
            h *= way
            continue
        better = best is None or error < best[0]
        if better:
            way = 10.0 if best is None and rounded else way
            best = error, found_
        if error == 0.0 or (rounded and way < 1.0) or (not better and way > 1.0):
            break
        h *= way
    return at(h)[1] if best is None else best[1]


def aside(model: Model, parameters: Mapping[str, float], name: str, found: Found) -> tuple[float, np.ndarray, str]:
    """The step with which differences begin, what is found that far aside, and the parameter's name."""
    h = STEP * whole(model, parameters, name)
    return h, found({**parameters, name: model.environment(parameters)[name] + h}), name


def check(model: Model, parameters: Mapping[str, float], name: str, found: Found) -> np.ndarray:
    """The same with one small step, second order."""
    value = model.environment(parameters)[name]
    h = CHECK * whole(model, parameters, name)
    return (found({**parameters, name: value + h}) - found({**parameters, name: value - h})) / (2.0 * h)


def whole(model: Model, parameters: Mapping[str, float], name: str) -> float:
    """The parameter itself; if it is zero, the change of it that changes something of the mechanism by the whole.

    Places count as parts of the mechanism's length, other numbers as parts of the largest of their kind.
    """
    value = float(np.real(model.environment(parameters)[name]))
    if value:
        return abs(value)
    c = compiled(model, parameters=parameters)
    v = values(c.structure, {**c.parameters, name: complex(value, COMPLEX)})
    length = c.values.length
    scales = [(v.system.frames.position, length)]
    places = np.array([n.unit == "m" for n in velocity_names(c.structure)])
    scales += [(v.v[places], length), (v.v[~places], 1.0), (v.q, length)]
    for table in ("bodies", "term_parameters", "force_parameters", "gravity", "units"):
        for _, x in arrays(getattr(v.system, table)):
            columns = np.atleast_2d(x.T)
            scales += [(x, np.abs(x.real).max()) for x in columns if len(x) and np.abs(x.real).max() > 0.0]
    effect = max((float(np.abs(np.imag(x)).max(initial=0.0)) / COMPLEX / s for x, s in scales), default=0.0)
    return 1.0 / effect if effect > 0.0 else 1.0
