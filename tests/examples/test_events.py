"""The examples with events, each against a closed form of its own numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from tests.mechanisms import example

G = 9.81
TIGHT = {"rtol": 1e-10, "atol": 1e-12}


def times(r, name, kind):
    return [e.t for e in r.events if e.name == name and e.kind == kind]


def test_bouncing_ball():
    """Falls 1 m; from then on each hop takes 0.75 times the one before: the series ends at t1 (1 + 2 e / (1 - e))."""
    e, t1 = 0.75, math.sqrt(2 / G)
    r = example("bouncing_ball.toml").simulate(4.0, outputs=41, **TIGHT)
    hits = times(r, "floor contact", "impact")
    hops = [t1 * (1 + 2 * sum(e**j for j in range(1, k + 1))) for k in range(len(hits))]
    assert hits[:20] == pytest.approx(hops[:20], abs=1e-9)
    ends = t1 * (1 + 2 * e / (1 - e))
    assert r.events["rest"][0].t == pytest.approx(ends, abs=1e-5)
    assert np.allclose(r["ball.y"][r.t > ends + 1e-4], 0.04, atol=1e-12)
    assert np.allclose(r["ball.x"], 0.4 * r.t, atol=1e-9)
    assert r.exchanged["impact_loss"][-1] == pytest.approx(0.2 * G * 1.0, rel=1e-8)
    assert r.health.energy_drift < 1e-9


def test_ratchet_hoist():
    """The first stroke takes the wheel by 52 degrees, from where it falls back to the tooth at 45; each one after takes it
    as far beyond its tooth as the lever goes beyond where it meets the wheel again."""
    r = example("ratchet.toml").simulate(6.0, outputs=601, **TIGHT)
    wheel, lever = np.degrees(r["axle.angle"]), np.degrees(r["pivot.angle"])
    assert wheel[100] == pytest.approx(52.0, abs=1e-6)  # the lever has gone from -26 to 26
    assert np.degrees(r["axle.angle"][198]) == pytest.approx(45.0, abs=1e-7)
    assert (np.diff(wheel) > -8).all()
    held = r["holding pawl"].force[198]
    assert held == pytest.approx(40.0, rel=1e-6)  # carries the load alone
    assert (np.diff(wheel - lever) > -1e-6).all()


def test_gears_with_backlash():
    """The table stands where the motor turns, until the other flank touches: it turns by 2 (60 - 2) / 3 degrees in all."""
    r = example("gear_backlash.toml").simulate(8.0, outputs=801, **TIGHT)
    table, motor = np.degrees(r["table bearing.angle"]), np.degrees(r["motor shaft.angle"])
    late = r.t > 1.0
    assert table[late].max() == pytest.approx(58 / 3, abs=1e-7)
    assert table[late].min() == pytest.approx(-58 / 3, abs=1e-7)
    lag = np.abs(motor + 3 * table)
    assert lag.max() < 2 + 1e-8
    # the flank is reached where the motor has come back by the play: 60 sin(pi t / 2) = 56
    back = 2 - math.asin(56 / 60) * 2 / math.pi
    assert min(abs(e.t - back) for e in r.events["teeth"]) < 1e-8


def test_cam_follower():
    """It leaves where e w^2 sin(w t) is what weight and spring give, flies on the spring, and lands."""
    e, w, m, k, F = 0.008, 1200 * 2 * math.pi / 60, 0.3, 800.0, 20.0
    r = example("cam_follower.toml").simulate(0.12, outputs=121, **TIGHT)
    down = lambda y: (m * G + F + k * y) / m  # noqa: E731
    leaves = brentq(lambda t: e * w * w * math.sin(w * t) - down(e * math.sin(w * t)), 0, math.pi / 2 / w)
    assert times(r, "face contact", "open")[0] == pytest.approx(leaves, abs=1e-8)
    y0, v0 = e * math.sin(w * leaves), e * w * math.cos(w * leaves)
    n = math.sqrt(k / m)
    rest = -(m * G + F) / k
    fly = lambda s: rest + (y0 - rest) * math.cos(n * s) + v0 / n * math.sin(n * s)  # noqa: E731
    lands = brentq(lambda s: fly(s) - e * math.sin(w * (leaves + s)), 1e-3, 0.06)
    hit = r.events["impact"][0]
    assert hit.t == pytest.approx(leaves + lands, abs=1e-8)
    speed = -(y0 - rest) * n * math.sin(n * lands) + v0 * math.cos(n * lands)
    relative = speed - e * w * math.cos(w * hit.t)
    assert hit.lost == pytest.approx(0.5 * m * relative**2, rel=1e-6)


def test_clock_escapement():
    """Each tick gives torque * 2 lead. Kryloff and Bogoliuboff: amplitude where pi c w A^2 / 2 is that, to the second order
    in A; the period there is the free pendulum's, T0 (1 + A^2 / 16)."""
    m, L, c, lead, torque = 4.0, 0.994, 0.02, math.radians(1), 0.03
    inertia = m * L * L + 1e-4
    w0 = math.sqrt(m * G * L / inertia)
    r = example("clock_escapement.toml").simulate(20.0, outputs=2001, rtol=1e-9, atol=1e-11)
    ticks = r.events["tick"].t
    assert len(ticks) == 10
    given = r["escape wheel"].work
    per_tick = [given[np.searchsorted(r.t, t + 0.5)] - given[np.searchsorted(r.t, t - 0.5)] for t in ticks[1:-1]]
    assert per_tick == pytest.approx([torque * 2 * lead] * len(per_tick), rel=1e-8)
    # amplitude: d(A^2)/dt follows energy given less lost, from 3 degrees on
    wanted = solve_ivp(lambda t, y: [(torque * 2 * lead - math.pi * c * w0 * y[0] ** 2 / 2) / (math.pi / w0)
                                     / (m * G * L * math.sin(y[0]))], (0, 20), [math.radians(3)], rtol=1e-9).y[0, -1]  # fmt: skip
    late = np.abs(r["suspension.angle"][r.t > 17.5]).max()
    assert late == pytest.approx(wanted, rel=0.01)
    period = np.diff(r.events["middle"].t).mean()
    A = np.abs(r["suspension.angle"]).mean() * math.pi / 2
    assert period == pytest.approx(2 * math.pi / w0 * (1 + A * A / 16), rel=1e-4)
    assert r.health.energy_drift < 1e-7


