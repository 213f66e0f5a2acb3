"""Equilibria of controllers with limits: within them though the output is at one as drawn, and at them."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb

WEIGHT = 9.81 * 0.3  # [N m], of the arm held level


def servo(parameters=None, **fields) -> fb.Mechanism:
    """An arm that is drawn level, and a PID that is to hold it at 0.5 rad; a step of it saturates."""
    m = fb.Mechanism("servo", planar=True, gravity=(0, -9.81), parameters=parameters or {})
    m.add(fb.Body("arm", mass=1, inertia=0.1, position=(0.3, 0)), fb.Revolute("A", "ground", "arm", at=(0, 0)))
    gains = {"setpoint": 0.5, "measured": "A.angle", "kp": 40, "ki": 30, "kd": 8, "filter": 0.01}
    m.add(fb.PID("pid", **(gains | {"lower": -12, "upper": 12} | fields)), fb.Motor("mot", "A", torque="pid"))
    return m


@pytest.mark.parametrize("anti_windup", ["back-calculation", "clamping"])
def test_saturated_as_drawn(anti_windup):
    e = servo(anti_windup=anti_windup).equilibrium()
    assert e["A.angle"] == pytest.approx(0.5, abs=1e-9)
    assert e["pid.output"] == pytest.approx(WEIGHT * np.cos(0.5), rel=1e-8)
    assert e.stability == "stable"


def test_proportional_only():
    """kp (r - a) = W cos a: saturated as drawn by 20 N m of 12."""
    e = servo(ki=0.0).equilibrium()
    assert 40 * (0.5 - e["A.angle"]) == pytest.approx(WEIGHT * np.cos(e["A.angle"]), rel=1e-9)


def test_at_a_limit():
    """2 N m lift the arm nowhere: it hangs at -acos(2/W); the integral is led back to where it stands.

    ki e + (upper - unlimited)/T = 0 with T = sqrt(kd/ki), and unlimited = kp e + I.
    """
    e = servo(upper=2.0).equilibrium()
    angle = -np.arccos(2.0 / WEIGHT)
    assert e["A.angle"] == pytest.approx(angle, abs=1e-7)
    assert e["pid.output"] == 2.0
    error = 0.5 - angle
    assert e["pid.integral"] == pytest.approx(2.0 + (30 * np.sqrt(8 / 30) - 40) * error, rel=1e-6)
    assert e.stability == "marginal"  # nothing damps it there


def test_what_winds_up_rests_nowhere():
    with pytest.raises(fb.NotConverged, match="the output of PID 'pid' is at a limit"):
        servo(upper=2.0, anti_windup="none").equilibrium()


@pytest.mark.parametrize(("period", "said"), [(None, "eigenvalues"), (0.01, "multipliers")])
def test_what_is_printed_is_consistent(period, said):
    """Held torque does not balance an arm that rises; the loop does: each is called what it is."""
    e = servo(period=period).equilibrium()
    told = dict(e.lines())
    assert told["equilibrium"].startswith(f"stable by the {said} of the closed loop")
    assert "least stiffness" not in told
    assert (e.least < 0.0) == (period is not None)
    assert told["least stiffness with constant controllers' states"].startswith(f"{e.least:.3g} of what acts")
    assert e.as_dict()["judged_by"].startswith(said)


@pytest.mark.parametrize("goal", [1e6, -3e4])
def test_a_goal_far_away(goal):
    """A cart of a mechanism of a metre, whose goal is a million of them away."""
    m = fb.Mechanism("slide", planar=True, parameters={"goal": goal})
    m.add(fb.Body("cart", mass=2, inertia=1), fb.Prismatic("A", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.PID("pid", setpoint="goal", measured="A.displacement", kp=80, ki=60, kd=12, filter=0.02))
    m.add(fb.Actuator("drive", "A.displacement", force="pid"))
    e = m.equilibrium()
    assert (e.stability, e["A.displacement"]) == ("stable", pytest.approx(goal, rel=1e-12))


def test_series_goes_to_a_limit_and_on():
    """A weaker and weaker motor: it holds the arm as long as W cos(0.5) is less than its limit; then the arm falls."""
    m = servo({"most": 12.0}, upper="most")
    values = [12.0, 3.0, 2.0]
    series = m.equilibria("most", values)
    assert series["A.angle"][:2] == pytest.approx([0.5] * 2, abs=1e-9)
    assert series["A.angle"][2] == pytest.approx(-np.arccos(2.0 / WEIGHT), abs=1e-6)
    assert series.stability == ("stable", "stable", "marginal")
    (jump,) = series.jumps
    assert 2.0 <= jump.value <= 3.0
    assert "stiffness with constant controllers" in series.lines()[0][1]
    with pytest.raises(fb.ModelError, match="stable= is for mechanisms without controllers"):
        m.equilibria("most", values, stable=True)


def test_from_a_settled_motion():
    """Its end is the guess: positions and controllers' states; so it is for what has no controllers."""
    m = servo()
    run = m.simulate(8, outputs=3)
    e = m.equilibrium(start=run)
    assert e["A.angle"] == pytest.approx(0.5, abs=1e-9)
    assert e["pid.integral"] == pytest.approx(run["pid.integral"][-1], abs=1e-2)
    with pytest.raises(fb.ModelError, match="or a result of simulate, not str"):
        m.equilibrium(start="settled")


def test_of_two_rests_that_where_the_motion_ended():
    """An arm with a soft spring upright leans either way; drawn to the right, and pushed over to the left."""
    m = fb.Mechanism("arm", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("arm", mass=1, inertia=0.1, position=(0.02, 0.3)), fb.Revolute("A", "ground", "arm", at=(0, 0)))
    m.add(fb.CoordinateSpring("spring", "A.angle", stiffness=2.5, damping=1.0, rest=0.0))
    m.add(fb.Motor("push", "A", torque="where(t < 2, 3, 0)"))
    run = m.simulate(20, outputs=3)
    e, other = m.equilibrium(t=20, start=run), m.equilibrium(t=20)
    assert e["A.angle"] == pytest.approx(run["A.angle"][-1], abs=0.1)  # it swings a little still
    assert e["A.angle"] > 0.5 and other["A.angle"] < -0.5
    with pytest.raises(fb.ModelError, match="a different one"):
        servo().equilibrium(start=run)
