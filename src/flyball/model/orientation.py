"""Orientations as a user may write them: of bodies, and of shapes on them."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator

from .element import Unit, plain
from .geometry import matrix_to_quaternion, orientation_matrix


def oriented(value: Any) -> Any:
    """A rotation object (with ``as_quat`` or ``as_matrix``) becomes a quaternion, scalar first."""
    if hasattr(value, "as_matrix"):
        value = matrix_to_quaternion(np.asarray(value.as_matrix()))
    value = plain(value)
    if not isinstance(value, (tuple, list)):
        raise ValueError("give a quaternion (4, scalar first), Bryant angles (3) or a 3x3 rotation matrix")
    if len(value) == 3 and all(isinstance(row, (tuple, list)) and len(row) == 3 for row in value):
        value = matrix_to_quaternion(orientation_matrix(value, "orientation")).tolist()
    return tuple(value)


Orientation = Annotated[tuple[float | str, ...], BeforeValidator(oriented), Unit("rad")]
