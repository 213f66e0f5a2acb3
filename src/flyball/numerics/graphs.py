"""Graph algorithms: connected components by union-find, and elimination orders with little fill.

Union-find with path halving (Tarjan 1975) runs in linear time and is compiled.

Minimum degree and nested dissection (George, *Nested dissection of a regular finite element mesh*, 1973; fill n
log n, work n^1.5) order the unknowns of sparse matrices. Nested dissection eliminates a small separator last, whose
removal leaves two halves, and treats the halves recursively. Graph distances from a few reference vertices and their
differences serve as coordinates; the cut is placed where the graph is narrow along one of them and both sides are
large. The cut edges are covered by the fewest vertices (Koenig 1931: as many as the largest matching has).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..compiler.formulas import formula


@formula
def find_root(parent, i):
    """Find the root of i, with path halving."""
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@formula
def unite(parent, i, j):
    """Unite the sets of i and j; the smaller root becomes the root, so the result is independent of the order."""
    i, j = find_root(parent, i), find_root(parent, j)
    if i < j:
        parent[j] = i
    elif j < i:
        parent[i] = j


LEAF_SIZE = 60  # subgraphs up to this size are ordered by minimum degree
REFERENCE_VERTICES = 4
SMALL_ORDER = 60  # orders up to which minimum degree runs in plain Python, without SciPy
MIN_BALANCE = 0.2  # smallest product of the weight fractions of the two halves


def nested_dissection(n: int, i: np.ndarray, j: np.ndarray) -> np.ndarray:
    """Order vertices by nested dissection; returns the place (n,) of each in the order of elimination.

    Entries (i, j) as for `sparse_factorisation.analyse_ldl`.
    """
    import scipy.sparse as sp

    own = np.arange(n)
    A = sp.coo_matrix((np.ones(2 * len(i) + n, np.int8), (np.r_[i, j, own], np.r_[j, i, own])), shape=(n, n)).tocsr()
    A.data[:] = 1
    first, group = _merge_equal_neighbours(A)
    merged = A[first][:, first].tocsr()
    merged.setdiag(0)
    merged.eliminate_zeros()
    weight = np.bincount(group).astype(float)
    order: list[np.ndarray] = []
    _append_elimination(merged, weight, np.arange(len(first)), order)
    rank = np.empty(len(first), np.int64)
    rank[np.concatenate(order)] = np.arange(len(first))
    perm = np.empty(n, np.int64)
    perm[np.argsort(rank[group], kind="stable")] = np.arange(n)
    return perm


def _merge_equal_neighbours(A: Any) -> tuple[np.ndarray, np.ndarray]:
    """Merge vertices with equal closed neighbourhoods (rows of one joint): first vertex and group number of each.

    Neighbourhoods are compared by sums of random numbers. Two groups merged by coincidence only cost fill.
    """
    keys = np.random.default_rng(1).integers(1, 2**40, A.shape[0])
    sums = np.add.reduceat(keys[A.indices], A.indptr[:-1])
    _, first, group = np.unique(sums, return_index=True, return_inverse=True)
    return first, group


def _append_elimination(A: Any, weight: np.ndarray, names: np.ndarray, order: list[np.ndarray]) -> None:
    """Append the vertices of a graph, numbered ``names`` in the whole graph, in the order of elimination."""
    from scipy.sparse.csgraph import connected_components

    if len(names) > LEAF_SIZE:
        count, part = connected_components(A, directed=False)
        if count > 1:
            for at in np.split(np.argsort(part, kind="stable"), np.cumsum(np.bincount(part))[:-1]):
                _append_elimination(A[at][:, at], weight[at], names[at], order)
            return
        side = _find_separator(A, weight)
        if side is not None:
            for k in (0, 1):
                at = np.flatnonzero(side == k)
                _append_elimination(A[at][:, at], weight[at], names[at], order)
            order.append(names[side == 2])
            return
    entries = A.tocoo()
    order.append(names[np.argsort(minimum_degree(len(names), entries.row, entries.col))])


def _find_separator(A: Any, weight: np.ndarray) -> np.ndarray | None:
    """Return for each vertex its half, 0 or 1, or 2 in the separator; None if no cut leaves two halves."""
    rows = np.repeat(np.arange(len(weight)), np.diff(A.indptr))
    total = weight.sum()
    best, found = np.inf, None
    for coordinate, second in _distance_coordinates(A):
        by = np.lexsort((second, coordinate))
        left = np.cumsum(weight[by])
        balance = left * (total - left) / total**2
        width = np.minimum(_cut_width(A, rows, by, weight)[:-1], _cut_width(A, rows, by[::-1], weight)[::-1][1:])
        score = np.where(balance[:-1] >= MIN_BALANCE, (width + 1.0) / np.maximum(balance[:-1], MIN_BALANCE), np.inf)
        at = int(np.argmin(score))
        if score[at] < best:
            best, right = score[at], np.ones(len(weight), bool)
            right[by[: at + 1]] = False
            cut = ~right[rows] & right[A.indices]
            found = (right, rows[cut], A.indices[cut])
    if found is None:
        return None
    right, left_ends, right_ends = found
    side = right.astype(np.int64)
    side[_vertex_cover(left_ends, right_ends)] = 2
    return side if (side == 0).any() and (side == 1).any() else None


def _cut_width(A: Any, rows: np.ndarray, by: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Weight of the vertices among the first k + 1 that have neighbours beyond them, for every k."""
    place = np.empty(len(by), np.int64)
    place[by] = np.arange(len(by))
    last = np.maximum.reduceat(place[A.indices], A.indptr[:-1])
    beyond = last > place
    change = np.bincount(place[beyond], weight[beyond], len(by)) - np.bincount(last[beyond], weight[beyond], len(by))
    return np.cumsum(change)


