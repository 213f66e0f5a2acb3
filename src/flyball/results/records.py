"""Kinematic records over time: the loops of the house, run in plain Python on arrays of all output times at once."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from ..math.vec import add, cross, load3, load9, scale, sub
from ..model.joint import Coordinate, Joint
from ..system.records import at_rest, carried, load
from ..system.tables import PARENT, V0
from ..system.tree import column, motion, pose
from ..system.values import Values

Record = tuple


class Records:
    """Records of bodies and frames at every output time, with true accelerations; arrays (n,) for each number."""

    def __init__(self, x: Values, q: np.ndarray, v: np.ndarray, vdot: np.ndarray) -> None:
        self.x = x
        self.n = len(q)
        S = x.system
        nb, nv = len(S.body_i), v.shape[1]
        self.W = SimpleNamespace(
            BK=np.zeros((nb, 24, self.n)), X=np.zeros((nv, 6, self.n)), O=np.zeros((nb, 3, self.n))
        )
        for b in range(nb):
            pose(S, self.W, b, q.T)
            motion(S, self.W, b, v.T)
        self._bodies = [self._moving(b, vdot.T) for b in range(nb)]
        self._frames: dict[int, Record] = {}

    def _moving(self, b: int, vdot: np.ndarray) -> Record:
        """Record of a body with its true accelerations: the bias plus every twist column times its vdot."""
        S, W = self.x.system, self.W
        p, R, w, v, alpha, a = load(W.BK, b)
        k = b
        while k >= 0:
            arm = sub(p, load3(W.O, k, 0))
            for i in range(S.body_i[k, 5]):
                turn, shift = column(S, W, k, i)
                s = vdot[S.body_i[k, V0] + i]
                alpha = add(alpha, scale(s, turn))
                a = add(a, scale(s, add(shift, cross(turn, arm))))
            k = S.body_i[k, PARENT]
        return p, R, w, v, alpha, a

    def body(self, b: int) -> Record:
        """Record of body b's centre of mass."""
        return self._bodies[b]

    def frame(self, k: int) -> Record:
        """Record of frame k."""
        if k not in self._frames:
            S = self.x.system
            offset, turn = load3(S.frame_x, k, 0), load9(S.frame_x, k, 3)
            b = int(S.frame_i[k])
            self._frames[k] = self.carried(b, offset, turn)
        return self._frames[k]

    def carried(self, b: int, offset: tuple, turn: tuple) -> Record:
        """Record of a point and axes carried by body b (-1: ground)."""
        if b >= 0:
            return carried(self._bodies[b], offset, turn)
        zero = np.zeros(self.n)
        p, R, *rest = at_rest(offset, turn, zero)
        return (tuple(x + zero for x in p), tuple(x + zero for x in R), *rest)


def coordinate_frames(x: Values, joint: Joint, what: str) -> tuple[tuple[int, Any], tuple[int, Any], Coordinate]:
    """(frame, extra turn) twice: what a joint's coordinate is measured between, from its frames F and M."""
    c = joint.coordinates[what]
    ends = []
    for role in c.frames:
        turn = getattr(c, f"turn_{role}")
        ends.append((x.structure.frame_at[joint.name, role, ""], turn if len(turn) else np.eye(3)))
    return ends[0], ends[1], c


def turned(record: Record, turn: Any) -> Record:
    """The record with its axes turned by a constant rotation."""
    from ..math.vec import mm

    return (record[0], mm(record[1], tuple(np.asarray(turn).ravel())), *record[2:])
