"""Which motions grow: the one way in which equilibria and modes judge it, and how root loci follow it.

Eigenvalues are told without what is rounding of them, each by what it is uncertain by itself
(`analysis/linear/spectrum.py`): a real part that is not zero is one.
"""

from __future__ import annotations

import numpy as np

BESIDE = 1e-8  # part of an eigenvalue within which a locus has it on the axis: nearer, crossings are not told apart


def growing(values: np.ndarray) -> np.ndarray:
    """Which eigenvalues belong to motions that grow, bool as ``values``."""
    return np.asarray(values).real > 0.0


def beyond_axis(values: np.ndarray) -> np.ndarray:
    """Which half plane each eigenvalue of a locus lies in: 1, -1, or 0 on the axis or just beside it, as ``values``."""
    w = np.asarray(values)
    return np.where(np.abs(w.real) > BESIDE * np.abs(w), np.sign(w.real), 0.0).astype(int)


def growth(values: np.ndarray, blur: np.ndarray, *, discrete: bool) -> float:
    """The largest growth: above zero if a motion grows, below if all decay, zero if that is open.

    Parameters
    ----------
    values : ndarray (n,) complex
        Eigenvalues.
    blur : ndarray (n,)
        What each is uncertain by.
    discrete : bool
        Whether they are multipliers from one instant to the next, which must not exceed 1 in size.
    """
    grows = values.real
    if discrete:
        grows = np.abs(values) - 1.0
        grows[np.abs(grows) <= blur] = 0.0
    return float(grows.max(initial=-1.0))
