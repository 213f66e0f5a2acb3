"""Energies to equations of motion: Lagrange's are Newton's and Euler's, as symbols and as numbers."""

import numpy as np
import pytest

import flyball as fb
from tests import mechanisms
from tests.contract import zoo
from tests.examples.test_examples import EQUATIONS
from tests.identities.test_complex_values import with_forces
from tests.symbolic.states import random_state


def same_numbers(m, coordinates):
    eq, _, values = random_state(m, coordinates)
    made = eq.lagrange()
    for name in ("M", "f"):
        a, b = (np.asarray(getattr(x, name).at(values), float) for x in (made, eq))
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-12 * max(1.0, np.abs(b).max(initial=0.0)), err_msg=name)


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize("name", EQUATIONS)
def test_numbers_of_examples(name, coordinates):
    same_numbers(mechanisms.example(name), coordinates)


@pytest.mark.parametrize(("where", "name"), [("space", "Spherical"), ("space", "Universal"), ("plane", "Prismatic")])
def test_numbers_of_joints(where, name):
    same_numbers(zoo.joined(where, name), "joint")


@pytest.mark.filterwarnings("ignore:invalid value")
@pytest.mark.parametrize("where", ["plane", "space"])
def test_numbers_of_every_force(where):
    same_numbers(with_forces(where), "absolute")


def cart_pole():
    m = fb.Mechanism("cart-pole", planar=True, gravity=(0, "-g"), parameters=dict(M=1.0, m=0.3, l=0.5, J=0.02, g=9.81))
    m.add(fb.Body("cart", mass="M", inertia=1.0))
    m.add(fb.Body("pole", mass="m", inertia="J", position=(0, "l")))
    m.add(fb.Prismatic("rail", "ground", "cart", at=(0, 0), axis=(1, 0)), fb.Revolute("pin", "cart", "pole", at=(0, 0)))
    m.add(fb.Actuator("push", "rail.displacement", force=0.0))
    return m


def chain(masses):
    names = [f"{k}{i}" for i in (1, 2) for k in ("l", "m")]
    m = fb.Mechanism("chain", planar=True, gravity=(0, "-g"), parameters=dict.fromkeys(names, 1.0) | {"g": 9.81})
    inertia = ("m1*l1**2/12", "m2*l2**2/12") if masses else (0.0, 0.0)
    m.add(fb.Body("a", mass="m1", inertia=inertia[0], position=("l1/2" if masses else "l1", 0)))
    m.add(fb.Body("b", mass="m2", inertia=inertia[1], position=("l1 + l2/2" if masses else "l1 + l2", 0)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=("l1", 0)))
    if masses:
        m.add(fb.Motor("drive", "A", torque="2*t"), fb.Motor("elbow", "B", torque="-0.1*rate"))
    return m


@pytest.mark.parametrize(
    "m",
    [cart_pole(), chain(False), chain(True), mechanisms.example("slider_crank.toml")],
    ids=["cart-pole", "double pendulum", "2R arm", "slider-crank"],
)
def test_the_difference_is_nothing(m):
    """With multipliers and without: every entry of the difference simplifies to zero."""
    for coordinates in ("joint", "absolute"):
        eq = m.symbolic(coordinates=coordinates, inputs=["push"] if m.name == "cart-pole" else [])
        difference = (eq.lagrange().residual - eq.residual).simplified()
        rest = [x for x in difference.list() if x != 0.0]
        if rest:
            sympy = pytest.importorskip("sympy")
            rest = [e for e in map(sympy.simplify, eq.printer(rest)) if e != 0]
        assert rest == []
