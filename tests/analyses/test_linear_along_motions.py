"""Linear equations along motions that are not steady: against differences of accelerations and of whole motions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

import flyball as fb

STEP = 1e-5


def four_bar(angle: float = 0.7, rate: float = 5.0, torque: float = 0.0) -> fb.Mechanism:
    m = fb.Mechanism("four-bar", planar=True, gravity=(0, -9.81), parameters={"torque": torque})
    m.add(fb.Body("crank", mass=0.4, inertia=0.0015, position=(0, 0.1)))
    m.add(fb.Body("coupler", mass=1.2, inertia=0.034, position=(0.25, 0.35)))
    m.add(fb.Body("rocker", mass=1.0, inertia=0.022, position=(0.55, 0.25)))
    m.add(fb.Revolute("A", "ground", "crank", at=(0, 0)), fb.Revolute("B", "crank", "coupler", at=(0, 0.2)))
    m.add(fb.Revolute("C", "coupler", "rocker", at=(0.5, 0.5)), fb.Revolute("D", "ground", "rocker", at=(0.6, 0)))
    m.add(fb.Motor("motor", "A", torque="torque"), fb.TorsionalSpringDamper("s", "D", stiffness=3, damping=0.1))
    m.add(fb.Initial("A.angle", value=angle, rate=rate))
    return m


def acceleration(*state: float) -> float:
    return float(four_bar(*state).simulate(1e-3, outputs=2)["A.angle_acceleration"][0])


@pytest.mark.parametrize("layer", ["absolute", "joint"])
@pytest.mark.parametrize("rate", [5.0, 0.0])  # at rest it is accelerated
def test_a_closed_loop_at_one_instant(layer, rate):
    """The constraints' coefficients change along the motion: with accelerations by differences."""
    found = []
    for step in np.eye(3) * STEP:
        found.append((acceleration(*[0.7, rate, 0] + step) - acceleration(*[0.7, rate, 0] - step)) / (2 * STEP))
    x = four_bar(0.7, rate).linearize(["motor"], ["D.angle_acceleration"], frozen=True, coordinates=layer)
    np.testing.assert_allclose(x.A, [[0, 1], found[:2]], rtol=1e-7)
    np.testing.assert_allclose(x.B[:, 0], [0, found[2]], rtol=1e-7, atol=1e-12)
    with pytest.raises(fb.AnalysisError, match="a descriptor has constant coefficients"):
        _ = x.descriptor


def test_a_driven_parameter_and_a_driver_are_inputs():
    """Drivers and lengths enter the constraints: A(t) x + B w with constant w, by differences."""

    def pendulum(offset: float, length: float) -> fb.Mechanism:
        m = fb.Mechanism("p", planar=True, gravity=(0, -9.81), parameters={"l": length, "o": offset})
        m.add(fb.Body("cart", mass=1, inertia=1), fb.Body("bob", mass=2, inertia=0.1, position=("l", 0)))
        m.add(
            fb.Prismatic("rail", "ground", "cart", at=(0, 0), axis=(1, 0)), fb.Revolute("A", "cart", "bob", at=(0, 0))
        )
        m.add(fb.Driver("D", "rail.displacement", "0.3*t**2 + o"), fb.Initial("A.angle", rate=2))
        return m

    def rate(offset: float = 0.0, length: float = 0.4) -> float:
        return float(pendulum(offset, length).simulate(1e-3, outputs=2)["A.angle_acceleration"][0])

    x = pendulum(0.0, 0.4).linearize(["D", "l"], ["A.angle"], frozen=True)
    by_length = (rate(length=0.4 + STEP) - rate(length=0.4 - STEP)) / (2 * STEP)
    np.testing.assert_allclose(x.A @ [0, 0] + x.B[:, 1], [0, by_length], rtol=1e-7)
    assert x.B[1, 0] == pytest.approx(rate(offset=1.0) - rate(), abs=1e-12)


