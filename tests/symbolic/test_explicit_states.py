"""State space: outputs, inputs, implicit coordinates, derivatives, other libraries' integrators, and what is refused."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flyball as fb
from flyball.expression_graph.graph import Graph
from flyball.symbolic.explicit.definitions import Definition, ImplicitSolver
from tests.analyses.linkages import four_bar_driven
from tests.mechanisms import bricard, door, example, four_bar, planar_rod
from tests.symbolic.explicit_made import cart_pole, differs, pendulum, states_of


@pytest.mark.parametrize("make", [bricard, lambda: example("double_wishbone.toml")], ids=["Bricard", "double wishbone"])
def test_coordinates_without_formula_are_found_by_newtons_method(make):
    """Accelerations at 20 states of a spatial loop, whose constraints hold to rounding."""
    m = make()
    s = states_of(m, "joint")
    assert len(s.implicit) >= 4 and "Newton's method" in s.explicit.notes[0]
    for move in np.random.default_rng(0).uniform(-0.1, 0.1, (20, 2)):
        x = s.start + move
        assert np.abs(s.equations.g.at(s.point(x))).max() < 1e-14
        assert differs(m, s, "joint", x) < 1e-12


def test_implicit_functions_have_their_exact_derivatives():
    """A = df/dx through dw/dx = -(dr/dw)^-1 dr/dx, against central differences of the numbers."""
    s = states_of(bricard(), "joint", outputs=["R2.angle"])
    x = s.start + [0.1, 0.3]
    A, C = (s.jacobian(y).at(s.point(x)) for y in (s.f, s.h))
    h = 1e-6
    for k in range(2):
        up, down = (s.evaluate(x + sign * h * np.eye(2)[k]) for sign in (1, -1))
        np.testing.assert_allclose(A[:, k], (up[0] - down[0]) / (2 * h), rtol=1e-7, atol=1e-7)
        np.testing.assert_allclose(C[:, k], (up[1] - down[1]) / (2 * h), rtol=1e-7, atol=1e-7)


def test_branch_ends():
    """w^2 + u^2 = 1: the branch below is followed up to u = 1, its end, and none is told beyond."""
    g = Graph()
    u, w = g.symbol("u"), g.symbol("w")
    lower = ImplicitSolver(Definition((w,), (), (w * w + u * u - 1.0,)), {"u": 0.0, "w": -1.0})
    for x in (0.5, -0.9, 0.999999):
        assert lower({"u": x})["w"] == pytest.approx(-np.sqrt(1 - x * x), rel=1e-12)
    with pytest.raises(fb.SingularityError, match=r"w cannot be followed to u = 1.1"):
        lower({"u": 1.1})
    assert lower({"u": 0.0})["w"] == -1.0


def test_what_stands_still_is_not_independent():
    with pytest.raises(
        fb.ModelError, match=r"'lower pivot.angle' is not independent at the start: nothing moves along"
    ):
        example("double_wishbone.toml").symbolic(coordinates="joint").explicit(["lower pivot.angle"])


def test_outputs_are_those_of_a_simulation():
    """Coordinates, reactions of rows and tree joints, energies, sensors; solve_ivp takes the state space as it is."""
    m = four_bar()
    outputs = ["D.angle", "coupler.x", "C.fx", "A.fy", "energy.kinetic", "rocker.alpha"]
    s = states_of(m, "joint", ["A.angle"], outputs=outputs)
    assert s.outputs == tuple(outputs) and s.states == ("A.angle", "A.angle'")
    run = m.simulate(0.3, rtol=1e-11, atol=1e-12, outputs=4)
    found = solve_ivp(s, (0.0, 0.3), s.start, t_eval=run.t, rtol=1e-10, atol=1e-12)
    for k, x in enumerate(found.y.T):
        expected = [run.curve(name)[1][k] for name in outputs]
        np.testing.assert_allclose(s.evaluate(x)[1], expected, rtol=1e-6, atol=1e-6)


def test_inputs_of_forces_and_parameters():
    s = states_of(cart_pole(), inputs=["push.x", "g"], outputs=["pin.angle"])
    x, u = [0.1, 0.7, -0.3, 0.9], [3.0, 1.62]
    same = s.evaluate(x, [0.0, 9.81], parameters={"F": 3.0, "g": 1.62})[0]
    np.testing.assert_allclose(s.evaluate(x, u)[0], s.evaluate(x, [3.0, 1.62])[0])
    assert np.abs(same - s.evaluate(x)[0]).max() > 0.1
    B = s.jacobian(s.f, s.inputs).at(s.point(x, u))
    step = np.array([(s.evaluate(x, u + h)[0] - s.evaluate(x, u - h)[0]) / 2e-3 for h in 1e-3 * np.eye(2)]).T
    np.testing.assert_allclose(B, step, rtol=1e-9, atol=1e-9)


def test_an_input_that_moves_a_driver_has_rates():
    """A pendulum whose support is driven: theta'' = -(g sin theta + a cos theta) / l for a point mass."""
    m = fb.Mechanism("driven", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("cart", mass=2, inertia=1), fb.Body("bob", mass=1, inertia=1e-30, position=(0, -0.5)))
    m.add(fb.Prismatic("rail", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.Revolute("pin", "cart", "bob", at=(0, 0)))
    m.add(fb.Driver("shaker", "rail.displacement", "0.1*sin(3*t)"))
    s = states_of(m, "joint", inputs=["shaker"], outputs=["cart.x", "cart.vx", "shaker.effort"])
    assert s.inputs == ("shaker", "shaker'", "shaker''") and s.states == ("pin.angle", "pin.angle'")
    t, angle, u = 0.4, 0.8, np.array([0.3, 0.7, -2.0])
    x, y = s.evaluate([angle, 0.2], u, t)
    a = -0.9 * np.sin(3 * t) + u[2]
    assert x[1] == pytest.approx(-(9.81 * np.sin(angle) + a * np.cos(angle)) / 0.5, rel=1e-12)
    assert y[:2] == pytest.approx([0.1 * np.sin(3 * t) + 0.3, 0.3 * np.cos(3 * t) + 0.7], rel=1e-12)
    effort = 3 * a + 0.5 * (x[1] * np.cos(angle) - 0.2**2 * np.sin(angle))
    assert y[2] == pytest.approx(effort, rel=1e-12)


def test_friction_of_joints_returns_itself():
    """A block on a rail with friction mu (m g): the load of the joint is found with the state."""
    m = fb.Mechanism("block", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("block", mass=2, inertia=0.1, velocity=(1, 0)))
    m.add(fb.Translational("rail", "ground", "block", at=(0, 0), axis=(1, 0)))
    m.add(fb.JointFriction("friction", "rail", static=0.3, stribeck_speed=1.0))
    s = states_of(m, "absolute")
    speed = 1.0
    assert s.evaluate([0.0, speed])[0][1] == pytest.approx(-0.3 * 9.81, rel=1e-3)
    assert differs(m, s, "absolute", [0.0, speed]) < 1e-10


def test_redundant_constraints():
    """Motion is determined, what two hinges of a door share is not, their sum is."""
    s = states_of(door(), "absolute", independent=())
    e = s.explicit
    assert e.solution.undetermined == ("upper", "lower")
    with pytest.raises(fb.ModelError, match=r"'upper.fz' is not determined: redundant constraints \(upper, lower\)"):
        e["upper.fz"]
    assert differs(door(), s, "absolute", s.start + np.r_[np.zeros(len(s.start) - 1), 2.0]) < 1e-12


def test_explicit_equations_tell_what_they_are():
    e = four_bar().symbolic().explicit(["A.angle"])
    assert e.dependent == ("B.angle", "D.angle") or set(e.dependent) >= {"D.angle"}
    text = str(e)
    assert "independent: A.angle" in text and "branch" in text and "dyad of two turning links" in text
    assert e.M.shape == (1, 1) and e.Z["D.angle"].shape == (1,)
    assert set(e.determinants) >= {"inertia of A.angle"}
    # transmission: Z is the derivative of the formula
    at = {"A.angle": 0.4}
    slope = e["D.angle"].diff("A.angle").at(at)
    assert e.Z["D.angle"].at(at)[0] == pytest.approx(float(slope), rel=1e-12)


@pytest.mark.parametrize(
    ("make", "independent", "message"),
    [
        (four_bar, ["A.angel"], r"no coordinate 'A.angel'.*did you mean 'A.angle'"),
        (four_bar, ["A.angle", "D.angle"], "'D.angle' is not independent of A.angle"),
        (four_bar, ["A.angle", "A.angle"], "names 'A.angle' twice"),
        (four_bar_driven, ["A.angle"], "'A.angle' is not independent: 'motor' gives it"),
        (cart_pole, ["pin.angle"], "has 2 freedoms, and independent names 1; add others, such as rail.displacement"),
    ],
)
def test_wrong_names(make, independent, message):
    with pytest.raises(fb.ModelError, match=message):
        make().symbolic(coordinates="joint").explicit(independent)


def test_two_drivers_of_one_freedom():
    m = four_bar_driven()
    m.add(fb.Driver("other", "D.angle", "0*t"))
    with pytest.raises(fb.FlyballError, match=r"motor|other"):
        m.symbolic().state_space()


def test_singular_positions_are_refused():
    """A parallelogram that is drawn stretched."""
    m = fb.Mechanism("stretched", planar=True, gravity=(0, -9.81))
    for name, p, q in (("a", (0, 0), (1, 0)), ("b", (1, 0), (3, 0)), ("c", (2, 0), (3, 0))):
        m.add(planar_rod(name, p, q))
    for name, i, j, at in (("A", "ground", "a", 0), ("B", "a", "b", 1), ("C", "b", "c", 3), ("D", "ground", "c", 2)):
        m.add(fb.Revolute(name, i, j, at=(at, 0)))
    with pytest.raises(fb.SingularityError, match="singular position at t = 0 s: the constraints of C are dependent"):
        m.symbolic(coordinates="joint").explicit()


def test_closed_form_may_be_asked_for():
    with pytest.raises(fb.ModelError, match=r"no closed form: R1.angle.*4 equations of R4.*Leave out closed"):
        bricard().symbolic(coordinates="joint").explicit(closed=True)
    assert not four_bar().symbolic().explicit(closed=True).implicit


def test_python_functions_have_values_and_no_derivatives():
    m = pendulum()
    m.add(fb.Motor("brake", "A", torque=lambda rate: -0.2 * rate))
    s = states_of(m, "joint")
    inertia = 0.1 + 2.0 * 0.7**2
    expected = (-2.0 * 9.81 * 0.7 * np.sin(0.3) - 0.2 * 1.5) / inertia
    assert s.evaluate([0.3, 1.5])[0][1] == pytest.approx(expected, rel=1e-12)
    with pytest.raises(fb.ModelError, match=r"derivative of .* is not known.*give the law as a text"):
        s.jacobian(s.f)


def test_wrong_numbers_and_outputs():
    s = states_of(pendulum(), "joint")
    with pytest.raises(fb.ModelError, match=r"2 numbers are wanted for the states \(A.angle, A.angle'\), not 3"):
        s.evaluate([0.0, 0.0, 0.0])
    with pytest.raises(fb.ModelError, match="0 numbers are wanted for the inputs"):
        s.evaluate([0.0, 0.0], [1.0])
    with pytest.raises(fb.ModelError, match=r"output 'A.force' is"):
        states_of(pendulum(), outputs=["A.force"])
    with pytest.raises(fb.ModelError, match=r"no .*angel"):
        states_of(pendulum(), outputs=["A.angel"])
    with pytest.raises(fb.ModelError, match="changes constraints"):
        states_of(example("slider_crank.toml"), inputs=list(example("slider_crank.toml").parameters)[:1] or ["r"])
