"""An island as rows over blocks of six velocities of unit mass, in the rooms of `Factor`.

A node becomes one block: velocities counted so that its mass matrix is 1, v = v_free + C e with C C' its inverse mass
matrix. A group becomes as many blocks as it takes: the Delassus matrix J Y' of the rows that meet it has a Cholesky
factor of few columns (pivoted, of the rank of what the group can do there), and u = u_free + G e, e = G' p is the same
as u = u_free + J Y' p. So every contact and every line (a *row* here: three velocities, of which a line uses the
first) sees sum over its *entries* of G (3, 6) times a block, and 1/2 |e|^2 is the kinetic energy of the change.
"""

from __future__ import annotations

from typing import NamedTuple

from ...compiler.formulas import formula
from ...compiler.layout import Float1, Int1
from ...math.scalar import sqrt
from .problem import NONE

# entries of Rows.size
# CONTACTS: contacts, which are the first rows; BEFORE_TURNING: rows before those of their rolling and spinning friction
ROWS, BLOCKS, ENTRIES, PAIRS, POOL, FILL, CONTACTS, BEFORE_TURNING = range(8)
SIZES = 16
RANK, NOTHING = 1e-11, 1e-14  # of a row's own mobility, of the largest in its group


class Rows(NamedTuple):
    """Rooms of one island inside `Factor`."""

    size: Int1  # (16,)
    head: Int1  # (nn + 3 ng,): first block of each node and group; blocks of each group; first side in its chain
    chain: Int1  # (2 m,): next side of the same group
    entry_p: Int1  # (m + 1,)
    side: Int1  # (2 m,): first entry of each side or -1
    block: Int1  # (ne,): block of each entry, by its place in the order of elimination
    pair_p: Int1  # (m + 1,): first pair of entries of each row
    pair: Int1  # (np,): where the product of the pair goes
    graph: Int1  # (7, nb + 1) flat: start, length, room, mark, place, order, Lp
    pool: Int1  # lists of neighbours
    Li: Int1  # rows of the factor's columns
    G: Float1  # (ne, 18)
    row: Float1  # (m, 32): see the columns in `prox.py`
    blocks: Float1  # (4, nb, 6) flat: e, gradient, step, e of p
    D: Float1  # (nb, 36)
    L: Float1  # (2, nnz, 36) flat: below the diagonal, above it


@formula
def mark_sides(P, c, head):
    """Forget what was known of what a contact acts on."""
    for s in range(2):
        a = P.at[c, s]
        if a >= 0:
            head[a] = -1
        elif a < NONE:
            forget_group(P, head, -2 - a)


@formula
def forget_group(P, head, g):
    """Forget what was known of a group."""
    nn, ng = P.size[1], P.size[2]
    head[nn + g] = -1
    head[nn + ng + g] = 0
    head[nn + 2 * ng + g] = -1


@formula
def moves(P, i):
    """Whether an impulse moves node i."""
    return P.node[i, 0] + P.node[i, 1] + P.node[i, 2] + P.node[i, 3] > 0.0


@formula
def link(P, head, chain, g, t, rows):
    """Put side t, of so many scalar rows, in the chain of group g."""
    nn, ng = P.size[1], P.size[2]
    chain[t] = head[nn + 2 * ng + g]
    head[nn + 2 * ng + g] = t
    head[nn + ng + g] += rows


@formula
def survey(P, span, head, chain):
    """Number the blocks. Returns their count and that of the entries; blocks of a group stand in head[nn + ng + g]."""
    first, last, line, end = span
    for c in range(first, last):
        mark_sides(P, c, head)
    for k in range(line, end):
        forget_group(P, head, P.line_at[k, 0])
    blocks = 0
    for c in range(first, last):
        for s in range(2):
            a = P.at[c, s]
            if a >= 0 and head[a] < 0 and moves(P, a):
                head[a] = blocks
                blocks += 1
            elif a < NONE and P.block[c, s] >= 0:
                link(P, head, chain, -2 - a, 2 * (c - first) + s, 3)
                if P.turn.shape[0] > 0:
                    link(P, head, chain, -2 - a, 2 * (c - first + last - first + end - line) + s, 3)
    for k in range(line, end):
        link(P, head, chain, P.line_at[k, 0], 2 * (last - first + k - line) + 1, 1)
    for c in range(first, last):
        for s in range(2):
            if P.at[c, s] < NONE:
                blocks = number_group(P, head, -2 - P.at[c, s], blocks)
    for k in range(line, end):
        blocks = number_group(P, head, P.line_at[k, 0], blocks)
    return blocks


