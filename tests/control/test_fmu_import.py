"""Units of other programs as controllers: by hand in C, by flyball's own export, for FMI 2 and 3."""

from __future__ import annotations

import math
import shutil
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import flyball as fb
from tests.control.slide import TIGHT, slide
from tests.control.units_in_c import compiled, description, pack

pytest.importorskip("fmpy")
pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or not shutil.which("gcc"), reason="compiles a unit for Linux by gcc"
)
RPM = 2 * math.pi / 60


@pytest.fixture(scope="module")
def libraries(tmp_path_factory):
    folder = tmp_path_factory.mktemp("units")
    return {version: compiled(folder, version) for version in (2, 3)}


@pytest.fixture(params=(2, 3), ids=("FMI 2", "FMI 3"))
def unit(request, libraries, tmp_path):
    return pack(tmp_path / "unit.fmu", request.param, libraries[request.param])


def sums(u, period):
    """Sums of the unit at its instants, from inputs there."""
    return period * np.r_[0.0, np.cumsum(u)[:-1]]


def test_a_unit_is_the_difference_equation_that_it_contains(unit):
    """x_(k+1) = x_k + gain u_k period, y = x + direct u, with units of its own: 1/min in, kN out."""
    m = slide(
        fb.FMU(
            "g", unit, inputs={"u": "20*RPM*sin(3*t) + A.displacement"}, period=0.02,
            parameters={"gain": "G", "direct": 0.5},
        ),
        force="0*g.shaft_y", G=2.0, RPM=RPM,
    )  # fmt: skip
    run = m.simulate(1, outputs=np.arange(0, 1, 0.02), **TIGHT)
    u = 20 * np.sin(3 * run.t)  # in 1/min: the cart stays
    np.testing.assert_allclose(run["g.u"], u * RPM, atol=1e-12)
    np.testing.assert_allclose(run["g"].slow, 2 * sums(u, 0.02), atol=1e-12)
    np.testing.assert_allclose(run["g"].shaft_y, 1e3 * (2 * sums(u, 0.02) + 0.5 * u), atol=1e-9)
    np.testing.assert_allclose(run["g.time"], run.t, atol=1e-12)


def test_it_closes_a_loop_as_the_same_state_space_does(unit):
    """The unit as an integral controller, beside the native controller."""
    gains = {"gain": 30.0, "direct": 4.0}
    own = fb.StateSpace("c", inputs=["0.3 - A.displacement"], A=1, B=30 * 0.05, C=1, D=4, period=0.05)
    there = fb.FMU("c", unit, inputs={"u": "(0.3 - A.displacement)*RPM"}, parameters=gains, period=0.05)
    expected = slide(own, force="c", RPM=RPM).simulate(3, outputs=61, **TIGHT)
    found = slide(there, force="1e-3*c.shaft_y", RPM=RPM).simulate(3, outputs=61, **TIGHT)
    assert np.ptp(expected["A.displacement"]) > 0.1
    np.testing.assert_allclose(found["A.displacement"], expected["A.displacement"], atol=1e-9)
    for method in ("radau", "dop853"):
        again = slide(there, force="1e-3*c.shaft_y", RPM=RPM).simulate(3, outputs=61, method=method, rtol=1e-8)
        np.testing.assert_allclose(again["A.displacement"], expected["A.displacement"], atol=1e-6)


def test_every_motion_has_an_instance_of_its_own(unit, tmp_path, monkeypatch):
    log = tmp_path / "log"
    monkeypatch.setenv("UNIT_LOG", str(log))
    made = [fb.FMU(k, unit, inputs={"u": f"{x}*t"}, outputs="slow", period=0.1) for k, x in (("a", 1), ("b", 2))]
    m = slide(*made, force="a - b")
    one, two = m.simulate(1), m.simulate(1)
    np.testing.assert_array_equal(one["a"].slow, two["a"].slow)
    np.testing.assert_allclose(one["b"].slow, 2 * one["a"].slow, atol=1e-12)
    assert log.read_text() == "++t-t-" * 2
    with ThreadPoolExecutor(2) as pool:
        runs = list(pool.map(lambda _: m.simulate(1), range(4)))
    for run in runs:
        np.testing.assert_array_equal(run["A.displacement"], one["A.displacement"])
    assert log.read_text().count("+") == log.read_text().count("-") == 12


def test_in_a_study_and_with_events(unit):
    """Parameters of the unit follow those of the mechanism; a stop ends steps between its instants."""
    m = slide(
        fb.FMU("c", unit, inputs={"u": 10 * RPM}, parameters={"gain": "G"}, outputs={"f": "slow"}, period=0.1),
        force="c", G=1.0,
    )  # fmt: skip
    m.add(fb.Limit("stop", "A.displacement", upper=0.3))
    found = m.study({"G": [1.0, 2.0]}, ["end(c.f)"], t_end=1)["end(c.f)"]
    np.testing.assert_allclose(found, [9.0, 18.0])
    run = m.simulate(1, parameters={"G": 2.0})
    assert [e.kind for e in run.events] or run.events
    assert run["A.displacement"].max() == pytest.approx(0.3, abs=1e-6)
    assert run["c"].f[-1] == pytest.approx(2 * 10 * 0.9)


