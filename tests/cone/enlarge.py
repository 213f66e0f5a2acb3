"""A solver called until its rooms are large enough, as the stepper does."""

from __future__ import annotations

import numpy as np

from flyball.numerics.cone.problem import SMALL, Factor
from flyball.numerics.cone.solve import solve


def solved(solver, P, X, W, O, F):
    """Iterations used, and the factor's rooms that were large enough."""
    for _ in range(10):
        used = solve(solver, P, X, W, O, F)
        if O.count.ended != SMALL:
            return used, F
        F = Factor(np.zeros(O.count.needed_numbers), np.zeros(O.count.needed_places, np.int64))
    raise AssertionError("rooms are never large enough")
