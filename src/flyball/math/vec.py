"""Three-vectors, 3 x 3 matrices (row by row) and quaternions (scalar first) as plain tuples; small products.

Tuples of numbers, not small arrays: the compiler keeps them in registers, and the same source runs on complex
numbers, on arrays over time and on symbols.

Products of small NumPy matrices add their terms in order: the same bits for every kind of number, on every machine.
NumPy's own go through BLAS, which rounds some products and sums at once, others not, depending on the processor.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..compiler.formulas import formula
from .scalar import sqrt


@formula
def cross(a, b):
    """Cross product a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@formula
def dot(a, b):
    """Dot product a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@formula
def add(a, b):
    """Sum a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@formula
def sub(a, b):
    """Difference a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@formula
def scale(s, a):
    """Product s a."""
    return (s * a[0], s * a[1], s * a[2])


@formula
def neg(a):
    """Negative -a."""
    return (-a[0], -a[1], -a[2])


@formula
def norm(a):
    """Length of a; analytic, so that it carries complex steps (NumPy's norm does not)."""
    return sqrt(dot(a, a))


@formula
def mv(R, a):
    """Product R a."""
    return (
        R[0] * a[0] + R[1] * a[1] + R[2] * a[2],
        R[3] * a[0] + R[4] * a[1] + R[5] * a[2],
        R[6] * a[0] + R[7] * a[1] + R[8] * a[2],
    )


@formula
def mtv(R, a):
    """Product R^T a."""
    return (
        R[0] * a[0] + R[3] * a[1] + R[6] * a[2],
        R[1] * a[0] + R[4] * a[1] + R[7] * a[2],
        R[2] * a[0] + R[5] * a[1] + R[8] * a[2],
    )


@formula
def symmetric(J, a):
    """Product J a of a symmetric J = (xx, xy, xz, yy, yz, zz)."""
    return (
        J[0] * a[0] + J[1] * a[1] + J[2] * a[2],
        J[1] * a[0] + J[3] * a[1] + J[4] * a[2],
        J[2] * a[0] + J[4] * a[1] + J[5] * a[2],
    )


@formula
def axes_across(n):
    """Two unit vectors perpendicular to the unit vector n and to each other (Duff and others, 2017).

    Where n lies in z = 0, z is the second, so that motion in that plane stays in it to the last bit.
    """
    if n[2] == 0.0:
        return (-n[1], n[0], 0.0 * n[0]), (0.0 * n[0], 0.0 * n[0], 1.0 + 0.0 * n[0])
    s = 1.0 if n[2] >= 0.0 else -1.0
    a = -1.0 / (s + n[2])
    b = n[0] * n[1] * a
    return (1.0 + s * n[0] * n[0] * a, s * b, -s * n[0]), (b, s + n[1] * n[1] * a, -n[1])


@formula
def mm(A, B):
    """Product A B."""
    return (
        A[0] * B[0] + A[1] * B[3] + A[2] * B[6],
        A[0] * B[1] + A[1] * B[4] + A[2] * B[7],
        A[0] * B[2] + A[1] * B[5] + A[2] * B[8],
        A[3] * B[0] + A[4] * B[3] + A[5] * B[6],
        A[3] * B[1] + A[4] * B[4] + A[5] * B[7],
        A[3] * B[2] + A[4] * B[5] + A[5] * B[8],
        A[6] * B[0] + A[7] * B[3] + A[8] * B[6],
        A[6] * B[1] + A[7] * B[4] + A[8] * B[7],
        A[6] * B[2] + A[7] * B[5] + A[8] * B[8],
    )


@formula
def transpose(R):
    """Transpose R^T."""
    return (R[0], R[3], R[6], R[1], R[4], R[7], R[2], R[5], R[8])


@formula
def col(R, i):
    """Column i of R: the i-th axis of the frame in world components."""
    return (R[i], R[3 + i], R[6 + i])


@formula
def load3(A, k, o):
    """Three consecutive entries of row k of a table, from column o."""
    return (A[k, o], A[k, o + 1], A[k, o + 2])


@formula
def load9(A, k, o):
    """Nine consecutive entries of row k of a table, from column o: a matrix row by row."""
    return (
        A[k, o],
        A[k, o + 1],
        A[k, o + 2],
        A[k, o + 3],
        A[k, o + 4],
        A[k, o + 5],
        A[k, o + 6],
        A[k, o + 7],
        A[k, o + 8],
    )


@formula
def store3(A, k, o, a):
    """Write a three-vector into row k of a table, from column o."""
    A[k, o] = a[0]
    A[k, o + 1] = a[1]
    A[k, o + 2] = a[2]


@formula
def store9(A, k, o, a):
    """Write a matrix into row k of a table, from column o."""
    for i in range(9):
        A[k, o + i] = a[i]


@formula
def quaternion_matrix(w, x, y, z):
    """Rotation matrix of a unit quaternion (scalar first), columns = turned axes."""
    return (
        1 - 2 * (y * y + z * z),
        2 * (x * y - w * z),
        2 * (x * z + w * y),
        2 * (x * y + w * z),
        1 - 2 * (x * x + z * z),
        2 * (y * z - w * x),
        2 * (x * z - w * y),
        2 * (y * z + w * x),
        1 - 2 * (x * x + y * y),
    )


@formula
def quaternion_product(a, b):
    """Hamilton product a b: the rotation b followed by a."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


def matrix_product(A: Any, B: Any) -> np.ndarray:
    """A B of matrices (..., 3, 3) and a vector (3,) or matrices (..., 3, k)."""
    if A.ndim == 2 and B.ndim == 1:
        return np.array(mv(A.ravel().tolist(), B.tolist()))
    if A.shape == B.shape == (3, 3):  # tuples take a tenth of the time of arrays
        return np.array(mm(A.ravel().tolist(), B.ravel().tolist())).reshape(3, 3)
    if "c" not in (A.dtype.kind, B.dtype.kind):
        return _product_terms(A, B)
    real = _product_terms(A.real, B.real) - (_product_terms(A.imag, B.imag) + 0.0)  # no zero changes its sign
    out = np.empty(real.shape, complex)  # NumPy's complex multiplication rounds by where arrays are in memory
    out.real, out.imag = real, _product_terms(A.real, B.imag) + _product_terms(A.imag, B.real) + 0.0
    return out


def _product_terms(A: Any, B: Any) -> Any:
    return A[..., 0:1] * B[..., 0:1, :] + A[..., 1:2] * B[..., 1:2, :] + A[..., 2:] * B[..., 2:, :]


def inner_product(a: Any, b: Any) -> Any:
    """The inner product of two vectors (3,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
