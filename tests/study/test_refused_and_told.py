"""What a study refuses beforehand, what it says of sampled models, and that an interrupt is loud."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.cli.options import read_assignments
from flyball.cli.study import _read_bounds, _read_variations
from tests.study.rigs import oscillator


def stop(done: float) -> None:
    if done > 0.3:
        raise KeyboardInterrupt


def test_abscissa_of_a_sampled_model_is_the_rate_of_its_growth():
    """A multiplier z from one sample to the next is a growth of ln|z| / period: below zero where it is stable."""
    m = fb.Mechanism("s", planar=True, parameters={"kp": 40.0})
    m.add(fb.Body("cart", mass=2, inertia=1), fb.Prismatic("A", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.PID("pid", setpoint=0, measured="A.displacement", kp="kp", kd=12, filter=0.02, period=0.01))
    m.add(fb.Actuator("drive", "A.displacement", force="pid"))
    s = m.study({"kp": [40, 4e4]}, ["abscissa"], analysis="linearize")
    for k, found in enumerate(s["abscissa"]):
        x = m.linearize(["kp"], ["A.displacement"], parameters=s.at(k)).eigenvalues
        assert found == pytest.approx(np.log(np.abs(x).max()) / 0.01, rel=1e-9)
    assert s["abscissa"][0] < 0.0 < s["abscissa"][1]


def test_a_parameter_that_nothing_has_is_refused():
    m = oscillator()
    m.parameters |= {"nothing": 1.0, "half": "k/2", "twice": "2*x0", "ride": "1 + nothing"}
    for name in ("nothing", "half", "ride"):
        with pytest.raises(fb.ModelError, match=f"{name}.*nothing of 'oscillator' depends on it"):
            m.study({name: [1, 2]}, ["end(b.x)"], t_end=1)
    m.parameters["k"] = "100*nothing"
    s = m.study({"nothing": [1.0, 4.0]}, ["end(b.x)"], t_end=1)
    assert s["end(b.x)"] == pytest.approx(0.1 * np.cos([10.0, 20.0]), abs=1e-6)
    m.study({"half": [1.0]}, {"x": lambda r: r["b.x"][-1]}, t_end=1)  # what a function looks at nobody knows


def test_what_is_given_twice_is_refused():
    for read, texts in (
        (_read_variations, ["k=1,2", "k=3"]),
        (_read_bounds, ["k=1:2", "k"]),
        (read_assignments, ["A=1", "A=2"]),
    ):
        with pytest.raises(fb.ModelError, match="given twice"):
            read(texts, "", "--flag")


def test_what_makes_no_values_is_refused(tmp_path):
    with pytest.raises(fb.ModelError, match="True is no finite number"):
        oscillator().study({"k": [True, 2.0]}, ["end(b.x)"], t_end=1)
    with pytest.raises(fb.ModelError, match="no such folder"):
        oscillator().study({"k": [1.0]}, ["end(b.x)"], t_end=1, file=tmp_path / "none" / "s.nc")
    with pytest.raises(fb.ModelError, match="formulations is empty"):
        oscillator().compare(1.0, formulations=[])


def test_what_a_function_returns_is_told_shortly():
    s = oscillator().study({"k": [1.0]}, {"y": lambda r: r["b.x"], "z": lambda r: None}, t_end=1)
    assert s.reasons[0] == "the function 'y' returned an array of 501; one number is wanted"
    s = oscillator().study({"k": [1.0]}, {"z": lambda r: None}, t_end=1)
    assert "returned None; one" in s.reasons[0]


def test_an_interrupted_run_is_none_of_the_study(tmp_path):
    """The interrupt comes within the second run, on the thread that asked: it was taken for done, at the time reached."""
    m, calls = oscillator(), []

    def looked(model, parameters):
        calls.append(parameters)
        return model.simulate(1e4, outputs=11, parameters=parameters, progress=stop if len(calls) == 2 else False)

    with pytest.raises(fb.Interrupted) as ended:
        m.study({"k": [50.0, 60.0, 70.0]}, {"t": lambda r: r.t[-1]}, analysis=looked, threads=1)
    assert ended.value.result["t"][0] == 1e4
    assert ended.value.result.done.tolist() == [True, False, False]


def test_an_interrupt_is_loud(tmp_path):
    m = oscillator()
    with pytest.raises(fb.Interrupted, match="interrupted by the user at t = ") as ended:
        m.simulate(1e4, outputs=11, progress=stop)
    assert not ended.value.result.health.success
    with pytest.raises(fb.Interrupted, match=r"contains nothing.*starts again"):
        m.simulate(100, outputs=11, progress=stop, checkpoint=tmp_path / "r.nc")
    assert not (tmp_path / "r.nc").exists()
    with pytest.raises(KeyboardInterrupt, match=r"\d+ of 200 runs are missing"):
        m.study({"k": np.linspace(50, 150, 200)}, ["end(b.x)"], t_end=0.1, progress=stop, file=tmp_path / "s.nc")
    assert not fb.load_study(tmp_path / "s.nc").complete


def test_a_pair_is_a_range():
    """Elsewhere (low, high) is; of a grid it was two values, without a word."""
    m = oscillator()
    for design in ("grid", "list"):
        with pytest.raises(fb.ModelError, match=r"vary 'k': \(50.0, 200.0\) is a range.*give a list, \[50.0, 200.0\]"):
            m.study({"k": (50.0, 200.0)}, ["end(b.x)"], t_end=1, design=design)
    assert len(m.study({"k": [50.0, 200.0]}, ["end(b.x)"], t_end=1)) == 2


def test_several_distributions_in_place_of_one():
    from scipy import stats

    with pytest.raises(fb.ModelError, match="vary 'k': 2 distributions are given in place of one"):
        oscillator().study({"k": stats.norm(100, [1, 2])}, ["end(b.x)"], t_end=1, design="sobol", samples=4)


def test_indices_say_of_how_many_samples_they_are():
    """A spring of less than nothing fails: of 64 samples some have a run that did, and 32 of the rest are taken."""
    m = oscillator()
    s = m.study({"k": (-10.0, 200.0), "x0": (0.1, 0.2)}, ["max(b.x)"], t_end=1, design="saltelli", samples=64)
    y = s["max(b.x)"].reshape(4, 64)
    whole = int(np.isfinite(y).all(axis=0).sum())
    found = s.indices()
    assert 32 <= whole < 64
    assert (found.samples, found.left_out) == (32, 64 - whole)
    assert f"left out         {64 - whole} samples of which a run failed" in repr(found)
    assert found.as_dict()["left_out"] == 64 - whole
