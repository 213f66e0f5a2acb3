"""What rounding may have made of the coefficients of linear equations.

Coefficients are sums of terms that often cancel: what ought to be nothing comes out as 1e-16 of what cancelled. Such
entries are not harmless. Eigenvalue solvers balance a matrix first (Parlett and Reinsch 1969), and entries of 1e-29
where there should be none lead them to scales at which everything else drowns (Watkins 2006, "A case where balancing is
harmful").
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .balance import acting
from .derivatives import Equations
from .free import Free

EXACT = 2e-14  # of the largest term of an equation: what is uncertain of its coefficients
LEAK = 1e-15  # of the largest term of the equations of the same bodies
SLOW = 1e-3  # of the speed that the terms would give if nothing cancelled: that of the fastest motion at least


class Terms(NamedTuple):
    """Sizes of what the coefficients of linear equations are sums of; n coordinates and velocities, p columns.

    Attributes
    ----------
    mass : ndarray (fv, fv)
        Mass matrix of the free velocities.
    rates : ndarray (f, p)
        In the rates of the free coordinates.
    forces : ndarray (nv, p)
        In the equations of motion.
    Y, M : ndarray (nv, fv), (nv, nv)
        Directions along which the multipliers drop out; mass matrix.
    """

    mass: np.ndarray
    rates: np.ndarray
    forces: np.ndarray
    Y: np.ndarray
    M: np.ndarray


class Doubt(NamedTuple):
    """What is uncertain of a matrix: A + by X with any X no entry of which is larger than that of ``size``, (n, n)."""

    by: np.ndarray
    size: np.ndarray


def without_rounding(
    terms: Terms, a_dot: np.ndarray, forces: np.ndarray, e: Equations, f: Free, off: np.ndarray | None = None
) -> Doubt:
    """Set coefficients that are rounding to 0, and say what is uncertain of the others.

    The entries of an equation are compared in units of the coordinates' natural sizes, rates at the speed of the
    fastest motion: the terms that cancel in one column are rounded as those that do not in another. What acts on a body
    along one axis shows along the others by the rounding of its directions.

    Parameters
    ----------
    terms : Terms
        Its mass matrix loses its rounding, too.
    a_dot : ndarray (f, p)
        Rates of the free coordinates.
    forces : ndarray (fv, p)
        What acts along the directions in which the multipliers drop out.
    off : ndarray (nv,), optional
        Large speeds of what has a size of its own, because it stands for something else; 0 of all others.
    """
    (a, fv), nv = (len(a_dot), len(forces)), len(f.scale)
    n = a + fv
    scale, along = np.r_[f.scale[f.chosen], f.scale[f.chosen_v]], np.abs(terms.Y).T
    inertia = np.sqrt(np.maximum(np.abs(np.diag(terms.mass)), 1e-300))
    terms.mass[np.abs(terms.mass) <= EXACT * np.outer(inertia, inertia)] = 0.0
    inverse = np.linalg.inv(terms.mass) if fv else terms.mass
    turned = _spread(acting(e), terms.M, e, f.scale)  # by a radian, or a length
    unit = scale.copy()
    large = np.zeros(fv) if off is None else off[f.chosen_v]
    if fv:
        A = np.abs(inverse @ forces[:, :n]) / scale[a:, None] * scale
        most = np.hstack([along @ terms.forces[:, :n] * scale, (along @ turned)[:, None]])
        moves = np.r_[np.ones(a, bool), large == 0.0]
        uncancelled = most / inertia[:, None] ** 2 / scale[a:, None]
        pushed = float((A[moves[a:]][:, ~moves] / scale[~moves] * large[large > 0.0]).max(initial=0.0))
        fastest = _fastest(A[moves[a:]][:, moves], uncancelled[moves[a:]][:, np.r_[moves, True]], a, pushed)
        unit[a:] = np.where(large > 0.0, large, fastest * unit[a:])
    rows = (terms.forces[:, :n] * unit).max(axis=1, initial=0.0) if n else np.zeros(nv)
    first = EXACT * (terms.rates[:, :n] * unit).max(axis=1, initial=0.0)
    second = along @ (EXACT * rows + LEAK * (_spread(rows, terms.M, e, f.scale) + turned))
    size = np.r_[first, second][:, None] / unit
    for own, least in ((a_dot[:, :n], size[:a]), (forces[:, :n], size[a:])):
        own[np.abs(own) <= least] = 0.0
    by = np.eye(n)
    by[a:, a:] = inverse
    return Doubt(by, size)


def _fastest(A: np.ndarray, uncancelled: np.ndarray, a: int, pushed: float) -> float:
    """Rate [1/s] of the fastest motion, from accelerations and what cancels in them, (fv, n), in natural units.

    ``pushed`` are accelerations by what has a size of its own: where nothing else acts all other is rounding.
    """

    def rate(by_position: np.ndarray, by_velocity: np.ndarray) -> float:
        return max(float(np.sqrt(by_position.max(initial=0.0))), float(by_velocity.max(initial=0.0)))

    n = A.shape[1]
    static = np.hstack([uncancelled[:, :a], uncancelled[:, n:]])
    return max(rate(A[:, :a], A[:, a:]), SLOW * rate(static, uncancelled[:, a:n]), np.sqrt(pushed)) or 1.0


def _spread(rows: np.ndarray, M: np.ndarray, e: Equations, scale: np.ndarray) -> np.ndarray:
    """The largest of what acts on the bodies that the mass matrix couples with each, as seen from each velocity."""
    from scipy.sparse.csgraph import connected_components

    nv = e.state.c.structure.tables["tree"].nv
    body = np.repeat(np.arange(len(nv)), nv)
    _, part = connected_components((M != 0.0) | (body[:, None] == body), directed=False)
    most = np.zeros(part.max(initial=-1) + 1)
    np.maximum.at(most, part, rows * scale)
    return most[part] / scale
