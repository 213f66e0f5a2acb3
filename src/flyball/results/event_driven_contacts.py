"""Contacts of a motion with event-driven integration: closed contact points, and their forces."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..constraints.switches.guard_kinds import OFF
from ..engine.entry_point import characteristic_rate_within
from ..engine.loads import direction_in_space
from ..math.vec import dot
from ..model.body import GROUND
from ..model.contact_point import Touch
from .contacts import SLIP, STICK, ContactBodies, Contacts, concatenate_contacts
from .recorded_kinematics import term_over_time

if TYPE_CHECKING:
    from .result import Result


class ContactHistory:
    """State of one contact point, and the force on the second side, at every output time."""

    def __init__(self, result: Result, element: Touch) -> None:
        self._result, self._s, self.element = result, result.values.structure, element
        self._switches = [k for k, x in enumerate(self._s.switches) if x.element is element and x.row >= 0]

    @property
    def known(self) -> bool:
        """Return whether the motion was computed with it."""
        return bool(self._switches) and self._result.phases is not None

    def _term(self, row: int) -> int:
        """Return the term of a row."""
        return next(k for k, t in enumerate(self._s.terms) if t.row == row)

    @cached_property
    def _rows(self) -> list[tuple[int, tuple]]:
        """Return (row, result of its formula) of the gap and of every slip."""
        rows = [self._s.switches[k].row for k in self._switches]
        return [(row, term_over_time(self._result, self._term(row))[2]) for row in rows]

    @cached_property
    def gap(self) -> np.ndarray:
        """Distance of the sides [m]."""
        return self._result.measured.quantity(self._s.switches[self._switches[0]].measured)[0]

    @cached_property
    def normal(self) -> np.ndarray:
        """From the first side to the second, (n, 3)."""
        return np.stack(self._rows[0][1][1], axis=1)

    @cached_property
    def pressure(self) -> np.ndarray:
        """Normal force [N]."""
        return self._result.multipliers[:, self._rows[0][0]]

    @cached_property
    def closed(self) -> np.ndarray:
        """Whether the contact is closed."""
        return self._result.phases.mode[self._switches[0]] != OFF  # type: ignore[union-attr]

    @cached_property
    def slides(self) -> np.ndarray:
        """Whether it slides."""
        if len(self._switches) < 2:
            return self.closed
        return self.closed & (self._result.phases.mode[self._switches[1]] == OFF)  # type: ignore[union-attr]

    @cached_property
    def tangents(self) -> np.ndarray:
        """Directions of the slip rows, (slips, n, 3)."""
        return np.array([np.stack(x[1], axis=1) for _, x in self._rows[1:]]).reshape(-1, len(self._result.t), 3)

    @cached_property
    def slip(self) -> np.ndarray:
        """Sliding velocity of the second side along the tangents [m/s], (slips, n)."""
        of = [self._s.switches[k].measured for k in self._switches[1:]]
        return np.array([self._result.measured.quantity(m)[1] for m in of]).reshape(-1, len(self._result.t))

    @cached_property
    def sliding(self) -> np.ndarray:
        """Sliding friction on the second side [N], (n, 3)."""
        d = self._result.phases.sigma[self._switches[1:]] + 0.0 * self.slip  # type: ignore[union-attr]
        if len(d) > 1:
            x, t = self._result.values, self._result.t
            pace = x.length * characteristic_rate_within(x.system, float(t[-1] - t[0]))
            for i in np.flatnonzero(self.slides).tolist():
                d[:, i] = direction_in_space(pace, tuple(d[:, i].tolist()), tuple(self.slip[:, i].tolist()))[:2]
        size = -self.element.friction[1] * self.pressure * self.slides
        return np.einsum("in,inc->nc", size * d, self.tangents)

    @cached_property
    def sticking(self) -> np.ndarray:
        """Static friction on the second side [N], (n, 3)."""
        held = [self._result.multipliers[:, row] for row, _ in self._rows[1:]]
        return np.einsum("in,inc->nc", np.array(held).reshape(-1, len(self._result.t)), self.tangents)

    @cached_property
    def force(self) -> np.ndarray:
        """On the second side [N], (n, 3)."""
        return self.pressure[:, None] * self.normal + self.sliding + self.sticking

    @cached_property
    def point(self) -> np.ndarray:
        """Point midway between the sides [m], (n, 3)."""
        _, M, _ = term_over_time(self._result, self._term(self._rows[0][0]))
        p = np.stack([x + self._result.records.zeros() for x in M[0]], axis=1)
        return p - (self.element.radius + 0.5 * self.gap)[:, None] * self.normal

    @property
    def power(self) -> np.ndarray:
        """Power of its friction [W]."""
        u = np.einsum("in,inc->nc", self.slip, self.tangents)
        return dot(tuple(self.sliding.T), tuple(u.T))


def event_driven_contacts(result: Result) -> Contacts | None:
    """Return every closed contact point at every output time; None if the motion was computed without."""
    if result.pieces:
        for p in result.pieces:
            p.contacts = event_driven_contacts(p)
        known = [p.contacts for p in result.pieces if p.contacts is not None]
        return concatenate_contacts(known, result.t) if known else None
    s = result.values.structure
    found = [x for e in s.model.forces if isinstance(e, Touch) and (x := ContactHistory(result, e)).known]
    if not found:
        return None
    names = [b.name for b in s.model.bodies] + [GROUND]
    carrier = {
        e: [names.index(s.model.carrier(n, e)) for n in (e.body_i, e.body_j)] for e in (x.element for x in found)
    }
    when = np.concatenate([np.flatnonzero(x.closed) for x in found])
    order = np.argsort(when, kind="stable")

    def joined(parts: list[np.ndarray]) -> np.ndarray:
        return np.concatenate([p[x.closed] for p, x in zip(parts, found, strict=True)])[order]

    n = len(result.t)
    ones = np.ones(n)
    return Contacts(
        t=result.t,
        sides=ContactBodies(names, [-1] * len(names)),
        begin=np.cumsum(np.r_[0, np.bincount(when, minlength=n)]),
        pair=joined([np.tile(carrier[x.element], (n, 1)) for x in found]),
        point=joined([x.point for x in found]),
        normal=joined([x.normal for x in found]),
        gap=joined([x.gap for x in found]),
        force=joined([x.force for x in found]),
        state=joined([np.where(x.slides, SLIP, STICK) for x in found]),
        friction=joined([np.where(x.slides, x.element.friction[1], x.element.friction[0]) * ones for x in found]),
        planar=result.planar,
    )
