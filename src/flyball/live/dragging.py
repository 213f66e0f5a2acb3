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
from .body_points import RANK_TOLERANCE, point_kinematics
from .messages import InvalidMessage, finite_number

CLOSURE_TOLERANCE = 1e-12
"""Residual of closed joints, in lengths of the mechanism or radians, at which Newton's method ends."""
MAX_RESIDUAL = 1e-11
"""Residual of positions that are shown: what rounding may leave above the tolerance."""
MAX_STEPS = 12
"""Steps towards one position of the mouse; the next position continues from there."""
MAX_CLOSURE_ITERATIONS = 8
MAX_STEP = 0.2
"""Largest change of a coordinate in one step [rad or lengths of the mechanism]: farther ones may change the branch."""
MIN_STEP = 1e-9
DAMPING = 1e-2
"""Damping of the steps, relative to a motion of the point by a length of the mechanism for a radian."""
MAX_COORDINATE = 1e9
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
        InvalidMessage
            If a number is missing or not finite, or the way of dragging is unknown.
        ModelError
            If there is no such body.
        """
        name = message.get("body")
        body = model.find(name) if model is not None and isinstance(name, str) else None
        if not isinstance(body, Body):
            raise ModelError(f"{str(name)[:80]!r} cannot be dragged: it is no body with joints or forces of its own")
        by = message.get("by")
        if by not in ("assembly", "force"):
            raise InvalidMessage(f"a body is dragged by 'assembly' or by 'force', not by {str(by)[:40]!r}")
        t = finite_number(message.get("t", 0.0), "t of a dragged body")
        at, to = (_position(message.get(k), f"{k} of a dragged body") for k in ("at", "to"))
        if model is not None and model.planar:
            at[2] = to[2] = 0.0
        return cls(body.name, at, to, by == "force", t)


def _position(values: Any, what: str) -> np.ndarray:
    if not isinstance(values, list) or len(values) != 3:
        raise InvalidMessage(f"{what} is {str(values)[:40]!r}; it must be three numbers")
    return np.array([finite_number(x, what, -MAX_COORDINATE, MAX_COORDINATE) for x in values])


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
        for _ in range(MAX_STEPS):
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
        if largest < RANK_TOLERANCE:
            raise ModelError(f"body {target.body!r} cannot be dragged there: its joints leave that point no motion")
        y = np.linalg.solve(A.T @ A + DAMPING**2 * np.eye(len(A.T)), A.T @ (error / c.values.length))
        step = free @ y
        return step * min(1.0, MAX_STEP / max(float(np.abs(step).max(initial=0.0)), 1e-300))

    @staticmethod
    def _null_space(G: np.ndarray) -> np.ndarray:
        if not len(G):
            return np.eye(G.shape[1])
        _, s, Vt = np.linalg.svd(G)
        return Vt[int((s > RANK_TOLERANCE * s[0]).sum()) :].T

    def _nearer(self, target: DragTarget, step: np.ndarray, distance: float) -> float | None:
        """Take the step, or a part of it that brings the point nearer; return the distance, None if there is none."""
        before, z = self._q.copy(), self._compiled.z.copy()
        while np.abs(step).max(initial=0.0) > MIN_STEP:
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
        for _ in range(MAX_CLOSURE_ITERATIONS):
            if self._residual() <= CLOSURE_TOLERANCE:
                return True
            units = c.row_units[self._joined]
            g = c.work.rows.value[self._joined] / units
            G = c.jacobian()[self._joined] * c.sizes / units[:, None]
            d = np.linalg.lstsq(G, -g, rcond=RANK_TOLERANCE)[0]
            if not np.isfinite(d).all() or np.abs(d).max() > MAX_STEP:
                return False
            retract(c.values.system, self._q, d * c.sizes)
        return self._residual() <= MAX_RESIDUAL

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
        position, _, J = point_kinematics(self._compiled, target.body, target.at)
        return target.to - position, J

    def _shown(self) -> Result:
        c = self._compiled
        row = np.concatenate([self._q, self._still, c.z])
        out = motion_through_states(c.values, np.array([self._t]), row[None])
        out.bulk = self._sets
        return out
