"""Functions of an angle that stay smooth through zero, because they are series in its square."""

from __future__ import annotations

from math import factorial

import numpy as np

from ..math.scalar import atan2

SERIES = 4.0  # squares of angles below this go by the series
TERMS = 13


def stumpff(s: np.ndarray) -> tuple[np.ndarray, ...]:
    """C0 to c5 of s = theta^2, where c_k(s) is the sum over n of (-s)^n / (k + 2 n)! (Stumpff 1959).

    c0 = cos(theta), c1 = sin(theta)/theta, c2 = (1 - cos(theta))/theta^2, c3 = (theta - sin(theta))/theta^3;
    c_{k+2} = (1/k! - c_k)/s, and dc_k/ds = (k c_{k+2} - c_{k+1})/2. Real or complex.
    """
    s = np.asarray(s)
    small = s.real < SERIES
    x = np.where(small, s, 0.0)
    c4, c5 = (_series(x, k) for k in (4, 5))
    c2, c3 = 0.5 - x * c4, 1 / 6 - x * c5
    low = (1 - x * c2, 1 - x * c3, c2, c3, c4, c5)
    if np.all(small):
        return low
    y = np.where(small, SERIES, s)
    r = np.sqrt(y)
    c0, c1, c2 = np.cos(r), np.sin(r) / r, 2 * np.sin(r / 2) ** 2 / y
    c3 = (1 - c1) / y
    high = (c0, c1, c2, c3, (0.5 - c2) / y, (1 / 6 - c3) / y)
    return tuple(np.where(small, a, b) for a, b in zip(low, high))


def _series(x: np.ndarray, k: int) -> np.ndarray:
    total = np.full_like(x, 1 / factorial(k + 2 * TERMS))
    for n in reversed(range(TERMS)):
        total = 1 / factorial(k + 2 * n) - x * total
    return total


def arc(e: np.ndarray) -> np.ndarray:
    """(..., 1) factors theta / sin(theta/2) of unit quaternions with scalar part >= 0; smooth at no rotation."""
    w, v = e[..., :1], e[..., 1:]
    square = (v * v).sum(axis=-1, keepdims=True)
    small = square.real < 1e-3
    t = np.where(small, square / np.where(small, w, 1.0) ** 2, 0.0)  # tan^2(theta/2)
    series = np.zeros_like(t)
    for n in reversed(range(8)):
        series = 1 / (2 * n + 1) - t * series
    size = np.sqrt(np.where(small, 1.0, square))
    return np.where(small, 2 * series / np.where(small, w, 1.0), 2 * atan2(size, w) / size)
