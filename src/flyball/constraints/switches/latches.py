"""Latches: a quantity moves freely one way. A freewheel locks anywhere, a ratchet at its teeth."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from ...numerics.complementarity.dense_problem import AT_REST, NO_IMPULSE, UNILATERAL
from .stop import RigidStop
from .switch_kind import (
    G_BACK,
    G_LOWER,
    G_PULL,
    G_REVERSES,
    OFF,
    ONE_SIDED,
    SLOW_ACCELERATION,
    TURN,
    Instant,
    ProblemRow,
    SwitchKind,
)

TOOTH_TOLERANCE = 1e-9  # part of the pitch within which a tooth is reached


class OneWayLatch(SwitchKind):
    """A row that is active while it pushes; an impact against its direction has no rebound."""

    def velocity_rows(self, n: Instant, s: int, at: tuple[float, ...], still: bool) -> list[ProblemRow]:
        """Return its row."""
        return [ProblemRow(s, UNILATERAL, state=AT_REST)]

    def acceleration_rows(self, n: Instant, s: int, at: tuple[float, ...], still: bool) -> list[ProblemRow]:
        """Return its row if the quantity is at rest."""
        return [ProblemRow(s, UNILATERAL, state=AT_REST if n.mode[s] != OFF else NO_IMPULSE)] if still else []

    def start_violation(self, n: Instant, s: int) -> float:
        """Return the speed against its direction, as a displacement at the mechanism's own rate."""
        return float(-n.rate[s] / n.characteristic_rate)

    def excess(self, x: np.ndarray, rate: np.ndarray, bounds: tuple[float, float]) -> np.ndarray:
        """Return the speed against its direction."""
        return -rate

    def push_direction(self, x: float, bounds: tuple[float, float], near: float) -> float:
        """Return 1: at rest it always holds."""
        return 1.0


class RatchetLatch(RigidStop):
    """A stop at the last tooth passed: its lower bound is removed while it moves forwards."""

    def initial_numbers(self, named: dict[str, Any]) -> dict[str, Any]:
        """Return its numbers with the bounds at the start: between these teeth."""
        return named | {"lower": named["tooth"], "upper": named["tooth"] + named["pitch"]}

    def prepare(self, n: Instant, s: int, still: bool) -> None:
        """Set the bound of a ratchet that does not hold: none forwards, the last passed tooth backwards."""
        modes = n.W.modes
        first, modes.upper[s] = modes.upper[s] < np.inf, np.inf
        if n.mode[s] != OFF:
            modes.lower[s] = n.hold[s]  # for continued motions too
        elif n.rate[s] > 0.0 and not still:
            _move_freely(n, s)
        elif first or n.way[s] >= 0.0:
            tooth, pitch = n.S.switch_numbers.tooth[s], n.S.switch_numbers.pitch[s]
            modes.lower[s] = tooth + pitch * np.floor((n.x[s] - tooth) / pitch + TOOTH_TOLERANCE)
            n.ways()[s] = n.way[s] = -1.0

    def finish(self, n: Instant, s: int, hit: Collection[int]) -> None:
        """Set a ratchet free whose tooth opened or rebounded from an impact, or that begins to move."""
        if n.W.modes.mode[s] != OFF:
            return
        slow = abs(n.rate[s]) <= 2.0 * TURN * n.unit[s] * n.characteristic_rate
        if (
            n.mode[s] != OFF
            or s in hit
            or (slow and n.acceleration(s) > SLOW_ACCELERATION * n.unit[s] * n.characteristic_rate**2)
        ):
            _move_freely(n, s)
        else:
            n.ways()[s] = n.way[s]

    def start_violation(self, n: Instant, s: int) -> float:
        """Return 0: every position is between two teeth."""
        return 0.0

    def penetration(self, n: Instant, s: int) -> float:
        """Return 0: its bounds follow the motion."""
        return 0.0

    def distance_from_bounds(self, modes: Any, numbers: Any, s: int, x: float) -> float:
        """Return the distance of the held position from the nearest tooth."""
        if modes.mode[s] == OFF:
            return 0.0
        off = (modes.hold[s] - numbers.tooth[s]) / numbers.pitch[s]
        return float(abs(off - round(off)) * numbers.pitch[s])

    def follow_bound(self, modes: Any, ways: np.ndarray, s: int, x: float, near: float) -> None:
        """Keep the position: it is on a tooth."""

    def excess(self, x: np.ndarray, rate: np.ndarray, bounds: tuple[float, float]) -> None:
        """Return None: the rule depends on the teeth passed before."""

    def push_direction(self, x: float, bounds: tuple[float, float], near: float) -> float | None:
        """Return 1 on a tooth; the bounds are those of the start, one pitch apart."""
        tooth, pitch = bounds[0], bounds[1] - bounds[0]
        return 1.0 if abs(x - tooth - pitch * round((x - tooth) / pitch)) <= near else None


def _move_freely(n: Instant, s: int) -> None:
    """Remove the bound of a ratchet until it reverses."""
    n.ways()[s] = n.way[s] = 1.0
    n.W.modes.lower[s] = -np.inf


ONE_WAY = OneWayLatch(
    guards=(G_BACK, G_PULL), forces=ONE_SIDED, role="turns in one direction only", closing=("lock", "locks"),
    opening=("overrun", "overruns"), states=("holds", "overruns"),
)  # fmt: skip
"""A freewheel, a check valve."""
RATCHET = RatchetLatch(
    guards=(G_LOWER, G_REVERSES, G_PULL), forces=ONE_SIDED, bounded=True, numbers=("tooth", "pitch", "restitution"),
    role="is latched", closing=("latch", "latches"), opening=("unlatch", "lets go"), states=("holds", "free"),
    misplaced="it is locked between teeth",
)  # fmt: skip
"""A ratchet and its pawl."""
