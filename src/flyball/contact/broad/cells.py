"""A hashed grid with levels by size: every shape stands in one cell, that of its envelope's middle.

Shapes of a level differ by no more than a factor of two (of ten with what has gained speed), and its cells are as wide
as the largest. So a shape looks at the cells about it at each level, and what it costs is linear in the number of
shapes, whatever their sizes (after Eitz and Gu 2007, "Hierarchical spatial hashing for real-time collision detection").
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from .desk import (
    BASE,
    BOUNDED,
    CORNER,
    EDGE,
    LAYER,
    LEVEL,
    LEVELS,
    MASKED,
    MIDDLE,
    OF,
    PER_EDGE,
    ROW,
    SHAPES,
    SIZES,
    USUAL,
    WHOLE,
)

LEAST = 1e-6  # edges of cells, in usual radii: shapes may be points
FAR = 1e15  # cells from the corner; what is further away stands in the last one
BITS, LAST = 21, (1 << 21) - 1


@formula
def cell(B, l, c, x):
    """Number of the cell along axis c at level l."""
    k = (x - B.level_x[l, CORNER + c]) * B.level_x[l, PER_EDGE]
    k = min(FAR, max(-FAR, k))
    whole = int(k)
    return whole - 1 if k < whole else whole


@formula
def name(a, b, c):
    """A cell by one number; cells are told apart as long as fewer than 2^21 lie between them along an axis."""
    return (a & LAST) | (b & LAST) << BITS | (c & LAST) << 2 * BITS


@formula
def place(B, l, a, b, c):
    """Where in `Search.head` a cell stands; cells of a row stand side by side."""
    k = a + B.level_i[l, ROW] * b + B.level_i[l, LAYER] * c
    return B.level_i[l, BASE] + (k & B.level_i[l, MASKED])


@formula
def size_of(largest, whole):
    """By which power of two a shape is smaller than the largest of its class."""
    k, edge = 0, 0.5 * largest
    while whole <= edge and k < SIZES - 1:
        k, edge = k + 1, 0.5 * edge
    return k


@formula
def along(sums, g, c, edge):
    """Over how many cells a group lies along axis c (without shapes far from the rest); where these begin."""
    n = sums[g, 0]
    mean = sums[g, 2 + c] / n
    spread = 6.0 * sqrt(max(0.0, sums[g, 5 + c] / n - mean * mean)) / edge
    return 3.0 + min(spread, 1e6), mean - 0.5 * spread * edge


@formula
def lay_out(B):
    """Levels from the sums over groups of one class and size: `Search.level_i`, `level_x`; all places emptied."""
    count, base = 0, 0
    for g in range(B.sums.shape[0]):
        n = int(B.sums[g, 0])
        if n == 0:
            continue
        edge = max(2.0 * B.sums[g, 1], LEAST * B.real[USUAL])
        B.level_x[count, EDGE], B.level_x[count, PER_EDGE] = edge, 1.0 / edge
        places = 2
        while places < 2 * n:
            places *= 2
        row, B.level_x[count, CORNER] = along(B.sums, g, 0, edge)
        rows, B.level_x[count, CORNER + 1] = along(B.sums, g, 1, edge)
        _, B.level_x[count, CORNER + 2] = along(B.sums, g, 2, edge)
        B.level_i[count, ROW] = int(row) | 1
        B.level_i[count, LAYER] = B.level_i[count, ROW] * (int(rows) | 1)
        B.level_i[count, OF], B.level_i[count, BASE], B.level_i[count, MASKED] = g // SIZES, base, places - 1
        B.level_i[count, SHAPES] = n
        B.sums[g, 8] = count
        base += places
        count += 1
    for k in range(base):
        B.head[k] = -1
    B.count[LEVELS] = count
    return base


@formula
def cell_of(B, s, l):
    """Name and place of the cell in which slot s stands at level l."""
    a = cell(B, l, 0, B.fat[s, MIDDLE])
    b = cell(B, l, 1, B.fat[s, MIDDLE + 1])
    c = cell(B, l, 2, B.fat[s, MIDDLE + 2])
    return name(a, b, c), place(B, l, a, b, c)


@formula
def unlink(B, s):
    """Take a slot out of its cell (before its envelope changes)."""
    l = B.slot[s, LEVEL]
    B.level_i[l, SHAPES] -= 1
    _, at = cell_of(B, s, l)
    t = B.head[at]
    if t == s:
        B.head[at] = B.link[s]
        return
    while B.link[t] != s:
        t = B.link[t]
    B.link[t] = B.link[s]


@formula
def link(B, s, l):
    """Put a slot into its cell at level l."""
    B.slot[s, LEVEL] = l
    B.level_i[l, SHAPES] += 1
    B.key[s], at = cell_of(B, s, l)
    B.link[s] = B.head[at]
    B.head[at] = s


@formula
def level_for(B, of, whole):
    """The finest level of a class that takes a shape of this size, or -1."""
    best = -1
    for l in range(B.count[LEVELS]):
        takes = B.level_i[l, OF] == of and 2.0 * whole <= B.level_x[l, EDGE]
        if takes and (best < 0 or B.level_x[l, EDGE] < B.level_x[best, EDGE]):
            best = l
    return best


@formula
def window(B, s, l):
    """First and last cells along each axis in which partners of slot s can stand at level l, and how many cells."""
    r = B.fat[s, WHOLE] + 0.5 * B.level_x[l, EDGE]
    x, y, z = B.fat[s, MIDDLE], B.fat[s, MIDDLE + 1], B.fat[s, MIDDLE + 2]
    a, d = cell(B, l, 0, x - r), cell(B, l, 0, x + r)
    b, e = cell(B, l, 1, y - r), cell(B, l, 1, y + r)
    c, f = cell(B, l, 2, z - r), cell(B, l, 2, z + r)
    many = (d - a + 1.0) * (e - b + 1.0) * (f - c + 1.0)
    return (a, b, c), (d, e, f), many


@formula
def crowded(B, many):
    """Whether looking at every shape is quicker than looking at so many cells."""
    return many > 27.0 + B.count[BOUNDED]
