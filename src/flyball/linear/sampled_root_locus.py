"""Root loci of mechanisms with sampled controllers: multipliers of one cycle, and where they leave the unit circle.

A deviation is multiplied by the eigenvalues z of the matrix of one cycle (`sampling_cycle`); it dies away where all are
within the unit circle. A multiplier that crosses the circle at 1 belongs to a deviation that grows monotonically, at -1
to one that changes sign from cycle to cycle, elsewhere to an oscillation.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from ..errors import AnalysisError
from ..progress import ReportProgress
from ..results.modes import Crossing, RootLocus, outside_circle
from ..statics.equilibrium_series import series_error

ROOT_TOLERANCE = 1e-13  # relative to the interval between two values
ON_REAL_AXIS = 1e-9  # imaginary part, relative to the multiplier, that counts as none
MAX_BISECTIONS = 48

CycleMatrix = Callable[[float], np.ndarray]


def sampled_root_locus(done: RootLocus, points: np.ndarray, matrix: CycleMatrix, report: ReportProgress) -> RootLocus:
    """Complete a locus: branches of the multipliers at the values of the parameter, and the changes of stability.

    Parameters
    ----------
    done : RootLocus
        Without values; its ``period`` is that of one cycle.
    points : ndarray (m,)
        Values of the parameter.
    matrix : callable
        Returns the matrix of one cycle for a value.
    report : callable
    """
    rows: list[np.ndarray] = []
    for k, value in enumerate(points.tolist()):
        try:
            w = np.linalg.eigvals(matrix(value)).astype(complex)
            if rows and len(w) != len(rows[0]):
                raise AnalysisError(f"there are {len(w)} states, and {len(rows[0])} at the values before")
        except AnalysisError as error:
            raise series_error(done, value, error) from error
        rows.append(w[_continued(rows[-1], w)] if rows else w[np.lexsort((w.real, w.imag))])
        done.values, done.eigenvalues = points[: k + 1], np.array(rows)
        done.path_values, done.path = done.values, done.eigenvalues
        report(0.7 * (k + 1) / len(points), f"{value:.6g}")
    for a, b in pairwise(points.tolist()):
        try:
            done.crossings += _crossings(matrix, a, b)
        except AnalysisError as error:
            raise series_error(done, a, error) from error
    report(1.0, "")
    return done


def _continued(before: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Indices of the multipliers that continue those before, by the least sum of distances."""
    from scipy.optimize import linear_sum_assignment

    return linear_sum_assignment(np.abs(before[:, None] - w))[1]


def _crossings(matrix: CycleMatrix, a: float, b: float) -> list[Crossing]:
    """Changes of stability between two values, by bisection to intervals in which one branch crosses the circle."""
    out = []
    waiting = [(a, b, 0)]
    while waiting:
        a, b, depth = waiting.pop()
        here, there = (np.linalg.eigvals(matrix(x)) for x in (a, b))
        change = int(outside_circle(there).sum()) - int(outside_circle(here).sum())
        on = _continued(here, there)
        moved = np.flatnonzero(outside_circle(here) != outside_circle(there[on]))
        if not len(moved) or (change == 0 and depth == MAX_BISECTIONS):
            continue
        alone = len(moved) == 1 or (len(moved) == 2 and _is_pair(here[moved]) and _is_pair(there[on][moved]))
        if alone or depth == MAX_BISECTIONS:
            out.append(_located(matrix, (a, b), here[moved[np.argmax(here[moved].imag)]], change))
            continue
        middle = 0.5 * (a + b)
        waiting += [(middle, b, depth + 1), (a, middle, depth + 1)]
    return out


def _is_pair(w: np.ndarray) -> bool:
    return bool(abs(w[0] - w[1].conjugate()) <= ON_REAL_AXIS * abs(w[0]))


def _located(matrix: CycleMatrix, between: tuple[float, float], begin: complex, change: int) -> Crossing:
    """The value at which the branch that is ``begin`` at the first end crosses the unit circle."""
    from scipy.optimize import brentq

    a, b = between
    known = {a: begin}

    def distance(x: float) -> float:
        w = np.linalg.eigvals(matrix(x))
        near = known[min(known, key=lambda k: abs(k - x))]
        known[x] = complex(w[np.argmin(np.abs(w - near))])
        return abs(known[x]) - 1.0

    for part in np.linspace(0.0, 1.0, 9)[1:]:  # follow the branch, so that the nearest known multiplier is its own
        distance(a + part * (b - a))
    if distance(a) * distance(b) > 0.0:
        value = a
    else:
        value = float(brentq(distance, a, b, xtol=ROOT_TOLERANCE * abs(b - a), rtol=1e-14))
    distance(value)
    z = known[value]
    if abs(z.imag) > ON_REAL_AXIS * abs(z):
        return Crossing(value, complex(z.real, abs(z.imag)), "flutter", change)
    return Crossing(value, complex(z.real), "divergence" if z.real > 0.0 else "alternation", change)
