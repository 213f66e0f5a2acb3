"""What a report and a console say of events: the end by one, the list of few and of many, what held when."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import flyball as fb
from flyball.constraints.switches.switch_kind import SwitchKind
from flyball.view.animation import record_motion
from flyball.view.figures import standard_figures
from flyball.view.motion_with_events import motion_with_event_states
from flyball.view.report import report_html, report_tables
from tests.program.test_cli import Said


def ball(bounce: float = 0.5) -> fb.Mechanism:
    """A body that falls by 1.25 m on a stop: it hits it at 0.5 s, then 0.5 s later at half the speed."""
    m = fb.Mechanism("ball", planar=True, gravity=(0, -10))
    m.add(fb.Body("b", mass=2, inertia=1, position=(0, 1.25)))
    m.add(fb.Limit("floor", "b.y", lower=0, restitution=bounce))
    return m


def by_name(result: fb.Result) -> dict:
    return {t.name: t for t in report_tables(result)}


def test_few_events_are_listed():
    m = ball()
    m.add(fb.Event("half", "t - 0.25", do=[fb.Note("on the way")]))
    found = by_name(m.simulate(0.9, outputs=10))
    assert found["events"].rows == (
        ("0.25", "half", "event", "on the way", ""),
        ("0.5", "floor", "impact", "floor closes at 5 m/s, leaves at 2.5 m/s", "18.75"),
    )
    assert "all-events" not in found
    (row,) = found["holding"].rows
    assert row == ("floor", "Limit", "b.y", "open", "open", "closed 0 %", "once")


def test_many_events_are_counted_and_folded():
    m = fb.Mechanism("clock", planar=True)
    m.add(fb.Body("b", mass=1, inertia=1))
    m.add(fb.Event("tick", "sin(100*pi*t)", direction="either"), fb.Event("tock", "sin(10*pi*t) - 0.5"))
    r = m.simulate(2.995, outputs=31)
    found = by_name(r)
    assert found["events"].rows == (
        ("tick", "event", "299", f"{r.events['tick'].t[0]:.6g}", f"{r.events['tick'].t[-1]:.6g}"),
        ("tock", "event", "15", f"{r.events['tock'].t[0]:.6g}", f"{r.events['tock'].t[-1]:.6g}"),
    )
    assert r.events["tick"].t == pytest.approx(np.arange(1, 300) / 100, abs=1e-9)
    listed = found["all-events"]
    assert listed.folded == "All 314 in the order of time"
    assert len(listed.rows) == 201
    assert listed.rows[150][1] == "114 more"
    assert listed.rows[-1][0] == f"{r.events.t[-1]:.6g}"
    page = report_html(r)
    assert '<a href="#table-events">Events</a>' in page
    assert "#table-all-events" not in page.split("<nav")[1].split("</nav>")[0]
    assert "<details><summary>All 314 in the order of time</summary>" in page


def test_what_held_when():
    """A rope that is taut to 1 s and then cut; a coordinate that is locked for the last half."""
    m = fb.Mechanism("held", planar=True, gravity=(0, -10))
    m.add(fb.Body("b", mass=1, inertia=0, position=(0, -1)))
    m.add(fb.Rope("line", ("ground", "b"), at=((0, 0), (0, -1))))
    m.add(fb.Body("c", mass=1, inertia=1, position=(3, 0)), fb.Revolute("A", "ground", "c", at=(3, 0)))
    m.add(fb.Event("cut", "t - 0.95", do=[fb.Release("line"), fb.Lock("A")]))
    rows = {row[0]: row[1:] for row in by_name(m.simulate(1.9, outputs=20))["holding"].rows}
    assert rows["line"][:5] == ("Rope", "ground - b", "taut", "released", "taut 50 %")
    assert rows["A.angle"] == ("locked by events", "A.angle", "free", "locked", "locked 50 %", "never")


def test_an_end_by_an_event_is_told_everywhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    m = ball()
    m.add(fb.Event("low", "0.8 - b.y", do=[fb.Stop()]))
    said = "ended at 0.3 s by event 'low' (requested: 5 s)"
    r = m.simulate(5)
    assert (r.health.status, r.health.message) == (said, said)
    assert r.health.success
    assert r.health.ended_early
    assert said in repr(r)
    assert dict(r.health.lines())["status"] == said
    page = report_html(r)
    assert f'<p class="verdict early" role="status">The run {said.replace(chr(39), "&#x27;")}.</p>' in page
    assert "reached its end" not in page
    r.save("r.nc")
    assert fb.load_result("r.nc").health.status == said
    m.save("ball.toml")
    words = ("run", "ball.toml", "--t-end", 5, "--no-plots", "--no-animation")
    assert any(said in line and line.startswith("status") for line in Said(*words).out.splitlines())
    data = json.loads(Said(*words, "--json").out)
    assert (data["message"], data["success"], data["ended_early"]) == (said, True, True)


def test_rounding_is_no_loss():
    """A lock where nothing moves takes nothing, to the digit that is printed."""
    m = fb.Mechanism("still", planar=True, gravity=(0, -10))
    m.add(fb.Body("a", mass=1, inertia=1), fb.Revolute("A", "ground", "a", at=(0, 0)))
    m.add(fb.Body("b", mass=1, inertia=1, position=(2, 0)), fb.Revolute("B", "ground", "b", at=(2, 0)))
    m.add(fb.Driver("d", "B.angle", "cos(t) - 1"), fb.CoordinateSpring("k", "A.angle", stiffness=3.7))
    m.add(fb.Initial("A.angle", rate=1e-12), fb.Event("hold", "t - 1.3", do=fb.Lock("A")))
    r = m.simulate(2)
    assert 0.0 <= r.events.lost.sum() < 1e-20
    assert r.events["hold"][0].lost == 0.0
    assert "lost" not in r.events.summary()


def test_what_was_not_locked_is_not_released():
    m = fb.Mechanism("free", planar=True)
    m.add(fb.Body("a", mass=1, inertia=1), fb.Revolute("A", "ground", "a", at=(0, 0)))
    m.add(fb.Event("early", "t - 0.2", do=fb.Release("A.angle")), fb.Event("lock", "t - 0.4", do=fb.Lock("A.angle")))
    m.add(fb.Event("late", "t - 0.6", do=fb.Release("A.angle")))
    m.add(fb.Body("b", mass=1, inertia=1, position=(2, 0)), fb.Limit("stop", "b.x", upper=3))
    m.add(fb.Event("open", "t - 0.2", do=fb.Release("stop")), fb.Event("again", "t - 0.7", do=fb.Release("stop")))
    done = {h.name: h.done for h in m.simulate(1).events}
    assert done["early"] == ("A.angle was not locked",)
    assert done["late"] == ("released A.angle",)
    assert done["open"] == ("released stop",)
    assert done["again"] == ("stop was released already",)


def test_jumps_are_upright_and_forces_broken():
    """The ball hits at 0.5 s with 5 m/s: 25 J before, 6.25 J after, at one time; its weight's support is known later."""
    r = ball().simulate(2.4, outputs=25)
    whole = motion_with_event_states(r)
    at = np.flatnonzero(whole.t == r.events["floor"].t[0])
    assert whole.t[at] == pytest.approx([0.5, 0.5], abs=1e-12)
    assert whole["b.vy"][at] == pytest.approx([-5, 2.5], abs=1e-9)
    assert whole.energy.kinetic[at] == pytest.approx([25, 6.25], abs=1e-9)
    assert np.abs(whole.energy.balance).max() < 1e-9
    assert (np.diff(whole.t) >= 0.0).all()
    kept = np.isin(whole.t, r.t)
    assert whole["b.y"][kept] == pytest.approx(r["b.y"], abs=0)
    assert np.isnan(whole["floor.force"][at]).any()
    assert np.nanmax(whole["floor.force"]) == pytest.approx(20.0, abs=1e-9)
    (ax,) = r.plot("energy.kinetic").axes
    assert max(ax.lines[0].get_ydata()) == pytest.approx(25.0, abs=1e-9)


