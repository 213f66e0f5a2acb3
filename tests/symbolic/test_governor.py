"""Watt's governor on its engine: Vyshnegradskii's criterion from the mechanism, with the balls' own inertia.

I. A. Vyshnegradskii, Sur la theorie generale des regulateurs, C. R. Acad. Sci. Paris 83 (1876) 318-321; as told by L. S.
Pontryagin, Ordinary Differential Equations (1962), section 27: with phi the arms' angle, m the mass, b the friction, F the
load, w the speed, arms of length 1 and the balls' inertia about the shaft left out,

    m phi'' = m w^2 sin(phi) cos(phi) - m g sin(phi) - b phi',   J w' = K cos(phi) - F

is stable if and only if b J / m > 2 F / w.
"""

from __future__ import annotations

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from flyball.symbolic.linear.linear_equations import linear_equations
from tests.symbolic.small import watt

NAMES = ("m", "I", "sleeve", "l", "alpha", "J", "k", "b", "W")


@pytest.fixture(scope="module")
def governor():
    return made()


def parts(found):
    """The one condition as (greater, smaller), and its symbols by name."""
    (condition,) = found.conditions
    return condition.lhs, condition.rhs, {x.name: x for x in condition.free_symbols}


def test_the_criterion_is_one_inequality(governor):
    """b W l sin^2 (J + 2 I + 2 m l^2 sin^2 + 8 m l^2 cos^2) > 2 k cos (I + m l^2 + 2 M l^2 sin^2): derived by hand.

    M is the mass of the sleeve and, by the lever, of the valve.
    """
    greater, smaller, x = parts(governor[1])
    m, I, sleeve, l, alpha, J, k, b, W = (x[n] for n in NAMES)
    s, c = sympy.sin(alpha), sympy.cos(alpha)
    wanted = b * W * l * s**2 * (J + 2 * I + 2 * m * l**2 * s**2 + 8 * m * l**2 * c**2)
    lifted = sleeve + x["valve"] / x["lever"] ** 2
    wanted -= 2 * k * c * (I + m * l**2 + 2 * lifted * l**2 * s**2)
    ratio = sympy.simplify((greater - smaller) / wanted / x["lever"] ** 2)
    assert ratio.is_number
    assert ratio > 0
    assert governor[1].zeros == 1  # the angle of the shaft


def test_the_classical_criterion_is_its_limit(governor):
    """Point balls, arms and sleeve without mass, an engine that is heavy beside them: Pontryagin's b J / m > 2 F / w.

    In his terms m is 2 m l^2 (two balls), b is 4 b l^2 sin^2 (the sleeve goes 2 l sin(alpha) as fast as the arms turn), and
    K = 2 k l, so that F = K cos(alpha).
    """
    greater, smaller, x = parts(governor[1])
    m, l, alpha, J, k, b, W = (x[n] for n in NAMES if n not in ("I", "sleeve"))
    heavy = sympy.Symbol("heavy", positive=True)
    point = (greater - smaller).subs({x["I"]: 0, x["sleeve"]: 0, x["valve"]: 0})
    classical = sympy.limit(sympy.expand(point.subs({J: heavy * J, k: heavy * k})) / heavy, heavy, sympy.oo)
    own_m, own_b, F = 2 * m * l**2, 4 * b * l**2 * sympy.sin(alpha) ** 2, 2 * k * l * sympy.cos(alpha)
    ratio = sympy.simplify(classical / (own_b * J / own_m - 2 * F / W) / x["lever"] ** 2)
    assert sympy.simplify(ratio / (W * m * l)).is_number
    assert (ratio / (W * m * l)).subs({x: 1 for x in ratio.free_symbols}) > 0
    assert not {x["I"], x["sleeve"], x["valve"]} & classical.free_symbols


@settings(max_examples=25, deadline=None)
@given(st.tuples(*[st.floats(0.1, 3.0)] * 8), st.floats(0.1, 1.4))
def test_it_holds_exactly_where_eigenvalues_are_stable(numbers, alpha):
    L, found = made()
    values = dict(zip((n for n in NAMES if n != "alpha"), numbers, strict=True)) | {"alpha": alpha}
    values["W"] *= 5.0
    w = L.eigenvalues(**values)
    w = w[np.argsort(np.abs(w))][1:]
    if np.abs(w.real).min() < 1e-7 * np.abs(w).max():
        return
    assert found.holds(**values) == (w.real.max() < 0.0)
    assert (found.left_sides(**values)[0] > 0.0) == (w.real.max() < 0.0)


def made(known=[]):  # noqa: B006 - made once
    if not known:
        L = linear_equations(watt(), balanced_by=["g"])
        known += [L, L.routh()]
    return known


def test_at_the_limit_the_numeric_mechanism_swings_for_ever(governor):
    """On the boundary the compiled mechanism's linearisation has a pair on the imaginary axis."""
    L, found = governor
    greater, smaller, x = parts(found)
    own = {x[n]: sympy.Float(v, 20) for n, v in L.parameters.items() if n in x and n != "b"}
    b = float(sympy.solve((greater - smaller).subs(own), x["b"])[0])
    N = watt(b=b, **L.balance(b=b)).linearize(coordinates="joint")
    w = N.eigenvalues[N.eigenvalues.imag > 1e-3]
    assert len(w) == 1
    assert abs(w[0].real) < 1e-9 * abs(w[0])
    assert found.holds(b=1.001 * b)
    assert not found.holds(b=0.999 * b)
