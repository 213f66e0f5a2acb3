"""Instants offset + k period that rounding parts from the times that they stand for."""

from __future__ import annotations

from decimal import Decimal

import numpy as np
import pytest

import flyball as fb
from tests.control.slide import slide


@pytest.mark.parametrize(("offset", "period"), [("0", "0.03"), ("0.02", "0.01"), ("0.1", "0.1"), ("0.013", "0.05")])
def test_a_law_that_jumps_at_an_instant_is_there_what_it_is_from_then_on(offset, period):
    """11 * 0.03 is a bit less than 0.33: what jumps then was seen a whole period late."""
    for k in (1, 3, 7, 11, 12, 15, 22, 23, 27):
        jump = float(Decimal(offset) + k * Decimal(period))
        held = {"period": float(period), "offset": float(offset)}
        m = slide(fb.StateSpace("s", inputs=[f"where(t < {jump!r}, 0, 1)"], D=[[1]], **held), force="s")
        half = 0.5 * float(period)
        r = m.simulate(jump + float(period), outputs=[0.0, jump - half, jump + half])
        assert r["s.output"].tolist() == [0.0, 0.0, 1.0], (k, jump)


@pytest.mark.parametrize("method", ["auto", "rk45", "radau"])
@pytest.mark.parametrize("t_end", [1.25, 3.0])
def test_an_event_beside_an_instant_is_passed(method, t_end):
    """3 * 0.1 is a bit more than 0.3: what is left to it after a blow is no step. It is w' = -(300 w + 8 x) / J."""
    for at in ("0.3", "0.6", "0.7", "1.2"):
        m = fb.Mechanism("z", planar=True)
        m.add(fb.Body("a", mass=1.0, inertia=0.1, angular_velocity=-0.9), fb.Revolute("A", "ground", "a", at=(0, 0)))
        m.add(fb.StateSpace("s", period=0.1, inputs=["A.angle"], D=[[-3.0]]), fb.Motor("M", "A", torque="s"))
        m.add(fb.CoordinateSpring("k", "A.angle", stiffness=5, damping=300.0))
        m.add(fb.Event("blow", f"t > {at}", do=[fb.Impulse("A.angle", 0.05)]))
        r = m.simulate(t_end, outputs=5, method=method)
        thrown = (-0.09 * np.exp(-8 * t_end / 300) + 0.05 * np.exp(-8 * (t_end - float(at)) / 300)) / 300
        assert r["A.angle"][-1] == pytest.approx(thrown, abs=5e-7)


@pytest.mark.parametrize("method", ["dop853", "rk45", "radau"])
@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_an_output_time_that_is_an_events_is_after_it(method, coordinates):
    """However rounding puts the event: the state of an integrator that drives a pendulum jumps."""
    for at in (0.3, 0.37, 0.5, 0.6, 0.7):
        for rtol in (1e-7, 1e-9):
            m = fb.Mechanism("z", planar=True, gravity=(0, -9.81))
            m.add(fb.Body("a", mass=1.0, inertia=0.1, position=(0.5, 0)), fb.Revolute("A", "ground", "a", at=(0, 0)))
            m.add(fb.Integrator("I", of="A.angle"), fb.Motor("q", "A", torque="-I"))
            m.add(fb.Event("e", f"t > {at}", do=[fb.Set("I.value", 7.0)]))
            r = m.simulate(1.0, outputs=[0.0, at, 1.0], method=method, rtol=rtol, coordinates=coordinates)
            assert r["I.value"][1] == pytest.approx(7.0, rel=1e-12), (at, rtol)
