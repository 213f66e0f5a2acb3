"""What multipliers that act on nothing do to reactions: the components that redundancy leaves undetermined."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...equations.records import load
from ...equations.rows import parameters
from ...math.vec import neg, scale
from ...tables.values import Values
from ..assembly.start import Assembly

CHANGED = 1e-6  # part of the largest that a self-stress does to a component, below which it leaves it alone
COMPONENTS = ("force x", "force y", "force z", "torque x", "torque y", "torque z")


def self_stresses(
    x: Values, frame: Callable[[int], tuple], z: np.ndarray, lam: np.ndarray, names: list[str]
) -> dict[str, np.ndarray]:
    """Wrenches (..., 6, k) on ``body_j`` at the joint's point there that each of the self-stresses makes.

    World axes, torques divided by the mechanism's length. At one position, or at many: then numbers of the frames are
    arrays (n,).

    Parameters
    ----------
    x : Values
    frame : callable
        The kinematic record of a frame.
    z : ndarray (nz, ...)
        Turns and places.
    lam : ndarray (..., nr, k)
        Self-stresses.
    names : list of str
        Joints.
    """
    s, S = x.structure, x.system
    out = {n: np.zeros((*lam.shape[:-2], 6, lam.shape[-1])) for n in names}
    for name in names:
        for k in s.terms_of[name]:
            t = s.terms[k]
            par = parameters(S.term_parameters, k)
            hint = z[t.hint] if t.hint >= 0 else 0.0
            _, f, tM, tF, _ = t.formula.of_kind.row(par, frame(t.F), frame(t.M), hint, S.const)
            if s.frames[t.M].role != "M":  # measured from M to F
                f, tM = neg(f), tF
            wrench = np.stack(np.broadcast_arrays(*f, *scale(1.0 / x.length, tM)), axis=-1)
            out[name] += par[7] * wrench[..., :, None] * lam[..., t.row, None, :]
    return out


def undetermined(a: Assembly, lam: np.ndarray, names: list[str]) -> dict[str, tuple[str, ...]]:
    """Reaction components (world axes, on body_j) that self-stresses ``lam`` (nr, k) can change, of these elements."""
    c = a.compiled
    planar = c.structure.model.planar
    wrenches = self_stresses(c.values, lambda k: load(c.work.FK, k), c.z, lam, names)
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
