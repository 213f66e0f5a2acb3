"""Contact islands: sets of nodes and groups connected by contacts and lines, found by union-find (`graphs`).

Immovable sides (`FIXED_SIDE`) connect nothing; nodes and groups do, even those that no impulse moves.
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
    """Contacts, lines, nodes and groups sorted by island; islands in the order of their first contacts, then lines."""

    parent: Int1  # (nn + ng,): forest over nodes, then groups; afterwards the island of each, or -1
    order: Int1  # (nc,): contacts sorted by island
    island: Int1  # (ni + 1,): as in `ContactProblem`; allocated for the largest possible number
    line_order: Int1  # (nl,): lines sorted by island
    line_p: Int1  # (ni + 1,)
    member: Int1  # (nn,): nodes of islands; the rest of the array is not used
    member_p: Int1  # (ni + 1,)
    group_order: Int1  # (ng,)
    group_p: Int1  # (ni + 1,)


@formula
def side_vertex(at, nodes):
    """Vertex number of a side among nodes, then groups, or -1."""
    return at if at >= 0 else nodes - 2 - at if at < FIXED_SIDE else -1


@formula
def contact_vertex(at, c, nodes):
    """Return a vertex on which contact c acts, -1 if there is none."""
    a = side_vertex(at[c, 0], nodes)
    return a if a >= 0 else side_vertex(at[c, 1], nodes)


@formula
def number_islands(at, line_at, sizes, I):
    """Assign numbers to the islands in ``parent`` (entry of each root: -2 - island); returns their count."""
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
    """Give the root of a the next number if it has none (all paths have length one); returns the new count."""
    if a < 0 or parent[a] < 0:
        return count
    r = parent[a]
    if parent[r] < 0:
        return count
    parent[r] = -2 - count
    return count + 1


@formula
def label_vertices(I, n):
    """Convert roots to island numbers; -1 for vertices without contacts and lines."""
    # a numbered root holds -2 - island, its members hold the root; a root precedes its members
    for i in range(n - 1, -1, -1):
        r = I.parent[i]
        if r >= 0:
            r = I.parent[r]
        I.parent[i] = -2 - r if r < -1 else -1


@formula
def sort_contacts(at, nc, nn, count, I):
    """Sort contacts by island, stable; those on nothing movable come last, in no island."""
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
    """Sort 0 to number - 1 by the island ``parent[first + i]``, ascending; those without island are left out."""
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
    """Sort lines by island, stable."""
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
    """Find islands; see `islands_of`. Returns their count."""
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
    """Allocate the islands of a problem."""
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
    """Find the islands of contacts and lines.

    Parameters
    ----------
    at : ndarray (nc, 2)
        Sides of contacts, as `ContactProblem.at`.
    line_at : ndarray (nl, 2)
        As `ContactProblem.line_at`.
    nodes, groups : int

    Returns
    -------
    int
        Number of islands.
    Islands
    """
    I = allocate_islands(len(at), nodes, groups, len(line_at))
    sizes = np.array([len(at), nodes, groups, len(line_at)])
    return int(islands_kernel(at, line_at, sizes, I)), I
