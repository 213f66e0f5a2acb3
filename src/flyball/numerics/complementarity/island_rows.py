"""An island of contacts as rows over blocks of six velocities, with a sparse 6 x 6 block factorisation.

A node becomes one block. Its velocities are scaled so that its mass matrix is 1: v = v_free + C e with C C' its
inverse mass matrix. A group becomes as many blocks as it needs: the Delassus matrix J Y' of the rows that act on
it has a Cholesky factor of few columns (pivoted, with the rank of the motions seen by these rows), and u = u_free +
G e, e = G' p is the same as u = u_free + J Y' p. So every contact and every line (a *row* here: three
velocities, of which a line uses the first) is the sum over its *entries* of G (3, 6) times a block, and 1/2 |e|^2
is the kinetic energy of the change.

The touching bodies change from step to step, so the pattern of the factor is found in compiled code: minimum
degree on the explicit elimination graph (with the fill inserted as it arises; Rose 1972), then a right-looking L U
whose inner products are of fixed size. Off-diagonal blocks are stored by columns, with the rows of a column in
ascending order of elimination. There is no pivoting: the matrices are 1 plus a positive semidefinite matrix, or
close to that. All arrays are in `FactorStorage`.
"""

from __future__ import annotations

from typing import NamedTuple

from ...compiler.formulas import by_address, formula
from ...compiler.struct_layout import Float1, Int1
from ...math.scalar import sqrt
from .contact_operator import row_product
from .contact_problem import FIXED_SIDE, STORAGE_TOO_SMALL

# entries of IslandRows.size
# CONTACTS: contacts, which are the first rows; BEFORE_ROLLING: rows before those of rolling and spinning friction
ROWS, BLOCKS, ENTRIES, PAIRS, POOL, FILL, CONTACTS, BEFORE_ROLLING = range(8)
SIZE_COUNT = 16
RANK_TOLERANCE, ZERO_MOBILITY = 1e-11, 1e-14  # relative to the row; to the largest in its group


class IslandRows(NamedTuple):
    """Storage of one island inside `FactorStorage`."""

    size: Int1  # (16,)
    head: Int1  # (nn + 3 ng,): first block of each node and group; blocks of each group; first side in its chain
    chain: Int1  # (2 m,): next side of the same group
    entry_p: Int1  # (m + 1,)
    side: Int1  # (2 m,): first entry of each side or -1
    block: Int1  # (ne,): block of each entry, by its place in the order of elimination
    pair_p: Int1  # (m + 1,): first pair of entries of each row
    pair: Int1  # (np,): place of the product of the pair in the matrix
    graph: Int1  # (7, nb + 1) flat: start, length, capacity, mark, place, order, Lp
    pool: Int1  # lists of neighbours
    Li: Int1  # rows of the factor's columns
    G: Float1  # (ne, 18)
    row: Float1  # (m, 32): columns as in `proximal_rows`
    blocks: Float1  # (4, nb, 6) flat: e, gradient, step, e of p
    D: Float1  # (nb, 36)
    L: Float1  # (2, nnz, 36) flat: below the diagonal, above it


@formula
def reset_contact_sides(P, c, head):
    """Reset the data of the nodes and groups on which a contact acts."""
    for s in range(2):
        a = P.at[c, s]
        if a >= 0:
            head[a] = -1
        elif a < FIXED_SIDE:
            reset_group(P, head, -2 - a)


@formula
def reset_group(P, head, g):
    """Reset the data of a group."""
    nn, ng = P.size[1], P.size[2]
    head[nn + g] = -1
    head[nn + ng + g] = 0
    head[nn + 2 * ng + g] = -1


@formula
def is_movable(P, i):
    """Whether an impulse moves node i."""
    return (
        P.node.inverse_mass[i]
        + P.node.inverse_inertia[i, 0]
        + P.node.inverse_inertia[i, 1]
        + P.node.inverse_inertia[i, 2]
        > 0.0
    )