def test_units_in_a_loop(unit):
    """Outputs that depend on no input of the same instant: two units exchange the values of one instant."""
    a = fb.FMU("a", unit, inputs={"u": "(1 - b.slow)*RPM"}, outputs=["slow"], period=0.1)
    b = fb.FMU("b", unit, inputs={"u": "a.slow*RPM"}, outputs=["slow"], period=0.1)
    run = slide(a, b, force="0*a", RPM=RPM).simulate(1, outputs=np.arange(0, 1, 0.1))
    x = np.zeros(2)
    for k in range(len(run.t)):
        np.testing.assert_allclose((run["a"].slow[k], run["b"].slow[k]), x, atol=1e-12)
        x = x + 0.1 * np.array([1 - x[1], x[0]])
    with pytest.raises(fb.ModelError, match=r"depends on itself: a\.shaft_y -> a\.u"):
        slide(
            fb.FMU("a", unit, inputs={"u": "b.shaft_y"}, period=0.1),
            fb.FMU("b", unit, inputs={"u": "a.shaft_y"}, period=0.1),
        )


def test_copies_and_model_files(unit, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    m = slide(
        fb.FMU("c", "unit.fmu", inputs={"u": "A.rate + 0"}, parameters={"fail.at": 7}, period=0.1),
        force="c.shaft_y + 1",
    )
    m.save(tmp_path / "m.toml")
    assert 'path = "unit.fmu"' in (tmp_path / "m.toml").read_text()
    whole = fb.Mechanism("two", planar=True)
    whole.add(fb.load(tmp_path / "m.toml"), prefix="left")
    run, one = whole.simulate(1), m.simulate(1)
    np.testing.assert_allclose(run["left.c"].shaft_y, one["c"].shaft_y, atol=1e-12)
    assert abs(one["c"].shaft_y).max() > 1e-3


@pytest.mark.parametrize("language", ["fmu", "fmu2"])
def test_back_from_our_own_export(language, tmp_path):
    """An oscillator exported as a unit: x = F/k (1 - cos w t) at the instants; a parameter set, 9 rad/s^2."""
    m = fb.Mechanism("plant", planar=True, parameters={"k": 4.0})
    m.add(fb.Body("cart", mass=2, inertia=1), fb.Prismatic("rail", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(
        fb.CoordinateSpring("spring", "rail.displacement", stiffness="k"), fb.PointForce("push", "cart", force=(0, 0))
    )
    (path,) = m.export(tmp_path, language=language, inputs=["push.x"], outputs=["cart.x"]).files
    unit = fb.FMU("o", path, inputs={"push.x": 2.0}, parameters={"k": 18.0}, outputs={"x": "cart.x"},
                  period="10 ms", tolerance=1e-10)  # fmt: skip
    run = slide(unit, force="o").simulate(2, outputs=np.arange(0, 2, 0.01))
    np.testing.assert_allclose(run["o"].x, 2 / 18 * (1 - np.cos(3 * run.t)), atol=1e-8)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"inputs": {"v": "t"}}, r"FMU 'c': the unit has no variable 'v'.*its inputs are u"),
        ({"inputs": {"U": "t"}}, r"no variable 'U' \(did you mean 'u'\?\)"),
        ({"inputs": {"shaft.y": "t"}}, r"'shaft.y' is no input of the unit: its causality is output; name it in outputs="),
        ({"inputs": {"gain": "t"}}, r"'gain' is no input of the unit: its causality is parameter; give it in parameters="),
        ({"inputs": {"n": "t"}}, r"'n' is of the type Int.*only single real variables"),
        ({"parameters": {"u": 1.0}}, r"'u' has no start value that can be set; it is an input: give it in inputs="),
        ({"parameters": {"slow": 1.0}}, r"'slow' has no start value that can be set; it is computed by the unit"),
        ({"parameters": {"gain": "t"}}, r"parameter 'gain' depends on 't'.*as an input"),
        ({"outputs": ["sluw"]}, r"no variable 'sluw' \(did you mean 'slow'\?\); its outputs are"),
        ({"outputs": {"x": "u"}}, r"output 'x' is the input 'u'"),
        ({"inputs": {"u": "A.displacement"}}, r"u of FMU 'c' is 'A.displacement', in m; it must be in rad/s"),
        ({"inputs": {"u": "5 N"}}, r"5 N"),
        ({"inputs": {"u": "A.displcement"}}, r"displcement"),
        ({"period": None}, r"give period="),
        ({"inputs": {"u": "t"}, "outputs": {"u": "slow", "s": "slow"}}, r"two of its signals or states are called 'u'"),
    ],
)  # fmt: skip
def test_wrong_variables_are_refused(fields, message, libraries, tmp_path):
    more = '<ScalarVariable name="n" valueReference="9" causality="input" variability="discrete"><Integer start="0"/></ScalarVariable>'
    unit = pack(tmp_path / "unit.fmu", 2, libraries[2], description(2, more))
    with pytest.raises(fb.ModelError, match=message):
        slide(fb.FMU("c", unit, **({"period": 0.1} | fields)), force="c.slow")


