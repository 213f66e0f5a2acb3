"""Locks: rows that are active or not as events say."""

from __future__ import annotations

from ...numerics.complementarity.dense_problem import BILATERAL
from .switch_kind import ANY_FORCE, OFF, Instant, ProblemRow, SwitchKind


class EventLock(SwitchKind):
    """A row that carries any force while it is locked."""

    def velocity_rows(self, n: Instant, s: int, at: tuple[float, ...], still: bool) -> list[ProblemRow]:
        """Return its row if it is locked."""
        return [ProblemRow(s, BILATERAL)] if n.S.switches.measured[s] >= 0 and n.mode[s] != OFF else []

    def acceleration_rows(self, n: Instant, s: int, at: tuple[float, ...], still: bool) -> list[ProblemRow]:
        """Return its row if it is locked."""
        return self.velocity_rows(n, s, at, still)


LOCK = EventLock(forces=ANY_FORCE, commanded=True, role="is locked", closing=("lock", ""), states=("locked", "free"))
"""A coordinate or a joint that events lock and release."""
