"""The scalar formulas of turns: compiled, on symbols and on arrays the same."""

from __future__ import annotations

import numpy as np
import pytest
import sympy

from flyball.math import rotation
from flyball.math.vec import mm
from tests.compiled import compiled

SEQUENCES = [(i, j, k) for i in range(3) for j in range(3) for k in range(3) if i != j != k]


@compiled
def every_formula(i, j, k, angles, rates, out):
    a, b, c = angles[0], angles[1], angles[2]
    speed = (rates[0], rates[1], rates[2])
    quaternion = rotation.sequence_quaternion(i, j, k, a, b, c)
    for m in range(4):
        out[0, m] = quaternion[m]
    base = rotation.axes_in_base(i, j, k, a, b)
    body = rotation.axes_in_body(i, j, k, b, c)
    n = 1
    for h in (
        base,
        body,
        rotation.axes_in_base_rate(base, speed),
        rotation.axes_in_body_rate(body, speed),
        rotation.reciprocal_rows(base),
        rotation.reciprocal_rows(body),
    ):
        for m in range(3):
            out[n, 0], out[n, 1], out[n, 2] = h[m][0], h[m][1], h[m][2]
            n += 1


@pytest.mark.parametrize("dtype", [float, complex])
def test_compiled_is_plain(dtype):
    rng = np.random.default_rng(0)
    for s in SEQUENCES:
        angles, rates = rng.uniform(-3, 3, 3).astype(dtype), rng.uniform(-3, 3, 3).astype(dtype)
        if dtype is complex:
            angles = angles + 1e-30j
        compiled, plain = np.zeros((2, 19, 4), dtype)
        every_formula(*s, angles, rates, compiled)
        every_formula.function(*s, angles, rates, plain)
        np.testing.assert_allclose(compiled, plain, rtol=1e-13, atol=1e-15)


def test_on_symbols():
    """R_x(a) R_y(b) R_z(c) in symbols is the product of the textbook's matrices."""
    a, b, c = sympy.symbols("a b c", real=True)
    R = mm(mm(rotation.axis_rotation(0, a), rotation.axis_rotation(1, b)), rotation.axis_rotation(2, c))
    exact = sympy.rot_ccw_axis1(a) * sympy.rot_ccw_axis2(b) * sympy.rot_ccw_axis3(c)
    assert sympy.simplify(sympy.Matrix(3, 3, R) - exact) == sympy.zeros(3, 3)
    h = rotation.axes_in_body(0, 1, 2, b, c)
    H = sympy.Matrix([[x[m] for x in h] for m in range(3)])
    assert sympy.simplify(H.det() - sympy.cos(b)) == 0
    assert sympy.simplify(sympy.Matrix([list(x) for x in rotation.reciprocal_rows(h)]) * H) == sympy.eye(3)


def test_axes_are_columns_of_the_turned_frames():
    """In the base: e_i, then an axis of the frame after the first turn, then one after the first two."""
    a, b = np.array([0.3, 2.0]), np.array([-0.4, 1.0])
    for i, j, k in SEQUENCES:
        h = rotation.axes_in_base(i, j, k, a, b)
        A = np.array(np.broadcast_arrays(*rotation.axis_rotation(i, a))).reshape(3, 3, 2)
        B = np.array(np.broadcast_arrays(*rotation.axis_rotation(j, b))).reshape(3, 3, 2)
        assert np.array(h[0]) == pytest.approx(np.tile(np.eye(3)[i], (2, 1)).T)
        assert np.array(np.broadcast_arrays(*h[1])) == pytest.approx(A[:, j])
        assert np.array(np.broadcast_arrays(*h[2])) == pytest.approx(np.einsum("ijn,jkn->ikn", A, B)[:, k])
