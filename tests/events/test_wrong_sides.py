"""A law that is on the wrong side of its corner, by whatever fault, is found at the step's end and put right, or told."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.simulation.events.nonsmooth_laws import Corners
from tests.layers import both_layers

pytestmark = both_layers


def cart(force, *more, **start) -> fb.Mechanism:
    m = fb.Mechanism("cart", planar=True, gravity=(0, 0))
    m.add(fb.Body("cart", mass=1, inertia=1, **start), fb.Prismatic("s", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.Actuator("drive", "s.displacement", force=force), *more)
    return m


def wrongly(monkeypatch, times):
    """Have sides be taken wrongly, the first few times that they are settled."""
    count, right = [0], Corners.settle

    def settle(self):
        jumps = right(self)
        if count[0] < times:
            count[0] += 1
            self.n.ways()[self.all] *= -1.0
        return jumps

    monkeypatch.setattr(Corners, "settle", settle)


@pytest.mark.parametrize("method", ["dop853", "radau"])
def test_a_wrong_side_at_the_start(monkeypatch, method):
    """v' = 2 - |v| / 2 from v = 1."""
    wrongly(monkeypatch, 1)
    r = cart("2 - 0.5*abs(rate)", velocity=(1, 0)).simulate(1.5, outputs=2, rtol=1e-10, method=method)
    assert r["cart.vx"][-1] == pytest.approx(4 - 3 * np.exp(-0.75), abs=1e-8)


@pytest.mark.parametrize("where", [0.5, -0.5])
def test_a_wrong_side_of_a_place(monkeypatch, where):
    """On either side of x = where / 2 other forces, 1 N and 3 N; from rest at 0, away from that place and past it."""
    wrongly(monkeypatch, 1)
    r = cart(f"where(value > {where / 2}, 3, 1)").simulate(2, outputs=2, rtol=1e-10)
    speed = 6.0 if where < 0 else np.sqrt(2 * 0.25) + 3 * (2 - np.sqrt(0.5))
    assert r["cart.vx"][-1] == pytest.approx(speed, abs=1e-8)


def test_a_law_that_is_put_right_at_a_jump(monkeypatch):
    """What a jump in time has carried across was taken for what passes zero there: the branch of before, once silent."""
    monkeypatch.setattr(Corners, "_carried", lambda self, found: set())
    for law in ("abs(where(t<1, 1, -3) + 1e-9*value)", "abs(where(t<1, 1, -3) - 1e-9*value)"):
        assert cart(law).simulate(2, outputs=3)["cart.vx"][-1] == pytest.approx(4.0, abs=1e-7)


def test_a_law_of_a_held_rate_is_put_right(monkeypatch):
    """The side was that of a rate's rounding: once silent. Locked, then v' = +-(2 - |v| / 2)."""
    monkeypatch.setattr(Corners, "_rounding_of", lambda self, s, u, least: least)
    for way in (1, -1):
        for came in (1, -1):
            lock = fb.Event("lock", "t > 0.2", do=[fb.Lock("s")])
            free = fb.Event("free", "t > 0.5", do=[fb.Release("s")])
            m = cart(f"{2 * way} - {0.5 * way}*abs(rate)", lock, free, velocity=(came, 0))
            r = m.simulate(1.5, outputs=2, rtol=1e-10)
            assert r["cart.vx"][-1] == pytest.approx(way * 4 * (1 - np.exp(-0.5)), abs=1e-8)


def test_sides_that_are_always_wrong_end_in_an_error(monkeypatch):
    wrongly(monkeypatch, 10**9)
    with pytest.raises(fb.SimulationError):
        cart("2 - 0.5*abs(rate)", velocity=(1, 0)).simulate(1.5, outputs=2)
