"""Null spaces taken apart: vectors that speak of as few elements as can be.

A null space says that something depends on something, not what on what: any basis of it mixes dependencies that have
nothing to do with one another. Here it is cut into subspaces that no smaller set of elements carries (in matroid terms:
circuits of the elements), first by what is not connected at all, then by leaving out one element after the other.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...numerics.rank import null_space, parts, span

SMALL = 1e-8  # singular values below this are rounding; bases are orthonormal
NEW = 1e-6  # those above this are of something new


def irreducible(
    N: np.ndarray, groups: Sequence[np.ndarray], most: int | None = None
) -> list[tuple[list[int], np.ndarray]]:
    """Subspaces that make up a null space, each carried by a set of elements from which none can be left out.

    Parameters
    ----------
    N : ndarray (n, k)
        A basis of the null space, its rows in units in which they compare.
    groups : sequence of ndarray of int
        The rows of every element.
    most : int, optional
        Dimensions up to which a part that is connected by its elements is taken apart: of a larger one so many.

    Returns
    -------
    list of (elements, basis)
        Numbers of the elements, and vectors (n, c) that only they carry. All bases together are k independent vectors,
        or fewer where ``most`` is.
    """
    out: list[tuple[list[int], np.ndarray]] = []
    for part in _parts(N, groups):
        basis = span(part[:, :most])
        blocks = [basis[g] for g in groups]
        touched = [e for e, b in enumerate(blocks) if len(b) and np.abs(b).max() > SMALL]
        if basis.shape[1] == 1:
            out.append((touched, basis))
            continue
        found = np.zeros((basis.shape[1], 0))
        while found.shape[1] < basis.shape[1]:
            P = min((_smallest(blocks, order, found) for order in (touched, touched[::-1])), key=_weight(blocks))
            new = _beyond(found, P)
            carriers = [e for e in touched if np.abs(blocks[e] @ P).max(initial=0.0) > SMALL]
            out.append((carriers, basis @ new))
            found = span(np.hstack([found, new]))
    return out


def _parts(N: np.ndarray, groups: Sequence[np.ndarray]) -> list[np.ndarray]:
    """The null space as a sum of spaces that share no element."""
    from scipy.linalg import qr
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    k = N.shape[1]
    if k < 2:
        return [N] if k else []
    _, _, order = qr(N.T, mode="economic", pivoting=True)
    reduced = np.linalg.solve(N[order[:k]].T, N.T).T  # the unit matrix in the rows chosen: as sparse as rows allow
    touches = np.array([np.abs(reduced[g]).max(axis=0, initial=0.0) for g in groups]).reshape(len(groups), k) > 1e-7
    e, j = np.nonzero(touches)
    n = len(groups) + k
    graph = coo_matrix((np.ones(len(e)), (e, len(groups) + j)), shape=(n, n))
    part = connected_components(graph, directed=False)[1][len(groups) :]
    return [reduced[:, part == p] for p in dict.fromkeys(part.tolist())]


def _smallest(blocks: list[np.ndarray], order: list[int], found: np.ndarray) -> np.ndarray:
    """Coefficients (k, p) of what is left when every element that can be spared is, and something new remains."""
    P = np.eye(found.shape[0])
    for e in order:
        B = blocks[e] @ P
        if np.abs(B).max(initial=0.0) <= SMALL:
            continue
        Q = P @ null_space(B, SMALL, 1.0)
        if Q.shape[1] and _beyond(found, Q).shape[1]:
            P = Q
    return P


def _beyond(found: np.ndarray, P: np.ndarray) -> np.ndarray:
    """The part of the columns of P, as they are, that is independent of what is found already."""
    if not found.shape[1]:
        return P
    rest = P - found @ (found.T @ P)
    return P @ parts(rest, NEW, 1.0).seen


def _weight(blocks: list[np.ndarray]):
    def weight(P: np.ndarray) -> int:
        return sum(np.abs(b @ P).max(initial=0.0) > SMALL for b in blocks)

    return weight
