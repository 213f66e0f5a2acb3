"""Conversion of vectors and orientations, as users write them, to NumPy arrays."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator

from ..errors import ModelError
from ..math.rotation import axis_rotation
from ..math.scalar import real_parts
from ..math.vec import cross, matrix_product, quaternion_matrix
from ..rotations.arrays import quaternion_of, rotation_matrices, unit_quaternions
from .element import Unit, python_data


def vector(values: Any, planar: bool, what: str, direction: bool = False) -> np.ndarray:
    """Return three components from two (planar) or three; a direction is normalised.

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
    """Return right-handed axes (columns) with the given unit vector as z; the world's axes if z is vertical.

    Near the vertical the world's axes are tilted the shortest way.
    """
    if z[2].real > 1.0 - 1e-12:
        x, y, c = z
        s = 1.0 / (1.0 + c)
        return np.array([[1.0 - s * x * x, -s * x * y, x], [-s * x * y, 1.0 - s * y * y, y], [-x, -y, c]])
    helper = np.eye(3)[int(np.argmin(np.abs(real_parts(z))))]
    x = np.array(cross(helper, z))  # NumPy's own takes ten times as long
    x = x / np.sqrt((x * x).sum())
    return np.array([x, cross(z, x), z]).T


def rotation_about(axis: int, angle: float) -> np.ndarray:
    """Rotation about a coordinate axis (0, 1, 2) by an angle [rad]."""
    return np.array(axis_rotation(axis, angle)).reshape(3, 3)


def quaternion_to_matrix(e: np.ndarray) -> np.ndarray:
    """Return the rotation matrix of a unit quaternion, scalar first."""
    return np.array(quaternion_matrix(*e)).reshape(3, 3)


def matrix_to_quaternion(R: np.ndarray) -> np.ndarray:
    """Return the unit quaternion, scalar first and not negative, of a rotation matrix, or of many, (..., 3, 3)."""
    return quaternion_of(R)


def orientation_matrix(value: Any, what: str) -> np.ndarray:
    """A rotation matrix from a quaternion (4, scalar first), Bryant angles (3, about x, then y, then z) or a matrix.

    Raises
    ------
    ModelError
        If it has another shape, a quaternion is zero, or a matrix is not a rotation.
    """
    a = np.asarray(value)
    if a.shape == (3, 3):
        return rotation_matrices(a, what)
    if a.shape == (4,):
        return quaternion_to_matrix(unit_quaternions(a, what))
    if a.shape == (3,):
        return matrix_product(matrix_product(rotation_about(0, a[0]), rotation_about(1, a[1])), rotation_about(2, a[2]))
    raise ModelError(f"{what}: give a quaternion (4, scalar first), Bryant angles (3) or a 3x3 rotation matrix")


def oriented(value: Any) -> Any:
    """Convert a rotation object (with ``as_quat`` or ``as_matrix``) to a quaternion, scalar first."""
    if hasattr(value, "as_matrix"):
        value = matrix_to_quaternion(np.asarray(value.as_matrix()))
    value = python_data(value)
    if not isinstance(value, (tuple, list)):
        raise ValueError("give a quaternion (4, scalar first), Bryant angles (3) or a 3x3 rotation matrix")
    if len(value) == 3 and all(isinstance(row, (tuple, list)) and len(row) == 3 for row in value):
        value = matrix_to_quaternion(orientation_matrix(value, "orientation")).tolist()
    return tuple(value)


Orientation = Annotated[
    tuple[float | str, ...],
    BeforeValidator(oriented, json_schema_input_type=tuple[float | str, ...] | tuple[tuple[float, ...], ...]),
    Unit("rad"),
]
