"""A ball on an elastic rope, taut and slack: against piecewise integration with events, and small oscillations."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.layers import both_layers
from tests.mechanisms import G, example

pytestmark = both_layers

K, FREE, M = 150.0, 1.0, 1.0


def taut(_, y):
    d = np.hypot(y[0], y[1])
    pull = K * (d - FREE) / (M * d)
    return [y[2], y[3], -pull * y[0], -pull * y[1] - G]


def slack(_, y):
    return [y[2], y[3], 0.0, -G]


def stretched(_, y):
    return np.hypot(y[0], y[1]) - FREE


stretched.terminal = True


def pieces(y, times):
    """Motion from a slack start: each piece goes on to the instant when the rope tightens or slackens."""
    out, t, pulled, switches = np.zeros((len(times), 4)), 0.0, False, 0
    while t < times[-1]:
        f = taut if pulled else slack
        stretched.direction = -1 if pulled else 1
        s = solve_ivp(f, (t, times[-1]), y, "DOP853", events=stretched, dense_output=True, rtol=1e-13, atol=1e-14)
        here = (times >= t) & (times <= s.t[-1])
        out[here] = s.sol(times[here]).T
        t, y, pulled, switches = s.t[-1], s.y[:, -1], not pulled, switches + 1
    return out, switches


def test_taut_and_slack():
    """Falls, bounces in the rope, flies and is caught again: the same path, though nobody tells it of the events."""
    r = example("rope_pendulum.toml").simulate(5.0, rtol=1e-11, atol=1e-12, outputs=201)
    y, switches = pieces([0.7, 0.3, 0.0, 0.0], r.t)
    assert switches > 5
    assert r["ball"].position == pytest.approx(y[:, :2], abs=1e-8)
    assert r["ball"].velocity == pytest.approx(y[:, 2:], abs=2e-7)
    length = np.hypot(y[:, 0], y[:, 1])
    assert r["rope.length"] == pytest.approx(length, abs=1e-8)
    assert r["rope.tension"] == pytest.approx(np.maximum(K * (length - FREE), 0), abs=2e-6)
    assert (r["rope.tension"] >= 0).all()
    assert (r["rope.tension"] == 0).sum() > 20
    assert r.energy.drift < 1e-7


def test_small_oscillations():
    """About rest: up and down with sqrt(k / m), sideways with sqrt(g / (l + m g / k)); they do not mix to first order."""
    hang = FREE + M * G / K
    tiny = 1e-5
    chosen = {"x": tiny, "y": -hang - tiny}
    r = example("rope_pendulum.toml").simulate(3.0, rtol=1e-12, atol=1e-15, outputs=301, parameters=chosen)
    assert -hang - r["ball.y"] == pytest.approx(tiny * np.cos(np.sqrt(K / M) * r.t), abs=2e-9)
    assert r["ball.x"] == pytest.approx(tiny * np.cos(np.sqrt(G / hang) * r.t), abs=2e-9)
    assert (r["rope.tension"] > 0).all()
