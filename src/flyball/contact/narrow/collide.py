"""The narrow phase: where two shapes touch, or nearly.

The list of pairs that have a way of their own is written from ``pairs``, so no kind is named here. For any other pair
the nearest points are sought (``nearest``), then the faces that meet there are cut (``manifold``): ``convex``.
"""

from __future__ import annotations

from math import inf

from ...compiler.formulas import formula
from ...compiler.sources import generated
from ...math.vec import add, dot, load3, load9, mm, mv, sub
from ..kinds import FIELD, PLANAR
from ..tables import AXES, KIND, MOVER, PLACE
from .convex import any_pair
from .pairs.registry import WAYS

ALL = {kind for pair in WAYS for kind in pair}


def _by_kinds(name, kinds, otherwise):
    """The formula that chooses among the pairs of these kinds."""
    names, lines = {"any_pair": any_pair}, []
    for number, pair in enumerate(sorted(WAYS, key=lambda p: (p[1] is None, p))):
        if pair[0] in kinds and (pair[1] is None or pair[1] in kinds):
            names[f"way_{number}"] = WAYS[pair]
            test = f"a == {pair[0]}" + ("" if pair[1] is None else f" and b == {pair[1]}")
            lines += [f"if {test}:", f"    return way_{number}(G, i, j, A, B, reach, room)"]
    return generated(__name__, name, "a, b, G, i, j, A, B, reach, room", [*lines, f"return {otherwise}"], names)


_by_kinds_all = _by_kinds("by_kinds", ALL, "any_pair(G, i, j, A, B, reach, room)")
_by_kinds_convex = _by_kinds("by_kinds_convex", ALL - {FIELD}, "any_pair(G, i, j, A, B, reach, room)")
_by_kinds_planar = _by_kinds("by_kinds_planar", PLANAR, "0")


@formula
def place(G, M, i):
    """Where a shape's origin is, and its axes (rows take its components to the world's)."""
    m = G.shape_i[i, MOVER]
    p, R = load3(G.shape_x, i, PLACE), load9(G.shape_x, i, AXES)
    if m < 0:
        return p, R
    Q = load9(M.pose, m, 3)
    return add(load3(M.pose, m, 0), mv(Q, p)), mm(Q, R)


@formula
def _of_two(by_kinds, G, M, i, j, reach, room):
    """Contacts of two shapes by a choice among pairs."""
    a, b = G.shape_i[i, KIND], G.shape_i[j, KIND]
    turned = a > b
    if turned:
        i, j, a, b = j, i, b, a
    p, R = place(G, M, i)
    q, Q = place(G, M, j)
    d = sub(q, p)
    if not dot(d, d) < inf:  # what is no number touches nothing
        return 0
    count = by_kinds(a, b, G, i, j, ((0.0, 0.0, 0.0), R), (d, Q), reach, room)
    for k in range(count):
        for c in range(3):
            room[k, c] += p[c]
            if turned:
                room[k, 3 + c] = -room[k, 3 + c]
    return count


@formula
def collide(G, M, i, j, reach, room):
    """Contacts of shapes i and j: how many were written into the first rows of ``room``.

    A row is a point midway between the surfaces, the unit normal from i to j, the gap and the feature, a whole number
    that tells the points of this pair apart and lasts. Points whose gap is above ``reach`` are no contacts.

    Parameters
    ----------
    G : Geometry
    M : Movers
    i, j : int
        Two shapes.
    reach : float
        Largest gap [m].
    room : array (ROOM, 8)
        Contacts come first; the rest is scratch (``room.py``).
    """
    return _of_two(_by_kinds_all, G, M, i, j, reach, room)


@formula
def collide_planar(G, M, i, j, reach, room):
    """As `collide`, for the kinds of planar mechanisms only: a third of it to compile."""
    return _of_two(_by_kinds_planar, G, M, i, j, reach, room)


@formula
def collide_convex(G, M, i, j, reach, room):
    """As `collide`, where no height fields are: three quarters of it to compile."""
    return _of_two(_by_kinds_convex, G, M, i, j, reach, room)
