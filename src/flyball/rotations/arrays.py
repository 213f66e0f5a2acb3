"""Arguments of the rotation functions as arrays of the right shape, and arrays as the tuples that formulas take.

What users hand over is checked; the message says what is wrong with it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import ModelError
from ..math.scalar import real_parts, sqrt


def split(a: np.ndarray) -> tuple[Any, ...]:
    """Components along the last axis; of a single vector plain numbers, with which the formulas are much faster."""
    if a.ndim == 1:
        return tuple(a.tolist())
    return tuple(a[..., i] for i in range(a.shape[-1]))


def joined(components: tuple[Any, ...]) -> np.ndarray:
    """Vectors (..., n) from their n components."""
    if not any(isinstance(c, np.ndarray) for c in components):
        return np.array(components)
    return np.stack(np.broadcast_arrays(*components), axis=-1)


def columns(vectors: tuple[Any, ...]) -> np.ndarray:
    """Matrices from their columns, each a tuple of components."""
    return np.swapaxes(rows(vectors), -1, -2)


def rows(vectors: tuple[Any, ...]) -> np.ndarray:
    """Matrices from their rows, each a tuple of components."""
    n = len(vectors[0])
    flat = joined(tuple(x for v in vectors for x in v))
    return flat.reshape(*flat.shape[:-1], len(vectors), n)


def skew(a: np.ndarray) -> np.ndarray:
    """Matrices S of the cross product, S b = a x b, of vectors (..., 3)."""
    x, y, z = split(a)
    o = 0.0 * x
    return rows(((o, -z, y), (z, o, -x), (-y, x, o)))


def matrix_times_vector(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Matrices times vectors, leading axes broadcast."""
    return (matrix @ vector[..., None])[..., 0]


ORTHONORMAL = 1e-9  # largest entry of R^T R - 1 of what still counts as a rotation matrix
SMALLEST = 1e-9  # shortest quaternion that still has a direction
_ORIENTATION_RULE = (
    "an orientation is a quaternion (..., 4), scalar first, or a rotation matrix (..., 3, 3); angles and vectors "
    "become one by from_euler, from_rotation_vector, from_axis_angle or from_gibbs"
)


def number_array(value: Any, shape: tuple[int, ...], what: str, rule: str = "") -> np.ndarray:
    """Array of floats or complex numbers whose last axes have the given shape.

    Raises
    ------
    ModelError
        If it has another shape, or not all of it are finite numbers.
    """
    try:
        a = np.asarray(value)
    except ValueError:
        raise ModelError(f"{what}: {value!r} is not an array: its rows differ in length") from None
    if a.dtype.kind not in "iufc" and not _is_symbolic(a):
        raise ModelError(f"{what}: {value!r} does not consist of numbers; angles are in radians, without units")
    a = a.astype(np.result_type(a.dtype, float), copy=False)
    n = a.ndim - len(shape)
    if n < 0 or a.shape[n:] != shape:
        wanted = ", ".join(["...", *map(str, shape)])
        raise ModelError(f"{what}: the shape is {a.shape}, expected ({wanted})" + (f"; {rule}" if rule else ""))
    finite = _is_finite(a)
    if not finite.all():
        refuse_values(~finite, a, what, "is not a finite number")
    return a


def _is_finite(a: np.ndarray) -> np.ndarray:
    if a.dtype != object:
        return np.isfinite(a)
    known = real_parts(a)
    return np.asarray(known - known == 0.0)


def _is_symbolic(a: np.ndarray) -> bool:
    """Whether all that is no number stands for one: see `math/scalar.py`."""
    return a.dtype == object and all(hasattr(x, "called") or isinstance(x, float | int) for x in a.flat)


def refuse_values(bad: np.ndarray, values: np.ndarray, what: str, rule: str) -> None:
    """Raise a ModelError with the first bad value and its place, if there is one.

    ``values`` may have more axes than ``bad``, its last ones belonging to one value.
    """
    if not np.any(bad):
        return
    k = tuple(int(i) for i in np.argwhere(bad)[0])
    value = np.asarray(values)[k]
    raise ModelError(f"{what}{index_text(k)}: {value.tolist()} {rule}")


def index_text(index: tuple[int, ...]) -> str:
    """Where in an array something is, for a message."""
    if not index:
        return ""
    return f" at index {index[0] if len(index) == 1 else index}"


