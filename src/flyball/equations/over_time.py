"""Kinematics of all bodies at many states, by the formulas of `tree`."""

from __future__ import annotations

from typing import NamedTuple

from ..compiler.kernels import kernel
from ..compiler.layout import Float2, Float3
from ..tables.system import Bodies, Tree
from .tree import motion, pose


class BodyTables(NamedTuple):
    """What of `System` it is computed from."""

    tree: Tree
    bodies: Bodies


class AtOnce(NamedTuple):
    """Of the bodies at one state, as in `Work`: records, twist columns, reference points."""

    BK: Float2
    X: Float2
    O: Float2


class OverTime(NamedTuple):
    """The same at all states, (bodies or columns, numbers, states)."""

    BK: Float3
    X: Float3
    O: Float3


@kernel
def kinematics_over_time(S: BodyTables, W: AtOnce, q: Float2, v: Float2, out: OverTime) -> int:
    """Poses, velocities and bias accelerations at the coordinates q (n, nq) and velocities v (n, nv)."""
    for i in range(q.shape[0]):
        for b in range(S.tree.parent.shape[0]):
            pose(S, W, b, q[i])
            motion(S, W, b, v[i])
            for k in range(24):
                out.BK[b, k, i] = W.BK[b, k]
            for k in range(3):
                out.O[b, k, i] = W.O[b, k]
        for j in range(v.shape[1]):
            for k in range(6):
                out.X[j, k, i] = W.X[j, k]
    return 0
