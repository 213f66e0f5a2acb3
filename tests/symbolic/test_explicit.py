"""Explicit equations and state space: against closed forms and the numeric engine's accelerations."""

import numpy as np
import pytest

import flyball as fb
from flyball.symbolic.explicit.linear_systems import Determinants, solve_blocks, solve_symmetric
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


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_reactions_of_a_pendulum(coordinates):
    """m (a - g) at the hinge, a of the centre of mass along the circle and towards its middle."""
    found = pendulum().symbolic(coordinates=coordinates).explicit()
    (name,) = found.independent
    m, l, g = 2.0, 0.7, 9.81
    for angle, rate in ((0.3, 0.0), (-2.0, 3.0)):
        s, c = np.sin(angle), np.cos(angle)
        turned = -m * g * l * s / (0.1 + m * l * l)
        expected = m * (l * turned * np.array([c, s]) + l * rate**2 * np.array([-s, c]) + np.array([0.0, g]))
        reaction = [float(found[k].at({name: angle, f"{name}'": rate})) for k in ("A.fx", "A.fy")]
        np.testing.assert_allclose(reaction, expected, rtol=1e-12)


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_what_a_driver_needs(coordinates):
    """Torque and power that turn a pendulum by 2 t + t^2 / 2."""
    m = pendulum()
    m.add(fb.Driver("motor", "A.angle", law="2*t + 0.5*t**2"))
    found = m.symbolic(coordinates=coordinates).explicit()
    for t in (0.0, 0.7):
        torque = 0.1 + 2.0 * 0.7**2 + 2.0 * 9.81 * 0.7 * np.sin(2 * t + 0.5 * t * t)
        assert float(found["motor.effort"].at({"t": t})) == pytest.approx(torque, rel=1e-12)
        assert float(found["motor.power"].at({"t": t})) == pytest.approx(torque * (2 + t), rel=1e-12)


def flat(length):
    """A parallelogram in space, drawn as a line."""
    m = fb.Mechanism("flat", gravity=(0, 0, 0))
    at = lambda x: (x * length, 0, 0)  # noqa: E731
    for name, x in (("a", 0.5), ("b", 2.0), ("c", 2.5)):
        m.add(fb.Body(name, mass=1, inertia=(length**2,) * 3, position=at(x)))
    for name, i, j, x in (("A", "ground", "a", 0), ("B", "a", "b", 1), ("C", "b", "c", 3), ("D", "ground", "c", 2)):
        m.add(fb.Revolute(name, i, j, at=at(x), axis=(0, 0, 1)))
    return m


@pytest.mark.parametrize("length", [1e3, 1.0, 1e-3, 1e-6])
@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_singular_positions_are_refused_in_every_size(length, coordinates):
    """Rows in metres and in radians stand side by side: neither is drowned by the other."""
    eq = flat(length).symbolic(coordinates=coordinates)
    with pytest.raises(fb.SingularityError, match="singular position"):
        eq.explicit()
    with pytest.raises(fb.ModelError, match="singular position"):
        eq.linear([])


@pytest.mark.parametrize("n", range(1, 7))
def test_small_systems_are_solved(n):
    """Cramer's rule, orthogonalisation, L D L^T: of full matrices of numbers."""
    rng = np.random.default_rng(n)
    A, B = rng.normal(size=(n, n)), rng.normal(size=(n, 2))
    found = solve_blocks(A.astype(object), B.astype(object), Determinants())
    np.testing.assert_allclose(found.astype(float), np.linalg.solve(A, B), rtol=1e-10, atol=1e-12)
    M = A @ A.T + np.eye(n)
    found = solve_symmetric(M.astype(object), B.astype(object), Determinants())
    np.testing.assert_allclose(found.astype(float), np.linalg.solve(M, B), rtol=1e-10, atol=1e-12)
