"""Explicit Runge-Kutta methods of a user's own, as data."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import numpy as np

from ...errors import ModelError
from .tableaux import TABLEAUX, Tableau

OF_ORDER: dict[int, list[tuple[str, float, Callable[[np.ndarray, np.ndarray, np.ndarray], float]]]] = {
    1: [("sum b_i", 1.0, lambda A, b, c: b.sum())],
    2: [("sum b_i c_i", 1 / 2, lambda A, b, c: b @ c)],
    3: [("sum b_i c_i^2", 1 / 3, lambda A, b, c: b @ c**2), ("sum b_i a_ij c_j", 1 / 6, lambda A, b, c: b @ A @ c)],
    4: [
        ("sum b_i c_i^3", 1 / 4, lambda A, b, c: b @ c**3),
        ("sum b_i c_i a_ij c_j", 1 / 8, lambda A, b, c: (b * c) @ A @ c),
        ("sum b_i a_ij c_j^2", 1 / 12, lambda A, b, c: b @ A @ c**2),
        ("sum b_i a_ij a_jk c_k", 1 / 24, lambda A, b, c: b @ A @ A @ c),
    ],
}
"""Order conditions: Hairer, Norsett and Wanner, *Solving Ordinary Differential Equations I* (1993), table II.2.1."""
ROUNDING = 1e-10  # of coefficients that are given as decimals


def runge_kutta(
    name: str,
    A: Sequence[Sequence[float]],
    b: Sequence[float],
    order: int,
    *,
    embedded: Sequence[float] | None = None,
    dense: Sequence[Sequence[float]] | None = None,
) -> None:
    """Define an explicit Runge-Kutta method: ``simulate(method=name)`` then uses it.

    Parameters
    ----------
    name : str
    A : s rows
        Row i holds the coefficients of the stages before stage i; a row may be shorter than s. The sums of the rows are
        the parts c_i of the step at which the stages are.
    b : s numbers
        Weights of the stages.
    order : int
        Order of accuracy. The order conditions up to 4 are checked.
    embedded : s or s + 1 numbers, optional
        Weights of a second solution of one order less, whose difference is the error that the width of steps is
        controlled by; the number s + 1 is of the derivative at the end of the step. Without it, ``simulate`` needs
        ``step=``.
    dense : s + 1 rows, optional
        For the state at a part x of a step: coefficients of x, x^2, ... of each stage, and of the derivative at the
        end. Not given: cubic Hermite interpolation, for an order of 4 at most.

    Raises
    ------
    ModelError
        If the name is taken, or the numbers are no such method.
    """
    who = f"Runge-Kutta method {name!r}"
    s = len(b)
    rows = [np.asarray(row, float) for row in A]
    if len(rows) != s or any(len(row) > s or row[i:].any() for i, row in enumerate(rows)):
        raise ModelError(f"{who}: A must have {s} rows, one for each weight of b, with zeros on and above the diagonal")
    matrix = np.array([np.pad(row, (0, s - len(row))) for row in rows]).reshape(s, s)
    weights, c = np.asarray(b, float), matrix.sum(axis=1)
    _check_order(who, matrix, weights, order, order)
    E = np.zeros((2, s + 1))
    if embedded is not None:
        if len(embedded) not in (s, s + 1):
            raise ModelError(f"{who}: embedded must have {s} or {s + 1} numbers, got {len(embedded)}")
        other = np.pad(np.asarray(embedded, float), (0, s + 1 - len(embedded)))
        whole = np.pad(np.vstack([matrix, weights]), ((0, 0), (0, 1)))
        _check_order(f"{who}, embedded", whole, other, order - 1, order)
        E[0] = np.append(weights, 0.0) - other
    full = np.pad(np.vstack([matrix, weights]), ((0, 0), (0, 1)))
    P = _hermite(who, weights, order) if dense is None else np.array(dense, float)
    if P.ndim != 2 or len(P) != s + 1 or not np.allclose(P.sum(axis=1), [*weights, 0.0], rtol=0.0, atol=ROUNDING):
        raise ModelError(f"{who}: dense must have {s + 1} rows whose sums are the weights b, and 0")
    sizes = np.array([order, s, s + 1], np.int64)
    made = Tableau(full, np.append(c, 1.0), E, np.ascontiguousarray(P), np.zeros((2, s + 1)), sizes)
    known = TABLEAUX.get(name)
    if name in RESERVED or (known is not None and not _same(known(), made)):
        raise ModelError(f"{who}: there is another method of that name; give it another")
    TABLEAUX[name] = lambda: made


RESERVED = (*TABLEAUX, "auto", "radau", "generalised-alpha", "variational", "impulse")


def _check_order(who: str, A: np.ndarray, b: np.ndarray, order: int, most: int) -> None:
    """Refuse weights that do not have an order of ``order``."""
    if not isinstance(most, int) or most < 1:
        raise ModelError(f"{who}: order must be a whole number from 1 on, got {most!r}")
    c = A.sum(axis=1)
    for name, value, of in itertools.chain.from_iterable(OF_ORDER.get(k, []) for k in range(1, order + 1)):
        if not abs(of(A, b, c) - value) <= ROUNDING:
            raise ModelError(f"{who}: for order {order} {name} must be {value:.6g}, and is {of(A, b, c):.6g}")


def _hermite(who: str, b: np.ndarray, order: int) -> np.ndarray:
    """Cubic interpolation through the states and derivatives at both ends of a step."""
    if order > 4:
        raise ModelError(f"{who}: of an order above 4 give dense=..., as cubic interpolation would be less accurate")
    P = np.outer(np.append(b, 0.0), [0.0, 3.0, -2.0])
    P[0] += 1.0, -2.0, 1.0
    P[-1] += 0.0, -1.0, 1.0
    return P


def _same(a: Tableau, b: Tableau) -> bool:
    return all(x.shape == y.shape and (x == y).all() for x, y in zip(a, b, strict=True))
