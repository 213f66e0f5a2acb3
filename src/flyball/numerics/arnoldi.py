"""The eigenvalue of largest modulus of a matrix of which only products are known, by Arnoldi's method.

Y. Saad, *Numerical Methods for Large Eigenvalue Problems*, 2nd edition (2011), section 6.2. Complex pairs, between
which the power method swings, are found as real ones are: exactly with as many products as the matrix has rows.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

NOTHING = 1e-10  # part of a product that is not in the space already: it is invariant


def largest(product: Callable[[np.ndarray], np.ndarray], start: np.ndarray, most: int) -> complex:
    """The Ritz value of largest modulus.

    Parameters
    ----------
    product : callable
        The matrix times a vector.
    start : numpy.ndarray
        A vector rich in what belongs to that eigenvalue; not zero.
    most : int
        Products.

    Returns
    -------
    complex
        Of a pair, either; zero if a product is not finite.
    """
    most = min(most, len(start))
    space, H = np.zeros((most + 1, len(start))), np.zeros((most + 1, most))
    space[0] = start / np.linalg.norm(start)
    for k in range(most):
        out = product(space[k])
        if not np.isfinite(out).all():
            return 0j
        size = np.linalg.norm(out)
        for _ in range(2):  # once more, for what rounding has left
            part = space[: k + 1] @ out
            H[: k + 1, k] += part
            out = out - part @ space[: k + 1]
        H[k + 1, k] = np.linalg.norm(out)
        if H[k + 1, k] <= NOTHING * size:
            most = k + 1
            break
        space[k + 1] = out / H[k + 1, k]
    values = np.linalg.eigvals(H[:most, :most])
    return complex(values[np.argmax(np.abs(values))])
