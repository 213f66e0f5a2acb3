"""Stretches of a motion between events: in each of them modes, what is held where, and parameters are constant.

What is computed from a result later asks these what held at its time: which side friction slid to, which stop was
closed, what a parameter was. Where parameters changed, a result is several results of one mechanism end to end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np

from ..tables.values import Values


class RecordedModes(NamedTuple):
    """What is recorded of every switch, (ns,) each: see `tables.system.Modes`."""

    mode: np.ndarray
    hold: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    released: np.ndarray


@dataclass(frozen=True)
class Stretch:
    """Output times in a row between which nothing switched.

    Attributes
    ----------
    rows : int
        How many output times; none is possible.
    switch : ndarray (5, ns)
        Mode, what is held, lower and upper bounds of every switch, whether it was released (`RecordedModes`).
    sigma : ndarray (ns,) or (ns, rows)
        The direction in which each acts.
    values : Values
        The tables, with parameters as they were then.
    lost : float [J]
        Lost in impacts and sudden locking since the start.
    given : float [J]
        Given by kicks since the start.
    end : ndarray (ny,)
        The state at its end, before the event.
    """

    rows: int
    switch: np.ndarray
    sigma: np.ndarray
    values: Values
    lost: float
    given: float
    end: np.ndarray

    @property
    def modes(self) -> RecordedModes:
        """The rows of ``switch`` by name."""
        return RecordedModes(*self.switch)

    @property
    def ways(self) -> np.ndarray:
        """The directions as columns, (ns, 1) or (ns, rows)."""
        return self.sigma if self.sigma.ndim == 2 else self.sigma[:, None]


@dataclass(frozen=True)
class Stretches:
    """All of a motion, in order."""

    all: tuple[Stretch, ...]

    def over(self, what: str) -> np.ndarray:
        """A field of the stretches at every output time, times last."""
        every = [np.asarray(getattr(x, what), float) for x in self.all]
        return np.concatenate([np.repeat(x[..., None], s.rows, -1) for x, s in zip(every, self.all, strict=True)], -1)

    @cached_property
    def mode(self) -> np.ndarray:
        """Mode of every switch, (ns, n)."""
        return self.over("switch")[0]

    @cached_property
    def sigma(self) -> np.ndarray:
        """Direction of every switch, (ns, n)."""
        every = [(x.ways, x.rows) for x in self.all]
        return np.concatenate([np.broadcast_to(x, (len(x), rows)) for x, rows in every], axis=1)

    def pieces(self) -> list[tuple[slice, Stretches]]:
        """Stretches with the same parameters, and the output times that they take up."""
        out, first = [], 0
        for _, group in groupby(self.all, key=lambda x: id(x.values)):
            found = Stretches(tuple(group))
            last = first + sum(x.rows for x in found.all)
            out.append((slice(first, last), found))
            first = last
        return out

    def moment(self, k: int) -> Stretches | None:
        """Stretch k as that of one time; None where ways change within it and none is known."""
        x = self.all[k]
        ways = x.ways[:, -1] if x.ways.shape[1] else None
        return None if ways is None else Stretches((replace(x, rows=1, sigma=ways),))

    def cut(self, rows: int) -> Stretches:
        """Those of the first so many output times."""
        out, left = list[Stretch](), rows
        for x in self.all:
            n = min(x.rows, left)
            out.append(replace(x, rows=n, sigma=x.sigma[:, :n] if x.sigma.ndim == 2 else x.sigma))
            left -= n
        return Stretches(tuple(out))


def stretched(stretches: Sequence[Stretch]) -> Stretches | None:
    """The stretches of a motion; None where there is none."""
    return Stretches(tuple(stretches)) if stretches else None


def cut_up(result: Any) -> tuple[Any, ...]:
    """A result piece by piece, if parameters changed in it, each with its own; else none."""
    cuts = result.stretches.pieces() if result.stretches is not None else []
    if len(cuts) < 2:
        return ()
    names = "t", "q", "v", "states", "vdot", "multipliers"
    out = []
    for at, stretches in cuts:
        parts = (getattr(result, name)[at] for name in names)
        piece = type(result)(result.model, stretches.all[0].values, *parts, result.health)
        piece.stretches, piece.wound = stretches, result.wound
        piece.exchanged = {k: x[at] for k, x in result.exchanged.items()}
        piece.begun, piece.within = result.begun, (result, at)
        if result.contacts is not None:
            piece.contacts = result.contacts.taken(range(at.start, at.stop))
        out.append(piece)
    return tuple(out)
