"""No threshold in metres, seconds or kilograms: in other units every number of a motion is the scaled one, bit by bit.

Units are powers of two of the former ones, so that converting is exact. ``python benchmarks/scales.py`` runs all
examples and 200 random mechanisms in six scales; `scales.EXEMPT` lists what may differ, and why.
"""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks"))

import scales
from fuzzing import content, scenes

from flyball.derivatives.equation_derivatives import EquationDerivatives, MechanismState, residual_rounding

pytestmark = pytest.mark.filterwarnings(
    "ignore::flyball.errors.StartWarning", "ignore::flyball.errors.PerformanceNotice"
)
SMALL_SLOW, LARGE_FAST = scales.Scale(2.0**-10, 2.0**20, 2.0**10), scales.Scale(2.0**10, 2.0**-20, 2.0**-10)
CASES = dict(scales.cases(3))
EXAMPLES = [name for name in CASES if "." in name and name not in scales.NOT_CONVERTED]
RANDOM = [f"{family} 0" for family in content.FAMILIES if family != "curves"]  # laws of constraints have no units
STEPPED = [f"{family} 2" for family in scenes.SCENES]  # by impulse time stepping
EXACT = [name for name in (*EXAMPLES, *RANDOM, *STEPPED) if not scales.is_exempt(name, "length up")]


@pytest.mark.parametrize("name", EXACT)
def test_a_motion_in_other_units_is_the_same_to_the_last_bit(name):
    m, t_end, options = CASES[name]()
    own = scales.answers(scales.scaled(m, scales.Scale()), t_end, options, scales.Scale())
    assert name in RANDOM or "error" not in own
    assert name not in STEPPED or own["method"].startswith("impulse time stepping")
    for s in (SMALL_SLOW, LARGE_FAST):
        assert not scales.differences(own, scales.answers(scales.scaled(m, s), t_end * s.time, options, s))


@pytest.mark.parametrize("name", ["dropped 0", "colliding 0", "thrown 0", "jointed 0"])
def test_default_steps_and_tolerances_scale_with_the_scene(name):
    m, t_end, _ = CASES[name]()
    own = scales.answers(scales.scaled(m, scales.Scale()), t_end, {"method": "impulse"}, scales.Scale())
    for s in (SMALL_SLOW, LARGE_FAST):
        assert not scales.differences(
            own, scales.answers(scales.scaled(m, s), t_end * s.time, {"method": "impulse"}, s)
        )


QUICK = ("assemble", "mobility", "kinematics", "linearize", "modes", "singularities", "sensitivity instant")


@pytest.mark.parametrize("name", [x for x in (*EXAMPLES, *RANDOM) if x not in (*scales.ROBOTS, *scales.LARGE)])
def test_other_analyses_in_other_units_answer_the_same(name):
    assert_the_same(name, (x for x in QUICK if (name, x) not in scales.UNDECIDED))


@pytest.mark.parametrize("name", ["bricard.toml", "newtons_cradle.py", "thin_rod.toml", "lossless 0", "couplings 0"])
def test_an_equilibrium_in_other_units_is_the_same(name):
    assert_the_same(name, ("equilibrium", "sensitivity equilibrium", "inverse_dynamics"))


def test_a_pair_of_real_eigenvalues_has_the_same_order_in_other_units():
    assert_the_same("heavy_top.toml", ("sensitivity modes",))


@pytest.mark.parametrize("name", ["slider_crank.toml", "quick_return.toml", "car_axis.toml", "toggle_press.toml"])
def test_the_rounding_of_forces_does_not_depend_on_which_numbers_are_integers(name):
    energies = []
    for s in (SMALL_SLOW, LARGE_FAST):
        a = scales.scaled(CASES[name]()[0], s).assemble()
        rounding = residual_rounding(EquationDerivatives(MechanismState.resting(a.compiled, a.t, a.q)))
        energies.append(rounding[: len(a.v)] * a.compiled.sizes / s.of("J"))
    assert np.array_equal(*energies) and energies[0].any()


def assert_the_same(name, analyses):
    m = CASES[name]()[0]
    for analysis in analyses:
        allowed = scales.ROUNDING if analysis in scales.ROUNDED else 0.0
        own, *others = (
            scales.scaled_answers.asked(analysis, scales.scaled(m, s), s)
            for s in (scales.Scale(), SMALL_SLOW, LARGE_FAST)
        )
        for other in others:
            assert not scales.differences(own, other, allowed)


@pytest.mark.parametrize("name", [name for name in STEPPED if name not in EXACT])
def test_compliant_contacts_do_not_depend_on_the_units_of_mass_and_time(name):
    units = [u for u in scales.SCALES if not scales.is_exempt(name, u)]
    assert units == ["mass up", "mass down", "time up", "time down"]
    assert dict(scales.compared(CASES[name](), units)) == {u: [] for u in units}


@pytest.mark.parametrize("name", scales.NOT_CONVERTED)
def test_what_is_left_out_cannot_be_converted(name):
    with pytest.raises(scales.Unsupported):
        scales.scaled(CASES[name]()[0], SMALL_SLOW)
