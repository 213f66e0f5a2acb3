"""A motion against measured curves: figures by hand, units, gaps, times; and what bad tables are told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flyball as fb


@pytest.fixture(scope="module")
def fall() -> fb.Result:
    """A body that moves at 2 m/s and 1 rad/s, for 1 s."""
    m = fb.Mechanism("fall", planar=True, gravity=(0, 0))
    m.add(fb.Body("a", mass=1, inertia=1))
    m.add(fb.Initial("a.x", rate=2), fb.Initial("a.angle", rate=1), fb.Sensor("way", "a.x"))
    return m.simulate(1, outputs=11)


def test_figures_are_those_of_the_residuals(fall, tmp_path):
    path = tmp_path / "test.csv"
    path.write_text("t [ms], a.x [mm], a.angle [deg]\n0,1,0\n250,500,\n550,1090,31.5\n1000,2003,57.2957795\n1500,9,9\n")
    c = fall.compare(path)
    r = np.array([0.001, 0.0, -0.01, 0.003])
    assert c.rms["a.x"] == pytest.approx(np.sqrt((r**2).mean()), rel=1e-6)
    assert c.largest["a.x"] == pytest.approx((-0.01, 0.55), rel=1e-6)
    x = np.array([0.001, 0.5, 1.09, 2.003])
    assert c.r_squared["a.x"] == pytest.approx(1 - (r @ r) / ((x - x.mean()) ** 2).sum(), rel=1e-9)
    assert c.counts == {"a.x": 4, "a.angle": 3}
    assert c.largest["a.angle"] == pytest.approx((np.radians(31.5) - 0.55, 0.55), rel=1e-6)
    told = dict(c.lines())
    assert told["left out"] == "1 time outside the motion, 0 to 1 s"
    assert (
        told["a.x"]
        == f"RMS {c.rms['a.x']:.4g} m, largest deviation -0.01 m at 0.55 s, R^2 {c.r_squared['a.x']:.6g}, 4 values"
    )


def test_the_motion_itself_has_no_deviation(fall):
    c = fall.compare({"t": fall.t, "way": fall["way"].value, "a.x": fall["a.x"]})
    assert c.rms == {"way": 0.0, "a.x": 0.0}
    assert c.r_squared == {"way": 1.0, "a.x": 1.0}


def test_jumps_are_compared_on_their_own_side():
    """A ball between two output times bounces: the interpolation does not go across the impact."""
    m = fb.Mechanism("bounce", planar=True, gravity=(0, 0))
    m.add(fb.Body("a", mass=1, inertia=1), fb.Prismatic("P", "ground", "a", at=(0, 0), axis=(1, 0)))
    m.add(fb.Initial("P.displacement", rate=1), fb.Limit("wall", "P.displacement", upper=0.55, restitution=1.0))
    run = m.simulate(1, outputs=11)
    c = run.compare({"t": [0.54, 0.56], "a.x": [0.54, 0.54], "a.vx": [1.0, -1.0]})
    np.testing.assert_allclose(c.residuals, 0.0, atol=1e-6)


def test_measured_values_are_dots_over_the_curve(fall):
    drawing = fall.compare({"t": [0.1, 0.5], "a.x": [0.2, 5.0]}).plot()
    line, dots = drawing.axes[0].lines[:2]
    assert dots.get_marker() == "o"
    assert dots.get_color() == line.get_color()
    assert drawing.axes[0].get_ylim()[1] > 5.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty; the first line has the headings"),
        (
            "t,a.x\n0,1\n1,fast\n",
            r"bad.csv, line 3, column 'a.x': 'fast' is no number; .* give units in brackets in the heading",
        ),
        ("t,a.x\n0,1\n\n1\n", r"bad.csv, line 4: 1 entries for 2 headings \(t, a.x\)"),
        ("t;a.x\n0;1\n", "bad.csv, line 2, column 't;a.x': '0;1' is no number; separate entries by commas"),
        ("T,a.x\n0,1\n", "bad.csv: the data need times, 't' or 'time'.*the columns are 'T', 'a.x'"),
        ("t,a.x,a.x\n0,1,1\n", "bad.csv, line 1, column 3: the heading 'a.x' occurs twice"),
        ("t,,a.x\n0,1,1\n", "bad.csv, line 1, column 2: there is no heading"),
        ("t,a.x,a.x [mm]\n0,1,1\n1,1,1\n", "two columns are named 'a.x'"),
        ("t,a.q\n0,1\n1,1\n", "bad.csv, column 'a.q': .*no curve 'q'"),
        ("t,a.x [kg]\n0,1\n1,1\n", r"bad.csv, column 'a.x \[kg\]': .*expected a length"),
        ("t,a.x\n0,1\n2,1\n1,1\n", "bad.csv, line 4, column 't': 1 s does not follow 2 s"),
        ("t,a.x\n0,1\n,1\n", "bad.csv, line 3, column 't': every row needs a finite time"),
        ("t,a.x\n0,1\n", "two or more finite times"),
        ("t,a.x\n0,\n1,nan\n", "'a.x' has no finite value"),
        ("t,a.x\n2,1\n3,1\n", "no value of 'a.x' can be compared: the motion has 0 to 1 s, the data 2 to 3 s"),
    ],
)
def test_bad_tables_are_told_where(fall, tmp_path: Path, text: str, message: str):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(fb.ModelError, match=message):
        fall.compare(path)


def test_no_such_file(fall):
    with pytest.raises(fb.ModelError, match=r"cannot read 'nothing.csv': No such file"):
        fall.compare("nothing.csv")