def test_rocking_block():
    """About an edge I0 a'' = -m g R sin(alpha - a), I0 = 4/3 m R^2; at each change of edges 1 - 3/2 sin^2(alpha) of the
    rate is left (Housner 1963)."""
    alpha, R, tilt = math.atan(0.25), math.hypot(0.2, 0.8), math.radians(8)
    p2, left = 3 * G / (4 * R), 1 - 1.5 * math.sin(alpha) ** 2
    r = example("rocking_block.toml").simulate(3.0, outputs=301, method="dop853", **TIGHT)

    def fall(t, y):
        return [y[1], -p2 * math.sin(alpha - y[0])]

    def down(t, y):
        return y[0]

    down.terminal, down.direction = True, -1  # type: ignore[attr-defined]
    t, y, wanted = 0.0, [tilt, 0.0], []
    while len(wanted) < 3:
        s = solve_ivp(fall, (0, 5), y, events=down, rtol=1e-12, atol=1e-13)
        t, y = t + s.t[-1], [1e-14, -left * s.y[1, -1]]
        wanted.append(t)
    hits = [e.t for e in r.events if e.kind == "impact" and e.lost > 1e-6]
    assert hits[:3] == pytest.approx(wanted, abs=1e-7)
    rate = r["block.angular_velocity"]
    assert np.abs(rate).max() < 1.0
    first = next(e for e in r.events if e.kind == "impact" and e.lost > 1e-6)
    before, after = first.before["block.angular_velocity"], first.after["block.angular_velocity"]
    assert after / before == pytest.approx(left, rel=1e-8)
    assert r.health.energy_drift < 1e-6 * 100 * G


def test_geneva_drive():
    """In the slot the wheel stands at atan(sin a / (sqrt(2) - cos a)) for the crank at a from the line of centres, and turns
    1 / (sqrt(2) - 1) times as fast as the crank half way; between, it stands still."""
    r = example("geneva_drive.toml").simulate(3.0, outputs=601, **TIGHT)
    a = 2 * np.pi * r.t - np.pi / 4
    turn, a = np.divmod(a + np.pi, 2 * np.pi)
    a = a - np.pi
    inside = np.abs(a) < np.pi / 4
    beta = -np.arctan2(np.sin(a), np.sqrt(2) - np.cos(a))
    wanted = -np.pi / 4 - turn * np.pi / 2 + np.where(inside, beta, np.where(a > 0, -np.pi / 4, np.pi / 4))
    assert np.allclose(r["axle.angle"], wanted, atol=1e-7)
    fastest = np.abs(r["axle.angle_rate"]).max()
    assert fastest == pytest.approx(2 * np.pi / (math.sqrt(2) - 1), rel=1e-6)
    assert np.abs(r["axle.angle_rate"][~inside & (np.abs(a) > np.pi / 4 + 1e-6)]).max() < 1e-9
    entered = np.r_[r.events["enter"].t, r.events["enter the other"].t]
    assert np.sort(entered) == pytest.approx([1.0, 2.0, 3.0], abs=1e-8)  # the last at the very end belongs to it
    assert sum(e.lost for e in r.events) < 1e-8
