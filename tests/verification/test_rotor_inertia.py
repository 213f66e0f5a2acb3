"""Inertia of rotors: against rotors that are bodies with gears, flywheels, closed forms, and MuJoCo's armature."""

import numpy as np
import pytest

import flyball as fb
from flyball.errors import ModelError

REFLECTED = {"A": 0.4, "B": 0.02}  # [kg m^2]


def arm(*parts):
    """Two links in space, hinged to each other and to the ground."""
    m = fb.Mechanism("arm")
    m.gravity = (0.0, 0.0, -9.81)
    m.add(
        fb.Body("a", mass=2, com=(0.25, 0, 0), inertia=(0.01, 0.05, 0.05)),
        fb.Body("b", mass=1, com=(0.75, 0, 0.1), inertia=(0.01, 0.03, 0.02)),
        fb.Revolute("A", "ground", "a", at=(0, 0, 0), axis=(0, 1, 0)),
        fb.Revolute("B", "a", "b", at=(0.5, 0, 0), axis=(1, 0, 0)),
        *parts,
    )
    return m


def rotors():
    return (
        fb.RotorInertia("rotor A", "A.angle", inertia="10 g*m^2", ratio=np.sqrt(40.0)),
        fb.RotorInertia("rotor B", "B.angle", inertia=0.02),
    )


def pendulum(*parts, shape=None):
    m = fb.Mechanism("pendulum", planar=True)
    m.gravity = (0.0, -9.81)
    m.add(fb.Body("rod", mass=2, position=(0, 0), com=(0.5, 0), inertia=0.1, shape=shape), *parts)
    return m


def hinge():
    return fb.Revolute("A", "ground", "rod", at=(0, 0))


def test_recursive_dynamics_gain_the_inertia_on_the_diagonal_only():
    p, bare = arm(*rotors()).prepare(coordinates="joint"), arm().prepare(coordinates="joint")
    J = np.diag(list(REFLECTED.values()))
    rng = np.random.default_rng(0)
    q, v, a, tau = rng.uniform(-2, 2, (4, 5, 2))
    assert p.crba(q) - bare.crba(q) == pytest.approx(np.broadcast_to(J, (5, 2, 2)), abs=1e-15)
    assert p.rnea(q, v, a) - bare.rnea(q, v, a) == pytest.approx(a @ J, abs=1e-14)
    bias = bare.rnea(q, v, 0 * a)
    expected = np.linalg.solve(bare.crba(q) + J, (tau - bias)[..., None])[..., 0]
    assert p.aba(q, v, tau) == pytest.approx(expected, rel=1e-12)
    for one, state in enumerate(zip(q, v, tau, strict=True)):  # one state as well as a batch
        assert p.aba(*state) == pytest.approx(expected[one], rel=1e-12)
    by_q, by_v, by_tau = p.aba_derivatives(q, v, tau)
    assert by_tau == pytest.approx(np.linalg.inv(bare.crba(q) + J), rel=1e-12)
    for k in range(2):
        h = 1e-6 * np.eye(2)[k]
        for slopes, ahead, behind in (
            (by_q, p.aba(q + h, v, tau), p.aba(q - h, v, tau)),
            (by_v, p.aba(q, v + h, tau), p.aba(q, v - h, tau)),
        ):
            assert slopes[..., k] == pytest.approx((ahead - behind) / 2e-6, rel=1e-6, abs=1e-6)


def test_a_rotor_on_the_ground_is_a_body_with_a_gear():
    """In absolute coordinates, where the rotor's spin is a velocity of its own."""
    geared = pendulum(
        hinge(),
        fb.Body("rotor", mass=1, position=(1, 0), inertia=0.001),
        fb.Revolute("R", "ground", "rotor", at=(1, 0)),
        fb.Coupler("gear", ("R.angle", "A.angle"), weights=(1.0, -20.0)),
    ).simulate(2, coordinates="absolute", rtol=1e-10, atol=1e-12)
    run = pendulum(hinge(), fb.RotorInertia("rotor", "A.angle", inertia=0.001, ratio=20)).simulate(
        2, rtol=1e-10, atol=1e-12
    )
    assert run["A.angle"] == pytest.approx(geared["A.angle"], abs=1e-7)
    assert run.energy.kinetic == pytest.approx(geared.energy.kinetic, abs=1e-6)
    assert run.energy.drift < 1e-7