def test_jumps_of_parameters_and_of_files(tmp_path: Path):
    """A spring of 8 N/m, stretched by 1 m, that becomes one of 16 N/m at 0.5 s: 4 J to 8 J; read from a file too."""
    m = fb.Mechanism("s", planar=True, parameters={"k": 8.0})
    m.add(fb.Body("b", mass=2, inertia=1), fb.Prismatic("A", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("s", "A.displacement", stiffness="k"), fb.Initial("A.displacement", value=1.0))
    m.add(fb.Event("hold", "start", do=fb.Lock("A")), fb.Event("hard", "t - 0.55", do=fb.Set("k", 16)))
    r = m.simulate(1, outputs=11)
    r.save(tmp_path / "r.nc")
    for run in (r, fb.load_result(tmp_path / "r.nc")):
        whole = motion_with_event_states(run)
        assert whole.t[6:8] == pytest.approx([0.55, 0.55], abs=1e-12)
        assert whole["s.energy"][5:9] == pytest.approx([4, 4, 8, 8], abs=1e-12)
        assert np.abs(whole.energy.balance).max() < 1e-12


def test_names_of_marks_are_written_once():
    r = ball(0.8).simulate(3, outputs=61)
    (ax,) = r.plot("b.y").axes
    texts = [t.get_text() for t in ax.texts if t.get_text()]
    assert texts == [f"floor ×{len(r.events)}"]


def test_jumps_on_the_page_are_upright():
    """The recording of a page has both sides of each impact: -5 and 2.5 m/s at 0.5 s, and its poses and times fit."""
    r = ball().simulate(2.4, outputs=25)
    shown = record_motion(r)
    at = np.flatnonzero(shown.t == r.events["floor"].t[0])
    (vy,) = (c.values for c in shown.channels if c.name == "b.vy")
    assert vy[at] == pytest.approx([-5, 2.5], abs=1e-9)
    assert shown.bodies[0].p[at, 1] == pytest.approx([0, 0], abs=1e-12)
    assert len(shown.t) == len(r.t) + 2 * len(r.events["impact"])
    assert all(np.isfinite(a.vector).all() for a in shown.arrows)
    page = report_html(r)
    assert len(page) > 100_000


def test_jumps_beside_an_output_time():
    """A motor that an event switches off within rounding of an output time: its torque falls upright."""
    m = fb.Mechanism("m", planar=True, parameters={"lift": 8})
    m.add(fb.Body("b", mass=1, inertia=2), fb.Revolute("A", "ground", "b", at=(0, 0)))
    m.add(fb.Motor("motor", "A", torque="lift*step(t, 0, 1, 2, 1)"), fb.Event("off", "t > 2 s", do=fb.Set("lift", 0)))
    whole = motion_with_event_states(m.simulate(4, outputs=101))
    falls = np.flatnonzero(np.diff(whole["motor.torque"]) < -1.0)
    assert len(falls) == 1
    assert whole.t[falls + 1] - whole.t[falls] == pytest.approx([0.0], abs=1e-12)


def test_what_jumps_not_is_not_broken():
    """A note of an event changes nothing: curves have no more times there."""
    m = ball()
    m.add(fb.Event("half", "t - 0.25", do=[fb.Note("on the way")]))
    r = m.simulate(0.45, outputs=10)
    assert len(r.events) == 1
    assert len(motion_with_event_states(r).t) == 10


def test_parameters_that_events_set():
    """The report has the value at the start, and the others with their times; masses are those at the start too."""
    m = fb.Mechanism("set", planar=True, parameters={"k": "8 N/m", "mass": 1, "c": 3})
    m.add(fb.Body("b", mass="mass", inertia=1), fb.Prismatic("A", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("s", "A.displacement", stiffness="k"))
    m.add(
        fb.Event("hard", "t - 0.25", do=[fb.Set("k", 16), fb.Set("mass", 2)]),
        fb.Event("soft", "t - 0.5", do=fb.Set("k", 4)),
    )
    found = by_name(m.simulate(1, outputs=5))
    assert found["parameters"].columns == ("name", "as written", "at the start [SI]", "set by events to")
    assert found["parameters"].rows == (
        ("k", "8 N/m", "8", "16 at 0.25 s, 4 at 0.5 s"),
        ("mass", "1", "1", "2 at 0.25 s"),
        ("c", "3", "3", ""),
    )
    assert found["bodies"].rows[0][1] == "1"


def test_what_is_there_and_never_happened_is_an_empty_list():
    m = ball()
    m.add(fb.Event("overload", "b.vy - 100", do=fb.Stop()))
    r = m.simulate(0.4)
    for name in ("overload", "floor", "b", "impact"):
        assert len(r.events[name]) == 0
        assert not r.events[:0][name]
    with pytest.raises(fb.ModelError, match=r"nothing named 'overlaod' happened \(did you mean 'overload'\?\)"):
        r.events["overlaod"]


def test_kinds_of_what_happens():
    known = {"close", "open", "stick", "slip", "lock", "overrun", "latch", "unlatch", "taut", "slack", "touch", "part"}
    assert known <= SwitchKind.transitions
    events = ball().simulate(0.1).events
    assert not any(len(events[kind]) for kind in sorted(known))


def test_warnings_are_at_the_top():
    m = ball()
    m.add(fb.Event("down", "b.y < 3", do=fb.Stop()))
    page = report_html(m.simulate(0.3))
    assert '<p class="verdict early" role="status">The run reached its end; 1 warning.</p>' in page
    assert page.index("never happened") < page.index("<dl class='cards'>")


def test_couplings_are_told():
    """A rack of 2 kg that falls on a pinion held by a motor: 2 g on the rack, R 2 g on the pinion; no bearing feels it."""
    m = fb.Mechanism("hoist", planar=True, gravity=(0, -10))
    m.add(fb.Body("drum", mass=3, inertia=0.1), fb.Revolute("axle", "ground", "drum", at=(0, 0)))
    m.add(fb.Body("load", mass=2, inertia=1, position=(0.5, -1)))
    m.add(fb.Prismatic("guide", "ground", "load", at=(0.5, -1), axis=(0, 1)))
    m.add(fb.RackAndPinion("winding", "guide", "axle", radius=0.5), fb.Motor("motor", "axle", torque=10))
    r = m.simulate(0.2, outputs=3)
    assert r["winding.effort_1"] == pytest.approx(20, abs=1e-9)
    assert r["winding.effort_2"] == pytest.approx(-10, abs=1e-9)
    rows = {row[0]: row for row in by_name(r)["joints"].rows}
    assert rows["winding"][6:8] == ("20", "10")
    assert rows["axle"][6] == "30"
    drawn = {c.name for f in standard_figures(r) if f.name == "actuation" for p in f.panels for c in p.curves}
    assert {"winding.effort_1", "winding.effort_2"} <= drawn
