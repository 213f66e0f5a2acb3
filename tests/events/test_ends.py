"""Ends of motions at, and within rounding of, an event's instant: what happens there happens once, in one of two runs."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb

NEAR = (0.0, 1e-16, -1e-16, 1e-15, -1e-15, 1e-14, -1e-14, 1e-13, -1e-13, 1e-12, -1e-12, 1e-9, -1e-9)


def free(*events, gravity=(0, 0), x=0.0):
    m = fb.Mechanism("free", planar=True, gravity=gravity)
    m.add(fb.Body("b", mass=1, inertia=1, position=(x, 0), velocity=(1, 0)), *events)
    return m


def push(x, y):
    return [fb.Impulse("b", (x, y))]


def quicker():
    """Each 2 pi / 3 m it gets faster by 1 m/s."""
    return free(fb.Event("a", "sin(3*b.x) > 0", do=push(1, 0)))


def far():
    """A kilometre away, where the last place of a position is 1e-13 m."""
    return free(fb.Event("a", "b.x > 1001", do=push(0, 1)), fb.Event("c", "b.x > 1002", do=push(0, 1)), x=1000.0)


def by_time():
    return free(fb.Event("a", "t > 1", do=push(0, 1)), fb.Event("c", "cos(t) < 0", do=push(0, 1)))


def thrown_back():
    """What is watched jumps: each 0.3 s it falls at 3 m/s, and is stopped."""
    return free(fb.Event("a", "b.vy < -3", do=push(0, 3)), gravity=(0, -10))


def close_by():
    """Six of them within 5e-13 s."""
    return free(*(fb.Event(f"e{k}", f"b.x > 1 + {k}*1e-13", do=push(0, 1)) for k in range(6)))


CASES = {  # instants, end of the motion, how many happen
    "quicker": (quicker, 2 * np.pi / 3 * np.array([1.0, 1.5, 1 + 1 / 2 + 1 / 3]), 5.0, 5),
    "far": (far, np.array([1.0, 2.0]), 3.0, 2),
    "by time": (by_time, np.array([1.0, np.pi / 2]), 3.0, 2),
    "thrown back": (thrown_back, np.array([0.3, 1.2]), 2.8, 9),
    "close by": (close_by, np.array([1.0]), 2.0, 6),
}


@pytest.mark.parametrize("case", list(CASES))
def test_what_happens_at_an_end_happens_once(case):
    made, instants, t_end, many = CASES[case]
    m = made()
    whole = m.simulate(t_end, outputs=2)
    assert len(whole.events) == many
    for t in instants:
        before = int((whole.events.t < t - 1e-6).sum())
        now = int((abs(whole.events.t - t) < 1e-6).sum())
        for part in NEAR:
            first = m.simulate(t * (1 + part), outputs=2)
            second = m.simulate(t_end, start=first, outputs=2)
            assert before <= len(first.events) <= before + now, (t, part)
            assert len(first.events) + len(second.events) == many, (t, part)
            assert second["b.vy"][-1] == pytest.approx(whole["b.vy"][-1], abs=1e-6)
            assert second["b.vx"][-1] == pytest.approx(whole["b.vx"][-1], abs=1e-6)
            assert second["b.x"][-1] == pytest.approx(whole["b.x"][-1], abs=1e-5)


def test_an_event_at_the_very_end_belongs_to_the_motion_that_ends_there():
    m = free(fb.Event("a", "t > 1", do=push(0, 1)))
    first = m.simulate(1.0)
    second = m.simulate(2.0, start=first)
    assert (first.events.t.tolist(), len(second.events)) == ([1.0], 0)
    assert (first["b.vy"][-1], second["b.y"][-1]) == pytest.approx((1.0, 1.0), abs=1e-12)


def test_a_motion_that_goes_on_counts_on(tmp_path):
    """Three times at most, whatever the motion is cut into; an event may happen again that has not happened so often."""
    m = free(fb.Event("a", "sin(10*t)", times=3), fb.Event("c", "sin(10*t)", times=7), fb.Event("d", "cos(10*t)"))
    first = m.simulate(1.5)
    first.save(tmp_path / "first.nc")
    for start in (first, fb.load_result(tmp_path / "first.nc")):
        second = m.simulate(2.5, start=start)
        third = m.simulate(6.0, start=second)
        for name, most in (("a", 3), ("c", 7), ("d", 9)):
            assert sum(e.name == name for r in (first, second, third) for e in r.events) == most
        assert third.carried["counts"] == {"a": 3, "c": 7, "d": 9}


def chirp(when, **at):
    m = fb.Mechanism("free", planar=True)
    m.add(fb.Body("b", mass=1, inertia=1, **at), fb.Event("e", when))
    return m


def test_a_sweep_is_followed_however_wide_the_steps():
    """Rising zeros of sin(exp(8 t)): a free body's steps are as wide as the motion."""
    r = chirp("sin(exp(8*t))").simulate(1.0, outputs=2)
    assert r.events.t == pytest.approx(np.log(2 * np.pi * np.arange(1, 475)) / 8, abs=1e-12)


def test_what_comes_often_and_ends_is_not_refused():
    """1e-4 s from its limit: 3182 rising zeros before 0.3 s, where the rate is 3e7 a second; the way back falls."""
    r = chirp("sin(1/(abs(0.3 - t) + 1e-4))").simulate(0.5, outputs=2)
    first = r.events.t[r.events.t < 0.3]
    n = np.arange(1, 1592)
    assert first == pytest.approx(0.3001 - 1 / (2 * np.pi * n), abs=1e-11)


