"""APGD in the metric of the contacts' diagonal blocks, one product with N an iteration."""

from __future__ import annotations

from ...compiler.kernels import kernel
from .accelerated import accelerated
from .problem import Choices, Factor, Problem, Scratch, State


@kernel
def lean(P: Problem, X: State, W: Scratch, O: Choices, F: Factor, task: int) -> int:
    """Iterations until a step would change velocities by less than `ENOUGH`, at most `MOST`; how many there were.

    L starts at 1, since the metric is that of the blocks; the bound may be missed by a fiftieth, which near the
    solution is rounding.
    """
    return accelerated(P, X, W, O, 1.0, (False, 1.3, 0.998, 1.02))
