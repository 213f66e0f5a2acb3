"""What rounding may have made of the coefficients of linear equations.

Coefficients are sums of terms that often cancel: what ought to be nothing comes out as 1e-16 of what cancelled. Such
entries are not harmless. Eigenvalue solvers balance a matrix first (Parlett and Reinsch 1969), and entries of 1e-29
where there should be none lead them to scales at which everything else drowns (Watkins 2006, "A case where balancing is
harmful").
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...tables.system import NV
from .balance import acting
from .derivatives import Equations
from .free import Free

EXACT = 2e-14  # of the largest term of an equation: what is uncertain of its coefficients
LEAK = 1e-15  # of the largest term of the equations of the same bodies
SLOW = 1e-3  # of the speed that the terms would give if nothing cancelled: that of the fastest motion at least


class Terms(NamedTuple):
    """Sizes of what the coefficients of A are sums of.

    Attributes
    ----------
    rates : ndarray (f, n)
        In the rates of the free coordinates.
    forces : ndarray (nv, n)
        In the equations of motion.
    Y, M : ndarray (nv, fv), (nv, nv)
        Directions along which the multipliers drop out; mass matrix.
    """

    rates: np.ndarray
    forces: np.ndarray
    Y: np.ndarray
    M: np.ndarray


def uncertain(A: np.ndarray, e: Equations, f: Free, terms: Terms) -> np.ndarray:
    """What is uncertain of every entry of A, (n, n).

    A row's entries are compared in units of the coordinates' natural sizes, rates at the speed of the fastest motion:
    the terms of one equation that cancel in one column are rounded as those that do not in another. What acts on a body
    along one axis shows along the others by the rounding of its directions.
    """
    a, n = f.Z.shape[1], len(A)
    if n == a:
        return np.zeros_like(A)
    scale = np.r_[f.scale[f.chosen], f.scale[f.chosen_v]]
    inverse = np.abs(np.linalg.inv(terms.Y.T @ terms.M @ f.Zv)) @ np.abs(terms.Y).T
    unit = scale.copy()
    turned = _spread(acting(e), terms.M, e, f.scale)  # by a radian, or a length
    most = np.hstack([inverse @ terms.forces * scale, (inverse @ turned)[:, None]]) / scale[a:, None]
    unit[a:] *= _fastest(np.abs(A) / scale[:, None] * scale, most, a)
    rows = (terms.forces * unit).max(axis=1, initial=0.0)
    first = EXACT * (terms.rates * unit).max(axis=1, initial=0.0)
    second = inverse @ (EXACT * rows + LEAK * (_spread(rows, terms.M, e, f.scale) + turned))
    return np.r_[first, second][:, None] / unit


def _fastest(A: np.ndarray, uncancelled: np.ndarray, a: int) -> float:
    """Rate [1/s] of the fastest motion, from coefficients and what cancels in them, in natural units."""

    def rate(by_position: np.ndarray, by_velocity: np.ndarray) -> float:
        return max(float(np.sqrt(by_position.max(initial=0.0))), float(by_velocity.max(initial=0.0)))

    n = len(A)
    static = np.hstack([uncancelled[:, :a], uncancelled[:, n:]])
    return max(rate(A[a:, :a], A[a:, a:]), SLOW * rate(static, uncancelled[:, a:n])) or 1.0


def _spread(rows: np.ndarray, M: np.ndarray, e: Equations, scale: np.ndarray) -> np.ndarray:
    """The largest of what acts on the bodies that the mass matrix couples with each, as seen from each velocity."""
    from scipy.sparse.csgraph import connected_components

    body_i = e.state.c.structure.tables["body_i"]
    body = np.repeat(np.arange(len(body_i)), body_i[:, NV])
    _, part = connected_components((M != 0.0) | (body[:, None] == body), directed=False)
    most = np.zeros(part.max(initial=-1) + 1)
    np.maximum.at(most, part, rows * scale)
    return most[part] / scale
