"""Stops: a quantity stays between two bounds; a closed bound pushes and does not pull."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...numerics.complementarity.dense_problem import AT_REST, BILATERAL, NO_IMPULSE, UNILATERAL
from .switch_kind import G_LOWER, G_PULL, G_UPPER, OFF, ONE_SIDED, Instant, ProblemRow, SwitchKind


class RigidStop(SwitchKind):
    """A row that is active at a bound while it pushes; impacts rebound by the coefficient of restitution."""

    def velocity_rows(self, n: Instant, s: int, at: tuple[float, ...], still: bool) -> list[ProblemRow]:
        """Return its row if it is at a bound."""
        return bound_rows(s, at) if at else []

    def acceleration_rows(self, n: Instant, s: int, at: tuple[float, ...], still: bool) -> list[ProblemRow]:
        """Return its row if it is at rest at a bound."""
        return bound_rows(s, at, AT_REST if n.mode[s] != OFF else NO_IMPULSE) if at and still else []

    def penetration(self, n: Instant, s: int) -> float:
        """Return by how much its quantity is beyond a bound."""
        return float(max(n.W.modes.lower[s] - n.x[s], n.x[s] - n.W.modes.upper[s]))

    def distance_from_bounds(self, modes: Any, numbers: Any, s: int, x: float) -> float:
        """Return by how much the quantity is beyond a bound."""
        return float(max(modes.lower[s] - x, x - modes.upper[s]))

    def follow_bound(self, modes: Any, ways: np.ndarray, s: int, x: float, near: float) -> None:
        """Hold the quantity at the present bound, or open."""
        modes.hold[s] = side = (modes.lower if ways[s] > 0.0 else modes.upper)[s]
        if abs(x - side) > near:
            modes.mode[s], ways[s] = OFF, 0.0

    def excess(self, x: np.ndarray, rate: np.ndarray, bounds: tuple[float, float]) -> np.ndarray | None:
        """Return by how much the quantity is beyond a bound."""
        return np.maximum(x - bounds[1], bounds[0] - x)

    def push_direction(self, x: float, bounds: tuple[float, float], near: float) -> float | None:
        """Return the direction away from the bound that it is at."""
        return 1.0 if abs(x - bounds[0]) <= near else -1.0 if abs(x - bounds[1]) <= near else None


def bound_rows(s: int, at: tuple[float, ...], state: int = AT_REST) -> list[ProblemRow]:
    """Return the row of a stop; a stop at both bounds is bilateral."""
    return [ProblemRow(s, BILATERAL)] if len(at) > 1 else [ProblemRow(s, UNILATERAL, at[0], state=state)]


STOP = RigidStop(
    guards=(G_LOWER, G_UPPER, G_PULL), forces=ONE_SIDED, bounded=True, role="is closed",
    closing=("close", "closes"), opening=("open", "opens"), states=("closed", "open"),
)  # fmt: skip
"""A rigid stop, a play."""
