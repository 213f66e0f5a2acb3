"""Explicit equations and state space: against closed forms and the numeric engine's accelerations."""

import numpy as np
import pytest

from tests.analyses.linkages import four_bar_driven
from tests.mechanisms import bricard, four_bar, free_body, spatial_four_bar
from tests.symbolic.explicit_made import cart_pole, differs, pendulum, states_of


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_pendulum(coordinates):
    s = states_of(pendulum(), coordinates)
    name = "A.angle" if coordinates == "joint" else "rod.angle"
    assert s.states == (name, f"{name}'")
    for angle, rate in ((0.3, 0.0), (-2.0, 3.0)):
        x = np.array([angle, rate])
        expected = -2.0 * 9.81 * 0.7 * np.sin(angle) / (0.1 + 2.0 * 0.7**2)
        np.testing.assert_allclose(s.evaluate(x)[0], [rate, expected], rtol=1e-13)


def test_cart_pole():
    """Accelerations of a pendulum on a cart: x and theta from vertical, counterclockwise."""
    s = states_of(cart_pole(), inputs=["push.x"])
    assert s.inputs == ("push.x",)
    assert s.states == ("rail.displacement", "pin.angle", "rail.displacement'", "pin.angle'")
    rng = np.random.default_rng(0)
    M, mb, l, g = 1.3, 0.4, 0.6, 9.81
    for x in rng.uniform(-3, 3, (20, 4)):
        c, w = np.cos(x[1]), x[3]
        F = rng.uniform(-9, 9)
        mass = np.array([[M + mb, mb * l * c], [mb * l * c, mb * l * l]])
        right = np.array([F + mb * l * np.sin(x[1]) * w * w, -mb * g * l * np.sin(x[1])])
        found = s.evaluate(x, [F])[0]
        np.testing.assert_allclose(found, [*x[2:], *np.linalg.solve(mass, right)], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize("made", [four_bar, four_bar_driven, spatial_four_bar, free_body, bricard])
def test_accelerations_are_the_engines_at_the_start(made, coordinates):
    if made is bricard and coordinates == "absolute":
        pytest.skip("as in joint coordinates, and slow")
    m = made()
    s = states_of(m, coordinates)
    assert differs(m, s, coordinates, s.start) < 1e-12
