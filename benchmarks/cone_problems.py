"""Cone problems of one time step: stacks of cubes, a settled pile of balls, a chain of links that lies on the ground.

For `solvers.py`. Friction 0.5 (pile: 0.3), step 5 ms, all from rest; the pile is let fall for 1.5 s first.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from flyball.numerics.complementarity.contact_operator import find_columns
from flyball.numerics.complementarity.contact_problem import (
    ContactProblem,
    allocate_solver,
    empty_problem,
    solve_contacts,
)
from flyball.numerics.complementarity.gauss_seidel import gauss_seidel

STEP, GRAVITY = 5e-3, 9.81
RADIUS, DENSITY = 0.1, 1000.0


def frames(normals: np.ndarray) -> np.ndarray:
    """Normals with two tangents each."""
    other = np.where(abs(normals[:, :1]) < 0.7, [[1.0, 0, 0]], [[0, 1.0, 0]])
    t = np.cross(normals, other)
    t /= np.linalg.norm(t, axis=1)[:, None]
    return np.hstack([normals, t, np.cross(normals, t)])


def stack(masses: list[float]) -> tuple[ContactProblem, np.ndarray, np.ndarray]:
    """Cubes of 1 m on one another; problem, velocities of nodes, of groups."""
    n = len(masses)
    P = empty_problem(4 * n, n)
    for i, m in enumerate(masses):
        P.node[i] = 1 / m, *[6 / m] * 3, 0, 0, 0, 1
        for k, (x, y) in enumerate(((-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5))):
            P.at[4 * i + k] = i - 1, i
            P.arm[4 * i + k] = x, y, 0.5, x, y, -0.5
    P.frame[:], P.mu[:] = (0, 0, 1, 1, 0, 0, 0, 1, 0), 0.5
    v = np.zeros((n, 8))
    v[:, 2] = -STEP * GRAVITY
    return P, v, np.zeros(0)


def touching(x: np.ndarray, half: float, reach: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Balls near to one another and to floor and walls: sides, normals, gaps."""
    pairs = np.array(sorted(cKDTree(x).query_pairs(2 * RADIUS + reach))).reshape(-1, 2)
    d = x[pairs[:, 1]] - x[pairs[:, 0]]
    length = np.linalg.norm(d, axis=1)
    at, normal, gap = [pairs], [d / length[:, None]], [length - 2 * RADIUS]
    for axis, sign, place in ((2, 1, 0.0), (0, 1, half), (0, -1, half), (1, 1, half), (1, -1, half)):
        g = sign * x[:, axis] + place - RADIUS
        near = np.flatnonzero(g < reach)
        at.append(np.column_stack([np.full(len(near), -1), near]))
        normal.append(np.tile(sign * np.eye(3)[axis], (len(near), 1)))
        gap.append(g[near])
    return np.vstack(at), np.vstack(normal), np.concatenate(gap)


def balls(x: np.ndarray, half: float) -> tuple[ContactProblem, np.ndarray]:
    """The contacts of balls at these places, and their gaps."""
    at, normal, gap = touching(x, half, 0.02 * RADIUS)
    P = empty_problem(len(at), len(x))
    m = DENSITY * 4 / 3 * np.pi * RADIUS**3
    P.node[:] = 1 / m, *[1 / (0.4 * m * RADIUS**2)] * 3, 0, 0, 0, 1
    P.at[:], P.frame[:], P.mu[:] = at, frames(normal), 0.3
    P.arm[:, :3], P.arm[:, 3:] = RADIUS * normal, -RADIUS * normal
    P.bias[:, 0] = np.maximum(gap, 0) / STEP
    return P, gap


