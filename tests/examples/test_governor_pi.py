"""The governor with a PI controller: its droop by a formula, its closed loop by the control library."""

from __future__ import annotations

import runpy

import numpy as np
import pytest

from tests.mechanisms import EXAMPLES

KI = 8.0


@pytest.fixture(scope="module")
def example():
    return runpy.run_path(str(EXAMPLES / "governor_pi.py"))


def test_the_integral_takes_the_droop_away(example):
    """Droop: the sleeve stands where the valve gives the load, (m + M) g = m l W^2 cos(alpha) says the speed there."""
    p, speed, mechanism = example["P"], example["speed"], example["mechanism"]
    droop, whole = (mechanism(ki=ki).simulate(60, outputs=61) for ki in (0.0, KI))
    assert droop["shaft.angle_rate"][1] == pytest.approx(speed(0.0), rel=1e-6)
    assert droop["shaft.angle_rate"][-1] == pytest.approx(speed(-p["more"] / p["kp"]), rel=2e-5)
    assert whole["shaft.angle_rate"][-1] == pytest.approx(speed(0.0), rel=2e-5)
    assert whole["valve.integral"][-1] == pytest.approx(p["load"] + p["more"], rel=1e-4)
    assert whole["shaft.angle_rate"].min() < speed(0.0) - 0.2


def test_closed_loop_is_that_of_the_control_library(example):
    """The plant by itself, closed by PI and lag there; about a steady motion, seen from a frame that turns."""
    ct = pytest.importorskip("control")
    p = example["P"]
    closed = example["mechanism"](ki=KI, more=0.0).linearize()
    hardly = example["mechanism"](kp=1e-13, more=0.0)  # the valve stays where it is
    plant = hardly.linearize(["engine torque"], ["guide.displacement"])
    zeros, poles, gain = plant.transfer()
    P = ct.zpk(zeros, poles, gain)
    s = ct.tf("s")
    loop = 1 + P * (p["kp"] + KI / s) / (p["lag"] * s + 1)
    w = closed.eigenvalues
    for x in w[np.abs(w) > 1e-6]:
        near = abs(complex(ct.evalfr(loop, x * (1 + 1e-5)))) + abs(complex(ct.evalfr(loop, x * (1 + 1e-5j))))
        assert abs(complex(ct.evalfr(loop, x))) < 1e-3 * near
    assert w.real[np.abs(w) > 1e-6].max() < -0.2
