"""Broad phase: which pairs of shapes may touch, from their envelopes in a hashed grid with levels by size.

Every bounded shape has an envelope, a capsule with a skin of a tenth of its radius, that contains it for up to eight
steps (`envelopes`). Every shape is in one cell, that of its envelope's middle. Shapes of a level differ in size by at
most a factor of two (ten for shapes that have gained speed), and its cells are as wide as the largest. A shape examines
the neighbouring cells at each level, so the cost is linear in the number of shapes, whatever their sizes (after Eitz
and Gu 2007, "Hierarchical spatial hashing for real-time collision detection"). Shapes that collide with the same groups
have separate levels. Bounded shapes are sorted into slots in the order of their cells.

Pairs whose envelopes overlap are listed. Only pairs of shapes that leave their envelope are searched again, 3 % per
step in a settling pile. All arrays are in `tables`; if one is full, this is reported, the array is enlarged, and the
search is repeated. All integers have 64 bits, because mixed widths would compile every formula twice.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.scalar import sqrt
from ..math.vec import load3
from .contact_matching import store_pair, stored_contact
from .envelopes import (
    bounds_meet,
    envelope_reaches_plane,
    store_axes,
    store_reference_plane,
    update_axes,
    update_motion,
    write_envelope,
)
from .shape_kinds import SPHERE
from .tables import (
    GENERIC_PAIR,
    IS_GENERIC,
    IS_PLANE,
    IS_SPHERE,
    PLANE_SPHERE,
    SIZE_LEVELS,
    SPHERE_PLANE,
    SPHERE_SPHERE,
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


LONG_ENVELOPE = 0.5  # envelopes longer than this, relative to the radius, are tested as capsules


@formula
def is_excluded(excluded, a, b):
    """Whether the pair of movers is in a sorted list of pairs, the smaller first."""
    if a > b:
        a, b = b, a
    low, high = 0, excluded.shape[0]
    while low < high:
        k = (low + high) // 2
        if excluded[k, 0] < a or (excluded[k, 0] == a and excluded[k, 1] < b):
            low = k + 1
        else:
            high = k
    return low < excluded.shape[0] and excluded[low, 0] == a and excluded[low, 1] == b


@formula
def may_touch(G, B, s, t):
    """Whether the shapes of two slots may collide at all."""
    a, b = B.slot.mover[s], B.slot.mover[t]
    if a == b:  # the same mover, or both fixed
        return False
    if B.count.classes_exact == 0:
        i, j = B.slot.shape_index[s], B.slot.shape_index[t]
        if G.shape.member[i] & G.shape.mask[j] == 0 or G.shape.member[j] & G.shape.mask[i] == 0:
            return False
    return G.excluded_pairs.shape[0] == 0 or not is_excluded(G.excluded_pairs, a, b)


@formula
def squared_axis_distance(fat, s, t, x, y, z):
    """Squared distance of the axes of two envelopes; (x, y, z) from the middle of s to that of t.

    The parameters are found alternately, as for two segments (Ericson 2005, 5.1.9).
    """
    a, b = load3(fat.half_line, s, 0), load3(fat.half_line, t, 0)
    aa = a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
    bb = b[0] * b[0] + b[1] * b[1] + b[2] * b[2]
    ab = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    ax, bx = x * a[0] + y * a[1] + z * a[2], x * b[0] + y * b[1] + z * b[2]
    det = aa * bb - ab * ab
    p = 0.0  # parameter on the axis of s, in [-1, 1]
    if det > 1e-12 * aa * bb:
        p = min(1.0, max(-1.0, (ax * bb - bx * ab) / det))
    q = 0.0
    if bb > 0.0:
        q = min(1.0, max(-1.0, (p * ab - bx) / bb))
    if aa > 0.0:
        p = min(1.0, max(-1.0, (ax + q * ab) / aa))
    if det <= 1e-12 * aa * bb and bb > 0.0:  # parallel: one more iteration
        q = min(1.0, max(-1.0, (p * ab - bx) / bb))
        if aa > 0.0:
            p = min(1.0, max(-1.0, (ax + q * ab) / aa))
    x, y, z = x + q * b[0] - p * a[0], y + q * b[1] - p * a[1], z + q * b[2] - p * a[2]
    return x * x + y * y + z * z


@formula
def envelopes_meet(B, s, t):
    """Whether the envelopes of two bounded slots overlap."""
    fat = B.envelope
    x = fat.middle[t, 0] - fat.middle[s, 0]
    y = fat.middle[t, 1] - fat.middle[s, 1]
    z = fat.middle[t, 2] - fat.middle[s, 2]
    whole = fat.bound[s] + fat.bound[t]
    if x * x + y * y + z * z > whole * whole:
        return False
    close = fat.radius[s] + fat.radius[t]
    if whole > (1.0 + LONG_ENVELOPE) * close and squared_axis_distance(fat, s, t, x, y, z) > close * close:
        return False
    return bounds_meet(B, B.turn, s, t, (x, y, z), whole - B.now.radius[s] - B.now.radius[t])


SUCCEEDING_SLOTS, ALL_SLOTS, UNVISITED_SLOTS = range(3)
"""Accepted partners: those later in order, all, or all but moved ones that come earlier."""


@formula
def add_pair(G, B, s, t):
    """Add two slots to the list; returns whether the table was large enough."""
    n = B.count.pairs
    if n >= B.pair.shape[0]:
        return False
    i, j = B.slot.shape_index[s], B.slot.shape_index[t]
    if i > j:
        i, j, s, t = j, i, t, s
    a, b = B.slot.form[s], B.slot.form[t]
    way = GENERIC_PAIR
    if b == IS_SPHERE and (a == IS_SPHERE or a == IS_PLANE):
        way = SPHERE_SPHERE if a == IS_SPHERE else PLANE_SPHERE
    elif a == IS_SPHERE and b == IS_PLANE:
        way = SPHERE_PLANE
    B.pair.first[n], B.pair.second[n], B.pair.kind[n] = s, t, way
    B.first_contacts[B.count.current_half, n] = stored_contact(B, i, j)
    B.count.pairs = n + 1
    return True


@formula
def add_from_cell(G, B, s, t, key, which):
    """Add partners from the cell ``key``; ``t`` is the first slot of its bucket."""
    compared = 0
    while t >= 0:
        if B.key[t] == key and t != s and not (which == UNVISITED_SLOTS and t < s and B.mark[t] != 0):
            compared += 1
            if envelopes_meet(B, s, t) and may_touch(G, B, s, t) and not add_pair(G, B, s, t):
                return False
        t = B.link[t]
    B.count.pairs_compared += compared
    return True


@formula
def add_from_level(G, B, s, l, which):
    """Add partners from level l, by testing every slot."""
    for t in range(B.count.bounded):
        if B.slot.level[t] == l and t != s and not (which == UNVISITED_SLOTS and t < s and B.mark[t] != 0):
            B.count.pairs_compared += 1
            if envelopes_meet(B, s, t) and may_touch(G, B, s, t) and not add_pair(G, B, s, t):
                return False
    return True


@formula
def add_neighbours(G, B, s, l, which):
    """Add the partners of slot s at level l; returns whether the table was large enough."""
    first, last, many = neighbour_cells(B, s, l)
    if which != SUCCEEDING_SLOTS and scan_is_cheaper(B, many):
        return add_from_level(G, B, s, l, which)
    a, b, c = first
    own = (a, b, c)
    if which == SUCCEEDING_SLOTS:
        own = (
            cell_index(B, l, 0, B.envelope.middle[s, 0]),
            cell_index(B, l, 1, B.envelope.middle[s, 1]),
            cell_index(B, l, 2, B.envelope.middle[s, 2]),
        )
        if not add_from_cell(G, B, s, B.link[s], B.key[s], SUCCEEDING_SLOTS):
            return False
        c = own[2]
    for z in range(c, last[2] + 1):
        ahead = which == SUCCEEDING_SLOTS and z == own[2]
        for y in range(own[1] if ahead else b, last[1] + 1):
            for x in range(own[0] + 1 if ahead and y == own[1] else a, last[0] + 1):
                t = B.head[bucket_of_cell(B, l, x, y, z)]
                if t >= 0 and not add_from_cell(G, B, s, t, cell_key(x, y, z), which):
                    return False
    return True


@formula
def add_plane_pairs(G, B, w):
    """Add the partners of a wide slot; returns whether the table was large enough."""
    of = B.slot.collision_class[w]
    store_reference_plane(B, w - B.count.bounded, B.slot.mover[w] < 0)
    for s in range(B.count.bounded):
        near = B.meets[of, B.slot.collision_class[s]] != 0 and envelope_reaches_plane(B, w - B.count.bounded, s)
        if near and may_touch(G, B, s, w) and not add_pair(G, B, s, w):
            return False
    return True


@formula
def list_all(G, B):
    """List all pairs, in the order of the slots; returns whether the table was large enough."""
    B.count.pairs = 0
    for s in range(B.count.bounded):
        own = B.slot.level[s]
        edge = B.level_grid.edge[own]
        for l in range(B.count.levels):
            if B.meets[B.slot.collision_class[s], B.level_cells.collision_class[l]] != 0:
                coarser = B.level_grid.edge[l] > edge or (B.level_grid.edge[l] == edge and l >= own)
                if coarser and not add_neighbours(G, B, s, l, SUCCEEDING_SLOTS if l == own else ALL_SLOTS):
                    return False
    for w in range(B.count.bounded, B.count.bounded + B.count.wide):  # noqa: SIM110
        if not add_plane_pairs(G, B, w):
            return False
    return True


@formula
def drop_moved(B):
    """Remove pairs of marked slots from the list, and store their contacts in the hash table."""
    n, half = 0, B.count.current_half
    for k in range(B.count.pairs):
        s, t, first = (
            B.pair.first[k] + 0,
            B.pair.second[k] + 0,
            B.first_contacts[half, k] + 0,
        )  # all integers of one type
        if B.mark[s] == 0 and B.mark[t] == 0:
            if n < k:
                B.pair.first[n], B.pair.second[n], B.pair.kind[n], B.first_contacts[half, n] = (
                    s,
                    t,
                    B.pair.kind[k],
                    first,
                )
            n += 1
        elif first >= 0:
            store_pair(B, B.slot.shape_index[s], B.slot.shape_index[t], first)
    B.count.pairs = n


@formula
def renew_envelope(B, s):
    """Compute a new envelope of slot s and insert it into its cell; returns whether a level fits."""
    i = B.slot.shape_index[s]
    for c in range(8):
        B.raw_now[i, c] = B.now[s, c]
    write_envelope(B, B.raw_now, B.raw_envelope, i, B.slot.mover[s] < 0)
    l = finest_level(B, B.slot.collision_class[s], B.raw_envelope.bound[i])
    if l < 0:
        return False
    remove_from_cell(B, s)
    for c in range(8):
        B.envelope[s, c] = B.raw_envelope[i, c]
    if B.slot.form[s] == IS_GENERIC:
        store_axes(B, s)
    insert_into_cell(B, s, l)
    B.count.envelopes_renewed += 1
    return True


@formula
def list_moved(G, B):
    """Append the pairs of shapes that have left their envelopes; returns whether the table was large enough."""
    wide = B.count.bounded
    for k in range(B.count.moved_slots):
        s = B.moved[k]
        if s >= wide:
            if not add_plane_pairs(G, B, s):
                return False
            continue
        for l in range(B.count.levels):
            if B.meets[B.slot.collision_class[s], B.level_cells.collision_class[l]] != 0 and not add_neighbours(
                G, B, s, l, UNVISITED_SLOTS
            ):
                return False
        for w in range(wide, wide + B.count.wide):
            may = B.mark[w] == 0 and B.meets[B.slot.collision_class[w], B.slot.collision_class[s]] != 0
            if may and envelope_reaches_plane(B, w - wide, s) and may_touch(G, B, s, w) and not add_pair(G, B, s, w):
                return False
    return True
