"""What the table of docs/controllers.md says: controllers in studies, contact, files, and motions that go on."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

import flyball as fb
from flyball.simulation import checkpoints as keeper
from flyball.simulation.events import event_loop
from flyball.simulation.implicit_integrators import implicit_integrator
from tests.checkpoints.motions import cut, killed
from tests.control.slide import TIGHT, slide

WAYS = ({}, {"method": "radau"}, {"method": "generalised-alpha", "step": 1e-3})


def loop(**fields):
    given = {"setpoint": "1", "measured": "A.displacement", "kp": "kp", "ki": 60, "kd": 12, "filter": 0.02}
    m = slide(fb.PID("pid", **(given | fields)), fb.Lag("act", of="pid", time=0.01), force="act", kp=80.0)
    return m


@pytest.mark.parametrize("period", [None, 0.01])
@pytest.mark.parametrize("way", WAYS, ids=["auto", "radau", "alpha"])
def test_going_on_from_a_file_is_the_same_motion(way, period, tmp_path):
    how = way if "step" in way else way | TIGHT
    m = loop(period=period)
    whole = m.simulate(0.8, outputs=5, **how)
    m.simulate(0.43, outputs=3, **how).save(tmp_path / "first.nc")
    rest = m.simulate(0.8, outputs=3, start=fb.load_result(tmp_path / "first.nc"), **how)
    near = 1e-4 if "step" in way else 1e-8
    for name in ("A.displacement", "pid.integral", "act.value"):
        assert rest[name][-1] == pytest.approx(whole[name][-1], abs=near)


@pytest.mark.parametrize("period", [None, 0.01])
def test_each_run_of_a_study_is_the_single_run(period):
    m = loop(period=period)
    found = m.study({"kp": [20.0, 80.0, 200.0]}, of=["A.displacement", "pid.output"], t_end=0.5, outputs=6)
    for k, kp in enumerate((20.0, 80.0, 200.0)):
        r = m.simulate(0.5, outputs=6, parameters={"kp": kp})
        for name in ("A.displacement", "pid.output"):
            assert np.array_equal(np.asarray(found[name])[k], r[name])


@pytest.mark.parametrize("period", [None, 0.01])
def test_a_stop_behind_the_set_point(period):
    """It strikes the stop and lies there while the integral comes down by ki e, then returns to its set point: 10 N."""
    m = loop(period=period, ki=600, upper=50, lower=-50)
    m.add(fb.Limit("stop", "A.displacement", upper=1.02, restitution=0.5))
    r = m.simulate(8, outputs=[0.5, 1.0, 2.0, 4.0, 8.0])
    assert r["A.displacement"].max() <= 1.02 + 1e-9
    assert r["A.displacement"][1:3] == pytest.approx([1.02, 1.02], abs=1e-9)
    assert r["pid.output"][1] - r["pid.output"][2] == pytest.approx(600 * 0.02, abs=1e-6)
    assert r["A.displacement"][-1] == pytest.approx(1.0, abs=1e-4)
    assert r["pid.output"][-1] == pytest.approx(10.0, abs=2e-3)


@pytest.mark.parametrize("way", WAYS[:2], ids=["auto", "radau"])
def test_events_reset_states(way):
    """An integral goes back whenever it reaches 0.3; a limited PID's integral at an instant, and its output jumps."""
    m = slide(fb.Integrator("sum", of="1"), force="0.0*sum")
    m.add(fb.Event("full", "sum - 0.3", do=fb.Set("sum.value", "sum - 0.2")))
    r = m.simulate(1, outputs=[0.2, 0.4, 0.6, 0.85], **way)
    assert r["sum.output"] == pytest.approx([0.2, 0.2, 0.2, 0.25], abs=1e-9)
    assert r.events[0].done == ("sum.value = 0.1, was 0.3",)
    m = slide(fb.PID("pid", setpoint="1", measured="A.displacement", ki="60", upper=6, tracking=0.5), force="pid")
    m.add(fb.Event("anew", "t - 0.5", do=fb.Set("pid.integral", -1)))
    r = m.simulate(0.6, outputs=[0.4999, 0.5001], **way)
    assert r["pid.output"] == pytest.approx([6, -1 + 60 * 1e-4 * (1 - r["A.displacement"][1])], abs=1e-3)
    with pytest.raises(fb.ModelError, match=r"has no parameter 'pid\.output'"):
        m.add(fb.Event("no", "t - 0.1", do=fb.Set("pid.output", 1)))


def anew():
    """Two states go back to 0 at 1.05 s, where k becomes 2: a ramp, and counts at each tenth of a second, both by k."""
    m = slide(fb.Integrator("ramp", of="k"), fb.State("count", next="count + k", period=0.1), force="ramp", k=1.0)
    m.add(fb.Event("anew", "t - 1.05", do=[fb.Set("ramp.value", 0), fb.Set("count.value", 0), fb.Set("k", "2*k")]))
    return m


@pytest.mark.parametrize("way", WAYS, ids=["auto", "radau", "alpha"])
@pytest.mark.parametrize("file", [False, True])
def test_going_on_where_events_set_states(way, file, tmp_path):
    """Before the event and after it, and a third time: ramp is 2 (1.55 - 1.05), count 2 a sample."""
    m, how = anew(), {"outputs": 2, **way}
    whole = m.simulate(1.55, **how)
    assert (whole["ramp.value"][-1], whole["count.value"][-1]) == pytest.approx((1.0, 10.0), abs=1e-9)
    r = m.simulate(0.52, **how)
    for t in (1.22, 1.55):
        r.save(tmp_path / "run.nc")
        r = m.simulate(t, start=fb.load_result(tmp_path / "run.nc") if file else r, **how)
    assert (r["ramp.value"][-1], r["count.value"][-1]) == pytest.approx((1.0, 10.0), abs=1e-9)
    assert r["A.displacement"][-1] == pytest.approx(whole["A.displacement"][-1], abs=1e-5)


