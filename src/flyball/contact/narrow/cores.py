"""The farthest point of a core, as the searches for nearest points ask for it: of a height field, of one triangle."""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.vec import dot, load3
from ..kinds import FIELD
from ..tables import KIND
from .any_shape import support
from .room import PIECE


@formula
def farthest(G, i, room, d):
    """The point of the core of shape i that is farthest along d, in its axes."""
    kind = G.shape_i[i, KIND]
    if kind != FIELD:
        return support(kind, G, i, d)
    best = load3(room, PIECE, 0)
    for k in range(1, 3):
        x = load3(room, PIECE + k, 0)
        if dot(d, x) > dot(d, best):
            best = x
    return best
