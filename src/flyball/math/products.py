"""Products of small matrices whose terms are added in order: the same bits for every kind of number, on every machine.

NumPy's own go through BLAS, which rounds some products and sums at once, others not, as the processor has it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .vec import mm, mv


def product(A: Any, B: Any) -> np.ndarray:
    """A B of matrices (..., 3, 3) and a vector (3,) or matrices (..., 3, k)."""
    if A.ndim == 2 and B.ndim == 1:
        return np.array(mv(A.ravel().tolist(), B.tolist()))
    if A.shape == B.shape == (3, 3):  # tuples take a tenth of the time of arrays
        return np.array(mm(A.ravel().tolist(), B.ravel().tolist())).reshape(3, 3)
    if "c" not in (A.dtype.kind, B.dtype.kind):
        return _terms(A, B)
    real = _terms(A.real, B.real) - (_terms(A.imag, B.imag) + 0.0)  # no zero changes its sign
    out = np.empty(real.shape, complex)  # NumPy multiplies complex arrays by their places in memory
    out.real, out.imag = real, _terms(A.real, B.imag) + _terms(A.imag, B.real) + 0.0
    return out


def _terms(A: Any, B: Any) -> Any:
    return A[..., 0:1] * B[..., 0:1, :] + A[..., 1:2] * B[..., 1:2, :] + A[..., 2:] * B[..., 2:, :]


def inner(a: Any, b: Any) -> Any:
    """The inner product of two vectors (3,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