def test_states_that_events_set_in_a_motion_of_many_parts(tmp_path, monkeypatch):
    """With checkpoints: parts end before the event and after it, and it is killed there."""
    m = slide(fb.Integrator("ramp", of="k"), force="ramp", k=1.0)
    m.add(fb.Event("anew", "t - 1.05", do=[fb.Set("ramp.value", 0), fb.Set("k", "2*k")]))
    cut(monkeypatch, 4)
    kept = []
    with monkeypatch.context() as within:
        write = keeper.CheckpointFile.write
        within.setattr(keeper.CheckpointFile, "write", lambda self: (write(self), kept.append(self.parts[-1].final[0])))
        m.simulate(1.55, rtol=1e-10, outputs=2, checkpoint=tmp_path / "whole.nc")
    before = sum(t < 1.05 for t in kept)
    assert 0 < before < len(kept)
    r = killed(m, tmp_path / "run.nc", monkeypatch, (before, 1), t_end=1.55, rtol=1e-10, outputs=2)
    assert r["ramp.value"][-1] == pytest.approx(1.0, abs=1e-9)
    assert [h.name for h in r.events] == ["anew"]


@pytest.mark.parametrize("way", WAYS[:2], ids=["auto", "radau"])
def test_an_event_at_an_instant_where_a_law_jumps_later(way):
    """Nothing is left of the stretch up to the instant, but much of that up to the jump: it went there at once."""
    push = "3*sign(sin(t) - 0.5)"
    m = slide(fb.State("count", next="count + 1", period=0.1), force=f"0.0*count + {push}")
    m.add(fb.Event("at", "t - 0.2"))
    r, plain = (x.simulate(1, outputs=11, **TIGHT, **way) for x in (m, slide(force=push)))
    assert r["A.displacement"] == pytest.approx(plain["A.displacement"], abs=1e-9)
    assert [h.t for h in r.events] == pytest.approx([0.2], abs=1e-12)


def test_jacobians_serve_from_sample_to_sample(monkeypatch):
    """Only what pushes jumps at instants: of a linear loop one is enough, to the exact discrete solution."""
    period, made = 1e-3, []
    monkeypatch.setattr(event_loop, "implicit_integrator", lambda *a: made.append(implicit_integrator(*a)) or made[-1])
    m = slide(fb.PID("pid", setpoint="1", measured="A.displacement", kp=80, ki=60, period=period))
    r = m.simulate(0.5, outputs=501, method="radau", rtol=1e-10, atol=1e-11)
    P = expm(np.array([[0, 1, 0], [-10, -2, 1], [0, 0, 0]]) * period)
    x, integral, exact = np.zeros(3), 0.0, [0.0]
    for _ in range(500):
        error = 1 - x[0]
        x[2] = 80 * error + integral
        integral += 60 * error * period
        x = P @ x
        exact.append(x[0])
    assert r["A.displacement"] == pytest.approx(exact, abs=1e-10)
    assert made[-1].count.jacobians < 10
    assert r.health.steps < 520


def test_auto_goes_back_where_a_sampled_loop_is_not_stiff_any_more():
    """A damper that goes: its force is stiff for the first two seconds."""
    m = slide(fb.PID("pid", setpoint="1", measured="A.displacement", kp=80, ki=60, kd=5, filter=0.02, period=0.05))
    m.add(fb.Actuator("damper", coordinate="A.displacement", force="-1e6*exp(-10*t)*rate"))
    r = m.simulate(60, outputs=61)
    assert "radau from t = " in r.health.method
    assert "dop853 from t = " in r.health.method
    assert r["A.displacement"][-1] == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("cut", [0.2, 0.3, 0.35])
@pytest.mark.parametrize("way", WAYS[:2], ids=["auto", "radau"])
def test_events_by_samples_at_a_seam(way, cut):
    """A count that is 3 from 0.2 s on, which a driver bears: each event is in one motion or the other."""
    m = slide(fb.State("count", next="count + 1", period=0.1), force="count")
    m.add(fb.Driver("D", "A.displacement", "0.1*t**2"))
    m.add(fb.Event("many", "count > 2.5"), fb.Event("effort", "D.effort < -2"))
    first = m.simulate(cut, outputs=2, **way)
    rest = m.simulate(0.6, outputs=2, start=first, **way)
    for name, late in (("many", 0.2), ("effort", 0.2)):
        assert [h.t for r in (first, rest) for h in r.events if h.name == name] == pytest.approx([late], abs=1e-9)


@pytest.mark.parametrize("steps", [1, 3])
def test_events_by_samples_where_a_part_ends(steps, tmp_path, monkeypatch):
    """The same in a motion of parts of few steps: at any of them something was sampled."""
    m = slide(fb.State("count", next="count + 1", period=0.1), force="count")
    m.add(*(fb.Event(f"{k}", f"count > {k} - 0.5") for k in range(2, 6)))
    cut(monkeypatch, steps)
    r = m.simulate(0.6, outputs=2, checkpoint=tmp_path / "run.nc")
    assert [(h.name, round(h.t, 9)) for h in r.events] == [(f"{k}", round(0.1 * (k - 1), 9)) for k in range(2, 6)]
