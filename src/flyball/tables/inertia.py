"""Inverse of a body's inertia; where a principal inertia is none, of the inertia with a stand-in for it.

A body without mass has a stand-in for that too, a part of what the others weigh.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..math.scalar import real_parts
from ..math.vec import cross

THIN = 1e-9  # principal inertias below this part of the body's size count as none
STAND_IN = 1e-6  # what is put in their place while factoring


def usual_mass(masses: list[Any]) -> Any:
    """What a body weighs as a rule: the mean of those that weigh anything; 1 kg where none does."""
    heavy = [m for m in masses if m.real > 0.0]
    return sum(heavy) / len(heavy) if heavy else 1.0


def inverse_inertia(J: np.ndarray, size: Any, planar: bool) -> tuple[np.ndarray, np.ndarray]:
    """Inverse of an inertia, and what was added to it before.

    Parameters
    ----------
    J : (3, 3)
        Inertia about the centre of mass; complex if it carries a complex step.
    size : number
        Inertia that the body would have if it were compact; complex too.
    planar : bool
        Whether only the inertia about z counts.

    Returns
    -------
    inverse : (3, 3)
        Of ``J`` plus the excess; in the plane of the entry of z alone.
    excess : (3, 3)
        Brings principal inertias that are none up to ``STAND_IN`` times the size; else zero.
    """
    w, V = (np.diag(real_parts(J)), np.eye(3)) if planar else np.linalg.eigh(real_parts(J))
    used = np.array([not planar, not planar, True])
    weak = used & (w < THIN * size.real)
    more = np.where(weak, STAND_IN * size.real - w, 0.0)
    inverse = (V * np.where(used, 1.0 / np.where(used, w + more, 1.0), 0.0)) @ V.T
    excess = (V * more) @ V.T
    if J.dtype == object:
        return _of_expressions(J + excess, used), excess
    if not (np.iscomplexobj(J) or isinstance(size, complex)):
        return inverse, excess
    d_excess = _rate_of_excess(J, size, w, V, weak) if weak.any() else np.zeros((3, 3))
    return inverse - 1j * inverse @ (J.imag + d_excess) @ inverse, excess + 1j * d_excess


def _of_expressions(J: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Inverse by cofactors, for numbers that LAPACK does not know; in the plane of the entry of z alone."""
    if not used[0]:
        out = np.zeros((3, 3), object)
        out[2, 2] = 1.0 / J[2, 2]
        return out
    rows = [np.array(cross(J[:, (k + 1) % 3], J[:, (k + 2) % 3])) for k in range(3)]
    return np.array(rows) / (J[:, 0] @ rows[0])


def _rate_of_excess(J: np.ndarray, size: Any, w: np.ndarray, V: np.ndarray, weak: np.ndarray) -> np.ndarray:
    """Imaginary part of size STAND_IN P - P J P, P the projector onto the directions without inertia.

    P turns as these do: dP = sum of (v_i v_j^T + v_j v_i^T) (v_i . dJ v_j) / (w_i - w_j) over v_i in it and v_j not
    in it (Kato, *Perturbation Theory for Linear Operators*, 1966, chapter II).
    """
    dJ, P = J.imag, V[:, weak] @ V[:, weak].T
    between = weak[:, None] & ~weak
    gap = w[:, None] - w  # none in the plane, where x and y count as without inertia; nothing leads to them there
    C = np.where(between, V.T @ dJ @ V / np.where(gap == 0.0, 1.0, gap), 0.0)
    dP = V @ (C + C.T) @ V.T
    across = dP @ J.real @ P
    return STAND_IN * (size.imag * P + size.real * dP) - P @ dJ @ P - across - across.T
