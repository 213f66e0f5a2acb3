"""A, B, C, D of the reduced equations, with names of states, inputs and outputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...graph.derivative import replaced
from ...graph.node import Node
from .derivatives import Perturbed
from .free import Free
from .reduced import Reduced, improper
from .solve import product
from .traced import Mechanics


@dataclass
class Matrices:
    """Arrays of objects: nodes or numbers.

    Attributes
    ----------
    improper : str
        Why there are no B, C and D: an output follows the rate of an input; else empty.
    """

    states: tuple[str, ...]
    state_units: tuple[str, ...]
    inputs: tuple[str, ...]
    input_units: tuple[str, ...]
    outputs: tuple[str, ...]
    output_units: tuple[str, ...]
    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    mass: np.ndarray | None
    damping: np.ndarray | None
    stiffness: np.ndarray | None
    improper: str = ""


def matrices(m: Mechanics, p: Perturbed, f: Free, r: Reduced, outputs: Sequence[tuple[str, str]]) -> Matrices:
    """Of the reduced equations, in the state in which rates of inputs do not appear; ``outputs``: names and units."""
    k, n = len(m.inputs), len(r.rate)
    y = _outputs(p, r, n, k)
    A, (B, B1, B2) = r.rate[:, :n], _parts(r.rate, n, k)
    C, (D, D1, D2) = y[:, :n], _parts(y, n, k)
    shift = B1 + product(A, B2)
    why = ""
    if bad := improper((D, D1 + product(C, B2), D2)):
        output, i, rate = bad
        why = (
            f"output {outputs[output][0]!r} follows the {rate} of input {m.inputs[i].name!r}, which no state-space "
            f"model can; leave out one of the two, or ask for the transfer function"
        )
    here, rates = ([m.names[d] for d in of] for of in (f.chosen, f.chosen_v))
    still = [(s, 0.0) for s in m.added]
    new = lambda X: None if X is None else _replaced(X, still)  # noqa: E731
    return Matrices(
        states=(*(x.name for x in here), *(f"{x.name} rate" for x in rates)),
        state_units=(*(x.unit for x in here), *(f"{x.unit}/s" for x in rates)),
        inputs=tuple(i.name for i in m.inputs),
        input_units=tuple(i.unit for i in m.inputs),
        outputs=tuple(name for name, _ in outputs),
        output_units=tuple(unit for _, unit in outputs),
        A=_replaced(A, still),
        B=_replaced(B + product(A, shift), still),
        C=_replaced(C, still),
        D=_replaced(D + product(C, shift), still),
        mass=new(r.M),
        damping=new(r.D),
        stiffness=new(r.K),
        improper=why,
    )


def _replaced(X: np.ndarray, pairs: Sequence[tuple[Node, float]]) -> np.ndarray:
    out = X.copy()
    out.ravel()[:] = replaced(list(X.ravel()), pairs)
    return out


def _parts(x: np.ndarray, n: int, k: int) -> list[np.ndarray]:
    """Columns of the inputs, of their first and of their second rates."""
    return [x[:, n + i * k : n + (i + 1) * k] for i in range(3)]


def _outputs(p: Perturbed, r: Reduced, n: int, k: int) -> np.ndarray:
    """Outputs by the states, the inputs and their rates, (outputs, n + 3 k)."""
    y = product(p.by["yx"], r.position) + product(p.by["yv"], r.velocity)
    y = y + product(p.by["ya"], r.acceleration) + product(p.by["yl"], r.multipliers)
    y[:, n : n + k] = y[:, n : n + k] + p.by["yw"]
    return y
