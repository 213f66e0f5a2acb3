"""What slides of several places that cannot all hold, and which way, where redundancy leaves open who carries what.

Accelerations are unique all the same: of all that the closed gaps allow they make

    |w - w_d|^2 / 2 + sum reach_i |u_i|,    u = b + B w,   A = B B^T

least (Gauss's principle with friction: Moreau 1963), w being the change of the accelerations in the metric of the
masses. |u| is rounded off, less and less; what friction can hold follows the loads, which are found in turns with it.
"""

from __future__ import annotations

import numpy as np

from ....numerics.cone.dense.problem import DRIVEN, GRIPS, HOLDS, PUSHES, TURNS, Dense

SINGULAR = 1e-9  # of the largest eigenvalue
ROUND = 1e-11  # of the largest acceleration: how far |u| is rounded off at the end
SHARPER = 0.1
NEWTON = 60
LOADS = 60  # times that loads and what slides are found in turns
SETTLED = 1e-10


def accelerations(P: Dense) -> tuple[np.ndarray, np.ndarray] | None:
    """Accelerations u and forces x of all rows where what pushes stays closed; None if it cannot or is not found."""
    d = np.sqrt(np.maximum(P.A.diagonal(), 1e-300))
    size, V = np.linalg.eigh(P.A / np.outer(d, d))
    kept = size > SINGULAR * size[-1]
    B = d[:, None] * V[:, kept] * np.sqrt(size[kept])
    held = np.flatnonzero((P.rule == HOLDS) | (P.rule == PUSHES))
    C = B[held] / d[held, None]
    first, _, rank, _ = np.linalg.lstsq(C, -P.b[held] / d[held], rcond=SINGULAR) if len(held) else (0.0, 0, 0, 0)
    free = np.linalg.svd(C)[2][rank:].T if len(held) else np.eye(B.shape[1])
    first = np.zeros(B.shape[1]) + first
    scale = np.abs(P.b / d).max()
    if len(held) and np.abs(C @ first + P.b[held] / d[held]).max() > 1e-7 * scale:
        return None
    pairs = [[i, i + 1] if P.rule[i] == TURNS else [i] for i in np.flatnonzero(np.isin(P.rule, (GRIPS, TURNS)))]
    driven = np.flatnonzero(P.rule == DRIVEN)
    x, z, soft = np.zeros(len(P.b)), np.zeros(free.shape[1]), scale
    for turn in range(LOADS):
        reach = np.maximum(P.const + P.gain @ x, 0.0)
        x[driven] = -P.lean[driven] * reach[driven]
        w_d = B[driven].T @ x[driven]
        soft = max(SHARPER * soft, ROUND * scale)
        old = x.copy()
        for soft_now in (soft,) if turn else _sharper(scale):
            soft = soft_now
            z = _least(P.b, B, (first, free, w_d), (pairs, reach, soft * d.mean()), z)
        w = first + free @ z
        u = P.b + B @ w
        for own in pairs:
            x[own] = -reach[own[0]] * u[own] / np.sqrt(u[own] @ u[own] + (soft * d.mean()) ** 2)
        rest = w - w_d - sum((B[own].T @ x[own] for own in pairs), np.zeros(len(w)))
        x[held] = np.linalg.lstsq(C.T, rest, rcond=SINGULAR)[0] / d[held] if len(held) else 0.0
        if np.abs((x - old) * d).max() <= SETTLED * np.abs(x * d).max():
            return u, x
    return None


def _sharper(scale: float) -> list[float]:
    """Roundings from coarse to fine."""
    out = [scale]
    while out[-1] > ROUND * scale:
        out.append(max(SHARPER * out[-1], ROUND * scale))
    return out


def _least(b: np.ndarray, B: np.ndarray, of: tuple, friction: tuple, z: np.ndarray) -> np.ndarray:
    """The z where it is least, by Newton's method."""
    (first, free, w_d), (pairs, reach, soft) = of, friction

    def value(z: np.ndarray) -> float:
        w = first + free @ z
        u = b + B @ w
        rubs = sum(reach[own[0]] * np.sqrt(u[own] @ u[own] + soft * soft) for own in pairs)
        return float(0.5 * (w - w_d) @ (w - w_d) + rubs)

    now = value(z)
    for _ in range(NEWTON):
        w = first + free @ z
        u, g, H = b + B @ w, w - w_d, np.eye(len(w))
        for own in pairs:
            rho = np.sqrt(u[own] @ u[own] + soft * soft)
            e = u[own] / rho
            g = g + reach[own[0]] * (B[own].T @ e)
            H += reach[own[0]] / rho * (B[own].T @ (np.eye(len(own)) - np.outer(e, e)) @ B[own])
        step = -np.linalg.solve(free.T @ H @ free, free.T @ g)
        part = 1.0
        while part > 1e-6 and value(z + part * step) > now:
            part *= 0.5
        if part <= 1e-6:
            break
        z = z + part * step
        less, now = now, value(z)
        if less - now <= 1e-15 * abs(now):
            break
    return z
