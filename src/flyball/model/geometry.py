"""Vectors and orientations that users write, as NumPy arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import ModelError


def vector(values: Any, planar: bool, what: str, direction: bool = False) -> np.ndarray:
    """Three components from two (planar) or three; a direction comes back with unit length.

    Raises
    ------
    ModelError
        If the number of components is wrong, a planar z is not 0, or a direction has no length.
    """
    values = values if isinstance(values, (tuple, list, np.ndarray)) else (values,)
    wanted = 2 if planar else 3
    if len(values) not in (wanted, 3):
        raise ModelError(f"{what}: expected {wanted} components, got {len(values)}: {tuple(values)}")
    if planar and len(values) == 3 and values[2] != 0.0:
        raise ModelError(f"{what}: the mechanism is planar, its third component must be 0, not {values[2]:g}")
    a = np.zeros(3, dtype=np.result_type(np.asarray(values).dtype, float))
    a[: len(values)] = values
    if not direction:
        return a
    size = np.sqrt((a * a).sum())
    if not size.real > 1e-12:
        raise ModelError(f"{what}: {tuple(values)} has no length; a direction must not be zero")
    return a / size


def triad(z: np.ndarray) -> np.ndarray:
    """Right-handed axes (columns) with the given unit vector as z; the world's axes where z is vertical."""
    if z[2].real > 1.0 - 1e-12:
        return np.eye(3)
    helper = np.eye(3)[int(np.argmin(np.abs(z.real)))]
    x = np.cross(helper, z)
    x = x / np.sqrt((x * x).sum())
    return np.column_stack([x, np.cross(z, x), z])


def rotation_about(axis: int, angle: float) -> np.ndarray:
    """Rotation about a coordinate axis (0, 1, 2) by an angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    R = np.eye(3, dtype=np.result_type(type(c), float))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R[i, i], R[i, j], R[j, i], R[j, j] = c, -s, s, c
    return R


def quaternion_to_matrix(e: np.ndarray) -> np.ndarray:
    """Rotation matrix of a unit quaternion, scalar first."""
    from ..math.vec import quaternion_matrix

    return np.array(quaternion_matrix(*e)).reshape(3, 3)


def matrix_to_quaternion(R: np.ndarray) -> np.ndarray:
    """Unit quaternion, scalar first and not negative, of a rotation matrix (Shepperd 1978)."""
    t = np.array([np.trace(R), R[0, 0], R[1, 1], R[2, 2]])
    k = int(np.argmax(t))
    if k == 0:
        e = np.array([1 + t[0], R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    else:
        i = k - 1
        j, m = (i + 1) % 3, (i + 2) % 3
        e = np.zeros(4, R.dtype)
        e[0] = R[m, j] - R[j, m]
        e[1 + i] = 1 + R[i, i] - R[j, j] - R[m, m]
        e[1 + j] = R[i, j] + R[j, i]
        e[1 + m] = R[i, m] + R[m, i]
    e = e / np.sqrt((e * e).sum())
    return -e if e[0].real < 0 else e


def orientation_matrix(value: Any, what: str) -> np.ndarray:
    """Rotation matrix from a quaternion (4, scalar first), Bryant angles (3, about x, then y, then z) or a matrix.

    Raises
    ------
    ModelError
        If it has another shape, a quaternion is zero, or a matrix is no rotation.
    """
    a = np.asarray(value)
    if a.shape == (3, 3):
        if np.abs(a.T @ a - np.eye(3)).max() > 1e-9 or np.linalg.det(a.real) < 0:
            raise ModelError(f"{what}: the matrix is not a rotation (its columns must be orthonormal, right-handed)")
        return a
    if a.shape == (4,):
        size = np.sqrt((a * a).sum())
        if not size.real > 1e-9:
            raise ModelError(f"{what}: a quaternion must not be zero")
        return quaternion_to_matrix(a / size)
    if a.shape == (3,):
        return rotation_about(0, a[0]) @ rotation_about(1, a[1]) @ rotation_about(2, a[2])
    raise ModelError(f"{what}: give a quaternion (4, scalar first), Bryant angles (3) or a 3x3 rotation matrix")
