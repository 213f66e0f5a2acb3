"""What to replace in an overconstrained mechanism so that no constraint says what others say, and no freedom is added.

Let the columns of N be the multipliers that act on nothing. An element's rows R give way to weaker ones, T R, and T
lets go of the directions Z (T Z = 0): of N the combinations z with Z^T N_e z = 0 are left. So a choice of changes is a
cure where the blocks Z^T N_e of its elements, one below the other, are square and regular: as many rows are let go as
there are vectors, and no vector is left. Since all new rows lie in the span of those that were there, the same motions
are allowed as before. All this is asked here and in positions next to this one.

Sets that share elements are cured one after the other, each together with those before: an element that belongs to two
sets lets go for one of them only.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...numerics.rank import null_space, parts, span
from ...results.freedoms import Cure
from .choices import Budget, Item, cheapest
from .jacobian import Found
from .stand_ins import Option, Rows, options, rows_of

ELEMENTS = 40  # of a set that are tried
PART = 1e-6  # rows of unit size that agree to this lie in a span; a smaller singular value of a block is none


class Outcome(NamedTuple):
    """What was found for a set."""

    cure: Cure | None
    here_only: bool  # whether it depends on itself here only, and not in all the other positions
    cut: str  # how far the search went, where it found none and there is more that could be tried


class Weaker(NamedTuple):
    """An option, and in every position how its rows are made of those that are there: T, and Z that T takes to 0."""

    option: Option
    T: np.ndarray  # (positions, m, n)
    Z: np.ndarray  # (positions, n, n - m)


def cures(there: Found, sets: Sequence[tuple[str, ...]], positions: Sequence[np.ndarray]) -> list[Outcome]:
    """A cure for each set of elements, one after the other: those before are taken as done."""
    tried = options(there, list(dict.fromkeys(name for s in sets for name in s[:ELEMENTS])), positions)
    every = list(dict.fromkeys(name for s in sets for name in s))
    rows = rows_of(there.assembly.compiled, there, every, positions)
    there.assembly.compiled.at(there.assembly.t, there.assembly.q, there.assembly.v)
    budget = Budget()
    out: dict[int, Outcome] = {}
    for group in _sharing(sets):
        names = list(dict.fromkeys(name for k in group for name in sets[k]))
        tangle = Tangle({n: rows[n] for n in names}, tried)
        for k in group:
            out[k] = tangle.cured(sets[k], budget)
    return [out[k] for k in range(len(sets))]


def _sharing(sets: Sequence[tuple[str, ...]]) -> list[list[int]]:
    """Numbers of the sets that share elements, directly or by way of others."""
    groups: list[tuple[set[str], list[int]]] = []
    for k, names in enumerate(sets):
        touched = [g for g in groups if g[0] & set(names)]
        groups = [g for g in groups if g not in touched]
        groups.append((set(names).union(*(g[0] for g in touched)), sorted(sum((g[1] for g in touched), [k]))))
    return [numbers for _, numbers in groups]


class Tangle:
    """Sets that share elements: their rows as they are after the changes chosen so far, and what these let go.

    In every position the multipliers are combinations z of the columns of N, that act on nothing as long as nothing is
    changed; those with ``gone`` z = 0 still do.
    """

    def __init__(self, rows: dict[str, Rows], tried: dict[str, list[Option]]) -> None:
        self.rows, self.tried = dict(rows), tried
        ends = np.cumsum([r.values.shape[1] for r in rows.values()])[:-1]
        self.first = [dict(zip(rows, np.split(N, ends), strict=True)) for N in _dependencies(list(rows.values()))]
        self.blocks = [dict(blocks) for blocks in self.first]  # rows of N by element, told by the new rows
        self.gone = [np.zeros((0, _width(blocks))) for blocks in self.first]
        self.cured_ones = [np.zeros((_width(blocks), 0)) for blocks in self.first]  # combinations: of the sets cured
        self.changed: set[str] = set()
        self.weaker: dict[str, list[Weaker]] = {}

    def cured(self, names: Sequence[str], budget: Budget) -> Outcome:
        """The cheapest changes that leave no multipliers to this set together with those cured before."""
        own = [_within(N, set(names)) for N in self.first]
        counts = [sum(len(N[n]) for n in names) - z.shape[1] for N, z in zip(self.first, own, strict=True)]
        here_only = max(counts) > counts[0]
        every = [span(np.hstack(z), PART, 1.0) for z in zip(self.cured_ones, own, strict=True)]
        free = [z @ null_space(gone @ z, PART, 1.0) for gone, z in zip(self.gone, every, strict=True)]
        if any(z.shape[1] != free[0].shape[1] for z in free):
            return Outcome(None, here_only, "")
        chosen, cut = self._chosen(names, free, budget)
        if chosen is None:
            limit = f"at the first {ELEMENTS} of {len(names)} elements" if len(names) > ELEMENTS else ""
            return Outcome(None, here_only, " and ".join(x for x in (cut, limit) if x))
        self._change(chosen)
        self.cured_ones = every
        return Outcome(Cure(tuple(w.option.change for w in chosen.values() if w.option.change)), here_only, "")

    def _chosen(
        self, names: Sequence[str], free: list[np.ndarray], budget: Budget
    ) -> tuple[dict[str, Weaker] | None, str]:
        """The cheapest changes of elements that leave nothing of the multipliers ``free`` (combinations of ours)."""
        if not free[0].shape[1]:
            return {}, ""
        fresh, again = [], []  # what is changed already stays if it can
        for k, name in enumerate(names):
            N = np.stack([block[name] @ Y for block, Y in zip(self.blocks, free, strict=True)])
            items = _items(k, self._weaker(name), N)
            again += items
            fresh += items if name not in self.changed else []
        cut = ""
        for some in (fresh, again) if len(fresh) < len(again) else (again,):
            chosen, cut = cheapest(some, free[0].shape[1], budget)
            if chosen is not None:
                return {names[i.element]: self._weaker(names[i.element])[i.number] for i in chosen}, ""
        return None, cut

    def _weaker(self, name: str) -> list[Weaker]:
        """What may take the place of an element as it is now."""
        if name not in self.weaker:
            own = self.rows[name]
            inverse = np.linalg.pinv(own.values, rcond=PART)
            found = (_less(own, option, inverse) for option in self.tried.get(name, [])[1:])
            self.weaker[name] = [w for w in found if w is not None]
        return self.weaker[name]

    def _change(self, chosen: dict[str, Weaker]) -> None:
        """Put rows in the place of others, and tell what is left of the multipliers by the new ones."""
        for p, blocks in enumerate(self.blocks):
            for name, w in chosen.items():
                self.gone[p] = np.vstack([self.gone[p], w.Z[p].T @ blocks[name]])
                blocks[name] = np.linalg.pinv(w.T[p]).T @ blocks[name]
        for name, w in chosen.items():
            self.rows[name] = w.option.rows
            self.weaker.pop(name)
        self.changed |= set(chosen)


def _width(blocks: dict[str, np.ndarray]) -> int:
    return next(iter(blocks.values())).shape[1]


def _within(blocks: dict[str, np.ndarray], names: set[str]) -> np.ndarray:
    """Which combinations of the multipliers speak of these elements only."""
    others = [B for n, B in blocks.items() if n not in names]
    return null_space(np.vstack(others), PART, 1.0) if others else np.eye(_width(blocks))


def _dependencies(blocks: Sequence[Rows]) -> list[np.ndarray]:
    """Multipliers (n, s) of the rows of elements, one below the other, that act on nothing, in every position."""
    columns = np.unique(np.concatenate([b.columns for b in blocks]))
    first = np.cumsum([0, *(b.values.shape[1] for b in blocks)])
    rows = np.zeros((len(blocks[0].values), first[-1], len(columns)))
    for k, b in enumerate(blocks):
        rows[:, first[k] : first[k + 1], np.searchsorted(columns, b.columns)] = b.values
    return [parts(x).dependencies for x in rows]


def _less(own: Rows, option: Option, inverse: np.ndarray) -> Weaker | None:
    """How an option's rows are made of those there; None if they are not, or depend on one another."""
    new = option.rows
    if not np.isin(new.columns, own.columns).all():
        return None
    wide = np.zeros((*new.values.shape[:2], len(own.columns)))
    wide[:, :, np.searchsorted(own.columns, new.columns)] = new.values
    T = wide @ inverse
    n, m = own.values.shape[1], T.shape[1]
    if m >= n or np.abs(T @ own.values - wide).max(initial=0.0) > PART:
        return None
    if not m:
        return Weaker(option, T, np.broadcast_to(np.eye(n), (len(T), n, n)))
    _, d, V = np.linalg.svd(T, full_matrices=True)
    return None if d.min() < PART else Weaker(option, T, V[:, m:].transpose(0, 2, 1))


def _items(k: int, weaker: Sequence[Weaker], N: np.ndarray) -> list[Item]:
    """What can be part of a cure of multipliers N (p, n, s); of options that let go the same only the first."""
    out: list[Item] = []
    known: set[tuple[int, bytes]] = set()
    for number, w in enumerate(weaker):
        if w.Z.shape[2] > N.shape[2]:
            continue
        _, d, V = np.linalg.svd(w.Z.transpose(0, 2, 1) @ N, full_matrices=False)
        same = w.Z.shape[2], np.round(V.transpose(0, 2, 1) @ V + 0.0, 5).tobytes()
        if d.min() > PART and same not in known:
            known.add(same)
            out.append(Item(k, number, w.option.cost, V))
    return out
