"""Motions that start in an equilibrium or a steady motion stay there."""

import numpy as np
import pytest

import flyball as fb
from tests.mechanisms import example


def arm() -> fb.Mechanism:
    """An arm on a spring, drawn away from its position of rest."""
    m = fb.Mechanism("arm", planar=True, gravity=(0, -9.81), parameters={"load": 0.0})
    m.add(fb.Body("a", mass=1, inertia=0.1, position=(1, -0.2)), fb.Revolute("R", "ground", "a", at=(0, 0)))
    m.add(fb.SpringDamper("s", "ground", "a", at=((1, 0), (1, -0.2)), stiffness=30, length=0.1))
    m.add(fb.Motor("motor", "R", torque="load"))
    return m


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
@pytest.mark.parametrize("method", ["dop853", "radau", "impulse"])
def test_an_arm_stays_at_rest(coordinates, method):
    m = arm()
    rest = m.equilibrium()
    coordinates = "auto" if method == "impulse" else coordinates
    run = m.simulate(1.0, start=rest, method=method, coordinates=coordinates)
    assert np.abs(run["R.angle"] - rest["R.angle"]).max() < 1e-9


def test_a_disturbance_swings_about_the_equilibrium():
    """The period for small angles is that of the linear model about the equilibrium."""
    m = arm()
    rest = m.equilibrium()
    (w,) = m.modes(about=rest).omega
    run = m.simulate(4.0, start=rest, parameters={"load": 1e-3}, outputs=4001, rtol=1e-10)
    swing = run["R.angle"] - rest["R.angle"]
    first = run.t[1 + np.argmax((swing[1:-1] > swing[:-2]) & (swing[1:-1] >= swing[2:]))]
    assert first == pytest.approx(np.pi / w, rel=2e-3)


def test_a_steady_motion_goes_on():
    m = example("governor.toml")
    steady = m.equilibrium(turning=["bearing.angle"])
    run = m.simulate(2.0, start=steady)
    assert np.ptp(run["left hinge.angle"]) < 1e-7
    assert run["bearing.angle"][-1] - run["bearing.angle"][0] == pytest.approx(2.0 * steady.speeds["bearing.angle"])


def test_states_of_controllers_are_those_of_the_equilibrium():
    """An integrator that carries a weight keeps its value."""
    m = fb.Mechanism("lift", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("a", mass=2.0, inertia=1.0), fb.Prismatic("P", "ground", "a", at=(0, 0), axis=(0, 1)))
    m.add(fb.PID("pid", setpoint=0.3, measured="P.displacement", kp=50.0, ki=40.0, kd=20.0, filter=0.02))
    m.add(fb.Actuator("drive", coordinate="P.displacement", force="pid"))
    rest = m.equilibrium()
    run = m.simulate(1.0, start=rest)
    assert rest["P.displacement"] == pytest.approx(0.3)
    assert np.abs(run["P.displacement"] - 0.3).max() < 1e-9
    assert np.abs(run["drive.force"] - 2.0 * 9.81).max() < 1e-6


def test_studies_and_comparisons_start_there():
    m = arm()
    rest = m.equilibrium()
    study = m.study({"load": [0.0, 0.5]}, of=["max(R.angle_rate)"], t_end=0.5, start=rest)
    assert study["max(R.angle_rate)"][0] < 1e-9 < study["max(R.angle_rate)"][1]
    assert m.compare(0.2, start=rest, repeats=0) is not None


def test_a_preload_is_not_forgotten():
    m = arm()
    held = m.equilibrium(preload=["motor"])
    with pytest.raises(fb.ModelError, match=r"needs the preload of motor, .*add x\.preload to the laws"):
        m.simulate(1.0, start=held)
