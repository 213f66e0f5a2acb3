"""What multipliers that act on nothing do to reactions: the components that redundancy leaves undetermined."""

from __future__ import annotations

import numpy as np

from ...constraints.registry import KINDS
from ...equations.records import load
from ...equations.rows import parameters
from ..assembly.start import Assembly

CHANGED = 1e-6  # part of the largest that a self-stress does to a component, below which it leaves it alone
COMPONENTS = ("force x", "force y", "force z", "torque x", "torque y", "torque z")


def self_stresses(a: Assembly, lam: np.ndarray, names: list[str]) -> dict[str, np.ndarray]:
    """Wrenches (6, k) on ``body_j`` at the joint's point there that each of the self-stresses ``lam`` (nr, k) makes.

    World axes, torques divided by the mechanism's length. The mechanism has been evaluated at the position.
    """
    c = a.compiled
    s, S, W = c.structure, c.values.system, c.work
    out = {n: np.zeros((6, lam.shape[1])) for n in names}
    for name in names:
        for k in s.terms_of[name]:
            t = s.terms[k]
            par = parameters(S.term_x, k)
            hint = c.z[t.hint] if t.hint >= 0 else 0.0
            _, f, tM, tF, _ = KINDS[t.formula.kind].row(par, load(W.FK, t.F), load(W.FK, t.M), hint, S.const)
            force, torque = np.array(f), np.array(tM)
            if s.frames[t.M].role != "M":  # measured from M to F
                force, torque = -force, np.array(tF)
            out[name] += np.outer(np.r_[force, torque / c.values.length] * par[7], lam[t.row])
    return out


def undetermined(a: Assembly, lam: np.ndarray, names: list[str]) -> dict[str, tuple[str, ...]]:
    """Reaction components (world axes, on body_j) that self-stresses ``lam`` (nr, k) can change, of these elements."""
    planar = a.compiled.structure.model.planar
    wrenches = self_stresses(a, lam, names)
    largest = max(np.abs(w).max() for w in wrenches.values())
    out = {}
    for name, w in wrenches.items():
        free = np.abs(w).max(axis=1) > CHANGED * largest
        if planar:
            free[[2, 3, 4]] = False
        text = tuple(
            x if not planar else x.replace("torque z", "torque") for x, f in zip(COMPONENTS, free, strict=True) if f
        )
        if text:
            out[name] = text
    return out
