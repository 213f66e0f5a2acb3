"""Points of studies: SciPy's, at the distributions that were asked for."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from scipy.stats import qmc

from flyball.studies.sampling import sample_points
from tests.study.rigs import oscillator

VARY = {"k": (50.0, 150.0), "mass": "normal(2, 0.1)"}


def drawn(design, vary=VARY, samples=64, seed=3):
    return sample_points(oscillator(), vary, design, samples, seed)[0]


def test_grids_run_through_the_last_first():
    x, axes = sample_points(oscillator(), {"k": [1, 2], "mass": [3, 4, 5]}, "grid", None, None)
    assert x.tolist() == [[1, 3], [1, 4], [1, 5], [2, 3], [2, 4], [2, 5]]
    assert [a.tolist() for a in axes] == [[1, 2], [3, 4, 5]]
    x, axes = sample_points(oscillator(), {"k": [1, 2], "mass": [3, 4]}, "list", None, None)
    assert x.tolist() == [[1, 3], [2, 4]]
    assert axes == ()


def test_a_latin_hypercube_has_one_point_in_each_stratum():
    x = drawn("latin", samples=50)
    k = np.sort(np.floor((x[:, 0] - 50.0) / 2.0))
    assert k.tolist() == list(range(50))
    assert np.sort(np.floor(stats.norm(2, 0.1).cdf(x[:, 1]) * 50)).tolist() == list(range(50))


def test_points_of_sobol_are_scipys():
    try:
        u = qmc.Sobol(2, rng=np.random.default_rng(3)).random(64)
    except TypeError:
        u = qmc.Sobol(2, seed=np.random.default_rng(3)).random(64)
    np.testing.assert_array_equal(drawn("sobol"), np.c_[50.0 + 100.0 * u[:, 0], stats.norm(2, 0.1).ppf(u[:, 1])])


def test_monte_carlo_and_its_seed():
    x = drawn("random", samples=4000)
    assert stats.kstest(x[:, 0], stats.uniform(50, 100).cdf).pvalue > 0.01
    assert stats.kstest(x[:, 1], stats.norm(2, 0.1).cdf).pvalue > 0.01
    np.testing.assert_array_equal(x, drawn("random", samples=4000))
    assert (x != drawn("random", samples=4000, seed=4)).all()
    np.testing.assert_array_equal(drawn("random", seed=None), drawn("random", seed=0))


@pytest.mark.parametrize(
    ("law", "same"),
    [
        ("uniform(1, 3)", stats.uniform(1, 2)),
        ("loguniform(1, 100)", stats.loguniform(1, 100)),
        ("lognormal(5, 0.2)", stats.lognorm(0.2, scale=5)),
        (stats.triang(0.3, 1, 2), stats.triang(0.3, 1, 2)),
        (("1 N/m", "0.003 N/mm"), stats.uniform(1, 2)),
        ("normal(5 N/m, 0.001 N/mm)", stats.norm(5, 1)),
    ],
)
def test_distributions(law, same):
    u = np.random.default_rng(3).random((8, 1))[:, 0]
    np.testing.assert_allclose(drawn("random", {"k": law}, samples=8)[:, 0], same.ppf(u), rtol=1e-14)


def test_crossed_samples():
    """A, B, and A with one column of B (Saltelli et al. 2010, table 2)."""
    x = drawn("saltelli", samples=8).reshape(4, 8, 2)
    A, B, first, second = x
    np.testing.assert_array_equal(first, np.c_[B[:, 0], A[:, 1]])
    np.testing.assert_array_equal(second, np.c_[A[:, 0], B[:, 1]])
    assert (A != B).all()
