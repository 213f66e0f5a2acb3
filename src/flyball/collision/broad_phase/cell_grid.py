"""Hashed grid with levels by size, and the sorting of bounded shapes into slots in the order of their cells.

Every shape is in one cell, that of its envelope's middle. Shapes of a level differ in size by at most a factor
of two (ten for shapes that have gained speed), and its cells are as wide as the largest. A shape examines the
neighbouring cells at each level, so the cost is linear in the number of shapes, whatever their sizes (after Eitz
and Gu 2007, "Hierarchical spatial hashing for real-time collision detection").
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from ..shape_kinds import SPHERE
from .envelopes import store_axes, update_axes, update_motion, write_envelope
from .workspace import (
    IS_GENERIC,
    IS_SPHERE,
    SIZE_LEVELS,
)

SMALLEST_EDGE = 1e-6  # smallest edge of a cell, in typical radii: shapes may be points
FARTHEST_CELL = 1e15  # largest distance from the corner in cells; shapes beyond it are in the last cell
KEY_BITS, KEY_MASK = 21, (1 << 21) - 1


@formula
def cell_index(B, l, c, x):
    """Return the number of the cell along axis c at level l."""
    k = (x - B.level_grid.corner[l, c]) * B.level_grid.inverse_edge[l]
    k = min(FARTHEST_CELL, max(-FARTHEST_CELL, k))
    whole = int(k)
    return whole - 1 if k < whole else whole


@formula
def cell_key(a, b, c):
    """Key of a cell; unique while fewer than 2^21 cells are between two cells along each axis."""
    return (a & KEY_MASK) | (b & KEY_MASK) << KEY_BITS | (c & KEY_MASK) << 2 * KEY_BITS


@formula
def bucket_of_cell(B, l, a, b, c):
    """Bucket of a cell in `Search.head`; cells of a row have adjacent buckets."""
    k = a + B.level_cells.row_stride[l] * b + B.level_cells.layer_stride[l] * c
    return B.level_cells.first[l] + (k & B.level_cells.mask[l])


@formula
def size_level(largest, whole):
    """Size level: power of two by which a shape is smaller than the largest of its class."""
    k, edge = 0, 0.5 * largest
    while whole <= edge and k < SIZE_LEVELS - 1:
        k, edge = k + 1, 0.5 * edge
    return k


@formula
def group_extent(sums, g, c, edge):
    """Return the number of cells that a group covers along axis c (without distant shapes), and their start."""
    n = sums.count[g]
    mean = sums.middle[g, c] / n
    spread = 6.0 * sqrt(max(0.0, sums.square[g, c] / n - mean * mean)) / edge
    return 3.0 + min(spread, 1e6), mean - 0.5 * spread * edge


@formula
def lay_out_levels(B):
    """Define the levels from the sums over one class and size: `Search.level_i`, `level_x`; clears all buckets."""
    count, base = 0, 0
    for g in range(B.sums.shape[0]):
        n = int(B.sums.count[g])
        if n == 0:
            continue
        edge = max(2.0 * B.sums.largest[g], SMALLEST_EDGE * B.real.typical_radius)
        B.level_grid.edge[count], B.level_grid.inverse_edge[count] = edge, 1.0 / edge
        places = 2
        while places < 2 * n:
            places *= 2
        row, B.level_grid.corner[count, 0] = group_extent(B.sums, g, 0, edge)
        rows, B.level_grid.corner[count, 1] = group_extent(B.sums, g, 1, edge)
        _, B.level_grid.corner[count, 2] = group_extent(B.sums, g, 2, edge)
        B.level_cells.row_stride[count] = int(row) | 1
        B.level_cells.layer_stride[count] = B.level_cells.row_stride[count] * (int(rows) | 1)
        B.level_cells.collision_class[count], B.level_cells.first[count], B.level_cells.mask[count] = (
            g // SIZE_LEVELS,
            base,
            places - 1,
        )
        B.level_cells.shapes[count] = n
        B.sums.level[g] = count
        base += places
        count += 1
    for k in range(base):
        B.head[k] = -1
    B.count.levels = count
    return base


@formula
def cell_of_slot(B, s, l):
    """Key and bucket of the cell of slot s at level l."""
    a = cell_index(B, l, 0, B.envelope.middle[s, 0])
    b = cell_index(B, l, 1, B.envelope.middle[s, 1])
    c = cell_index(B, l, 2, B.envelope.middle[s, 2])
    return cell_key(a, b, c), bucket_of_cell(B, l, a, b, c)


@formula
def remove_from_cell(B, s):
    """Remove a slot from its cell (before its envelope changes)."""
    l = B.slot.level[s]
    B.level_cells.shapes[l] -= 1
    _, at = cell_of_slot(B, s, l)
    t = B.head[at]
    if t == s:
        B.head[at] = B.link[s]
        return
    while B.link[t] != s:
        t = B.link[t]
    B.link[t] = B.link[s]


@formula
def insert_into_cell(B, s, l):
    """Insert a slot into its cell at level l."""
    B.slot.level[s] = l
    B.level_cells.shapes[l] += 1
    B.key[s], at = cell_of_slot(B, s, l)
    B.link[s] = B.head[at]
    B.head[at] = s


@formula
def finest_level(B, of, whole):
    """Finest level of a class for a shape of this size, or -1."""
    best = -1
    for l in range(B.count.levels):
        takes = B.level_cells.collision_class[l] == of and 2.0 * whole <= B.level_grid.edge[l]
        if takes and (best < 0 or B.level_grid.edge[l] < B.level_grid.edge[best]):
            best = l
    return best


@formula
def neighbour_cells(B, s, l):
    """First and last cells along each axis that can contain partners of slot s at level l, and the number of cells."""
    r = B.envelope.bound[s] + 0.5 * B.level_grid.edge[l]
    x, y, z = B.envelope.middle[s, 0], B.envelope.middle[s, 1], B.envelope.middle[s, 2]
    a, d = cell_index(B, l, 0, x - r), cell_index(B, l, 0, x + r)
    b, e = cell_index(B, l, 1, y - r), cell_index(B, l, 1, y + r)
    c, f = cell_index(B, l, 2, z - r), cell_index(B, l, 2, z + r)
    many = (d - a + 1.0) * (e - b + 1.0) * (f - c + 1.0)
    return (a, b, c), (d, e, f), many


@formula
def scan_is_cheaper(B, many):
    """Whether testing every shape is cheaper than visiting this many cells."""
    return many > 27.0 + B.count.bounded


@formula
def make_envelopes(G, M, B):
    """Compute the envelopes of all bounded shapes, by shape, in ``raw``, and sums by class and size in ``sums``."""
    for g in range(B.sums.shape[0]):
        for c in range(B.sums.shape[1]):
            B.sums[g, c] = 0.0
    for i in range(B.shape_class.shape[0]):
        if B.shape_class[i] >= 0:
            m = G.shape.mover[i]
            update_motion(M, B, i, m, G.shape.kind[i] == SPHERE, B.raw_now, i)
            B.raw_bound[i] = write_envelope(B, B.raw_now, B.raw_envelope, i, m < 0)
            first = B.shape_class[i] * SIZE_LEVELS
            B.sums.largest_of_class[first] = max(B.sums.largest_of_class[first], B.raw_envelope.bound[i])
    for i in range(B.shape_class.shape[0]):
        if B.shape_class[i] >= 0:
            g = B.shape_class[i] * SIZE_LEVELS
            g += size_level(B.sums.largest_of_class[g], B.raw_envelope.bound[i])
            B.mark[i] = g
            B.sums.count[g] += 1.0
            B.sums.largest[g] = max(B.sums.largest[g], B.raw_bound[i])
            for c in range(3):
                x = B.raw_envelope.middle[i, c]
                B.sums.middle[g, c] += x
                B.sums.square[g, c] += x * x


@formula
def number_slots(B, places):
    """Assign slots by counting sort over the buckets: by shape, in ``moved``; ``head`` then holds the first slots."""
    for i in range(B.shape_class.shape[0]):
        if B.shape_class[i] >= 0:
            l = int(B.sums.level[B.mark[i]])
            a = cell_index(B, l, 0, B.raw_envelope.middle[i, 0])
            b = cell_index(B, l, 1, B.raw_envelope.middle[i, 1])
            B.moved[i] = bucket_of_cell(B, l, a, b, cell_index(B, l, 2, B.raw_envelope.middle[i, 2]))
            B.mark[i] = l
            B.head[B.moved[i]] += 1  # from -1
    total = 0
    for p in range(places):
        total += B.head[p] + 1
        B.head[p] = total
    for k in range(B.shape_class.shape[0]):
        i = B.shape_class.shape[0] - 1 - k
        if B.shape_class[i] >= 0:
            p = B.moved[i]
            B.head[p] -= 1
            B.moved[i] = B.head[p]
    for p in range(places):
        first = B.head[p]
        end = B.head[p + 1] if p + 1 < places else total
        if first == end:
            B.head[p] = -1
        for s in range(first, end):
            B.link[s] = s + 1 if s + 1 < end else -1


@formula
def fill_slots(G, M, B):
    """Copy the data by shape to the arrays by slot."""
    for i in range(B.shape_class.shape[0]):
        if B.shape_class[i] >= 0:
            s = B.moved[i]
            B.slot.shape_index[s], B.slot.mover[s], B.slot.level[s] = i, G.shape.mover[i], B.mark[i]
            B.slot.form[s] = IS_SPHERE if G.shape.kind[i] == SPHERE else IS_GENERIC
            B.slot.collision_class[s] = B.shape_class[i]
            for c in range(8):
                B.now[s, c], B.envelope[s, c] = B.raw_now[i, c], B.raw_envelope[i, c]
            if B.slot.form[s] == IS_GENERIC:
                update_axes(G, M, B, s, i, B.slot.mover[s])
                store_axes(B, s)
    for s in range(B.count.bounded):
        B.key[s], _ = cell_of_slot(B, s, B.slot.level[s])
        B.mark[s] = 0


@formula
def sort_shapes(G, M, B):
    """Assign new slots and envelopes to all bounded shapes; restarts the frame."""
    for c in range(3):
        B.frame.origin[c] = B.frame.lag[c] = 0.0
        B.frame.step[c] = B.real.horizon * B.frame.velocity[c]
    make_envelopes(G, M, B)
    number_slots(B, lay_out_levels(B))
    fill_slots(G, M, B)
    B.count.envelopes_renewed += B.count.bounded
