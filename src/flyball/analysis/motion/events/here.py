"""A motion at an instant at which something happens: what decides and acts reads it and writes to it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ....equations.engine import MOTION, evaluate
from ....equations.sharing import Sharing, sharing
from ....numerics.integrators.clock import NOW, Clock, T
from ....tables.specs import Structure
from ....tables.system import VALUE
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
    doubts : list of str
        What rigid bodies left open, in words, for the health.
    bounces : dict
        Switch -> `rest.Bounces`: how often it closed lately.
    swings : dict
        Switch -> when the last ways through its corner were (`swings`).
    counts : dict
        Event -> how often it happened so far.
    true : list of str
        Events whose comparisons were true as the motion began.
    acted : dict
        What was settled by events at the instant ``acted_at``, and by which action of which.
    nothing : mapping
        Guard -> what is zero of it at the instant, where that is known.
    zero : dict
        Event -> what its guard was, in size, where it last fired: zero to rounding.
    sides : dict
        Event -> the side that its guard was last on, where the motion ends within rounding of zero.
    fresh : bool
        Whether forces or velocities jump at the instant: the next step is then no wider than those of late.
    decider : Instant, optional
        What decides at its instants (`events.instant`).
    failed : Exception
        Why the motion cannot go on here.
    watched : str
        How closely it was looked for events, in words.
    method : str
        By what it was computed from when on, in words, where that was not one method.
    astray : frozenset of int
        Switches found where they should not be (`events.astray`): stops left the wrong way with no speed, which close
        without a bounce, and corners whose laws were on the wrong side.
    sharing : Sharing, optional
        What holds together and shares its forces (`equations.sharing`).
    tied : frozenset of tuple
        Guards (kind, switch) of what is at its end and is kept there by others (`events.idle`).
    least : dict
        Switch -> force that is rounding, of what takes part in the modes decided last.
    still : tuple of int
        Measured quantities whose rates what holds keeps at zero (`events.still`).
    seen : Segments, optional
        What held at the rows of output so far (`events.segments`).
    """

    start: Start
    clock: Clock
    records: list[Any] = field(default_factory=list)
    lost: float = 0.0
    stopped: str = ""
    fresh: bool = False
    decider: Any = None
    failed: Exception | None = None
    watched: str = ""
    method: str = ""
    given: float = 0.0
    kick: np.ndarray | None = None
    blows: list[Any] = field(default_factory=list)
    doubts: list[str] = field(default_factory=list)
    bounces: dict[int, Any] = field(default_factory=dict)
    swings: dict[int, list[float]] = field(default_factory=dict)
    tied: frozenset[tuple[int, int]] = frozenset()
    least: dict[int, float] = field(default_factory=dict)
    still: tuple[int, ...] = ()
    seen: Any = None
    sharing: Any = None
    counts: dict[str, int] = field(default_factory=dict)
    acted: dict[str, Any] = field(default_factory=dict)
    acted_at: float = float("nan")
    astray: frozenset[int] = frozenset()
    true: list[str] = field(default_factory=list)
    nothing: Mapping[int, float] = field(default_factory=dict)
    zero: dict[str, float] = field(default_factory=dict)
    sides: dict[str, float] = field(default_factory=dict)

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
    def group(self) -> Sharing:
        """What holds together and shares its forces: `sharing`, made when it is first asked for."""
        if self.sharing is None:
            self.sharing = sharing(len(self.c.system.switch_i), len(self.c.system.row_i))
        return self.sharing

    @property
    def q(self) -> np.ndarray:
        """Its positions, in place, (nq,)."""
        return self.y[: self.structure.nq]

    @property
    def v(self) -> np.ndarray:
        """Its velocities, in place, (nv,)."""
        return self.y[self.structure.nq : self.structure.nq + self.structure.nv]

    def evaluate(self) -> None:
        """Have kinematics, rows, forces and what is measured at the state of the instant in the scratch."""
        evaluate(*self.c.buffers, self.t, self.y.copy(), MOTION)

    def names(self) -> dict[str, float]:
        """Values of all that expressions of events may name, at the state last evaluated."""
        c, sensed = self.c, self.c.work.sensed
        return {"t": self.t, **c.values.env, **{k: float(sensed[VALUE, m]) for k, m in self.structure.slots.items()}}
