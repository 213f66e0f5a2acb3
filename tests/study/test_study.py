"""Many runs: what they find, that each is the single run, and that one which fails leaves the others alone."""

from __future__ import annotations

import inspect

import numpy as np
import pytest

import flyball as fb
from flyball.simulation.method_choice import SimulateOptions
from tests.mechanisms import example
from tests.study.rigs import oscillator, pushed


def test_a_grid_by_the_closed_form():
    k, mass = np.array([50.0, 100.0, 400.0]), np.array([1.0, 2.0])
    s = oscillator().study({"k": [50, 100, "0.4 N/mm"], "mass": mass}, ["end(b.x)", "b.vx"], t_end="2 s", outputs=11)
    omega = np.sqrt(k[:, None] / mass)
    assert s.shape == (3, 2)
    np.testing.assert_allclose(s["end(b.x)"], 0.1 * np.cos(2.0 * omega), atol=1e-7)
    np.testing.assert_allclose(s["b.vx"], -0.1 * omega[..., None] * np.sin(omega[..., None] * s.t), atol=1e-5)
    assert s.complete
    assert s.done.all()
    assert s.at(3) == {"k": 100.0, "mass": 2.0}
    assert s.unit("b.vx") == "m/s"


def test_numbers_of_a_curve():
    """Of a cosine over whole periods: mean 0, rms 1 / sqrt 2."""
    omega = 10.0
    of = ["max(b.x)", "min(b.x)", "mean(b.x)", "rms(b.x)", "end(b.x)"]
    s = oscillator().study({"x0": [0.1, 0.2]}, of, t_end=2.0 * 2.0 * np.pi / omega, outputs=401)
    for name, part in zip(of, (1.0, -1.0, 0.0, np.sqrt(0.5), 1.0), strict=True):
        np.testing.assert_allclose(s[name], part * np.array([0.1, 0.2]), atol=1e-6)


