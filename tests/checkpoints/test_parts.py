"""Parts end soon after they are to, whatever the method, and whatever happens at the end of each step."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.simulation import checkpoints as keeper

from .motions import bouncer, crank, cut, double_pendulum, pile, sampled, switched, twisting, watched

RADAU, ALPHA = {"method": "radau"}, {"method": "generalised-alpha", "step": 0.005}
CASES = {
    "smooth": (double_pendulum, {"t_end": 1}),
    "fixed steps": (double_pendulum, {"t_end": 1, "step": 0.01, "method": "rk45"}),
    "radau": (double_pendulum, {"t_end": 1} | RADAU),
    "alpha": (double_pendulum, {"t_end": 0.2} | ALPHA),
    "variational": (double_pendulum, {"t_end": 0.2, "method": "variational", "step": 0.005}),
    "sampled": (sampled, {"t_end": 0.3}),
    "sampled, radau": (sampled, {"t_end": 0.1} | RADAU),
    "sampled, alpha": (sampled, {"t_end": 0.1} | ALPHA),
    "sampled, watched": (watched, {"t_end": 0.3}),
    "sampled, watched, radau": (watched, {"t_end": 0.1} | RADAU),
    "sampled, watched, alpha": (watched, {"t_end": 0.1} | ALPHA),
    "events": (bouncer, {"t_end": 2}),
    "events, radau": (bouncer, {"t_end": 1} | RADAU),
    "accumulating": (twisting, {"t_end": 1.5, "rtol": 1e-9}),
    "jumps in time": (switched, {"t_end": 0.1}),
    "jumps in time, radau": (switched, {"t_end": 0.05} | RADAU),
    "jumps in time, alpha": (switched, {"t_end": 0.05} | ALPHA),
    "prescribed": (crank, {"t_end": 1, "outputs": 60}),
    "impulses": (pile, {"t_end": 0.1, "method": "impulse"}),
}
STEPS, MORE = 4, 3  # of a part, and times as many that it has at most


@pytest.mark.parametrize("case", CASES)
def test_no_part_lasts_long(case, tmp_path, monkeypatch):
    """Parts of implicit methods are of one step here."""
    made, how = CASES[case]
    cut(monkeypatch, STEPS)
    kept, add = [], keeper.CheckpointFile.add
    monkeypatch.setattr(keeper.CheckpointFile, "add", lambda self, part: (kept.append(part.health), add(self, part)))
    run = made().simulate(checkpoint=tmp_path / "run.nc", **{"outputs": 2} | how)
    assert run.health.success
    assert len(kept) >= run.health.steps / (MORE * STEPS) - 1
    assert max(h.steps + h.rejected for h in kept) <= MORE * STEPS


def test_parts_do_not_begin_with_short_steps(tmp_path, monkeypatch):
    """Two steps each: as many steps in all as in one piece. Radau began each with a ten thousandth of the span."""
    how = {"t_end": 1, "outputs": 11, "method": "radau"}
    plain = sampled().simulate(**how)
    cut(monkeypatch, 2)
    run = sampled().simulate(checkpoint=tmp_path / "run.nc", **how)
    assert run.health.steps <= 1.2 * plain.health.steps
    assert run["a.x"] == pytest.approx(plain["a.x"], abs=1e-8)


def test_a_method_that_was_gone_over_to_is_that_of_the_next_part(tmp_path, monkeypatch):
    """And is told once."""
    m = fb.Mechanism("lag", planar=True)
    m.add(fb.Body("a", mass=1, inertia=0.1, position=(0.5, 0)), fb.Revolute("A", "ground", "a", at=(0, 0)))
    m.add(fb.CoordinateSpring("S", "A.angle", stiffness=200, damping=5e4), fb.Motor("M", "A", torque="300*sin(t)"))
    cut(monkeypatch, 700)
    run = m.simulate(30, outputs=31, checkpoint=tmp_path / "run.nc")
    assert run.health.method.count("radau from t = ") == 1
    assert run.health.steps < 1500  # 180 000 by dop853
    t = run.t  # I' w' + 5e4 w + 200 x = 300 sin t, but for what is gone after a millisecond: w = x'
    inertia = 0.1 + 0.25
    gain = 300 / ((200 - inertia) + 5e4j)
    slow = -np.imag(gain) * np.exp(-200 * t / 5e4)
    assert run["A.angle"] == pytest.approx(np.imag(gain * np.exp(1j * t)) + slow, abs=1e-5)


def test_prescribed_motions_go_on(tmp_path, monkeypatch):
    """Works are those of the motion in one piece."""
    how = {"t_end": 2, "outputs": 101}
    plain = crank().simulate(**how)
    cut(monkeypatch, 17)
    run = crank().simulate(checkpoint=tmp_path / "run.nc", **how)
    assert len(run.t) == len(plain.t)
    for name in ("c.x", "c.vx", "turn.effort", "turn.work"):
        assert run[name] == pytest.approx(plain[name], abs=1e-5 * np.abs(plain[name]).max()), name
    assert run.health.energy_drift < 1e-5


def test_parts_name_a_wheel_that_pulls(tmp_path, monkeypatch):
    """By impulse time stepping, too: a wheel of 1 kg that 15 N lift is held down by its joint with 5.19 N."""
    m = fb.Mechanism("wheel", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("hub", mass=1, inertia=0.01, position=(0, 0.1)))
    m.add(fb.WheelOnLine("road", "ground", "hub", at=(0, 0), centre=(0, 0.1), axis=(1, 0)))
    m.add(fb.PointForce("lift", "hub", at=(0, 0.1), force=(0, 15)))
    cut(monkeypatch, STEPS)
    run = m.simulate(0.1, outputs=11, method="impulse", checkpoint=tmp_path / "run.nc")
    assert "pulls with up to 5.19 N" in "".join(run.health.warnings)
