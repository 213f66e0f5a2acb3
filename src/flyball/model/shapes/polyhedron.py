"""Volume, centre and inertia of closed surfaces of triangles, and what is wrong with those that are not closed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

NOTHING = 1e-12  # a volume smaller than this part of the bounding box's is none


@dataclass(frozen=True)
class Integrals:
    """Volume [m^3], centre [m] and inertia per unit mass about it [m^2] of a homogeneous polyhedron."""

    volume: float
    centre: np.ndarray
    gyration: np.ndarray


def integrals(v: np.ndarray, f: np.ndarray) -> Integrals:
    """Integrals over the inside of a closed surface, exact but for rounding.

    The sum over the tetrahedra that the triangles make with one point, each with its sign: with corners 0, a, b, c and
    s = a + b + c its volume is V = a . (b x c) / 6, its first moment V s / 4, its second moment
    V (a a + b b + c c + s s) / 20.

    Parameters
    ----------
    v : (k, 3)
        Vertices.
    f : (m, 3)
        Triangles, counter-clockwise seen from outside.
    """
    middle = v.mean(axis=0)  # near the inside, so that little cancels
    corners = (v - middle)[f]
    a, b, c = corners.transpose(1, 0, 2)
    V = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6
    volume = V.sum()
    s = a + b + c
    first = V @ s / (4 * volume)
    second = sum(np.einsum("k,ki,kj->ij", V, x, x) for x in (a, b, c, s)) / (20 * volume) - np.outer(first, first)
    return Integrals(volume, middle + first, np.trace(second) * np.eye(3) - second)


def welded(v: np.ndarray, f: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices at the same place made one, and triangles without an area by their indices left out."""
    order = np.lexsort(v.T)  # np.unique by rows does the same ten times as slowly
    new = np.ones(len(v), bool)
    new[1:] = (np.diff(v[order], axis=0) != 0.0).any(axis=1)
    at = np.empty(len(v), int)
    at[order] = np.cumsum(new) - 1
    v, f = v[order[new]], at[f]
    return v, f[(f[:, 0] != f[:, 1]) & (f[:, 1] != f[:, 2]) & (f[:, 2] != f[:, 0])]


def flaws(v: np.ndarray, f: np.ndarray) -> str:
    """What keeps a (welded) surface from having an inside, as a sentence with numbers; empty if nothing does."""
    if not len(f):
        return "it has no triangles"
    open_edges, twisted = _edges(f)
    if open_edges:
        return (
            f"it is not closed: {open_edges} of its edges have a triangle on one side only. Close its holes and merge "
            f"vertices that should be one in the program that made it"
        )
    if twisted:
        return (
            f"its triangles do not all face outwards: at {twisted} edges two neighbours go round in different ways. "
            f"Make its normals consistent in the program that made it"
        )
    return _inside_out(v, f)


def _edges(f: np.ndarray) -> tuple[int, int]:
    """Edges with an odd number of triangles, and edges that are not gone along as often one way as the other."""
    ways = np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]])
    up = np.where(ways[:, 0] < ways[:, 1], 1, -1)
    edge = ways.min(axis=1) * (f.max() + 1) + ways.max(axis=1)
    _, at = np.unique(edge, return_inverse=True)
    count, sense = np.bincount(at), np.bincount(at, weights=up)
    odd = count % 2 == 1
    return int(odd.sum()), int(((sense != 0) & ~odd).sum())


def _inside_out(v: np.ndarray, f: np.ndarray) -> str:
    """Parts that face inwards without lying in another part, as cavities do; a volume of nothing."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    pairs = np.concatenate([f[:, [0, 1]], f[:, [1, 2]]])
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(v), len(v)))
    _, part = np.unique(connected_components(graph, directed=False)[1][f[:, 0]], return_inverse=True)
    corners = (v - v.mean(axis=0))[f]
    a, b, c = corners.transpose(1, 0, 2)
    volumes = np.bincount(part, weights=np.einsum("ij,ij->i", a, np.cross(b, c)) / 6)
    low, high = np.full((len(volumes), 3), np.inf), np.full((len(volumes), 3), -np.inf)
    np.minimum.at(low, part, corners.min(axis=1))
    np.maximum.at(high, part, corners.max(axis=1))
    if not abs(volumes.sum()) > NOTHING * np.prod(high.max(axis=0) - low.min(axis=0)):
        return "it encloses no volume. Give it a thickness"
    for k in np.flatnonzero(volumes < 0):
        if not ((volumes > 0) & (low <= low[k]).all(axis=1) & (high >= high[k]).all(axis=1)).any():
            return (
                f"triangles of it face inwards (the volume of a part comes out as {volumes[k]:.3g}). Turn "
                f"these faces round (flip normals) in the program that made it"
            )
    return ""
