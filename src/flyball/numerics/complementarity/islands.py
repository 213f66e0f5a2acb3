"""Contact islands: what contacts and lines connect, by union-find (`graphs`).

What stands still (`FIXED_SIDE`) connects nothing; nodes and groups do, also those that no impulse moves.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...compiler.formulas import formula
from ...compiler.kernels import kernel
from ...compiler.struct_layout import Int1, Int2
from ..graphs import find_root, unite
from .contact_problem import FIXED_SIDE


class Islands(NamedTuple):
    """Contacts, lines, nodes and groups by island; islands in the order of their first contacts, then first lines."""

    parent: Int1  # (nn + ng,): forest over nodes, then groups; afterwards the island of each or -1
    order: Int1  # (nc,): contact that stands at each place when those of an island stand together
    island: Int1  # (ni + 1,): as in `Problem`; room for one more than there are contacts and lines
    line_order: Int1  # (nl,): likewise of lines
    line_p: Int1  # (ni + 1,)
    member: Int1  # (nn,): nodes of islands; the rest of the array is not used
    member_p: Int1  # (ni + 1,)
    group_order: Int1  # (ng,)
    group_p: Int1  # (ni + 1,)


@formula
def side_vertex(at, nodes):
    """A side's place among nodes and groups, or -1."""
    return at if at >= 0 else nodes - 2 - at if at < FIXED_SIDE else -1


@formula
def contact_vertex(at, c, nodes):
    """Something that contact c acts on, -1 if nothing."""
    a = side_vertex(at[c, 0], nodes)
    return a if a >= 0 else side_vertex(at[c, 1], nodes)


@formula
def number_islands(at, line_at, sizes, I):
    """Number the islands in I.island (of each root, as -2 - island in ``parent``); returns how many there are."""
    nc, nn, ng, nl = sizes
    for i in range(nn + ng):
        I.parent[i] = i
    for c in range(nc):
        a, b = side_vertex(at[c, 0], nn), side_vertex(at[c, 1], nn)
        if a >= 0 and b >= 0:
            unite(I.parent, a, b)
    for i in range(nn + ng):
        I.parent[i] = find_root(I.parent, i)
    count = 0
    for c in range(nc):
        count = number_root(I.parent, contact_vertex(at, c, nn), count)
    for k in range(nl):
        count = number_root(I.parent, nn + line_at[k, 0], count)
    return count


@formula
def number_root(parent, a, count):
    """Give the root of a, all paths being of length one, the next number if it has none; how many have one then."""
    if a < 0 or parent[a] < 0:
        return count
    r = parent[a]
    if parent[r] < 0:
        return count
    parent[r] = -2 - count
    return count + 1


@formula
def label_vertices(I, n):
    """From roots to islands: -1 for what nothing touches."""
    # a root that was numbered holds -2 - island, all below it the root; roots lead what is larger only
    for i in range(n - 1, -1, -1):
        r = I.parent[i]
        if r >= 0:
            r = I.parent[r]
        I.parent[i] = -2 - r if r < -1 else -1


@formula
def sort_contacts(at, nc, nn, count, I):
    """Contacts by island, in the order that they had; those on nothing that moves come last, in no island."""
    for k in range(count + 1):
        I.island[k] = 0
    for c in range(nc):
        a = contact_vertex(at, c, nn)
        if a >= 0:
            I.island[I.parent[a] + 1] += 1
    for k in range(count):
        I.island[k + 1] += I.island[k]
    rest = I.island[count]
    for c in range(nc - 1, -1, -1):
        a = contact_vertex(at, c, nn)
        if a >= 0:
            k = I.parent[a]
            I.island[k + 1] -= 1
            I.order[I.island[k + 1]] = c
    for k in range(count):
        I.island[k] = I.island[k + 1]
    I.island[count] = rest
    for c in range(nc):
        if contact_vertex(at, c, nn) < 0:
            I.order[rest] = c
            rest += 1


@formula
def sort_vertices(first, count, number, parent, order, start):
    """Numbers 0 to number - 1 by the island of ``parent[first + i]``, ascending; those of none are left out."""
    for k in range(count + 1):
        start[k] = 0
    for i in range(number):
        if parent[first + i] >= 0:
            start[parent[first + i] + 1] += 1
    for k in range(count):
        start[k + 1] += start[k]
    rest = start[count]
    for i in range(number - 1, -1, -1):
        k = parent[first + i]
        if k >= 0:
            start[k + 1] -= 1
            order[start[k + 1]] = i
    for k in range(count):
        start[k] = start[k + 1]
    start[count] = rest


@formula
def sort_lines(line_at, nl, nn, count, I):
    """Lines by island, in the order that they had."""
    for k in range(count + 1):
        I.line_p[k] = 0
    for k in range(nl):
        I.line_p[I.parent[nn + line_at[k, 0]] + 1] += 1
    for k in range(count):
        I.line_p[k + 1] += I.line_p[k]
    for e in range(nl - 1, -1, -1):
        k = I.parent[nn + line_at[e, 0]]
        I.line_p[k + 1] -= 1
        I.line_order[I.line_p[k + 1]] = e
    for k in range(count):
        I.line_p[k] = I.line_p[k + 1]
    I.line_p[count] = nl


@formula
def find_islands(at, line_at, sizes, I):
    """Find islands; see `islands_of`. Returns how many there are."""
    nc, nn, ng, nl = sizes
    count = number_islands(at, line_at, sizes, I)
    label_vertices(I, nn + ng)
    sort_contacts(at, nc, nn, count, I)
    sort_lines(line_at, nl, nn, count, I)
    sort_vertices(0, count, nn, I.parent, I.member, I.member_p)
    sort_vertices(nn, count, ng, I.parent, I.group_order, I.group_p)
    return count


@kernel
def islands_kernel(at: Int2, line_at: Int2, sizes: Int1, I: Islands) -> int:
    """Find islands; see `islands_of`."""
    return find_islands(at, line_at, (sizes[0], sizes[1], sizes[2], sizes[3]), I)


def allocate_islands(contacts: int, nodes: int, groups: int, lines: int) -> Islands:
    """Room for the islands of a problem."""
    most = min(contacts + lines, nodes + groups) + 1

    def whole(n: int) -> np.ndarray:
        return np.zeros(n, np.int64)

    return Islands(
        whole(nodes + groups),
        whole(contacts),
        whole(most),
        whole(lines),
        whole(most),
        whole(nodes),
        whole(most),
        whole(groups),
        whole(most),
    )


def islands_of(at: np.ndarray, line_at: np.ndarray, nodes: int, groups: int) -> tuple[int, Islands]:
    """Islands of contacts and lines.

    Parameters
    ----------
    at : ndarray (nc, 2)
        Sides of contacts, as `Problem.at`.
    line_at : ndarray (nl, 2)
        As `Problem.line_at`.
    nodes, groups : int

    Returns
    -------
    int
        How many islands there are.
    Islands
    """
    I = allocate_islands(len(at), nodes, groups, len(line_at))
    sizes = np.array([len(at), nodes, groups, len(line_at)])
    return int(islands_kernel(at, line_at, sizes, I)), I
