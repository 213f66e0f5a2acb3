"""Energies beside controllers, which have none."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.errors import ModelError

G = np.array([3.0, -9.81])
TIMES = [0.0, 0.3, 0.6]


def arm(*, unit: float = 1.0, anti_windup: str | None = None) -> fb.Mechanism:
    """A rod of M kg, 0.4 m from its hinge, that a PID and a lag lead to r; signals in other units than N m."""
    m = fb.Mechanism("arm", planar=True, gravity=tuple(G), parameters={"kp": 30.0, "M": 1.2, "r": 0.6})
    m.add(fb.Body("rod", mass="M", inertia=0.05, position=(0.4, 0)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.TorsionalSpringDamper("spring", "A", stiffness=5, damping=0.5))
    limits = {"upper": 40.0 * unit, "anti_windup": anti_windup} if anti_windup else {}
    gains = {"kp": f"{unit!r}*kp", "ki": 20.0 * unit}
    m.add(fb.PID("pid", setpoint="r", measured="A.angle", **gains, **limits), fb.Lag("lag", of="pid", time=0.05))
    m.add(fb.Motor("motor", "A", torque=f"lag/{unit!r}"))
    return m


def differenced(m: fb.Mechanism, name: str, by: str) -> np.ndarray:
    """The derivative of a curve by central differences of fourth order of simulated motions."""
    value = m.parameters[by]
    h = 1e-3 * value

    def at(x: float) -> np.ndarray:
        return m.simulate(TIMES[-1], outputs=TIMES, rtol=1e-12, atol=1e-13, parameters={by: x}, progress=False)[name]

    return (8 * (at(value + h) - at(value - h)) - (at(value + 2 * h) - at(value - 2 * h))) / (12 * h)


@pytest.mark.parametrize("unit", [1.0, 1e7, 1e-4])
def test_energies_of_a_motion_change_as_those_of_simulated_ones(unit):
    """Whatever the states' units are."""
    m = arm(unit=unit)
    of = ["energy.kinetic", "energy.potential", "energy.total", "energy.elastic", "motor.work", "lag.value"]
    s = m.sensitivity(of, ["kp", "M"], analysis="motion", t_end=TIMES[-1], outputs=TIMES, rtol=1e-10)
    run = m.simulate(TIMES[-1], outputs=TIMES, rtol=1e-11, atol=1e-12, progress=False)
    for k, name in enumerate(of):
        assert s.values[:, k] == pytest.approx(run[name], rel=1e-7, abs=1e-7 * np.abs(run[name]).max()), name
        for by in ("kp", "M"):
            d = differenced(m, name, by)
            assert s[name, by] == pytest.approx(d, rel=1e-6, abs=1e-6 * np.abs(d).max()), (name, by)


def test_the_balance_of_a_motion_changes_with_nothing():
    s = arm().sensitivity(["energy.balance", "energy.total"], analysis="motion", t_end=0.6, outputs=4, rtol=1e-10)
    by_balance, by_total = np.abs(s.derivatives).max(axis=(0, 2))
    assert by_balance < 1e-7 * by_total
    assert np.abs(s.values[:, 0]).max() < 1e-8 * np.abs(s.values[:, 1]).max()


def test_verify_looks_at_the_motions_of_the_mechanism_itself():
    m = arm()
    s = m.sensitivity(["energy.kinetic"], ["M"], analysis="motion", t_end=0.6, outputs=TIMES, verify=True)
    assert s.verification[:, 0, 0] == pytest.approx(differenced(m, "energy.kinetic", "M"), rel=1e-5, abs=1e-5)
    assert s.verification[:, 0, 0] == pytest.approx(s["energy.kinetic", "M"], rel=1e-5, abs=1e-5)


def test_a_mass_is_found_by_kinetic_energies():
    m = arm()
    target = m.simulate(TIMES[-1], outputs=TIMES, rtol=1e-11, atol=1e-12, progress=False)["energy.kinetic"]
    m.parameters["M"] = 1.0
    found = m.optimize(
        ["energy.kinetic"],
        {"M": (0.5, 3)},
        target=target[:, None],
        analysis="motion",
        t_end=TIMES[-1],
        outputs=TIMES,
        progress=False,
    )
    assert found.parameters["M"] == pytest.approx(1.2, rel=1e-7)


def test_energies_at_rest_are_the_rods_and_the_springs():
    """Those of the rod and of the spring alone."""
    m = arm()
    s = m.sensitivity(["energy.potential", "energy.total", "energy.kinetic"], ["M", "r"], analysis="equilibrium")
    r, along = 0.6, 0.4 * np.array([np.cos(0.6), np.sin(0.6)])
    across = 0.4 * np.array([-np.sin(0.6), np.cos(0.6)])
    for name in ("energy.potential", "energy.total"):
        assert s[name, "M"] == pytest.approx(-G @ along, rel=1e-9)
        assert s[name, "r"] == pytest.approx(-1.2 * G @ across + 5 * r, rel=1e-9)
    assert s["energy.kinetic", "r"] == 0.0
    assert s.values[0, 0] == pytest.approx(-1.2 * G @ along + 5 * r**2 / 2, rel=1e-9)


def test_a_linear_model_has_the_energies_of_the_mechanism():
    m = arm()
    rest = m.equilibrium()
    lin = m.linearize(["r"], ["energy.potential", "energy.total", "lag"], about=rest)
    here = rest.result
    values = [here["energy.potential"][0], here["energy.total"][0], here["lag.value"][0]]
    assert lin.output_values == pytest.approx(values, rel=1e-12)
    across = 0.4 * np.array([-np.sin(0.6), np.cos(0.6)])
    expected = np.where([x == "A.angle" for x in lin.states], -1.2 * G @ across + 5 * 0.6, 0.0)
    for k in (0, 1):
        assert lin.C[k] == pytest.approx(expected, rel=1e-8, abs=1e-9)


def test_clamping_is_refused_in_the_users_names():
    with pytest.raises(ModelError, match=r"PID 'pid': the rate of 'pid.integral' decides by 'A.angle'") as error:
        arm(anti_windup="clamping").sensitivity(["A.angle"], ["kp"], analysis="motion", t_end=0.1)
    assert "anti_windup='clamping'" in str(error.value) and "'back-calculation'" in str(error.value)
    assert "push" not in str(error.value) and "Actuator" not in str(error.value)


def test_laws_that_name_controllers_are_refused_as_the_user_wrote_them():
    m = arm()
    m.replace(fb.Motor("motor", "A", torque="where(lag > 1, 1, lag)"))
    with pytest.raises(ModelError, match=r"Motor 'motor': its law 'where\(lag > 1, 1, lag\)' decides by 'lag.value'"):
        m.sensitivity(["A.angle"], ["kp"], analysis="motion", t_end=0.1)
    m = arm(anti_windup="back-calculation")
    m.replace(fb.PID("pid", setpoint="where(A.angle > 0.3, r, 1)", measured="A.angle", kp="kp", ki=20))
    with pytest.raises(ModelError, match=r"PID 'pid': the rate of 'pid.integral' decides by 'A.angle'.*Write a smooth"):
        m.sensitivity(["A.angle"], ["kp"], analysis="motion", t_end=0.1)
