"""Transfer functions with symbolic coefficients: equal to textbooks', and to the numeric linearisation."""

from __future__ import annotations

import numpy as np
import pytest
import sympy

import flyball as fb
from flyball.expression_graph.graph import Graph
from flyball.symbolic.linear.linear_equations import linear_equations
from flyball.symbolic.linear.polynomials import PolynomialRing
from tests.analyses.made import chain
from tests.symbolic.small import ball_on_beam, cart, quarter_car, two_masses, watt

LAYERS = ("joint", "absolute")


def rational(text: str, f) -> bool:
    """Whether a transfer function is what a text says."""
    known = {x.name: x for x in f.expression.free_symbols} | {"s": f.s}
    names = {
        k: known.get(k, sympy.Symbol(k))
        for k in ("M", "m", "l", "J", "g", "R", "Jb", "m1", "m2", "k1", "k2", "c", "k", "body", "wheel", "tyre")
    }
    return sympy.simplify(sympy.sympify(text, {**names, **known}) - f.expression) == 0


def agrees(f, N, rel=1e-10):
    """Coefficients, poles, zeros and frequency response are those of `LinearModel`, what was cancelled put back."""
    zeros, poles, gain = N.transfer(f.input, f.output)
    own = {f.s: sympy.Symbol("s")} | {
        x: sympy.Float(f.parameters[x.name], 25) for x in f.cancelled.free_symbols - {f.s}
    }
    common = sympy.Poly(sympy.sympify(f.cancelled).subs(own), sympy.Symbol("s")).all_coeffs()
    common = np.array([float(c) for c in common])
    num, den = f.at()
    whole = np.polymul(den, common / common[0])
    wanted = np.real(np.poly(poles))
    assert whole == pytest.approx(wanted, rel=rel, abs=rel * np.abs(wanted).max())
    above = np.polymul(num, common / common[0])
    wanted = gain * np.real(np.poly(zeros)) if len(zeros) else np.array([gain])
    assert above == pytest.approx(wanted, rel=rel, abs=rel * np.abs(wanted).max())
    w = np.array([0.3, 1.7, 11.0, 47.0])
    assert f.response_at(w) == pytest.approx(N.response(w, f.input, f.output), rel=rel)
    for p in f.poles():
        assert np.abs(poles - p).min() < 1e-6 * (1.0 + abs(p))
    for z in f.zeros():
        assert np.abs(zeros - z).min() < 1e-6 * (1.0 + abs(z))


@pytest.mark.parametrize("layer", LAYERS)
def test_pendulum_on_a_cart(layer):
    L = linear_equations(cart(), ["push.x"], ["cart.x", "pin.angle"], coordinates=layer)
    N = cart().linearize(["push.x"], ["cart.x", "pin.angle"])
    x, angle = (L.transfer_function("push.x", k) for k in ("cart.x", "pin.angle"))
    agrees(x, N)
    agrees(angle, N)
    assert rational("m*l/((J*(M + m) + M*m*l**2)*s**2 - (M + m)*m*g*l)", angle)
    assert rational("((J + m*l**2)*s**2 - m*g*l)/(((J*(M + m) + M*m*l**2)*s**2 - (M + m)*m*g*l)*s**2)", x)
    assert angle.cancelled == angle.s**2  # where the cart is means nothing to the angle


def test_two_masses():
    L = linear_equations(two_masses(), ["push.x"], ["first.x", "second.x"])
    N = two_masses().linearize(["push.x"], ["first.x", "second.x"])
    den = "((m1*s**2 + c*s + k1 + k2)*(m2*s**2 + c*s + k2) - (c*s + k2)**2)"
    first, second = (L.transfer_function("push.x", k) for k in ("first.x", "second.x"))
    assert rational(f"(m2*s**2 + c*s + k2)/{den}", first)
    assert rational(f"(c*s + k2)/{den}", second)
    agrees(first, N)
    agrees(second, N)


def test_quarter_car_over_a_road():
    """The road is the law of a driver: G = tyre (c s + k) / ... from the road to the car."""
    L = linear_equations(quarter_car(), ["profile"], ["car.y"])
    f = L.transfer_function()
    assert rational("tyre*(c*s + k)/((wheel*s**2 + c*s + k + tyre)*(body*s**2 + c*s + k) - (c*s + k)**2)", f)
    agrees(f, quarter_car().linearize(["profile"], ["car.y"]))


@pytest.mark.parametrize("layer", LAYERS)
def test_ball_on_a_beam(layer):
    """x'' (m + Jb/R^2) ... : the ball runs down by m g / (m + Jb / R^2) times the tilt, rolling; the beam reacts."""
    L = linear_equations(ball_on_beam(), ["drive"], ["groove.displacement"], coordinates=layer)
    f = L.transfer_function()
    agrees(f, ball_on_beam().linearize(["drive"], ["groove.displacement"]))
    assert len(f.den) == 5


