"""Coefficients of the integrators: the published ones, and of the order that they are called by."""

import numpy as np
import pytest

from flyball.numerics.integrators.tableaux import TABLEAUX, tableau


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


@pytest.mark.parametrize("name", TABLEAUX)
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