@formula
def number_group(P, head, g, blocks):
    """Give a group its blocks, once; returns how many blocks there are then."""
    nn, ng = P.size[1], P.size[2]
    if head[nn + g] < 0:
        rank = min(P.group[g + 1] - P.group[g], head[nn + ng + g])
        head[nn + g] = blocks
        head[nn + ng + g] = (rank + 5) // 6
        blocks += (rank + 5) // 6
    return blocks


@formula
def entries_of(P, span, head, row, s):
    """First block and number of blocks of side s of a row."""
    nn, ng = P.size[1], P.size[2]
    c, k = what(span, row)
    if c >= 0 and P.at[c, s] >= 0:
        a = head[P.at[c, s]]
        return a, 1 if a >= 0 else 0
    g = group_of(P, span, 2 * row + s)
    if g < 0:
        return -1, 0
    return head[nn + g], head[nn + ng + g]


@formula
def what(span, row):
    """The contact of a row and -1 (turning: -2), or -1 and the line."""
    contacts, lines = span[1] - span[0], span[3] - span[2]
    if row < contacts:
        return span[0] + row, -1
    if row < contacts + lines:
        return -1, span[2] + row - contacts
    return span[0] + row - contacts - lines, -2


@formula
def rows_in(P, span):
    """How many rows there are."""
    contacts = span[1] - span[0]
    return contacts + span[3] - span[2] + (contacts if P.turn.shape[0] > 0 else 0)


@formula
def count_entries(P, span, head):
    """Entries and pairs of entries of all rows."""
    entries, pairs = 0, 0
    for row in range(rows_in(P, span)):
        n = entries_of(P, span, head, row, 0)[1] + entries_of(P, span, head, row, 1)[1]
        entries += n
        pairs += n * (n - 1) // 2
    return entries, pairs


@formula
def list_entries(P, span, R):
    """Entries by row and side, their blocks, and where the pairs of each row begin."""
    e, pairs = 0, 0
    R.entry_p[0], R.pair_p[0] = 0, 0
    for row in range(R.size[ROWS]):
        n = 0
        for s in range(2):
            block, many = entries_of(P, span, R.head, row, s)
            R.side[2 * row + s] = e if many > 0 else -1
            for k in range(many):
                R.block[e] = block + k
                e += 1
            n += many
        pairs += n * (n - 1) // 2
        R.entry_p[row + 1], R.pair_p[row + 1] = e, pairs


@formula
def root_of_block(P, i):
    """Lower Cholesky factor of a node's inverse inertia: xx, yx, yy, zx, zy, zz; zero where it cannot turn."""
    xx, yy, zz = P.node[i, 1], P.node[i, 2], P.node[i, 3]
    xy, xz, yz = P.node[i, 4], P.node[i, 5], P.node[i, 6]
    least = 1e-14 * (xx + yy + zz)
    a = sqrt(xx) if xx > least else 0.0
    b, d = (xy / a, xz / a) if a > 0.0 else (0.0, 0.0)
    yy -= b * b
    f = sqrt(yy) if yy > least else 0.0
    g = (yz - b * d) / f if f > 0.0 else 0.0
    zz -= d * d + g * g
    h = sqrt(zz) if zz > least else 0.0
    return a, b, f, d, g, h


@formula
def node_entry(P, c, s, turning, root, G, e):
    """G of a contact's side on a node, reversed on side 1; of its turning where ``turning`` is 1."""
    i, sign = P.at[c, s], 2.0 * s - 1.0
    m = sign * sqrt(P.node[i, 0]) * (1.0 - turning)
    x, y, z = sign * P.arm[c, 3 * s], sign * P.arm[c, 3 * s + 1], sign * P.arm[c, 3 * s + 2]
    for r in range(3):
        a, b, d = P.frame[c, 3 * r], P.frame[c, 3 * r + 1], P.frame[c, 3 * r + 2]
        p, q, t = y * d - z * b, z * a - x * d, x * b - y * a
        if turning > 0.0:
            p, q, t = sign * a, sign * b, sign * d
        o = 18 * e + 6 * r
        G[o], G[o + 1], G[o + 2] = m * a, m * b, m * d
        G[o + 3] = root[0] * p + root[1] * q + root[3] * t
        G[o + 4] = root[2] * q + root[4] * t
        G[o + 5] = root[5] * t


