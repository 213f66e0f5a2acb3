"""Laws that jump in time at the very instant of something else: another event, an end of the motion, a change of it."""

from __future__ import annotations

import pytest

import flyball as fb

ACTIONS = ([], [fb.Impulse("b", (0, 1))], [fb.Set("k", 2)])


def at_a_second(law, do):
    """A body that flies at 1 m/s; at 1 s it is 1 m along, and laws of time jump."""
    m = fb.Mechanism("flies", planar=True, gravity=(0, 0), parameters={"k": 1.0})
    m.add(fb.Body("b", mass=1, inertia=1, velocity=(1, 0)))
    m.add(fb.Event("x", "b.x - 1", do=do), fb.Event("jump", law, do=[fb.Impulse("b", (0, 1))]))
    m.add(fb.Event("tick", "t > 1"), fb.Event("both", "(b.x + 1)*where(t < 1, -1, 1)*k"))
    return m


@pytest.mark.parametrize("do", ACTIONS, ids=["note", "blow", "set"])
@pytest.mark.parametrize("law", ["where(t < 1, -1, 1)", "where(t <= 1, -1, 1)*(1 + b.x)"])
@pytest.mark.parametrize("cut", [1.0, 1 - 1e-15, 1 + 1e-15, 1 + 1e-13, 2.0])
def test_each_happens_once_wherever_it_is_cut(law, do, cut):
    m = at_a_second(law, do)
    first = m.simulate(cut, outputs=3)
    second = m.simulate(2.5, start=first, outputs=3)
    every = [*first.events, *second.events]
    assert sorted(e.name for e in every) == ["both", "jump", "tick", "x"]
    assert [e.t for e in every] == pytest.approx([1.0] * 4, abs=1e-12)
    assert second["b.vy"][-1] == pytest.approx(1 + (do == ACTIONS[1]), abs=1e-12)
    assert second["b.y"][-1] == pytest.approx(1.5 * (1 + (do == ACTIONS[1])), abs=1e-11)


def test_a_brake_gives_way_where_an_event_meets_a_jump_of_its_load():
    """It holds 3 N of 1 N until 1 s, then 5 N push: v = 2 (t - 1). An event at 1 s changes nothing of that."""
    m = fb.Mechanism("brake", planar=True, gravity=(0, 0))
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("P", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.Actuator("F", "P.displacement", force="where(t < 1, 1, 5)"), fb.Brake("B", "P.displacement", capacity=3))
    m.add(fb.Body("c", mass=1, inertia=1, velocity=(1, 0)), fb.Event("x", "c.x - 1"))
    r = m.simulate(2.0, outputs=2)
    assert r["b.vx"][-1] == pytest.approx(2.0, abs=1e-9)
    assert len(r.events["x"]) == 1
