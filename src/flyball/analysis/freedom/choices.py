"""The cheapest choice of blocks that are square and regular, one below the other: branch and bound."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...numerics.rank import null_space

MOST = 4  # elements that a choice changes
TESTS = 200_000  # choices that are tested for one set, and
ALL = 400_000  # for all of a mechanism
PART = 1e-6  # a block with a smaller singular value is singular


@dataclass
class Budget:
    """How many choices may still be tested."""

    tests: int = ALL


class Item(NamedTuple):
    """What one element may let go: its orthonormal rows (positions, f, s) of the multipliers, and what it costs."""

    element: int
    number: int
    cost: float
    block: np.ndarray

    @property
    def freed(self) -> int:
        """How many rows it lets go."""
        return self.block.shape[1]


def cheapest(items: Sequence[Item], surplus: int, left: Budget) -> tuple[list[Item] | None, str]:
    """The cheapest choice whose blocks are square and regular in every position; equal ones in the order of elements.

    Partial choices are taken up by what they cost; those that cannot be better than the best one found are left alone.
    """
    if not items:
        return None, ""
    groups = _grouped(items)
    least, widest = min(i.cost for i in items), max(groups)
    budget = start = min(TESTS, left.tests)
    best: Choice | None = None
    heap = [Choice(0.0, 0, (), ())]
    while heap and budget > 0:
        now = heapq.heappop(heap)
        if best is not None and (now.cost + least, now.changes + 1, now.elements) > best[:3]:
            continue
        free = _remaining([items[i] for i in now.items], surplus, len(items[0].block))
        for f, (numbers, blocks) in groups.items():
            after = free.shape[2] - f
            if not 0 <= after <= widest * (MOST - now.changes - 1):
                continue
            begin = sum(items[n].element <= now.elements[-1] for n in numbers) if now.elements else 0
            budget -= len(numbers) - begin
            for k in _regular(blocks[begin:], free):
                new = now.extended(numbers[begin + k], items)
                if after:
                    heapq.heappush(heap, new)
                elif best is None or new < best:
                    best = new
    left.tests -= start - budget
    if best is not None:
        return [items[i] for i in best.items], ""
    return None, f"after {start - budget} choices" if heap else ""


class Choice(NamedTuple):
    """Items chosen, in the order in which choices are compared."""

    cost: float
    changes: int
    elements: tuple[int, ...]
    items: tuple[int, ...]

    def extended(self, i: int, items: Sequence[Item]) -> Choice:
        """With one more item, of a later element."""
        new = items[i]
        return Choice(self.cost + new.cost, self.changes + 1, (*self.elements, new.element), (*self.items, i))


def _grouped(items: Sequence[Item]) -> dict[int, tuple[list[int], np.ndarray]]:
    """Numbers of the items that let go as many rows, and their blocks (items, positions, f, s)."""
    out = {}
    for f in sorted({i.freed for i in items}):
        numbers = [k for k, i in enumerate(items) if i.freed == f]
        out[f] = numbers, np.stack([items[k].block for k in numbers])
    return out


def _remaining(chosen: Sequence[Item], surplus: int, positions: int) -> np.ndarray:
    """What is left of the multipliers: bases (positions, s, left) of what the blocks of a choice take to nothing."""
    if not chosen:
        return np.broadcast_to(np.eye(surplus), (positions, surplus, surplus))
    blocks = np.concatenate([i.block for i in chosen], axis=1)
    return np.stack([null_space(b, PART, 1.0) for b in blocks])


def _regular(blocks: np.ndarray, free: np.ndarray) -> list[int]:
    """Which blocks (items, positions, f, s) keep full rank on what is left (positions, s, left) in every position."""
    if not len(blocks):
        return []
    shown = blocks @ free
    if shown.shape[2] == 1:
        least = np.sqrt((shown**2).sum(axis=3))[:, :, 0]
    else:
        least = np.linalg.svd(shown, compute_uv=False)[..., -1]
    return np.flatnonzero(least.min(axis=1) > PART).tolist()
