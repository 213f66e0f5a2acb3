"""The motion at one instant that is no output time: just before or after an event."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from .booked import at_stretch

if TYPE_CHECKING:
    from ..tables.values import Values
    from .result import Result


class Moment:
    """Positions and velocities at one instant: ``moment["block.vx"]``.

    Accelerations and forces of constraints have no value there: they jump.

    Attributes
    ----------
    t : float [s]
    y : ndarray
        State vector: coordinates, velocities, turns and works.
    values : Values
        The mechanism with the parameters of that time.
    came : tuple of (ndarray, int)
        The state that the motion came to the instant with, and whether this is before (0) or after (1) it.
    """

    def __init__(
        self, result: Result, values: Values, t: float, y: np.ndarray, came: tuple[np.ndarray, int] | None = None
    ) -> None:
        self._of, self.values, self.t, self.y, self.came = result, values, float(t), y, came

    @cached_property
    def stretch(self) -> int:
        """Which stretch of the motion it ends or begins; -1 where that is not known, as at the start."""
        every = self._of.stretches.all if self._of.stretches is not None else ()
        if self.came is None:
            return -1
        y, after = self.came
        found = next((k for k, x in enumerate(every) if np.array_equal(x.end, y)), -1)
        return found if found < 0 else min(found + after, len(every) - 1)

    @cached_property
    def alone(self) -> Result:
        """A result of this one time; what nobody knows there is nan."""
        r = self._of
        s = self.values.structure
        q, v, z = (p[None, :] for p in np.split(self.y, [s.nq, s.nq + s.nv]))
        unknown = np.full((1, s.nv), np.nan), np.full((1, len(s.rows) + len(s.prescribed)), np.nan)
        made = type(r)(r.model, self.values, np.array([self.t]), q, v, z, *unknown, r.health)
        made.wound = r.wound
        if self.stretch >= 0 and r.stretches is not None:
            made.begun, made.within = r.begun, (r, self.stretch)
            made.exchanged |= at_stretch(r, self.stretch)
            made.stretches = r.stretches.moment(self.stretch)
        return made

    def __getitem__(self, name: str) -> Any:
        """A curve such as ``"block.vx"`` as a number, or a vector such as ``"block.velocity"``.

        Raises
        ------
        ModelError
            If there is no such curve, or it jumps there.
        """
        value = np.asarray(self.alone.channel(name if "." in name else f"{name}.value")[1])[0]
        if not np.isfinite(value).all():
            raise ModelError(
                f"{name!r} has no value at the instant t = {self.t:.6g} s of an event: accelerations and forces of "
                f"constraints jump there; read positions, velocities and energies, or what is at output times"
            )
        return float(value) if np.ndim(value) == 0 else value

    def __repr__(self) -> str:
        return f"<{self._of.model.name!r} at t = {self.t:.6g} s>"
