"""What the tests of rotations draw from, and the derivative by a complex step."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from flyball import rotations

ALL = rotations.INTRINSIC + rotations.EXTRINSIC
STEP = 1e-30
SOME = rotations.random(400, seed=7)

vectors = arrays(float, 3, elements=st.floats(-4, 4, allow_subnormal=False))
quaternions = arrays(float, 4, elements=st.floats(-1, 1, allow_subnormal=False)).filter(lambda e: e @ e > 1e-6)


def derivative(function: Callable, *pairs: tuple) -> np.ndarray:
    """d/dt of a function of arguments (value, rate), exact to rounding."""
    return function(*(np.asarray(x) + 1j * STEP * np.asarray(v) for x, v in pairs)).imag / STEP


def same_orientation(a: object, b: object, within: float = 2e-15) -> bool:
    return bool(np.all(rotations.angular_distance(a, b) <= within))
