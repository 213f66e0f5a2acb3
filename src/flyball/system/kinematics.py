"""(q, v) -> records of bodies and frames."""

from __future__ import annotations

from .._jit import formula
from ..math.vec import load3, load9
from .records import at_rest, carried, load, store
from .tree import advance


@formula
def bodies(S, W, q, v):
    """Records of all bodies, parents first."""
    for b in range(S.body_i.shape[0]):
        advance(S, W, b, q, v)


@formula
def frames(S, W):
    """Records of all frames on moving bodies (frames on ground are written once, when the work arrays are made)."""
    for k in range(S.kinds[-1], S.frame_i.shape[0]):
        record = carried(load(W.BK, S.frame_i[k]), load3(S.frame_x, k, 0), load9(S.frame_x, k, 3))
        store(W.FK, k, record)


@formula
def ground_frames(S, W):
    """Records of the frames on ground."""
    for k in range(S.kinds[-1]):
        store(W.FK, k, at_rest(load3(S.frame_x, k, 0), load9(S.frame_x, k, 3), 0.0 * S.frame_x[k, 0]))
