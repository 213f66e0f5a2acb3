"""Coordinate partitioning: which coordinates are independent, and when another takes the place of one of them.

With G = [G_d G_i], dependent and independent columns, dv_d = B dv_i where B = -G_d^-1 G_i (Wehage and Haug 1982,
*Journal of Mechanical Design* 104, 247-255). ``settle`` solves positions and velocities for the dependent ones; the
independent ones stay as the integrator has them.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.scalar import magnitude
from .solve import REFINEMENTS, factor, solve

MOST = 4.0  # a dependent coordinate that moves by more than this times an independent one takes its place


@formula
def exchange(S, W):
    """Exchange coordinates as long as an entry of B, in sizes of its coordinates, is above MOST.

    Each exchange multiplies the volume |det G_d| by that entry, so this comes to an end, and the pivots stay away from
    zero (the exchange is that of Goreinov, Tyrtyshnikov and Zamarashkin 1997, for submatrices of large volume).
    """
    way = W.velocities.scratch_3
    r = W.rows.scratch_2
    n = way.shape[0]
    for _ in range(n):
        if r.shape[0] == 0 or factor(S, W) != 0:
            return
        most = MOST
        out = -1
        taken = -1
        for i in range(n):
            size = -W.velocities.partition[i].real
            if size > 0.0:
                column(S, W, i, r)
                solve(S, W, W.velocities.applied, r, way, W.rows.residual, False, REFINEMENTS)
                for d in range(n):
                    own = W.velocities.partition[d].real
                    if own > 0.0 and magnitude(way[d]) * size > most * own:
                        most = magnitude(way[d]) * size / own
                        out, taken = i, d
        if out < 0:
            return
        W.velocities.partition[out] = -W.velocities.partition[out]
        W.velocities.partition[taken] = -W.velocities.partition[taken]
        W.counts.exchanges += 1


@formula
def column(S, W, i, out):
    """Minus column i of G into ``out``."""
    for k in range(out.shape[0]):
        out[k] = 0.0
        for e in range(S.row_start[k], S.row_start[k + 1]):
            if S.column[e] == i:
                out[k] -= W.G[e]
