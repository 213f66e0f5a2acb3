"""Accelerated projected gradient descent as published: Mazhar, Heyn, Negrut and Tasora 2015, algorithm 1."""

from __future__ import annotations

from ...compiler.kernels import kernel
from .accelerated import accelerated
from .problem import Choices, Factor, Problem, Scratch, State


@kernel
def apgd(P: Problem, X: State, W: Scratch, O: Choices, F: Factor, task: int) -> int:
    """Iterations until a step would change velocities by less than `ENOUGH`, at most `MOST`; how many there were."""
    return accelerated(P, X, W, O, -1.0, (True, 2.0, 0.9, 1.0 + 1e-9))
