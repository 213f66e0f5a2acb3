"""Contact matching: which contact of this step is which contact of the last step.

A hash table of pairs remembers the first contact of each pair while the list of pairs is rebuilt; within a pair,
contacts are matched by feature, else by distance.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from .broad_phase.workspace import TABLE_PAIRS
from .tables import FEATURE, FOUND, POINT, SHAPE_1, SHAPE_2

EMPTY_PLACE = -1
MATCHING_DISTANCE = (
    0.3  # a contact without a feature's namesake is the nearest one, if it is nearer than this, in radii
)


@formula
def table_place(names, i, j, name):
    """Where a pair stands in the table, or the empty place where it would stand.

    Pairs of shapes with near numbers stand near each other, for these are mostly asked for together.
    """
    mask = names.shape[0] - 1
    k = (3 * i + 5 * j) & mask
    while names[k] != EMPTY_PLACE and names[k] != name:
        k = (k + 1) & mask
    return k


@formula
def store_pair(B, i, j, first):
    """Put a pair of shapes and its first contact into the table."""
    name = i * B.shape_class.shape[0] + j
    k = table_place(B.names, i, j, name)
    if B.names[k] == EMPTY_PLACE:
        B.names[k], B.firsts[k] = name, first
        B.taken[B.count[TABLE_PAIRS]] = k
        B.count[TABLE_PAIRS] += 1


@formula
def stored_contact(B, i, j):
    """The first contact of a pair, or -1."""
    if B.count[TABLE_PAIRS] == 0:
        return -1
    name = i * B.shape_class.shape[0] + j
    k = table_place(B.names, i, j, name)
    return B.firsts[k] if B.names[k] == name else -1


@formula
def clear_table(B):
    """Empty the table."""
    for k in range(B.count[TABLE_PAIRS]):
        B.names[B.taken[k]] = EMPTY_PLACE
    B.count[TABLE_PAIRS] = 0


@formula
def store_all_pairs(O, B):
    """Put all pairs that have contacts in O into the table."""
    i, j = -1, -1
    for c in range(O.count[FOUND]):
        if O.at[c, SHAPE_1] != i or O.at[c, SHAPE_2] != j:
            i, j = O.at[c, SHAPE_1], O.at[c, SHAPE_2]
            store_pair(B, i, j, c)


@formula
def matching_contact(O, pair, first, feature, point, size, used):
    """The contact before of a pair of shapes that is the one at ``point`` now; bits of ``used`` say which are taken.

    Returns its place and its bit, or -1 and 0.
    """
    end, best, bit = O.count[FOUND], -1, 0
    c = first
    while 0 <= c < end and c - first < 62 and O.at[c, SHAPE_1] == pair[0] and O.at[c, SHAPE_2] == pair[1]:
        b = 1 << (c - first)
        if O.at[c, FEATURE] == feature and used & b == 0:
            return c, b
        c += 1
    least = (MATCHING_DISTANCE * size) ** 2
    for k in range(max(0, c - first)):
        b = 1 << k
        if used & b == 0:
            x = O.x[first + k, POINT] - point[0]
            y = O.x[first + k, POINT + 1] - point[1]
            z = O.x[first + k, POINT + 2] - point[2]
            d = x * x + y * y + z * z
            if d < least:
                least, best, bit = d, first + k, b
    return best, bit
