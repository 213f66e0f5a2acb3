"""Where the rooms of one island stand in `Factor`, and the pattern of its matrix."""

from __future__ import annotations

from ...compiler.formulas import by_address, formula
from .blocks import columns, eliminate, entry_of, join
from .gather import (
    BEFORE_TURNING,
    BLOCKS,
    CONTACTS,
    ENTRIES,
    FILL,
    PAIRS,
    POOL,
    ROWS,
    SIZES,
    Rows,
    count_entries,
    fill_entries,
    list_entries,
    rows_in,
    survey,
)
from .problem import SMALL

WIDE = 32  # numbers of a row


@formula
def rows_of(P, F, size):
    """The rooms by their sizes; ``size`` is the head of `Factor.places`."""
    q, x = F.places, F.numbers
    m, nb, ne, np, pool, fill = size[ROWS], size[BLOCKS], size[ENTRIES], size[PAIRS], size[POOL], size[FILL]
    a = SIZES
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
    t = s + WIDE * m
    u = t + 24 * nb
    v = u + 36 * nb
    return Rows(
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
def places_of(P, size):
    """How long `Factor.places` must be."""
    m, nb = size[ROWS], size[BLOCKS]
    fixed = SIZES + P.size[1] + 3 * P.size[2] + 6 * m + 2
    return fixed + size[ENTRIES] + size[PAIRS] + 7 * (nb + 1) + size[POOL] + size[FILL]


@formula
def numbers_of(size):
    """How long `Factor.numbers` must be."""
    return 18 * size[ENTRIES] + WIDE * size[ROWS] + 60 * size[BLOCKS] + 72 * size[FILL]


@formula
def fits(P, F, O, size):
    """Whether the rooms are large enough; if not, what is needed is said."""
    numbers, places = numbers_of(size), places_of(P, size)
    if numbers <= F.numbers.shape[0] and places <= F.places.shape[0]:
        return True
    O.count.ended = SMALL
    O.count.needed_numbers = max(numbers + numbers // 2, O.count.needed_numbers)
    O.count.needed_places = max(places + places // 2, O.count.needed_places)
    return False


@formula
def measure(P, span, F, O, size):
    """Sizes of all but the factor. False if the rooms are too small."""
    for k in range(SIZES):
        size[k] = 0
    size[ROWS] = rows_in(P, span)
    size[CONTACTS] = span[1] - span[0]
    size[BEFORE_TURNING] = size[CONTACTS] + span[3] - span[2]
    if not fits(P, F, O, size):
        return False
    R = by_address(rows_of(P, F, size))
    size[BLOCKS] = survey(P, span, R.head, R.chain)
    size[ENTRIES], size[PAIRS] = count_entries(P, span, R.head)
    size[POOL] = 16 * size[BLOCKS] + 4 * size[PAIRS]
    if not fits(P, F, O, size):
        return False
    left = F.places.shape[0] - places_of(P, size) + size[POOL]
    size[POOL] = left // 2  # the columns are no longer than the lists that they are made of
    return True


@formula
def neighbours(R, nb):
    """The graph of the matrix. Returns the pool's top, -1 if it is full."""
    g, n = R.graph, nb + 1
    start, length, room = g[:n], g[n : 2 * n], g[2 * n : 3 * n]
    for k in range(nb):
        start[k], length[k], room[k] = 0, 0, 0
    top = 0
    for row in range(R.size[ROWS]):
        for e in range(R.entry_p[row], R.entry_p[row + 1]):
            for f in range(R.entry_p[row], e):
                i, j = R.block[e], R.block[f]
                if i != j and not among(R.pool, start[i], length[i], j):
                    top = join(R.pool, start, length, room, i, j, top, R.size[POOL])
                    if top >= 0:
                        top = join(R.pool, start, length, room, j, i, top, R.size[POOL])
                    if top < 0:
                        return -1
    return top


@formula
def among(pool, start, length, j):
    """Whether j is in a list; contacts of a pair stand together, so its end is looked at first."""
    k = length - 1
    while k >= 0 and pool[start + k] != j:
        k -= 1
    return k >= 0


@formula
def order(R, nb):
    """Order of elimination. Returns the number of blocks outside the diagonal of the factor, -1: the pool is full."""
    top = neighbours(R, nb)
    if top < 0:
        return -1
    g, n = R.graph, nb + 1
    mark, place = g[3 * n : 4 * n], g[4 * n : 5 * n]
    for k in range(nb):
        mark[k], place[k] = 0, -1
    top = eliminate(nb, R.pool, g[:n], g[n : 2 * n], g[2 * n : 3 * n], mark, place, g[5 * n : 6 * n], top, R.size[POOL])
    if top < 0:
        return -1
    fill = 0
    for k in range(nb):
        fill += g[n + k]
    return fill


@formula
def pattern(R, nb):
    """Columns of the factor, entries by places, and where the products of pairs go (-1: to the diagonal)."""
    g, n = R.graph, nb + 1
    place, Lp = g[4 * n : 5 * n], g[6 * n : 7 * n]
    columns(nb, R.pool, g[:n], g[n : 2 * n], place, g[5 * n : 6 * n], Lp, R.Li)
    for e in range(R.size[ENTRIES]):
        R.block[e] = place[R.block[e]]
    for row in range(R.size[ROWS]):
        k = R.pair_p[row]
        for e in range(R.entry_p[row], R.entry_p[row + 1]):
            for f in range(R.entry_p[row], e):
                i, j = R.block[e], R.block[f]
                R.pair[k] = entry_of(Lp, R.Li, max(i, j), min(i, j)) if i != j else -1
                k += 1


@formula
def prepare(P, span, F, O):
    """Rooms, pattern and G of an island. False if the rooms are too small: `Choices.count` says what is needed."""
    size = F.places[:SIZES]
    if F.places.shape[0] < SIZES:
        O.count.ended, O.count.needed_places, O.count.needed_numbers = SMALL, 4096, 16384
        return False
    if not measure(P, span, F, O, size):
        return False
    R = by_address(rows_of(P, F, size))
    list_entries(P, span, R)
    fill = order(R, size[BLOCKS])
    if fill < 0:
        O.count.ended = SMALL
        O.count.needed_places = 2 * F.places.shape[0]
        O.count.needed_numbers = F.numbers.shape[0]
        return False
    size[FILL] = fill
    if not fits(P, F, O, size):
        return False
    R = by_address(rows_of(P, F, size))
    fill_entries(P, span, R, R.row)
    pattern(R, size[BLOCKS])
    return True
