"""Integrators for an engine that has none: the classical Runge-Kutta method in Python, and SciPy's DOP853."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

Array = np.ndarray
Acceleration = Callable[[float, Array, Array], Array]  # of (t, q, v)
Run = tuple[Array, Array, float]


def runge_kutta(acceleration: Acceleration, t: float, q: Array, v: Array, h: float) -> tuple[Array, Array]:
    """One step of the classical method of order 4."""
    a1 = acceleration(t, q, v)
    v2 = v + h / 2 * a1
    a2 = acceleration(t + h / 2, q + h / 2 * v, v2)
    v3 = v + h / 2 * a2
    a3 = acceleration(t + h / 2, q + h / 2 * v2, v3)
    v4 = v + h * a3
    a4 = acceleration(t + h, q + h * v3, v4)
    return q + h / 6 * (v + 2 * v2 + 2 * v3 + v4), v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)


def fixed_steps(acceleration: Acceleration, q: Array, v: Array, t_end: float, steps: int, samples: int) -> Run:
    """So many steps of the classical method. Returns (coordinates, rates, CPU seconds); arrays of the samples only.

    Raises
    ------
    RuntimeError
        If the motion leaves what numbers can tell.
    """
    kept = set(np.linspace(0, steps, samples + 1).round().astype(int).tolist()) if samples else {-1}
    h = t_end / steps
    kept_q, kept_v = [], []
    begin = time.process_time()
    with np.errstate(all="ignore"):
        for k in range(steps + 1):
            if k in kept:
                if not np.isfinite(q).all():
                    raise RuntimeError("the motion has left the finite numbers")
                kept_q.append(q)
                kept_v.append(v)
            if k < steps:
                q, v = runge_kutta(acceleration, k * h, q, v, h)
    seconds = time.process_time() - begin
    return np.array(kept_q), np.array(kept_v), seconds


def controlled(acceleration: Acceleration, q: Array, v: Array, t_end: float, rtol: float, samples: int) -> Run:
    """SciPy's DOP853 with error control, atol a hundredth of rtol. Returns as ``fixed_steps`` does."""
    n = len(q)

    def rate(t: float, y: Array) -> Array:
        return np.concatenate([y[n:], acceleration(t, y[:n], y[n:])])

    times = np.linspace(0, t_end, samples + 1) if samples else [t_end]
    begin = time.process_time()
    s = solve_ivp(rate, (0.0, t_end), np.r_[q, v], "DOP853", times, rtol=rtol, atol=1e-2 * rtol)
    seconds = time.process_time() - begin
    if not s.success:
        raise RuntimeError(s.message)
    return s.y[:n].T, s.y[n:].T, seconds
