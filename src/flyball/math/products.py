"""Products of small matrices whose terms are added in order: the same bits for every kind of number, on every machine.

NumPy's own go through BLAS, which rounds some products and sums at once, others not, as the processor has it.
"""

from __future__ import annotations

from typing import Any

import numpy as np


def product(A: Any, B: Any) -> np.ndarray:
    """A B of matrices (..., 3, 3) and a vector (3,) or matrices (..., 3, k)."""
    if A.ndim == 2 and B.ndim == 1:
        x, y, z = B.tolist()
        return np.array([a * x + b * y + c * z for a, b, c in A.tolist()])
    if A.ndim == 2 and B.ndim == 2:
        columns = list(zip(*B.tolist(), strict=True))
        return np.array([[a * x + b * y + c * z for x, y, z in columns] for a, b, c in A.tolist()])
    terms = (A[..., :, k, None] * B[..., None, k, :] for k in range(3))
    return next(terms) + next(terms) + next(terms)


def inner(a: Any, b: Any) -> Any:
    """The inner product of two vectors (3,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