def test_small_swings_and_modes_have_the_period_of_both_inertias():
    m = pendulum(hinge(), fb.RotorInertia("rotor", "A.angle", inertia=0.001, ratio=20))
    m.add(fb.Initial("A.angle", value=-np.pi / 2))
    expected = np.sqrt(2 * 9.81 * 0.5 / (0.1 + 2 * 0.25 + 0.4))
    assert m.modes().omega == pytest.approx([expected], rel=1e-9)
    A = m.linearize(coordinates="joint").A
    assert np.abs(np.linalg.eigvals(A).imag).max() == pytest.approx(expected, rel=1e-12)


def slider_crank(*parts, crank_inertia):
    m = fb.Mechanism("slider-crank", planar=True)
    m.gravity = (0.0, -9.81)
    m.add(
        fb.Body("crank", mass=1, position=(0, 0), com=(0.1, 0), inertia=crank_inertia),
        fb.Body("rod", mass=1, position=(0.2, 0), com=(0.3, 0), inertia=0.02),
        fb.Body("slider", mass=0.5, position=(0.8, 0), inertia=1e-3),
        fb.Revolute("A", "ground", "crank", at=(0, 0)),
        fb.Revolute("B", "crank", "rod", at=(0.2, 0)),
        fb.Revolute("C", "rod", "slider", at=(0.8, 0)),
        fb.Prismatic("D", "ground", "slider", at=(0.8, 0), axis=(1, 0)),
        fb.Motor("motor", "A", torque="0.5*cos(3*t)"),
        fb.Initial("A.angle", rate=4.0),
        *parts,
    )
    return m


def test_a_crank_in_a_loop_gains_a_flywheel():
    """The reference has the inertia in the crank itself, and absolute coordinates."""
    wheel = slider_crank(crank_inertia=0.51).simulate(2, coordinates="absolute", rtol=1e-10, atol=1e-12)
    m = slider_crank(fb.RotorInertia("rotor", "A.angle", inertia=0.5), crank_inertia=0.01)
    run = m.simulate(2, rtol=1e-10, atol=1e-12)
    for name in ("A.angle", "slider.x", "B.fx", "C.fy", "A.fx", "D.fy"):
        assert run[name] == pytest.approx(wheel[name], rel=1e-6, abs=1e-6), name
    assert run.energy.kinetic == pytest.approx(wheel.energy.kinetic, rel=1e-7)
    assert run["rotor.force"] == pytest.approx(-0.5 * run["A.angle_acceleration"], rel=1e-9, abs=1e-9)
    assert run.energy.drift < 1e-7 * run.energy.kinetic.max()
    implicit = m.simulate(2, method="radau", rtol=1e-9, atol=1e-11)
    assert implicit["A.angle"] == pytest.approx(wheel["A.angle"], abs=1e-5)


def test_joints_carry_nothing_about_their_axes():
    spin = fb.Initial("A.angle", rate=3.0), fb.Initial("B.angle", rate=5.0)
    run = arm(*rotors(), *spin).simulate(1)
    assert run["A"].torque[:, 1] == pytest.approx(0.0, abs=1e-11)
    axis = np.cos(run["A.angle"]), -np.sin(run["A.angle"])  # of B, along x and z of the world
    along = run["B"].torque[:, 0] * axis[0] + run["B"].torque[:, 2] * axis[1]
    assert along == pytest.approx(0.0, abs=1e-11)
    assert np.abs(run["A"].torque).max() > 0.1
    assert not run.health.warnings


def test_a_driver_accelerates_the_rotor_too():
    m = pendulum(hinge(), fb.RotorInertia("rotor", "A.angle", inertia=0.001, ratio=20))
    m.add(fb.Driver("drive", "A.angle", law="0.3*sin(2*t)"))
    run = m.simulate(1)
    angle, acceleration = 0.3 * np.sin(2 * run.t), -1.2 * np.sin(2 * run.t)
    expected = (0.1 + 0.5 + 0.4) * acceleration + 2 * 9.81 * 0.5 * np.cos(angle)
    assert run["drive.effort"] == pytest.approx(expected, rel=1e-9)


