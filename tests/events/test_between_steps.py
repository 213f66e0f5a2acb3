"""Between the ends of steps that stability limits, not accuracy: rows of output and guards are as good as the ends.

v' = c (t - v) from rest: v = t - T + T exp(-c t), T = 1/c. It follows a line from below, and steps are as wide as the
method is stable, 6/c for dop853, 3.3/c for rk45. The polynomial through the stages of such a step is a far cry from v.
"""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb

from .watched_ode import run

END = 2.0
TIMES = np.linspace(0.0, END, 161)
AT_REST = [0.0, 0.0]


def pulled(c):
    return lambda t, q, v: c * (t - v)


def unguarded(t, q, v):
    return [1.0 + 0.0 * v[0]]


def behind(c, part):
    """Above zero where v is less than that part of T behind the line: from T (1 - exp(-c t)) = part T on never."""
    return lambda t, q, v: [v[0] - t + part / c]


def velocity(c, t):
    return t - (1.0 - np.exp(-c * t)) / c


@pytest.mark.parametrize("method", ["dop853", "rk45"])
@pytest.mark.parametrize("rtol", [1e-4, 1e-7, 1e-10])
@pytest.mark.parametrize("c", [10.0, 30.0, 100.0, 300.0])
def test_rows_between_steps_are_as_good_as_their_ends(c, rtol, method):
    _, rows, _, clock = run(pulled(c), unguarded, AT_REST, END, [0], times=TIMES, rtol=rtol, method=method)
    t, q, v = rows.T
    exact = velocity(c, t)
    assert np.array_equal(t, TIMES)
    assert (abs(v - exact) < 4.0 * rtol * (0.01 + exact)).all()
    assert (abs(q - (t**2 / 2 - (t - (1 - np.exp(-c * t)) / c) / c)) < rtol * (0.01 + t)).all()
    assert clock.count.rejected < 5 + 0.25 * clock.count.accepted


def test_without_that_judgement_they_are_not(monkeypatch):
    monkeypatch.setattr("flyball.numerics.integrators.explicit_runge_kutta.dense_output_is_accurate", lambda R, c: True)
    _, rows, _, _ = run(pulled(100.0), unguarded, AT_REST, END, [0], times=TIMES, rtol=1e-7)
    assert abs(rows[:, 2] - velocity(100.0, rows[:, 0])).max() > 2e-6


@pytest.mark.parametrize("method", ["dop853", "rk45"])
@pytest.mark.parametrize(("rtol", "part"), [(1e-4, 0.9), (1e-4, 1.1), (1.02e-7, 0.999), (1e-7, 1.001)])
def test_what_never_happens_is_not_found(rtol, part, method):
    """Once from below to above as v falls back behind the line, and that at the right time; not again, or never."""
    c = 100.0
    events, _, _, _ = run(pulled(c), behind(c, part), AT_REST, END, [0], times=TIMES, rtol=rtol, method=method)
    expected = [-np.log(1.0 - part) / c] if part < 1.0 else []
    slack = 10.0 * rtol * 0.1 / (c * abs(1.0 - part))  # tolerances, by the slope c T exp(-c t)
    assert len(events) == len(expected)
    assert all(abs(at[0] - t) < slack for at, t in zip(events, expected, strict=True))


@pytest.mark.parametrize("part", [0.95, 1.05, 1.1])
def test_what_only_the_dense_output_tells_of_is_no_event(monkeypatch, part):
    """The step that is taken again shows that the guard stays on its side."""
    monkeypatch.setattr("flyball.numerics.integrators.explicit_runge_kutta.dense_output_is_accurate", lambda R, c: True)
    events, _, _, _ = run(pulled(100.0), behind(100.0, part), AT_REST, END, [0], rtol=1e-4)
    assert len(events) == (part < 1.0)


