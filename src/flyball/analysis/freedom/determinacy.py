"""Which reactions a motion determines, position by position: what no self-stress can change.

A mechanism that its drivers move has as many constraints too many as it has more of them than velocities, but where it
is singular. So many dependencies are found by inverse iteration with one sparse factor a position, in a compiled loop
(``equations/dependencies.py``); where they turn out to be more or fewer, or to be told apart only just, by singular
values.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...equations.dependencies import dependencies
from ...math.vec import mtv
from ...model.body import Driver
from ...model.coupling import Coupling
from ...model.geometry import matrix_to_quaternion
from ...numerics.rank import parts
from ...numerics.sparse_rank import DENSE, FEW, by_pivots
from ...results.records import Records
from ...results.result import Result
from ...tables.system import PLANAR, POINT
from ..compiled import Compiled, compiled
from .jacobian import lengths, scaled_jacobian
from .stresses import CHANGED, self_stresses

ITERATED = 64  # dependencies up to which they are found by inverse iteration
LEAST = 1e-6  # part of the largest entry of a dependency that makes a row part of it
NONE, SURE = 1e-11, 1e-5  # singular values, of the largest, that are surely none, and surely some


class Determinacy:
    """Self-stresses of a mechanism along its motion.

    Attributes
    ----------
    count : ndarray (n,) of int
        Constraints too many at every time.
    least : ndarray (n,)
        The smallest singular value of the constraints that counts, of the largest: near zero near a singular position.
    wrenches : dict
        Joint -> what independent self-stresses do to its reaction, (n, 6, k): force and torque / length, world axes,
        on ``body_j`` at the joint's point there. Joints that none touches are left out.
    efforts : dict
        Driver or coupling -> whether its effort is undetermined, (n,) of bool; the same.
    """

    def __init__(self, n: int) -> None:
        self.least = np.ones(n)
        self.count = np.zeros(n, np.int64)
        self.wrenches: dict[str, np.ndarray] = {}
        self.efforts: dict[str, np.ndarray] = {}


def determinacy(result: Result) -> Determinacy:
    """The self-stresses at every output time of a motion."""
    out = Determinacy(len(result.t))
    own = compiled(result.model, parameters=result.values.told, tree=result.values.structure.tree)
    base = own if not own.structure.tree else compiled(result.model, parameters=own.values.told)
    if not len(base.structure.rows) or not len(result.t):
        return out
    states = absolute_states(result, own, base)
    lam = _Along(base, states, out).found()
    if lam.any():
        _told(base, states, lam, out)
    return out


@dataclass
class _Along:
    """Dependencies along a motion; how many, and the least singular value that counts, are noted in ``out``."""

    base: Compiled
    states: np.ndarray
    out: Determinacy

    def found(self) -> np.ndarray:
        """Multipliers (n, nr, most) that act on nothing; nothing where there are fewer."""
        nr, nv = len(self.base.structure.rows), self.base.structure.nv
        lam = np.zeros((len(self.states), nr, 0))
        count, left, tried = max(nr - nv, 0), np.arange(len(self.states)), set[int]()
        while len(left):
            if count not in tried and count < min(nr, ITERATED):
                tried.add(count)
                sure, own = self._iterated(left, count)
                lam = _put(lam, left[sure], own[sure])
                left = left[~sure]
            if len(left):
                own = self._decomposed(left[0], count)
                lam, left, count = _put(lam, left[:1], own[None]), left[1:], own.shape[1]
        return lam

    def _iterated(self, which: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Whether there are surely ``count``, and those; by the compiled loop."""
        c = self.base
        lam, sizes = dependencies(c.values.system, c.work, self.states[which], lengths(c), count)
        largest, least, none = sizes.T
        with np.errstate(invalid="ignore"):
            sure = (least > SURE * largest) & (none < NONE * largest)
        self.out.count[which], self.out.least[which] = count, least / largest
        return sure, lam

    def _decomposed(self, k: int, count: int) -> np.ndarray:
        """Multipliers (nr, dependencies) at one time, by singular values; by pivots where there are about many."""
        c, nq, nv = self.base, self.base.structure.nq, self.base.structure.nv
        t, q, v, z = np.split(self.states[k], np.cumsum([1, nq, nv]))
        c.z = np.where(np.isnan(z), c.z, z)
        c.at(float(t[0]), q, v)
        G, size, _ = scaled_jacobian(c)
        size = np.maximum(size, 1e-300)
        large, many = max(G.shape) > DENSE, count >= ITERATED and max(G.shape) > FEW
        if (large or many) and (found := by_pivots(G)) is not None:
            (count, own), self.out.least[k] = found, 1.0
        else:
            p = parts(G.toarray())
            count, own = p.rank, p.dependencies
            self.out.least[k] = float(p.values[-1] / p.values[0]) if p.rank else 1.0
        self.out.count[k] = G.shape[0] - count
        return own / size[:, None]


def _put(lam: np.ndarray, which: np.ndarray, own: np.ndarray) -> np.ndarray:
    """``lam`` with the dependencies at some of the times, widened if need be."""
    more = own.shape[2] - lam.shape[2]
    lam = np.pad(lam, ((0, 0), (0, 0), (0, max(more, 0))))
    lam[which, :, : own.shape[2]] = own
    return lam


def _told(base: Compiled, states: np.ndarray, lam: np.ndarray, out: Determinacy) -> None:
    """What self-stresses do to joints; efforts of drivers and couplings that they change."""
    s, n = base.structure, len(states)
    largest = np.abs(lam).max(axis=2)
    part = largest > LEAST * largest.max(axis=1, keepdims=True)
    touched = {name: part[:, rows].any(axis=1) for name, rows in s.slices.items()}
    joints = []
    for name in [name for name, at in touched.items() if at.any()]:
        if isinstance(s.model[name], (Driver, Coupling)):
            out.efforts[name] = touched[name]
        else:
            joints.append(name)
    _, q, v, z = np.split(states, np.cumsum([1, s.nq, s.nv]), axis=1)
    records = Records(base.values, q, v, np.zeros_like(v))
    wrenches = self_stresses(base.values, records.frame, z.T, lam, joints)
    most = np.zeros(n)
    for name, w in wrenches.items():
        w[~touched[name]] = 0.0
        np.maximum(most, np.abs(w).max(axis=(1, 2)), out=most)
    for name, w in wrenches.items():
        w /= np.maximum(most, 1e-300)[:, None, None]
        w[np.abs(w).max(axis=(1, 2)) <= CHANGED] = 0.0
        if w.any():
            out.wrenches[name] = w


# The states of a motion in absolute coordinates, all output times at once.


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
