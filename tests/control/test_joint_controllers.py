"""Controllers that know a model of the robot: computed torque, PD with gravity compensation.

Closed forms: under computed torque with an exact model every error obeys e'' + kd e' + kp e = 0, for every mechanism.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import fsolve

import flyball as fb
from flyball.controllers.joint_controller import with_leaves
from flyball.expression_graph.graph import Graph
from flyball.expression_graph.tracing import law_tree
from flyball.model.expressions import Expression
from tests.control.robots import ARM, CRANE, arm, crane, decay, driven

TIGHT = {"rtol": 1e-10, "atol": 1e-12}
KP, KD = (100.0, 64.0), (20.5, 12.0)
HOLD = {"coordinates": ARM, "reference": [0.3, 0.5]}


def computed(**fields) -> fb.ComputedTorque:
    return fb.ComputedTorque("c", **({"kp": KP, "kd": KD} | HOLD | fields))


def compensated(**fields) -> fb.GravityCompensatedPD:
    return fb.GravityCompensatedPD("c", **({"kp": 80, "kd": 12} | HOLD | fields))


@pytest.mark.parametrize("specialize", [True, False])
def test_errors_of_an_arm_that_follows_functions_of_time_decay_as_set(specialize):
    run = arm(computed(reference=["sin(2*t)", "0.5*cos(t)"])).simulate(2, specialize=specialize, **TIGHT)
    assert run["c.shoulder_error"] == pytest.approx(decay(0.0, 2.0, (KP[0], KD[0]), run.t), abs=1e-8)
    assert run["c.elbow_error"] == pytest.approx(decay(0.5, 0.0, (KP[1], KD[1]), run.t), abs=1e-8)
    assert run["elbow.acceleration"] == pytest.approx(run["c.elbow_acceleration"], abs=1e-7)


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize(("length", "mass"), [(1.0, 1.0), (1e3, 1e-6)])
def test_errors_of_a_robot_in_space_decay_as_set_in_any_units(coordinates, length, mass):
    slide = f"{0.1 * length}*t"
    c = fb.ComputedTorque("c", coordinates=CRANE, reference=["t", "0.5 + 0.2*sin(t)", slide, "t**2"], kp=30, kd=11.5)
    run = crane(c, length, mass).simulate(1, coordinates=coordinates, **TIGHT)
    rates = (1.0, 0.2, 0.1 * length, 0.0)
    for k, (joint, size) in enumerate(zip(("turn", "lift", "run", "wrist"), (1.0, 1.0, length, 1.0), strict=True)):
        expected = decay((0.0, 0.2, 0.0, 0.0)[k], rates[k], (30, 11.5), run.t)
        assert run[f"c.{joint}_error"] / size == pytest.approx(expected / size, abs=1e-8)


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_linear_model_has_the_eigenvalues_of_the_errors(coordinates):
    m = arm(computed())
    rest = m.equilibrium()
    assert (rest["shoulder.angle"], rest["elbow.angle"]) == pytest.approx((0.3, 0.5), abs=1e-9)
    found = m.linearize(about=rest, coordinates=coordinates).eigenvalues
    expected = np.r_[np.roots([1, KD[0], KP[0]]), np.roots([1, KD[1], KP[1]])]
    assert np.sort_complex(found) == pytest.approx(np.sort_complex(expected), rel=1e-8)


def test_symbolic_equations_include_the_controller():
    m = arm(computed())
    found = m.symbolic(inputs=["elbow drive"]).linear(["elbow.angle"], at={"shoulder.angle": 0.3, "elbow.angle": 0.5})
    _, den = found.transfer_function().at(load=1.7)
    assert den == pytest.approx(np.polymul([1, KD[0], KP[0]], [1, KD[1], KP[1]]), rel=1e-9)


def test_sampled_controller_of_one_joint_has_the_multipliers_of_a_sampled_double_integrator():
    """q'' = u with u held: the map of one period, closed by feedback of the sampled state."""
    period = 0.05
    m = fb.Mechanism("joint", planar=True)
    m.add(fb.Body("link", mass=2, inertia=0.1, position=(0.3, 0)), fb.Revolute("A", "ground", "link", at=(0, 0)))
    c = fb.ComputedTorque("c", coordinates="A.angle", reference=0, kp=40, kd=9, period=period)
    m.add(c)
    found = driven(m, c).linearize().eigenvalues
    whole = expm(period * np.array([[0, 1, 0], [0, 0, 1], [0, 0, 0]]))
    expected = np.linalg.eigvals(whole[:2, :2] - whole[:2, 2:] * np.array([[40, 9]]))
    for multiplier in expected:
        assert np.abs(found - multiplier).min() < 1e-10


def test_sampled_control_approaches_the_continuous_one():
    reference = ["0.4*sin(t)", "0.3*t"]
    ends = [
        arm(computed(reference=reference, period=period)).simulate(1)["c.shoulder_error"][-1] for period in (4e-3, 2e-3)
    ]
    end = decay(0.0, 0.4, (KP[0], KD[0]), 1.0)
    assert 0.4 < (ends[1] - end) / (ends[0] - end) < 0.6


def test_pd_with_gravity_compensation_rests_at_its_reference():
    run = arm(compensated()).simulate(8)
    assert run["c.shoulder_error"][-1] == pytest.approx(0, abs=1e-6)
    assert run["c.elbow_error"][-1] == pytest.approx(0, abs=1e-6)
    assert str(arm(compensated()).equilibrium()).startswith("equilibrium: stable")


@pytest.mark.parametrize("known", ["0.4*load", 0.4])
def test_a_wrong_load_in_the_model_leaves_the_error_of_statics(known):
    rest = arm(compensated(parameters={"load": known})).equilibrium()

    def unbalanced(q):  # the spring of the gains carries the weight that the model does not know
        bent = 0.25 * np.cos(q[0] + q[1])
        return 80 * (np.array([0.3, 0.5]) - q) - 9.81 * 0.6 * np.array([0.5 * np.cos(q[0]) + bent, bent])

    expected = fsolve(unbalanced, [0.3, 0.5], xtol=1e-13)
    assert (rest["shoulder.angle"], rest["elbow.angle"]) == pytest.approx(expected, abs=1e-8)


def test_a_body_that_the_model_lacks_is_not_compensated():
    m = fb.Mechanism("arm", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("upper", mass=2, inertia=0.05, position=(0.25, 0)))
    m.add(fb.Body("load", mass=1, inertia=0.03, position=(0.75, 0)))
    m.add(fb.Revolute("shoulder", "ground", "upper", at=(0, 0)), fb.Fixed("grip", "upper", "load", at=(0.5, 0)))
    c = fb.GravityCompensatedPD("c", coordinates="shoulder.angle", reference=0.3, kp=80, kd=12, ignored=["load"])
    m.add(c)
    q = driven(m, c).equilibrium()["shoulder.angle"]
    assert 80 * (0.3 - q) == pytest.approx(9.81 * 0.75 * np.cos(q), abs=1e-7)


def test_a_parameter_changes_mechanism_and_model_together():
    m = arm(computed())
    heavy = m.simulate(0.5, parameters={"load": 7.0}, **TIGHT)
    assert heavy["c.elbow_error"] == pytest.approx(decay(0.5, 0.0, (KP[1], KD[1]), heavy.t), abs=1e-8)
    by_load = m.sensitivity(["elbow.angle"], ["load"], analysis="equilibrium")
    assert by_load["elbow.angle", "load"] == pytest.approx(0, abs=1e-9)


def test_legs_of_a_free_body_are_controlled_relative_to_it():
    """Two equal legs of a trunk in free fall without gravity: momentum does not change, errors decay."""
    m = fb.Mechanism("trunk", planar=True)
    m.add(fb.Body("trunk", mass=1e6, inertia=1e6))
    for side, x in (("l", -1), ("r", 1)):
        m.add(fb.Body(f"leg_{side}", mass=1, inertia=0.1, position=(x, -0.3)))
        m.add(fb.Revolute(f"hip_{side}", "trunk", f"leg_{side}", at=(x, 0)))
    c = fb.ComputedTorque("c", coordinates=["hip_l.angle", "hip_r.angle"], reference=0.2, kp=30, kd=11.5, base="trunk")
    m.add(c)
    run = driven(m, c).simulate(1, **TIGHT)
    assert run["c.hip_l_error"] == pytest.approx(decay(0.2, 0.0, (30, 11.5), run.t), abs=1e-5)


def test_model_files_keep_the_controller(tmp_path):
    for c in (computed(reference=["t", "sin(t)"], ignored=[]), compensated(parameters={"load": "0.5*load"})):
        m = arm(c)
        m.save(tmp_path / "arm.toml")
        assert fb.load(tmp_path / "arm.toml") == m


def test_impulse_time_stepping_has_controllers_without_states():
    m = arm(compensated(), fb.Ground("floor", shape=fb.Plane(normal=(0, 1)), position=(0, -5)), fb.Contact())
    run = m.simulate(0.5, method=fb.Stepping(step=1e-3))
    smooth = arm(compensated()).simulate(0.5)
    assert run["shoulder.angle"][-1] == pytest.approx(smooth["shoulder.angle"][-1], abs=2e-3)


def ball(*more):
    """A link with a hinge on a link with a ball joint."""
    m = fb.Mechanism("ball", gravity=(0, 0, -9.81))
    m.add(fb.Body("a", mass=1, inertia=(0.1, 0.2, 0.3), position=(0.3, 0, 0)))
    m.add(fb.Body("b", mass=1, inertia=(0.1, 0.2, 0.3), position=(0.6, 0, 0)))
    m.add(fb.Spherical("S", "ground", "a", at=(0, 0, 0)), fb.Revolute("R", "a", "b", at=(0.45, 0, 0), axis=(0, 1, 0)))
    c = fb.GravityCompensatedPD("c", coordinates=["R.angle", *more], reference=0, kp=10, kd=1)
    m.add(c)
    return driven(m, c)


def test_the_remedy_for_a_ball_joint():
    """Three hinges with massless bodies between them; the weight is held at the reference."""
    m = ball().changed({"c": None, "R drive": None, "S": None})
    for k, axis in enumerate(((0, 0, 1), (0, 1, 0), (1, 0, 0))):
        if k < 2:
            m.add(fb.Body(f"link{k}", mass=0, inertia=0))
        ends = ("ground", "link0", "link1", "a")[k : k + 2]
        m.add(fb.Revolute(f"S{k}", *ends, at=(0, 0, 0), axis=axis))
    angles = ["S0.angle", "S1.angle", "S2.angle", "R.angle"]
    c = fb.GravityCompensatedPD("c", coordinates=angles, reference=[0.2, -0.3, 0.1, 0.4], kp=60, kd=14)
    m.add(c)
    run = driven(m, c).simulate(8, outputs=3)
    assert [run[k][-1] for k in angles] == pytest.approx([0.2, -0.3, 0.1, 0.4], abs=1e-3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: arm(computed(coordinates=["shoulder.angle", "elbw.angle"])), "no joint named 'elbw'.*'elbow'"),
        (lambda: arm(computed(coordinates=["elbow.angle", "elbow.angle"])), "names each coordinate once"),
        (lambda: arm(computed(kp=[1, 2, 3])), "kp has 3 values for 2 coordinates"),
        (lambda: arm(computed(kd=[])), "kd has 0 values for 2 coordinates"),
        (lambda: arm(computed(ignored=["hand"])), "no body named 'hand'"),
        (lambda: arm(computed(parameters={"weight": 1})), "no parameter 'weight'"),
        (lambda: arm(computed(reference=["elbow.angle", 0])), "'elbow.angle', whose derivative.*give reference_rate"),
        (lambda: arm(computed(base="upper")).simulate(0.1), "connected with ground by 'shoulder'; leave base out"),
        (lambda: arm(computed(ignored=["upper"])).simulate(0.1), "no joints connect 'shoulder'.*give base"),
        (
            lambda: arm(compensated(coordinates="shoulder.angle", reference=0)).simulate(0.1),
            r"coordinates that it does not control: elbow.angle; add them.*ignored",
        ),
        (lambda: ball("S.roll", "S.pitch", "S.yaw").simulate(0.1), "ball joints, Spherical 'S'.*three Revolute joints"),
        (lambda: arm(computed(parameters={"load": "2 m"}), load="1 kg"), "parameter 'load' of.*'2 m': expected a mass"),
        (
            lambda: arm(computed(parameters={"load": "a"}), load="1 kg", a="2 m"),
            "parameter 'a' is '2 m': expected a mass",
        ),
        (lambda: arm(computed()).inverse_dynamics([0, 1]), "ComputedTorque 'c'"),
        (lambda: arm(computed()).prepare(), "ComputedTorque 'c'"),
    ],
)
def test_what_a_controller_of_joints_cannot_do_is_refused(make, message):
    with pytest.raises(fb.ModelError, match=f"(?s){message}"):
        make()


def test_a_loop_and_a_coupling_are_refused_by_name():
    m = fb.Mechanism("loop", planar=True)
    m.add(*(fb.Body(x, mass=1, inertia=0.1, position=(k, 0.5)) for k, x in enumerate("abc")))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=(0, 1)))
    m.add(fb.Revolute("C", "b", "c", at=(2, 1)), fb.Revolute("D", "ground", "c", at=(2, 0)))
    loop = m.copy()
    loop.add(fb.GravityCompensatedPD("pd", coordinates=["A.angle"], reference=0, kp=1, kd=1))
    loop.add(fb.Motor("motor", "A", torque="pd"))
    with pytest.raises(fb.ModelError, match=r"must form a tree, and \w+ adds constraint equations.*ignored"):
        loop.simulate(0.1)
    m.add(fb.Coupler("gear", coordinates=["A.angle", "D.angle"], weights=[1, 1], value=0))
    m.add(fb.GravityCompensatedPD("pd", coordinates=["A.angle"], reference=0, kp=1, kd=1, ignored=["b"]))
    m.add(fb.Motor("motor", "A", torque="pd"))
    with pytest.raises(fb.ModelError, match="Coupler 'gear' couples joints of its model"):
        m.simulate(0.1)


def test_a_coordinate_that_follows_from_another_is_refused():
    m = fb.Mechanism("jack", gravity=(0, 0, -9.81))
    m.add(fb.Body("nut", mass=1, inertia=(0.1, 0.1, 0.1)))
    m.add(fb.Screw("S", "ground", "nut", at=(0, 0, 0), axis=(0, 0, 1), lead=0.01))
    c = fb.GravityCompensatedPD("pd", coordinates=["S.angle", "S.displacement"], reference=0, kp=1, kd=1)
    m.add(c)
    with pytest.raises(fb.ModelError, match=r"pd'.*(S.displacement follows from|adds constraint equations)"):
        driven(m, c).simulate(0.1)


def test_a_command_is_computed_once_in_an_effort():
    """x + x y + x^2, of x = sin(t): one sine."""
    g = Graph()
    x, y = g.symbol("x"), g.symbol("y")
    tree = with_leaves(law_tree(x + x * y + x * x), {"x": Expression.parse("sin(t)").tree}, {"t"})
    assert sum(n.kind == "sin" for n in tree.walk()) == 1
    u = np.sin(0.7)
    assert Expression("effort", tree).evaluate({"t": 0.7, "y": 3.0}) == pytest.approx(u + 3 * u + u * u, rel=1e-15)


@pytest.mark.parametrize(("leaf", "times"), [("abs(t)", 1), ("abs(q)", 2), ("sin(q)", 1), ("min(q, a)", 2)])
def test_a_command_with_a_corner_in_the_motion_stays_in_sight(leaf, times):
    g = Graph()
    x = g.symbol("x")
    found = with_leaves(law_tree(x * g.symbol("y") + x), {"x": Expression.parse(leaf).tree}, {"t", "a"})
    kind = leaf.partition("(")[0]
    assert sum(n.kind == kind for n in found.walk()) == times


def test_errors_decay_as_set_where_a_gain_has_a_corner_in_the_motion():
    """Gains of q that jump by a switch at q = 0.15: two exponentials, joined where the angle passes it."""
    run = arm(computed(kp=("where(shoulder.angle < 0.15, 64, 30)", 64.0))).simulate(2, **TIGHT)
    below = run["shoulder.angle"] < 0.15
    assert below.any() and not below.all()
    kp = np.where(below, 64.0, 30.0)
    e, rate = run["c.shoulder_error"], -run["shoulder.rate"]
    away = np.abs(run["shoulder.angle"] - 0.15) > 1e-4
    expected = -KD[0] * rate - kp * e
    assert -run["shoulder.acceleration"][away] == pytest.approx(expected[away], abs=1e-6)


def test_breakpoints_of_a_reference_follow_its_parameters():
    """The second motion has another time of the ramp's end; its steps end there, not where those of the first did."""
    m = arm(computed(reference=["step(t, 0, 0, rise, 0.5)", 0.0]), rise=1.0)
    for rise in (1.0, 0.3, 1.0):
        run = m.simulate(1.5, parameters={"rise": rise}, outputs=[0.5 * rise, rise, 1.5], **TIGHT)
        s = np.minimum(run.t / rise, 1.0)
        error = run["c.shoulder_error"]
        assert error + run["shoulder.angle"] == pytest.approx(0.5 * s**2 * (3 - 2 * s), abs=1e-10)