@pytest.mark.parametrize("rtol", [1e-4, 1e-7, 1e-10])
def test_motions_that_accuracy_limits_pay_nothing(monkeypatch, rtol):
    """Swings, an orbit, a driven spring that hardens: as many steps as if nobody looked."""
    times = np.linspace(0.0, 10.0, 401)
    cases = [
        (lambda t, q, v: -9.81 * np.sin(q), [3.1, 0.0]),
        (lambda t, q, v: -q / np.linalg.norm(q) ** 3, [0.4, 0.0, 0.0, 2.0]),
        (lambda t, q, v: -np.array([1.0, 30.0]) * q, [1.0, 0.1, 0.0, 0.0]),
        (lambda t, q, v: -(q**3) + 7.5 * np.cos(t) - 0.05 * v, [3.0, 4.0]),
    ]

    def steps():
        return [run(f, unguarded, y, 10.0, [0], times=times, rtol=rtol)[3].count.accepted for f, y in cases]

    judged = steps()
    monkeypatch.setattr("flyball.numerics.integrators.explicit_runge_kutta.dense_output_is_accurate", lambda R, c: True)
    free = steps()
    assert sum(judged) <= 1.02 * sum(free)
    assert all(a <= 1.03 * b + 1 for a, b in zip(judged, free, strict=True))


def slide(*more):
    m = fb.Mechanism("slide", planar=True)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("A", "ground", "b", at=(0, 0), axis=(1, 0)), *more)
    return m


@pytest.mark.parametrize("method", ["dop853", "rk45"])
@pytest.mark.parametrize("rtol", [1e-4, 1e-7])
def test_a_slide_behind_a_ramp(rtol, method):
    """Its acceleration, c times as far off as its velocity, too; and a switch that it never throws."""
    c = 1000.0
    never = fb.Event("never", f"b.vx - t + {1 / c - 1e-5 if rtol < 1e-6 else 0.0} > 0", do=[fb.Stop()])
    for more in ((), (never,) if rtol > 1e-6 else ()):
        r = slide(fb.Actuator("F", "A.displacement", force=f"{c}*t - {c}*rate"), *more).simulate(
            2, outputs=161, rtol=rtol, method=method
        )
        assert abs(r["b.vx"] - velocity(c, r.t)).max() < 4.0 * rtol * END
        assert abs(r["b.ax"] - (1.0 - np.exp(-c * r.t))).max() < 4.0 * c * rtol * END
        assert r.t[-1] == END
        assert not r.events


@pytest.mark.parametrize("rtol", [1e-6, 1e-9])
def test_a_lag_behind_time(rtol):
    for T in (0.1, 0.01):
        r = slide(fb.Lag("L", of="t", time=T)).simulate(5, outputs=401, rtol=rtol, method="dop853")
        assert abs(r["L.value"] - (r.t - T + T * np.exp(-r.t / T))).max() < 20.0 * rtol * 5


def test_an_integral_at_a_stop():
    """A controller with its filter and limits, whose arm rests on a stop, by two kinds of methods."""
    m = fb.Mechanism("servo", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("arm", mass=1, inertia=0.1, position=(0.3, 0)), fb.Revolute("A", "ground", "arm", at=(0, 0)))
    gains = {"kp": 40, "ki": 30, "kd": 8, "filter": 0.01, "lower": -12, "upper": 12}
    m.add(fb.PID("pid", setpoint=0.5, measured="A.angle", **gains), fb.Motor("motor", "A", torque="pid"))
    m.add(fb.Limit("stop", "A.angle", lower=-0.25, upper=0.3, restitution=0.3))
    times = np.linspace(0, 2, 201)
    fine = m.simulate(2, outputs=times, rtol=1e-10, method="radau")["pid.integral"]
    for rtol in (1e-9, 1e-7):
        found = m.simulate(2, outputs=times, rtol=rtol, method="dop853")["pid.integral"]
        assert abs(found - fine).max() < 20.0 * rtol * abs(fine).max() + 2e-8
