"""Equations in the order in which they can be solved: block triangular form of a square pattern.

Equations and unknowns are matched (Hopcroft and Karp 1973); what then depends on one another is a block (the strongly
connected components of Tarjan 1972; Duff and Reid 1978).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

Block = tuple[list[int], list[int]]
"""Equations and the unknowns that they determine together."""


def blocks(pattern: np.ndarray) -> list[Block] | None:
    """Blocks in an order of solution.

    Parameters
    ----------
    pattern : ndarray of bool (n, n)
        Whether an unknown (column) stands in an equation (row).

    Returns
    -------
    list of (rows, columns) or None
        None where the pattern alone makes the equations singular.
    """
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components, maximum_bipartite_matching

    n = len(pattern)
    if n == 0:
        return []
    match = maximum_bipartite_matching(sp.csr_matrix(pattern), perm_type="column")  # row -> column
    if (match < 0).any():
        return None
    moved = pattern[:, match]  # unknown k is now the one that equation k is solved for
    count, label = connected_components(sp.csr_matrix(moved), directed=True, connection="strong")
    rows = [np.flatnonzero(label == k).tolist() for k in range(count)]
    needs = [{int(label[j]) for r in rows[k] for j in np.flatnonzero(moved[r])} - {k} for k in range(count)]
    return [(rows[k], match[rows[k]].tolist()) for k in _in_order(needs, [min(match[r]) for r in rows])]


def _in_order(needs: Sequence[set[int]], first: Sequence[int]) -> list[int]:
    """Each after those that it needs; else by their first unknowns."""
    done: list[int] = []
    left = sorted(range(len(needs)), key=lambda k: first[k])
    while left:
        k = next(k for k in left if needs[k] <= set(done))
        done.append(k)
        left.remove(k)
    return done
