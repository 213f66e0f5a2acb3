"""A solver called until its rooms are large enough, as the stepper does."""

from __future__ import annotations

import numpy as np

from flyball.numerics.complementarity.contact_problem import STORAGE_TOO_SMALL, FactorStorage, solve_contacts


def solved(solver, P, X, W, O, F):
    """Iterations used, and the factor's rooms that were large enough."""
    for _ in range(10):
        used = solve_contacts(solver, P, X, W, O, F)
        if O.count.ended != STORAGE_TOO_SMALL:
            return used, F
        F = FactorStorage(np.zeros(O.count.needed_numbers), np.zeros(O.count.needed_places, np.int64))
    raise AssertionError("rooms are never large enough")
