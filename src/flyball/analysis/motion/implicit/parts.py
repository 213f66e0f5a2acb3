"""Which velocities each part of the equations depends on, and in which equations it stands: patterns of Jacobians."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from ....tables.specs import Structure
from ....tables.system import (
    ALONG,
    BETWEEN,
    SLIDING,
    System,
)
from ...linear.derivatives import grouped

Part = tuple[np.ndarray, np.ndarray]
"""Equations in which it stands, one after the other; what it depends on: velocities, of which also the positions, and
states of controllers. Both are numbered so, and behind the equations of the states stand rates of the rows."""


class Terms(NamedTuple):
    """A sparse matrix of derivatives as sums of what steps of velocities change."""

    i: np.ndarray  # equations and velocities of its entries
    j: np.ndarray
    pick: np.ndarray  # (n, 3): entry, step, place among what is found: sums of these
    group: np.ndarray  # (nv + nx,): the step in which each velocity and state is taken

    @property
    def groups(self) -> int:
        """How many steps there are."""
        return int(self.group.max(initial=-1)) + 1


class Parts:
    """Parts of a mechanism in the order in which `equations/parts.py` writes them.

    Parameters
    ----------
    s : Structure
    S : System
    nx : int
        States of controllers that are unknowns.
    """

    def __init__(self, s: Structure, S: System, nx: int) -> None:
        self.S, self.nv, self.nr, self.nx = S, s.nv, len(S.rows.law), nx
        nm = len(S.row_start) - 1 - self.nr
        self.body = np.repeat(np.arange(len(S.tree.parent)), S.tree.nv)
        self.chain: list[np.ndarray] = []
        for parent, v, nv in zip(S.tree.parent, S.tree.v, S.tree.nv, strict=True):
            own = np.arange(v, v + nv)
            self.chain.append(np.r_[own, self.chain[parent]] if parent >= 0 else own)
        self.entries = [S.column[S.row_start[k] : S.row_start[k + 1]] for k in range(self.nr + nm)]
        self.row = [self._hung(np.unique(self.body[e])) for e in self.entries]
        states = s.nv + np.arange(nx)
        self.told = np.r_[self._read(s, s.slots, nm), states]
        self.bodies = [(c, np.unique(c)) for c in self.chain]
        self.all = [*self.bodies, *self._between(), *zip(self.entries[: self.nr], self.row[: self.nr], strict=True)]
        self.all += self._along()
        laws = [x.law.names for x in s.controls[:nx]]
        self.states = [(states[n : n + 1], np.r_[self._read(s, names, nm), states]) for n, names in enumerate(laws)]
        self.rates = [(np.array([s.nv + nx + k]), row) for k, row in enumerate(self.row[: self.nr])]

    def _read(self, s: Structure, names: Iterable[str], nm: int) -> np.ndarray:
        """Velocities on which measured quantities depend, by the names that laws have for them."""
        columns = {s.slots[name] for name in names if name in s.slots}
        return _union([self.row[self.nr + m % nm] for m in sorted(columns) if m < 2 * nm])

    def _hung(self, bodies: Sequence[int] | np.ndarray) -> np.ndarray:
        """Velocities of bodies and of all that they hang on."""
        return _union([self.chain[b] for b in bodies])

    def _law(self, k: int, own: np.ndarray) -> np.ndarray:
        """With what the laws of force k are told."""
        return np.union1d(own, self.told) if (self.S.forces.laws[k] >= 0).any() else own

    def _between(self) -> list[Part]:
        out, forces = [], self.S.forces
        for k, family in enumerate(forces.family):
            if family == BETWEEN:
                ends = [b for b in self.S.frame_body[[forces.M[k], forces.F[k]]] if b >= 0]
                depends = self._law(k, self._hung(ends))
                out += [(self.chain[b], depends) for b in ends]
        return out

    def _along(self) -> list[Part]:
        out, forces = [], self.S.forces
        for k, family in enumerate(forces.family):
            if family not in (ALONG, SLIDING):
                continue
            measured = [forces.F[k], forces.M[k]] if family == SLIDING else [forces.F[k]]
            lines = [self.nr + m for m in measured if m >= 0]
            pressing = zip(*self.S.load_terms, strict=True)
            loading = [self.S.terms.row[x] for n, x in pressing if n == forces.load[k] and x >= 0]
            depends = self._law(k, _union([self.row[n] for n in [*lines, *loading]]))
            out += [(self.entries[n], depends) for n in lines]
        return out

    def terms(self, some: Sequence[Part], first: np.ndarray) -> Terms:
        """Derivatives of the sums of some parts, which begin at these places among what is found."""
        group = self._groups([depends for _, depends in some])
        none = np.zeros(0, np.int64)
        i = np.concatenate([none, *(np.repeat(e, len(d)) for e, d in some)])
        j = np.concatenate([none, *(np.tile(d, len(e)) for e, d in some)])
        places = zip(first.tolist(), some, strict=False)
        at = np.concatenate([none, *(np.repeat(n + np.arange(len(e)), len(d)) for n, (e, d) in places)])
        n = max(self.nv + self.nx, 1)
        keys, entry = np.unique(i * n + j, return_inverse=True)
        pick = np.column_stack([entry, group[j], at])
        return Terms(keys // n, keys % n, pick.astype(np.int64), group)

    def _groups(self, together: Sequence[np.ndarray]) -> np.ndarray:
        """What no part depends on together has one number, (nv + nx,)."""
        from scipy.sparse import csc_matrix

        part = np.repeat(np.arange(len(together)), [len(d) for d in together])
        velocity = np.concatenate([np.zeros(0, np.int64), *together])
        touched = csc_matrix((np.ones(len(part), bool), (part, velocity)), shape=(len(together), self.nv + self.nx))
        return grouped(touched)


def _union(some: Sequence[np.ndarray]) -> np.ndarray:
    return np.unique(np.concatenate([np.zeros(0, np.int64), *some]))
