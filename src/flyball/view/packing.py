"""Poses of many bodies, and contact forces, as small whole numbers that follow one another in time.

Positions are steps of a grid; orientations are rotation vectors, steps of 2 pi / 65535; forces are square roots of what
they are of the largest one. Of poses it is written how each number differs from that of the time before (modulo the
width of the integer): a body at rest costs nothing once compressed. The page undoes it: `packed.js`, `touches.js`.
"""

from __future__ import annotations

import numpy as np

FINE = 1e-3  # step of positions over the size of a body: less than a pixel
NARROW, WIDE = 2**16, 2**32
NOWHERE = 0  # in x: this body is not drawn


def positions(p: np.ndarray, size: float) -> tuple[np.ndarray, dict[str, object]]:
    """Differences of positions (n, m, 3) on a grid that is fine for bodies of a size, and what undoes them.

    Returns whole numbers, time by time, x of all, then y, then z; and ``low``, ``step``, ``type``.
    """
    gone = ~np.isfinite(p).all(axis=2)
    inside = p[~gone]
    low = inside.min(axis=0) if len(inside) else np.zeros(3)
    extent = float((inside.max(axis=0) - low).max()) if len(inside) else 0.0
    step = max(FINE * size, extent / (WIDE - 3.0))
    kind = "u2" if extent / step < NARROW - 2.0 else "u4"
    grid = np.rint(np.where(gone[:, :, None], 0.0, p - low) / step) + 1.0
    grid[gone] = NOWHERE
    about = {"low": [float(x) for x in low - step], "step": step}
    return _differences(grid.astype(np.int64), WIDE if kind == "u4" else NARROW), about | {"type": kind}


def orientations(q: np.ndarray) -> np.ndarray:
    """Differences of rotation vectors of quaternions (n, m, 4), as `positions` has them."""
    q = np.where(np.isfinite(q).all(axis=2)[:, :, None], q, (1.0, 0.0, 0.0, 0.0))
    q = q * np.where(q[:, :, :1] < 0.0, -1.0, 1.0)
    sine = np.sqrt((q[:, :, 1:] ** 2).sum(axis=2))
    angle = 2.0 * np.arctan2(sine, q[:, :, 0])
    per = np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 2.0)
    turn = q[:, :, 1:] * per[:, :, None]
    return _differences(np.rint(turn * ((NARROW - 1) / (2.0 * np.pi))).astype(np.int64), NARROW)


def _differences(grid: np.ndarray, width: int) -> np.ndarray:
    """What each time adds to the one before, components of all bodies one after the other."""
    change = np.diff(grid, axis=0, prepend=np.zeros_like(grid[:1])) % width
    return change.transpose(0, 2, 1).reshape(-1)


def rooted(force: np.ndarray) -> tuple[np.ndarray, float]:
    """Forces (k, 3) as whole numbers 0 to 65534, the square roots of their parts of the largest, and that [N]."""
    force = np.where(np.isfinite(force), force, 0.0)
    largest = float(np.abs(force).max(initial=0.0))
    part = np.sign(force) * np.sqrt(np.abs(force) / largest) if largest > 0.0 else force
    return np.rint(32767.0 * (part + 1.0)).astype(np.int64), largest
