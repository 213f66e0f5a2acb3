"""Mobility of a mechanism: freedoms, free motions, redundant constraint sets and the remedies found for them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from ..model.joint import Joint
from ..model.model import Model

MAX_BODIES = 12  # bodies that a line names
MAX_ELEMENTS = 12  # elements that a line names
LEVEL_PLURALS = {"position": "positions", "velocity": "velocities"}


@dataclass(frozen=True)
class FreeMotion:
    """One way in which a mechanism can move, with nothing else free moving.

    Attributes
    ----------
    name : str
        What stands for it: a coordinate such as ``"A.angle"``, or words such as ``"coupler turns about (1, 0, 0)"``.
    coordinate : str
        The coordinate, whose rate in ``velocity`` is 1; "" if the motion has none of a joint or a body.
    bodies : tuple of str
        Those that move.
    velocity : ndarray (nv,)
        Of the mechanism in absolute coordinates [m/s], [rad/s].
    """

    name: str
    coordinate: str
    bodies: tuple[str, ...]
    velocity: np.ndarray

    @property
    def text(self) -> str:
        """In words."""
        more = f" and {len(self.bodies) - MAX_BODIES} more" if len(self.bodies) > MAX_BODIES else ""
        moving = f"{', '.join(self.bodies[:MAX_BODIES])}{more} {'moves' if len(self.bodies) == 1 else 'move'}"
        return f"{self.name}: {moving}" if self.coordinate else self.name

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "name": self.name,
            "coordinate": self.coordinate,
            "bodies": list(self.bodies),
            "velocity": self.velocity.tolist(),
        }


@dataclass(frozen=True)
class FreedomGeometry:
    """What freedoms rest on.

    Attributes
    ----------
    here : int
        Freedoms by rank at this position.
    nearby : int
        Freedoms by rank next to it, in positions that the mechanism can move to: those of its true motion.
    generic : int
        Freedoms that joints of the same kinds have with general dimensions.
    gruebler : int
        Freedoms by counting.
    positions : list of ndarray
        Positions next to this one in which it was looked at.
    """

    here: int
    nearby: int
    generic: int
    gruebler: int
    positions: list[np.ndarray] = field(default_factory=list, compare=False, repr=False)

    @property
    def singular(self) -> bool:
        """Whether the rank is smaller here than next to it."""
        return self.nearby < self.here

    @property
    def special(self) -> bool:
        """Whether some of the true freedom rests on special dimensions."""
        return self.generic < self.nearby

    @property
    def text(self) -> str:
        """In words."""
        said = []
        if self.singular and self.nearby == 0 and not self.positions:
            said.append(
                f"{_freedom_count(self.here)} for the moment only: it can shake, but not move, from this singular position"
            )
        elif self.singular:
            said.append(f"singular position: {_freedom_count(self.here)} here, {self.nearby} next to it")
        if self.special:
            true = "true freedom" if self.nearby == 1 else "true freedoms"
            said.append(
                f"rests on special dimensions: Gruebler's count is {self.gruebler}, the {true} {self.nearby}; the same "
                f"joints with general dimensions would leave {self.generic}"
            )
        if not said:
            said.append(
                "no freedom is left"
                if self.here == 0
                else "general: no freedom rests on special dimensions or on this position"
            )
        return "; ".join(said)

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "here": self.here,
            "nearby": self.nearby,
            "generic": self.generic,
            "singular": self.singular,
            "special_dimensions": self.special,
            "text": self.text,
        }


def _freedom_count(n: int) -> str:
    return f"{n} freedom{'' if n == 1 else 's'}"


@dataclass(frozen=True)
class JointChange:
    """One element that a cure changes: what it is replaced by, or None where it is left out."""

    name: str
    kind: str
    by: Joint | None

    @property
    def text(self) -> str:
        """In words."""
        if self.by is None:
            return f"leave out {self.kind} {self.name!r}"
        new = self.by.called or f"a {type(self.by).__name__.lower()} joint"
        axis = getattr(self.by, "axes", None) or self.by.axis
        along = "" if axis is None else f" with {'axes' if hasattr(self.by, 'axes') else 'axis'} {_axis_text(axis)}"
        return f"replace {self.kind} {self.name!r} by {new}{along}"


@dataclass(frozen=True)
class Remedy:
    """Changes that take away what is too many and add no freedom; none where those for sets before do for this too."""

    changes: tuple[JointChange, ...]

    @property
    def text(self) -> str:
        """In words."""
        return " and ".join(c.text for c in self.changes) or "the changes for the sets before do for this one too"

    def applied(self, model: Model) -> Any:
        """A copy of the mechanism with the changes made."""
        return model.changed({c.name: c.by for c in self.changes})

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        changes = [{"name": c.name, "by": None if c.by is None else type(c.by).__name__} for c in self.changes]
        return {"text": self.text, "changes": changes}


@dataclass(frozen=True)
class RedundantSet:
    """Elements whose constraints depend on one another; without any one of them the others would not.

    Attributes
    ----------
    elements : tuple of str
    count : int
        Constraints too many.
    contradiction : str
        "" where they say the same twice; else what they disagree on, ``"position"`` or ``"velocity"``.
    gap : float
        By how much they disagree, seen at one of them (a driver, if there is one) if all others are fulfilled [unit].
    here_only : bool
        Whether they depend on one another in this singular position only, and not next to it.
    undetermined : dict
        Joint -> reaction components (world axes, on ``body_j``) that this leaves undetermined.
    cure : Cure or None
        What to replace or leave out; those of the sets before are taken as done.
    cut : str
        Where none was found: how far the search went, if there is more that could be tried.
    unit : str
        Of the gap: ``"m"``, ``"rad"``, ``"m/s"`` or ``"rad/s"``.
    """

    elements: tuple[str, ...]
    count: int
    contradiction: str = ""
    gap: float = 0.0
    here_only: bool = False
    undetermined: dict[str, tuple[str, ...]] = field(default_factory=dict)
    cure: Remedy | None = None
    drivers: tuple[str, ...] = ()
    cut: str = ""
    unit: str = ""

    @property
    def text(self) -> str:
        """In words."""
        names = ", ".join(self.elements[:MAX_ELEMENTS])
        names += f" and {len(self.elements) - MAX_ELEMENTS} more" if len(self.elements) > MAX_ELEMENTS else ""
        how = "constraint" if self.count == 1 else "constraints"
        if self.contradiction:
            what = LEVEL_PLURALS[self.contradiction]
            return f"contradictory: {names} cannot agree on {what}, {self.gap:.3g} {self.unit} apart"
        where = ", in this singular position only" if self.here_only else ""
        return f"{self.count} {how} too many among {names}{where}"

    @property
    def advice(self) -> str:
        """What to do about it."""
        if self.cure is not None:
            return f"cure: {self.cure.text}"
        if self.contradiction and self.drivers:
            return f"cure: leave out one of {', '.join(self.drivers)}, or make their laws agree with the rest"
        if self.here_only:
            return "cure: another position or other dimensions; it is no joint's fault"
        if self.contradiction:
            return "cure: correct the lengths, the points or the laws of these, so that all can be fulfilled"
        return f"no cure by another joint was found{self.cut and f'; the search was cut {self.cut}'}"

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "elements": list(self.elements),
            "count": self.count,
            "contradiction": self.contradiction,
            "gap": self.gap,
            "unit": self.unit,
            "here_only": self.here_only,
            "undetermined": {k: list(v) for k, v in self.undetermined.items()},
            "cure": None if self.cure is None else self.cure.as_dict(),
        } | ({"search_cut": self.cut} if self.cut else {})


def _axis_text(axis: Any) -> str:
    if isinstance(axis[0], (tuple, list)):
        return " and ".join(_axis_text(a) for a in axis)
    return "(" + ", ".join(f"{x:.4g}" if isinstance(x, float) else str(x) for x in axis) + ")"


MAX_LINES = 12  # of a kind that are printed


class MobilityDetails(Protocol):
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

    def geometry(self, m: Mobility) -> FreedomGeometry:
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
    found: MobilityDetails | None = field(default=None, compare=False, repr=False)
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
    def geometry(self) -> FreedomGeometry:
        """What the freedoms rest on: counting, special dimensions, or a singular position."""
        return self.there.geometry(self)

    @property
    def there(self) -> MobilityDetails:
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
        out += [("freedoms", m.text) for m in self.motions[:MAX_LINES]]
        if self.freedoms > MAX_LINES:
            out.append(("freedoms", f"... and {self.freedoms - MAX_LINES} more"))
        if self.without:
            out.append(("not counted", self.without))
        if not there.gap:
            out.append(("geometry", self.geometry.text))
        for s in self.sets[:MAX_LINES]:
            out += [("redundant", s.text), ("redundant", s.advice)]
        if (left := self.redundancy - sum(s.count for s in self.sets[:MAX_LINES])) > 0:
            out.append(("redundant", f"... and {left} more"))
        if self.cut:
            out.append(("redundant", self.cut))
        if self.undetermined:
            text = "; ".join(f"{k}: {', '.join(v)}" for k, v in list(self.undetermined.items())[:MAX_LINES])
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
