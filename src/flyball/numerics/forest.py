"""Union and find (Tarjan 1975): what hangs together, in linear time."""

from __future__ import annotations

from ..compiler.formulas import formula


@formula
def root(parent, i):
    """The root of i; paths are halved on the way."""
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@formula
def unite(parent, i, j):
    """Two become one; the smaller number leads, so that nothing depends on the order of what unites them."""
    i, j = root(parent, i), root(parent, j)
    if i < j:
        parent[j] = i
    elif j < i:
        parent[i] = j
