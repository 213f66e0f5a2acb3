"""Kinks that meet in a place: the pieces of a function around it, seen from it in many directions.

Along its quantities one by one a function may be smooth where it has kinks between them: max(0, min(x, y)). So it is
looked at a little way off in directions all around. Across a face between two pieces of a continuous function slopes
differ along the face's normal only (Hadamard), so the faces are found where, on the way from a direction in one piece
to one in another, the slopes change.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from functools import cached_property

import numpy as np

AROUND = 13  # directions around a place in a plane; odd, so that no two are opposite
EACH = 12  # directions for each of more quantities than two
TURNED = 0.123  # angle of the first: faces are seldom there
HALVED = 12  # times that the way between two pieces is parted
PIECES = 8  # at most that are told apart

Slopes = Callable[[np.ndarray], tuple[float, np.ndarray]]  # value and slopes a scaled step from the place


class Piece:
    """A direction (n,), and value and slopes far and near along it."""

    def __init__(self, of: Slopes, way: np.ndarray, far: float, near: float, same: float, flat: float) -> None:
        self.of, self.sizes, self.way, self.same, self.flat = of, (far, near), way / np.linalg.norm(way), same, flat

    @cached_property
    def far(self) -> np.ndarray:
        """Slopes far away, (n,)."""
        return self.of(self.sizes[0] * self.way)[1]

    @cached_property
    def near(self) -> np.ndarray:
        """Slopes near the place, (n,)."""
        return self.of(self.sizes[1] * self.way)[1]

    def across(self, other: Piece) -> np.ndarray | None:
        """By what the slopes of another exceed these, (n,); None if they are of one piece."""
        near = other.near - self.near
        size = max(np.abs(self.near).max(), np.abs(other.near).max())
        if not np.abs(near).max() > self.flat * size:
            return None
        return near if np.abs(near).max() > self.same * np.abs(other.far - self.far).max() else None

    def to(self, other: Piece, part: float) -> Piece:
        """A direction between the two."""
        return Piece(self.of, (1.0 - part) * self.way + part * other.way, *self.sizes, self.same, self.flat)


def faces(of: Slopes, n: int, far: float, near: float, same: float, flat: float) -> list[np.ndarray]:
    """Normals (n,) of the faces between the pieces around a place.

    Parameters
    ----------
    of : callable
        Value and slopes a step away, in units of the sizes.
    n : int
        Quantities.
    far, near : float
        Two lengths of steps.
    same : float
        Slopes that differ near by less than this part of what they differ by far away are of one smooth piece.
    flat : float
        The same, of the slopes themselves.
    """
    found: list[Piece] = []
    for way in _around(n):
        other = Piece(of, way, far, near, same, flat)
        if len(found) <= PIECES and all(known.across(other) is not None for known in found):
            found.append(other)
    if len(found) > PIECES:  # slopes that change all around, as those of a cone do
        return list(np.eye(n))
    out: list[np.ndarray] = []
    for a, b in itertools.combinations(found, 2):
        for normal in _between(a, b, HALVED):
            normal = normal / np.linalg.norm(normal)
            if not any(abs(abs(normal @ m) - 1.0) < flat**0.5 for m in out):
                out.append(normal)
    return out


def _around(n: int) -> np.ndarray:
    """Directions of n quantities, evenly around in a plane, else at random."""
    if n < 2:
        return np.zeros((0, n))
    if n > 2:
        return np.random.default_rng(0).standard_normal((EACH * n, n))
    angle = TURNED + 2.0 * np.pi * np.arange(AROUND) / AROUND
    return np.column_stack([np.cos(angle), np.sin(angle)])


def _between(a: Piece, b: Piece, halvings: int) -> list[np.ndarray]:
    """Differences of the slopes of all pieces that are passed on the way from one to another."""
    across = a.across(b)
    if across is None:
        return []
    if not halvings:
        return [across]
    middle = a.to(b, 0.4375)  # not where a face is likely to be
    return _between(a, middle, halvings - 1) + _between(middle, b, halvings - 1)