def _distance_coordinates(A: Any) -> list[tuple[np.ndarray, np.ndarray]]:
    """Distances from reference vertices and their differences, each with a second coordinate that breaks ties."""
    from scipy.sparse.csgraph import dijkstra

    def distances(root: int) -> np.ndarray:
        return dijkstra(A, directed=False, indices=root, unweighted=True)

    d = [distances(int(np.argmax(distances(0))))]
    while len(d) < REFERENCE_VERTICES:
        d.append(distances(int(np.argmax(np.min(d, axis=0)))))
    out = [(x, d[(k + 1) % REFERENCE_VERTICES]) for k, x in enumerate(d)]
    for a in range(REFERENCE_VERTICES):
        out += [(d[a] - d[b], d[a] + d[b]) for b in range(a)]
    return out


def _vertex_cover(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Find the smallest set of vertices that touches every edge (left, right) of a bipartite graph."""
    import scipy.sparse as sp
    from scipy.sparse.csgraph import maximum_bipartite_matching

    us, u = np.unique(left, return_inverse=True)
    vs, v = np.unique(right, return_inverse=True)
    B = sp.csr_matrix((np.ones(len(u), np.int8), (u, v)), shape=(len(us), len(vs)))
    of_left = maximum_bipartite_matching(B, perm_type="column")
    of_right = np.full(len(vs), -1)
    of_right[of_left[of_left >= 0]] = np.flatnonzero(of_left >= 0)
    reached = of_left < 0  # by alternating paths from unmatched vertices
    seen = np.zeros(len(vs), bool)
    new = np.flatnonzero(reached)
    while len(new):
        ends = np.unique(B[new].indices)
        ends = ends[~seen[ends]]
        seen[ends] = True
        new = of_right[ends]
        new = new[~reached[new]]
        reached[new] = True
    return np.r_[us[~reached], vs[seen]]


def minimum_degree(n: int, i: np.ndarray, j: np.ndarray) -> np.ndarray:
    """Order unknowns by minimum degree; returns the place (n,) of each. Large matrices: Liu (1985), from SuperLU."""
    if n < SMALL_ORDER:
        return _exact_minimum_degree(n, i, j)
    import scipy.sparse as sp
    from scipy.sparse.linalg import splu

    ones = sp.coo_matrix((np.ones(2 * len(i)), (np.r_[i, j], np.r_[j, i])), shape=(n, n)).tocsc()
    ones.data[:] = -1.0
    ones.setdiag(2.0 * n)  # diagonally dominant: the trial factorisation only yields the ordering
    lu = splu(ones.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return np.asarray(lu.perm_c, np.int64)


def _exact_minimum_degree(n: int, i: np.ndarray, j: np.ndarray) -> np.ndarray:
    """Eliminate the unknown with the fewest neighbours next; its neighbours become neighbours of each other."""
    near: list[set[int]] = [set() for _ in range(n)]
    for a, b in zip(i.tolist(), j.tolist(), strict=True):
        if a != b:
            near[a].add(b)
            near[b].add(a)
    left, place = set(range(n)), np.empty(n, np.int64)
    for k in range(n):
        least = min(left, key=lambda a: (len(near[a]), a))
        place[least] = k
        left.remove(least)
        for a in near[least]:
            near[a] |= near[least]
            near[a] -= {a, least}
    return place
