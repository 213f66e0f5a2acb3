"""m.symbolic(): whatever a result has, as an expression that gives the same number; symbols, refusals, what is shown."""

import dataclasses
import sys

import numpy as np
import pytest

import flyball as fb
from flyball.errors import ModelError
from flyball.expression_graph.graph import Graph, nodes_in_order
from flyball.expression_graph.tracing import parameter_symbols
from tests import mechanisms
from tests.contract import zoo
from tests.examples.test_examples import EQUATIONS
from tests.identities.test_complex_values import with_forces
from tests.symbolic.states import random_state

NO_FUNCTION = ("work", "balance")  # integrals along the motion


def same_as_results(m, coordinates):
    """Every quantity of every part at a random state."""
    eq, result, values = random_state(m, coordinates)
    checked = 0
    for part in result.parts():
        names = [f"{part}.{k}" for k in result[part].names if k not in NO_FUNCTION]
        if f"{part}.e0" not in eq.named:
            names = [n for n in names if not n.endswith(".quaternion")]
        numbers = {n: np.asarray(result.channel(n)[1])[0] for n in names}
        size = max([1.0, *(np.abs(x).max() for x in numbers.values())])
        for name, number in numbers.items():
            found = eq[name].at(values)
            if name.endswith(".quaternion"):
                found = found * np.sign(found @ number)
            elif eq[name].unit == "rad" and not m.planar:
                found = number + np.angle(np.exp(1j * (found - number)))  # in (-pi, pi]
            np.testing.assert_allclose(found, number, rtol=1e-10, atol=1e-11 * size, err_msg=name)
            assert eq[name].unit == result.channel(name)[0]
            checked += 1
    assert checked > 10


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize("name", EQUATIONS)
def test_quantities_of_examples(name, coordinates):
    same_as_results(mechanisms.example(name), coordinates)


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize(("where", "name"), zoo.CASES)
def test_quantities_of_joints(where, name, coordinates):
    same_as_results(zoo.joined(where, name), coordinates)


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize("make", [lambda: with_forces("plane"), lambda: with_forces("space")])
def test_quantities_of_forces(make, coordinates):
    try:
        same_as_results(make(), coordinates)
    except fb.AnalysisError as error:  # friction that joint coordinates do not know
        assert coordinates == "joint" and "friction" in str(error)


def pendulum(**options):
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, "-g"), parameters={"l": 1.2, "mass": 2.0, "g": "9.81 m/s^2"})
    m.add(fb.Body("rod", mass="mass", inertia="mass*l**2/12", com=("l/2", 0)))
    m.add(fb.Revolute("hinge", "ground", "rod", at=(0, 0)))
    m.add(fb.Motor("motor", "hinge", torque=0.0))
    return m, m.symbolic(**options)


def test_a_pendulum_reads_as_in_a_textbook():
    """m l^2/3 phi'' = tau - m g l/2 cos phi; its hinge carries the weight and what the centre's acceleration takes."""
    sympy = pytest.importorskip("sympy")
    _, eq = pendulum(inputs=["motor"])
    phi, l, mass, g, u = (eq.expression(n).sympy() for n in ("hinge.angle", "l", "mass", "g", "motor"))
    w, a = eq.expression("hinge.angle'").sympy(), eq.expression("hinge.angle''").sympy()
    assert sympy.simplify(eq.M[0, 0].sympy() - mass * l**2 / 3) == 0
    assert sympy.simplify(eq.f[0].sympy() - u + mass * g * l / 2 * sympy.cos(phi)) == 0
    assert sympy.simplify(eq["energy.kinetic"].sympy() - mass * l**2 * w**2 / 6) == 0
    force = eq["hinge.force"].sympy()
    x, y = l / 2 * sympy.cos(phi), l / 2 * sympy.sin(phi)
    second = [sympy.diff(c, phi) * a + sympy.diff(c, phi, 2) * w**2 for c in (x, y)]
    assert sympy.simplify(force[0] - mass * second[0]) == 0
    assert sympy.simplify(force[1] - mass * (second[1] + g)) == 0


