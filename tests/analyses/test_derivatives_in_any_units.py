"""Derivatives by complex steps and by differences do not depend on the units of length, mass and time."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks"))

import scales

import flyball as fb
from flyball.derivatives.equation_derivatives import COMPLEX_STEP, complex_step_derivative
from flyball.sensitivity.parameter_derivatives import difference_derivative
from flyball.sensitivity.sensitivity import entry_units

CASES = dict(scales.cases(0))


def test_what_the_third_order_leaves_is_dropped_and_small_derivatives_are_kept():
    x = np.array([0.0, 3.0]) + 1j * COMPLEX_STEP
    assert complex_step_derivative(x**3).tolist() == [0.0, pytest.approx(27.0)]
    assert complex_step_derivative(1e-60 * x**3).tolist() == [0.0, pytest.approx(27e-60)]
    assert complex_step_derivative(np.zeros(2, complex)).tolist() == [0.0, 0.0]


@pytest.mark.parametrize("name", ["double_wishbone.toml", "spatial_four_bar.toml", "pendulum_chain.py"])
@pytest.mark.parametrize("analysis", ["linearize", "modes", "sensitivity instant"])
def test_inertias_of_1e_minus_45_have_the_same_linear_equations(name, analysis):
    m, small = CASES[name]()[0], scales.Scale(length=2.0**-70)
    own, other = (scales.scaled_answers.asked(analysis, scales.scaled(m, s), s) for s in (scales.Scale(), small))
    assert "error" not in own
    assert not scales.differences(own, other, scales.ROUNDING)


def test_differences_are_as_exact_for_a_number_in_another_unit():
    m = fb.Mechanism("any", parameters={"p": 1.0})

    def found(env):
        return np.array([1e9 * env["p"] ** 2, np.sin(300.0 * env["p"])])

    exact = np.array([2e9, 300.0 * np.cos(300.0)])
    assert difference_derivative(m, {}, "p", found, np.array([1e9, 1.0])) == pytest.approx(exact, rel=1e-8)


def test_units_of_the_entries_of_a_matrix_follow_those_of_its_states():
    rng = np.random.default_rng(0)
    A, T = rng.normal(size=(6, 6)), 2.0 ** rng.integers(-40, 40, 6)
    for scaled in (A, A / T[:, None] * T):
        assert 1e-2 < np.abs(scaled / entry_units(scaled)).max() < 1e2
