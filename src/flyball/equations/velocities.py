"""Velocities of the forest, read from how the bodies move, and the turned angles of bodies, read from the forest."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..math.scalar import atan2
from ..math.vec import add, cross, scale
from ..tables.coordinates import REST, BodyState, free_velocities, whole_turns
from ..tables.forest import TreeJoint
from ..tables.system import PLANAR
from ..tables.values import Values
from .tree import column


def velocities(x: Values, bodies: Mapping[str, BodyState], W: Any) -> np.ndarray:
    """Velocities (nv,) of the forest for bodies that move so.

    Those of tree joints are the least squares of each body's motion relative to its parent's, at the poses in W.
    """
    s = x.structure
    v = free_velocities(x, bodies)
    names = {b: name for name, b in s.place.items()}
    for t in s.tree_joints.values():
        parent = names[int(x.system.tree.parent[t.links[0]])]
        _rates(x, W, t, bodies[names[t.child]], bodies.get(parent, REST), v)
    return v


def turned_angles(x: Values, W: Any, q: np.ndarray) -> dict[str, Any]:
    """Turned angle of every body of a planar mechanism, whole turns counted, at the poses in W, which belong to q.

    Numbers for q (nq,), arrays over time for (nq, n). Bodies begin at the angles that they are drawn with.
    """
    S = x.system
    since: list[Any] = []  # what the coordinates along each chain have turned it since it was drawn
    for b in range(len(S.tree.parent)):
        total = since[S.tree.parent[b]] if S.tree.parent[b] >= 0 else 0.0
        for i in range(S.tree.nv[b]):
            at = S.tree.q[b] + i
            total = total + column(S, W, b, i)[0][2] * (q[at] - x.q[at])
        since.append(total)
    out = {}
    for name, b in x.structure.place.items():
        if b >= 0 and S.tree.joint[b] == PLANAR:
            out[name] = q[S.tree.q[b] + 2]
        elif b >= 0:
            near, angle = x.bodies[name].angle + since[b], atan2(W.BK[b, 6], W.BK[b, 3])
            out[name] = angle + whole_turns(near, angle)
    return out


def _rates(x: Values, W: Any, t: TreeJoint, d: BodyState, parent: BodyState, v: np.ndarray) -> None:
    """Velocities of one tree joint from the motions of the bodies on both sides."""
    S = x.system
    seen = parent.v + _cross(parent.w, d.p - parent.p)
    columns, at = [], []
    for link in t.links:
        for k in range(int(S.tree.nv[link])):
            turn, shift = column(S, W, link, k)
            arm = d.p - W.O[link]
            columns.append(np.array((*add(shift, cross(turn, arm)), *scale(x.length, turn))))
            at.append(int(S.tree.v[link]) + k)
    if len(at) == 1 and not np.iscomplexobj(columns[0]):
        rel = np.concatenate((d.v - seen, x.length * (d.w - parent.w)))
        v[at[0]] = (columns[0] @ rel) / (columns[0] @ columns[0])
    elif at:
        rel = np.r_[d.v - seen, x.length * (d.w - parent.w)]
        v[at] = least_squares(np.array(columns).T, rel)


def least_squares(A: np.ndarray, b: np.ndarray) -> np.ndarray:
    """X that makes A x - b least; of complex numbers what carries the derivative, which conjugation would not."""
    if A.shape[1] == 1:
        return (A.T @ b) / (A.T @ A)[0]
    x = np.linalg.lstsq(A.real, b.real, rcond=None)[0]
    if not (np.iscomplexobj(A) or np.iscomplexobj(b)):
        return x
    P = np.linalg.pinv(A.real)
    dx = P @ (b.imag - A.imag @ x) + P @ P.T @ A.imag.T @ (b.real - A.real @ x)
    return x + 1j * dx


def _cross(a: Any, b: Any) -> np.ndarray:
    """Cross product; NumPy's own takes ten times as long."""
    return np.array(cross(a, b))