def test_means_are_over_time_however_output_times_are_spread():
    """Of x = t^2 / 2 by trapezoids: each time counts as much as the spans beside it."""
    m = fb.Mechanism("block", planar=True, parameters={"a": 1.0})
    m.add(fb.Body("b", mass=1.0, inertia=1.0), fb.Prismatic("slide", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.Actuator("push", "slide.displacement", force="a"))
    t = np.array([0.0, 0.05, 0.1, 0.2, 1.0])
    s = m.study({"a": [1.0, 3.0]}, ["mean(b.x)", "mean(b.vx)", "rms(b.vx)"], t_end=1.0, outputs=t.tolist())
    a = np.array([1.0, 3.0])
    np.testing.assert_allclose(s["mean(b.vx)"], a / 2, rtol=1e-9)  # exact: it is linear; alike they gave 0.27 a
    np.testing.assert_allclose(s["mean(b.x)"], a * np.trapezoid(t**2 / 2, t), rtol=1e-8)
    np.testing.assert_allclose(s["rms(b.vx)"], a * np.sqrt(np.trapezoid(t**2, t)), rtol=1e-8)
    assert dict(s.lines())["mean, rms"] == "over time by the trapezoidal rule between the output times"


def test_functions_of_results():
    s = oscillator().study(
        {"x0": [0.1, 0.2]}, {"energy": lambda r: r.energy.total[0], "turns": lambda r: len(r.t)}, t_end=0.1, outputs=3
    )
    np.testing.assert_allclose(s["energy"], 50.0 * np.array([0.1, 0.2]) ** 2, rtol=1e-12)
    assert s["turns"].tolist() == [3.0, 3.0]
    bad = oscillator().study({"x0": [0.1]}, {"curve": lambda r: r.t}, t_end=0.1)
    assert "one number is wanted" in bad.reasons[0]


@pytest.mark.parametrize(
    ("vary", "options"),
    [
        ({"stiffness": [4000.0, 4530.0, 4900.0, 5000.0], "torque": [0.03, 0.033]}, {"specialize": True}),
        ({"stiffness": [4000.0, 4530.0, 4900.0, 5000.0], "torque": [0.03, 0.033]}, {"specialize": False}),
        ({"d": [0.028, 0.0281, 0.0279, 0.02805]}, {"specialize": False}),
    ],
)
def test_each_run_is_the_single_run(vary, options):
    """To the last bit: positions, velocities, accelerations, reactions, works."""
    m = example("andrews.toml")
    of = ["K5.x", "end(K3.angle)", "max(crank.angle_rate)", "rms(P3.fx)", "end(motor.work)", "K5.ax"]
    s = m.study(vary, of, t_end=0.004, outputs=5, threads=2, **options)
    assert s.done.all()
    for k in range(len(s)):
        r = m.simulate(**s.question(k))
        assert r["K5.x"].tobytes() == s.values["K5.x"][k].tobytes()
        assert r["K5.ax"].tobytes() == s.values["K5.ax"][k].tobytes()
        assert r["K3.angle"][-1] == s.values["end(K3.angle)"][k]
        assert r["crank.angle_rate"].max() == s.values["max(crank.angle_rate)"][k]
        assert r["motor.work"][-1] == s.values["end(motor.work)"][k]


@pytest.mark.parametrize("more", [{}, {"method": "impulse"}, {"method": fb.Stepping(step="2 ms")}])
def test_each_run_of_a_motion_with_contact_is_the_single_run(more, tmp_path):
    m = example("bouncing_ball.toml")
    body = m.bodies[0].name
    name = next(iter(m.parameters))
    value = m.environment()[name]
    s = m.study({name: [value, 0.9 * value]}, [f"{body}.vy"], t_end=0.3, outputs=4, **more)
    assert s.done.all()
    s.save(tmp_path / "s.nc")
    for k in range(2):
        assert fb.load_study(tmp_path / "s.nc").question(k)["method"] == s.question(k)["method"]
        assert m.simulate(**s.question(k))[f"{body}.vy"].tobytes() == s.values[f"{body}.vy"][k].tobytes()


def test_a_run_that_fails_is_left_out_and_says_why():
    s = oscillator().study({"mass": [1.0, -1.0, 2.0]}, ["end(b.x)"], t_end=0.1)
    assert s.status.tolist() == [1, 2, 1]
    assert np.isnan(s["end(b.x)"]).tolist() == [False, True, False]
    assert list(s.reasons) == [1]
    assert "Body 'b': mass is -1 kg" in s.reasons[1]
    assert any("run 1 (mass = -1)" in text for _, text in s.lines())


def test_a_failing_run_among_those_that_share_tables():
    """A spring is tried at a stiffness that its element refuses."""
    s = oscillator().study({"k": [100.0, 1e300, 100.0, 50.0, 100.0]}, ["end(b.x)"], t_end=1.0)
    assert s.status.tolist() == [1, 2, 1, 1, 1]
    assert s["end(b.x)"][0] == s["end(b.x)"][2] == s["end(b.x)"][4]
    np.testing.assert_allclose(s["end(b.x)"][0], 0.1 * np.cos(10.0), atol=1e-7)


def test_a_motion_that_an_event_ends():
    """It is stopped where x rises through 0, after three quarters of a period, with omega x0."""
    m = oscillator()
    m.add(fb.Event("through", when="b.x", do=[fb.Stop()]))
    s = m.study({"k": [100.0, 400.0]}, ["b.x", "end(b.vx)"], t_end=1.0, outputs=11)
    t = s.t[None, :]
    ended = 1.5 * np.pi / np.array([10.0, 20.0])[:, None]
    assert (np.isnan(s["b.x"]) == (t > ended)).all()
    np.testing.assert_allclose(s["end(b.vx)"], [1.0, 2.0], rtol=1e-6)


def test_options_are_those_of_simulate():
    ours, its = (inspect.signature(getattr(fb.Mechanism, n)).parameters for n in ("study", "simulate"))
    shared = {k for k in its if k in ours and k not in ("t_end", "outputs")}
    assert shared >= {f for f in SimulateOptions.__dataclass_fields__ if f not in ("t_end", "outputs")}
    assert {k: ours[k].default for k in shared} == {k: its[k].default for k in shared}


@pytest.mark.parametrize("more", [{"method": "radau"}, {"method": "radau", "step": "5 ms"}, {"method": "rk45"}])
def test_every_method(more):
    s = oscillator().study({"k": [50.0, 100.0, 150.0, 200.0, 250.0]}, ["end(b.x)"], t_end=0.5, **more)
    omega = np.sqrt(s.points[:, 0])
    np.testing.assert_allclose(s["end(b.x)"], 0.1 * np.cos(0.5 * omega), atol=1e-6)
    assert oscillator().simulate(**s.question(3))["b.x"][-1] == s["end(b.x)"][3]


def test_going_on_from_a_result():
    m = oscillator()
    first = m.simulate(0.5)
    s = m.study({"c": [0.0, 0.1]}, ["end(b.x)"], t_end=1.0, start=first)
    np.testing.assert_allclose(s["end(b.x)"][0], 0.1 * np.cos(10.0), atol=1e-7)
    assert m.simulate(**s.question(1))["b.x"][-1] == s["end(b.x)"][1]


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ({"vary": {}}, "vary names no parameter"),
        ({"vary": {"kk": [1]}}, "has no parameter 'kk'.*'k'"),
        ({"vary": {"k": 3}}, "a grid takes a list of values"),
        ({"vary": {"k": []}}, "there are no values"),
        ({"vary": {"k": ["3 m"]}}, "parameter 'k' of 'oscillator'"),
        ({"vary": {"k": [np.inf]}}, "inf is no finite number"),
        ({"of": []}, "of names no quantity"),
        ({"of": ["b.xx"]}, "no curve 'xx'"),
        ({"of": ["max(b)"]}, "whole part"),
        ({"of": ["b.x", "b.x"]}, "twice"),
        ({"of": "b.x"}, "of is a list of names"),
        ({"design": "griddle"}, "unknown design 'griddle'"),
        ({"samples": 4}, "samples=4 does nothing with design='grid'"),
        ({"seed": 4}, "seed=4 does nothing with design='grid'"),
        ({"design": "sobol", "vary": {"k": (1, 2)}}, "samples, which design='sobol' needs"),
        ({"design": "sobol", "vary": {"k": (1, 2)}, "samples": 12}, "take 8 or 16"),
        ({"design": "latin", "vary": {"k": (2, 1)}, "samples": 3}, "lower end 2 must be smaller"),
        ({"design": "latin", "vary": {"k": "normall(2, 1)"}, "samples": 3}, "no distribution 'normall'"),
        ({"design": "latin", "vary": {"k": "normal(2)"}, "samples": 3}, r"takes \(mean, standard deviation\)"),
        ({"design": "latin", "vary": {"k": "normal(2, -1)"}, "samples": 3}, "standard deviation must be greater"),
        ({"design": "random", "vary": {"k": [1, 2, 3]}, "samples": 3}, "a sample is drawn from"),
        ({"design": "list", "vary": {"k": [1, 2, 3], "c": [0]}}, "as many for each parameter, not 'k' 3, 'c' 1"),
        ({"parameters": {"k": 3}}, "k: given in parameters, and varied"),
        ({"threads": 0}, "threads must be at least 1"),
        ({"executor": 3}, "executor is one of concurrent.futures"),
        ({"rtol": -1}, "rtol must be greater than 0"),
        ({"t_end": -1}, "must be later"),
        ({"vary": {"k": np.zeros(5000), "c": np.zeros(5000)}}, "25,000,000 runs"),
    ],
)
def test_what_makes_no_sense_is_refused(more, told):
    with pytest.raises(fb.ModelError, match=told):
        oscillator().study(**{"vary": {"k": [1.0]}, "of": ["b.x"], "t_end": 1.0} | more)