def test_equations_along_a_run_give_neighbouring_motions():
    """x' = A(t) x with the same states at all times, against the difference of two whole motions."""
    times = np.linspace(0, 0.6, 121)
    run = four_bar().simulate(0.6, outputs=times, rtol=1e-11)
    models = [
        four_bar().linearize(
            outputs=["D.angle"], about=run, t=t, frozen=True, coordinates="joint", independent=["A.angle"]
        )
        for t in times
    ]
    assert {x.states for x in models} == {("A.angle", "A.angle rate")}
    A = CubicSpline(times, np.array([x.A for x in models]))
    end = solve_ivp(lambda t, y: A(t) @ y, (0, 0.6), [1.0, -2.0], rtol=1e-9, atol=1e-12).y[:, -1]
    other = [four_bar(0.7 + s, 5.0 - 2 * s).simulate(0.6, outputs=times, rtol=1e-11) for s in (STEP, -STEP)]
    for k, name in enumerate(("A.angle", "A.angle_rate")):
        assert end[k] == pytest.approx((other[0][name][-1] - other[1][name][-1]) / (2 * STEP), rel=2e-5)
    rocker = models[-1].C @ end
    assert rocker[0] == pytest.approx((other[0]["D.angle"][-1] - other[1]["D.angle"][-1]) / (2 * STEP), rel=2e-5)
    assert models[40].output_values == pytest.approx(run["D.angle"][40], abs=1e-9)


def test_friction_that_slides_and_then_sticks():
    m = fb.Mechanism("o", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("b", mass=1, inertia=1, velocity=(1, 0)), fb.Prismatic("P", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("s", "P.displacement", stiffness=1))
    m.add(fb.JointFriction("f", "P", static=0.3))
    run = m.simulate(3, outputs=61)
    assert run["P.displacement_rate"][-1] == pytest.approx(0.0, abs=1e-15)
    sliding = m.linearize(about=run, t=0.1, frozen=True)
    np.testing.assert_allclose(sliding.A, [[0, 1], [-1, 0]], rtol=1e-12)
    assert sliding.t == pytest.approx(0.1)
    assert "assumed to keep sliding" in sliding.notes[0]
    assert m.linearize(about=run, frozen=True).A.shape == (0, 0)


def test_states_are_chosen_by_name():
    m = four_bar()
    for name in ("A.angle", "B.angle"):
        x = m.linearize(frozen=True, coordinates="joint", independent=[name])
        assert x.states == (name, f"{name} rate")
    with pytest.raises(fb.ModelError, match=r"independent: 'A.angel' is no coordinate .* \(did you mean 'A.angle'\?\)"):
        m.linearize(frozen=True, coordinates="joint", independent=["A.angel"])
    with pytest.raises(fb.ModelError, match=r"2 coordinates are given, and the mechanism has 1 degrees of freedom"):
        m.linearize(frozen=True, coordinates="joint", independent=["A.angle", "B.angle"])
    with pytest.raises(fb.ModelError, match=r"'A\.angle' is given twice"):
        m.linearize(frozen=True, coordinates="joint", independent=["A.angle", "A.angle"])
    slider = fb.Mechanism("dead centre", planar=True)
    slider.add(
        fb.Body("crank", mass=1, inertia=1), fb.Body("rod", mass=1, inertia=1), fb.Body("piston", mass=1, inertia=1)
    )
    slider.add(fb.Revolute("A", "ground", "crank", at=(0, 0)), fb.Revolute("B", "crank", "rod", at=(1, 0)))
    slider.add(fb.Revolute("C", "rod", "piston", at=(3, 0)))
    slider.add(fb.Prismatic("P", "ground", "piston", at=(3, 0), axis=(1, 0)))
    assert slider.linearize(coordinates="absolute", independent=["crank.angle"]).states[0] == "crank.angle"
    with pytest.raises(fb.SingularityError, match=r"piston.x do not determine the motion .* for instance"):
        slider.linearize(coordinates="absolute", independent=["piston.x"])


def test_times_that_a_motion_does_not_have():
    run = four_bar().simulate(0.2, outputs=3)
    with pytest.raises(fb.ModelError, match=r"t = 0.15 s is no output time of the motion; the nearest is 0.[12] s"):
        four_bar().linearize(about=run, t=0.15, frozen=True)
    with pytest.raises(fb.ModelError, match="an equilibrium has its own time"):
        four_bar().modes(about=four_bar().equilibrium(), t=1)
