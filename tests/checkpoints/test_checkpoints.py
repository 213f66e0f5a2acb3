"""A motion that is kept on the way, and interrupted or killed, is to the last bit the one that was not."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import numpy as np
import pytest

import flyball as fb
from flyball.simulation import checkpoints as keeper
from flyball.simulation import integration_intervals
from flyball.simulation import simulate as simulating
from flyball.simulation.checkpoints import deferred_interrupt

from .motions import (
    assert_same,
    bouncer,
    crank,
    cut,
    double_pendulum,
    killed,
    pile,
    sampled,
    soft,
    switched,
    twisting,
    watched,
)

CASES = {  # mechanism, options, steps of a part; how near it is to the motion that was not kept, and in what
    "smooth": (double_pendulum, {"t_end": 4, "rtol": 1e-9}, 40, 1e-6, "a.x b.x b.angle S.work M.work"),
    "joint": (double_pendulum, {"t_end": 4, "rtol": 1e-9, "coordinates": "joint"}, 40, 1e-6, "a.x b.x b.angle S.work"),
    "fixed steps": (double_pendulum, {"t_end": 1, "step": 0.004, "method": "rk45"}, 30, 1e-6, "a.x b.x b.angle"),
    "stiff": (lambda: soft(5000.0, 500.0), {"t_end": 10, "outputs": 11}, 1500, 1e-4, "a.x b.x"),
    "implicit": (soft, {"t_end": 1, "method": "radau"}, 30, 1e-4, "a.x b.x"),
    "implicit events": (bouncer, {"t_end": 2, "method": "radau"}, 60, 1e-3, "b.x b.y"),
    "events": (bouncer, {"t_end": 4, "rtol": 1e-9}, 6, 1e-7, "b.x b.y b.vx S.work"),
    "sampled controller": (sampled, {"t_end": 1, "outputs": 201}, 11, 1e-6, "a.x pid.output M.torque"),
    "sampled, radau": (sampled, {"t_end": 0.3, "method": "radau"}, 60, 1e-6, "a.x pid.output M.torque"),
    "sampled, watched": (watched, {"t_end": 0.5}, 8, 1e-6, "a.x pid.output M.torque"),
    "jumps in time": (switched, {"t_end": 0.1}, 6, 1e-7, "a.x a.vx"),
    "prescribed": (crank, {"t_end": 2, "outputs": 101}, 20, 1e-6, "c.x c.vx turn.effort turn.work"),
    "corners": (twisting, {"t_end": 6.5, "rtol": 1e-10}, 8, 1e-8, "p.x p.vx M.force"),
    "impulses": (pile, {"t_end": 0.4, "method": "impulse"}, 8, 2e-2, "arm.z balls[0].z balls[5].z"),
}


@pytest.mark.parametrize("case", CASES)
def test_killed_and_gone_on_with_it_is_the_same_to_the_last_bit(case, tmp_path, monkeypatch):
    made, how, steps, near, names = CASES[case]
    how, m = {"outputs": 41, **how}, made()
    plain = m.simulate(**how)
    cut(monkeypatch, steps)
    run = m.simulate(checkpoint=tmp_path / "run.nc", **how)
    assert run.health.success
    assert run.health.status == plain.health.status
    assert os.listdir(tmp_path) == ["run.nc"]
    again = killed(m, tmp_path / "killed.nc", monkeypatch, (1, 2), **how)
    assert_same(run, again)
    assert_same(run, fb.load_result(tmp_path / "killed.nc"))
    for name in names.split():
        assert run[name] == pytest.approx(plain[name], abs=near * max(1.0, np.abs(plain[name]).max())), name
    assert [(h.kind, h.name) for h in run.events] == [(h.kind, h.name) for h in plain.events]
    assert [h.t for h in run.events] == pytest.approx([h.t for h in plain.events], abs=1e-7)
    assert run.health.energy_drift <= 3.0 * plain.health.energy_drift + 1e-9


def test_nine_signals_cost_what_was_not_written(tmp_path, monkeypatch):
    """A process kills itself by SIGKILL at half of the motion; another goes on."""
    script = """
import os, signal, sys
import pytest
from tests.checkpoints.motions import cut, double_pendulum
cut(pytest.MonkeyPatch())
end = lambda fraction: fraction > 0.5 and os.kill(os.getpid(), signal.SIGKILL)
double_pendulum().simulate(4, checkpoint=sys.argv[1], progress=end)
"""
    path = tmp_path / "run.nc"
    root = os.path.dirname(os.path.dirname(os.path.dirname(__file__)))
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", script, path], cwd=root, check=False)
    assert done.returncode == -signal.SIGKILL
    there = fb.load_result(path)
    assert not there.health.success
    assert "not at its end" in there.health.status
    assert 0.5 < there.final[0] < 3.5
    cut(monkeypatch)
    run = double_pendulum().simulate(4, checkpoint=path)
    assert_same(run, double_pendulum().simulate(4, checkpoint=tmp_path / "other.nc"))
    assert run.t[-1] == 4.0


def test_an_interrupt_keeps_what_was_computed(tmp_path, monkeypatch):
    def stop(fraction):
        if fraction > 0.6:
            raise KeyboardInterrupt

    m, path = double_pendulum(), tmp_path / "run.nc"
    cut(monkeypatch)
    run = m.simulate(4, checkpoint=tmp_path / "whole.nc")
    with pytest.raises(fb.Interrupted, match="the same call continues from there") as ended:
        m.simulate(4, checkpoint=path, progress=stop)
    broken = ended.value.result
    assert not broken.health.success
    n = len(broken.t)
    assert 0.5 < broken.t[-1] < 4.0
    assert np.array_equal(broken["b.x"], run["b.x"][:n])
    assert_same(run, m.simulate(4, checkpoint=path))


@pytest.fixture
def ctrl_c_interrupts():
    """What runs in the background of a shell is begun deaf to it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("ctrl_c_interrupts")