def test_symbols_are_values_of_the_coordinates_as_users_know_them():
    """An angle that is drawn at 0.4 is 0.4 there: offsets are in the equations, as expressions of parameters."""
    m = fb.Mechanism("p", planar=True, gravity=(0, -9.81), parameters={"drawn": 0.4})
    m.add(fb.Body("rod", mass=1.0, inertia=0.1, position=(0.5, 0)))
    m.add(fb.Revolute("hinge", "ground", "rod", at=(0, 0), angle="drawn"))
    eq = m.symbolic()
    assert eq.start["hinge.angle"] == 0.4
    at = eq.start | {"hinge.angle": 0.4 + 0.3}
    np.testing.assert_allclose(eq["rod.position"].at(at), 0.5 * np.array([np.cos(0.3), np.sin(0.3)]), rtol=1e-14)
    np.testing.assert_allclose(eq["rod.x"].at(at | {"drawn": 0.7}), 0.5, rtol=1e-14)


def test_drivers_are_rows_in_both_coordinates():
    m = mechanisms.example("slider_crank.toml")
    for coordinates in ("joint", "absolute"):
        eq = m.symbolic(coordinates=coordinates)
        k = eq.lam.rows.index("motor.effort")
        assert eq.g.at(eq.start | {"t": 0.0})[k] == pytest.approx(0.0, abs=1e-14)
        driven = eq["A.rate"].at(eq.start)
        assert eq.nu.at(eq.start)[k] == pytest.approx(driven)


def test_angles_are_plain_in_the_plane():
    """No arc tangent and no counting of turns, whichever coordinates the equations are in."""
    for name in ("slider_crank.toml", "quick_return.toml", "planetary.py"):
        for coordinates in ("joint", "absolute"):
            eq = mechanisms.example(name).symbolic(coordinates=coordinates)
            found = [eq.g, eq.f, eq.gamma, *(eq[f"{j.name}.{k}"] for j in eq.model.joints for k in j.measured(True))]
            operations = {x.op for e in found for x in nodes_in_order(e.list())}
            assert not operations & {"atan2", "rounded"}


def test_values_are_refused_by_name():
    m, eq = pendulum()
    with pytest.raises(ModelError, match=r"has no symbol 'hinge.angel'.*hinge\.angle"):
        eq.M.at({"hinge.angel": 0.2})
    with pytest.raises(ModelError, match=r"no value is given for hinge\.angle"):
        eq.f.at({})
    with pytest.raises(ModelError, match="no function of the state"):
        eq["energy.balance"]
    with pytest.raises(ModelError, match="has no input 'hinge'"):
        m.symbolic(inputs=["hinge"])
    with pytest.raises(ModelError, match="coordinates"):
        m.symbolic(coordinates="polar")
    with pytest.raises(ModelError, match="supports no contact"):
        mechanisms.example("dominoes.py").symbolic()


def test_a_python_function_is_a_named_function_without_a_derivative():
    def push(t):
        return 2.0 * t

    m = fb.Mechanism("pushed", planar=True)
    m.add(fb.Body("cart", mass=1.0, inertia=1.0), fb.PointForce("push", "cart", force=(push, 0), at=(0, 0)))
    eq = m.symbolic()
    assert eq.f.at(eq.start | {"t": 3.0})[0] == 6.0
    assert "push" in str(eq.f[0])
    with pytest.raises(ModelError, match="'push' is not known"):
        eq.f.diff("t")


def test_arithmetic_and_calculus():
    _, eq = pendulum(coordinates="absolute")
    assert eq.M["rod.angle'", "rod.angle'"].at({}) == pytest.approx(2.0 * 1.2**2 / 12)
    rates = eq.g.jacobian(eq.q) @ eq.T
    at = eq.start | {"rod.angle": 0.3}
    np.testing.assert_allclose(rates.at(at), eq.G.at(at), atol=1e-15)
    rest = eq.residual.replaced({"rod.com_x''": 1.0, "rod.com_y''": 0.0, "rod.angle''": 0.0})
    np.testing.assert_allclose(
        rest.at(at | {"hinge.lam_nx": 2.0, "hinge.lam_ny": 2.0 * 9.81}),
        [0.0, 0.0, 1.2 * np.sin(0.3) * -1.0 + 1.2 * np.cos(0.3) * 9.81],
        atol=1e-13,
    )
    assert float(eq.expression("l")) == 1.2 and eq.M.T.shape == (3, 3)
    with pytest.raises(ModelError, match=r"no entry 'rod\.z'"):
        eq.f["rod.z"]


