"""The linear equations of motion with the constraints taken out: first order, and M, D, K where there is a second.

With x a change of position along the velocities, u one of velocity, both seen from an evenly turning frame (see
``steady``), and inputs w, the perturbed kinematics, equations of motion and constraints at a state are

    x' + H x = u + N x,    M (u' + H u) + D u + K x + r_w w = G^T l,
    G x + g_w w = 0,       G u + V x + n_w w + g_w w' = 0

K holds everything that forces, inertia and *reactions* do when positions change: joint forces turn with the bodies, so
it is not the stiffness of the springs. With x = Z a + X w and u = Zv b + P a + U w + U1 w' the multipliers drop out
of the equations along Zv; joint friction follows the reactions, adds F to the -G^T that they act by, and needs another
projection (``_left``).
Inputs that move the mechanism act through their rates too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import ModelError
from ...numerics.rank import span
from .derivatives import Equations
from .free import Free
from .loads import refuse_undetermined
from .rounding import Doubt, Terms, without_rounding


@dataclass
class Frame:
    """An evenly turning frame.

    Attributes
    ----------
    turning : ndarray (3,) [rad/s]
        Its angular velocity, along the world's axes.
    H : ndarray (nv, nv) [1/s]
        Rate at which co-moving changes of positions and velocities turn.
    N : ndarray (nv, nv) [1/s]
        (rate of a change of position) = (change of velocity) + N (change of position).
    told : str
        What it is, for people; empty at rest.
    """

    turning: np.ndarray
    H: np.ndarray
    N: np.ndarray
    told: str = ""


@dataclass
class Inputs:
    """What m inputs do to the equations at a fixed state: r_w (nv, m), g_w (holonomic rows, m), n_w (all rows, m)."""

    r: np.ndarray
    g: np.ndarray
    n: np.ndarray


@dataclass
class Reduced:
    """Linear equations in the changes s = (a, b) of the free coordinates and velocities, and the inputs.

    Every array has columns for s (n), inputs, their first and their second rates (m each).

    Attributes
    ----------
    rate : ndarray (n, n + 3 m)
        s' as it follows from s and the inputs.
    position, velocity, acceleration, multipliers : ndarray
        Changes of all positions, velocities, accelerations, multipliers and efforts of prescribed coordinates.
    M, D, K : ndarray (f, f) or None
        M a'' + D a' + K a = 0 where all constraints are on positions.
    doubt : Doubt
        What is uncertain of A by rounding.
    """

    rate: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    multipliers: np.ndarray
    M: np.ndarray | None = None
    D: np.ndarray | None = None
    K: np.ndarray | None = None
    doubt: Doubt | None = None

    @property
    def A(self) -> np.ndarray:
        """System matrix, s' = A s without inputs."""
        return self.rate[:, : len(self.rate)]

    def inputs(self, part: np.ndarray) -> list[np.ndarray]:
        """Columns of the inputs, of their first and of their second rates."""
        return np.split(part[:, len(self.rate) :], 3, axis=1)


def reduced(e: Equations, f: Free, frame: Frame, w: Inputs | None = None, off: np.ndarray | None = None) -> Reduced:
    """Take the constraints out; ``off`` is as in `rounding.without_rounding`.

    Raises
    ------
    ModelError
        If something free moves without inertia.
    """
    r, nv = e.at["r"], len(f.scale)
    M, D, K = (X[r].toarray() for X in (e.by_acceleration, e.by_velocity, e.by_position))
    H, N = frame.H, frame.N
    given = len(f.rows) - e.block("n").size
    V = np.vstack([e.by_position[e.at["n"]].toarray(), np.zeros((given, nv))])
    w = w or Inputs(np.zeros((nv, 0)), np.zeros((len(f.holonomic), 0)), np.zeros((len(f.rows), 0)))
    none = np.zeros_like(w.r)
    rates = np.zeros((len(f.rows), w.g.shape[1]))
    rates[f.on_positions] = w.g
    X = f.unseen(-f.solve(w.g, f.holonomic), f.Z, f.left)
    P, U, U1 = (
        f.unseen(-f.solve(b), f.Zv, f.left_v) if b.any() else np.zeros((nv, b.shape[1]))
        for b in (V @ f.Z, V @ X + w.n, rates)
    )
    x = np.hstack([f.Z, np.zeros_like(f.Zv), X, none, none])
    u = np.hstack([P, f.Zv, U, U1, none])
    a_dot = f.left @ (u + (N - H) @ x)
    known = P @ a_dot + np.hstack([np.zeros((nv, f.Z.shape[1] + f.Zv.shape[1])), none, U, U1])
    acting = np.hstack([np.zeros((nv, f.Z.shape[1] + f.Zv.shape[1])), w.r, none, none])
    others = (M @ H + D) @ u + K @ x + acting
    by_multipliers = -f.rows.T
    Y = f.Zv
    if e.state.c.structure.loads:
        by_multipliers[:, : e.block("n").size] += e.by_reactions
        Y = _left(e, f)
    size = abs(M @ H) @ abs(u) + abs(D) @ abs(u) + abs(K) @ abs(x) + abs(M) @ abs(known)
    terms = Terms(Y.T @ M @ f.Zv, abs(f.left) @ (abs(u) + abs(N - H) @ abs(x)), size, Y, M)
    forces = Y.T @ (M @ known + others)
    try:
        doubt = without_rounding(terms, a_dot, forces, e, f, off)
    except np.linalg.LinAlgError:
        d = f.chosen_v[int(np.argmin(np.abs(np.diag(terms.mass))))]
        raise without_inertia(f.names[d].name) from None
    b_dot = np.linalg.solve(terms.mass, 0.0 - forces) if f.Zv.shape[1] else a_dot[:0]
    acceleration = f.Zv @ b_dot + known + H @ u
    left = M @ (acceleration - H @ u) + others
    multipliers = np.linalg.lstsq(f.scale[:, None] * by_multipliers, -f.scale[:, None] * left, rcond=1e-12)[0]
    out = Reduced(np.vstack([a_dot, b_dot]), x, u, acceleration, multipliers, doubt=doubt)
    if f.Zv.shape == f.Z.shape:
        turned = (H - N) @ f.Z  # u = Z a' + turned a
        out.M = terms.mass
        out.D = Y.T @ (M @ turned + (M @ H + D) @ f.Z)
        out.K = Y.T @ ((M @ H + D) @ turned + K @ f.Z)
    return out


def without_inertia(name: str) -> ModelError:
    """The error that names what moves without inertia."""
    return ModelError(
        f"nothing with inertia moves along {name}: there is no linear equation of motion; give it a mass or a moment "
        f"of inertia"
    )


def _left(e: Equations, f: Free) -> np.ndarray:
    """Y (nv, fv) with Y^T dr/dl = 0, so that the multipliers drop out; Zv where no friction follows the reactions.

    Y is Zv less what the constraints' own directions C make up for: Y^T = Zv^T - Zv^T R (C^T R)^+ C^T.
    """
    F = np.zeros(f.rows.T.shape)
    F[:, : e.block("n").size] = e.by_reactions
    refuse_undetermined(e.state.c.structure, (f.rows * f.scale)[: e.block("n").size], e.by_reactions)
    R = f.scale[:, None] * (F - f.rows.T)
    C = span((f.rows * f.scale).T)
    Z = f.Zv / f.scale[:, None]
    return f.scale[:, None] * (Z - C @ (Z.T @ R @ np.linalg.pinv(C.T @ R, rcond=1e-12)).T)
