"""Tables: curves through points, against closed forms, SciPy, and each other's derivatives."""

import math

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline, PchipInterpolator

from flyball.math.spline import spline
from flyball.model.table import Table
from tests.compiled import compiled

KINDS = ["cubic", "monotone", "linear"]
BEYOND = ["refuse", "line", "hold", "repeat"]
X = (-1.0, 0.2, 0.5, 1.3, 2.0, 3.1)
Y = (0.4, 1.0, 0.8, -0.7, -0.7, 0.4)
H = 1e-30


@compiled
def compiled_spline(data, at, x):
    return spline(data, at, x)


def table(interpolation="cubic", beyond="line", x=X, y=Y, **units):
    return Table("curve", x=x, y=y, interpolation=interpolation, beyond=beyond, **units)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("beyond", BEYOND)
def test_goes_through_its_points(kind, beyond):
    np.testing.assert_allclose(table(kind, beyond).values(np.array(X))[0], Y, atol=1e-14)


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
        errors.append(abs(table(kind, "repeat", x, np.sin(x)).values(at)[0] - np.sin(at)).max())
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.25)


def test_cubic_has_two_continuous_derivatives_and_monotone_one():
    eps = 1e-9
    for kind, smooth in (("cubic", 3), ("monotone", 2), ("linear", 1)):
        for beyond in BEYOND:
            t = table(kind, beyond)
            inner = np.array(X[1:-1])
            if beyond == "repeat":
                inner = np.r_[X[0], inner, X[-1], X[-1] + 5 * (X[-1] - X[0])]
            before, after = t.values(inner - eps), t.values(inner + eps)
            for a, b in list(zip(before, after, strict=True))[:smooth]:
                np.testing.assert_allclose(a, b, atol=1e-6)


def test_cubic_and_monotone_are_those_of_scipy():
    x = np.linspace(X[0], X[-1], 101)
    for made, reference in (
        (table(), CubicSpline(X, Y)),
        (table("monotone"), PchipInterpolator(X, Y)),
        (table(beyond="repeat"), CubicSpline(X, Y, bc_type="periodic")),
    ):
        for k, values in enumerate(made.values(x[1:])):
            np.testing.assert_allclose(values, reference(x[1:], k), atol=1e-12)


@settings(max_examples=30, deadline=None, derandomize=True, database=None)
@given(st.lists(st.floats(-5, 5), min_size=2, max_size=8), st.sampled_from(BEYOND))
def test_monotone_stays_between_its_points(y, beyond):
    y = [*y, y[0]] if beyond == "repeat" else y
    x = np.cumsum(1.0 + 0.5 * np.sin(np.arange(len(y))))
    t = table("monotone", beyond, x, y)
    for k in range(len(y) - 1):
        f = t.values(np.linspace(x[k], x[k + 1], 9))[0]
        assert min(y[k : k + 2]) - 1e-12 <= f.min()
        assert f.max() <= max(y[k : k + 2]) + 1e-12


@pytest.mark.parametrize("kind", KINDS)
def test_outside(kind):
    far = np.array([X[0] - 2.5, X[-1] + 4.0])
    ends = np.array([X[0], X[-1]])
    f, f1, f2 = table(kind, "line").values(far)
    at_end, slope, _ = table(kind, "line").values(ends)
    np.testing.assert_allclose(f, at_end + slope * (far - ends))
    np.testing.assert_allclose(f1, slope)
    assert not f2.any()
    f, f1, f2 = table(kind, "hold").values(far)
    assert f.tolist() == [Y[0], Y[-1]]
    assert not f1.any()
    assert not f2.any()
    x = np.linspace(X[0], X[-1], 31)[:-1]
    turns = np.array([[-3], [0], [2], [1000]])
    repeated = table(kind, "repeat").values(x + turns * (X[-1] - X[0]))
    for found, expected in zip(repeated, table(kind, "repeat").values(x), strict=True):
        np.testing.assert_allclose(found, np.broadcast_to(expected, found.shape), atol=1e-9)


