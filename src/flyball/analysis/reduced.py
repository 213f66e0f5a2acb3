"""The linear equations of motion with the constraints taken out: first order, and M, D, K where there is a second.

Perturbed, the equations of motion and the constraints at a state are, with x a change of position along the velocities
and u one of velocity, both co-moving (see ``steady``):

    x' + H x = u + N x,    M (u' + H u) + D u + K x - G^T l = -r_u d,    G x = -g_u d,    G u + V x = -n_u d

K holds everything that forces, inertia and *reactions* do when positions change: joint forces turn with the bodies, so
it is not the stiffness of the springs. With x = Z a and u = Zv b - G^+ V Z a the multipliers drop out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .derivatives import Equations
from .free import Free


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
    """

    turning: np.ndarray
    H: np.ndarray
    N: np.ndarray


@dataclass
class Reduced:
    """x' = A x of the independent changes x = (a, b), and how all others follow from them.

    Attributes
    ----------
    A : ndarray (n, n)
    position, velocity : ndarray (nv, n)
        Changes of all positions and velocities per unit of x.
    M, D, K : ndarray (f, f) or None
        M a'' + D a' + K a = 0 where all constraints are on positions.
    """

    A: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    M: np.ndarray | None
    D: np.ndarray | None
    K: np.ndarray | None
    mass: np.ndarray  # M along the velocities that are free


def reduced(e: Equations, f: Free, frame: Frame) -> Reduced:
    """Take the constraints out."""
    r = e.at["r"]
    M, D, K = (X[r].toarray() for X in (e.by_acceleration, e.by_velocity, e.by_position))
    V = np.vstack([e.by_position[e.at["n"]].toarray(), np.zeros((len(f.rows) - e.residual[e.at["n"]].size, len(M)))])
    Z, Zv, H = f.Z, f.Zv, frame.H
    P = -f.solve(V @ Z) if V.any() else np.zeros_like(Z)
    u = np.hstack([P, Zv])
    x = np.hstack([Z, np.zeros_like(Zv)])
    a_dot = f.left @ (u + (frame.N - H) @ x)
    mass = Zv.T @ M @ Zv
    forces = Zv.T @ (M @ (P @ a_dot) + (M @ H + D) @ u + K @ x)
    b_dot = -np.linalg.solve(mass, forces) if len(mass) else np.zeros((0, x.shape[1]))
    second: tuple = (None, None, None)
    if Zv.shape == Z.shape:
        turned = (H - frame.N) @ Z  # u = Z a' + turned a
        second = (
            Z.T @ M @ Z,
            Z.T @ (M @ turned + M @ H @ Z + D @ Z),
            Z.T @ (M @ H @ turned + D @ turned + K @ Z),
        )
    return Reduced(np.vstack([a_dot, b_dot]), x, u, *second, mass)