def test_an_interrupt_of_a_long_part_ends_it_in_order(tmp_path, monkeypatch):
    """Ctrl-C: what a part that should have ended long ago has computed is in the file, and not computed again."""
    path, sent = tmp_path / "run.nc", []

    def ctrl_c(fraction):
        if fraction > 0.4 and not sent:
            sent.append(fraction)
            signal.raise_signal(signal.SIGINT)

    m = double_pendulum()
    cut(monkeypatch, 10**9)  # all of it is one part
    monkeypatch.setattr(integration_intervals, "OLD", 0.0)
    monkeypatch.setattr(simulating, "SLICE", 1e-9)
    with pytest.raises(fb.Interrupted, match="interrupted by the user at t = ") as ended:
        m.simulate(4, checkpoint=path, progress=ctrl_c)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    broken, kept = ended.value.result, fb.load_result(path)
    assert_same(broken, kept)
    t = kept.final[0]
    assert 4 * sent[0] <= t < 4 * sent[0] + 0.5
    assert f"{path} contains it to t = {t:.6g} s" in broken.health.message
    begun = []
    run = m.simulate(4, checkpoint=path, progress=begun.append)
    assert begun[0] >= sent[0]
    assert run["b.x"][: len(kept.t)] == pytest.approx(kept["b.x"], abs=0)
    plain = m.simulate(4, rtol=1e-9)
    assert run["b.x"] == pytest.approx(plain["b.x"], abs=1e-3)


@pytest.mark.usefixtures("ctrl_c_interrupts")
def test_a_second_interrupt_ends_it_at_once(monkeypatch):
    monkeypatch.setattr(integration_intervals, "OLD", 0.0)
    own = integration_intervals.Segment(0.0)
    with deferred_interrupt(own):
        signal.raise_signal(signal.SIGINT)
        assert own.asked
        assert own.due()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)


def test_a_failure_has_the_whole_motion_up_to_it(tmp_path, monkeypatch):
    m = double_pendulum().changed({"M": None})
    m.add(fb.Motor("M", "A", torque="1/(2.5-t)**2"))
    cut(monkeypatch)
    with pytest.raises(fb.SimulationError) as failed:
        m.simulate(4, checkpoint=tmp_path / "run.nc")
    t = failed.value.result.t
    assert t[0] == 0.0
    assert np.diff(t) == pytest.approx(4 / 500)
    assert 2.0 < t[-1] < 2.5 + 1e-9


def test_what_is_there_to_its_end_is_what_is_returned(tmp_path, monkeypatch):
    m, path = double_pendulum(), tmp_path / "run.nc"
    run = m.simulate(1, checkpoint=path)
    assert_same(run, m.simulate(1))  # it had one part
    monkeypatch.setattr("flyball.simulation.checkpoints.simulate_with_reason", None)
    assert_same(run, m.simulate(1, checkpoint=path))
    assert type(m.simulate(1, checkpoint=path).model) is fb.Mechanism
    assert "A.angle" in _variables(path)  # for other programs


def _variables(path):
    import h5netcdf

    with h5netcdf.File(path) as file:
        return set(file.variables)


def test_a_motion_goes_on_from_any_state_of_its_file(tmp_path, monkeypatch):
    """With ``start=`` too: events go on counting, parameters stay as set."""
    m, path = bouncer(), tmp_path / "run.nc"
    whole = m.simulate(4, rtol=1e-9)
    cut(monkeypatch, 6)
    files = []
    write = keeper.CheckpointFile.write

    def copied(self):
        write(self)
        files.append(path.read_bytes())

    monkeypatch.setattr(keeper.CheckpointFile, "write", copied)
    m.simulate(4, rtol=1e-9, checkpoint=path)
    assert len(files) > 3
    for n in (1, len(files) // 2, len(files) - 1):
        path.write_bytes(files[n])
        there = fb.load_result(path)
        rest = m.simulate(4, start=there, rtol=1e-9, outputs=[4.0])
        for name in ("b.x", "b.vx"):
            assert rest[name][-1] == pytest.approx(whole[name][-1], abs=1e-7)
        counts = [there.events.counts().get("up", 0), rest.events.counts().get("up", 0)]
        assert sum(counts) == whole.events.counts()["up"] == 5


def test_a_slow_machine_ends_parts_by_the_clock(tmp_path, monkeypatch):
    monkeypatch.setattr(integration_intervals, "LATEST", 0.0)
    monkeypatch.setattr(keeper, "EVERY", 0.0)
    written = []
    monkeypatch.setattr(keeper, "save", lambda *a, **k: written.append(a))
    m = double_pendulum()
    run = m.simulate(4, checkpoint=tmp_path / "run.nc")
    assert len(written) > 1
    assert run["b.x"] == pytest.approx(m.simulate(4)["b.x"], abs=1e-4)
