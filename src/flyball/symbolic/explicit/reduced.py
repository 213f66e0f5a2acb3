"""Explicit differential equations: constraints and multipliers taken out by coordinate partitioning.

    w = w(u, t),  w' = G_w^-1 (nu - G_u u'),  w'' = G_w^-1 (gamma - G_u u'')
    Z^T M Z u'' = Z^T (f - M b),  Z = [1; -G_w^-1 G_u],  b = [0; G_w^-1 gamma]
    G_w^T lam = (M v' - f)_w

(Wehage and Haug 1982, J. Mech. Des. 104; Hahn, *Rigid Body Dynamics of Mechanisms 1*, eq. 4.84). Nothing is inverted:
see `solve`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ...analysis.linear.free import compared
from ...errors import ModelError
from ...graph.arrays import zeros
from ...graph.node import Node
from ...model.model import listing
from ...numerics.rank import parts
from ...tables.names import velocity_names
from ...tracing.trace import Traced
from .blocks import blocks
from .constraints import constraints
from .definition import Definition, Formulas
from .partition import free, named, positions
from .place import Place
from .positions import Solved, solved_positions
from .solve import Determinants, pattern, solve, solve_symmetric, times, transposed


@dataclass(frozen=True)
class More:
    """What equations may hold besides coordinates, velocities and multipliers.

    Attributes
    ----------
    vdot : list of Node
        Symbols of the accelerations.
    places : list of (Node, Node)
        Symbols of places on curves, and what vanishes there.
    """

    vdot: Sequence[Node] = ()
    places: Sequence[tuple[Node, Any]] = ()


NOTHING = More()


@dataclass(repr=False)
class Reduced:
    """Equations of motion in independent coordinates; see `reduced`.

    Attributes
    ----------
    names : tuple of str
        Velocities, by the coordinates that they are rates of.
    known : list of int
        Which coordinates q are given: the independent ones; of quaternions all four.
    chosen : list of int
        Which velocities v are independent.
    definitions : list of Definition
        Dependent coordinates, velocities, accelerations, multipliers and loads of joints, each from what stands before.
    M, f : ndarray of Node (n, n), (n,)
        Reduced: M a = f, a the accelerations of the independent coordinates.
    accelerations : ndarray of Node (nv,)
        Symbols-free where all coordinates have formulas.
    """

    traced: Traced
    place: Place
    start: dict[str, float]
    names: tuple[str, ...]
    known: list[int]
    chosen: list[int]
    dependent: list[int]
    positions: list[Definition]
    definitions: list[Definition]
    M: np.ndarray
    f: np.ndarray
    Z: np.ndarray
    accelerations: np.ndarray
    multipliers: np.ndarray
    determinants: dict[str, Any] = field(default_factory=dict)
    undetermined: tuple[str, ...] = ()
    notes: list[str] = field(default_factory=list)

    @property
    def independent(self) -> tuple[str, ...]:
        """Names of the independent coordinates."""
        return tuple(self.names[d] for d in self.chosen)

    @cached_property
    def formulas(self) -> Formulas:
        """Puts in all formulas."""
        return Formulas(self.definitions)

    def __repr__(self) -> str:
        return f"<equations solved for the accelerations of {', '.join(self.independent) or 'nothing free'}>"

    def inlined(self, nodes: Sequence[Any]) -> list[Any]:
        """Expressions of q, v, lam in terms of the independent coordinates, their rates, and what has no formula."""
        return self.formulas(nodes)


def reduced(x: Traced, start: Mapping[str, float], independent: Sequence[str] = (), more: More = NOTHING) -> Reduced:
    """Solve a mechanism's equations for the accelerations of independent coordinates.

    Parameters
    ----------
    x : Traced
    start : mapping
        An assembled position, as numbers of t, q and v by the names of their symbols: it tells the branch of every
        dependent coordinate.
    independent : sequence of str
        Coordinates such as ``"A.angle"``; chosen by pivoting at the start if none are named.
    more : More
        What the equations hold besides.

    Raises
    ------
    ModelError
        If a name does not exist, the coordinates named depend on one another, or are too many or too few.
    SingularityError
        If the start is singular.
    """
    c = constraints(x)
    place = Place(x, c, start)
    names = tuple(v.data.name.removesuffix("'") for v in x.v)
    if x.v and not x.v[0].data.element:  # symbols that are called by their numbers
        names = tuple(n.name for n in velocity_names(x.structure))
    chosen, rows = _chosen(x, place, names, independent)
    known, holonomic, unknown = _positions(x, place, chosen)
    solved = solved_positions(x, place, (holonomic, unknown), more.places)
    return _Reduction(x, names, place, more).equations(known, chosen, rows, solved)


def _chosen(x: Traced, place: Place, names: Sequence[str], wanted: Sequence[str]) -> tuple[list[int], list[int]]:
    """Independent velocities, and constraints that determine the others."""
    model = x.structure.model.name
    if isinstance(wanted, str):
        wanted = [wanted]
    at = named(names, wanted, model)
    G = place.G
    for name, d in zip(wanted, at, strict=True):
        if any(G[k, d] and np.count_nonzero(G[k]) == 1 for k in range(len(G))):
            by = [place.c.elements[k] for k in range(len(G)) if G[k, d] and np.count_nonzero(G[k]) == 1]
            raise ModelError(f"{name!r} is not independent: {by[0]!r} gives it; name another coordinate")
    try:
        found = free(G, place.scale, at, only=bool(wanted))
    except ValueError as error:
        d = int(error.args[0])
        others = [n for n in wanted if n != names[d]]
        what = f"of {', '.join(others)}" if others else "at the start: nothing moves along it"
        best = [names[k] for k in free(G, place.scale).chosen]
        raise ModelError(
            f"{names[d]!r} is not independent {what}; {listing(best) if best else 'drivers leave no freedom'}"
        ) from None
    freedoms = len(names) - len(found.rows)
    if wanted and len(found.chosen) < freedoms:
        best = [names[k] for k in free(G, place.scale, at).chosen if k not in at]
        raise ModelError(
            f"{model!r} has {freedoms} freedoms, and independent names {len(at)}; add others, such as {', '.join(best)}"
        )
    place.refuse_singular(found)
    return found.chosen, found.rows


def _positions(x: Traced, place: Place, chosen: list[int]) -> tuple[list[int], list[int], list[int]]:
    """Coordinates that are given; constraints that determine the others; those others."""
    which = np.flatnonzero(place.c.holonomic)
    free_places = set(free(place.G[which], place.scale, chosen).chosen)
    known: list[int] = []
    unknown: list[int] = []
    moved: list[int] = []
    for q, v in positions(x.structure):
        if any(d in free_places for d in v):
            known += q
        else:
            unknown += q
            moved += v
    G = place.G[np.ix_(which, np.array(moved, int))]
    rows = free(G, place.scale[moved]).rows
    return known, which[rows].tolist(), unknown


@dataclass
class _Reduction:
    """The steps from constraints to explicit equations, and the names of what must not vanish on the way."""

    x: Traced
    names: tuple[str, ...]
    place: Place
    more: More
    singular: dict[str, Any] = field(default_factory=dict)

    def equations(self, known: list[int], chosen: list[int], rows: list[int], solved: Solved) -> Reduced:
        x, nv = self.x, len(self.names)
        for name, value in solved.never:
            self.singular[f"positions of {name}"] = value
        c = self.place.c
        dependent = [d for d in range(nv) if d not in chosen]
        G = self.place.probe.cleaned(c.G[rows])
        Gw, order = G[:, dependent], blocks(pattern(G[:, dependent]))
        right = np.concatenate([G[:, chosen], c.nu[rows][:, None], c.gamma[rows][:, None]], axis=1)
        dets = Determinants()
        X = solve(Gw, right, dets, order)
        self._told("constraints for", dets, [self.names[d] for d in dependent])
        n = len(chosen)
        Z, b = zeros(nv, n), zeros(nv)
        Z[chosen] = np.eye(n)
        Z[dependent], b[dependent] = -X[:, :n], X[:, n + 1]
        u = np.array([x.v[d] for d in chosen], object)
        w = X[:, n] + times(Z[dependent], u)
        definitions = [*solved.definitions, *self._each([x.v[d] for d in dependent], w, "constraints on velocities")]
        M = times(Z.T, times(x.M, Z))
        f = times(Z.T, x.f - times(x.M, b))
        pivots = Determinants()
        a = solve_symmetric(M, f[:, None], pivots)[:, 0] if n else zeros(0)
        self._told("inertia of", pivots, [self.names[d] for d in chosen])
        vdot = times(Z, a) + b
        dets = Determinants()
        missing = (times(x.M, vdot) - x.f)[dependent]
        lam = solve(Gw.T, missing[:, None], dets, transposed(order or []))[:, 0]
        definitions += self._multipliers(rows, lam)
        definitions += self._each(self.more.vdot, vdot, "accelerations") if self.more.vdot else []
        return Reduced(
            x, self.place, self.place.values, self.names, known, chosen, dependent, solved.definitions, definitions, M,
            f, Z, vdot, self._all(rows, lam), self.singular, self._undetermined(), solved.notes,
        )  # fmt: skip

    def _each(self, symbols: Sequence[Node], values: Any, how: str) -> list[Definition]:
        return [Definition((s,), (y,), (), how) for s, y in zip(symbols, values, strict=True)]

    def _multipliers(self, rows: list[int], lam: np.ndarray) -> list[Definition]:
        """Multipliers of rows; those of redundant rows are declared nothing. Loads that follow from them."""
        x = self.x
        all_ = self._all(rows, lam)
        out: list[Definition] = []
        if x.loads:  # these are in f, and so in the multipliers
            into: Mapping[int, Any] = dict(enumerate(all_))
            found = Definition(tuple(x.lam), tuple(into[k] for k in range(len(x.lam))))
            returned = Formulas([found])([x.graph.node(y) for y in x.returned])
            gaps = tuple(s - y for s, y in zip(x.loads, returned, strict=True))
            out.append(Definition(tuple(x.loads), (), gaps, "loads of joints that return themselves"))
        return out + self._each(x.lam, all_[: len(x.lam)], "reactions")

    def _all(self, rows: list[int], lam: np.ndarray) -> np.ndarray:
        out = zeros(len(self.place.c.elements))
        out[rows] = lam
        return out

    def _undetermined(self) -> tuple[str, ...]:
        """Elements whose reactions redundancy leaves open."""
        y = parts(compared(self.place.G, self.place.scale)).dependencies
        open_ = np.abs(y).max(axis=1, initial=0.0) > 1e-8
        return tuple(dict.fromkeys(e for e, yes in zip(self.place.c.elements, open_, strict=True) if yes))

    def _told(self, what: str, dets: Determinants, names: Sequence[str]) -> None:
        for columns, value in dets.found:
            self.singular[f"{what} {', '.join(names[k] for k in columns)}"] = value
