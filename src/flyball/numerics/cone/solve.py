"""A solver called from Python."""

from __future__ import annotations

from ...compiler.kernels import Kernel
from .problem import Choices, Factor, Problem, Scratch, State


def solve(solver: Kernel, P: Problem, X: State, W: Scratch, O: Choices, F: Factor) -> int:
    """Solve in place.

    Parameters
    ----------
    solver : Kernel
        Of a file of this folder: `gauss_seidel.gauss_seidel`, ...
    P, X, W, O, F : Problem, State, Scratch, Choices, Factor
        See `problem` and `rooms`.

    Returns
    -------
    int
        Iterations used; how it ended, and how well, stands in O.
    """
    return int(solver(P, X, W, O, F, 0))
