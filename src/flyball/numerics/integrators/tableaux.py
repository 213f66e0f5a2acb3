"""Explicit Runge-Kutta methods as data. A new method is a new entry of ``TABLEAUX``."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import NamedTuple

import numpy as np

from ...compiler.layout import Float1, Float2, Int1
from . import dop853

ASTRAY, BELOW = 1.6e-3, 0.2
"""The coefficients c7, c6 of dop853's dense output tell by how much it is off within a step at most: see `astray`.

For y' = lambda y that is 1.2e-3 c7, to a fifth, wherever h |lambda| is 1 to 6.5, whatever the argument of lambda; and
c7 is c6/3 from 2 on. Where the step is narrow for what the solution does c7/c6 is small, and it is about c8/256, c8
being c7^2/c6. The error estimate of the step does not see this: on the real axis, as h lambda goes to -6, the dense
output is off by 80 times that, where rk45's never is by 2.5 times.
"""


class Tableau(NamedTuple):
    """One explicit pair with dense output, all as arrays, so that one compiled loop serves every method.

    Stage i is f(t + c[i] h, y + h sum A[i, j] K[j]); the first ``order_i[1]`` stages make the step, the next is the
    derivative at its end, the rest are only for dense output. The interpolant is
    y(t + x h) = y + h sum_j K[j] sum_p P[j, p] x^(p + 1).
    """

    A: Float2  # (all stages, all stages)
    c: Float1  # (all stages,)
    E: Float2  # (2, all stages): two error estimates; the second damps the first (zero: not used)
    P: Float2  # (all stages, degree)
    D: Float2  # (2, all stages): error of the interpolant, and what damps it; zero where that of the step bounds it
    order_i: Int1  # order that the step control assumes, stages of a step, all stages


def _rk45() -> Tableau:
    """Dormand and Prince (1980), order 5(4), 6 stages; dense output of order 4 by Shampine (1986)."""
    stages = [
        [],
        [1 / 5],
        [3 / 40, 9 / 40],
        [44 / 45, -56 / 15, 32 / 9],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
        [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
    A = np.array([row + [0.0] * (7 - len(row)) for row in stages])
    c = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
    E = np.zeros((2, 7))
    E[0] = [-71 / 57600, 0, 71 / 16695, -71 / 1920, 17253 / 339200, -22 / 525, 1 / 40]
    P = np.array(
        [
            [1, -8048581381 / 2820520608, 8663915743 / 2820520608, -12715105075 / 11282082432],
            [0, 0, 0, 0],
            [0, 131558114200 / 32700410799, -68118460800 / 10900136933, 87487479700 / 32700410799],
            [0, -1754552775 / 470086768, 14199869525 / 1410260304, -10690763975 / 1880347072],
            [0, 127303824393 / 49829197408, -318862633887 / 49829197408, 701980252875 / 199316789632],
            [0, -282668133 / 205662961, 2019193451 / 616988883, -1453857185 / 822651844],
            [0, 40617522 / 29380423, -110615467 / 29380423, 69997945 / 29380423],
        ]
    )
    return Tableau(A, c, E, P, np.zeros((2, 7)), np.array([5, 6, 7], np.int64))


def _dop853() -> Tableau:
    """Order 8(5,3), 12 stages, dense output of order 7; its source is named in `dop853`."""
    s = len(dop853.C)
    A = np.array([_dense(row, s) for row in dop853.A])
    E = np.array([_dense(dop853.E5, s), _dense(dop853.E3, s)])
    # y + x (F0 + (1 - x) (F1 + x (F2 + (1 - x) (...)))): expanded into powers of x
    B, first, last = A[12], np.eye(s)[0], np.eye(s)[12]
    F = [B, first - B, 2 * B - first - last, *(_dense(row, s) for row in dop853.D)]
    total = np.zeros((s, 1))
    for i in range(len(F) - 1, -1, -1):
        total[:, 0] += F[i]
        factor = np.array([0.0, 1.0]) if i % 2 == 0 else np.array([1.0, -1.0])
        total = np.stack([np.convolve(row, factor) for row in total])
    P = np.ascontiguousarray(total[:, 1:])
    D = ASTRAY * np.stack([P[:, -1], BELOW * P[:, -2]])
    return Tableau(A, np.array(dop853.C), E, P, D, np.array([8, 12, s], np.int64))


def _dense(row: Mapping[int, float], length: int) -> np.ndarray:
    out = np.zeros(length)
    out[list(row)] = list(row.values())
    return out


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
