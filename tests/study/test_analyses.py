"""Studies of other analyses than motions: by closed forms, each run the single analysis, what is not known refused."""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import flyball as fb
from flyball.cli import app
from flyball.studies.study import ANALYSES
from tests.study.rigs import oscillator

K = np.array([50.0, 100.0, 400.0])


def hanging() -> fb.Mechanism:
    """A pan on a spring: it rests at y = -m g / k."""
    m = fb.Mechanism("scale", planar=True, gravity=(0, -9.81), parameters={"k": "100 N/m", "c": 0.5, "load": 2.0})
    m.add(fb.Body("pan", mass="load", inertia=0.01), fb.Prismatic("guide", "ground", "pan", at=(0, 0), axis=(0, 1)))
    m.add(fb.CoordinateSpring("spring", coordinate="pan.y", stiffness="k", damping="c"))
    m.add(fb.Actuator("push", "pan.y", force="0"))
    return m


def test_equilibria():
    s = hanging().study({"k": K, "load": [1.0, 2.0]}, ["pan.y", "spring.force", "stable"], analysis="equilibrium")
    rest = -9.81 * np.array([1.0, 2.0]) / K[:, None]
    np.testing.assert_allclose(s["pan.y"], rest, rtol=1e-12)
    np.testing.assert_allclose(np.abs(s["spring.force"]), 9.81 * np.array([[1.0, 2.0]] * 3), rtol=1e-12)
    assert (s["stable"] == 1.0).all()
    for k in (0, 5):
        assert hanging().equilibrium(**s.question(k))["pan.y"] == s.values["pan.y"][k]
    assert s.to_xarray()["pan.y"].dims == ("k", "load")
    up = fb.Mechanism("inverted", planar=True, gravity=(0, -9.81), parameters={"k": 0.0})
    up.add(fb.Body("rod", mass=1, inertia=0.1, position=(0, 0.5)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    up.add(fb.TorsionalSpringDamper("spring", "A", stiffness="k"))
    s = up.study({"k": [1.0, 10.0]}, ["stable"], analysis="equilibrium")  # m g l = 4.905
    assert s["stable"].tolist() == [0.0, 1.0]
    assert s.remarks == {0: "the equilibrium is unstable"}


def test_modes_about_equilibria(tmp_path):
    of = ["frequency[0]", "damping_ratio[0]", "omega[0]", "stable", "frequency[1]"]
    s = hanging().study({"k": K}, of, analysis="modes", about="equilibrium", file=tmp_path / "s.nc")
    omega = np.sqrt(K / 2.0)
    ratio = 0.5 / (2.0 * np.sqrt(2.0 * K))
    np.testing.assert_allclose(s["omega[0]"], omega, rtol=1e-9)
    np.testing.assert_allclose(s["damping_ratio[0]"], ratio, rtol=1e-9)
    np.testing.assert_allclose(s["frequency[0]"], omega * np.sqrt(1.0 - ratio**2) / (2.0 * np.pi), rtol=1e-9)
    assert (s["stable"] == 1.0).all()
    assert np.isnan(s["frequency[1]"]).all()
    m, asked = hanging(), fb.load_study(tmp_path / "s.nc").question(1)
    one = m.modes(about=m.equilibrium(**asked), parameters=asked["parameters"])
    assert one.frequency[0] == s["frequency[0]"][1]
    with pytest.raises(fb.ModelError, match="another study"):
        hanging().study({"k": K}, of, analysis="modes", file=tmp_path / "s.nc")


def test_what_linear_models_answer():
    of = ["gain(pan.y, push)", "gain(pan.y, push, 3)", "phase(pan.y, push, 3)", "gain(pan.vy, push, 3)", "abscissa"]
    s = hanging().study({"k": K}, of, analysis="linearize", about="equilibrium")
    g = 1.0 / (K - 2.0 * 9.0 + 0.5 * 3.0j)
    for name, exact in zip(of, (1.0 / K, abs(g), np.angle(g), 3.0 * abs(g), -0.125 * np.ones(3)), strict=True):
        np.testing.assert_allclose(s[name], exact, rtol=1e-8)
    assert [s.unit(name) for name in of] == ["m/N", "m/N", "rad", "m/s/N", "1/s"]


def test_an_instant_and_kinematics():
    """Of a crank of length l at the angle w t: l w^2 towards its axis."""
    m = fb.Mechanism("crank", planar=True, parameters={"l": 0.5, "w": 2.0})
    m.add(fb.Body("crank", mass=3.0, inertia=0.1, position=("l", 0)), fb.Revolute("A", "ground", "crank", at=(0, 0)))
    m.add(fb.Driver("drive", "A.angle", "w*t"))
    vary = {"l": [0.5, 1.0], "w": [1.0, 2.0, 3.0]}
    l, w = np.array([[0.5], [1.0]]), np.array([[1.0, 2.0, 3.0]])
    s = m.study(vary, ["crank.ax", "A.fx", "crank.x"], analysis="instant")
    np.testing.assert_allclose(s["crank.ax"], -l * w**2, rtol=1e-12)
    np.testing.assert_allclose(np.abs(s["A.fx"]), 3.0 * l * w**2, rtol=1e-12)
    at = m.assemble(**s.question(3)).as_dict()["bodies"]["crank"]["mass_centre"]
    assert at[0] == s.values["crank.x"][3]
    s = m.study(vary, ["crank.x", "max(crank.vy)"], analysis="kinematics", t_end=1.0, outputs=5)
    np.testing.assert_allclose(s["crank.x"], l[..., None] * np.cos(w[..., None] * s.t), atol=1e-10)
    np.testing.assert_allclose(s["max(crank.vy)"], l * w, rtol=1e-12)
    assert m.kinematics(**s.question(4))["crank.x"].tobytes() == s.values["crank.x"][4].tobytes()
    m.drivers.clear()
    assert "under-driven" in m.study({"l": [1.0]}, ["crank.x"], analysis="kinematics", t_end=1.0).reasons[0]


def damped(k, t=0.5):
    """Position of the pan that is let go where the spring is unloaded: 2 kg, 0.5 N s/m."""
    d, w = 0.125, np.sqrt(k / 2.0 - 0.125**2)
    return -2.0 * 9.81 / k * (1.0 - np.exp(-d * t) * (np.cos(w * t) + d / w * np.sin(w * t)))


AT_THE_END = {"t_end": 0.5, "outputs": 2, "rtol": 1e-10}
SAMPLES = {  # analysis -> a result, options, and its closed form
    "motion": ("pan.y", AT_THE_END, damped),
    "kinematics": ("pan.y", {"t_end": 0.5, "outputs": 2}, lambda k: 1e-3 * k * 0.5**2),
    "instant": ("pan.ay", {}, lambda k: -9.81 + 0.0 * k),
    "equilibrium": ("pan.y", {}, lambda k: -2.0 * 9.81 / k),
    "modes": ("omega[0]", {"about": "equilibrium"}, lambda k: np.sqrt(k / 2.0)),
    "linearize": ("abscissa", {"about": "equilibrium"}, lambda k: -0.125 + 0.0 * k),
}


@pytest.mark.parametrize("analysis", ANALYSES)
def test_every_analysis_gives_its_closed_form(analysis):
    of, options, exact = SAMPLES[analysis]
    m = hanging()
    if analysis == "kinematics":
        m.add(fb.Driver("lift", "pan.y", "1e-3*k*t**2"))
    s = m.study({"k": K}, [of], analysis=analysis, **options)
    np.testing.assert_allclose(s[of].reshape(len(K), -1)[:, -1], exact(K), rtol=1e-8)


def test_functions_of_the_mechanism():
    def preload(m, parameters):
        return m.equilibrium(parameters=parameters, preload=["push"])

    s = hanging().study({"load": [1.0, 2.0, -1.0]}, {"lift": lambda e: e.preload["push"]}, analysis=preload)
    np.testing.assert_allclose(s["lift"][:2], [9.81, 19.62], rtol=1e-12)
    assert list(s.reasons) == [2]
    with pytest.raises(fb.ModelError, match=r"of='pan.y': the results of a function"):
        hanging().study({"load": [1.0]}, ["pan.y"], analysis=preload)


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ({}, "analysis='motion' needs t_end"),
        ({"analysis": "moods"}, "unknown analysis 'moods' .did you mean 'modes'"),
        ({"analysis": "equilibrium", "t_end": 1}, "t_end does nothing with analysis='equilibrium'"),
        ({"analysis": "modes", "rtol": 1e-3}, "rtol does nothing with analysis='modes'"),
        ({"t_end": 1, "t": 1}, "t does nothing with analysis='motion'"),
        ({"analysis": "instant", "about": "equilibrium"}, "about does nothing"),
        ({"analysis": "modes", "about": 3, "of": ["stable"]}, "about is 'equilibrium' or None, not 3"),
        ({"analysis": "modes"}, r"of='b.x': modes have frequency\[0\]"),
        ({"analysis": "linearize"}, "linear models have gain"),
        ({"analysis": "linearize", "of": ["gain(b.x)"]}, "linear models have gain"),
        ({"analysis": "linearize", "of": ["gain(b.x, pull)"]}, "has no input 'pull'"),
        ({"analysis": "equilibrium", "of": ["max(b.x)"]}, "there is one instant only, at which b.x is one number"),
        ({"analysis": "equilibrium", "of": ["b.q"]}, "no curve 'q'"),
    ],
)
def test_what_makes_no_sense_is_refused(more, told):
    with pytest.raises(fb.ModelError, match=told):
        oscillator().study(**{"vary": {"k": [1.0]}, "of": ["b.x"]} | more)


