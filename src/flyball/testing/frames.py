"""Frames in arbitrary motion, as the formulas of elements see them."""

from __future__ import annotations

from typing import Any

import numpy as np

Frame = dict[str, np.ndarray]
"""Position ``p``, rotation ``R``, angular velocity ``w``, velocity ``v``, and their rates ``alpha`` and ``a``."""


def random_motion(seed: int) -> list[Frame]:
    """Two frames with random poses, velocities and accelerations."""
    from scipy.spatial.transform import Rotation

    rng = np.random.default_rng(seed)
    keys = ("p", "w", "v", "alpha", "a")
    return [{"R": Rotation.random(random_state=rng).as_matrix()} | {k: rng.normal(size=3) for k in keys} for _ in "FM"]


def random_rotation(seed: int) -> np.ndarray:
    """A random rotation matrix."""
    return random_motion(seed)[0]["R"]


def record(m: Frame, dtype: Any = float) -> tuple[tuple[Any, ...], ...]:
    """The kinematic record of a frame."""
    return tuple(tuple(np.asarray(m[k], dtype).ravel().tolist()) for k in ("p", "R", "w", "v", "alpha", "a"))


def moved(m: Frame, t: float) -> Frame:
    """The frame after a time t of its motion, exact to second order."""
    from scipy.spatial.transform import Rotation

    turn = m["w"] * t + 0.5 * m["alpha"] * t * t
    return m | {
        "p": m["p"] + m["v"] * t + 0.5 * m["a"] * t * t,
        "R": Rotation.from_rotvec(turn).as_matrix() @ m["R"],
        "w": m["w"] + m["alpha"] * t,
        "v": m["v"] + m["a"] * t,
    }


def stepped(m: Frame, e: float) -> Frame:
    """The frame after an imaginary time i e of its motion: imaginary parts over e are rates."""
    w = m["w"]
    turn = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    return m | {
        "p": m["p"] + 1j * e * m["v"],
        "R": (np.eye(3) + 1j * e * turn) @ m["R"],
        "w": w + 1j * e * m["alpha"],
        "v": m["v"] + 1j * e * m["a"],
    }


def turned(m: Frame, Q: np.ndarray, d: np.ndarray) -> Frame:
    """The frame and its motion in a world that was turned by Q, then shifted by d."""
    return {"p": Q @ m["p"] + d, "R": Q @ m["R"]} | {k: Q @ m[k] for k in ("w", "v", "alpha", "a")}


def power(wrench: Any, F: Frame, M: Frame) -> Any:
    """Power of a force and a torque on M, and of the reverse on F's body at the same point."""
    f, t = (np.array(x) for x in wrench)
    d = M["p"] - F["p"]
    return f @ (M["v"] - F["v"] - np.cross(F["w"], d)) + t @ (M["w"] - F["w"])
