"""Explicit Runge-Kutta methods as data. A new method is a new entry of ``TABLEAUX``."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np


class Tableau(NamedTuple):
    """One explicit pair with dense output, all as arrays, so that one compiled loop serves every method.

    Stage i is f(t + c[i] h, y + h sum A[i, j] K[j]); the first ``order_i[1]`` stages make the step, the next is the
    derivative at its end, the rest are only for dense output. The interpolant is
    y(t + x h) = y + h sum_j K[j] sum_p P[j, p] x^(p + 1).
    """

    A: np.ndarray  # (all stages, all stages)
    c: np.ndarray  # (all stages,)
    E: np.ndarray  # (2, all stages): two error estimates; the second damps the first (zero: not used)
    P: np.ndarray  # (all stages, degree)
    order_i: np.ndarray  # order that the step control assumes, stages of a step, all stages


def _rk45() -> Tableau:
    """Dormand and Prince (1980), order 5(4), 6 stages; numbers from SciPy."""
    from scipy.integrate import RK45

    A = np.zeros((7, 7))
    A[:6, :5] = RK45.A
    A[6, :6] = RK45.B
    E = np.zeros((2, 7))
    E[0] = RK45.E
    return Tableau(A, np.r_[RK45.C, 1.0], E, np.ascontiguousarray(RK45.P), np.array([5, 6, 7], np.int64))


def _dop853() -> Tableau:
    """Hairer, Norsett and Wanner (1993), order 8(5,3), 12 stages, dense output of order 7; numbers from SciPy."""
    from scipy.integrate import DOP853

    s = 16
    A = np.zeros((s, s))
    A[:12, :12] = DOP853.A[:12, :12]
    A[12, :12] = DOP853.B
    A[13:, :] = DOP853.A_EXTRA
    c = np.r_[DOP853.C, 1.0, DOP853.C_EXTRA]
    E = np.zeros((2, s))
    E[0, :13] = DOP853.E5
    E[1, :13] = DOP853.E3
    # y + x (F0 + (1 - x) (F1 + x (F2 + (1 - x) (...)))): expanded into powers of x
    B = np.zeros(s)
    B[:12] = DOP853.B
    first, last = np.eye(s)[0], np.eye(s)[12]
    F = [B, first - B, 2 * B - first - last, *DOP853.D]
    total = np.zeros((s, 1))
    for i in range(len(F) - 1, -1, -1):
        total[:, 0] += F[i]
        factor = np.array([0.0, 1.0]) if i % 2 == 0 else np.array([1.0, -1.0])
        total = np.stack([np.convolve(row, factor) for row in total])
    return Tableau(A, c, E, np.ascontiguousarray(total[:, 1:]), np.array([8, 12, s], np.int64))


TABLEAUX = {"dop853": _dop853, "rk45": _rk45}


@cache
def tableau(name: str) -> Tableau:
    """The method of that name.

    Raises
    ------
    ValueError
        If there is no such method; the message lists those there are.
    """
    if name not in TABLEAUX:
        raise ValueError(f"unknown integrator {name!r}; choose one of {', '.join(sorted(TABLEAUX))}")
    return TABLEAUX[name]()
