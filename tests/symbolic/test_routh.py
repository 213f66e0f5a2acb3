"""Routh's and Hurwitz's conditions: those of textbooks, and true exactly where eigenvalues say so."""

from __future__ import annotations

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

import flyball as fb
from flyball.symbolic.linear.linear_equations import linear_equations
from flyball.symbolic.linear.polynomials import PolynomialRing
from flyball.symbolic.linear.stability_conditions import is_hurwitz, stability_conditions
from tests.analyses.classical import CAPSIZE, WEAVE, bicycle, column, stand
from tests.symbolic.small import cart, quarter_car

UNSURE = 1e-6  # real parts that eigenvalues of a computer do not tell from zero


def of_polynomial(n: int):
    """Conditions for a_0 s^n + ... + a_n, all coefficients symbols."""
    from flyball.expression_graph.graph import Graph

    g = Graph()
    a = np.array([[g.symbol(f"a{k}", 1.0) for k in range(n + 1)]], object)
    ring = PolynomialRing([a], "polynomial", [])
    p = sum((x.numer * ring.ring.gens[0] ** (n - k) for k, x in enumerate(ring.matrices[0][0])), ring.ring.zero)
    return stability_conditions(ring, p, "polynomial", ({f"a{k}": 1.0 for k in range(n + 1)}, {}), ())


def test_third_and_fourth_order():
    a = sympy.symbols("a0:5", real=True)
    cubic = {sympy.expand(c.lhs - c.rhs) for c in of_polynomial(3).conditions}
    assert sympy.expand(a[1] * a[2] - a[0] * a[3]) in cubic
    assert {a[0], a[3]} < cubic
    assert len(cubic) == 4
    quartic = {sympy.expand(c.lhs - c.rhs) for c in of_polynomial(4).conditions}
    assert sympy.expand(a[1] * a[2] * a[3] - a[0] * a[3] ** 2 - a[1] ** 2 * a[4]) in quartic


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 6])
def test_conditions_hold_where_roots_are_stable(n):
    """Any signs of the coefficients: polynomials of random roots on both sides."""
    found = of_polynomial(n)
    rng = np.random.default_rng(n)
    seen = set()
    for _ in range(300):
        pairs = rng.normal(-0.7, 1.0, n // 2) + 1j * rng.normal(0.0, 2.0, n // 2)
        roots = np.r_[pairs, pairs.conj(), rng.normal(-0.7, 1.0, n % 2)]
        a = np.real(np.poly(roots)) * rng.choice([0.3, 4.0])
        stable = bool((roots.real < 0.0).all())
        if np.abs(roots.real).min() < UNSURE:
            continue
        values = {f"a{k}": x for k, x in enumerate(a.tolist())}
        assert all(x > 0.0 for x in found.left_sides(**values)) == stable == is_hurwitz(a)
        seen.add(stable)
    assert seen == {True, False}


@settings(max_examples=60, deadline=None)
@given(st.tuples(*[st.floats(0.05, 20.0)] * 4), st.floats(-3.0, 3.0))
def test_conditions_of_a_mechanism_on_random_numbers(positive, gain):
    """A pendulum on a cart held up by a spring and a force that follows it, damped or driven by its rate."""
    L, found = held()
    k, b, m, l = positive
    values = {"k": 10.0 * k, "b": b * 0.2, "m": m, "l": l, "p": gain}
    w = L.eigenvalues(**values)
    w = w[np.argsort(np.abs(w))][2:]  # where the cart is means nothing
    if np.abs(w.real).min() < UNSURE * np.abs(w).max():
        return
    assert found.holds(**values) == (w.real.max() < 0.0)
    assert all(x > 0.0 for x in found.left_sides(**values)) == (w.real.max() < 0.0)


def held(known=[]):  # noqa: B006 - made once
    if not known:
        p = {"M": 2.0, "m": 0.5, "l": 0.3, "J": 0.02, "g": 9.81, "k": 5.0, "b": 0.4, "p": 0.5}
        m = cart()
        m.parameters.update(p)
        m.add(fb.CoordinateSpring("spring", "pin.angle", stiffness="k", damping="b"))
        m.add(fb.Sensor("tilt", "pin.angle"))
        m.replace(fb.PointForce("push", "cart", at=(0, 0), force=("p*tilt", "0")))
        L = linear_equations(m)
        known += [L, L.routh(positive=["M", "m", "l", "J", "g", "k", "b"])]
    return known


def test_bicycle_between_weave_and_capsize():
    """The benchmark bicycle's limits are the roots of its conditions in the speed."""
    found = linear_equations(bicycle()).routh()
    v = sympy.Symbol("v", real=True)
    limits = [
        r
        for c in found.conditions
        for r in sympy.real_roots(sympy.nsimplify(c.subs({x: v for x in c.free_symbols}).lhs - c.rhs))
        if r > 0
    ]
    limits = [float(x) for x in limits]
    assert min(abs(x - WEAVE) for x in limits) < 1e-9
    assert min(abs(x - CAPSIZE) for x in limits) < 1e-9
    for v, stable in ((4.2, False), (4.4, True), (5.9, True), (6.1, False)):
        assert found.holds(v=v) == stable


def test_stand_and_quarter_car():
    """A damped rod stands from k = m g l / 2 on; a quarter car is stable for all parameters."""
    (condition,) = linear_equations(stand(0.2)).routh().conditions
    (k,) = condition.free_symbols
    assert sympy.solveset(condition.lhs - condition.rhs, k) == {sympy.Rational(981, 200)}
    found = linear_equations(quarter_car()).routh()
    assert found.conditions == ()
    assert {str(x) for x in found.positive} == {"body", "wheel", "k", "c", "tyre"}
    assert "always" in repr(found)


def test_without_damping_nothing_is_asymptotically_stable():
    found = linear_equations(cart(), at={"pin.angle": np.pi}).routh()
    assert found.conditions == (sympy.false,)
    assert not found.holds()
    assert "never" in repr(found)


def test_a_force_that_follows():
    """Ziegler's column with equal dampers: flutter from P = 1.4643 k / l on (41/28; Herrmann and Jong 1965)."""
    found = linear_equations(column(2, True, 0.1)).routh()
    small = 1e-6
    assert found.holds(c=small, P=41 / 28 - 1e-3)
    assert not found.holds(c=small, P=41 / 28 + 1e-3)


def test_what_is_refused():
    with pytest.raises(fb.ModelError, match="no parameter 'mass'"):
        linear_equations(cart()).routh().holds(mass=2.0)
