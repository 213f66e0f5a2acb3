"""All bounded shapes into slots in the order of their cells, with new envelopes."""

from __future__ import annotations

from ...compiler.formulas import formula
from ..kinds import SPHERE
from ..tables import AHEAD, KIND, MOVER
from .cells import cell, cell_of, lay_out, place, size_of
from .desk import (
    BALL,
    BOUNDED,
    CLASS,
    DRIFT,
    FAT_RAW,
    FORM,
    FRAME,
    LAG,
    LATER_RAW,
    LEVEL,
    MIDDLE,
    MOVES,
    OTHER,
    REMADE,
    SHAPE,
    SIZES,
    STRIDE,
    WHOLE,
)
from .envelopes import axes_now, fatten, keep_axes, locate


@formula
def make_envelopes(G, M, B):
    """Envelopes of all bounded shapes, by shape, in ``raw``; sums over shapes of one class and size in ``sums``."""
    for g in range(B.sums.shape[0]):
        for c in range(B.sums.shape[1]):
            B.sums[g, c] = 0.0
    for i in range(B.kin.shape[0]):
        if B.kin[i] >= 0:
            m = G.shape_i[i, MOVER]
            locate(M, B, i, m, G.shape_i[i, KIND] == SPHERE, B.raw, i)
            B.raw[i, LATER_RAW] = fatten(B, B.raw, i, FAT_RAW, m < 0)
            first = B.kin[i] * SIZES
            B.sums[first, 9] = max(B.sums[first, 9], B.raw[i, FAT_RAW + WHOLE])
    for i in range(B.kin.shape[0]):
        if B.kin[i] >= 0:
            g = B.kin[i] * SIZES
            g += size_of(B.sums[g, 9], B.raw[i, FAT_RAW + WHOLE])
            B.mark[i] = g
            B.sums[g, 0] += 1.0
            B.sums[g, 1] = max(B.sums[g, 1], B.raw[i, LATER_RAW])
            for c in range(3):
                x = B.raw[i, FAT_RAW + MIDDLE + c]
                B.sums[g, 2 + c] += x
                B.sums[g, 5 + c] += x * x


@formula
def number_slots(B, places):
    """Slots by counting how many shapes stand at each place: by shape, in ``moved``; ``head`` then tells the first."""
    for i in range(B.kin.shape[0]):
        if B.kin[i] >= 0:
            l = int(B.sums[B.mark[i], 8])
            a = cell(B, l, 0, B.raw[i, FAT_RAW + MIDDLE])
            b = cell(B, l, 1, B.raw[i, FAT_RAW + MIDDLE + 1])
            B.moved[i] = place(B, l, a, b, cell(B, l, 2, B.raw[i, FAT_RAW + MIDDLE + 2]))
            B.mark[i] = l
            B.head[B.moved[i]] += 1  # from -1
    total = 0
    for p in range(places):
        total += B.head[p] + 1
        B.head[p] = total
    for k in range(B.kin.shape[0]):
        i = B.kin.shape[0] - 1 - k
        if B.kin[i] >= 0:
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
    """What is kept by slot, from what is kept by shape."""
    for i in range(B.kin.shape[0]):
        if B.kin[i] >= 0:
            s = B.moved[i]
            B.slot[s, SHAPE], B.slot[s, MOVES], B.slot[s, LEVEL] = i, G.shape_i[i, MOVER], B.mark[i]
            B.slot[s, FORM] = BALL if G.shape_i[i, KIND] == SPHERE else OTHER
            B.slot[s, CLASS] = B.kin[i]
            for c in range(8):
                B.now[s, c], B.fat[s, c] = B.raw[i, c], B.raw[i, FAT_RAW + c]
            if B.slot[s, FORM] == OTHER:
                axes_now(G, M, B, s, i, B.slot[s, MOVES])
                keep_axes(B, s)
    for s in range(B.count[BOUNDED]):
        B.key[s], _ = cell_of(B, s, B.slot[s, LEVEL])
        B.mark[s] = 0


@formula
def sort_all(G, M, B):
    """New slots and envelopes for all bounded shapes; the frame begins anew."""
    for c in range(3):
        B.real[FRAME + c] = B.real[LAG + c] = 0.0
        B.real[STRIDE + c] = B.real[AHEAD] * B.real[DRIFT + c]
    make_envelopes(G, M, B)
    number_slots(B, lay_out(B))
    fill_slots(G, M, B)
    B.count[REMADE] += B.count[BOUNDED]
