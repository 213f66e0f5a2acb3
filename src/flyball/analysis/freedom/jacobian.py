"""The constraint Jacobian in units in which its rows and columns compare, its rank and its null spaces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...numerics.rank import null_space
from ...numerics.sparse_rank import DENSE, FEW, rank, sparse_null_space
from ..assembly.start import Assembly
from ..compiled import Compiled


@dataclass(frozen=True)
class Found:
    """Where a mechanism was looked at, and what the null spaces of its Jacobian are there."""

    assembly: Assembly
    dependencies: np.ndarray  # multipliers (nr, k) that act on nothing; all for which there is `ROOM`
    allowed: np.ndarray | None  # velocities (nv, f) that the rows allow; None: found when asked for
    gap: str = ""  # why it cannot be assembled, if it cannot

    @property
    def velocities(self) -> np.ndarray:
        """Velocities (nv, f) that the rows allow; all for which there is `ROOM`."""
        if self.allowed is not None:
            return self.allowed
        a = self.assembly
        a.compiled.at(a.t, a.q, a.v)
        G, _, scale = scaled_jacobian(a.compiled)
        few = max(G.shape) <= DENSE
        return (null_space(G.toarray()) if few else sparse_null_space((G.T @ G).tocsr())[1]) * scale[:, None]


def lengths(c: Compiled) -> np.ndarray:
    """1 for velocities that are metres a second, 1 / length of the mechanism for those that are radians."""
    return c.sizes / c.values.length


def scaled_jacobian(c: Compiled, dense: bool = False) -> tuple[Any, np.ndarray, np.ndarray]:
    """The Jacobian last evaluated with turns counted in lengths and rows of unit size, and both scales.

    Returns
    -------
    G : sparse (nr, nv), or an array if that is wanted
    size : ndarray (nr,)
        What rows were divided by.
    scale : ndarray (nv,)
        What columns were multiplied with: velocities are ``scale`` times those that G takes.
    """
    scale = lengths(c)
    if dense:
        A = c.jacobian() * scale
        size = np.sqrt((A * A).sum(axis=1))
        return A / np.maximum(size, 1e-300)[:, None], size, scale
    import scipy.sparse as sp

    G = c.sparse_jacobian() @ sp.diags(scale)
    size = np.sqrt(np.asarray(G.multiply(G).sum(axis=1)).ravel())
    return (sp.diags(1.0 / np.maximum(size, 1e-300)) @ G).tocsr(), size, scale


def rank_of(c: Compiled) -> int:
    """Rank of the Jacobian last evaluated."""
    return rank(scaled_jacobian(c, few(c))[0])


def few(c: Compiled) -> bool:
    """Whether the Jacobian is so small that its rank is found from all of it, as an array."""
    return max(len(c.structure.rows), c.structure.nv) <= FEW
