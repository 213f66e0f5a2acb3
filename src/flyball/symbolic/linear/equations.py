"""Linear equations of a mechanism with expressions of its parameters in them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...errors import AnalysisError, ModelError
from ...graph.derivative import replaced
from ...graph.node import Node
from ...graph.values import evaluate, evaluated
from ...model.words import listing, suggest
from .derivatives import Derivatives, Perturbed
from .free import Free
from .reduced import Reduced, improper, product
from .traced import Mechanics


@dataclass
class LinearEquations:
    """x' = A x + B u, y = C x + D u, whose entries are expressions of the mechanism's parameters.

    The states are changes of as many coordinates as there are freedoms, then changes of their rates, as those of
    `LinearModel`.

    Attributes
    ----------
    name : str
    states, inputs, outputs : tuple of str
    state_units, input_units, output_units : tuple of str
    parameters : dict
        Name -> value of the parameters that have one of their own.
    A, B, C, D : ndarray of objects
        Nodes (see `Graph`) or numbers.
    mass, damping, stiffness : ndarray of objects or None
        M a'' + D a' + K a = 0 in the first half of the states; None with constraints on velocities only.
    conditions : list of Node
        What has to vanish for the point to be an equilibrium, where it does not by itself: the equations hold for
        parameters with which it does.
    balanced_by : dict
        Parameter -> the expression of the others that it stands for, since equilibrium asks for it.
    found : tuple of str
        Coordinates that are numbers at the point, whatever the parameters: loops were closed numerically.
    """

    name: str
    states: tuple[str, ...]
    state_units: tuple[str, ...]
    inputs: tuple[str, ...]
    input_units: tuple[str, ...]
    outputs: tuple[str, ...]
    output_units: tuple[str, ...]
    parameters: dict[str, float]
    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    mass: np.ndarray | None
    damping: np.ndarray | None
    stiffness: np.ndarray | None
    conditions: list[Node]
    balanced_by: dict[str, Node]
    found: tuple[str, ...]
    at: Perturbed = field(repr=False)
    free: Free = field(repr=False)
    mechanics: Mechanics = field(repr=False)

    def values(self, **parameters: float) -> dict[str, np.ndarray]:
        """A, B, C, D in numbers: with the parameters' own values, or others.

        Raises
        ------
        ModelError
            If there is no such parameter, or equilibrium says what it is.
        """
        told = self.told(parameters)
        return {k: evaluated(getattr(self, k), told).astype(float) for k in "ABCD"}

    def told(self, parameters: Mapping[str, float]) -> dict[str, float]:
        """Values by the names of symbols; refuses those that there are not."""
        for name in parameters:
            if name in self.balanced_by:
                raise ModelError(f"{name!r} has the value with which the mechanism is in equilibrium")
            if name not in self.parameters:
                known = list(self.parameters)
                raise ModelError(f"{self.name!r} has no parameter {name!r}{suggest(name, known)}; {listing(known)}")
        return {k: float(x) for k, x in parameters.items()}

    def eigenvalues(self, **parameters: float) -> np.ndarray:
        """Of A in numbers, (n,) complex [1/s]."""
        return np.linalg.eigvals(self.values(**parameters)["A"])

    def balance(self, **parameters: float) -> dict[str, float]:
        """Values of the parameters that balance, for values of the others."""
        told = self.told(parameters)
        found = evaluate(list(self.balanced_by.values()), told)
        return {k: float(x) for k, x in zip(self.balanced_by, found, strict=True)}

    def index(self, what: str, name: str | None) -> int:
        """Which input or output that is; the only one if not named."""
        names: tuple[str, ...] = getattr(self, f"{what}s")
        if name is None and len(names) == 1:
            return 0
        if name not in names:
            given = "say which" if name is None else f"there is no {what} {name!r}{suggest(name, list(names))}"
            there = listing(list(names)) if names else f"the equations were made without any: {what}s=[...]"
            raise ModelError(f"{given}; {there}")
        return names.index(name)


def told(
    m: Mechanics,
    d: Derivatives,
    p: Perturbed,
    f: Free,
    r: Reduced,
    names: tuple[Sequence[str], Sequence[str]],
) -> dict[str, Any]:
    """Matrices and names of states, inputs and outputs; ``names``: of outputs, and their units."""
    k, n = len(m.inputs), len(r.rate)
    y = _outputs(p, r, n, k)
    A, (B, B1, B2) = r.rate[:, :n], _parts(r.rate, n, k)
    C, (D, D1, D2) = y[:, :n], _parts(y, n, k)
    shift = B1 + product(A, B2)
    if bad := improper((D, D1 + product(C, B2), D2)):
        output, i, rate = bad
        raise AnalysisError(
            f"output {names[0][output]!r} follows the {rate} of input {m.inputs[i].name!r}, which no state-space model "
            f"can; leave out one of the two, or ask for the transfer function"
        )
    here, rates = ([m.names[d] for d in of] for of in (f.chosen, f.chosen_v))
    return {
        "states": (*(x.name for x in here), *(f"{x.name} rate" for x in rates)),
        "state_units": (*(x.unit for x in here), *(f"{x.unit}/s" for x in rates)),
        "inputs": tuple(i.name for i in m.inputs),
        "input_units": tuple(i.unit for i in m.inputs),
        "outputs": tuple(names[0]),
        "output_units": tuple(names[1]),
        "A": A,
        "B": B + product(A, shift),
        "C": C,
        "D": D + product(C, shift),
        "mass": r.M,
        "damping": r.D,
        "stiffness": r.K,
    }


def _parts(x: np.ndarray, n: int, k: int) -> list[np.ndarray]:
    """Columns of the inputs, of their first and of their second rates."""
    return [x[:, n + i * k : n + (i + 1) * k] for i in range(3)]


def _outputs(p: Perturbed, r: Reduced, n: int, k: int) -> np.ndarray:
    """Outputs by the states, the inputs and their rates, (outputs, n + 3 k)."""
    y = product(p.by["yx"], r.position) + product(p.by["yv"], r.velocity)
    y = y + product(p.by["ya"], r.acceleration) + product(p.by["yl"], r.multipliers)
    y[:, n : n + k] = y[:, n : n + k] + p.by["yw"]
    return y


def with_balance(p: Perturbed, pairs: Sequence[tuple[Node, Node]]) -> Perturbed:
    """With other expressions in place of parameters."""

    def new(X: np.ndarray) -> np.ndarray:
        out = X.copy()
        out.ravel()[:] = replaced(list(X.ravel()), pairs)
        return out

    return Perturbed({k: new(X) for k, X in p.value.items()}, {k: new(X) for k, X in p.by.items()}, new(p.N), new(p.T))
