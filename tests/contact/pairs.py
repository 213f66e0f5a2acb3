"""Separations of many pairs of cores in one call."""

from __future__ import annotations

import numpy as np

from flyball.collision.narrow_phase.distance import core_separation
from flyball.collision.narrow_phase.primitives import SCRATCH_ROWS, SIMPLEX
from flyball.math.vec import add, load3, load9, mm, mtv, mv, scale, store3, sub, transpose
from tests.compiled import compiled


def _separations(G, pose, far, room, out):
    g = G
    for k in range(out.shape[0]):
        i, j = 2 * k, 2 * k + 1
        A, B = load9(pose, i, 3), load9(pose, j, 3)
        p = mtv(A, sub(load3(pose, j, 0), load3(pose, i, 0)))
        start = p if p[0] != 0.0 or p[1] != 0.0 or p[2] != 0.0 else (1.0, 0.0, 0.0)
        s, n, a = core_separation(g, i, j, p, mm(transpose(A), B), start, far, room, SIMPLEX)
        out[k, 0] = s
        store3(out, k, 1, mv(A, n))
        store3(out, k, 4, add(load3(pose, i, 0), mv(A, a)))
        store3(out, k, 7, add(load3(pose, i, 0), mv(A, add(a, scale(s, n)))))
    return 0


measure = compiled(_separations)


def separations(G, pose, far=np.inf):
    """Separation, direction, nearest points of the cores of shapes (0, 1), (2, 3), ... at poses (n, 12)."""
    out = np.full((len(pose) // 2, 10), np.nan)
    measure(G, pose, float(far), np.full((SCRATCH_ROWS, 8), np.nan), out)
    return out
