"""Constraint rows: sums of unit wrenches on frames, minus a law of time.

    g = sum c_k value_k - f(t),  G v = nu = f',  G vdot = gamma = f'' - sum c_k bias_k

and G[row, d] is the power of the row's wrench along twist column d, whatever the coordinates below.
"""

from __future__ import annotations

from .._jit import formula
from ..math.scalar import atan2, cos, sin
from ..math.vec import neg
from .laws import evaluate_jet
from .records import load
from .tables import G_VALUE, GAMMA, NU, NU_DOT, ROW_LAW, ROW_WRAP, TERM_F, TERM_M, TERM_ROW, TERM_SEG, TERM_SEG_END
from .tree import project

COEFFICIENT = 7


@formula
def parameters(T, k):
    """The eight parameters of row k of an element table."""
    return (T[k, 0], T[k, 1], T[k, 2], T[k, 3], T[k, 4], T[k, 5], T[k, 6], T[k, 7])


@formula
def begin(S, W, t):
    """Start every row from its law of time."""
    for k in range(S.row_i.shape[0]):
        law = S.row_i[k, ROW_LAW]
        if law >= 0:
            f, f1, f2 = evaluate_jet(S.code, S.const, law, W.stack, t, W.stack, -1)  # chief: sensed
            W.row[G_VALUE, k] = -f
            W.row[NU, k] = f1
            W.row[NU_DOT, k] = f2
        else:
            W.row[G_VALUE, k] = 0.0
            W.row[NU, k] = 0.0
            W.row[NU_DOT, k] = 0.0
    for e in range(W.G.shape[0]):
        W.G[e] = 0.0


@formula
def each_value(S, W, kind, row):
    """Add every term of one kind to its row: value and Jacobian entries, from the poses."""
    for k in range(S.kinds[kind], S.kinds[kind + 1]):
        F = load(W.FK, S.term_i[k, TERM_F])
        M = load(W.FK, S.term_i[k, TERM_M])
        g, force, torque_M, torque_F, _ = row(parameters(S.term_x, k), F, M)
        c = S.term_x[k, COEFFICIENT]
        W.row[G_VALUE, S.term_i[k, TERM_ROW]] += c * g
        for s in range(S.term_i[k, TERM_SEG], S.term_i[k, TERM_SEG_END]):
            if S.seg_i[s, 1] > 0:
                project(S, W, S.seg_i[s, 0], W.G, S.seg_i[s, 2], c, force, torque_M, M[0])
            else:
                project(S, W, S.seg_i[s, 0], W.G, S.seg_i[s, 2], c, neg(force), torque_F, F[0])


@formula
def each_bias(S, W, kind, row):
    """Take every term's acceleration bias of one kind from its row's gamma."""
    for k in range(S.kinds[kind], S.kinds[kind + 1]):
        F = load(W.FK, S.term_i[k, TERM_F])
        M = load(W.FK, S.term_i[k, TERM_M])
        _, _, _, _, bias = row(parameters(S.term_x, k), F, M)
        W.row[GAMMA, S.term_i[k, TERM_ROW]] -= S.term_x[k, COEFFICIENT] * bias


@formula
def end(S, W):
    """Angles that follow a law are compared modulo a whole turn."""
    for k in range(S.row_i.shape[0]):
        if S.row_i[k, ROW_WRAP] == 1:
            g = W.row[G_VALUE, k]
            W.row[G_VALUE, k] = atan2(sin(g), cos(g))


@formula
def row_times(S, W, k, x):
    """G[k] . x."""
    s = 0.0 * W.row[G_VALUE, k]
    for e in range(S.row_p[k], S.row_p[k + 1]):
        s += W.G[e] * x[S.col_i[e]]
    return s
