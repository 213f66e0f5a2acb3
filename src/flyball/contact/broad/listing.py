"""The list of pairs: all looked for, or only those of shapes that have left their envelopes."""

from __future__ import annotations

from ...compiler.formulas import formula
from .cells import cell, crowded, level_for, link, name, place, unlink, window
from .desk import (
    ANY,
    BALL,
    BALL_FLAT,
    BALLS,
    BOUNDED,
    CLASS,
    COMPARED,
    EDGE,
    FAT_RAW,
    FLAT,
    FLAT_BALL,
    FORM,
    HALF,
    LEVEL,
    LEVELS,
    LISTED,
    MIDDLE,
    MOVED,
    MOVES,
    OF,
    OTHER,
    REMADE,
    SHAPE,
    WHOLE,
    WIDE,
)
from .envelopes import fatten, keep_axes
from .meeting import allowed, envelopes_meet
from .same import keep, kept
from .unbounded import reaches, settle

LATER, EVERY, FRESH = range(3)
"""Which partners are taken: those that come later in order, all, or all but moved ones that come earlier."""


@formula
def offer(G, B, s, t):
    """Put two slots into the list: whether there was room."""
    n = B.count[LISTED]
    if n >= B.pair.shape[0]:
        return False
    i, j = B.slot[s, SHAPE], B.slot[t, SHAPE]
    if i > j:
        i, j, s, t = j, i, t, s
    a, b = B.slot[s, FORM], B.slot[t, FORM]
    way = ANY
    if b == BALL and (a == BALL or a == FLAT):
        way = BALLS if a == BALL else FLAT_BALL
    elif a == BALL and b == FLAT:
        way = BALL_FLAT
    B.pair[n, 0], B.pair[n, 1], B.pair[n, 2] = s, t, way
    B.seen[B.count[HALF], n] = kept(B, i, j)
    B.count[LISTED] = n + 1
    return True


@formula
def chain(G, B, s, t, key, which):
    """Offer all of one place that stand in the cell ``key``; ``t`` is the first."""
    compared = 0
    while t >= 0:
        if B.key[t] == key and t != s and not (which == FRESH and t < s and B.mark[t] != 0):
            compared += 1
            if envelopes_meet(B, s, t) and allowed(G, B, s, t) and not offer(G, B, s, t):
                return False
        t = B.link[t]
    B.count[COMPARED] += compared
    return True


@formula
def everyone(G, B, s, l, which):
    """Offer all of level l, one by one."""
    for t in range(B.count[BOUNDED]):
        if B.slot[t, LEVEL] == l and t != s and not (which == FRESH and t < s and B.mark[t] != 0):
            B.count[COMPARED] += 1
            if envelopes_meet(B, s, t) and allowed(G, B, s, t) and not offer(G, B, s, t):
                return False
    return True


@formula
def visit(G, B, s, l, which):
    """Offer the partners of slot s at level l: whether there was room."""
    first, last, many = window(B, s, l)
    if which != LATER and crowded(B, many):
        return everyone(G, B, s, l, which)
    a, b, c = first
    own = (a, b, c)
    if which == LATER:
        own = (
            cell(B, l, 0, B.fat[s, MIDDLE]),
            cell(B, l, 1, B.fat[s, MIDDLE + 1]),
            cell(B, l, 2, B.fat[s, MIDDLE + 2]),
        )
        if not chain(G, B, s, B.link[s], B.key[s], LATER):
            return False
        c = own[2]
    for z in range(c, last[2] + 1):
        ahead = which == LATER and z == own[2]
        for y in range(own[1] if ahead else b, last[1] + 1):
            for x in range(own[0] + 1 if ahead and y == own[1] else a, last[0] + 1):
                t = B.head[place(B, l, x, y, z)]
                if t >= 0 and not chain(G, B, s, t, name(x, y, z), which):
                    return False
    return True


@formula
def with_wide(G, B, w):
    """Offer the partners of a wide slot: whether there was room."""
    of = B.slot[w, CLASS]
    settle(B, w - B.count[BOUNDED], B.slot[w, MOVES] < 0)
    for s in range(B.count[BOUNDED]):
        near = B.meets[of, B.slot[s, CLASS]] != 0 and reaches(B, w - B.count[BOUNDED], s)
        if near and allowed(G, B, s, w) and not offer(G, B, s, w):
            return False
    return True


@formula
def list_all(G, B):
    """All pairs, in the order of the slots: whether there was room."""
    B.count[LISTED] = 0
    for s in range(B.count[BOUNDED]):
        own = B.slot[s, LEVEL]
        edge = B.level_x[own, EDGE]
        for l in range(B.count[LEVELS]):
            if B.meets[B.slot[s, CLASS], B.level_i[l, OF]] != 0:
                coarser = B.level_x[l, EDGE] > edge or (B.level_x[l, EDGE] == edge and l >= own)
                if coarser and not visit(G, B, s, l, LATER if l == own else EVERY):
                    return False
    for w in range(B.count[BOUNDED], B.count[BOUNDED] + B.count[WIDE]):  # noqa: SIM110
        if not with_wide(G, B, w):
            return False
    return True


@formula
def drop(B):
    """Take the pairs of marked slots off the list, and keep in the table which contacts they had."""
    n, half = 0, B.count[HALF]
    for k in range(B.count[LISTED]):
        s, t, first = B.pair[k, 0] + 0, B.pair[k, 1] + 0, B.seen[half, k] + 0  # all integers of one type
        if B.mark[s] == 0 and B.mark[t] == 0:
            if n < k:
                B.pair[n, 0], B.pair[n, 1], B.pair[n, 2], B.seen[half, n] = s, t, B.pair[k, 2], first
            n += 1
        elif first >= 0:
            keep(B, B.slot[s, SHAPE], B.slot[t, SHAPE], first)
    B.count[LISTED] = n


@formula
def refit(B, s):
    """Another envelope for slot s, in its cell: whether a level takes it."""
    i = B.slot[s, SHAPE]
    for c in range(8):
        B.raw[i, c] = B.now[s, c]
    fatten(B, B.raw, i, FAT_RAW, B.slot[s, MOVES] < 0)
    l = level_for(B, B.slot[s, CLASS], B.raw[i, FAT_RAW + WHOLE])
    if l < 0:
        return False
    unlink(B, s)
    for c in range(8):
        B.fat[s, c] = B.raw[i, FAT_RAW + c]
    if B.slot[s, FORM] == OTHER:
        keep_axes(B, s)
    link(B, s, l)
    B.count[REMADE] += 1
    return True


@formula
def list_moved(G, B):
    """The pairs of shapes that have left their envelopes, at the end of the list: whether there was room."""
    wide = B.count[BOUNDED]
    for k in range(B.count[MOVED]):
        s = B.moved[k]
        if s >= wide:
            if not with_wide(G, B, s):
                return False
            continue
        for l in range(B.count[LEVELS]):
            if B.meets[B.slot[s, CLASS], B.level_i[l, OF]] != 0 and not visit(G, B, s, l, FRESH):
                return False
        for w in range(wide, wide + B.count[WIDE]):
            may = B.mark[w] == 0 and B.meets[B.slot[w, CLASS], B.slot[s, CLASS]] != 0
            if may and reaches(B, w - wide, s) and allowed(G, B, s, w) and not offer(G, B, s, w):
                return False
    return True
