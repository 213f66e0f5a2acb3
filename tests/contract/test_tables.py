"""Tables: curves through points, against closed forms, SciPy, and each other's derivatives."""

import math

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline, PchipInterpolator

from flyball.compiler.jit import kernel
from flyball.math.spline import spline
from flyball.model.table import Table

KINDS = ["cubic", "monotone", "linear"]
OUTSIDES = ["linear", "hold", "periodic"]
X = (-1.0, 0.2, 0.5, 1.3, 2.0, 3.1)
Y = (0.4, 1.0, 0.8, -0.7, -0.7, 0.4)
H = 1e-30


@kernel
def compiled_spline(data, at, x):
    return spline(data, at, x)


def table(interpolation="cubic", outside="linear", x=X, y=Y, **units):
    return Table("curve", x=x, y=y, interpolation=interpolation, outside=outside, **units)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("outside", OUTSIDES)
def test_goes_through_its_points(kind, outside):
    np.testing.assert_allclose(table(kind, outside).values(np.array(X))[0], Y, atol=1e-14)


@pytest.mark.parametrize("x", [X[:4], (0.0, 1.0, 7.0, 7.5, 9.0)])
def test_cubic_reproduces_a_cubic_everywhere_between(x):
    """A not-a-knot spline through points of a cubic is that cubic."""
    x = np.array(x)
    between = np.linspace(x[0], x[-1], 23)
    f, f1, f2 = table(x=x, y=2 - x + 0.5 * x**2 - 0.3 * x**3).values(between)
    np.testing.assert_allclose(f, 2 - between + 0.5 * between**2 - 0.3 * between**3, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(f1, -1 + between - 0.9 * between**2, rtol=1e-11, atol=1e-10)
    np.testing.assert_allclose(f2, 1 - 1.8 * between, rtol=1e-10, atol=1e-9)


def test_two_points_are_a_line_and_three_a_parabola():
    assert table(x=(1, 3), y=(2, 8)).values(1.5) == pytest.approx((3.5, 3, 0))
    assert table(x=(0, 1, 3), y=(0, 1, 9)).values(2.0) == pytest.approx((4, 4, 2))


@pytest.mark.parametrize(("kind", "order"), [("cubic", 4), ("linear", 2)])
def test_finer_tables_come_closer(kind, order):
    """One period of a sine, repeated: the error falls with the order of the interpolation, the seam included."""
    at = np.linspace(-7, 14, 301)
    errors = []
    for n in (20, 40):
        x = np.linspace(0, 2 * math.pi, n + 1)
        errors.append(abs(table(kind, "periodic", x, np.sin(x)).values(at)[0] - np.sin(at)).max())
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.25)


def test_cubic_has_two_continuous_derivatives_and_monotone_one():
    eps = 1e-9
    for kind, smooth in (("cubic", 3), ("monotone", 2), ("linear", 1)):
        for outside in OUTSIDES:
            t = table(kind, outside)
            inner = np.array(X[1:-1])
            if outside == "periodic":
                inner = np.r_[X[0], inner, X[-1], X[-1] + 5 * (X[-1] - X[0])]
            before, after = t.values(inner - eps), t.values(inner + eps)
            for a, b in list(zip(before, after, strict=True))[:smooth]:
                np.testing.assert_allclose(a, b, atol=1e-6)


def test_cubic_and_monotone_are_those_of_scipy():
    x = np.linspace(X[0], X[-1], 101)
    for made, reference in (
        (table(), CubicSpline(X, Y)),
        (table("monotone"), PchipInterpolator(X, Y)),
        (table(outside="periodic"), CubicSpline(X, Y, bc_type="periodic")),
    ):
        for k, values in enumerate(made.values(x[1:])):
            np.testing.assert_allclose(values, reference(x[1:], k), atol=1e-12)


@settings(max_examples=30, deadline=None, derandomize=True, database=None)
@given(st.lists(st.floats(-5, 5), min_size=2, max_size=8), st.sampled_from(OUTSIDES))
def test_monotone_stays_between_its_points(y, outside):
    y = [*y, y[0]] if outside == "periodic" else y
    x = np.cumsum(1.0 + 0.5 * np.sin(np.arange(len(y))))
    t = table("monotone", outside, x, y)
    for k in range(len(y) - 1):
        f = t.values(np.linspace(x[k], x[k + 1], 9))[0]
        assert min(y[k : k + 2]) - 1e-12 <= f.min()
        assert f.max() <= max(y[k : k + 2]) + 1e-12


