"""Scalar functions agree on floats, complex numbers, arrays, symbols and in compiled code."""

import math
import subprocess
import sys

import numpy as np
import pytest
import sympy

from flyball.math import scalar
from flyball.math.scalar import (
    absolute,
    acos,
    asin,
    atan,
    atan2,
    cos,
    cosh,
    cubic_rise,
    divide,
    exp,
    log,
    maximum,
    minimum,
    power,
    quintic_rise,
    rounded,
    sign,
    sin,
    sinh,
    sqrt,
    tan,
    tanh,
)
from tests.compiled import compiled

ONE = [
    "sqrt",
    "sin",
    "cos",
    "tan",
    "asin",
    "acos",
    "atan",
    "exp",
    "log",
    "sinh",
    "cosh",
    "tanh",
    "absolute",
    "sign",
    "rounded",
    "cubic_rise",
    "quintic_rise",
]
TWO = ["atan2", "minimum", "maximum", "divide", "power"]
SHARP = {"sign", "rounded"}
INSIDE = [0.3, 0.71]
OUTSIDE = [-1.5, -1.0, -0.0, 0.0, 1.0, 1.5, 800.0, math.inf, -math.inf, math.nan]
PAIRS = [(0.3, 0.7), (1.2, -0.4), (2.0, 3.0), (0.7, 2.0), (1.5, -1.0)]
BROKEN = [
    (-1.0, 0.5),
    (0.0, -1.0),
    (1.0, 0.0),
    (0.0, 0.0),
    (-0.0, -1.0),
    (math.nan, 1.0),
    (1.0, math.nan),
    (10.0, 400.0),
]
H = 1e-30


@compiled
def every_one(x, out):
    out[0] = sqrt(x)
    out[1] = sin(x)
    out[2] = cos(x)
    out[3] = tan(x)
    out[4] = asin(x)
    out[5] = acos(x)
    out[6] = atan(x)
    out[7] = exp(x)
    out[8] = log(x)
    out[9] = sinh(x)
    out[10] = cosh(x)
    out[11] = tanh(x)
    out[12] = absolute(x)
    out[13] = sign(x)
    out[14] = rounded(x)
    out[15] = cubic_rise(x)
    out[16] = quintic_rise(x)


@compiled
def every_two(a, b, out):
    out[0] = atan2(a, b)
    out[1] = minimum(a, b)
    out[2] = maximum(a, b)
    out[3] = divide(a, b)
    out[4] = power(a, b)


def plain(names, *args):
    return np.array([getattr(scalar, name)(*args) for name in names])


@pytest.mark.parametrize("x", INSIDE + OUTSIDE)
def test_compiled_is_plain(x):
    out = np.zeros(len(ONE))
    every_one(x, out)
    np.testing.assert_allclose(out, plain(ONE, x), rtol=1e-14, equal_nan=True)


@pytest.mark.parametrize(("a", "b"), PAIRS + BROKEN)
def test_compiled_is_plain_for_two(a, b):
    out = np.zeros(len(TWO))
    every_two(a, b, out)
    np.testing.assert_allclose(out, plain(TWO, a, b), rtol=1e-14, equal_nan=True)


@pytest.mark.parametrize("x", INSIDE)
def test_complex_step_of_one(x):
    out = np.zeros(len(ONE), complex)
    every_one(x + H * 1j, out)
    np.testing.assert_allclose(out, plain(ONE, x + H * 1j), rtol=1e-13)
    np.testing.assert_allclose(out.real, plain(ONE, x), rtol=1e-14)
    slope = (plain(ONE, x + 1e-5) - plain(ONE, x - 1e-5)) / 2e-5
    np.testing.assert_allclose(out.imag / H, slope, rtol=1e-8, atol=1e-9)


@pytest.mark.parametrize(("a", "b"), PAIRS)
def test_complex_step_of_two(a, b):
    for da, db in ((1.0, 0.0), (0.0, 1.0), (0.6, 0.8)):
        out = np.zeros(len(TWO), complex)
        every_two(a + da * H * 1j, b + db * H * 1j, out)
        np.testing.assert_allclose(out, plain(TWO, a + da * H * 1j, b + db * H * 1j), rtol=1e-13)
        np.testing.assert_allclose(out.real, plain(TWO, a, b), rtol=1e-14)
        e = 1e-6
        slope = (plain(TWO, a + da * e, b + db * e) - plain(TWO, a - da * e, b - db * e)) / (2 * e)
        np.testing.assert_allclose(out.imag / H, slope, rtol=1e-8, atol=1e-8)


def test_kinks_follow_one_branch():
    assert absolute(0.0 + 1j * H) == 1j * H
    assert absolute(-2.0 + 1j * H) == 2.0 - 1j * H
    assert minimum(1.0 + 1j * H, 1.0) == 1.0 + 1j * H
    assert maximum(1.0, 2.0 + 1j * H) == 2.0 + 1j * H
    assert sign(-3.0 + 1j) == -1.0


def test_power_at_zero_and_of_negative_numbers():
    assert power(-2.0, 3.0) == -8.0
    assert math.isnan(power(-2.0, 0.5))
    assert power(0.0, -2.0) == math.inf
    assert power(0j, 2.0) == 0.0
    assert power(0.0 + 1j * H, 1.0) == 1j * H
    assert power(-2.0 + 1j * H, 2.0).imag == pytest.approx(-4 * H)
    assert math.isnan(power(-2.0 + 0j, 0.5).real)


@pytest.mark.parametrize("name", ONE + TWO)
def test_arrays_are_done_element_by_element(name):
    function = getattr(scalar, name)
    x = np.array([*INSIDE, -1.5, 0.0, 2.0])
    args = (x,) if name in ONE else (x, x[::-1].copy())
    expected = [function(*(float(a) for a in each)) for each in zip(*args, strict=True)]
    np.testing.assert_allclose(function(*args), expected, rtol=1e-14)
    objects = function(*(a.astype(object) for a in args)) if name != "divide" else expected
    np.testing.assert_allclose(np.array(objects, float), expected, rtol=1e-14)
    complex_args = tuple(a[:2] + 1j * H for a in args)
    expected = [function(*(complex(a) for a in each)) for each in zip(*complex_args, strict=True)]
    np.testing.assert_allclose(function(*complex_args), expected, rtol=1e-13)


@pytest.mark.parametrize("name", ONE)
def test_symbols(name):
    s = sympy.Symbol("s", real=True)
    for x in INSIDE:
        expected = getattr(scalar, name)(x)
        assert float(getattr(scalar, name)(s).subs(s, sympy.Float(x, 30))) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("name", TWO)
def test_symbols_of_two(name):
    s = sympy.Symbol("s", real=True)
    expected = getattr(scalar, name)(0.3, 0.7)
    assert float(getattr(scalar, name)(s, sympy.Float(0.7)).subs(s, 0.3)) == pytest.approx(expected, rel=1e-12)


def test_whole_powers_of_everything():
    s = sympy.Symbol("s")
    assert scalar.integer_power(s, 3) == s**3
    assert scalar.integer_power(s, -2) == s**-2
    assert scalar.integer_power(2.0, -3) == 0.125
    assert scalar.integer_power(0.0, 0) == 1
    assert scalar.integer_power(0.0, -1) == math.inf
    assert scalar.integer_power(1j, 2) == -1


def test_importing_needs_no_compiler_and_no_symbols():
    code = "import sys, flyball.math.scalar as s; s.sqrt(2.0); assert not {'numba', 'sympy'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)
