"""The states of a motion in absolute coordinates, all output times at once."""

from __future__ import annotations

import numpy as np

from ...math.vec import mtv
from ...model.geometry import matrix_to_quaternion
from ...results.result import Result
from ...tables.system import PLANAR, POINT
from ..compiled import Compiled


def absolute_states(result: Result, own: Compiled, base: Compiled) -> np.ndarray:
    """Times and states (n, 1 + ny) of a motion in the coordinates of ``base``.

    nan stands for turns and places on curves that ``own``, in whose coordinates the motion is, does not count; works
    are zero.
    """
    s, n = base.structure, len(result.t)
    if base is own:
        return np.column_stack([result.t, result.q, result.v, result.hints])
    q, v, z = np.zeros((n, s.nq)), np.zeros((n, s.nv)), np.full((n, len(s.states)), np.nan)
    for name, b in s.place.items():
        if b >= 0:
            _moved(result, base, name, q, v)
    hints = {k: result.hints[:, at] for k, at in own.structure.state_at.items()} | own.turned(result.q.T)
    for name, at in s.state_at.items():
        if name.endswith(".work"):
            z[:, at] = 0.0
        elif name in hints:
            z[:, at] = hints[name]
    return np.column_stack([result.t, q, v, z])


def _moved(result: Result, base: Compiled, name: str, q: np.ndarray, v: np.ndarray) -> None:
    """Coordinates and velocities of one body, where those of ``base`` stand."""
    tree = base.values.system.tree
    b, at = (x.structure.place[name] for x in (result.values, base.values))
    p, R, w, u, _, _ = result.records.body(b)
    q0, v0 = int(tree.q[at]), int(tree.v[at])
    if tree.joint[at] == POINT:
        n = int(tree.nv[at])
        q[:, q0 : q0 + n], v[:, v0 : v0 + n] = np.stack(p[:n], axis=1), np.stack(u[:n], axis=1)
    elif tree.joint[at] == PLANAR:
        q[:, q0 : q0 + 3] = np.stack([p[0], p[1], result.records.angle(b)], axis=1)
        v[:, v0 : v0 + 3] = np.stack([u[0], u[1], w[2]], axis=1)
    else:
        matrices = np.stack(np.broadcast_arrays(*R), axis=1).reshape(-1, 3, 3)
        q[:, q0 : q0 + 7] = np.column_stack([*p, matrix_to_quaternion(matrices)])
        v[:, v0 : v0 + 6] = np.stack([*u, *mtv(R, w)], axis=1)
