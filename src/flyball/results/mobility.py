"""Freedoms and redundancy of a mechanism, with names."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from .freedoms import FreeMotion, Geometry, RedundantSet

LINES = 12  # of a kind that are printed


class Findings(Protocol):
    """Where a mechanism was looked at, and what finds out more about it when it is asked for."""

    @property
    def gap(self) -> str:
        """Why it cannot be assembled, if it cannot."""

    @property
    def assembly(self) -> Any:
        """The position that was looked at."""

    @property
    def velocities(self) -> np.ndarray:
        """A basis (nv, f) of the velocities that the rows allow; of a large mechanism some of it."""

    @property
    def name(self) -> str:
        """Of the mechanism."""

    def sets(self, m: Mobility) -> tuple[RedundantSet, ...]:
        """See `Mobility.sets`."""

    def motions(self, m: Mobility) -> tuple[FreeMotion, ...]:
        """See `Mobility.motions`."""

    def geometry(self, m: Mobility) -> Geometry:
        """See `Mobility.geometry`."""


@dataclass(frozen=True)
class Mobility:
    """Freedoms and redundancy of a mechanism at a position.

    Attributes
    ----------
    velocities, rows, rank : int
        Velocities of all bodies, constraint rows, and how many of these are independent.
    redundant : tuple of str
        Elements whose rows take part in a dependency.
    undetermined : dict
        Joint -> reaction components (world axes, on ``body_j``) that redundancy leaves undetermined.
    followed : int or None
        How many of the constraints too many these two come from, where a mechanism is so large that they are not
        found for all; None: for all.
    """

    velocities: int
    rows: int
    rank: int
    redundant: tuple[str, ...] = ()
    undetermined: dict[str, tuple[str, ...]] = field(default_factory=dict)
    without: str = ""  # what is there besides, and not counted
    found: Findings | None = field(default=None, compare=False, repr=False)
    followed: int | None = None

    @property
    def gruebler(self) -> int:
        """Freedoms by counting rows (Gruebler and Kutzbach)."""
        return self.velocities - self.rows

    @property
    def freedoms(self) -> int:
        """Freedoms by rank, at this position."""
        return self.velocities - self.rank

    @property
    def redundancy(self) -> int:
        """Rows that say nothing new."""
        return self.rows - self.rank

    @property
    def cut(self) -> str:
        """In words, whether `redundant` and `undetermined` are not complete."""
        if self.followed is None or self.followed >= self.redundancy:
            return ""
        return (
            f"named are those that {self.followed} of {self.redundancy} constraints too many touch: there may be more"
        )

    @cached_property
    def sets(self) -> tuple[RedundantSet, ...]:
        """The independent sets of constraints that depend on one another, each as small as can be, with cures."""
        return self.there.sets(self)

    @cached_property
    def motions(self) -> tuple[FreeMotion, ...]:
        """The free motions by name; of a large mechanism the first of them."""
        return self.there.motions(self)

    @cached_property
    def geometry(self) -> Geometry:
        """What the freedoms rest on: counting, special dimensions, or a singular position."""
        return self.there.geometry(self)

    @property
    def there(self) -> Findings:
        """Where it was looked at."""
        if self.found is None:
            raise ValueError("this count was made without its mechanism")
        return self.found

    def lines(self) -> list[tuple[str, str]]:
        """Label and text of what a reader wants to see first."""
        there = self.there
        out = [("mechanism", there.name)]
        if there.gap:
            out.append(("not closed", there.gap))
        out.append(("freedoms", f"{self.freedoms} at this position; counting gives {self.gruebler}"))
        out += [("freedoms", m.text) for m in self.motions[:LINES]]
        if self.freedoms > LINES:
            out.append(("freedoms", f"... and {self.freedoms - LINES} more"))
        if self.without:
            out.append(("not counted", self.without))
        if not there.gap:
            out.append(("geometry", self.geometry.text))
        for s in self.sets[:LINES]:
            out += [("redundant", s.text), ("redundant", s.advice)]
        if (left := self.redundancy - sum(s.count for s in self.sets[:LINES])) > 0:
            out.append(("redundant", f"... and {left} more"))
        if self.cut:
            out.append(("redundant", self.cut))
        if self.undetermined:
            text = "; ".join(f"{k}: {', '.join(v)}" for k, v in list(self.undetermined.items())[:LINES])
            out.append(("reactions not determined", text))
        return out

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "name": self.there.name,
            "closed": not self.there.gap,
            "velocities": self.velocities,
            "rows": self.rows,
            "rank": self.rank,
            "gruebler": self.gruebler,
            "freedoms": self.freedoms,
            "redundancy": self.redundancy,
            "redundant": list(self.redundant),
            "undetermined": {k: list(v) for k, v in self.undetermined.items()},
            "cut": self.cut,
            "motions": [m.as_dict() for m in self.motions],
            "sets": [s.as_dict() for s in self.sets],
            "geometry": None if self.there.gap else self.geometry.as_dict(),
        }

    def __str__(self) -> str:
        lines = self.lines()
        width = max(len(k) for k, _ in lines)
        labels = [k if not i or k != lines[i - 1][0] else "" for i, (k, _) in enumerate(lines)]
        return "\n".join(f"{k:<{width}}  {v}" for k, (_, v) in zip(labels, lines, strict=True))