def test_governor_with_engine():
    L = linear_equations(watt(), ["steam"], ["shaft.angle_rate"], balanced_by=["g"])
    f = L.transfer_function()
    N = watt(**L.balance()).linearize(["steam"], ["shaft.angle_rate"], coordinates="joint")
    agrees(f, N)
    assert [len(x) for x in (f.num, f.den)] == [3, 4]


def test_values_of_parameters_without_a_new_derivation():
    f = linear_equations(two_masses(), ["push.x"], ["second.x"]).transfer_function()
    other = {"m1": 3.0, "m2": 0.2, "k1": 7.0, "k2": 90.0, "c": 1.1}
    w = np.array([0.5, 3.0, 30.0])
    N = two_masses(**other).linearize(["push.x"], ["second.x"])
    assert f.response_at(w, **other) == pytest.approx(N.response(w), rel=1e-11)
    assert f.response_at(w) == pytest.approx(two_masses().linearize(["push.x"], ["second.x"]).response(w), rel=1e-11)


def test_outputs_may_follow_rates_of_inputs():
    """No state space has the acceleration of what a driver moves; a transfer function does."""
    L = linear_equations(quarter_car(), ["profile"], ["road.ay"])
    f = L.transfer_function()
    assert f.expression == f.s**2
    with pytest.raises(fb.AnalysisError, match="second rate of input 'profile'"):
        _ = L.B


def test_shown_and_handed_on():
    f = linear_equations(cart(), ["push.x"], ["pin.angle"]).transfer_function()
    text = repr(f)
    assert "numerator: l*m" in text
    assert "cancelled: s**2" in text
    assert f.latex().startswith(r"G(s) = \frac{l m}{")
    assert f._repr_latex_().startswith("$")
    control = pytest.importorskip("control")
    g = f.to_control()
    assert np.sort(g.poles().real) == pytest.approx(np.sort(f.poles().real), rel=1e-12)
    assert isinstance(g, control.TransferFunction)
    assert len(f.bode().axes) >= 2


def test_what_is_refused(monkeypatch):
    L = linear_equations(cart(), ["push.x"], ["pin.angle"])
    with pytest.raises(fb.ModelError, match="no input 'pull'"):
        L.transfer_function("pull")
    with pytest.raises(fb.ModelError, match="without any"):
        linear_equations(cart(), ["push.x"]).transfer_function()
    with pytest.raises(fb.ModelError, match="no parameter 'mass'"):
        L.transfer_function().at(mass=3.0)
    with monkeypatch.context() as fewer:
        fewer.setattr("flyball.symbolic.linear.polynomials.MAX_ORDER", 5)
        with pytest.raises(fb.ModelError, match=r"are 6 with their constraints, .* up to 5: use numbers"):
            linear_equations(chain(6)).routh()
    monkeypatch.setattr("flyball.symbolic.linear.polynomials.MAX_TERMS_OF_ENTRY", 10)
    with pytest.raises(fb.ModelError, match=r"have \d+ operations in their coefficients, .* up to 10: use numbers"):
        linear_equations(cart()).routh()
    monkeypatch.setattr("flyball.symbolic.linear.polynomials.MAX_TERMS_OF_ENTRY", 4000)
    monkeypatch.setattr("flyball.symbolic.linear.polynomials.MAX_TERMS", 2)
    with pytest.raises(fb.ModelError, match=r"minors of \d+ terms, .* up to 2: give numbers"):
        linear_equations(cart()).routh()


def test_what_a_parameter_that_is_zero_now_multiplies_stays():
    """A damping that is zero as told, with a long number before it: no rounding."""
    g = Graph()
    k, d = g.symbol("k", 100.0), g.symbol("d", 0.0)
    ring = PolynomialRing([np.array([[0.5 * k + 0.0123456789123 * d]], object)], "it", [])
    x = ring.matrices[0][0, 0]
    (told,) = ring.by_powers(x.numer.mul_ground(1 / x.denom.LC))
    assert len(told) == 2


def test_what_does_not_answer_is_said_so():
    """A weight that hangs straight down is not lifted, to first order, by a torque."""
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, "-g"), parameters={"g": 9.81, "l": 1.0, "u": 0.0})
    m.add(fb.Body("rod", mass=1.0, inertia=0.1, position=(0, "-l")))
    m.add(fb.Revolute("hinge", "ground", "rod", at=(0, 0)), fb.PointTorque("motor", "rod", torque="u"))
    L = m.symbolic(inputs=["motor"]).linear(["rod.y", "rod.x"])
    assert "0: to first order the output does not depend" in str(L.transfer_function("motor", "rod.y"))
    assert "denominator" in str(L.transfer_function("motor", "rod.x"))
    with pytest.raises(fb.ModelError, match="must be a mapping of coordinates"):
        m.symbolic().linear(at="drawn")


def test_a_mechanism_without_parameters_is_stable_or_not():
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("rod", mass=1.0, inertia=0.1, position=(0, -1)), fb.Revolute("hinge", "ground", "rod", at=(0, 0)))
    m.add(fb.CoordinateSpring("friction", "hinge.angle", stiffness=0.0, damping=0.3))
    found = m.symbolic().linear().routh()
    assert found.holds()
    assert str(found) == "stable: always"