@pytest.mark.parametrize("kind", KINDS)
def test_outside(kind):
    far = np.array([X[0] - 2.5, X[-1] + 4.0])
    ends = np.array([X[0], X[-1]])
    f, f1, f2 = table(kind, "linear").values(far)
    at_end, slope, _ = table(kind, "linear").values(ends)
    np.testing.assert_allclose(f, at_end + slope * (far - ends))
    np.testing.assert_allclose(f1, slope)
    assert not f2.any()
    f, f1, f2 = table(kind, "hold").values(far)
    assert f.tolist() == [Y[0], Y[-1]]
    assert not f1.any()
    assert not f2.any()
    x = np.linspace(X[0], X[-1], 31)[:-1]
    turns = np.array([[-3], [0], [2], [1000]])
    repeated = table(kind, "periodic").values(x + turns * (X[-1] - X[0]))
    for found, expected in zip(repeated, table(kind, "periodic").values(x), strict=True):
        np.testing.assert_allclose(found, np.broadcast_to(expected, found.shape), atol=1e-9)


def test_the_ends_count_as_inside():
    """A law that ends where its table ends has the table's second derivative there, not that of the line beyond."""
    x = np.linspace(0, 2, 6)
    t = table(x=x, y=x**3)
    assert t.values(0.0)[2] == pytest.approx(0, abs=1e-9)
    assert t.values(2.0)[2] == pytest.approx(12)
    assert t.values(np.nextafter(2.0, 3))[2] == 0


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("outside", OUTSIDES)
def test_numbers_arrays_complex_and_compiled_agree(kind, outside):
    t = table(kind, outside)
    data = np.r_[7.0, 7.0, t.data()]  # it may stand anywhere
    x = np.r_[np.linspace(-6, 9, 61), X]
    over = t.values(x)
    for k, at in enumerate(x.tolist()):
        f, f1, f2 = (values[k] for values in over)
        assert t.values(at) == (f, f1, f2)
        assert spline(data, 2, at) == (f, f1, f2)
        assert compiled_spline(data, 2, at) == pytest.approx((f, f1, f2), rel=1e-14, abs=1e-14)
        for how in (spline, compiled_spline):
            stepped = how(data, 2, complex(at, H))
            assert [z.imag / H for z in stepped[:2]] == pytest.approx([f1, f2], rel=1e-12, abs=1e-13)
    np.testing.assert_allclose(t.values(x + 1j * H)[0], over[0] + 1j * H * over[1], rtol=1e-12)
    assert np.shape(t.value(np.ones((2, 3)))) == (2, 3)


def test_curves_in_the_plane_share_breaks():
    """Two tables of one parameter: an ellipse, closed and smooth."""
    s = np.linspace(0, 1, 65)
    x, y = (table(outside="periodic", x=s, y=c) for c in (3 * np.cos(2 * np.pi * s), 2 * np.sin(2 * np.pi * s)))
    data = np.r_[x.data(), y.data()]
    for at in (0.0, 0.313, 1.0, 4.77):
        a, b = (np.array(spline(data, k, at)) for k in (0, len(x.data())))
        assert (a[0] / 3) ** 2 + (b[0] / 2) ** 2 == pytest.approx(1, abs=1e-6)
        assert a[1] * a[0] / 9 + b[1] * b[0] / 4 == pytest.approx(0, abs=1e-3)


@pytest.mark.parametrize("outside", OUTSIDES)
def test_symbolic(outside):
    t, s = table("monotone", outside), sympy.Symbol("s", real=True)
    f = t.value(s)
    for at in (-3.0, -0.4, 1.3, 2.4, 3.1, 5.0):
        assert float(f.subs(s, at)) == pytest.approx(t.value(at), abs=1e-12)
        if outside != "periodic":  # SymPy cannot derive a floor
            assert float(f.diff(s).subs(s, at + 0.01)) == pytest.approx(t.values(at + 0.01)[1], abs=1e-12)


def test_units_are_those_of_the_columns():
    t = table("linear", x=(0, 90), y=(0, 10), x_unit="deg", y_unit="mm")
    assert t.value(math.pi / 4) == pytest.approx(0.005)


def test_nan_stays_nan():
    t = table(outside="periodic")
    assert all(math.isnan(f) for f in t.values(math.nan))
    assert math.isnan(t.value(math.inf))
    assert np.isnan(t.value(np.array([math.nan, 1.0]))).tolist() == [True, False]
    assert all(math.isnan(f) for f in compiled_spline(np.array(t.data()), 0, math.inf))
