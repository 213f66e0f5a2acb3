"""Locks and drivers: rows that are active or not as events say."""

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


class EventDriver(EventLock):
    """The row of a driver: like that of a joint while it is engaged, and a row of the impact at which it engages."""

    @property
    def decided(self) -> bool:
        """Return False: an engaged driver is a constraint, and no problem of forces decides about it."""
        return False

    def velocity_rows(self, n: Instant, s: int, at: tuple[float, ...], still: bool) -> list[ProblemRow]:
        """Return its row at the instant at which it engages."""
        return [ProblemRow(s, BILATERAL)] if s in n.engaging else []

    def acceleration_rows(self, n: Instant, s: int, at: tuple[float, ...], still: bool) -> list[ProblemRow]:
        """Return no row."""
        return []


EVENT_DRIVER = EventDriver(forces=ANY_FORCE, commanded=True, role="is engaged", states=("engaged", "released"))
"""A driver that events release and engage again."""
