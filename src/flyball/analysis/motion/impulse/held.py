"""The mechanism within a motion with contact: its own start, and what it does, put into the whole's arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ....model.model import Model
from ....stepping.joined import V_AFTER, V_BEFORE, Joined
from ....tables.values import Values
from ...assembly.start import Assembly
from ..start import Start, begin
from .alone import alone, stops_of, with_stops
from .going_on import part_of
from .mechanism import tables
from .parts import Parts


@dataclass
class Held:
    """The mechanism of a motion with contact.

    Attributes
    ----------
    start : Start
        Its own, of a model without the free bodies.
    joints : Joined
        Its tables in the step.
    """

    start: Start
    joints: Joined
    y: list[np.ndarray] = field(default_factory=list)
    vdot: list[np.ndarray] = field(default_factory=list)
    lam: list[np.ndarray] = field(default_factory=list)
    gaps: list[float] = field(default_factory=list)
    slips: list[float] = field(default_factory=list)

    def add(self, A: Joined, moved: bool) -> None:
        """Keep where it is now, and mean accelerations and multipliers of the step that led there, if one did."""
        h = float(A.real.step) if moved else 1.0
        self.y.append(A.clock.y[0].copy())
        self.vdot.append((A.wide[V_AFTER] - A.wide[V_BEFORE]) / h)
        self.lam.append(A.lam[0] + (A.lam[1] + A.lam[2]) / h)
        s = self.start.assembly.compiled.structure
        W = self.start.assembly.compiled.work
        lost = self.start.assembly.compiled.jacobian() @ A.clock.y[0, s.nq : s.nq + s.nv] - W.rows.nu
        self.gaps.append(float(np.abs(W.rows.value).max(initial=0.0)))
        self.slips.append(float(np.abs(lost).max(initial=0.0)))

    def into(self, whole: Values, q: np.ndarray, v: np.ndarray, vdot: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Put its coordinates, velocities and accelerations into the whole's; returns the whole's states, multipliers.

        All in absolute coordinates.
        """
        own, s = self.start.assembly.compiled.structure, whole.structure
        y, lam = np.array(self.y), np.array(self.lam)
        for name, b in own.place.items():
            if b >= 0:
                here, there, k = own.tables["tree"], s.tables["tree"], s.place[name]
                q[:, there.coordinates(k)] = y[:, here.coordinates(b)]
                v[:, there.velocities(k)] = y[:, own.nq :][:, here.velocities(b)]
                vdot[:, there.velocities(k)] = np.array(self.vdot)[:, here.velocities(b)]
        states = np.zeros((len(y), len(s.states)))
        for name, k in s.state_at.items():
            if name in own.state_at:
                states[:, k] = y[:, own.nq + own.nv + own.state_at[name]]
        out = np.zeros((len(y), len(whole.system.rows.law)))
        for name, rows in s.slices.items():
            out[:, rows] = lam[:, own.slices[name]]
        return states, out


def held_apart(
    whole: Values,
    t: float,
    parameters: Mapping[str, float] | None,
    found: Parts,
    first: int,
    base: Assembly | None = None,
) -> Held | None:
    """The mechanism of a model, if joints, forces or stops hold any of its bodies; ``first`` is its first mover.

    It begins where ``base`` is, or else as described.
    """
    if not found.held:
        return None
    model = whole.structure.model
    own = alone(with_stops(model), found.held)
    start = part_of(base, own, parameters) if base else begin(own, t, parameters, None, "absolute")
    return Held(start, tables(start, found.held, first, 1.0, stops_of(model, whole)))


def acting_values(model: Model, values: Values, parameters: Mapping[str, float] | None) -> Values:
    """Tables in which stops are forces, so that what they stop counts as held."""
    if all(e.acts() for e in model.limits):
        return values
    from ...compiled import compiled

    return compiled(with_stops(model), parameters=parameters).values
