"""Coordinates of tree joints that drivers prescribe: they are as their laws say."""

from __future__ import annotations

from ..compiler.formulas import formula
from ..laws.evaluation import evaluate_jet
from ..tables.system import BODY_LAW, GIVEN, MADE, OFFSET, PREPARE, Q0, V0
from .made import run
from .rows import BY_TIME
from .tree import normalise


@formula
def prepare(S, W, t, q, v):
    """Unit quaternions; prescribed coordinates, velocities and accelerations (W.vel[GIVEN]) as their laws say."""
    if W.info[MADE + PREPARE] != 0:
        run(W.info[MADE + PREPARE], S, W, t, q, v, q, v)
        return
    normalise(S, q)
    for b in range(S.body_i.shape[0]):
        law = S.body_i[b, BODY_LAW]
        if law >= 0:
            f, f1, f2 = evaluate_jet(S.code, S.const, law, W.stack, t, W.sensed, BY_TIME)
            q[S.body_i[b, Q0]] = f - S.body_x[b, OFFSET]
            v[S.body_i[b, V0]] = f1
            W.vel[GIVEN, S.body_i[b, V0]] = f2
