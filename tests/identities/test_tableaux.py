"""Coefficients of the integrators: the published ones, and of the order that they are called by."""

import numpy as np
import pytest

from flyball.numerics.integrators.butcher_tableaux import TABLEAUX, tableau


@pytest.mark.parametrize(("name", "order"), [("rk45", 5), ("dop853", 8)])
def test_quadrature_and_row_sum_conditions(name, order):
    """Butcher's simplifying conditions: stages stand at c, and b integrates powers of t up to the order."""
    R = tableau(name)
    stages = R.order_i[1]
    b, c = R.A[stages, :stages], R.c[:stages]
    np.testing.assert_allclose(R.A.sum(axis=1), R.c, atol=4e-14)
    for k in range(order):
        assert b @ c**k == pytest.approx(1 / (k + 1), abs=2e-14)
    assert abs(b @ c**order - 1 / (order + 1)) > 1e-8
    assert b @ R.A[:stages, :stages] @ c == pytest.approx(1 / 6, abs=2e-14)


@pytest.mark.parametrize("name", TABLEAUX)
def test_dense_output_ends_at_the_step_and_follows_polynomials(name):
    R = tableau(name)
    np.testing.assert_allclose(R.P.sum(axis=1)[: R.order_i[1]], R.A[R.order_i[1], : R.order_i[1]], atol=2e-13)
    np.testing.assert_allclose(R.E.sum(axis=1), 0.0, atol=2e-13)  # the error of a constant slope is none
    for x in (0.3, 0.8):
        weights = R.P @ x ** np.arange(1, R.P.shape[1] + 1)
        for k in range(R.P.shape[1]):
            assert weights @ R.c**k == pytest.approx(x ** (k + 1) / (k + 1), abs=1e-13)


@pytest.mark.parametrize("name", ["rk45", "dop853"])
def test_numbers_are_those_of_scipy(name):
    integrate = pytest.importorskip("scipy.integrate")
    R, other = tableau(name), {"rk45": integrate.RK45, "dop853": integrate.DOP853}[name]
    stages = R.order_i[1]
    theirs = other.A[:, :stages]
    assert np.array_equal(R.A[:stages, : theirs.shape[1]], theirs)
    assert np.array_equal(R.A[stages, :stages], other.B)
    if name == "rk45":
        assert np.array_equal(R.E[0], other.E)
        assert np.array_equal(R.P, other.P)
        return
    assert np.array_equal(R.A[13:], other.A_EXTRA)
    assert np.array_equal(R.E[:, :13], [other.E5, other.E3])
    # SciPy nests its interpolant: y + x (F0 + (1 - x) (F1 + x (...)))
    K, x = np.linspace(-1.0, 2.0, 16) ** 3, 0.37
    dy = other.B @ K[:12]
    F, y = [dy, K[0] - dy, 2 * dy - (K[0] + K[12]), *(other.D @ K)], 0.0
    for i, f in enumerate(reversed(F)):
        y = (y + f) * (x if i % 2 == 0 else 1 - x)
    assert R.P @ x ** np.arange(1, 8) @ K == pytest.approx(y, rel=1e-13)


def on_the_test_equation(R, z):
    """Of y' = lambda y, y = 1, z = h lambda: y at the end, how far the dense output is off, and what is said of both."""
    K = np.zeros(R.order_i[2], complex)
    for i in range(len(K)):
        K[i] = z * (1.0 + R.A[i, :i] @ K[:i])
    last = R.order_i[1]
    x = np.linspace(0.0, 1.0, 101)
    u = 1.0 + K @ R.P @ x ** np.arange(1, R.P.shape[1] + 1)[:, None]
    e, damped, said, less = (abs(w @ K[: len(w)]) for w in (*R.E, *R.D))
    step = e**2 / np.hypot(e, 0.1 * damped)
    between = said**3 / (said**2 + less**2) if said > 0.0 else 0.0
    return abs(1.0 + R.A[last] @ K), abs(u - np.exp(z * x)).max(), step, between


@pytest.mark.parametrize("argument", [1.0, 0.9, 0.75, 0.6, 0.5])
def test_what_is_said_of_the_dense_output_is_so(argument):
    """All over the left half of the plane, as far as the method is stable; where rk45 says nothing its step does."""
    for width in np.linspace(2.0, 6.5, 19):
        end, off, step, between = on_the_test_equation(tableau("dop853"), width * np.exp(1j * np.pi * argument))
        assert 0.85 * off < between < 1.35 * off
    for width in np.linspace(0.1, 3.5, 18):
        end, off, step, between = on_the_test_equation(tableau("rk45"), width * np.exp(1j * np.pi * argument))
        assert between == 0.0
        assert end > 1.5 or off < 2.5 * step


def test_errors_of_steps_say_nothing_of_the_dense_output_where_stability_limits_them():
    end, off, step, _ = on_the_test_equation(tableau("dop853"), -6.0)
    assert end < 0.5
    assert off > 50.0 * step
    for width in (0.5, 1.0, 2.0, 3.0):
        _, off, step, _ = on_the_test_equation(tableau("dop853"), -width)
        assert off < 3.0 * step


EMBEDDED_ORDER = {"rk45": 4, "dop853": 5}
BUILT_IN = tuple(TABLEAUX)  # other tests define methods


def test_every_method_has_an_order_of_its_embedded_solution():
    assert set(EMBEDDED_ORDER) == {name for name in BUILT_IN if tableau(name).E.any()}


@pytest.mark.parametrize(("name", "order"), EMBEDDED_ORDER.items())
def test_order_conditions_of_the_embedded_solution(name, order):
    """The error estimate E is b less the weights of a solution of lower order (Hairer, Norsett and Wanner, II.2)."""
    R = tableau(name)
    stages = R.order_i[1]
    b = np.zeros(len(R.c))
    b[:stages] = R.A[stages, :stages]
    weights, A, c = b - R.E[0], R.A, R.c
    for k in range(order):
        assert weights @ c**k == pytest.approx(1 / (k + 1), abs=2e-13)
    assert abs(weights @ c**order - 1 / (order + 1)) > 1e-6
    for value, expected in (
        (weights @ A @ c, 1 / 6), (weights @ (c * (A @ c)), 1 / 8), (weights @ A @ c**2, 1 / 12), (weights @ A @ A @ c, 1 / 24),
    ):  # fmt: skip
        assert value == pytest.approx(expected, abs=2e-13)
