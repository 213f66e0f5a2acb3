"""A motion at an instant at which something happens: what decides and acts reads it and writes to it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ....numerics.integrators.clock import NOW, Clock, T
from ....tables.specs import Structure
from ...compiled import Compiled
from ..start import Start


@dataclass
class Here:
    """A motion where it stands.

    Modes are in ``c.work.switch``, the sides of switches behind what is sensed (see `equations.guards`).

    Attributes
    ----------
    start : Start
        Where and in which coordinates it began.
    clock : Clock
        Of the integration: its time and state are those of the instant.
    records : list of Happening
        What happened so far, in order.
    lost : float
        Mechanical energy [J] that impacts and sudden changes took so far.
    given : float
        Mechanical energy [J] that kicks and changed parameters gave so far.
    stopped : str
        Why the motion ends here, in words; empty: it goes on.
    kick : ndarray, optional
        Generalised impulse (nv,) that is given at this instant: taken up by the next jump.
    blows : list
        What it is made of; see `results.struck.Struck`.
    bounces : dict
        Switch -> `rest.Bounces`: how often it closed lately.
    fresh : bool
        Whether the next step finds its first width anew: after a jump of forces or velocities the last one says little.
    failed : Exception
        Why the motion cannot go on here.
    watched : str
        How closely it was looked for events, in words.
    seen : Segments, optional
        What held at the rows of output so far (`events.segments`).
    """

    start: Start
    clock: Clock
    records: list[Any] = field(default_factory=list)
    lost: float = 0.0
    stopped: str = ""
    fresh: bool = False
    failed: Exception | None = None
    watched: str = ""
    given: float = 0.0
    kick: np.ndarray | None = None
    blows: list[Any] = field(default_factory=list)
    bounces: dict[int, Any] = field(default_factory=dict)
    seen: Any = None

    @property
    def c(self) -> Compiled:
        """Tables and scratch that the motion is computed with."""
        return self.start.assembly.compiled

    @property
    def structure(self) -> Structure:
        """Its integers."""
        return self.c.structure

    @property
    def t(self) -> float:
        """The instant [s]."""
        return float(self.clock.real[T])

    @property
    def y(self) -> np.ndarray:
        """The state there (q, v, z), to be written to in place, (ny,)."""
        return self.clock.y[NOW]

    @property
    def q(self) -> np.ndarray:
        """Its positions, in place, (nq,)."""
        return self.y[: self.structure.nq]

    @property
    def v(self) -> np.ndarray:
        """Its velocities, in place, (nv,)."""
        return self.y[self.structure.nq : self.structure.nq + self.structure.nv]