def test_what_an_analysis_does_not_know_is_refused_by_name():
    m = oscillator()
    m.add(fb.Event("through", when="b.x", do=[fb.Stop()]))
    for analysis, of in (("instant", "b.x"), ("kinematics", "b.x")):
        with pytest.raises(fb.ModelError, match=r"through"):
            m.study({"k": [1.0]}, [of], analysis=analysis, **({"t_end": 1} if analysis == "kinematics" else {}))


def test_from_a_shell(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    hanging().save("m.toml")
    words = ["study", "m.toml", "--vary", "k=50,100,400", "--of", "frequency[0]", "--analysis", "modes"]
    said = CliRunner().invoke(app, [*words, "--about", "equilibrium", "--json", "--plot", "p.png"])
    assert said.exit_code == 0, said.stderr
    exact = np.sqrt(K / 2.0 - 0.125**2) / (2.0 * np.pi)
    np.testing.assert_allclose(json.loads(said.stdout)["values"]["frequency[0]"], exact, rtol=1e-8)
    assert (tmp_path / "p.png").stat().st_size > 5000
    bad = CliRunner().invoke(app, [*words, "--t-end", "1"])
    assert bad.exit_code == 2
    assert "t_end does nothing with analysis='modes'" in bad.stderr


def test_the_abscissa_of_sampled_models():
    """Of x_(k+1) = a x_k every period: ln(a) / period; it was the real part of the multiplier, in 1/s."""
    m = fb.Mechanism("slide", planar=True, parameters={"a": 0.5})
    m.add(fb.Body("cart", mass=1.0, inertia=1.0), fb.Prismatic("A", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("spring", "A.displacement", stiffness=4.0, damping=1.0))
    m.add(fb.State("x", next="a*x", period=0.1), fb.Actuator("drive", "A.displacement", force="x"))
    s = m.study({"a": [0.5, 1.5, -1.5]}, ["abscissa"], analysis="linearize")
    unstable = np.log(1.5) / 0.1
    np.testing.assert_allclose(s["abscissa"], [-0.5, unstable, unstable], rtol=1e-9)