def test_the_ends_count_as_inside():
    """A law that ends where its table ends has the table's second derivative there, not that of the line beyond."""
    x = np.linspace(0, 2, 6)
    t = table(x=x, y=x**3)
    assert t.values(0.0)[2] == pytest.approx(0, abs=1e-9)
    assert t.values(2.0)[2] == pytest.approx(12)
    assert t.values(np.nextafter(2.0, 3))[2] == 0


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("beyond", BEYOND)
def test_numbers_arrays_complex_and_compiled_agree(kind, beyond):
    t = table(kind, beyond)
    data = np.r_[7.0, 7.0, t.data()]  # it may stand anywhere
    x = np.r_[np.linspace(-6, 9, 61), X]
    over = t.values(x)
    for k, at in enumerate(x.tolist()):
        f, f1, f2 = (values[k] for values in over)
        if math.isnan(f):
            assert beyond == "refuse"
            assert not X[0] <= at <= X[-1]
            assert np.isnan([t.values(at), spline(data, 2, at), compiled_spline(data, 2, at)]).all()
            continue
        assert t.values(at) == (f, f1, f2)
        assert spline(data, 2, at) == (f, f1, f2)
        assert compiled_spline(data, 2, at) == pytest.approx((f, f1, f2), rel=1e-14, abs=1e-14)
        for how in (spline, compiled_spline):
            stepped = how(data, 2, complex(at, H))
            assert [z.imag / H for z in stepped[:2]] == pytest.approx([f1, f2], rel=1e-12, abs=1e-13)
    np.testing.assert_allclose(t.values(x + 1j * H)[0].imag / H, over[1], rtol=1e-12, atol=1e-13)
    assert np.shape(t.value(np.ones((2, 3)))) == (2, 3)


def test_curves_in_the_plane_share_breaks():
    """Two tables of one parameter: an ellipse, closed and smooth."""
    s = np.linspace(0, 1, 65)
    x, y = (table(beyond="repeat", x=s, y=c) for c in (3 * np.cos(2 * np.pi * s), 2 * np.sin(2 * np.pi * s)))
    data = np.r_[x.data(), y.data()]
    for at in (0.0, 0.313, 1.0, 4.77):
        a, b = (np.array(spline(data, k, at)) for k in (0, len(x.data())))
        assert (a[0] / 3) ** 2 + (b[0] / 2) ** 2 == pytest.approx(1, abs=1e-6)
        assert a[1] * a[0] / 9 + b[1] * b[0] / 4 == pytest.approx(0, abs=1e-3)


@pytest.mark.parametrize("beyond", BEYOND)
def test_symbolic(beyond):
    t, s = table("monotone", beyond), sympy.Symbol("s", real=True)
    f = t.value(s)
    for at in (-3.0, -0.4, 1.3, 2.4, 3.1, 5.0):
        assert float(f.subs(s, at)) == pytest.approx(t.value(at), abs=1e-12, nan_ok=True)
        if beyond != "repeat" and not math.isnan(t.value(at + 0.01)):  # SymPy cannot derive a floor
            assert float(f.diff(s).subs(s, at + 0.01)) == pytest.approx(t.values(at + 0.01)[1], abs=1e-12, nan_ok=True)


@pytest.mark.parametrize("kind", KINDS)
def test_rounding_is_not_beyond_the_ends(kind):
    """A thousandth of a millionth of the width is still inside, and as smooth as the piece next to it."""
    t = table(kind, "refuse")
    inside, width = table(kind, "line"), X[-1] - X[0]
    for end, out in ((X[0], -width), (X[-1], width)):
        at_end = np.array(inside.values(end))
        near = np.array(t.values(end + 0.9e-9 * out))
        np.testing.assert_allclose(near, at_end, atol=1e-7)
        assert np.isnan(t.values(end + 1.1e-9 * out)).all()
    assert t.values(X[-1])[2] == pytest.approx(inside.values(X[-1])[2], abs=1e-9)
    narrow = table(kind, "refuse", x=(1e6, 1e6 + 1e-6, 1e6 + 2e-6), y=(0, 1, 0))
    assert not np.isnan(narrow.values(np.nextafter(1e6, 0))).any()


def test_units_are_those_of_the_columns():
    t = table("linear", x=(0, 90), y=(0, 10), x_unit="deg", y_unit="mm")
    assert t.value(math.pi / 4) == pytest.approx(0.005)


def test_nan_stays_nan():
    t = table(beyond="repeat")
    assert all(math.isnan(f) for f in t.values(math.nan))
    assert math.isnan(t.value(math.inf))
    assert np.isnan(t.value(np.array([math.nan, 1.0]))).tolist() == [True, False]
    assert all(math.isnan(f) for f in compiled_spline(np.array(t.data()), 0, math.inf))