def rotation_matrices(value: Any, what: str) -> np.ndarray:
    """Rotation matrices (..., 3, 3).

    Raises
    ------
    ModelError
        If a matrix is not orthonormal to 1e-9 or is left-handed.
    """
    R = number_array(value, (3, 3), what)
    known = real_parts(R) if R.dtype == object else R
    off = np.abs(np.swapaxes(known, -1, -2) @ known - np.eye(3)).max(axis=(-1, -2), initial=0.0)
    if np.any(off > ORTHONORMAL):
        k = np.unravel_index(int(np.argmax(off)), off.shape)
        raise ModelError(
            f"{what}{index_text(tuple(map(int, k)))}: the matrix is not a rotation: its columns must be "
            f"orthonormal, but "
            f"R^T R is off by {off[k]:.2g} (at most {ORTHONORMAL:g}); rotations.nearest gives the closest rotation"
        )
    refuse_values(
        np.linalg.det(real_parts(R)) < 0, R, what, "is not a rotation: it mirrors, so make its columns right-handed"
    )
    return R


def unit_quaternions(value: Any, what: str) -> np.ndarray:
    """Quaternions (..., 4) divided by their lengths.

    Raises
    ------
    ModelError
        If one is zero.
    """
    e = number_array(value, (4,), what)
    size = np.sqrt((e * e).sum(axis=-1, keepdims=True))
    bad = ~(real_parts(size)[..., 0] > SMALLEST)
    refuse_values(bad, e, what, "has no direction; a quaternion must not be zero (no rotation is (1, 0, 0, 0))")
    return e / size


def unit_vectors(value: Any, what: str) -> np.ndarray:
    """Directions (..., 3) with unit length.

    Raises
    ------
    ModelError
        If one is zero.
    """
    a = number_array(value, (3,), what)
    largest = np.abs(real_parts(a)).max(axis=-1, keepdims=True, initial=0.0)
    refuse_values(
        largest[..., 0] == 0, a, what, "has no length; an axis must not be zero (for no rotation give the angle 0)"
    )
    a = a / largest
    return a / np.sqrt((a * a).sum(axis=-1, keepdims=True))


def orientations(value: Any, what: str) -> np.ndarray:
    """Unit quaternions (..., 4) from quaternions, rotation matrices or an object with ``as_matrix`` (SciPy's).

    Raises
    ------
    ModelError
        If it is none of these.
    """
    if hasattr(value, "as_matrix"):
        value = value.as_matrix()
    try:
        shape = np.shape(value)
    except ValueError:
        raise ModelError(f"{what}: {value!r} is not an array; {_ORIENTATION_RULE}") from None
    if shape[-2:] == (3, 3):
        return quaternion_of(rotation_matrices(value, what))
    if not shape or shape[-1] != 4:
        raise ModelError(f"{what}: {_ORIENTATION_RULE}; the shape is {shape}")
    return unit_quaternions(value, what)


def quaternion_of(R: np.ndarray) -> np.ndarray:
    """Unit quaternions (..., 4), scalar first and not negative, of rotation matrices (..., 3, 3) taken as they are.

    Four times the products e e^T stand in sums and differences of the entries of R. The row with the largest diagonal
    is taken, so that nothing small is divided by (Shepperd 1978).
    """
    K = np.empty((*R.shape[:-2], 4, 4), R.dtype)
    x, y, z = R[..., 0, 0], R[..., 1, 1], R[..., 2, 2]
    K[..., 0, 0], K[..., 1, 1], K[..., 2, 2], K[..., 3, 3] = 1 + x + y + z, 1 + x - y - z, 1 - x + y - z, 1 - x - y + z
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        K[..., 0, 1 + i] = K[..., 1 + i, 0] = R[..., k, j] - R[..., j, k]
        K[..., 1 + i, 1 + j] = K[..., 1 + j, 1 + i] = R[..., i, j] + R[..., j, i]
    best = np.argmax(real_parts(np.diagonal(K, axis1=-2, axis2=-1)), axis=-1)
    e = np.take_along_axis(K, best[..., None, None], axis=-2)[..., 0, :]
    e = e / sqrt((e * e).sum(axis=-1, keepdims=True))
    return np.where(real_parts(e[..., :1]) < 0, -e, e)
