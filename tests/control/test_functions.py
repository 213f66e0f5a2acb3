"""Python functions as laws of controllers: the numbers of the same expressions."""

from __future__ import annotations

import math

import numpy as np
import pytest

import flyball as fb
from tests.control.slide import TIGHT, slide

SINE = "amp*sin(3*t)"


def sine(t, amp):
    return amp * math.sin(3 * t)


def called_back(t):
    return float(str(t))


PAIRS = {
    "lag": (lambda x: fb.Lag("c", of=x(sine, SINE), time=0.1)),
    "gain": (lambda x: fb.Integrator("c", of="A.displacement + 1", gain=x(sine, SINE))),
    "state": (lambda x: fb.State("c", rate=x(lambda t, amp, factor=1.5: amp * factor - t, "amp*1.5 - t"))),
    "sampled": (lambda x: fb.State("c", next=x(lambda c, t: 0.5 * c + t, "0.5*c + t"), period=0.1)),
    "one input": (lambda x: fb.StateSpace("c", inputs=x(sine, SINE), A=-1, B=1, C=1)),
    "called back": (lambda x: fb.Lag("c", of=x(called_back, "t"), time=0.1)),
}


@pytest.mark.filterwarnings("ignore::flyball.PerformanceNotice")
@pytest.mark.parametrize("made", PAIRS.values(), ids=PAIRS)
def test_they_are_the_expressions(made):
    """They ended in a TypeError."""
    runs = [
        slide(made(lambda *pair, k=k: pair[k]), force="c", amp=2.0).simulate(1, outputs=21, **TIGHT) for k in (0, 1)
    ]
    np.testing.assert_allclose(runs[0]["A.displacement"], runs[1]["A.displacement"], rtol=1e-12, atol=1e-14)
    assert abs(runs[1]["A.displacement"][-1]) > 1e-3
    np.testing.assert_array_equal(runs[0]["c.output"], runs[1]["c.output"])


@pytest.mark.parametrize("period", [None, 0.01])
def test_a_scheduled_gain_within_limits(period):
    def made(setpoint, kp):
        pid = fb.PID(
            "c", setpoint=setpoint, measured="A.displacement", kp=kp, ki=5, kd=1, filter=0.05, lower=-3, upper=4,
            period=period,
        )  # fmt: skip
        return slide(pid, force="c", amp=2.0).simulate(2, outputs=41, **TIGHT)["c.output"]

    expected = made(SINE, "20 + t")
    assert expected.max() == 4.0
    np.testing.assert_allclose(made(sine, lambda t: 20 + t), expected, atol=1e-9)


def test_they_ask_for_other_controllers():
    def made(of, force):
        first, last = fb.Lag("f", of="sin(t)", time=0.1), fb.Lag("c", of=of, time=0.1)
        return slide(first, last, force=force).simulate(1, outputs=21, **TIGHT)["A.displacement"]

    expected = made("f*f + t", "c - f")
    np.testing.assert_allclose(made(lambda f, t: f * f + t, lambda c, f: c - f), expected, rtol=1e-12, atol=1e-14)


def test_what_they_cannot(tmp_path):
    m = slide(fb.Lag("c", of=sine, time=0.1), force="c", amp=2.0)
    for ask in (m.linearize, m.equilibrium, m.modes, lambda: m.simulate(1, method="radau")):
        with pytest.raises(fb.ModelError, match=r"sine.* has no derivatives"):
            ask()
    with pytest.raises(fb.ModelError, match="Lag 'c': of is the Python function 'sine', and a model file cannot"):
        m.save(tmp_path / "m.toml")
    with pytest.raises(fb.ModelError, match="Lag 'd': unknown name 'q'"):
        m.add(fb.Lag("d", of=lambda q: q, time=1))

    def late(t):
        if t > 0.5:
            raise ValueError("no more")
        return t

    with pytest.raises(fb.SimulationError, match=r"Lag 'c': the Python function <late\(t\)> raises ValueError"):
        slide(fb.Lag("c", of=late, time=0.1), force="c").simulate(1)