def test_an_impact_stops_the_rotor_too():
    m = pendulum(hinge(), fb.RotorInertia("rotor", "A.angle", inertia=0.001, ratio=20))
    m.gravity = (0.0, 0.0)
    m.add(fb.Initial("A.angle", rate=2.0), fb.Limit("stop", "A.angle", upper=0.5, restitution=0.6))
    run = m.simulate(0.5)
    hit = run.events[0]
    assert run["A.rate"][-1] == pytest.approx(-1.2, rel=1e-9)
    assert hit.impulses["stop"] == pytest.approx(-1.0 * 3.2, rel=1e-9)
    assert hit.impulses["A"][5] == pytest.approx(0.0, abs=1e-9)
    assert run.energy.drift < 1e-9


def test_contact_by_impulses_feels_the_rotor():
    """Conservation of the moment of momentum about the hinge, with the rotor's part, and of energy."""
    ends = []
    for inertia in (0.0, 0.4):
        tip = fb.Sphere(radius=0.05, position=(1, 0))
        m = pendulum(hinge(), fb.RotorInertia("rotor", "A.angle", inertia=inertia), shape=tip)
        m.gravity = (0.0, 0.0)
        m.add(
            fb.Body("ball", mass=0.5, position=(1, 0.3), inertia=1e-3, shape=fb.Sphere(radius=0.05)),
            fb.Contact(restitution=1.0, friction=0.0),
            fb.Initial("A.angle", rate=1.0),
        )
        run = m.simulate(0.6)
        I = 0.6 + inertia
        moment = I * run["A.rate"] + 0.5 * (run["ball.x"] * run["ball.vy"] - run["ball.y"] * run["ball.vx"])
        assert moment == pytest.approx(I, rel=1e-6)
        ends.append(run["ball.vy"][-1])
    assert ends[1] > 1.05 * ends[0] > 0.0


def test_symbolic_equations_and_sensitivities_have_it():
    m = pendulum(hinge())
    m.parameters = {"J": 0.001, "n": 20.0}
    m.add(fb.RotorInertia("rotor", "A.angle", inertia="J", ratio="n"))
    eq = m.symbolic()
    assert eq.M[0, 0].at({"A.angle": 0.3, "J": 0.001, "n": 20.0}) == pytest.approx(1.0, rel=1e-12)
    s = m.sensitivity(["A.angle"], ["J"], analysis="motion", t_end=1.0, rtol=1e-10, atol=1e-12)
    h = 1e-6
    ahead, behind = (m.simulate(1, parameters={"J": 0.001 + x}, rtol=1e-11, atol=1e-13)["A.angle"][-1] for x in (h, -h))
    assert float(np.ravel(s["A.angle", "J"])[-1]) == pytest.approx((ahead - behind) / (2 * h), rel=1e-5)


def test_controllers_know_the_rotor():
    """A computed torque moves the joint as a driver does."""
    m = pendulum(hinge(), fb.RotorInertia("rotor", "A.angle", inertia=0.001, ratio=20))
    m.add(fb.ComputedTorque("control", coordinates="A.angle", reference="0.3*sin(2*t)", kp=100, kd=20))
    m.add(fb.Motor("motor", "A", torque="control"))
    m.add(fb.Initial("A.angle", rate=0.6))
    run = m.simulate(1, rtol=1e-10, atol=1e-12)
    assert run["A.angle"] == pytest.approx(0.3 * np.sin(2 * run.t), abs=1e-8)


