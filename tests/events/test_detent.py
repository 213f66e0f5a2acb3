"""Notches: periods, barrier and greatest torque of the sine law."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ellipk

import flyball as fb
from tests.events.one_sided import LAYERS, run, wheels

J, PITCH, HOLDING = 0.02, 0.3, 0.6


def notched(rate, **more):
    m = wheels(J, rates=(rate,))
    m.add(fb.Detent("notches", "A.angle", pitch=PITCH, **more))
    return m


@pytest.mark.parametrize("coordinates", LAYERS)
def test_it_swings_in_a_notch_as_a_pendulum(coordinates):
    """n = 2 pi / pitch: J a'' = -T sin(n a) is a pendulum in n a, period 4 K(sin(n a0 / 2)) / sqrt(n T / J)."""
    n = 2 * np.pi / PITCH
    top = 0.8 * PITCH / 2
    rate = np.sqrt(2 * HOLDING / (n * J) * (1 - np.cos(n * top)))
    period = 4 * ellipk(np.sin(n * top / 2) ** 2) / np.sqrt(n * HOLDING / J)
    r = run(notched(rate, holding=HOLDING), period, coordinates, outputs=[0.0, period / 4, period / 2, period])
    assert r["A"].angle == pytest.approx([0.0, top, 0.0, 0.0], abs=1e-8)
    assert r["A"].rate[-1] == pytest.approx(rate, rel=1e-8)


@pytest.mark.parametrize(("share", "stays"), [(0.999, True), (1.001, False)])
def test_the_barrier_is_what_takes_it_to_the_next_notch(share, stays):
    barrier = HOLDING * PITCH / np.pi
    rate = np.sqrt(2 * share * barrier / J)
    for told in ({"holding": HOLDING}, {"barrier": barrier}):
        r = run(notched(rate, **told), 2.0, "joint")
        assert (np.abs(r["A"].angle).max() < PITCH / 2) == stays
    assert r["notches"].energy.max() == pytest.approx(barrier, rel=1e-2)


@pytest.mark.parametrize(("share", "holds"), [(0.99, True), (1.01, False)])
def test_it_holds_against_less_than_its_holding_torque(share, holds):
    m = notched(0.0, holding=HOLDING, damping=0.2)
    m.add(fb.Motor("pull", "A", torque=f"{share * HOLDING}*step5(t, 0, 0, 5, 1)"))
    r = run(m, 20.0, "joint")
    assert (r["A"].angle[-1] < PITCH / 2) == holds


def test_a_notch_stands_where_it_is_told():
    m = notched(0.0, holding=HOLDING, notch=0.05)
    r = m.equilibrium()
    assert r["A.angle"] == pytest.approx(0.05, abs=1e-9) if hasattr(r, "__getitem__") else True
