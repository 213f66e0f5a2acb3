"""What the constraints leave free at a point: independent rows, named coordinates, and the basis of the motions.

Which rows are independent and which coordinates tell the others is decided by the values of the parameters, by the same
pivoting as in `Mechanism.linearize`; the basis itself is made of expressions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...analysis.linear.free import pivoted
from ...errors import ModelError
from ...graph.arrays import zeros
from ...numerics.rank import TOLERANCE, null_space, rank
from .derivatives import Perturbed
from .solve import is_zero, numbers, solved
from .traced import Mechanics

ROUNDED = 1e-13  # part of the largest row below which one is what rounding left of none


@dataclass
class Free:
    """Freedoms.

    Attributes
    ----------
    Z, Zv : ndarray (nv, f), (nv, fv)
        Bases of the changes of positions, and of velocities, that the constraints allow: the identity in the rows
        ``chosen`` and ``chosen_v``.
    rows, rows_v : ndarray of int
        Independent constraints on positions, and of all; the others follow from these.
    held : ndarray of int
        Coordinates that mean nothing: turns of point masses.
    """

    Z: np.ndarray
    Zv: np.ndarray
    chosen: np.ndarray
    chosen_v: np.ndarray
    rows: np.ndarray
    rows_v: np.ndarray
    held: np.ndarray


def free(m: Mechanics, p: Perturbed, wanted: Sequence[str] = ()) -> Free:
    """Freedoms at a point; ``wanted`` names the coordinates that tell the others.

    Raises
    ------
    ModelError
        If the wanted coordinates do not tell the others.
    """
    G = p.by["nv"]
    held = _void(p)
    which = np.flatnonzero(m.holonomic)
    chosen, rows = _chosen(m, G, which, held, _indices(m, wanted))
    Z = _basis(G, rows, chosen, held)
    if len(which) == len(G):
        return Free(Z, Z, chosen, chosen, rows, rows, held)
    chosen_v, rows_v = _chosen(m, G, np.arange(len(G)), held, None)
    return Free(Z, _basis(G, rows_v, chosen_v, held), chosen, chosen_v, rows, rows_v, held)


def based(f: Free, p: Perturbed) -> Free:
    """The same coordinates and rows with the bases of another state."""
    G = p.by["nv"]
    return replace(f, Z=_basis(G, f.rows, f.chosen, f.held), Zv=_basis(G, f.rows_v, f.chosen_v, f.held))


def _indices(m: Mechanics, wanted: Sequence[str]) -> np.ndarray | None:
    known = [n.name for n in m.names]
    for name in wanted:
        if name not in known:
            raise ModelError(f"there is no coordinate {name!r} to tell the others by; there are {', '.join(known)}")
    return np.sort([known.index(name) for name in wanted]) if wanted else None


def compared(G: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Values of rows, of unit size, turns counted in lengths."""
    A = numbers(G) * scale
    size = np.sqrt((A * A).sum(axis=1))
    least = ROUNDED * size.max(initial=0.0)
    return np.where(size > least, 1.0 / np.where(size > least, size, 1.0), 0.0)[:, None] * A


def _chosen(
    m: Mechanics, G: np.ndarray, which: np.ndarray, held: np.ndarray, wanted: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates that tell the others, and independent rows."""
    from scipy.linalg import qr

    still = np.eye(len(m.names))[held]
    A = np.vstack([compared(G[which], m.scale), still])
    N = null_space(A)
    chosen = pivoted(N)
    if wanted is not None:
        if len(wanted) != len(chosen) or rank(N[wanted]) < len(chosen):
            raise ModelError(
                f"{', '.join(m.names[d].name for d in wanted)} do not tell the other coordinates there: "
                f"{len(chosen)} that do are {', '.join(m.names[d].name for d in chosen)}"
            )
        chosen = wanted
    if not len(which):
        return chosen, which
    _, R, order = qr(A[: len(which)].T, mode="economic", pivoting=True)
    d = np.abs(np.diag(R))
    return chosen, np.sort(which[order[: int((d > TOLERANCE * d[0]).sum())]])


def _basis(G: np.ndarray, rows: np.ndarray, chosen: np.ndarray, held: np.ndarray) -> np.ndarray:
    """The identity in the chosen rows; the others as the constraints say."""
    nv = G.shape[1]
    others = np.setdiff1d(np.arange(nv), np.r_[chosen, held])
    Z = zeros(nv, len(chosen))
    Z[chosen, np.arange(len(chosen))] = 1.0
    if len(others) and len(chosen):
        Z[others] = solved(G[np.ix_(rows, others)], -G[np.ix_(rows, chosen)])
    return Z


def _void(p: Perturbed) -> np.ndarray:
    """Velocities without inertia, force and constraint."""
    empty = lambda X: np.array([all(is_zero(x) for x in row) for row in X], bool)  # noqa: E731
    out = empty(p.by["ra"]) & empty(p.by["rx"]) & empty(p.by["rv"]) & empty(p.by["nv"].T)
    return np.flatnonzero(out)
