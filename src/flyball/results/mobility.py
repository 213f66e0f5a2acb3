"""Mobility of a mechanism: degrees of freedom, free motions, redundant constraint sets and remedies."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from ..model.joint import Joint
from ..model.messages import kind_in_words
from ..model.model import Model

MAX_BODIES = 12  # number of bodies in a line
MAX_ELEMENTS = 12  # number of elements in a line
LEVEL_PLURALS = {"position": "positions", "velocity": "velocities"}


@dataclass(frozen=True)
class FreeMotion:
    """One free motion of a mechanism, with all other free coordinates at rest.

    Attributes
    ----------
    name : str
        Its name: a coordinate such as ``"A.angle"``, or a description such as ``"coupler turns about (1, 0, 0)"``.
    coordinate : str
        The coordinate, whose rate in ``velocity`` is 1; "" if the motion has none of a joint or a body.
    bodies : tuple of str
        Moving bodies.
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
    """Degrees of freedom by rank, by counting, and for general dimensions.

    Attributes
    ----------
    here : int
        Degrees of freedom by rank at this position.
    nearby : int
        Degrees of freedom by rank in reachable neighbouring positions: those of its true motion.
    generic : int
        Degrees of freedom for joints of the same kinds with general dimensions.
    gruebler : int
        Degrees of freedom by counting.
    positions : list of ndarray
        Neighbouring positions that were analysed.
    """

    here: int
    nearby: int
    generic: int
    gruebler: int
    positions: list[np.ndarray] = field(default_factory=list, compare=False, repr=False)

    @property
    def singular(self) -> bool:
        """Whether the rank is smaller here than in neighbouring positions."""
        return self.nearby < self.here

    @property
    def special(self) -> bool:
        """Whether some of the true degrees of freedom depend on special dimensions."""
        return self.generic < self.nearby

    @property
    def text(self) -> str:
        """In words."""
        said = []
        if self.singular and self.nearby == 0 and not self.positions:
            said.append(
                f"{_freedom_count(self.here)} for the moment only: it can shake, but not move, from this "
                f"singular position"
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
    """Change of one element by a remedy: its replacement, or None if it is left out."""

    name: str
    kind: str
    by: Joint | None

    @property
    def text(self) -> str:
        """In words."""
        if self.by is None:
            return f"leave out {self.kind} {self.name!r}"
        new = self.by.called or f"a {kind_in_words(type(self.by))} joint"
        axis = getattr(self.by, "axes", None) or self.by.axis
        along = "" if axis is None else f" with {'axes' if hasattr(self.by, 'axes') else 'axis'} {_axis_text(axis)}"
        return f"replace {self.kind} {self.name!r} by {new}{along}"


@dataclass(frozen=True)
class Remedy:
    """Changes that remove redundant constraints without adding freedom; empty if those for other sets suffice."""

    changes: tuple[JointChange, ...]

    @property
    def text(self) -> str:
        """In words."""
        return " and ".join(c.text for c in self.changes) or "the changes for the other sets do for this one too"

    def applied(self, model: Model) -> Any:
        """Return a copy of the mechanism with the changes made."""
        return model.changed({c.name: c.by for c in self.changes})

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        changes = [{"name": c.name, "by": None if c.by is None else type(c.by).__name__} for c in self.changes]
        return {"text": self.text, "changes": changes}


@dataclass(frozen=True)
class RedundantSet:
    """Elements with a minimal set of dependent constraints: without any one of them the others are independent.

    Attributes
    ----------
    elements : tuple of str
    count : int
        Number of redundant constraints.
    contradiction : str
        "" if they are consistent; else what they contradict each other in, ``"position"`` or ``"velocity"``.
    gap : float
        Size of the contradiction, at one of them (a driver, if there is one) with all others satisfied [unit].
    here_only : bool
        Whether they are dependent in this singular position only, and not in neighbouring ones.
    undetermined : dict
        Joint -> reaction components (world axes, on ``body_j``) that this leaves undetermined.
    cure : Remedy or None
        What to replace or leave out; remedies of the other sets are assumed to be applied.
    cut : str
        If no remedy was found: extent of the search, if it was cut off.
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
            return f"remedy: {self.cure.text}"
        if self.contradiction and self.drivers:
            return (
                f"remedy: leave out one of {', '.join(self.drivers)}, or make their laws compatible with the other "
                "constraints"
            )
        if self.here_only:
            return "remedy: another position or other dimensions; another joint does not help"
        if self.contradiction:
            return "remedy: correct their lengths, points or laws so that all can be satisfied"
        return f"no remedy by another joint was found{self.cut and f'; the search was cut {self.cut}'}"

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


MAX_LINES = 12  # number printed of each kind


class MobilityDetails(Protocol):
    """The analysed position of a mechanism, and further analyses on demand."""

    @property
    def gap(self) -> str:
        """Why it cannot be assembled, if so."""

    @property
    def assembly(self) -> Any:
        """The analysed position."""

    @property
    def velocities(self) -> np.ndarray:
        """A basis (nv, f) of the velocities that the rows allow; for a large mechanism a part of it."""

    @property
    def name(self) -> str:
        """Name of the mechanism."""

    def sets(self, m: Mobility) -> tuple[RedundantSet, ...]:
        """See `Mobility.sets`."""

    def motions(self, m: Mobility) -> tuple[FreeMotion, ...]:
        """See `Mobility.motions`."""

    def geometry(self, m: Mobility) -> FreedomGeometry:
        """See `Mobility.geometry`."""


@dataclass(frozen=True)
class Mobility:
    """Degrees of freedom and redundancy of a mechanism at a position.

    Attributes
    ----------
    velocities, rows, rank : int
        Velocities of all bodies, constraint rows, and how many of these are independent.
    redundant : tuple of str
        Elements with dependent rows.
    undetermined : dict
        Joint -> reaction components (world axes, on ``body_j``) that redundancy leaves undetermined.
    followed : int or None
        Number of redundant constraints evaluated for these two, if a mechanism is too large to evaluate all; None: all.
    """

    velocities: int
    rows: int
    rank: int
    redundant: tuple[str, ...] = ()
    undetermined: dict[str, tuple[str, ...]] = field(default_factory=dict)
    without: str = ""  # parts of the mechanism that are not counted
    found: MobilityDetails | None = field(default=None, compare=False, repr=False)
    followed: int | None = None

    @property
    def gruebler(self) -> int:
        """Degrees of freedom by counting rows (Gruebler and Kutzbach)."""
        return self.velocities - self.rows

    @property
    def freedoms(self) -> int:
        """Degrees of freedom by rank, at this position."""
        return self.velocities - self.rank

    @property
    def redundancy(self) -> int:
        """Number of redundant rows."""
        return self.rows - self.rank

    @property
    def cut(self) -> str:
        """Why `redundant` and `undetermined` are incomplete, if so."""
        if self.followed is None or self.followed >= self.redundancy:
            return ""
        return (
            f"named are those that {self.followed} of {self.redundancy} constraints too many touch: there may be more"
        )

    @cached_property
    def sets(self) -> tuple[RedundantSet, ...]:
        """The independent minimal sets of dependent constraints, with remedies."""
        return self.there.sets(self)

    @cached_property
    def motions(self) -> tuple[FreeMotion, ...]:
        """The free motions by name; for a large mechanism the first of them."""
        return self.there.motions(self)

    @cached_property
    def geometry(self) -> FreedomGeometry:
        """Degrees of freedom by counting, for general dimensions, and next to this position."""
        return self.there.geometry(self)

    @property
    def there(self) -> MobilityDetails:
        """The analysed position."""
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