def pile(count: int = 1000, time: float = 1.5) -> tuple[ContactProblem, np.ndarray, np.ndarray]:
    """Balls let fall into a box: velocities first, overlaps by a second solve without friction."""
    side = round(count ** (1 / 3))
    pitch, rng = 2.2 * RADIUS, np.random.default_rng(0)
    grid = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), -1).reshape(-1, 3)[:count]
    x = (grid - [(side - 1) / 2, (side - 1) / 2, 0]) * pitch + [0, 0, RADIUS + 0.02]
    x[:, :2] += rng.uniform(-0.1, 0.1, (count, 2)) * RADIUS
    half, v, known = 0.5 * pitch * side + 0.01, np.zeros((count, 8)), (np.zeros(0, int), np.zeros((0, 3)))
    for _ in range(round(time / STEP)):
        P, gap = balls(x, half)
        X, W, O, F = allocate_solver(P)
        v[:, 2] -= STEP * GRAVITY
        key = (P.at[:, 0] + 1) * 6 * count + P.at[:, 1] * 6 + np.argmax(P.frame[:, :3], 1) * (P.at[:, 0] < 0)
        known = warm(X.p, P.frame, key, known)
        X.v[:], O.count.most, O.real.enough, O.count.coulomb = v, 50, 1e-4, 1
        solve_contacts(gauss_seidel, P, X, W, O, F)
        v, known = X.v.copy(), (key, world(X.p, P.frame))
        moved = allocate_solver(P)[0]
        i, j = P.at[:, 0], P.at[:, 1]
        rate = ((v[j, :3] - v[i, :3] * (i >= 0)[:, None]) * P.frame[:, :3]).sum(1)
        P.bias[:, 0], P.mu[:] = gap / STEP + rate, 0.0
        O.count.coulomb = 0
        solve_contacts(gauss_seidel, P, moved, W, O, F)
        x += STEP * (v[:, :3] + moved.v[:, :3])
    P, _ = balls(x, half)
    v[:, 2] -= STEP * GRAVITY
    return P, v, np.zeros(0)


def world(p: np.ndarray, frame: np.ndarray) -> np.ndarray:
    """Impulses as vectors in the world."""
    return np.einsum("ck,ckx->cx", p, frame.reshape(-1, 3, 3))


def warm(p: np.ndarray, frame: np.ndarray, key: np.ndarray, known: tuple[np.ndarray, np.ndarray]) -> tuple:
    """Start impulses from those of the same pairs a step before."""
    if len(known[0]):
        order = np.argsort(known[0])
        at = np.searchsorted(known[0][order], key).clip(max=len(order) - 1)
        same = known[0][order][at] == key
        p[same] = np.einsum("cx,ckx->ck", known[1][order][at[same]], frame[same].reshape(-1, 3, 3))
        p[:, 0] = np.maximum(p[:, 0], 0)
    return known


def chain(links: int = 20, tip: float = 100.0) -> tuple[ContactProblem, np.ndarray, np.ndarray]:
    """Rods of 1 kg and 1 m by spherical joints, zigzag, ends on the ground; the last weighs ``tip`` times as much."""
    n = 6 * links
    mass = np.ones(links)
    mass[-1] = tip
    inverse = np.zeros((n, n))
    turn = 0.6 * (-1.0) ** np.arange(links)
    along = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(links)])
    for i in range(links):
        a = along[i]
        inertia = mass[i] / 12 * (np.eye(3) - np.outer(a, a)) + mass[i] * 1e-3 * np.eye(3)
        inverse[6 * i : 6 * i + 3, 6 * i : 6 * i + 3] = np.eye(3) / mass[i]
        inverse[6 * i + 3 : 6 * i + 6, 6 * i + 3 : 6 * i + 6] = np.linalg.inv(inertia)

    def point(i: int, arm: np.ndarray) -> np.ndarray:
        """Velocities of a point of link i."""
        J = np.zeros((3, n))
        J[:, 6 * i : 6 * i + 3] = np.eye(3)
        J[:, 6 * i + 3 : 6 * i + 6] = [[0, arm[2], -arm[1]], [-arm[2], 0, arm[0]], [arm[1], -arm[0], 0]]
        return J

    G = np.vstack([point(i, along[i] / 2) - point(i + 1, -along[i + 1] / 2) for i in range(links - 1)])
    inverse -= inverse @ G.T @ np.linalg.solve(G @ inverse @ G.T, G @ inverse)
    P = empty_problem(2 * links, 0, 1, 0, 2 * links * 3 * n)
    P.group[1] = n
    q = np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]])
    for c in range(2 * links):
        i, end = divmod(c, 2)
        J = q @ point(i, along[i] * (end - 0.5) + [0, 0, -0.03])
        P.at[c], P.block[c] = (-1, -2), (-1, 3 * n * c)
        P.J[3 * n * c : 3 * n * (c + 1)], P.Y[3 * n * c : 3 * n * (c + 1)] = J.ravel(), (J @ inverse).ravel()
        find_columns(P, 3 * n * c, n, 3)
    P.frame[:], P.mu[:] = q.ravel(), 0.5
    wide = np.tile([0.3, 0, -STEP * GRAVITY, 0, 0, 0], links)
    return P, np.zeros((0, 8)), wide  # all alike: the joints are fulfilled
