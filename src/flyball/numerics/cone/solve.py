"""A solver called from Python: by its door, as the stepper does."""

from __future__ import annotations

from ...compiler.door import Door, enter
from ...compiler.held import held
from ...compiler.jit import kernel
from .problem import Choices, Factor, Problem, Scratch, State


@kernel
def solve_kernel(address, P, X, W, O, F):
    """Go through the door at an address."""
    return enter(address, held(P), held(X), held(W), held(O), held(F), 0)


def solve(solver: Door, P: Problem, X: State, W: Scratch, O: Choices, F: Factor) -> int:
    """Solve in place.

    Parameters
    ----------
    solver : Door
        Of a file of this folder: `gauss_seidel.gauss_seidel`, ...
    P, X, W, O, F : Problem, State, Scratch, Choices, Factor
        See `problem` and `rooms`.

    Returns
    -------
    int
        Iterations used; how it ended, and how well, stands in O.
    """
    return int(solve_kernel(solver.address(P, X, W, O, F), P, X, W, O, F))
