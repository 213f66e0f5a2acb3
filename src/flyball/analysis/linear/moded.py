"""How eigenvalues change with parameters, where the mechanism is drawn or rests; controllers in the loop, sampled too.

The matrix is exact, its derivatives are differences of sixth order of it; see ``eigenvalues`` for what follows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ...errors import ModelError
from ...results.linear import follow
from ...results.sensitivity import Sensitivity
from ..equilibrium import ABOUT, equilibrium, resting
from ..linearize import LinearizeOptions, small_motions, without_inputs
from .derivatives import Equations, State
from .differences import Found, aside, derivative
from .eigenvalues import changes
from .instant import instant
from .kinks import refuse_kinks
from .question import Question


def of_modes(a: Question) -> Sensitivity:
    """Eigenvalues and their derivatives; of sampled controllers multipliers from one cycle to the next."""
    matrix, unit = _loop(a) if a.model.controllers else _free(a)
    base = matrix(a.parameters)
    dA = np.array([derivative(a.model, a.parameters, name, matrix) for name in a.to])
    w, dw = changes(base, dA.reshape(len(a.to), *base.shape), lambda k: aside(a.model, a.parameters, a.to[k], matrix))
    of = tuple(f"eigenvalue {k}" for k in range(len(w)))
    return Sensitivity("modes", of, a.to, (unit,) * len(of), {}, np.array([a.t]), w[None], dw[None])


def at_modes(a: Question) -> Found:
    """The eigenvalues for any parameters, in the order of those that they were."""
    matrix, _ = _loop(a) if a.model.controllers else _free(a)
    A = matrix(a.parameters)
    first, _ = changes(A, np.zeros((0, *A.shape)))

    def found(parameters: Mapping[str, float]) -> np.ndarray:
        return follow(np.array([first, np.linalg.eigvals(matrix(parameters)).astype(complex)]))[1]

    return found


def _free(a: Question) -> tuple[Found, str]:
    """The matrix of a mechanism without controllers, in the free coordinates that it has at first; its unit."""
    about = _places(a)

    def state(parameters: Mapping[str, float]) -> State:
        return instant(a.model, about(parameters), t=a.t, parameters=parameters, coordinates="absolute")[0]

    begin = state(a.parameters)
    f, _, _ = without_inputs(begin)
    refuse_kinks(Equations(begin), np.zeros((len(begin.v), 1)), np.zeros((len(begin.v), 1)), a.to)
    return lambda parameters: without_inputs(state(parameters), like=f)[2].A, "1/s"


def _loop(a: Question) -> tuple[Found, str]:
    """The matrix of the closed loop, and its unit: none if it leads from one sample to another."""
    about = _places(a)

    def linear(parameters: Mapping[str, float]) -> Any:
        place = about(parameters)
        given = {"about": place, "t": None if place else a.t, "parameters": parameters, "coordinates": "absolute"}
        return small_motions(a.model, LinearizeOptions(**(ABOUT | given)))[0]

    first = linear(a.parameters)

    def found(parameters: Mapping[str, float]) -> np.ndarray:
        now = linear(parameters)
        if now.states != first.states:
            raise ModelError(f"the states there are {', '.join(now.states)}, and were {', '.join(first.states)}")
        return now.A

    return found, "" if first.period else "1/s"


def _places(a: Question) -> Callable[[Mapping[str, float]], Any]:
    """The equilibrium for any parameters, near the first; None where eigenvalues are of the mechanism as drawn."""
    begin: list[Any] = []

    def about(parameters: Mapping[str, float]) -> Any:
        if a.about != "equilibrium":
            return None
        begin.append(equilibrium(a.model, resting(a.t, parameters, begin[0] if begin else None)))
        return begin.pop() if len(begin) > 1 else begin[0]

    return about
