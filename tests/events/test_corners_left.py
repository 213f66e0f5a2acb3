"""Laws that hold the motion on a corner, and let it go: however the law is written, by every method."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flyball as fb
from tests.events.test_corners import cart
from tests.layers import both_layers

pytestmark = both_layers

FINE = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14, "max_step": 0.01}
CLEAR = 1e-4  # [s]
STIFF, SOFT = 10.0, 1.0  # [N s/m], of a damper to a base that moves at .3 cos 5t
BASE = "(rate - 0.3*cos(5*t))"
LAWS = [
    f"where(rate*{BASE} > 0, -10, -1)*{BASE} - 5*value",
    f"where(rate > 0, where({BASE} > 0, -10, -1), where({BASE} > 0, -1, -10))*{BASE} - 5*value",
    f"where(rate > 0 and {BASE} > 0 or rate < 0 and {BASE} < 0, -10, -1)*{BASE} - 5*value",
    f"where(sign(rate)*sign({BASE}) > 0, -10, -1)*{BASE} - 5*value",
    f"-(5.5 + 4.5*sign(rate*{BASE}))*{BASE} - 5*value",
]


def skyhook(times):
    """Speeds of 1 kg at 1 m/s first, on 5 N/m and the damper that is stiff where it brakes: the instants too.

    From event to event; on rate = 0, where it is held, the damping is what stands still asks for, -5 x / .3 cos 5t.
    """

    def asked(t, x):
        return 5.0 * x[0] / (0.3 * np.cos(5.0 * t))

    def acceleration(t, x, c):
        return -c * (x[1] - 0.3 * np.cos(5.0 * t)) - 5.0 * x[0]

    t, x, c, said, out = 0.0, np.array([0.0, 1.0]), STIFF, [], np.ones(len(times))
    while t < times[-1] - 1e-12:
        held = c is None
        ends = (
            [lambda t, x: asked(t, x) - SOFT, lambda t, x: asked(t, x) - STIFF]
            if held
            else [lambda t, x: x[1], lambda t, x: x[1] - 0.3 * np.cos(5.0 * t)]
        )
        for end in ends:
            end.terminal = True

        def goes(t, x, c=c):
            return (0.0, 0.0) if c is None else (x[1], acceleration(t, x, c))

        off = solve_ivp(goes, (t, t + CLEAR), x, **FINE)  # away from the event that it begins on
        s = solve_ivp(goes, (t + CLEAR, times[-1]), off.y[:, -1], events=ends, dense_output=True, **FINE)
        here = (times >= t) & (times <= s.t[-1])
        out[here] = s.sol(times[here])[1] if here.any() else 0.0
        t, x = s.t[-1], s.y[:, -1].copy()
        if not s.status:
            break
        if held:  # it goes on by the damping that it has come to
            c = SOFT if len(s.t_events[0]) else STIFF
            said.append(t)
        elif len(s.t_events[1]):
            c = STIFF + SOFT - c
        else:
            x[1], base = 0.0, 0.3 * np.cos(5.0 * t)
            above, below = (SOFT, STIFF) if base > 0.0 else (STIFF, SOFT)
            up, down = acceleration(t, x, above), acceleration(t, x, below)
            c = None if up < 0.0 < down else (above if up > 0.0 else below)
            said += [t] if c is None else []
    return out, said


def with_parameter(name, value, law):
    m = cart("0", velocity=(1, 0))
    m.parameters[name] = value
    m.replace(fb.Actuator("drive", "track.displacement", force=law))
    return m


TIMES = np.linspace(0.0, 2.0, 41)


@pytest.mark.parametrize("law", LAWS)
def test_it_is_left_by_whatever_the_law_is_written_with(law):
    v, instants = skyhook(TIMES)
    r = cart(law, velocity=(1, 0)).simulate(2, outputs=TIMES, rtol=1e-11)
    assert [e.kind for e in r.events] == ["hold", "leave"]
    assert [e.t for e in r.events] == pytest.approx(instants, abs=1e-8)
    assert r["track.rate"] == pytest.approx(v, abs=1e-8)


@pytest.mark.parametrize(
    "how",
    [
        {"method": "rk45"},
        {"method": "radau"},
        {"coordinates": "absolute"},
        {"step": "1 ms"},
        {"method": "generalised-alpha", "step": "0.5 ms"},
    ],
)
def test_it_is_left_by_every_method(how):
    v, instants = skyhook(TIMES)
    r = cart(LAWS[0], velocity=(1, 0)).simulate(2, outputs=TIMES, **how)
    near = 2e-5 if "step" in how else 1e-6
    assert [e.kind for e in r.events] == ["hold", "leave"]
    assert [e.t for e in r.events] == pytest.approx(instants, abs=near)
    assert r["track.rate"] == pytest.approx(v, abs=near)


@pytest.mark.parametrize("pull", [2.0, -2.0])
@pytest.mark.parametrize(
    "law",
    [
        "where(rate > 0, -3, 3)",
        "where(rate > 0 and rate < 10 and t > -1, -3, 3)",
        "where(not rate > 0 or t < 0, 3, -3)",
        "where(sign(rate) > 0.5, -3, 3)",
        "where(sign(rate) > most, -3, 3)",
        "3 - 6*max(0, sign(rate))",
        "3 - 6*min(1, 1 + sign(rate), 2)",
        "3 - 3*abs(sign(rate) + 1)",
        "-3*sign(sign(rate))",
    ],
)
def test_friction_in_many_words(law, pull):
    """-3 sign(v) with a pull of 2 t: from 1 m/s to rest at t^2 -+ 3 t = -+1, and away from t = 1.5 on."""
    m = with_parameter("most", 0.5, f"{pull}*t + {law}")
    r = m.simulate(3, outputs=4, rtol=1e-11)
    way = np.sign(pull)
    assert [e.kind for e in r.events] == ["hold", "leave"]
    assert [e.t for e in r.events] == pytest.approx([way * (3 - np.sqrt(9 - way * 4)) / 2, 1.5], abs=1e-9)
    assert r["track.rate"] == pytest.approx([1, 0, way * 0.25, way * 2.25], abs=1e-9)


def test_every_run_of_a_study():
    m = with_parameter("stiff", STIFF, LAWS[0].replace("-10", "-stiff"))
    study = m.study({"stiff": [8.0, 10.0, 12.0]}, ["min(track.rate)"], t_end=2, progress=False)
    assert (study.status == 1).all()