@formula
def link_group_side(P, head, chain, g, t, rows):
    """Insert side t, which has this number of scalar rows, into the chain of group g."""
    nn, ng = P.size[1], P.size[2]
    chain[t] = head[nn + 2 * ng + g]
    head[nn + 2 * ng + g] = t
    head[nn + ng + g] += rows


@formula
def number_blocks(P, span, head, chain):
    """Assign numbers to the blocks; returns their count. Blocks per group are in head[nn + ng + g]."""
    first, last, line, end = span
    for c in range(first, last):
        reset_contact_sides(P, c, head)
    for k in range(line, end):
        reset_group(P, head, P.line_at[k, 0])
    blocks = 0
    for c in range(first, last):
        for s in range(2):
            a = P.at[c, s]
            if a >= 0 and head[a] < 0 and is_movable(P, a):
                head[a] = blocks
                blocks += 1
            elif a < FIXED_SIDE and P.block[c, s] >= 0:
                link_group_side(P, head, chain, -2 - a, 2 * (c - first) + s, 3)
                if P.turn.shape[0] > 0:
                    link_group_side(P, head, chain, -2 - a, 2 * (c - first + last - first + end - line) + s, 3)
    for k in range(line, end):
        link_group_side(P, head, chain, P.line_at[k, 0], 2 * (last - first + k - line) + 1, 1)
    for c in range(first, last):
        for s in range(2):
            if P.at[c, s] < FIXED_SIDE:
                blocks = number_group(P, head, -2 - P.at[c, s], blocks)
    for k in range(line, end):
        blocks = number_group(P, head, P.line_at[k, 0], blocks)
    return blocks


@formula
def number_group(P, head, g, blocks):
    """Assign numbers to the blocks of a group, once; returns the new count of blocks."""
    nn, ng = P.size[1], P.size[2]
    if head[nn + g] < 0:
        rank = min(P.group[g + 1] - P.group[g], head[nn + ng + g])
        head[nn + g] = blocks
        head[nn + ng + g] = (rank + 5) // 6
        blocks += (rank + 5) // 6
    return blocks


@formula
def side_entries(P, span, head, row, s):
    """First block and number of blocks of side s of a row."""
    nn, ng = P.size[1], P.size[2]
    c, k = row_subject(span, row)
    if c >= 0 and P.at[c, s] >= 0:
        a = head[P.at[c, s]]
        return a, 1 if a >= 0 else 0
    g = side_group(P, span, 2 * row + s)
    if g < 0:
        return -1, 0
    return head[nn + g], head[nn + ng + g]


@formula
def row_subject(span, row):
    """Contact of a row and -1 (-2: rolling friction), or -1 and the line."""
    contacts, lines = span[1] - span[0], span[3] - span[2]
    if row < contacts:
        return span[0] + row, -1
    if row < contacts + lines:
        return -1, span[2] + row - contacts
    return span[0] + row - contacts - lines, -2


@formula
def row_count(P, span):
    """Return the number of rows."""
    contacts = span[1] - span[0]
    return contacts + span[3] - span[2] + (contacts if P.turn.shape[0] > 0 else 0)


@formula
def count_entries(P, span, head):
    """Count the entries and pairs of entries of all rows."""
    entries, pairs = 0, 0
    for row in range(row_count(P, span)):
        n = side_entries(P, span, head, row, 0)[1] + side_entries(P, span, head, row, 1)[1]
        entries += n
        pairs += n * (n - 1) // 2
    return entries, pairs


@formula
def list_entries(P, span, R):
    """List the entries by row and side, their blocks, and the first pair of each row."""
    e, pairs = 0, 0
    R.entry_p[0], R.pair_p[0] = 0, 0
    for row in range(R.size[ROWS]):
        n = 0
        for s in range(2):
            block, many = side_entries(P, span, R.head, row, s)
            R.side[2 * row + s] = e if many > 0 else -1
            for k in range(many):
                R.block[e] = block + k
                e += 1
            n += many
        pairs += n * (n - 1) // 2
        R.entry_p[row + 1], R.pair_p[row + 1] = e, pairs


