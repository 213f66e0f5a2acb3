"""Controllers in implicit methods: their states are unknowns of Newton's method as velocities are."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

import flyball as fb
from tests.control.slide import TIGHT, slide

KP, KI, KD = 80.0, 60.0, 12.0


def pid(**fields):
    given = {"setpoint": "1", "measured": "A.displacement", "kp": KP, "ki": KI, "kd": KD, "filter": 0.02}
    return fb.PID("pid", **(given | fields))


def exact(t, filter):
    """(x, v, I, slow, 1) of the slide under the PID as an exponential."""
    f = 1 / filter
    A = [[0, 1, 0, 0, 0], [-10 - KP - KD * f, -2, 1, -KD * f, KP], [-KI, 0, 0, 0, KI], [-f, 0, 0, -f, 0], [0] * 5]
    return np.array([expm(np.array(A) * s) @ [0, 0, 0, 0, 1.0] for s in t])


def missed(r, filter=0.02):
    """Largest error of position and integral."""
    y = exact(r.t, filter)
    return max(np.abs(r["A.displacement"] - y[:, 0]).max(), np.abs(r["pid.integral"] - y[:, 2]).max())


@pytest.mark.parametrize(("method", "order", "step"), [("radau", 5, 0.02), ("generalised-alpha", 2, 0.004)])
@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_order(method, order, step, coordinates):
    wide, narrow = (
        missed(slide(pid()).simulate(1, outputs=26, method=method, step=h, coordinates=coordinates))
        for h in (step, step / 2)
    )
    assert wide / narrow > 0.8 * 2**order
    assert narrow < 1e-4


def test_what_is_stiff_by_a_controller_alone():
    """A derivative's filter of a microsecond: dop853 needs five million steps for the 30 s."""
    r = slide(pid(filter=1e-6)).simulate(30, outputs=31)
    assert "radau from t = 0.00" in r.health.method and "where it is stiff" in r.health.method
    assert r.health.steps < 1500
    assert missed(r, 1e-6) < 1e-6


@pytest.mark.parametrize("fields", [{"lower": -4, "upper": 12}, {"period": 0.01, "lower": -4, "upper": 12}])
def test_limits_and_instants(fields):
    """Corners and samples are events and ends of steps to any method."""

    def run(**options):
        m = slide(pid(**fields), fb.Lag("act", of="pid", time=0.01), force="act")
        return m.simulate(0.505, outputs=11, **options)

    a, b = run(**TIGHT), run(method="radau", **TIGHT)
    for name, near in (("A.displacement", 3e-9), ("act.output", 1e-7), ("pid.integral", 3e-8)):
        assert np.abs(a[name] - b[name]).max() < near


def test_what_senses_one_body_and_pushes_another():
    """A chain in joint coordinates and in absolute ones, by dop853 and by radau: one motion."""
    m = fb.Mechanism("chain", planar=True, gravity=(0, -9.81))
    for i in range(3):
        m.add(fb.Body(f"b{i}", mass=1.0, inertia=0.1, position=(i + 0.5, 0)))
        m.add(fb.Revolute(f"R{i}", f"b{i - 1}" if i else "ground", f"b{i}", at=(i, 0)))
    m.add(
        fb.PID("p", setpoint="0.3*sin(3*t)", measured="R2.angle", kp=300, ki=200, kd=50, filter=0.005),
        fb.State("x", rate="sin(R1.angle) - x/0.1 + 0.2*R0.angle*x + p"),
        fb.Motor("far", "R2", torque="p + x"),
        fb.Motor("near", "R0", torque="40*x - 1000*(1 - cos(x))"),
        fb.TorsionalSpringDamper("stiff", joint="R0", stiffness=1e5, damping=10),
    )
    found = {}
    for coordinates in ("joint", "absolute"):
        for method in ("dop853", "radau"):
            r = m.simulate(0.5, outputs=6, coordinates=coordinates, method=method, rtol=1e-9, atol=1e-10)
            found[coordinates, method] = np.array([r["R0.angle"], r["R2.angle"], r["p.integral"], r["x.value"]])
    first = found["joint", "dop853"]
    assert all(np.abs(y - first).max() < 3e-7 * np.abs(first).max() for y in found.values())


def test_who_says_no():
    with pytest.raises(fb.ModelError, match=r"variational.*does not support PID 'pid'"):
        slide(pid()).simulate(1, method="variational", step=1e-3)
