"""The list of pairs of shapes that may touch: pair filter, overlap of envelopes, full and partial rebuild."""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.vec import load3
from ..contact_matching import store_pair, stored_contact
from .cell_grid import (
    bucket_of_cell,
    cell_index,
    cell_key,
    finest_level,
    insert_into_cell,
    neighbour_cells,
    remove_from_cell,
    scan_is_cheaper,
)
from .envelopes import bounds_meet, envelope_reaches_plane, store_axes, store_reference_plane, write_envelope
from .workspace import (
    GENERIC_PAIR,
    IS_GENERIC,
    IS_PLANE,
    IS_SPHERE,
    PLANE_SPHERE,
    SPHERE_PLANE,
    SPHERE_SPHERE,
)

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