@formula
def inertia_root(P, i):
    """Lower Cholesky factor of a node's inverse inertia: xx, yx, yy, zx, zy, zz; zero if it cannot rotate."""
    xx, yy, zz = P.node.inverse_inertia[i, 0], P.node.inverse_inertia[i, 1], P.node.inverse_inertia[i, 2]
    xy, xz, yz = P.node.inverse_inertia[i, 3], P.node.inverse_inertia[i, 4], P.node.inverse_inertia[i, 5]
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
def fill_node_entry(P, c, s, turning, root, G, e):
    """Compute G of a contact's side on a node, reversed on side 1; ``turning`` 1: of its rotation."""
    i, sign = P.at[c, s], 2.0 * s - 1.0
    m = sign * sqrt(P.node.inverse_mass[i]) * (1.0 - turning)
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
def side_rows(P, span, t):
    """Start of the block of a side in a chain, the first number of its rows in J and Y, and its number of rows."""
    c, k = row_subject(span, t // 2)
    if c < 0:
        return P.line_at[k, 1], P.line_at[k, 1], 1
    g = -2 - P.at[c, t % 2]
    e = P.block[c, t % 2]
    return e, e + (3 * (P.group[g + 1] - P.group[g]) if k == -2 else 0), 3


@formula
def most_mobile_row(P, span, R, g, D):
    """Find the side and scalar row with the largest fraction of its mobility left: (side, row, mobility left)."""
    nn, ng = P.size[1], P.size[2]
    t, best, side, which, left = R.head[nn + 2 * ng + g], RANK_TOLERANCE, -1, 0, 0.0
    while t >= 0:
        many = side_rows(P, span, t)[2]
        for r in range(many):
            d, whole = D[6 * t + r], D[6 * t + 3 + r]
            if whole > 0.0 and d > best * whole:
                best, side, which, left = d / whole, t, r, d
        t = R.chain[t]
    return side, which, left


@formula
def group_mobilities(P, span, R, g, D):
    """Store the mobility of every scalar row of a group (velocity per own unit impulse) twice; 0 if it is rounding."""
    nn, ng = P.size[1], P.size[2]
    n, largest = P.group[g + 1] - P.group[g], 0.0
    for again in range(2):
        t = R.head[nn + 2 * ng + g]
        while t >= 0:
            e, at, many = side_rows(P, span, t)
            for r in range(many):
                if again == 0:
                    d = row_product(P, e, n, at + r * n, P.Y, at + r * n)
                    D[6 * t + r] = d
                    largest = max(largest, d)
                else:
                    D[6 * t + 3 + r] = D[6 * t + r] if D[6 * t + r] > ZERO_MOBILITY * largest else 0.0
            t = R.chain[t]


@formula
def fill_group_entries(P, span, R, g, D):
    """Write the pivoted Cholesky factor of J Y' to the entries of a group (reversed on side 1). D (2 m, 6): scratch."""
    nn, ng = P.size[1], P.size[2]
    n = P.group[g + 1] - P.group[g]
    group_mobilities(P, span, R, g, D)
    for k in range(6 * R.head[nn + ng + g]):
        side, which, left = most_mobile_row(P, span, R, g, D)
        if side < 0:
            return
        at = side_rows(P, span, side)[1] + which * n
        scale = 1.0 / sqrt(left)
        t = R.head[nn + 2 * ng + g]
        own = 18 * R.side[side] + 6 * which
        while t >= 0:
            e, other, many = side_rows(P, span, t)
            sign = 1.0 if t % 2 == side % 2 else -1.0
            for r in range(many):
                x = sign * row_product(P, e, n, other + r * n, P.Y, at)
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
    """Fill all entries of G."""
    nn, ng = P.size[1], P.size[2]
    for k in range(18 * R.size[ENTRIES]):
        R.G[k] = 0.0
    for row in range(R.size[ROWS]):
        c, k = row_subject(span, row)
        for s in range(2):
            if c >= 0 and P.at[c, s] >= 0 and R.side[2 * row + s] >= 0:
                turning = 1.0 if k == -2 else 0.0
                fill_node_entry(P, c, s, turning, inertia_root(P, P.at[c, s]), R.G, R.side[2 * row + s])
    for t in range(2 * R.size[ROWS]):
        g = side_group(P, span, t)
        if g >= 0 and R.head[nn + 2 * ng + g] == t:
            fill_group_entries(P, span, R, g, D)


@formula
def side_group(P, span, t):
    """Group of a side, or -1."""
    c, k = row_subject(span, t // 2)
    if c < 0:
        return P.line_at[k, 0] if t % 2 == 1 else -1
    a = P.at[c, t % 2]
    return -2 - a if a < FIXED_SIDE and P.block[c, t % 2] >= 0 else -1


BLOCK_SIZE, BLOCK_NUMBERS = 6, 36


@formula
def add_neighbour(pool, start, length, capacity, i, j, top, size):
    """Add j to the neighbours of i, where it is not yet listed; returns the pool's new top, or -1 if it is full."""
    if length[i] == capacity[i]:
        if top + 2 * capacity[i] + 4 > size:
            return -1
        for k in range(length[i]):
            pool[top + k] = pool[start[i] + k]
        start[i] = top
        capacity[i] = 2 * capacity[i] + 4
        top += capacity[i]
    pool[start[i] + length[i]] = j
    length[i] += 1
    return top


@formula
def eliminate_minimum_degree(n, pool, start, length, capacity, mark, place, order, top, size):
    """Eliminate by minimum degree; a node's remaining neighbours are then its column. Returns -1 if the pool is full.

    ``mark`` holds 0 on entry for every node; ``place`` -1 for every node that is not eliminated yet.
    """
    stamp = 0
    for k in range(n):
        best = -1
        for i in range(n):
            if place[i] < 0 and (best < 0 or length[i] < length[best]):
                best = i
        place[best] = k
        order[k] = best
        for a in range(length[best]):
            i = pool[start[best] + a]
            stamp += 1
            mark[i] = stamp
            kept = 0
            for b in range(length[i]):
                j = pool[start[i] + b]
                if j != best:
                    pool[start[i] + kept] = j
                    mark[j] = stamp
                    kept += 1
            length[i] = kept
            for b in range(length[best]):
                j = pool[start[best] + b]
                if mark[j] != stamp:
                    top = add_neighbour(pool, start, length, capacity, i, j, top, size)
                    if top < 0:
                        return -1
    return top


@formula
def factor_columns(n, pool, start, length, place, order, Lp, Li):
    """List the columns of the factor in the order of elimination, rows as places, ascending."""
    Lp[0] = 0
    for k in range(n):
        i = order[k]
        first = Lp[k]
        for a in range(length[i]):
            row = place[pool[start[i] + a]]
            e = first + a
            while e > first and Li[e - 1] > row:
                Li[e] = Li[e - 1]
                e -= 1
            Li[e] = row
        Lp[k + 1] = first + length[i]


@formula
def find_factor_entry(Lp, Li, row, column):
    """Index of block (row, column), row > column, both places; -1 if it is zero."""
    for e in range(Lp[column], Lp[column + 1]):
        if Li[e] == row:
            return e
    return -1


@formula
def factor_diagonal_block(D, d):
    """Factor the block at d in place: unit L below, U above, inverse diagonal. False if a pivot is 0 or nan."""
    for c in range(BLOCK_SIZE):
        o = d + BLOCK_SIZE * c
        if not abs(D[o + c]) > 0.0:
            return False
        inverse = 1.0 / D[o + c]
        D[o + c] = inverse
        for r in range(c + 1, BLOCK_SIZE):
            b = d + BLOCK_SIZE * r
            l = D[b + c] * inverse
            D[b + c] = l
            for k in range(c + 1, BLOCK_SIZE):
                D[b + k] -= l * D[o + k]
    return True


@formula
def divide_by_upper(L, e, D, d):
    """Multiply block e from the right by the inverse of U at d."""
    for r in range(BLOCK_SIZE):
        o = e + BLOCK_SIZE * r
        for c in range(BLOCK_SIZE):
            s = L[o + c]
            for k in range(c):
                s -= L[o + k] * D[d + BLOCK_SIZE * k + c]
            L[o + c] = s * D[d + BLOCK_SIZE * c + c]


@formula
def divide_by_lower(L, e, u, D, d, symmetric):
    """Multiply block u from the left by the inverse of L at d.

    For a symmetric matrix it is derived from the result of `divide_by_upper` for e.
    """
    for r in range(BLOCK_SIZE):
        o = u + BLOCK_SIZE * r
        for c in range(BLOCK_SIZE):
            if symmetric:
                L[o + c] = L[e + BLOCK_SIZE * c + r] / D[d + BLOCK_SIZE * r + r]
            else:
                for k in range(r):
                    L[o + c] -= D[d + BLOCK_SIZE * r + k] * L[u + BLOCK_SIZE * k + c]


@formula
def subtract_block_product(C, c, A, a, b):
    """Subtract block a of A times its block b from block c of C."""
    for r in range(BLOCK_SIZE):
        o, p = a + BLOCK_SIZE * r, c + BLOCK_SIZE * r
        a0, a1, a2, a3, a4, a5 = A[o], A[o + 1], A[o + 2], A[o + 3], A[o + 4], A[o + 5]
        for j in range(b, b + BLOCK_SIZE):
            C[p + j - b] -= (
                a0 * A[j] + a1 * A[j + 6] + a2 * A[j + 12] + a3 * A[j + 18] + a4 * A[j + 24] + a5 * A[j + 30]
            )


@formula
def factor_blocks(n, Lp, Li, D, L, symmetric):
    """Factor in place; diagonal blocks in D by place, those below it in L, followed by those above it.

    For a symmetric matrix the blocks above need not be filled. False if a pivot is 0.
    """
    above = BLOCK_NUMBERS * Lp[n]
    for k in range(n):
        if not factor_diagonal_block(D, BLOCK_NUMBERS * k):
            return False
        last = Lp[k + 1]
        for e in range(Lp[k], last):
            divide_by_upper(L, BLOCK_NUMBERS * e, D, BLOCK_NUMBERS * k)
            divide_by_lower(L, BLOCK_NUMBERS * e, above + BLOCK_NUMBERS * e, D, BLOCK_NUMBERS * k, symmetric)
        for e in range(Lp[k], last):
            subtract_block_product(D, BLOCK_NUMBERS * Li[e], L, BLOCK_NUMBERS * e, above + BLOCK_NUMBERS * e)
            t = Lp[Li[e]]
            for f in range(e + 1, last):
                while Li[t] != Li[f]:
                    t += 1
                subtract_block_product(L, BLOCK_NUMBERS * t, L, BLOCK_NUMBERS * f, above + BLOCK_NUMBERS * e)
                if not symmetric:
                    subtract_block_product(
                        L, above + BLOCK_NUMBERS * t, L, BLOCK_NUMBERS * e, above + BLOCK_NUMBERS * f
                    )
    return True


@formula
def solve_blocks(n, Lp, Li, D, L, x):
    """Solve in place; x by places, six numbers each."""
    above = BLOCK_NUMBERS * Lp[n]
    for k in range(n):
        d, o = BLOCK_NUMBERS * k, BLOCK_SIZE * k
        for r in range(BLOCK_SIZE):
            for c in range(r):
                x[o + r] -= D[d + BLOCK_SIZE * r + c] * x[o + c]
        for e in range(Lp[k], Lp[k + 1]):
            subtract_block_vector(L, BLOCK_NUMBERS * e, x, BLOCK_SIZE * Li[e], o)
    for k in range(n - 1, -1, -1):
        d, o = BLOCK_NUMBERS * k, BLOCK_SIZE * k
        for e in range(Lp[k], Lp[k + 1]):
            subtract_block_vector(L, above + BLOCK_NUMBERS * e, x, o, BLOCK_SIZE * Li[e])
        for r in range(BLOCK_SIZE - 1, -1, -1):
            s = x[o + r]
            for c in range(r + 1, BLOCK_SIZE):
                s -= D[d + BLOCK_SIZE * r + c] * x[o + c]
            x[o + r] = s * D[d + BLOCK_SIZE * r + r]


@formula
def subtract_block_vector(L, e, x, i, j):
    """Subtract block e times the six entries of x at j from those at i."""
    for r in range(BLOCK_SIZE):
        o = e + BLOCK_SIZE * r
        for c in range(BLOCK_SIZE):
            x[i + r] -= L[o + c] * x[j + c]


ROW_WIDTH = 32  # numbers of a row


@formula
def island_rows(P, F, size):
    """Divide the storage by ``size``, which is the head of `FactorStorage.places`."""
    q, x = F.places, F.numbers
    m, nb, ne, np, pool, fill = size[ROWS], size[BLOCKS], size[ENTRIES], size[PAIRS], size[POOL], size[FILL]
    a = SIZE_COUNT
    b = a + P.size[1] + 3 * P.size[2]
    c = b + 2 * m
    d = c + m + 1
    e = d + 2 * m
    f = e + ne
    g = f + m + 1
    h = g + np
    i = h + 7 * (nb + 1)
    j = i + pool
    s = 18 * ne
    t = s + ROW_WIDTH * m
    u = t + 24 * nb
    v = u + 36 * nb
    return IslandRows(
        size,
        q[a:b],
        q[b:c],
        q[c:d],
        q[d:e],
        q[e:f],
        q[f:g],
        q[g:h],
        q[h:i],
        q[i:j],
        q[j : j + fill],
        x[:s],
        x[s:t],
        x[t:u],
        x[u:v],
        x[v : v + 72 * fill],
    )


@formula
def places_needed(P, size):
    """Return the required length of `FactorStorage.places`."""
    m, nb = size[ROWS], size[BLOCKS]
    fixed = SIZE_COUNT + P.size[1] + 3 * P.size[2] + 6 * m + 2
    return fixed + size[ENTRIES] + size[PAIRS] + 7 * (nb + 1) + size[POOL] + size[FILL]


@formula
def numbers_needed(size):
    """Return the required length of `FactorStorage.numbers`."""
    return 18 * size[ENTRIES] + ROW_WIDTH * size[ROWS] + 60 * size[BLOCKS] + 72 * size[FILL]


@formula
def storage_fits(P, F, O, size):
    """Whether the storage is large enough; otherwise writes the required sizes to O."""
    numbers, places = numbers_needed(size), places_needed(P, size)
    if numbers <= F.numbers.shape[0] and places <= F.places.shape[0]:
        return True
    O.count.ended = STORAGE_TOO_SMALL
    O.count.needed_numbers = max(numbers + numbers // 2, O.count.needed_numbers)
    O.count.needed_places = max(places + places // 2, O.count.needed_places)
    return False


@formula
def measure_island(P, span, F, O, size):
    """Compute the sizes of all but the factor. False if the storage is too small."""
    for k in range(SIZE_COUNT):
        size[k] = 0
    size[ROWS] = row_count(P, span)
    size[CONTACTS] = span[1] - span[0]
    size[BEFORE_ROLLING] = size[CONTACTS] + span[3] - span[2]
    if not storage_fits(P, F, O, size):
        return False
    R = by_address(island_rows(P, F, size))
    size[BLOCKS] = number_blocks(P, span, R.head, R.chain)
    size[ENTRIES], size[PAIRS] = count_entries(P, span, R.head)
    size[POOL] = 16 * size[BLOCKS] + 4 * size[PAIRS]
    if not storage_fits(P, F, O, size):
        return False
    left = F.places.shape[0] - places_needed(P, size) + size[POOL]
    size[POOL] = left // 2  # the columns are no longer than the lists from which they are made
    return True


@formula
def find_neighbours(R, nb):
    """Build the graph of the matrix. Returns the pool's top, -1 if it is full."""
    g, n = R.graph, nb + 1
    start, length, room = g[:n], g[n : 2 * n], g[2 * n : 3 * n]
    for k in range(nb):
        start[k], length[k], room[k] = 0, 0, 0
    top = 0
    for row in range(R.size[ROWS]):
        for e in range(R.entry_p[row], R.entry_p[row + 1]):
            for f in range(R.entry_p[row], e):
                i, j = R.block[e], R.block[f]
                if i != j and not is_listed(R.pool, start[i], length[i], j):
                    top = add_neighbour(R.pool, start, length, room, i, j, top, R.size[POOL])
                    if top >= 0:
                        top = add_neighbour(R.pool, start, length, room, j, i, top, R.size[POOL])
                    if top < 0:
                        return -1
    return top


@formula
def is_listed(pool, start, length, j):
    """Whether j is in a list, searched from its end because contacts of a pair are consecutive."""
    k = length - 1
    while k >= 0 and pool[start + k] != j:
        k -= 1
    return k >= 0


@formula
def find_elimination_order(R, nb):
    """Find the order of elimination. Returns the number of off-diagonal blocks of the factor, -1: the pool is full."""
    top = find_neighbours(R, nb)
    if top < 0:
        return -1
    g, n = R.graph, nb + 1
    mark, place = g[3 * n : 4 * n], g[4 * n : 5 * n]
    for k in range(nb):
        mark[k], place[k] = 0, -1
    top = eliminate_minimum_degree(
        nb, R.pool, g[:n], g[n : 2 * n], g[2 * n : 3 * n], mark, place, g[5 * n : 6 * n], top, R.size[POOL]
    )
    if top < 0:
        return -1
    fill = 0
    for k in range(nb):
        fill += g[n + k]
    return fill


@formula
def fill_factor_pattern(R, nb):
    """List the columns of the factor, entries by places, and places of the products of pairs (-1: the diagonal)."""
    g, n = R.graph, nb + 1
    place, Lp = g[4 * n : 5 * n], g[6 * n : 7 * n]
    factor_columns(nb, R.pool, g[:n], g[n : 2 * n], place, g[5 * n : 6 * n], Lp, R.Li)
    for e in range(R.size[ENTRIES]):
        R.block[e] = place[R.block[e]]
    for row in range(R.size[ROWS]):
        k = R.pair_p[row]
        for e in range(R.entry_p[row], R.entry_p[row + 1]):
            for f in range(R.entry_p[row], e):
                i, j = R.block[e], R.block[f]
                R.pair[k] = find_factor_entry(Lp, R.Li, max(i, j), min(i, j)) if i != j else -1
                k += 1


@formula
def prepare_island(P, span, F, O):
    """Prepare storage, pattern and G of an island. False if the storage is too small (sizes in O)."""
    size = F.places[:SIZE_COUNT]
    if F.places.shape[0] < SIZE_COUNT:
        O.count.ended, O.count.needed_places, O.count.needed_numbers = STORAGE_TOO_SMALL, 4096, 16384
        return False
    if not measure_island(P, span, F, O, size):
        return False
    R = by_address(island_rows(P, F, size))
    list_entries(P, span, R)
    fill = find_elimination_order(R, size[BLOCKS])
    if fill < 0:
        O.count.ended = STORAGE_TOO_SMALL
        O.count.needed_places = 2 * F.places.shape[0]
        O.count.needed_numbers = F.numbers.shape[0]
        return False
    size[FILL] = fill
    if not storage_fits(P, F, O, size):
        return False
    R = by_address(island_rows(P, F, size))
    fill_entries(P, span, R, R.row)
    fill_factor_pattern(R, size[BLOCKS])
    return True
