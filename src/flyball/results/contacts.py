"""Contacts of a motion: contact points at each output time, and their forces.

`Contacts` is a table with one row per contact and output time; `PairForce` sums the rows of a pair of bodies or sets.
For an event-driven motion the table is computed from its constraint rows (`ContactHistory`), at closed contact points.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..constraints.switches.switch_kind import OFF
from ..engine.entry_point import characteristic_rate_within
from ..engine.loads import direction_in_space
from ..errors import ModelError
from ..math.vec import dot
from ..model.body import GROUND
from ..model.contact_point import Touch
from ..model.messages import listing, suggest
from ..model.quantities import MEMBER
from .convergence import Convergence, concatenate_histories
from .motion_record import term_over_time

if TYPE_CHECKING:
    import pandas

    from .result import Result


STICK, SLIP, OPEN = 0, 1, 2
STATES = ("stick", "slip", "open")


class ContactBodies:
    """The sides of contacts: single bodies, ground and the members of sets, numbered consecutively.

    Parameters
    ----------
    names : names
        Names of bodies, of ``"ground"``, and of sets of bodies.
    counts : int
        For each name the number of members of the set, -1 for a single body.
    """

    def __init__(self, names: Iterable[str], counts: Iterable[int]) -> None:
        self.names, self.counts = tuple(names), tuple(int(n) for n in counts)
        self.first = np.cumsum([0, *(1 if n < 0 else n for n in self.counts)])

    def __len__(self) -> int:
        return int(self.first[-1])

    def name(self, k: int) -> str:
        """Name of side ``k``: ``"ball"``, or ``"balls[17]"`` of a set."""
        owner = int(np.searchsorted(self.first, k, "right")) - 1
        return self.names[owner] if self.counts[owner] < 0 else f"{self.names[owner]}[{k - self.first[owner]}]"

    def span(self, name: str) -> tuple[int, int]:
        """The first side of a name, and the one after its last: of a body, a set, or a member such as ``"balls[17]"``.

        Raises
        ------
        ModelError
            If there is none of that name.
        """
        owner, k = name, -1
        if name not in self.names and (found := MEMBER.fullmatch(name)):
            owner, k = found[1], int(found[2])
        if owner not in self.names:
            known = listing(list(self.names))
            raise ModelError(f"nothing that can touch is named {name!r}{suggest(name, self.names)}; {known}")
        at = self.names.index(owner)
        low, high = int(self.first[at]), int(self.first[at + 1])
        if k < 0:
            return low, high
        if self.counts[at] < 0 or k >= high - low:
            rule = "is a single body" if self.counts[at] < 0 else f"has the members 0 to {high - low - 1}"
            raise ModelError(f"there is no {name!r}: {owner!r} {rule}")
        return low + k, low + k + 1

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ContactBodies) and (self.names, self.counts) == (other.names, other.counts)

    __hash__ = None  # type: ignore[assignment]


CONTACT_COLUMNS = {  # columns of the table: type, numbers a row
    "pair": ("i8", 2),
    "point": ("f8", 3),
    "normal": ("f8", 3),
    "gap": ("f8", 0),
    "force": ("f8", 3),
    "state": ("i8", 0),
    "friction": ("f8", 0),
}


@dataclass(frozen=True, eq=False)
class Contacts:
    """Contacts at the output times, row by row; the rows of time ``i`` are ``begin[i]`` to ``begin[i + 1]``.

    ``run.contacts.at(0.5)``, ``run.contacts.between("ball", "ground")``, ``run.contacts.on("ball")``. With impulse time
    stepping the rows of a time are the contacts of the step that ends there. Such a step detects contacts in the poses
    at its start: ``point`` and ``gap`` belong to these, a step before the poses of the result at that time. With every
    other method they belong to the output time. With lever arms from the mass centres at that time, the torques are
    those that act on the bodies: to rounding, except for contacts of two moving bodies with impulse time stepping,
    where the lever arms of both differ by half a step's motion.

    Attributes
    ----------
    t : ndarray (n,) [s]
    sides : ContactBodies
        The sides.
    begin : ndarray (n + 1,) of int
    pair : ndarray (k, 2) of int
        The two sides, as `ContactBodies` counts them.
    point : ndarray (k, 3) [m]
        Where the force acts, midway between the surfaces, world axes; with impulse time stepping at the start of the
        step.
    normal : ndarray (k, 3)
        From the first side to the second; with impulse time stepping the direction used for the impulse, at the start
        of the step or at its middle.
    gap : ndarray (k,) [m]
        Negative if they overlap; with impulse time stepping at the start of the step.
    force : ndarray (k, 3) [N]
        On the second side, the mean over the step that ends at the time, world axes.
    state : ndarray (k,) of int
        `STICK`, `SLIP` or `OPEN`, with names in `STATES`.
    friction : ndarray (k,)
        The coefficient that was used.
    history : Convergence or None
        Residuals of the solves over their iterations, with ``fb.Stepping(history=...)``.
    planar : bool
    """

    t: np.ndarray
    sides: ContactBodies
    begin: np.ndarray
    pair: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    gap: np.ndarray
    force: np.ndarray
    state: np.ndarray
    friction: np.ndarray
    history: Convergence | None = None
    planar: bool = False
    _known: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        """Refuse tables that do not fit together."""
        k, n = len(self.pair), len(self.t)
        for name, (_, width) in CONTACT_COLUMNS.items():
            want = (k, width) if width else (k,)
            if np.shape(getattr(self, name)) != want:
                raise ValueError(f"contacts: {name} must have shape {want}, got {np.shape(getattr(self, name))}")
        b = np.asarray(self.begin)
        if b.shape != (n + 1,) or b[0] != 0 or b[-1] != k or (np.diff(b) < 0).any():
            raise ValueError(f"contacts: begin must ascend from 0 to {k} in {n + 1} steps")
        if k and not (np.min(self.pair) >= 0 and np.max(self.pair) < len(self.sides)):
            raise ValueError(f"contacts: pair names sides beyond the {len(self.sides)} that there are")

    def __len__(self) -> int:
        return len(self.pair)

    @cached_property
    def when(self) -> np.ndarray:
        """Index of the output time of each row."""
        return np.repeat(np.arange(len(self.t)), np.diff(self.begin))

    @cached_property
    def normal_force(self) -> np.ndarray:
        """Along the normal, pressing positive [N], (k,)."""
        return np.einsum("ij,ij->i", self.force, self.normal)

    @cached_property
    def tangential_force(self) -> np.ndarray:
        """In the tangent plane, on the second side [N], (k, 3)."""
        return self.force - self.normal_force[:, None] * self.normal

    @property
    def worst_overlap(self) -> float:
        """Deepest overlap of the contacts in the table [m]; 0 if there is none. For the poses see `Contacts`."""
        return float(-np.min(self.gap, initial=0.0))

    @property
    def count(self) -> np.ndarray:
        """Contacts at each output time, (n,)."""
        return np.diff(self.begin)

    def at(self, t: float) -> Contacts:
        """The contacts at the output time nearest to ``t`` [s], as a table of one time.

        Raises
        ------
        ModelError
            If ``t`` is no number or outside of the motion.
        """
        if not len(self.t):
            raise ModelError("the motion has no output times, so there are no contacts to read")
        low, high = float(self.t[0]), float(self.t[-1])
        slack = 1e-9 * max(high - low, abs(high))
        if not isinstance(t, (int, float, np.number)) or not low - slack <= float(t) <= high + slack:
            raise ModelError(f"contacts: t is {t!r}; it must be a time [s] from {low:g} to {high:g}")
        return self.at_times([int(np.abs(self.t - float(t)).argmin())])

    def at_times(self, times: Sequence[int] | np.ndarray) -> Contacts:
        """Return the table at some of the output times, by their indices; repeated indices are permitted."""
        times = np.asarray(times, int)
        begin = np.r_[0, np.cumsum(self.count[times])]
        rows = np.arange(begin[-1]) + np.repeat(np.asarray(self.begin)[times] - begin[:-1], self.count[times])
        own = {name: getattr(self, name)[rows] for name in CONTACT_COLUMNS}
        return replace(self, t=self.t[times], begin=begin, **own)

    def between(self, a: str, b: str) -> PairForce:
        """Return the contact force of ``a`` on ``b`` over time: the sum over all their contacts.

        Parameters
        ----------
        a, b : str
            Names of bodies, of ``"ground"``, of sets (all their members), or of members: ``"balls[17]"``.

        Raises
        ------
        ModelError
            If there is none of these names.
        """
        return self._summed(b, a)

    def on(self, name: str) -> PairForce:
        """Return the contact force of all others on a body, a member of a set, or a whole set, over time."""
        return self._summed(name, None)

    def _summed(self, on: str, by: str | None) -> PairForce:
        if (on, by) not in self._known:
            self._known[on, by] = pair_force(self, on, by)
        return self._known[on, by]

    def force_on(self, low: int, high: int) -> np.ndarray:
        """The summed contact forces on the sides ``low`` to ``high`` (excluded), (n, high - low, 3) [N], world axes."""
        n, m = len(self.t), high - low
        out = np.zeros((n * m, 3))
        for side, sign in ((0, -1.0), (1, 1.0)):
            k = self.pair[:, side]
            own = (k >= low) & (k < high)
            at = self.when[own] * m + k[own] - low
            for c in range(3):
                out[:, c] += sign * np.bincount(at, self.force[own, c], n * m)
        return out.reshape(n, m, 3)

    def names(self) -> list[tuple[str, str]]:
        """Names of the two sides, row by row."""
        return [(self.sides.name(a), self.sides.name(b)) for a, b in self.pair.tolist()]

    def table(self) -> dict[str, np.ndarray]:
        """Every row as columns: time, names of the sides, x, y, z, normal, gap, force, state, friction."""
        names = self.names()
        out = {
            "t": self.t[self.when],
            "side_1": _text_array([a for a, _ in names]),
            "side_2": _text_array([b for _, b in names]),
        }
        axes = "xy" if self.planar else "xyz"
        for label, what in (("", self.point), ("n", self.normal), ("f", self.force)):
            out |= {f"{label}{a}": what[:, k] for k, a in enumerate(axes)}
        states = np.array(STATES)[self.state]
        return out | {"gap": self.gap, "normal_force": self.normal_force, "state": states, "friction": self.friction}

    def to_dataframe(self) -> pandas.DataFrame:
        """The table as a data frame, units in ``attrs["units"]``."""
        import pandas as pd

        frame = pd.DataFrame(self.table())
        lengths, forces = ("x", "y", "z", "gap"), ("fx", "fy", "fz", "normal_force")
        units = {"t": "s"} | dict.fromkeys(lengths, "m") | dict.fromkeys(forces, "N")
        frame.attrs["units"] = {k: units.get(k, "1") for k in frame.columns}
        return frame

    def pairs(self) -> list[tuple[str, str]]:
        """The pairs that touched, each once, in the order of `ContactBodies`."""
        return [(self.sides.name(a), self.sides.name(b)) for a, b in np.unique(self.pair, axis=0).tolist()]

    def plot(self, *pairs: Sequence[str], path: str | os.PathLike | None = None) -> Any:
        """Plot normal and tangential forces of pairs over time; see `flyball.view.force_plots.plot_contacts`."""
        from ..view.force_plots import plot_contacts

        return plot_contacts(self, pairs, path)

    def lines(self) -> list[tuple[str, str]]:
        """Labels and texts for people."""
        if not len(self):
            return [("contacts", "none at any output time")]
        parts = [f"{n} {STATES[k]}" for k, n in enumerate(np.bincount(self.state, minlength=3).tolist()) if n]
        most = int(self.count.max())
        worst = f"{self.worst_overlap:.2g} m"
        return [
            ("contacts", f"{len(self)} at {len(self.t)} times, {most} at most at once: {', '.join(parts)}"),
            ("worst overlap", worst),
            ("largest force", f"{float(np.sqrt((self.force**2).sum(axis=1)).max()):.4g} N"),
        ]

    def as_dict(self) -> dict[str, Any]:
        """Every row as plain lists."""
        return {k: v.tolist() for k, v in self.table().items()}

    def __repr__(self) -> str:
        return "\n".join(f"{k:<14} {v}" for k, v in self.lines())


def concatenate_contacts(every: Sequence[Contacts], t: np.ndarray) -> Contacts:
    """Concatenate contacts of consecutive times."""
    begin = np.concatenate([[0], *(c.count for c in every)]).cumsum()
    columns: dict[str, Any] = {name: np.concatenate([getattr(c, name) for c in every]) for name in CONTACT_COLUMNS}
    history = concatenate_histories([c.history for c in every if c.history is not None])
    return Contacts(t=t, sides=every[0].sides, begin=begin, planar=every[0].planar, history=history, **columns)


def _text_array(names: list[str]) -> np.ndarray:
    return np.array(names, object)


# Contact forces between two bodies, or sets of them, over time.


class PairForce:
    """The summed contact force on one body (or set) over time.

    Attributes
    ----------
    on, by : str
        Affected and acting side; ``by`` is empty for all others.
    t : ndarray (n,) [s]
    force : ndarray (n, 3) [N]
        Sum on ``on``, world axes; (n, 2) in the plane.
    normal_force : ndarray (n,) [N]
        Sum of the magnitudes along the normals: opposite normals do not cancel.
    tangential_force : ndarray (n,) [N]
        Magnitude of the summed tangential forces.
    center : ndarray (n, 3) [m]
        Mean point of the contacts, weighted by their normal forces; nan without contact force. With impulse time
        stepping it belongs to the start of the step that ends at the time, as ``gap`` does: see `Contacts`.
    gap : ndarray (n,) [m]
        The smallest gap of the contacts; nan if there is none.
    count : ndarray (n,) of int
    state : ndarray (n,) of int
        `STICK` if all loaded contacts stick, `SLIP` if one slips, `OPEN` if there is no contact force.
    """

    def __init__(self, contacts: Contacts, on: str, by: str, rows: np.ndarray, sign: np.ndarray) -> None:
        self.on, self.by, self.t = on, by, contacts.t
        n, when = len(contacts.t), contacts.when[rows]

        def total(values: np.ndarray) -> np.ndarray:
            return np.bincount(when, values, n)

        def vector(values: np.ndarray) -> np.ndarray:
            return np.stack([total(values[:, c]) for c in range(3)], axis=1)

        pressing = contacts.normal_force[rows]
        axes = 2 if contacts.planar else 3
        self.force = vector(sign[:, None] * contacts.force[rows])[:, :axes]
        self.normal_force = total(pressing)
        tangential = vector(sign[:, None] * contacts.tangential_force[rows])
        self.tangential_force = np.sqrt((tangential**2).sum(axis=1))
        self.count = np.bincount(when, minlength=n)
        weighed = vector(pressing[:, None] * contacts.point[rows])
        presses = self.normal_force > 0.0
        self.center = np.full((n, 3), np.nan)
        self.center[presses] = weighed[presses] / self.normal_force[presses, None]
        self.center = self.center[:, :axes]
        self.gap = np.full(n, np.inf)
        np.minimum.at(self.gap, when, contacts.gap[rows])
        self.gap[self.count == 0] = np.nan
        state = contacts.state[rows]
        self.state = np.full(n, OPEN)
        self.state[total((state == STICK).astype(float)) > 0] = STICK
        self.state[total((state == SLIP).astype(float)) > 0] = SLIP

    @property
    def states(self) -> list[str]:
        """The states by name."""
        return [STATES[k] for k in self.state.tolist()]

    def impulse(self) -> np.ndarray:
        """Sum of force times step over all output times but the first [N s]; exact if every step is an output."""
        return (np.diff(self.t)[:, None] * self.force[1:]).sum(axis=0)

    @property
    def title(self) -> str:
        """Title with both sides."""
        return f"{self.by or 'all others'} on {self.on}"

    def __repr__(self) -> str:
        most = float(self.normal_force.max(initial=0.0))
        touching = int((self.state != OPEN).sum())
        return f"<contact force of {self.title}: pressing at {touching} of {len(self.t)} times, up to {most:.4g} N>"


def pair_force(contacts: Contacts, on: str, by: str | None) -> PairForce:
    """Sum the contact forces of ``by`` (None: all others) on ``on``.

    Raises
    ------
    ModelError
        If there is none of these names, or they share a body and are not the same set.
    """
    low, high = contacts.sides.span(on)
    own = [(k >= low) & (k < high) for k in contacts.pair.T]
    if by is None:
        other = [~own[0], ~own[1]]
    else:
        a, b = contacts.sides.span(by)
        if (a, b) == (low, high) and high - low > 1:
            raise ModelError(f"contacts between members of {on!r} cancel in their sum: name single ones")
        if a < high and low < b:
            raise ModelError(f"{by!r} and {on!r} share a body: a contact is between two bodies")
        other = [(k >= a) & (k < b) for k in contacts.pair.T]
    second, first = own[1] & other[0], own[0] & other[1]
    rows = np.flatnonzero(first | second)
    return PairForce(contacts, on, by or "", rows, np.where(second[rows], 1.0, -1.0))


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
