"""Radau IIA of three stages, order 5: its numbers (Hairer and Wanner, *Solving ODEs II*, 1996, sections IV.5 and IV.8).

Stage values Z satisfy Z' = A^-1 Z / h at the places C. A^-1 has one real eigenvalue GAMMA and a pair ALPHA +- i BETA:
with T^-1 A^-1 T in real blocks the Newton systems of three stages are one real and one complex system of one stage.
"""

from __future__ import annotations

import numpy as np

_ROOT = 6.0**0.5
C = ((4.0 - _ROOT) / 10.0, (4.0 + _ROOT) / 10.0, 1.0)
_A = np.array(
    [
        [(88 - 7 * _ROOT) / 360, (296 - 169 * _ROOT) / 1800, (-2 + 3 * _ROOT) / 225],
        [(296 + 169 * _ROOT) / 1800, (88 + 7 * _ROOT) / 360, (-2 - 3 * _ROOT) / 225],
        [(16 - _ROOT) / 36, (16 + _ROOT) / 36, 1 / 9],
    ]
)


def _rows(M: np.ndarray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(map(float, row)) for row in M)


def _blocks() -> tuple[float, complex, np.ndarray]:
    """Real eigenvalue of A^-1, the complex one, and T: columns u, Re w, Im w of the eigenvectors."""
    values, vectors = np.linalg.eig(np.linalg.inv(_A))
    k = int(np.argmin(np.abs(values.imag)))
    m = int(np.argmax(values.imag))
    u, w = vectors[:, k].real, vectors[:, m] / vectors[2, m]
    return float(values[k].real), complex(values[m]), np.column_stack([u / u[2], w.real, w.imag])


GAMMA, _pair, _T = _blocks()
ALPHA, BETA = _pair.real, _pair.imag
A = _rows(_A)
INVERSE = _rows(np.linalg.inv(_A))
T = _rows(_T)
T_INVERSE = _rows(np.linalg.inv(_T))
ERROR = (-(13.0 + 7.0 * _ROOT) / 3.0, (-13.0 + 7.0 * _ROOT) / 3.0, -1.0 / 3.0)
"""Of the error estimate: (GAMMA M - h J) err = h f(t0, y0) + M (ERROR . Z)."""
THROUGH_START = _rows(np.linalg.inv(np.array([[c, c**2, c**3] for c in C])))
"""Coefficients of x, x^2, x^3 of the polynomial through 0 at x = 0 and stage values Z: rows times Z."""
THROUGH_STAGES = _rows(np.linalg.inv(np.array([[1.0, c, c**2] for c in C])))
"""Coefficients of 1, x, x^2 of the polynomial through values at the stages: rows times these."""
_NODES = np.array([0.0, *C])
BEND = tuple(float(1.0 / np.prod([a - b for b in _NODES if b != a])) for a in _NODES)
"""Weights of the third divided difference of values at the begin of a step and its stages: the cubic through all four
is the parabola through the stages and this times (x - c1) (x - c2) (x - 1)."""
BENT = tuple(np.polynomial.Polynomial.fromroots(C).integ().coef[1:].tolist())
"""Integral of (x - c1) (x - c2) (x - 1) from 0 to x, over x: coefficients of 1, x, x^2, x^3. It is 0 at 1 (Radau)."""
BENT_MOST = float(np.abs(np.polynomial.Polynomial.fromroots(C).integ()(np.linspace(0.0, 1.0, 1001))).max())
"""The most that it is within the step."""
