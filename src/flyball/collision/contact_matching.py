"""Contact matching: finds each contact of this step among those of the last step.

A hash table of pairs stores the first contact of each pair while the list of pairs is rebuilt. Within a pair,
contacts are matched by feature, otherwise by distance.
"""

from __future__ import annotations

from ..compiler.formulas import formula

EMPTY_PLACE = -1
MATCHING_DISTANCE = (
    0.3  # largest distance, relative to the radius, at which contacts with different features are matched
)


@formula
def table_place(names, i, j, name):
    """Find the place of a pair in the table, or the empty place for it.

    Pairs of shapes with similar numbers have places near each other, because they are mostly accessed together.
    """
    mask = names.shape[0] - 1
    k = (3 * i + 5 * j) & mask
    while names[k] != EMPTY_PLACE and names[k] != name:
        k = (k + 1) & mask
    return k


@formula
def store_pair(B, i, j, first):
    """Store a pair of shapes and its first contact in the table."""
    name = i * B.shape_class.shape[0] + j
    k = table_place(B.table.names, i, j, name)
    if B.table.names[k] == EMPTY_PLACE:
        B.table.names[k], B.table.firsts[k] = name, first
        B.table.occupied[B.count.table_pairs] = k
        B.count.table_pairs += 1


@formula
def stored_contact(B, i, j):
    """First contact of a pair, or -1."""
    if B.count.table_pairs == 0:
        return -1
    name = i * B.shape_class.shape[0] + j
    k = table_place(B.table.names, i, j, name)
    return B.table.firsts[k] if B.table.names[k] == name else -1


@formula
def clear_table(B):
    """Empty the table."""
    for k in range(B.count.table_pairs):
        B.table.names[B.table.occupied[k]] = EMPTY_PLACE
    B.count.table_pairs = 0


@formula
def store_all_pairs(O, B):
    """Store all pairs that have contacts in O in the table."""
    i, j = -1, -1
    for c in range(O.count.found):
        if O.at.shape_1[c] != i or O.at.shape_2[c] != j:
            i, j = O.at.shape_1[c], O.at.shape_2[c]
            store_pair(B, i, j, c)


@formula
def matching_contact(O, pair, first, feature, point, size, used):
    """Match the contact at ``point`` with one of the last search; bits of ``used`` mark those already matched.

    Returns its index and its bit, or -1 and 0.
    """
    end, best, bit = O.count.found, -1, 0
    c = first
    while 0 <= c < end and c - first < 62 and O.at.shape_1[c] == pair[0] and O.at.shape_2[c] == pair[1]:
        b = 1 << (c - first)
        if O.at.feature[c] == feature and used & b == 0:
            return c, b
        c += 1
    least = (MATCHING_DISTANCE * size) ** 2
    for k in range(max(0, c - first)):
        b = 1 << k
        if used & b == 0:
            x = O.x.point[first + k, 0] - point[0]
            y = O.x.point[first + k, 1] - point[1]
            z = O.x.point[first + k, 2] - point[2]
            d = x * x + y * y + z * z
            if d < least:
                least, best, bit = d, first + k, b
    return best, bit
