"""Laws by abs(rate) of what something holds for a while: as it lets go, the law is on the side to which it goes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flyball as fb
from tests.layers import both_layers

pytestmark = both_layers
SPEEDS, FORCES = (0, 0.05, 0.2, 1, 5), (1.0, 0.8, 0.5, 0.45, 0.6)
STIFFNESS, BELT, STATIC = 1.7, 0.3, 1.2
STRIBECK = {
    "cap(abs(rate))": lambda u: np.interp(u, SPEEDS, FORCES),
    "1-.6*tanh(4*max(0,abs(rate)))": lambda u: 1 - 0.6 * np.tanh(4 * u),
}


def slide(m, name, joint):
    m.add(fb.Body(name, mass=1, inertia=1), fb.Prismatic(joint, "ground", name, at=(0, 0), axis=(1, 0)))


def cart(force, *more, velocity=0.0) -> fb.Mechanism:
    m = fb.Mechanism("cart", planar=True, gravity=(0, 0))
    m.add(fb.Body("b", mass=1, inertia=1, velocity=(velocity, 0)))
    m.add(fb.Prismatic("s", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.Actuator("push", "s.displacement", force=force), *more)
    return m


def belt(capacity):
    """A block on a spring, on a belt whose friction falls with the speed of sliding."""
    m = fb.Mechanism("belt", planar=True, gravity=(0, 0))
    slide(m, "b", "s")
    slide(m, "belt", "u")
    m.add(fb.Table("cap", x=SPEEDS, y=FORCES, interpolation="linear", beyond="hold"))
    m.add(fb.Driver("d", "u.displacement", f"{BELT}*t"))
    m.add(fb.CoordinateSpring("k", "s.displacement", stiffness=STIFFNESS))
    m.add(fb.Clutch("c", "s.displacement", "u.displacement", capacity=capacity, static=STATIC))
    return m


def slip(capacity, x, v):
    """How long the block slides, and where it sticks: scipy's."""

    def stuck(_, y):
        return y[1] - BELT

    stuck.direction, stuck.terminal = 1, True
    f = STRIBECK[capacity]
    s = solve_ivp(
        lambda _, y: [y[1], f(abs(BELT - y[1])) - STIFFNESS * y[0]], (0, 10), [x, v],
        method="DOP853", events=stuck, rtol=1e-11, atol=1e-13, max_step=0.02,
    )  # fmt: skip
    return s.t[-1], s.y[0, -1]


@pytest.mark.parametrize("capacity", STRIBECK)
def test_stick_and_slip_with_friction_that_falls_with_the_speed(capacity):
    """It sticks until the spring pulls STATIC times as much, and all slips after that last the same."""
    let_go = STATIC / STIFFNESS
    (first, x0), (each, x1) = slip(capacity, 0.0, 0.0), slip(capacity, let_go, BELT - 1e-13)
    times = [first, first + (let_go - x0) / BELT]
    for _ in range(2):
        times += [times[-1] + each, times[-1] + each + (let_go - x1) / BELT]
    m = belt(capacity)
    for options in (
        {},
        {"rtol": 1e-9, "max_step": 0.013},
        {"max_step": 0.1},
        {"rtol": 1e-5},
        {"method": "rk45", "max_step": 0.02},
        {"method": "dop853", "rtol": 1e-11},
        {"method": "radau", "rtol": 1e-8},
    ):
        r = m.simulate(14, outputs=3, **options)
        told = [e for e in r.events if e.kind in ("stick", "slip")]
        assert [e.kind for e in told] == ["stick", "slip"] * 2 + ["stick"], options
        assert [e.t for e in told] == pytest.approx(times[:5], abs=10 * options.get("rtol", 1e-7) ** 0.75), options
        assert not r.health.warnings


def test_and_where_it_is_cut():
    m = belt("cap(abs(rate))")
    whole, r = m.simulate(20, rtol=1e-9, outputs=3), None
    for t in (12.458, 14.83574, 15.9039, 18.849, 20.0):
        r = m.simulate(t, rtol=1e-9, outputs=3, start=r)
    assert r["b.x"][-1] == pytest.approx(whole["b.x"][-1], abs=1e-8)
    assert r["b.vx"][-1] == pytest.approx(whole["b.vx"][-1], abs=1e-8)


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize("came", [1, -1])
def test_a_lock_lets_go(way, came):
    """v' = way (2 - |v| / 2): |v| = 4 (1 - exp(-t / 2))."""
    lock, free = fb.Event("lock", "t > 0.2", do=[fb.Lock("s")]), fb.Event("free", "t > 0.5", do=[fb.Release("s")])
    m = cart(f"{2 * way} - {0.5 * way}*abs(rate)", lock, free, velocity=came)
    r = m.simulate(1.5, outputs=2, rtol=1e-10)
    assert r["b.vx"][-1] == pytest.approx(way * 4 * (1 - np.exp(-0.5)), abs=1e-9)


@pytest.mark.parametrize(
    "holds", [fb.Limit("stop", "s.displacement", lower=-0.1), fb.OneWay("wheel", "s.displacement")]
)
@pytest.mark.parametrize("c", [0.5, -0.5])
def test_a_stop_lets_go(holds, c):
    """Pressed until t = 1, then v' = 2 (t - 1) - c |v|."""
    start = -0.3 if isinstance(holds, fb.Limit) else 0.1
    r = cart(f"2*(t-1) - {c}*abs(rate)", holds, velocity=start).simulate(2.5, outputs=2, rtol=1e-10)
    s = 1.5
    assert r["b.vx"][-1] == pytest.approx(2 * s / c - 2 * (1 - np.exp(-c * s)) / c**2, abs=1e-9)
