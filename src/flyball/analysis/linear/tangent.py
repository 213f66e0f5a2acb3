"""How a state changes with a parameter: the linearised constraints and equations of motion, solved in real numbers.

Along a change (dq, dv, dp) of positions, velocities and a parameter one complex step through the residuals gives what
the constraints and the equations of motion miss, exactly; accelerations and multipliers follow by

    M dvdot + (F - G^T) dlam = -(r along (dq, dv, dp)),    G dvdot = -(a along (dq, dv, dp))

F is what joint friction makes of the reactions (``loads``).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...equations.residual import residual_kernel
from ...equations.scratch import work
from ...errors import ModelError
from ...numerics.rank import TOLERANCE
from ...tables.names import velocity_names
from ...tables.values import Values
from .derivatives import Equations, State
from .differences import whole
from .loads import STEP, as_complex, by_reactions, complex_tables, derivative, refuse_undetermined

TORN = 1e-7  # part of the gaps that a parameter opens which is left where no motion closes them
ROUNDED = 1e-9  # part of the mechanism's length below which gaps that the whole of a parameter opens are none


@dataclass
class Tangent:
    """Changes per unit of a parameter: of positions along the velocities, of velocities, accelerations, multipliers."""

    q: np.ndarray
    v: np.ndarray
    vdot: np.ndarray
    lam: np.ndarray

    @property
    def parts(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """As rows, for `curves.slopes`."""
        return self.q[None], self.v[None], self.vdot[None], self.lam[None]


class Direction:
    """A parameter's complex step in the tables, and the residuals along it at any state."""

    def __init__(self, e: Equations, name: str) -> None:
        self.name = name
        self.values: Values = e.stepped(name)
        self.system = as_complex(self.values.system)
        self.work = work(e.state.c.structure, self.system, complex)
        self.e = e

    @staticmethod
    def derivative(x: np.ndarray) -> np.ndarray:
        """By the parameter, of numbers that carry its step."""
        return derivative(x)

    def along(self, x: State, dq: np.ndarray, dv: np.ndarray) -> np.ndarray:
        """Derivatives of all residuals at x along changes of positions and velocities and the parameter, (width,)."""
        nv = len(x.v)
        steps = np.zeros((1, 3 * nv + 1), complex)
        steps[0, :nv], steps[0, nv : 2 * nv] = 1j * STEP * dq, 1j * STEP * dv
        out = np.zeros((1, self.e.width), complex)
        y, vdot, lam = (a.astype(complex) for a in (x.y, x.vdot, x.lam))
        residual_kernel(self.system, self.work, complex(x.t), y, vdot, lam, steps, out)
        return derivative(out[0])


class Linear:
    """Mass matrix and constraints at a state, ready to be solved with."""

    def __init__(self, x: State, M: np.ndarray | None = None) -> None:
        c = x.c
        c.at(x.t, x.q, x.v)
        self.x = x
        self.G = c.jacobian()
        self.M = c.mass().toarray() if M is None else M
        self.which = np.array([r.holonomic for r in c.structure.rows], bool)
        self.scale = np.array([1.0 / np.sqrt(m) if m > 0.0 else 1.0 for m in np.diag(self.M)])
        n, m = len(self.M), len(self.G)
        self.A = np.zeros((n + m, n + m))
        S = self.scale
        self.A[:n, :n] = S[:, None] * self.M * S
        H = self.G * S
        self.size = 1.0 / np.maximum(np.sqrt((H * H).sum(axis=1)), 1e-300)
        self.H = self.size[:, None] * H
        self.A[:n, n:], self.A[n:, :n] = -self.H.T, self.H
        self._inverses: dict[bytes, np.ndarray] = {}

    @cached_property
    def inverse(self) -> np.ndarray:
        """Pseudo-inverse of the equations of motion with the constraints: rows may be redundant."""
        A = self.A
        if self.x.c.structure.loads:
            n, F = len(self.M), friction(self.x, self.G)
            A = A.copy()
            A[:n, n:] += self.scale[:, None] * F * self.size
        return np.linalg.pinv(A, rcond=1e-12)

    def motion(self, right: np.ndarray, which: np.ndarray | None = None) -> np.ndarray:
        """The change x with G x = right that is smallest in kinetic energy."""
        rows = np.ones(len(self.H), bool) if which is None else which
        key = rows.tobytes()
        if key not in self._inverses:
            self._inverses[key] = np.linalg.pinv(self.H[rows], rcond=TOLERANCE) if rows.any() else self.H[rows].T
        return self.scale * (self._inverses[key] @ (self.size * right)[rows])

    def acceleration(self, r: np.ndarray, a: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(dvdot, dlam) that take away what is missed of the equations of motion and of the constraints."""
        n = len(self.M)
        x = self.inverse @ -np.r_[self.scale * r, self.size * a]
        return self.scale * x[:n], self.size * x[n:]


def friction(x: State, G: np.ndarray) -> np.ndarray:
    """What joint friction makes of the reactions, F (nv, rows); refused where redundancy leaves these open."""
    s = x.c.structure
    F = by_reactions(x, *complex_tables(x.c))
    turns = np.array([1.0 if d.unit == "m" else 1.0 / x.c.values.length for d in velocity_names(s)])
    refuse_undetermined(s, G * turns, F)
    return F


def nearest(d: Direction, x: State, lin: Linear, dq: np.ndarray, dv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The changes of positions and velocities nearest to the given ones that keep the constraints.

    Raises
    ------
    ModelError
        If none keep them: with another value of the parameter the mechanism cannot be assembled.
    """
    at = d.e.at
    before = d.along(x, dq, dv)[at["g"]]
    dq = dq + lin.motion(-before, lin.which)
    left = d.along(x, dq, dv)
    _refuse_torn(d, x, np.abs(before), np.abs(left[at["g"]]))
    return dq, dv + lin.motion(-left[at["n"]])


def _refuse_torn(d: Direction, x: State, before: np.ndarray, left: np.ndarray) -> None:
    """Refuse a parameter whose change opens gaps (rows,) that no motion closes."""
    c = x.c
    rounding = ROUNDED * c.values.length / whole(c.structure.model, c.parameters, d.name)
    if left.max(initial=0.0) > max(TORN * before.max(initial=0.0), rounding):
        names = dict.fromkeys(
            r.element.name for r, g in zip(c.structure.rows, left, strict=True) if g > 0.1 * left.max()
        )
        raise ModelError(
            f"{c.structure.model.name!r} cannot be assembled with another {d.name!r}: {', '.join(names)} would "
            f"contradict each other (redundant joints, or a singular position), so nothing has a derivative by it. Let "
            f"what else has to fit follow the parameter, or take the redundancy out: m.mobility() names it"
        )


def closed(d: Direction, x: State, lin: Linear, dq: np.ndarray, dv: np.ndarray) -> Tangent:
    """The tangent whose positions and velocities are nearest to the given ones and keep the constraints."""
    at = d.e.at
    dq, dv = nearest(d, x, lin, dq, dv)
    left = d.along(x, dq, dv)
    return Tangent(dq, dv, *lin.acceleration(left[at["r"]], left[at["a"]]))
