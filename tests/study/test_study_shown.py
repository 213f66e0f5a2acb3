"""Studies on the command line and as pictures."""

from __future__ import annotations

import json

import matplotlib.figure
import numpy as np
import pytest
from typer.testing import CliRunner

import flyball as fb
from flyball.cli import app
from tests.study.rigs import oscillator, pushed


def invoke(*words: str):
    return CliRunner().invoke(app, ["study", "m.toml", *words])


@pytest.fixture
def model(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    oscillator().save("m.toml")


@pytest.mark.usefixtures("model")
def test_a_grid(tmp_path):
    said = invoke("--vary", "k=50:150:3", "--vary", "x0=0.1,20 cm", "--of", "end(b.x)", "--t-end", "1", "--json", "-o", "s.nc",
                  "--csv", "s.csv", "--plot", "s.png", "--histogram", "h.png", "--set", "c=0.5")  # fmt: skip
    assert said.exit_code == 0, said.stderr
    data = json.loads(said.stdout)
    assert data["points"]["k"] == [50, 50, 100, 100, 150, 150]
    assert data["points"]["x0"][:2] == [0.1, 0.2]
    assert data["files"] == ["s.nc", "s.csv", "s.png", "h.png"]
    m = oscillator()
    m.parameters["c"] = 0.5
    expected = m.study({"k": [50, 100, 150], "x0": [0.1, 0.2]}, ["end(b.x)"], t_end=1)
    assert data["values"]["end(b.x)"] == expected.values["end(b.x)"].tolist()
    assert (tmp_path / "s.png").stat().st_size > 5000
    assert (tmp_path / "s.csv").read_text().splitlines()[0] == "run,k,x0,end(b.x)"
    again = invoke("--vary", "k=50:150:3", "--vary", "x0=0.1,20 cm", "--of", "end(b.x)", "--t-end", "1", "-o", "s.nc",
                   "--set", "c=0.5")  # fmt: skip
    assert again.exit_code == 0, again.stderr
    assert "6 done" in again.stdout
    other = invoke("--vary", "k=50:150:4", "--of", "end(b.x)", "--t-end", "1", "--file", "s.nc")
    assert other.exit_code == 2
    assert "another study" in other.stderr


@pytest.mark.usefixtures("model")
def test_samples_and_indices():
    said = invoke("--vary", "k=50:150", "--vary", "mass=normal(2, 0.1)", "--of", "end(b.x)", "--t-end", "0.1", "--design", "saltelli",
                  "--samples", "8")  # fmt: skip
    assert said.exit_code == 0, said.stderr
    assert "32 done" in said.stdout
    assert "first" in said.stdout
    bad = invoke("--vary", "k", "--of", "end(b.x)", "--t-end", "1")
    assert bad.exit_code == 2
    assert "write name=values" in bad.stderr


def pictures(s: fb.Study):
    yield s.plot()
    if any(x.ndim == 1 for x in s.values.values()):
        yield s.histogram()
        yield s.scatter()


@pytest.mark.parametrize(
    ("vary", "of", "more"),
    [
        ({"k": [1.0, 2.0, 3.0]}, ["end(b.x)", "b.x"], {}),
        ({"k": [1.0, 2.0, 3.0], "mass": [1.0, 2.0]}, ["end(b.x)"], {}),
        ({"k": (1.0, 3.0), "mass": (1.0, 2.0)}, ["end(b.x)", "max(b.x)"], {"design": "latin", "samples": 20}),
        ({"k": [1.0, 2.0], "mass": [1.0, 2.0], "c": [0.0, 1.0]}, ["end(b.x)", "b.x"], {}),
        ({"k": (1.0, 3.0)}, ["b.x"], {"design": "random", "samples": 50}),
        ({"k": [1.0, 1e300], "mass": [1.0, -1.0]}, ["end(b.x)", "b.x"], {}),
        ({"mass": [-1.0]}, ["end(b.x)"], {}),
    ],
)
def test_pictures(vary, of, more):
    s = oscillator().study(vary, of, t_end=0.01, outputs=3, **more)
    for figure in pictures(s):
        assert isinstance(figure, matplotlib.figure.Figure)
        figure.canvas.draw()


def test_a_surface_is_the_mean_over_other_parameters():
    s = oscillator().study(
        {"k": [1.0, 2.0, 3.0], "mass": [1.0, 2.0], "x0": [0.1, 0.3]}, ["end(b.x)", "b.x"], t_end=1.0, outputs=3
    )
    ax = s.surface("end(b.x)", "mass", "k").axes[0]
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("mass", "k")
    low, high = ax.collections[0].get_clim()
    mean = s["end(b.x)"].mean(axis=2)
    assert low <= mean.min()
    assert high >= mean.max()
    with pytest.raises(fb.ModelError, match=r"b.x is a curve; give end\(b.x\)"):
        s.surface("b.x", "mass", "k")
    with pytest.raises(fb.ModelError, match="not 'kk'"):
        s.surface("end(b.x)", "mass", "kk")


def test_indices_have_a_picture(tmp_path):
    s = pushed().study({"a": (0, 1), "b": (0, 1)}, ["end(block.x)"], t_end=1.0, design="saltelli", samples=16)
    s.indices().plot(tmp_path / "i.svg")
    assert (tmp_path / "i.svg").stat().st_size > 3000
    assert json.loads(json.dumps(s.indices().as_dict()))["samples"] == 16
    assert len(repr(s.indices()).splitlines()) == 3


def test_what_does_not_vary_has_no_indices():
    s = pushed().study({"idle": (0, 1)}, ["end(block.x)"], t_end=0.1, design="saltelli", samples=8)
    assert np.isnan(s.indices().first_range).all()
    assert s.indices().total.tolist() == [[0.0]]


def curves_of(figure: matplotlib.figure.Figure):
    """The axis of a figure that is over time."""
    return next(ax for ax in figure.axes if ax.get_xlabel() == "time [s]")


def test_few_curves_are_told_apart_by_a_legend():
    s = oscillator().study({"k": [1.0, 200.0], "mass": [1.0, 2.0]}, ["b.x"], t_end=0.01, outputs=3)
    ax = curves_of(s.plot())
    told = [text.get_text() for text in ax.get_legend().get_texts()]
    assert told == ["k = 1, mass = 1", "k = 1, mass = 2", "k = 200, mass = 1", "k = 200, mass = 2"]
    assert len({line.get_color() for line in ax.lines}) == 4
    for line, values in zip(ax.lines, s.values["b.x"], strict=True):
        assert line.get_ydata().tolist() == values.tolist()


def test_more_curves_are_coloured_by_the_parameter_that_tells_most_of_them():
    s = oscillator().study({"mass": [1.0, 1.001], "k": [10.0**i for i in range(6)]}, ["b.x"], t_end=0.2, outputs=9)
    figure = s.plot()
    bar = next(ax for ax in figure.axes if ax.get_label() == "<colorbar>")
    assert bar.get_ylabel() == "k"
    assert bar.get_yscale() == "log"
    lines = curves_of(figure).lines
    assert [tuple(x.get_color()) for x in lines[:6]] == [tuple(x.get_color()) for x in lines[6:]]
    assert len({tuple(x.get_color()) for x in lines}) == 6


def test_axes_are_logarithmic_where_values_are_spread_so():
    scaled = {"size": lambda run: float(run["b.x"][0]) ** 4}
    s = oscillator().study({"x0": [0.01, 0.03, 0.1, 0.3, 1.0]}, scaled, t_end=0.01, outputs=3)
    (ax,) = s.plot().axes
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
    assert s.histogram().axes[0].get_xscale() == "log"
    even = oscillator().study({"x0": [0.01, 0.26, 0.51, 0.76, 1.0]}, {"a": lambda run: 0.0 * run["b.x"][0] - 1.0}, t_end=0.01, outputs=3)  # fmt: skip
    (ax,) = even.plot().axes
    assert (ax.get_xscale(), ax.get_yscale()) == ("linear", "linear")
    both = oscillator().study({"k": [1.0, 10.0, 100.0], "x0": [0.01, 0.1, 1.0]}, scaled, t_end=0.01, outputs=3)
    ax = both.plot().axes[0]
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
    assert both.plot().axes[1].get_yscale() == "log"  # of the colours
