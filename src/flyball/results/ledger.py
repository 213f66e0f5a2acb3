"""Energies of a motion as they are balanced: of all of it, and of each part that nothing connects with the others."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..numerics.forest import root, unite
from ..tables.system import BETWEEN, SLIDING, System
from .booked import GIVEN
from .energy import EXCHANGED, gravity, kinetic

if TYPE_CHECKING:
    from .result import Result


@dataclass(frozen=True)
class Ledger:
    """Energies [J] of some bodies at every output time.

    Attributes
    ----------
    result : Result
    bodies : ndarray of int
        Rows of the body table.
    kinetic, balance : ndarray (n,)
    stored : tuple of two ndarray (n,)
        Of gravity, and in springs.
    works : tuple of ndarray (n,)
    foreign : ndarray (n,)
        What impacts, contacts and events exchanged that the balance does not know of: it holds where this is constant.
    """

    result: Result
    bodies: np.ndarray
    kinetic: np.ndarray
    balance: np.ndarray
    stored: tuple[np.ndarray, np.ndarray]
    works: tuple[np.ndarray, ...]
    foreign: np.ndarray

    @property
    def mass(self) -> np.ndarray:
        """Of each of the bodies [kg]."""
        return self.result.values.system.bodies.mass[self.bodies]

    @property
    def weight(self) -> float:
        """Of all of the bodies [N]."""
        return float(self.mass.sum() * np.linalg.norm(self.result.values.system.gravity))

    @property
    def went(self) -> np.ndarray:
        """Square of how far each of the bodies came about [m^2]."""
        r = self.result.motions
        x, y, z = (np.ptp(p, axis=1) for p in r.bodies(self.bodies)[0])
        return x**2 + y**2 + z**2

    def known(self, begin: int, end: int) -> bool:
        """Whether the balance holds between two rows, the last not counted."""
        return not np.ptp(self.foreign[begin:end]) > 0.0

    @property
    def of(self) -> str:
        """Whose it is, in words; empty: that of all."""
        if len(self.bodies) == len(self.result.values.system.tree.parent):
            return ""
        place = {b: name for name, b in self.result.values.structure.place.items()}
        names = [place[b] for b in self.bodies.tolist() if b in place]  # massless links have none
        name, more = names[0], len(names) - 1
        others = f" and the {more} bodies" if more > 1 else " and the body"
        return f" of {name!r}" + (f"{others} connected with it" if more else "")

    def moved(self, begin: int, end: int) -> float:
        """How much energy was shifted about between two rows, the last not counted [J].

        The largest kinetic energy, and the ranges of gravity's and the springs' energies and of every work.
        """
        if end <= begin:
            return 0.0
        ranges = sum(np.ptp(x[begin:end]) for x in (*self.stored, *self.works))
        return float(self.kinetic[begin:end].max() + ranges)


def whole(result: Result) -> Ledger:
    """That of everything."""
    e = result.energy
    every = np.arange(len(result.values.system.tree.parent))
    none = result.motions.zeros()
    return Ledger(result, every, e.kinetic, e.balance, (e.gravity, e.elastic), tuple(e.work.values()), none)


def apart(result: Result) -> list[Ledger]:
    """Those of parts that neither joints nor forces connect; none where all hangs together.

    What impacts and events exchanged nobody knows by parts.
    """
    S = result.values.system
    part = result.values.structure.kept.get("connected", None, 1, partial(connected, S))
    many = int(part.max(initial=0)) + 1
    if many < 2 or result.bulk or not len(result.t):
        return []
    of = [np.flatnonzero(part == p) for p in range(many)]
    elastic = [result.motions.zeros() for _ in of]
    works: list[list[np.ndarray]] = [[] for _ in of]
    for f in result.model.acting():
        at = _part_of(result, f, part)
        if at >= 0:
            elastic[at] = elastic[at] + result[f.name].energy
    for name, work in result.energy.work.items():
        at = _part_of(result, result[name].element, part)
        if at >= 0:
            works[at].append(work)
    out, foreign = [], _exchanged(result)
    for p, bodies in enumerate(of):
        moving, weight = kinetic(result, bodies), gravity(result, bodies)
        residue = moving + weight + elastic[p] - sum(works[p], result.motions.zeros())
        out.append(Ledger(result, bodies, moving, residue - residue[0], (weight, elastic[p]), tuple(works[p]), foreign))
    return out


def connected(S: System) -> np.ndarray:
    """The part to which each row of the body table belongs, (nb,): joints, couplings and forces connect them."""
    first = list(
        range(len(S.tree.parent))
    )  # of what each hangs together with, as far as it is known: a body before it, or itself
    pairs = [(b, parent) for b, parent in enumerate(S.tree.parent.tolist()) if parent >= 0]
    some = [*(_of_line(S, k) for k in range(len(S.rows.law))), *(_of_force(S, k) for k in range(len(S.forces.F)))]
    pairs += [(int(bodies[0]), int(b)) for bodies in some for b in bodies[1:]]
    for i, j in pairs:
        unite(first, i, j)
    return np.unique([root(first, b) for b in range(len(first))], return_inverse=True)[1]


def _of_line(S: System, k: int) -> np.ndarray:
    """Bodies of a row, or of a measured quantity behind all rows."""
    body = np.repeat(np.arange(len(S.tree.parent)), S.tree.nv)
    return np.unique(body[S.column[S.row_start[k] : S.row_start[k + 1]]])


def _of_force(S: System, k: int) -> np.ndarray:
    ends, family = np.array([S.forces.F[k], S.forces.M[k]]), S.forces.family[k]
    if family == BETWEEN:
        at = S.frame_body[ends[ends >= 0]]
        return np.unique(at[at >= 0])
    lines = ends[ends >= 0] if family == SLIDING else ends[:1]
    return np.unique(np.concatenate([_of_line(S, len(S.rows.law) + m) for m in lines]))


def _part_of(result: Result, e: Any, part: np.ndarray) -> int:
    """The part that an element acts on, or -1."""
    s, S = result.values.structure, result.values.system
    if e.name in s.prescribed:
        return int(part[s.prescribed[e.name]])
    k = next((k for k, f in enumerate(s.forces) if f is e or f.name == e.name), None)
    if k is not None:
        bodies = _of_force(S, k)
    else:
        rows = s.slices.get(e.name, slice(0, 0))
        bodies = np.concatenate([np.zeros(0, np.int64), *(_of_line(S, r) for r in range(rows.start, rows.stop))])
    return int(part[bodies[0]]) if len(bodies) else -1


def _exchanged(result: Result) -> np.ndarray:
    """What impacts, contacts and events took or gave since the start, (n,) [J]."""
    e = result.energy
    return sum((np.abs(e.exchanged(k)) for k in (*EXCHANGED, GIVEN)), result.motions.zeros())
