"""Whether two shapes are a pair: what the description allows, and envelopes that meet."""

from __future__ import annotations

from ...compiler.formulas import formula
from ..tables import MASK, MEMBER
from .desk import MIDDLE, MOVES, ROUND, SHAPE, SIZE, TOLD, WHOLE
from .envelopes import bodies_meet

FAST = 0.5  # an envelope longer than this, in radii, is looked at as a capsule


@formula
def held_apart(apart, a, b):
    """Whether the pair of movers stands in a sorted list of pairs, the smaller first."""
    if a > b:
        a, b = b, a
    low, high = 0, apart.shape[0]
    while low < high:
        k = (low + high) // 2
        if apart[k, 0] < a or (apart[k, 0] == a and apart[k, 1] < b):
            low = k + 1
        else:
            high = k
    return low < apart.shape[0] and apart[low, 0] == a and apart[low, 1] == b


@formula
def allowed(G, B, s, t):
    """Whether the shapes of two slots may touch at all."""
    a, b = B.slot[s, MOVES], B.slot[t, MOVES]
    if a == b:  # the same mover, or both stand still
        return False
    if B.count[TOLD] == 0:
        i, j = B.slot[s, SHAPE], B.slot[t, SHAPE]
        if G.shape_i[i, MEMBER] & G.shape_i[j, MASK] == 0 or G.shape_i[j, MEMBER] & G.shape_i[i, MASK] == 0:
            return False
    return G.apart.shape[0] == 0 or not held_apart(G.apart, a, b)


@formula
def between(fat, s, t, x, y, z):
    """Squared distance of the lines of two envelopes; (x, y, z) from the middle of s to that of t.

    The parameters are found in turn, as for two segments (Ericson 2005, 5.1.9).
    """
    a, b = (fat[s, 3], fat[s, 4], fat[s, 5]), (fat[t, 3], fat[t, 4], fat[t, 5])
    aa = a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
    bb = b[0] * b[0] + b[1] * b[1] + b[2] * b[2]
    ab = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    ax, bx = x * a[0] + y * a[1] + z * a[2], x * b[0] + y * b[1] + z * b[2]
    det = aa * bb - ab * ab
    p = 0.0  # place on the line of s, in [-1, 1]
    if det > 1e-12 * aa * bb:
        p = min(1.0, max(-1.0, (ax * bb - bx * ab) / det))
    q = 0.0
    if bb > 0.0:
        q = min(1.0, max(-1.0, (p * ab - bx) / bb))
    if aa > 0.0:
        p = min(1.0, max(-1.0, (ax + q * ab) / aa))
    if det <= 1e-12 * aa * bb and bb > 0.0:  # side by side: once more
        q = min(1.0, max(-1.0, (p * ab - bx) / bb))
        if aa > 0.0:
            p = min(1.0, max(-1.0, (ax + q * ab) / aa))
    x, y, z = x + q * b[0] - p * a[0], y + q * b[1] - p * a[1], z + q * b[2] - p * a[2]
    return x * x + y * y + z * z


@formula
def envelopes_meet(B, s, t):
    """Whether the envelopes of two bounded slots meet."""
    fat = B.fat
    x = fat[t, MIDDLE] - fat[s, MIDDLE]
    y = fat[t, MIDDLE + 1] - fat[s, MIDDLE + 1]
    z = fat[t, MIDDLE + 2] - fat[s, MIDDLE + 2]
    whole = fat[s, WHOLE] + fat[t, WHOLE]
    if x * x + y * y + z * z > whole * whole:
        return False
    close = fat[s, ROUND] + fat[t, ROUND]
    if whole > (1.0 + FAST) * close and between(fat, s, t, x, y, z) > close * close:
        return False
    return bodies_meet(B, B.turn, s, t, (x, y, z), whole - B.now[s, SIZE] - B.now[t, SIZE])
