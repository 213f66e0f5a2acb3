"""Contacts that bodies will have: a pair is carried on along its motion until it nearly touches.

Nearest points of shapes that are far apart say little about where they will meet, or whether: a brick that flies past
another would be stopped by the plane between them. So a fast pair is looked at where it will first touch (conservative
advancement: Mirtich 1996, "Impulse-based dynamic simulation of rigid body systems", 2.3), and the gaps are those
along the normals found there.
"""

from __future__ import annotations

from ...compiler.formulas import call, formula
from ...math.scalar import cos, sin
from ...math.vec import add, load3, load9, mm, norm, put3, put9, quaternion_matrix, scale
from ..tables import AHEAD, MARGIN
from .desk import ASKED_1, ASKED_2, BOUNDED, GOES, MOVES, NARROW, REACH, SHAPE, SPIN

MOST = 40  # advances
CLOSE = 0.01  # a gap that is taken for touching, in radii of the smaller shape


@formula
def remember(M, B, row, m):
    """Keep the pose of a mover."""
    if m >= 0:
        for c in range(12):
            B.kept[row, c] = M.pose[m, c]


@formula
def recall(M, B, row, m):
    """Put it back where it was."""
    if m >= 0:
        for c in range(12):
            M.pose[m, c] = B.kept[row, c]


@formula
def carry(M, B, row, m, time):
    """Put a mover where it will be."""
    if m >= 0:
        w = load3(M.twist, m, 3)
        half = 0.5 * time * norm(w)
        put3(M.pose, m, 0, add(load3(B.kept, row, 0), scale(time, load3(M.twist, m, 0))))
        if half > 0.0:
            e = scale(0.5 * time * sin(half) / half, w)
            put9(M.pose, m, 3, mm(quaternion_matrix(cos(half), e[0], e[1], e[2]), load9(B.kept, row, 3)))


@formula
def ask(G, M, B, s, t, reach):
    """Contacts of the pair of slots as it stands, up to this gap, into ``room``: how many."""
    B.count[ASKED_1], B.count[ASKED_2], B.real[REACH] = B.slot[s, SHAPE], B.slot[t, SHAPE], reach
    return call(B.count[NARROW], G, M, B, B, B, 0)


@formula
def nearest(B, found):
    """The contact with the least gap."""
    best = 0
    for k in range(found):
        if B.room[k, 6] < B.room[best, 6]:
            best = k
    return best


@formula
def closing(B, s, t, k):
    """How fast two bounded shapes can come nearer along the normal of contact k."""
    v = B.now[s, SPIN] + B.now[t, SPIN]
    for c in range(3):
        v += B.room[k, 3 + c] * (B.now[s, GOES + c] - B.now[t, GOES + c])
    return v


@formula
def first_touch(G, M, B, s, t, reach, size):
    """Contacts where a fast pair will first touch within `AHEAD` seconds: how many, and after what time.

    They stand in ``room``, their poses in M: `recall` puts these back. ``reach`` is `MARGIN` and the largest way.
    """
    a, b = B.slot[s, MOVES], B.slot[t, MOVES]
    ahead, time = B.real[AHEAD], 0.0
    fastest = (reach - B.real[MARGIN]) / ahead
    enough = B.real[MARGIN] + CLOSE * size
    for _ in range(MOST):
        found = ask(G, M, B, s, t, B.real[MARGIN] + fastest * (ahead - time))
        if found == 0:
            return 0, time
        k = nearest(B, found)
        gap = B.room[k, 6]
        if gap <= enough:
            return found, time
        speed = fastest
        if s < B.count[BOUNDED] and t < B.count[BOUNDED]:
            speed = min(fastest, closing(B, s, t, k))
        if gap - B.real[MARGIN] >= speed * (ahead - time):
            return 0, time
        time += (gap - 0.5 * enough) / speed
        if time >= ahead:
            return 0, time
        carry(M, B, 0, a, time)
        carry(M, B, 1, b, time)
    return found, time
