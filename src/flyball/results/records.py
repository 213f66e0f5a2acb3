"""Kinematic records over time: of floats compiled, of complex numbers by the same formulas on arrays in Python."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from ..equations.over_time import AtOnce, BodyTables, OverTime, kinematics_over_time
from ..equations.records import at_rest, carried, load
from ..equations.tree import column, motion, pose
from ..equations.velocities import turned_angles
from ..math.products import product
from ..math.vec import add, cross, load3, load9, mm, put3, scale, sub
from ..model.body import Frame
from ..model.joint import Coordinate, Joint
from ..tables.values import Values

Record = tuple
TURN = 2.0 * np.pi


class Records:
    """Records of bodies and frames at every output time, with true accelerations; arrays (n,) for each number.

    ``wound``: body -> whole turns [rad] that its coordinates count and its angle does not (`Result.wound`). Without
    ``vdot`` nobody will ask for accelerations.
    """

    def __init__(
        self, x: Values, q: np.ndarray, v: np.ndarray, vdot: np.ndarray | None, wound: Mapping[str, float] | None = None
    ) -> None:
        self.x, self.q = x, q
        self.n = len(q)
        S = x.system
        nb, nv = len(S.tree.parent), v.shape[1]
        own = [] if vdot is None else [vdot]
        self.dtype = np.result_type(q, v, *own, S.const)  # complex for derivatives
        self.W = OverTime(self.zeros(nb, 24), self.zeros(nv, 6), self.zeros(nb, 3))
        if self.dtype == float:
            one = AtOnce(np.zeros((nb, 24)), np.zeros((nv, 6)), np.zeros((nb, 3)))
            q, v = np.ascontiguousarray(q), np.ascontiguousarray(v)
            kinematics_over_time(BodyTables(S.tree, S.bodies), one, q, v, self.W)
        else:
            for b in range(nb):
                pose(S, self.W, b, q.T)
                motion(S, self.W, b, v.T)
        if vdot is not None:
            self._accelerate(vdot.T)
        self._frames: dict[int, Record] = {}
        self._names = {b: name for name, b in x.structure.place.items() if b >= 0}
        self._wound = wound or {}

    def zeros(self, *shape: int) -> np.ndarray:
        """Nothing yet, at every time."""
        return np.zeros((*shape, self.n), self.dtype)

    def _accelerate(self, vdot: np.ndarray) -> None:
        """Make the bias accelerations in W.BK true ones.

        What is missing passes from parent to child as if they were one body, and every twist column adds its vdot.
        """
        S, W = self.x.system, self.W
        missing: list[tuple[tuple, tuple]] = []
        for b in range(len(S.tree.parent)):
            p, _, _, _, bias_alpha, bias_a = load(W.BK, b)
            alpha = a = (0.0, 0.0, 0.0)
            parent = int(S.tree.parent[b])
            if parent >= 0:
                alpha, a = missing[parent]
                a = add(a, cross(alpha, sub(p, load3(W.BK, parent, 0))))
            arm = sub(p, load3(W.O, b, 0))
            for i in range(S.tree.nv[b]):
                turn, shift = column(S, W, b, i)
                s = vdot[S.tree.v[b] + i]
                alpha = add(alpha, scale(s, turn))
                a = add(a, scale(s, add(shift, cross(turn, arm))))
            missing.append((alpha, a))
        for b, (alpha, a) in enumerate(missing):
            _, _, _, _, bias_alpha, bias_a = load(W.BK, b)
            put3(W.BK, b, 18, add(bias_alpha, alpha))
            put3(W.BK, b, 21, add(bias_a, a))

    def body(self, b: int) -> Record:
        """Record of body b's centre of mass."""
        return load(self.W.BK, b)

    def bodies(self, b: Sequence[int] | np.ndarray) -> Record:
        """Records of several bodies' centres of mass: arrays (bodies, n)."""
        return load(self.W.BK[b].swapaxes(0, 1)[None], 0)

    def frame(self, k: int) -> Record:
        """Record of frame k."""
        if k not in self._frames:
            S = self.x.system
            offset, turn = load3(S.frames.position, k, 0), load9(S.frames.rotation, k, 0)
            b = int(S.frame_body[k])
            self._frames[k] = self.carried(b, offset, turn)
        return self._frames[k]

    def forget(self) -> None:
        """Keep no frames; they are found again when they are asked for."""
        self._frames.clear()

    def carried(self, b: int, offset: tuple, turn: tuple) -> Record:
        """Record of a point and axes carried by body b (-1: ground)."""
        if b >= 0:
            return carried(self.body(b), offset, turn)
        zero = self.zeros()
        p, R, *rest = at_rest(offset, turn, zero)
        return (tuple(x + zero for x in p), tuple(x + zero for x in R), *rest)

    def placed(self, name: str) -> tuple[int, tuple, tuple]:
        """Body (-1: ground) that carries a named frame, or a body's own; its origin and axes on that body."""
        p, R = self.x.poses.named(name)
        e = self.x.structure.model[name]
        body = e.body if isinstance(e, Frame) else name
        b = self.x.bodies[body]
        offset, turn = product(b.R.T, p - b.c), product(b.R.T, R)
        return self.x.structure.place[body], tuple(offset.tolist()), tuple(turn.ravel().tolist())

    def named(self, name: str) -> Record:
        """Record of a named frame, or of a body's own frame."""
        return self.carried(*self.placed(name))

    def angle(self, b: int) -> np.ndarray:
        """Turned angle [rad] of body b (-1: ground) of a planar mechanism, whole turns counted; (n,).

        It is the drawn angle in the drawn configuration and goes on from there, whichever coordinates are below.
        """
        if b < 0:
            return self.zeros()
        return self._angles[self._names[b]] - self._wound.get(self._names[b], 0.0)

    @cached_property
    def _angles(self) -> dict[str, np.ndarray]:
        """What the coordinates make of every body's angle."""
        return turned_angles(self.x, self.W, self.q.T)

    def drawn_angle(self, b: int) -> float:
        """Angle [rad] of body b (-1: ground) of a planar mechanism as drawn, whole turns counted."""
        return 0.0 if b < 0 else self.x.bodies[self._names[b]].angle


def wound(counted: Mapping[str, float], angles: Mapping[str, float]) -> dict[str, float]:
    """Whole turns that coordinates count and the angles of bodies do not.

    A joint that is told to begin two turns on has them in its coordinate where that is one of the mechanism's; the
    bodies are no further on for it.

    Parameters
    ----------
    counted : mapping
        Body -> its turned angle [rad] at the start of a planar motion, as its coordinates have it.
    angles : mapping
        Body -> its turned angle there.

    Returns
    -------
    dict
        Body -> how far its coordinates are ahead [rad]; those that are not are left out.
    """
    ahead = {k: TURN * round((counted[k] - a) / TURN) for k, a in angles.items()}
    return {name: float(more) for name, more in ahead.items() if more != 0.0}


def coordinate_frames(x: Values, joint: Joint, what: str) -> tuple[tuple[int, Any], tuple[int, Any], Coordinate]:
    """(frame, extra turn or ()) twice: what a joint's coordinate is measured between, from its frames F and M."""
    c = joint.coordinates[what]
    ends = []
    for role in c.frames:
        turn = getattr(c, f"turn_{role}")
        ends.append((x.structure.frame_at[joint.name, role, ""], turn))
    return ends[0], ends[1], c


def turned(record: Record, turn: Any) -> Record:
    """The record with its axes turned by a constant rotation, if there is one."""
    if not len(turn):
        return record
    return (record[0], mm(record[1], tuple(np.asarray(turn).ravel())), *record[2:])
