"""Coordinates of tree joints that drivers prescribe: they are as their laws say."""

from __future__ import annotations

from ..compiler.formulas import formula
from ..laws.evaluation import evaluate_jet
from ..tables.system import PREPARE
from .made import run
from .rows import BY_TIME
from .tree import normalise


@formula
def prepare(S, W, t, q, v):
    """Unit quaternions; prescribed coordinates, velocities and accelerations as their laws say."""
    if W.made[PREPARE] != 0:
        run(W.made[PREPARE], S, W, t, q, v, q, v)
        return
    normalise(S, q)
    for b in range(S.tree.parent.shape[0]):
        law = S.tree.law[b]
        if law >= 0:
            f, f1, f2 = evaluate_jet(S.code, S.const, law, W.stack, t, W.sensed, BY_TIME)
            q[S.tree.q[b]] = f - S.bodies.offset[b]
            v[S.tree.v[b]] = f1
            W.velocities.prescribed[S.tree.v[b]] = f2
