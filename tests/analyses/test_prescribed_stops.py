"""Motions that drivers prescribe, of mechanisms with stops and friction: not past a stop, and friction slides."""

from __future__ import annotations

import re

import numpy as np
import pytest

import flyball as fb
from tests.layers import both_layers

pytestmark = both_layers
CRANK, ROD, SPEED = 0.1, 0.3, 2 * np.pi
REACH = ROD + CRANK  # of the slider, drawn there


def slider_crank(*more):
    m = fb.Mechanism("slider-crank", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("crank", mass=1, inertia=0.01, position=(0.05, 0)))
    m.add(fb.Body("rod", mass=1, inertia=0.02, position=(0.25, 0)))
    m.add(fb.Body("slider", mass=2, inertia=0.01, position=(REACH, 0)))
    m.add(fb.Revolute("A", "ground", "crank", at=(0, 0)), fb.Revolute("B", "crank", "rod", at=(CRANK, 0)))
    m.add(fb.Revolute("C", "rod", "slider", at=(REACH, 0)))
    m.add(fb.Prismatic("D", "ground", "slider", at=(REACH, 0), axis=(1, 0)))
    m.add(fb.Driver("drive", "A.angle", "(60 rpm)*t"), *more)
    return m


@pytest.mark.parametrize("lower", [-0.1999, -0.15])
@pytest.mark.parametrize("outputs", [3, 11])
def test_a_stop_passed_between_output_times_is_found(lower, outputs):
    """The slider's other dead centre, 2 r from the first, is at no output time."""
    with pytest.raises(fb.ModelError, match=r"Limit 'L': the drivers take D.displacement past it") as error:
        slider_crank(fb.Limit("L", "D.displacement", lower=lower)).kinematics(outputs, t_end=2.3)
    angle = SPEED * float(re.search(r"at t = ([\d.]+) s", str(error.value))[1])
    assert CRANK * np.cos(angle) + np.sqrt(ROD**2 - (CRANK * np.sin(angle)) ** 2) - REACH < lower + 1e-7


def test_what_is_only_just_not_passed():
    m = slider_crank(fb.Limit("L", "D.displacement", lower=-2 * CRANK - 1e-6, upper=1e-6))
    r = m.kinematics(11, t_end=2.3)
    (said,) = [x for x in r.health.remarks if "Limit 'L'" in x]
    assert "not passed at" in said and "no proof" in said


def test_a_freewheel_that_turns_back_between_output_times():
    m = slider_crank(fb.OneWay("W", "D.displacement", direction=-1))
    with pytest.raises(fb.ModelError, match=r"OneWay 'W': the drivers take D.displacement past it"):
        m.kinematics([0.0, 0.45, 1.45], t_start=0.0)


def test_friction_in_what_drivers_move_is_followed():
    """The same in simulate as in kinematics: no steps are refused where friction turns, and works are exact."""
    friction = (
        fb.JointFriction("rub", "D", static=0.3, kinetic=0.2),
        fb.JointFriction("pin", "A", static=0.3, radius=0.01),
    )
    m = slider_crank(*friction)
    r, k = m.simulate(2.0, outputs=81), m.kinematics(81, t_end=2.0)
    assert r["drive.effort"] == pytest.approx(k["drive.effort"], abs=1e-12) and r.health.rejected == 0
    # the guide carries D.fy: power of friction mu |N| |v| by the trapezoidal rule on fine times, away from the ends
    t = np.linspace(0.0, 2.0, 4001)
    fine = m.kinematics(t.tolist())
    power = 0.2 * np.abs(fine["D.fy"]) * np.abs(fine["D.rate"])
    assert r["rub.work"][-1] == pytest.approx(-np.trapezoid(power, t), rel=1e-5)
    assert any("rub" in x and "not determined" in x for x in r.health.remarks)
    assert r.health.energy_drift < 1e-6