def test_every_number_may_be_a_symbol_or_none():
    """Called after its field; the equations are the same, and masses then are where they belong."""
    m = mechanisms.example("slider_crank.toml")
    every, some, none = (m.symbolic(names=names) for names in ("all", "parameters", "none"))
    assert {"crank.mass", "rod.mass", "slider.mass", "spring.stiffness", "g"} < set(every.parameters)
    assert not none.parameters and set(some.parameters) == set(m.parameters)
    at = {k: x + 0.1 for k, x in some.start.items()}
    for name in ("M", "f", "g", "G", "gamma"):
        told = getattr(some, name).at(at)
        np.testing.assert_allclose(getattr(every, name).at(at), told, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(getattr(none, name).at(at), told, rtol=1e-12, atol=1e-12)
    rod = dataclasses.replace(m["rod"], mass=2.5)
    heavier = m.copy()
    heavier.replace(rod)
    told = heavier.symbolic().M.at(at)
    np.testing.assert_allclose(every.M.at(at | {"rod.mass": 2.5}), told, rtol=1e-12, atol=1e-12)
    with pytest.raises(ModelError, match="must be one of parameters, all, none"):
        m.symbolic(names="some")


def test_what_is_shown():
    _, eq = pendulum()
    assert str(eq.M) == "[ mass*l^2/3 ]"
    assert r"\frac{1}{3}" in eq.M[0, 0].latex() and "l^{2}" in eq.M[0, 0].latex()
    lines = dict(eq.lines())
    assert lines["q"] == "hinge.angle" and lines["lam"] == "none: no constraints"
    assert lines["parameters"] == "l = 1.2, mass = 2, g = 9.81"
    assert repr(eq) == "<equations of 'pendulum' in joint coordinates>"
    assert "too long" in str(mechanisms.example("stewart.py").symbolic().f)


def test_without_sympy(monkeypatch):
    """Everything but SymPy's own expressions goes on; these say in one line what to install."""
    monkeypatch.setitem(sys.modules, "sympy", None)
    _, eq = pendulum()
    assert str(eq.f) and eq.M.latex() and eq.M.at(eq.start).shape == (1, 1)
    with pytest.raises(ImportError, match=r"pip install 'flyball\[symbolic\]'"):
        eq.M.sympy()


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_angles_that_are_measured_against_their_coordinate(coordinates):
    """Springs about both axes of a universal joint, the second of which is measured the other way round."""
    m = fb.Mechanism("cross", gravity=(0, 0, -9.81))
    m.add(fb.Body("b", mass=1.0, inertia=(0.2, 0.3, 0.4), position=(0.3, 0.2, -0.5)))
    m.add(fb.Universal("U", "ground", "b", at=(0, 0, 0), axes=((1, 0, 0), (0, 1, 0))))
    m.add(fb.CoordinateSpring("first", "U.angle_1", stiffness=5.0))
    m.add(fb.CoordinateSpring("second", "U.angle_2", stiffness=7.0))
    p, eq = m.prepare(coordinates=coordinates), m.symbolic(coordinates=coordinates)
    r = p.simulate(0.5, outputs=4)
    for t, q, v in zip(r.t[1:], r.q[1:], r.v[1:], strict=True):
        np.testing.assert_allclose(eq.f.at(eq.state(float(t), q, v)), p.forces(float(t), q, v), rtol=0, atol=1e-12)


def test_why_these_coordinates_is_told():
    m = mechanisms.four_bar()
    assert m.symbolic().coordinates.startswith("joint: these make the fewest equations")
    assert m.symbolic(coordinates="joint").coordinates.startswith("joint: as requested")


def test_parameters_with_a_unit_are_symbols_and_derived_ones_are_expressions_of_them():
    m = fb.Mechanism("o", planar=True, parameters={"k": "100 N/m", "x": 0.1, "n": "3", "twice": "2*k"})
    found = parameter_symbols(m, Graph())
    assert list(found) == ["k", "x", "n"]
    assert all(node.op == "symbol" for node in found.values())


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_coordinates_that_are_drawn_at_other_values_than_zero(coordinates):
    """An angle of 0.3 rad, from which a spring turns, and a displacement of 0.2 m as drawn."""
    m = fb.Mechanism("drawn", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("a", mass=2.0, inertia=0.1, position=(0.2, 0.0)))
    m.add(fb.Body("b", mass=1.0, inertia=0.05, position=(0.5, -0.4), angle=0.3))
    m.add(fb.Prismatic("P", "ground", "a", at=(0.2, 0), axis=(1, 0), displacement=0.2))
    m.add(fb.Revolute("A", "a", "b", at=(0.2, 0.0), angle=0.3))
    m.add(fb.CoordinateSpring("s", "A.angle", stiffness=3.0), fb.CoordinateSpring("k", "P.displacement", stiffness=5.0))
    same_as_results(m, coordinates)
