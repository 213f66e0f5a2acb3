"""A body dragged by a point: positions that fulfil all joints, with the point as near to the mouse as they allow."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..assembly.compiled_mechanism import CompiledMechanism, compile_mechanism
from ..engine.kinematics import retract
from ..errors import ModelError
from ..model.body import Body
from ..model.model import Model
from ..results.result import Result
from ..simulation.measurement import motion_through_states

CLOSED = 1e-12
"""Residual of closed joints, in lengths of the mechanism or radians: positions beyond ten times it are not shown."""
MOST_STEPS = 12
"""Steps towards one position of the mouse; the next position continues from there."""
MOST_CLOSING = 8
LONGEST_STEP = 0.2
"""Largest change of a coordinate in one step [rad or lengths of the mechanism]: farther ones may change the branch."""
SHORTEST_STEP = 1e-9
DAMPING = 1e-2
"""Damping of the steps, relative to a motion of the point by a length of the mechanism for a radian."""
RANK = 1e-9
"""Singular values of the constraints below this part of the largest are dependences."""
MOST_COORDINATE = 1e9
"""Largest coordinate of a point that is accepted [m]."""


@dataclass(frozen=True)
class DragTarget:
    """A point of a body, in its reference frame [m], and where it is pulled in the world [m]."""

    body: str
    at: np.ndarray
    to: np.ndarray
    by_force: bool
    t: float

    @classmethod
    def from_message(cls, message: Mapping[str, Any], model: Model | None) -> DragTarget:
        """Read a message of the page.

        Raises
        ------
        ModelError
            If there is no such body, or a number is missing or not finite.
        """
        name = message.get("body")
        body = model.find(name) if model is not None and isinstance(name, str) else None
        if not isinstance(body, Body):
            raise ModelError(f"{str(name)[:80]!r} cannot be dragged: it is no body with joints or forces of its own")
        by = message.get("by")
        if by not in ("assembly", "force"):
            raise ModelError(f"a body is dragged by 'assembly' or by 'force', not by {str(by)[:40]!r}")
        t = _finite([message.get("t", 0.0)], 1, "t")[0]
        at, to = (_finite(message.get(k), 3, k) for k in ("at", "to"))
        if model is not None and model.planar:
            at[2] = to[2] = 0.0
        return cls(body.name, at, to, by == "force", float(t))


def _finite(values: Any, count: int, name: str) -> np.ndarray:
    good = isinstance(values, list) and len(values) == count
    if not good or not all(
        isinstance(x, int | float) and not isinstance(x, bool) and abs(x) < MOST_COORDINATE for x in values
    ):
        raise ModelError(f"{name} of a dragged body must be {count} finite numbers below {MOST_COORDINATE:g}")
    return np.array(values, float)


class AssemblyDrag:
    """The mechanism without its drivers and forces, moved from one closed position to the next.

    Parameters
    ----------
    model : Model
    parameters : mapping
    start : Result
        The motion from which dragging begins.
    index : int
        Number of its output time.

    Attributes
    ----------
    closure : float
        Largest residual of the joints at the present position, in lengths of the mechanism or radians.
    """

    def __init__(self, model: Model, parameters: Mapping[str, Any], start: Result, index: int) -> None:
        c = self._compiled = compile_mechanism(model.snapshot(), parameters=parameters, solved=False)
        other = CompiledMechanism(start.values, start.states[index].copy())
        self._t, self._samples = float(start.t[index]), 0
        self._q, _ = c.take(other, self._t, start.q[index].copy(), np.zeros(start.v.shape[1]))
        self._still = np.zeros(c.structure.nv)
        self._joined = np.array([r.element.category != "drivers" for r in c.structure.rows], bool)
        self._sets = {name: m.at_times(slice(index, index + 1)) for name, m in start.bulk.items()}
        self.closure = self._residual()

    def move(self, target: DragTarget) -> Result:
        """Bring the point as near to its target as the joints allow, and return the position as a motion of one time.

        Raises
        ------
        ModelError
            If the joints leave the body no motion.
        """
        if self._compiled.structure.place[target.body] < 0:
            raise ModelError(f"body {target.body!r} cannot be dragged: it is fixed to ground")
        distance = self._distance(target)
        for _ in range(MOST_STEPS):
            step = self._step(target)
            nearer = self._nearer(target, step, distance)
            if nearer is None:
                break
            distance = nearer
        self.closure = self._residual()
        return self._shown()

    def _step(self, target: DragTarget) -> np.ndarray:
        """Return a step along the constraints by damped least squares, in scaled velocities."""
        c = self._compiled
        self._evaluate()
        free = self._null_space(c.jacobian()[self._joined] * c.sizes / c.row_units[self._joined, None])
        error, J = self._point(target)
        A = J * c.sizes @ free / c.values.length
        largest = float(np.abs(A).max(initial=0.0))
        if largest < RANK:
            raise ModelError(f"body {target.body!r} cannot be dragged there: its joints leave that point no motion")
        y = np.linalg.solve(A.T @ A + DAMPING**2 * np.eye(len(A.T)), A.T @ (error / c.values.length))
        step = free @ y
        return step * min(1.0, LONGEST_STEP / max(float(np.abs(step).max(initial=0.0)), 1e-300))

    @staticmethod
    def _null_space(G: np.ndarray) -> np.ndarray:
        if not len(G):
            return np.eye(G.shape[1])
        _, s, Vt = np.linalg.svd(G)
        return Vt[int((s > RANK * s[0]).sum()) :].T

    def _nearer(self, target: DragTarget, step: np.ndarray, distance: float) -> float | None:
        """Take the step, or a part of it that brings the point nearer; return the distance, None if there is none."""
        before, z = self._q.copy(), self._compiled.z.copy()
        while np.abs(step).max(initial=0.0) > SHORTEST_STEP:
            self._q = before.copy()
            retract(self._compiled.values.system, self._q, step * self._compiled.sizes)
            if self._close() and (found := self._distance(target)) < distance:
                return found
            self._compiled.z[:] = z
            step = 0.5 * step
        self._q = before
        self._evaluate()
        return None

    def _close(self) -> bool:
        """Close all joints from a position nearby by Newton's method; return whether they are closed."""
        c = self._compiled
        for _ in range(MOST_CLOSING):
            if self._residual() <= CLOSED:
                return True
            units = c.row_units[self._joined]
            g = c.work.rows.value[self._joined] / units
            G = c.jacobian()[self._joined] * c.sizes / units[:, None]
            d = np.linalg.lstsq(G, -g, rcond=RANK)[0]
            if not np.isfinite(d).all() or np.abs(d).max() > LONGEST_STEP:
                return False
            retract(c.values.system, self._q, d * c.sizes)
        return self._residual() <= 10.0 * CLOSED

    def _evaluate(self) -> None:
        self._compiled.at(self._t, self._q, self._still)

    def _residual(self) -> float:
        self._evaluate()
        c = self._compiled
        return float(np.abs(c.work.rows.value / c.row_units)[self._joined].max(initial=0.0))

    def _distance(self, target: DragTarget) -> float:
        return float(np.linalg.norm(self._point(target)[0]))

    def _point(self, target: DragTarget) -> tuple[np.ndarray, np.ndarray]:
        """Return the way from the point to its target (3,), and the point's Jacobian (3, nv), as last evaluated."""
        c = self._compiled
        b, tree = c.structure.place[target.body], c.values.system.tree
        R = c.work.bodies.rotation[b].reshape(3, 3)
        arm = R @ (target.at - c.values.bodies[target.body].com.real)
        J = np.zeros((3, c.structure.nv))
        shifts = 2 if c.structure.model.planar else 3
        first, n = int(tree.v[b]), int(tree.nv[b])
        J[:shifts, first : first + shifts] = np.eye(shifts)
        if n > shifts:
            cross = -np.cross(arm, np.eye(3)).T  # column k: axis k x arm
            J[:, first + shifts : first + n] = (cross @ R)[:, -(n - shifts) :]
        return target.to - c.work.bodies.position[b] - arm, J

    def _shown(self) -> Result:
        c = self._compiled
        row = np.concatenate([self._q, self._still, c.z])
        out = motion_through_states(c.values, np.array([self._t]), row[None])
        out.bulk = self._sets
        return out
