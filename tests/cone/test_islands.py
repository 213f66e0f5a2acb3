"""Islands against connected components of SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from flyball.numerics.complementarity.solver_choice import islands_of


def components(at, line_at, nodes, groups):
    """Component of each contact and each line (-1 - c for a contact on nothing that moves)."""
    side = np.where(at >= 0, at, np.where(at == -1, -1, nodes - 2 - at))
    both = side[(side >= 0).all(1)]
    n = nodes + groups
    of = connected_components(coo_matrix((np.ones(len(both)), both.T), (n, n)), directed=False)[1]
    some = side.max(1) if len(side) else np.zeros(0, int)
    return np.where(some >= 0, of[some] if n else -1, -1), of[nodes + line_at[:, 0]], of


@pytest.mark.parametrize("seed", range(20))
def test_islands_are_connected_components(seed):
    rng = np.random.default_rng(seed)
    nodes, groups = rng.integers(1, 60), rng.integers(0, 10)
    nc, nl = rng.integers(0, 80), rng.integers(0, 8) if groups else 0
    at = rng.integers(-1 - groups, nodes, (nc, 2))
    line_at = np.zeros((nl, 2), np.int64)
    line_at[:, 0] = rng.integers(groups, size=nl) if nl else 0
    count, I = islands_of(at, line_at, nodes, groups)
    contact, line, of = components(at, line_at, nodes, groups)
    assert count == len(set(contact[contact >= 0]) | set(line))
    assert sorted(I.order) == list(range(nc)) and sorted(I.line_order) == list(range(nl))
    for k in range(count):
        contacts, lines = I.order[I.island[k] : I.island[k + 1]], I.line_order[I.line_p[k] : I.line_p[k + 1]]
        assert (np.diff(contacts) > 0).all() and (np.diff(lines) > 0).all()  # the order that they had
        mine = {*contact[contacts], *line[lines]}
        assert len(mine) == 1
        held = {*I.member[I.member_p[k] : I.member_p[k + 1]], *(nodes + I.group_order[I.group_p[k] : I.group_p[k + 1]])}
        assert held == set(np.nonzero(of == mine.pop())[0])
    assert (contact[I.order[I.island[count] :]] == -1).all()
    assert I.line_p[count] == nl


def test_the_time_is_linear_in_a_long_chain():
    """A chain of 200,000 in an order that makes trees without halving deep; it ends at all."""
    n = 200_000
    at = np.stack([np.arange(n - 1), np.arange(1, n)], 1)[::-1].copy()
    count, I = islands_of(at, np.zeros((0, 2), np.int64), n, 0)
    assert count == 1 and I.member_p[1] == n
