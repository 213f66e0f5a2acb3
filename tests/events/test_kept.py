"""Modes and parameters of a motion over time: gone on with, written to files, and true at every output time."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb


def block():
    """2 kg between springs, pushed along a slide with a brake that holds 6 N; from the first rest on k is 8 times as much."""
    m = fb.Mechanism("block", planar=True, parameters={"k": 100.0})
    m.add(fb.Body("b", mass=2.0, inertia=0.1), fb.Translational("slide", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("spring", "slide.displacement", stiffness="k"))
    m.add(fb.Brake("brake", "slide.displacement", capacity=6.0, static=1.5), fb.Initial("slide.displacement", rate=1.0))
    m.add(fb.Event("stiffer", "t - 1", do=[fb.Set("k", "8*k")]))
    m.add(fb.Event("blow", "t - 2", do=[fb.Impulse("slide.displacement", 3.0)]))
    return m


@pytest.fixture(scope="module")
def run():
    return block().simulate(3.0, outputs=61, rtol=1e-10, atol=1e-12)


def test_the_balance_closes_over_events(run):
    """The stuck spring has seven times its energy more, and the blow of 3 N s on 2 kg at rest gives 2.25 J."""
    stuck = run.t < 1.0
    x = run["slide.displacement"][stuck][-1]
    given = run.exchanged["event_work"]
    assert given[stuck].max() == 0.0
    assert given[(run.t > 1.0) & (run.t < 2.0)] == pytest.approx(0.5 * 700.0 * x * x, rel=1e-9)
    kick = given[-1] - 0.5 * 700.0 * x * x
    v = run.events["blow"][0].before["b.vx"]
    assert kick == pytest.approx(3.0 * v + 9.0 / 4.0, rel=1e-8)
    assert run.health.energy_drift < 1e-8
    assert run.health.acceleration_violation < 1e-9
    assert (np.diff(run["brake.work"]) < 1e-12).all()


def test_forces_at_each_time_balance(run):
    """m a = spring + brake, with the parameters and modes of then."""
    assert np.allclose(2.0 * run["b.ax"], run["spring.force"] + run["brake.friction"], atol=1e-7)
    k = np.where(run.t < 1.0, 100.0, 800.0)
    assert np.allclose(run["spring.force"], -k * run["slide.displacement"], atol=1e-9)


def test_in_two_parts_it_is_the_same(run):
    m = block()
    for cut in (0.9, 1.5, 2.3):
        first = m.simulate(cut, outputs=2, rtol=1e-10, atol=1e-12)
        second = m.simulate(3.0, start=first, outputs=[3.0], rtol=1e-10, atol=1e-12)
        assert second["slide.displacement"][-1] == pytest.approx(run["slide.displacement"][-1], abs=1e-8), cut


def test_a_file_keeps_what_held(run, tmp_path):
    run.save(tmp_path / "run.nc")
    again = fb.load_result(tmp_path / "run.nc")
    assert np.array_equal(again.phases.mode, run.phases.mode)
    for name, (_, x) in run.channels().items():
        assert np.array_equal(again[name], x, equal_nan=True), name