def test_wrong_files_are_refused(libraries, tmp_path, monkeypatch):
    def refused(path, message):
        with pytest.raises(fb.ModelError, match=message):
            slide(fb.FMU("c", path, period=0.1), force="c.slow")

    refused(tmp_path / "none.fmu", r"FMU 'c': there is no file .*none\.fmu'; give the path of an FMU")
    (tmp_path / "text.fmu").write_text("no zip")
    refused(tmp_path / "text.fmu", r"FMU 'c': .* is no FMU: it is no zip archive")
    (tmp_path / "short.fmu").write_bytes(pack(tmp_path / "u.fmu", 2, libraries[2]).read_bytes()[:5000])
    refused(tmp_path / "short.fmu", r"no zip archive")
    import zipfile

    with zipfile.ZipFile(tmp_path / "empty.fmu", "w") as archive:
        archive.writestr("a.txt", "")
    refused(tmp_path / "empty.fmu", r"has no modelDescription\.xml")
    refused(pack(tmp_path / "xml.fmu", 2, b"", "<fmi"), r"modelDescription\.xml in .* cannot be read")
    refused(
        pack(tmp_path / "other.fmu", 2, b"", folder="win64"), r"no compiled code for this platform, \w+; it has win64"
    )
    one = description(2).replace('fmiVersion="2.0"', 'fmiVersion="1.0"')
    refused(pack(tmp_path / "one.fmu", 2, b"", one), r"is of FMI 1\.0; FMI 2 and 3 are supported")
    refused(
        pack(tmp_path / "me.fmu", 3, libraries[3], description(3, kind="ModelExchange")),
        r"for model exchange only.*export it for co-simulation",
    )
    good = pack(tmp_path / "good.fmu", 2, libraries[2])
    monkeypatch.setitem(sys.modules, "fmpy", None)
    refused(good, r"an FMU needs the package fmpy: pip install 'flyball\[fmu\]'")


def test_faults_during_a_motion(unit, tmp_path, monkeypatch):
    """Each is named with the time, and the instance is freed."""
    log = tmp_path / "log"
    monkeypatch.setenv("UNIT_LOG", str(log))

    def fails(message, **parameters):
        m = slide(fb.FMU("c", unit, inputs={"u": "t"}, parameters=parameters, period=0.1), force="c.slow")
        with pytest.raises((fb.SimulationError, fb.ModelError), match=message):
            m.simulate(1)
        assert log.read_text().count("+") == log.read_text().count("-")

    fails(r"FMU 'c'.*its step from t = 0\.4 s over 0\.1 s fails.*too hot", **{"fail.at": 0.45})
    fails(r"FMU 'c'.*its output 'shaft\.y' is nan at t = 0 s", broken=1.0)
    m = slide(fb.FMU("c", unit, inputs={"u": "t"}, parameters={"fixed": "p"}, period=0.1), force="c.slow", p=1.0)
    m.add(fb.Event("change", when="t > 0.35", do=[fb.Set("p", 2.0)]))
    with pytest.raises((fb.SimulationError, fb.ModelError), match=r"parameter 'fixed' changes during the motion"):
        m.simulate(1)
    assert log.read_text().count("+") == log.read_text().count("-")


def test_a_unit_that_does_not_start(libraries, tmp_path):
    text = description(2).replace('guid="{unit}"', 'guid="{other}"')
    m = slide(fb.FMU("c", pack(tmp_path / "unit.fmu", 2, libraries[2], text), period=0.1), force="c.slow")
    with pytest.raises(
        (fb.SimulationError, fb.ModelError), match=r"FMU 'c'.*it cannot be loaded: Failed to instantiate"
    ):
        m.simulate(0.3)


def test_what_cannot_have_a_unit_names_it(unit):
    m = slide(fb.FMU("c", unit, inputs={"u": "A.rate + 0"}, period=0.1), force="c.slow", G=1.0)
    for analysis in (
        m.linearize,
        m.equilibrium,
        m.modes,
        lambda: m.sensitivity(["A.displacement"], ["G"], analysis="motion", t_end=1),
    ):
        with pytest.raises((fb.ModelError, TypeError), match="FMU 'c'"):
            analysis()
    run = m.simulate(0.5)
    with pytest.raises(fb.ModelError, match=r"FMU 'c': a motion cannot continue an earlier one with it"):
        m.simulate(1, start=run)


def test_only_one_instance_in_a_process(libraries, tmp_path):
    text = description(2, extra='canBeInstantiatedOnlyOncePerProcess="true"')
    unit = pack(tmp_path / "unit.fmu", 2, libraries[2], text)
    one = fb.FMU("a", unit, period=0.1)
    slide(one, force="a.slow").simulate(0.2)
    m = slide(one, fb.FMU("b", unit, period=0.1), force="a.slow")
    with pytest.raises((fb.ModelError, fb.SimulationError), match=r"only one instance"):
        m.simulate(0.2)