@pytest.mark.parametrize(
    ("when", "at"),
    [("sin(1/(0.3 - t))", {}), ("sin(1/b.x)", {"position": (0.3, 0), "velocity": (-1, 0)})],
    ids=["by time", "by state"],
)
def test_events_that_accumulate_are_named_soon(when, at):
    """The n-th is at 0.3 - 1 / (2 pi n): none before the 8192nd is left out, and where they accumulate is told."""
    with pytest.raises(
        fb.SimulationError, match=r"Event 'e' has happened 8192 times.*without end before t = 0.3 s"
    ) as e:
        chirp(when, **at).simulate(0.5, outputs=2)
    found = e.value.result.events.t
    assert found == pytest.approx(0.3 - 1 / (2 * np.pi * np.arange(1, len(found) + 1)), abs=1e-11)
    assert len(found) > 8000


def kicked(when, kick, **more):
    """Thrown up at 1 m/s, and kicked up wherever its speed passes zero: each flight is kick / g long."""
    m = fb.Mechanism("ball", planar=True, gravity=(0, -10))
    m.add(fb.Body("b", mass=1, inertia=1, velocity=(0, 1)))
    m.add(fb.Event("e", when, do=[fb.Impulse("b", (0, kick))], **more))
    return m


@pytest.mark.parametrize("on", ["result", "file"])
@pytest.mark.parametrize(("when", "more"), [("b.vy", {"direction": "falling"}), ("b.vy < 0", {})])
def test_what_its_own_action_took_off_zero_at_an_end_is_met_again(when, more, on, tmp_path):
    """Apex n is at 0.1 + 0.05 n s, 0.05 + 0.0125 n m up; the motion is cut at the first one."""
    m = kicked(when, 0.5, **more)
    whole = m.simulate(0.98, outputs=2)
    assert whole.events.t == pytest.approx(0.1 + 0.05 * np.arange(18), abs=1e-12)
    for later in (0.0, 1e-15, 1e-12, 1e-9):
        first = m.simulate(float(whole.events.t[0]) + later, outputs=2)
        first.save(tmp_path / "first.nc")
        start = first if on == "result" else fb.load_result(tmp_path / "first.nc")
        second = m.simulate(0.98, start=start, outputs=2)
        assert len(first.events) == 1
        assert second.events.t == pytest.approx(0.15 + 0.05 * np.arange(17), abs=1e-10)
        high = 0.05 + 17 * 0.0125 + 0.5 * 0.03 - 5 * 0.03**2
        assert second["b.y"][-1] == pytest.approx(high, abs=1e-9)


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
@pytest.mark.parametrize("when", ["p.vy", "p.vx", "p.x*p.vx"])
@pytest.mark.parametrize("act", ["set", "blow"])
def test_what_a_taut_rope_solves_anew_is_done_once(act, when, coordinates):
    """A pendulum's speeds pass zero where it turns and where it hangs straight, once each: as on a rigid rod."""
    do = fb.Set("k", "k*2") if act == "set" else fb.Impulse("p", ("g*p.vx", "g*p.vy"))
    for angle, length in ((-1.035872591088826, 1.297430423353678), (0.7, 1.0), (1.2, 0.45), (-0.3, 1.7)):
        p = (length * np.sin(angle), -length * np.cos(angle))
        rope = fb.Rope("tie", ["ground", "p"], at=[(0, 0), p], length=length)
        told = []
        for tie in (rope, fb.Distance("tie", "ground", "p", at=[(0, 0), p])):
            m = fb.Mechanism("pendulum", planar=True, gravity=(0, -9.81), parameters={"k": 1.0, "g": 0.0})
            m.add(fb.Body("p", mass=1, inertia=0.01, position=p), tie, fb.Event("e", when, direction="either", do=[do]))
            told.append(m.simulate(8, coordinates=coordinates, outputs=2).events["e"].t)
        assert np.diff(told[0]).min() > 0.1
        assert told[0] == pytest.approx(told[1], abs=1e-5)


@pytest.mark.parametrize("do", [fb.Set("k", "k*2"), fb.Impulse("p", ("g*p.vx", 0))], ids=["set", "blow"])
def test_what_friction_of_a_joint_solves_anew_is_done_once(do):
    """A slide with dry friction on a spring turns every half period, pi / w, until it sticks: each turn once."""
    w, d = 5.0, 0.03  # w^2 = k / m; d: friction / k
    m = fb.Mechanism("slide", planar=True, gravity=(0, -10), parameters={"k": 1.0, "g": 0.0})
    m.add(
        fb.Body("p", mass=1, inertia=0.01, position=(0, 0)),
        fb.Prismatic("S", "ground", "p", at=(0, 0), axis=(1, 0)),
        fb.JointFriction("B", "S", static=w * w * d / 10, kinetic=w * w * d / 10),
        fb.Actuator("sp", "S.displacement", force=f"-{w * w}*value"),
        fb.Initial("S.displacement", value=1.0),
        fb.Event("e", "p.vx", direction="either", do=[do]),
    )
    r = m.simulate(12, outputs=2)
    turns = 16  # |x| falls by 2 d each: 0.04 after 16, above d; then one to -0.02, where it sticks
    assert r.events["e"].t[:turns] == pytest.approx(np.pi / w * np.arange(1, turns + 1), abs=1e-6)
    assert np.diff(r.events["e"].t).min() > 0.1