def test_equilibria_do_not_depend_on_it():
    m = pendulum(hinge(), fb.RotorInertia("rotor", "A.angle", inertia=5.0))
    m.add(fb.TorsionalSpringDamper("spring", "A", stiffness=40.0))
    bare = pendulum(hinge(), fb.TorsionalSpringDamper("spring", "A", stiffness=40.0))
    found, expected = m.equilibrium(), bare.equilibrium()
    assert found.result["A.angle"] == pytest.approx(expected.result["A.angle"], rel=1e-12)
    assert m.mobility().freedoms == 1


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"inertia": -1.0}, "inertia"),
        ({"inertia": 1.0, "ratio": 0.0}, "ratio is 0"),
        ({"inertia": "2 m"}, "inertia"),
        ({"coordinate": "rod.x", "inertia": 1.0}, "not the coordinate of an axis of a joint"),
        ({"coordinate": "S.roll", "inertia": 1.0}, "not the coordinate of an axis of a joint"),
    ],
)
def test_refusals_name_the_element(change, words):
    m = pendulum(hinge())
    if "S.roll" in change.values():
        m = fb.Mechanism("ball joint")
        m.add(fb.Body("rod", mass=1, inertia=(1, 1, 1)), fb.Spherical("S", "ground", "rod", at=(0, 0, 0)))
    coordinate = change.get("coordinate", "A.angle")
    numbers = {k: x for k, x in change.items() if k != "coordinate"}
    with pytest.raises(ModelError, match=f"RotorInertia 'rotor'.*{words}"):
        m.add(fb.RotorInertia("rotor", coordinate, **numbers))


def test_coordinates_in_which_it_is_no_velocity_are_refused():
    m = slider_crank(fb.RotorInertia("rotor", "A.angle", inertia=0.5), crank_inertia=0.01)
    for analysis in (m.simulate, m.linearize, m.symbolic):
        with pytest.raises(ModelError, match=r"RotorInertia 'rotor'.*coordinates='joint'"):
            analysis(*((0.1,) if analysis == m.simulate else ()), coordinates="absolute")
    everywhere = [fb.RotorInertia(f"rotor {k}", f"{k}.angle", inertia=0.5) for k in "ABC"]
    everywhere.append(fb.RotorInertia("rotor D", "D.displacement", inertia=0.5))
    with pytest.raises(ModelError, match=r"the loop is cut at.*GearPair"):
        slider_crank(*everywhere, crank_inertia=0.01).simulate(0.1)


def test_a_ball_screw_adds_a_mass():
    """A rotor that turns 300 rad per metre, on a slide in the units of both."""
    m = fb.Mechanism("slide", planar=True)
    m.add(fb.Body("table", mass=2, inertia=1), fb.Prismatic("S", "ground", "table", at=(0, 0), axis=(1, 0)))
    m.add(fb.RotorInertia("screw", "S.displacement", inertia="1e-4 kg*m^2", ratio="300 rad/m"))
    m.add(fb.Actuator("push", "S.displacement", force=5.0))
    run = m.simulate(1)
    assert run["table.x"][-1] == pytest.approx(0.5 * 5.0 / (2.0 + 9.0), rel=1e-9)
    assert run["screw.force"] == pytest.approx(-9.0 * 5.0 / 11.0, rel=1e-9)


def test_the_motion_of_the_carrier_is_neglected():
    """An arm whose elbow motor is a geared body on the upper link: the difference falls as 1/ratio."""

    def elbow(ratio: float, body: bool) -> float:
        m = fb.Mechanism("arm", planar=True)
        m.add(
            fb.Body("upper", mass=1, com=(0.25, 0), inertia=0.05), fb.Body("lower", mass=1, com=(0.75, 0), inertia=0.05)
        )
        m.add(fb.Revolute("S", "ground", "upper", at=(0, 0)), fb.Revolute("E", "upper", "lower", at=(0.5, 0)))
        m.add(fb.Motor("torque", "S", torque=1.0))
        J = 0.05 / ratio**2
        if body:
            m.add(fb.Body("rotor", mass=1e-9, com=(0.5, 0), inertia=J), fb.Revolute("R", "upper", "rotor", at=(0.5, 0)))
            m.add(fb.Coupler("gear", ("R.angle", "E.angle"), weights=(1.0, -ratio)))
        else:
            m.add(fb.RotorInertia("rotor", "E.angle", inertia=J, ratio=ratio))
        return m.simulate(0.5, rtol=1e-9, atol=1e-11)["E.angle"][-1]

    gaps = [abs(elbow(n, True) - elbow(n, False)) for n in (20.0, 200.0)]
    assert 1e-3 < gaps[0] < 0.05
    assert gaps[1] == pytest.approx(gaps[0] / 10.0, rel=0.1)
