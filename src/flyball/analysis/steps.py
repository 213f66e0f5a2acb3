"""Between two positions: the step along the velocities that leads from one to the other, and rates likewise."""

from __future__ import annotations

import numpy as np

from ..equations.tree import lengths, quaternion_at
from .compiled import Compiled

HALF_TURN = 1e-3  # cosine of half an angle below which it counts as half a turn


def tangent_rate(c: Compiled, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
    """The change along the velocities that changes of the coordinates are, (nv,)."""
    S = c.values.system
    out = np.zeros(c.structure.nv)
    for b in range(len(S.tree.parent)):
        q0, v0 = int(S.tree.q[b]), int(S.tree.v[b])
        n = lengths(S, b)
        out[v0 : v0 + n] = dq[q0 : q0 + n]
        k, w = quaternion_at(S, b)
        if k >= 0:
            (a, *u), (e, *p) = q[k : k + 4], dq[k : k + 4]
            out[w : w + 3] = 2.0 * (a * np.array(p) - e * np.array(u) - np.cross(u, p))
    return out


def tangent_step(c: Compiled, q: np.ndarray, other: np.ndarray) -> np.ndarray:
    """The step along the velocities that leads from one position to another, (nv,): what ``retract`` takes.

    Turns of bodies in space are Cayley steps, 2 tan(angle / 2) about the axis; towards half a turn, where these have no
    end, they stay finite. Angles of the plane count whole turns.
    """
    S = c.values.system
    out = np.zeros(c.structure.nv)
    for b in range(len(S.tree.parent)):
        q0, v0 = int(S.tree.q[b]), int(S.tree.v[b])
        n = lengths(S, b)
        out[v0 : v0 + n] = other[q0 : q0 + n] - q[q0 : q0 + n]
        k, w = quaternion_at(S, b)
        if k >= 0:
            (a, *u), (e, *p) = q[k : k + 4], other[k : k + 4]
            turn = a * np.array(p) - e * np.array(u) - np.cross(u, p)
            cosine = a * e + np.dot(u, p)
            out[w : w + 3] = 2.0 * turn / (cosine if abs(cosine) > HALF_TURN else HALF_TURN)
    return out
