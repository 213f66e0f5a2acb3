"""Sensitivity of whole motions: the variational equations beside the equations of motion.

    dq' = dv + N dq,    (dvdot, dlam) from the linearised equations at every instant (see ``tangent``)

Both are integrated together by an explicit Runge-Kutta method of order 8; after every step the motion is put back on
the constraints, and its changes on the linearised ones. (Direct differentiation: Haug and Ehle 1982; Chang and
Nikravesh 1985. That the changes may be put back like this, see Serban and Freeman 1996.)
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...equations.engine import MOTION
from ...equations.tree import normalise, retract
from ...errors import SimulationError
from ...tables.system import EFFORT, G_VALUE, LAM, NU, X_SOLVED
from ..compiled import Compiled
from .derivatives import State
from .frames import kinematic
from .tangent import Direction, Linear, Tangent, closed

CLOSED = 1e-12  # of the mechanism's length
PASSES = 8


class Variation:
    """A motion and its changes with parameters.

    Parameters
    ----------
    x : State
        Start, in absolute coordinates.
    directions : sequence of Direction
        Parameters.
    start : sequence of Tangent
        How the start changes with each.
    """

    def __init__(self, x: State, directions: Sequence[Direction], start: Sequence[Tangent]) -> None:
        self.c: Compiled = x.c
        self.x = x
        self.M = x.c.mass().toarray()
        self.directions = list(directions)
        self.nq, self.nv = len(x.q), len(x.v)
        self.nz = len(x.z)
        self.y = np.concatenate([x.y, *(np.r_[d.q, d.v] for d in start)])

    def run(self, times: np.ndarray, rtol: float, atol: float) -> Iterator[tuple[State, list[Tangent]]]:
        """The state and its changes at every time; steps end at the times.

        Raises
        ------
        SimulationError
            If the step becomes too small: a singular position, or something that is not smooth.
        """
        from scipy.integrate import DOP853

        t, first = float(times[0]), None
        yield self._at(t, self.y)
        for end in times[1:]:
            solver = DOP853(self._rate, t, self.y, float(end), rtol=rtol, atol=atol, first_step=_within(first, end - t))
            while solver.status == "running":
                message = solver.step()
                if solver.status == "failed":
                    raise SimulationError(
                        f"the variational equations stopped at t = {solver.t:.6g} s: {message}", None, t
                    )
                first = solver.h_abs
                solver.y = self._closed(solver.t, solver.y)
                solver.f = self._rate(solver.t, solver.y)
            t, self.y = float(solver.t), solver.y
            yield self._at(t, self.y)

    def _split(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Positions, velocities, states, and changes (parameters, 2 nv)."""
        q, v, z, more = np.split(y, np.cumsum([self.nq, self.nv, self.nz]))
        return q.copy(), v.copy(), z, more.reshape(len(self.directions), 2 * self.nv)

    def _state(self, t: float, q: np.ndarray, v: np.ndarray) -> State:
        return State.moving(self.c, t, q, v)

    def _rate(self, t: float, y: np.ndarray) -> np.ndarray:
        q, v, z, changes = self._split(y)
        normalise(self.c.values.system, q)
        _, dy = self.c.at(t, q, v, MOTION)
        W = self.c.work
        x = State(self.c, t, q, v, self.c.z.copy(), W.vel[X_SOLVED].copy(), W.row[LAM].copy(), W.vel[EFFORT].copy())
        out = np.zeros_like(y)
        out[: self.nq + self.nv + self.nz] = dy
        lin, N = Linear(x, self.M), kinematic(x)
        parts = out[self.nq + self.nv + self.nz :].reshape(changes.shape)
        for k, d in enumerate(self.directions):
            dq, dv = np.split(changes[k], 2)
            left = d.along(x, dq, dv)
            parts[k, : self.nv] = dv + N @ dq
            parts[k, self.nv :] = lin.acceleration(left[d.e.at["r"]], left[d.e.at["a"]])[0]
        return out

    def _closed(self, t: float, y: np.ndarray) -> np.ndarray:
        """Motion and changes back on their constraints."""
        q, v, z, changes = self._split(y)
        S = self.c.values.system
        normalise(S, q)
        for _ in range(PASSES):
            self.c.at(t, q, v)
            lin, g = Linear(State(self.c, t, q, v, self.c.z, v, self.x.lam, v), self.M), self.c.work.row[G_VALUE].copy()
            if not np.abs(g[lin.which]).max(initial=0.0) > CLOSED * self.c.values.length:
                break
            retract(S, q, lin.motion(-g, lin.which))
        v += lin.motion(self.c.work.row[NU] - self.c.jacobian() @ v)
        x = self._state(t, q, v)
        lin = Linear(x, self.M)
        for k, d in enumerate(self.directions):
            now = closed(d, x, lin, *np.split(changes[k], 2))
            changes[k] = np.r_[now.q, now.v]
        return np.concatenate([q, v, self.c.z, changes.ravel()])

    def _at(self, t: float, y: np.ndarray) -> tuple[State, list[Tangent]]:
        q, v, _, changes = self._split(y)
        x = self._state(t, q, v)
        lin = Linear(x, self.M)
        return x, [closed(d, x, lin, *np.split(changes[k], 2)) for k, d in enumerate(self.directions)]


def _within(first: float | None, span: float) -> float | None:
    return None if first is None else min(first, span)