def test_progress():
    seen: list[float] = []
    oscillator().study({"k": np.linspace(1, 9, 130)}, ["end(b.x)"], t_end=0.01, progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == 1.0


def test_labelled_data():
    m = oscillator()
    grid = m.study({"k": [50.0, 100.0], "mass": [1.0, 2.0, 3.0]}, ["end(b.x)", "b.x"], t_end=0.1, outputs=3)
    x = grid.to_xarray()
    assert x["b.x"].dims == ("k", "mass", "time")
    assert x["b.x"].attrs["units"] == "m"
    assert float(x["end(b.x)"].sel(k=100.0, mass=3.0)) == grid["end(b.x)"][1, 2]
    latin = m.study({"k": (50.0, 100.0), "mass": (1.0, 2.0)}, ["end(b.x)"], t_end=0.1, design="latin", samples=3)
    x = latin.to_xarray()
    assert x["end(b.x)"].dims == ("run",)
    assert x["k"].values.tolist() == latin.points[:, 0].tolist()
    frame = latin.to_dataframe()
    assert list(frame.columns) == ["k", "mass", "end(b.x)"]
    with pytest.raises(fb.ModelError, match=r"the study has no 'end\(b.y\)'"):
        latin["end(b.y)"]
    with pytest.raises(fb.ModelError, match="numbered from 0 to 2"):
        latin.at(3)


def test_indices_of_a_sum():
    """Of y = (a + 2 b) / 2 with a, b uniform of equal width: 1/5 and 4/5, no interaction; what is idle has none."""
    vary = {"a": (0.0, 1.0), "b": (0.0, 1.0), "idle": (0.0, 1.0)}
    s = pushed().study(vary, ["end(block.x)"], t_end=1.0, design="saltelli", samples=64)
    assert len(s) == 64 * 5
    found = s.indices()
    np.testing.assert_allclose(found.first, [[0.2, 0.8, 0.0]], atol=0.05)
    np.testing.assert_allclose(found.total, [[0.2, 0.8, 0.0]], atol=0.05)
    assert found["end(block.x)"]["idle"][1] < 1e-12
    with pytest.raises(fb.ModelError, match="sensitivity indices need design='saltelli'"):
        pushed().study({"a": [1.0]}, ["end(block.x)"], t_end=1.0).indices()
