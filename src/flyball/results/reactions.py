"""What joints carry, rows or tree joints: the backward sweep over everything that acts on the bodies.

A body needs the wrench (m (a - g), I alpha + w x I w) about its centre of mass. What forces and rows do not give, its
tree joint must; what its children need beyond that passes through it too. Summed from the leaves to the roots with the
true accelerations, that is the wrench through every tree joint (recursive Newton-Euler: Luh, Walker and Paul 1980;
Featherstone 2008, table 5.1). Through FREE and PLANAR nothing passes: the residual of the equations of motion.
"""

from __future__ import annotations

from functools import cached_property
from types import SimpleNamespace
from typing import TYPE_CHECKING

import numpy as np

from ..equations.loads import act, euler
from ..laws.call import STACK_RESERVE
from ..laws.evaluation import evaluate_jet
from ..math.vec import add, cross, load3, load9, mtv, mv, neg, put3, scale, sub
from ..model.force import CoordinateForce
from .terms import Wrench, along, coefficient, nothing, term

if TYPE_CHECKING:
    from .result import Result


class Reactions:
    """Wrenches over time, world axes, arrays (n,) for each number."""

    def __init__(self, result: Result) -> None:
        self._result = result
        self._known: dict[str, Wrench] = {}

    def of(self, joint: str) -> Wrench:
        """Force [N] on a joint's ``body_j`` at M's origin and torque [N m] about it.

        What a driver does along a coordinate of the joint is the driver's, not the joint's.
        """
        if joint not in self._known:
            force, torque = self._of_rows(joint)
            if joint in self._result.values.structure.tree_joints:
                more = self._of_tree(joint)
                force, torque = add(force, more[0]), add(torque, more[1])
            self._known[joint] = force, torque
        return self._known[joint]

    def _of_rows(self, joint: str) -> Wrench:
        """What the joint's own rows do."""
        result, s = self._result, self._result.values.structure
        force, torque = nothing(result.records)
        for k in s.terms_of.get(joint, ()):
            t = s.terms[k]
            _, _, (_, f, tM, tF, _) = term(result, k)
            if s.frames[t.M].role != "M":  # measured from M to F
                f, tM = neg(f), tF
            lam = coefficient(result, k) * result.multipliers[:, t.row]
            force, torque = add(force, scale(lam, f)), add(torque, scale(lam, tM))
        return force, torque

    def _of_tree(self, name: str) -> Wrench:
        """What passes through a tree joint, less what drivers that prescribe its coordinates do."""
        result, s = self._result, self._result.values.structure
        joint, tree = s.model[name], s.tree_joints[name]
        force, torque = load3(self.through, tree.child, 0), load3(self.through, tree.child, 3)
        at = result.records.frame(s.frame_at[name, "M", ""])[0]
        torque = add(torque, cross(sub(result.records.body(tree.child)[0], at), force))
        if tree.reversed:
            force, torque = neg(force), neg(torque)
        for driver in s.prescribed:
            owner, what = s.model.coordinate(s.model[driver].coordinate, s.model[driver])
            if owner is joint:
                f, t = along(result, joint, what)
                effort = result.multipliers[:, s.slices[driver].start]
                force, torque = sub(force, scale(effort, f)), sub(torque, scale(effort, t))
        return force, torque

    @cached_property
    def through(self) -> np.ndarray:
        """The wrench that every body's tree joint puts on it, (nb, 6, n).

        Force [N], and torque [N m] about the body's centre of mass, world axes.
        """
        S = self._result.values.system
        W = self._acting()
        for b in range(len(S.tree.parent) - 1, -1, -1):
            parent = int(S.tree.parent[b])
            if parent >= 0:
                act(W, parent, 1.0, load3(W.FB, b, 0), load3(W.FB, b, 3), load3(W.BK, b, 0))
        return -W.FB

    def _acting(self) -> SimpleNamespace:
        """Kinematics, and what acts on every body with the tree joints left out: gravity, inertia, forces, rows."""
        result, s = self._result, self._result.values.structure
        W = self._inertial()
        for f in s.forces:
            if not isinstance(f, CoordinateForce):
                self._between(W, f.name)
        efforts = self._efforts()
        for k, t in enumerate(s.terms):
            c = coefficient(result, k)
            effort = efforts[t.row - len(s.rows)] if t.measured else result.multipliers[:, t.row]
            if c != 0.0 and effort.any():
                self._term(W, k, c * effort)
        return W

    def _inertial(self) -> SimpleNamespace:
        """Kinematics, and gravity less what each body needs to move as it does."""
        S, records = self._result.values.system, self._result.records
        W = SimpleNamespace(BK=records.W.BK, FB=records.zeros(len(S.tree.parent), 6))
        gravity = tuple(S.gravity)
        for b in range(len(S.tree.parent)):
            _, R, w, _, alpha, a = records.body(b)
            put3(W.FB, b, 0, scale(S.bodies.mass[b], sub(gravity, a)))
            put3(W.FB, b, 3, neg(mv(R, euler(load9(S.bodies.inertia, b, 0), mtv(R, w), mtv(R, alpha)))))
        return W

    def _between(self, W: SimpleNamespace, name: str) -> None:
        """A force between frames: the wrench on M's body, its reverse at the same point on F's."""
        (i, j), at, force, torque = self._result[name].acts()
        if j >= 0:
            act(W, j, 1.0, force, torque, at)
        if i >= 0:
            act(W, i, -1.0, force, torque, at)

    def _term(self, W: SimpleNamespace, k: int, effort: np.ndarray) -> None:
        """A term of a row or of a measured quantity that pushes with an effort."""
        t = self._result.values.structure.terms[k]
        F, M, (_, force, torque_M, torque_F, _) = term(self._result, k)
        i, j = (int(self._result.values.system.frame_body[frame]) for frame in (t.F, t.M))
        if j >= 0:
            act(W, j, effort, force, torque_M, M[0])
        if i >= 0:
            act(W, i, effort, neg(force), torque_F, F[0])

    def _efforts(self) -> list[np.ndarray]:
        """What acts along every measured quantity: forces, and drivers whose laws follow it.

        The row of such a driver is q - f(t, s): along s it acts with -df/ds times its multiplier.
        """
        result, s = self._result, self._result.values.structure
        out = [result.records.zeros() for _ in s.measured]
        for f in s.forces:
            if isinstance(f, CoordinateForce):
                m, effort = result[f.name].pushes()
                out[m] = out[m] + effort
        for k, row in enumerate(s.rows):
            for slot in row.sensors:
                out[slot] = out[slot] - result.multipliers[:, k] * self._slope(row.law, slot)
        return out

    def _slope(self, law: int, slot: int) -> np.ndarray:
        """Derivative of a driver's law by a sensor."""
        result, S = self._result, self._result.values.system
        sensed = result.measured.slots
        stack = np.zeros((result.values.structure.depth + 1 + STACK_RESERVE, 3), result.records.dtype)
        slopes = [
            evaluate_jet(S.code, S.const, law, stack, float(t), sensed[:, :, i], slot)[1]
            for i, t in enumerate(result.t)
        ]
        return np.array(slopes)