@formula
def rows_at(P, span, t):
    """Where J and Y of a side in a chain begin, and how many scalar rows they have."""
    c, k = what(span, t // 2)
    if c < 0:
        return P.line_at[k, 1], 1
    g = -2 - P.at[c, t % 2]
    return P.block[c, t % 2] + (3 * (P.group[g + 1] - P.group[g]) if k == -2 else 0), 3


@formula
def best_row(P, span, R, g, D):
    """Side and scalar row with the most mobility left beside what it had: (side, row, mobility left)."""
    nn, ng = P.size[1], P.size[2]
    t, best, side, which, left = R.head[nn + 2 * ng + g], RANK, -1, 0, 0.0
    while t >= 0:
        many = rows_at(P, span, t)[1]
        for r in range(many):
            d, whole = D[6 * t + r], D[6 * t + 3 + r]
            if whole > 0.0 and d > best * whole:
                best, side, which, left = d / whole, t, r, d
        t = R.chain[t]
    return side, which, left


@formula
def mobilities(P, span, R, g, D):
    """What every scalar row of a group moves by for its own unit impulse, twice; 0 where that is rounding."""
    nn, ng = P.size[1], P.size[2]
    n, largest = P.group[g + 1] - P.group[g], 0.0
    for again in range(2):
        t = R.head[nn + 2 * ng + g]
        while t >= 0:
            at, many = rows_at(P, span, t)
            for r in range(many):
                if again == 0:
                    d = 0.0
                    for k in range(n):
                        d += P.J[at + r * n + k] * P.Y[at + r * n + k]
                    D[6 * t + r] = d
                    largest = max(largest, d)
                else:
                    D[6 * t + 3 + r] = D[6 * t + r] if D[6 * t + r] > NOTHING * largest else 0.0
            t = R.chain[t]


@formula
def group_entries(P, span, R, g, D):
    """Pivoted Cholesky factor of J Y' into the entries of a group (reversed on side 1). D: (2 m, 6) to work in."""
    nn, ng = P.size[1], P.size[2]
    n = P.group[g + 1] - P.group[g]
    mobilities(P, span, R, g, D)
    for k in range(6 * R.head[nn + ng + g]):
        side, which, left = best_row(P, span, R, g, D)
        if side < 0:
            return
        at = rows_at(P, span, side)[0] + which * n
        scale = 1.0 / sqrt(left)
        t = R.head[nn + 2 * ng + g]
        own = 18 * R.side[side] + 6 * which
        while t >= 0:
            other, many = rows_at(P, span, t)
            sign = 1.0 if t % 2 == side % 2 else -1.0
            for r in range(many):
                x = 0.0
                for j in range(n):
                    x += P.J[other + r * n + j] * P.Y[at + j]
                x *= sign
                o = 18 * R.side[t] + 6 * r
                for j in range(k):
                    x -= R.G[o + 18 * (j // 6) + j % 6] * R.G[own + 18 * (j // 6) + j % 6]
                x = x * scale if t != side or r != which else sqrt(left)
                R.G[o + 18 * (k // 6) + k % 6] = x
                D[6 * t + r] -= x * x
            t = R.chain[t]
        D[6 * side + which] = 0.0


@formula
def fill_entries(P, span, R, D):
    """All of G."""
    nn, ng = P.size[1], P.size[2]
    for k in range(18 * R.size[ENTRIES]):
        R.G[k] = 0.0
    for row in range(R.size[ROWS]):
        c, k = what(span, row)
        for s in range(2):
            if c >= 0 and P.at[c, s] >= 0 and R.side[2 * row + s] >= 0:
                turning = 1.0 if k == -2 else 0.0
                node_entry(P, c, s, turning, root_of_block(P, P.at[c, s]), R.G, R.side[2 * row + s])
    for t in range(2 * R.size[ROWS]):
        g = group_of(P, span, t)
        if g >= 0 and R.head[nn + 2 * ng + g] == t:
            group_entries(P, span, R, g, D)


@formula
def group_of(P, span, t):
    """Group that a side is in, or -1."""
    c, k = what(span, t // 2)
    if c < 0:
        return P.line_at[k, 0] if t % 2 == 1 else -1
    a = P.at[c, t % 2]
    return -2 - a if a < NONE and P.block[c, t % 2] >= 0 else -1
