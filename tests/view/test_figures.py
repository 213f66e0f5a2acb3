"""Which curves share an axis, how coincident ones are told apart, and what the axes say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flyball as fb
from flyball.results.result import Result
from flyball.view.figures import (
    MAX_PANEL_CURVES,
    hidden_counts,
    panel_label,
    panels_by_unit,
    split_panel,
    standard_figures,
)
from flyball.view.plotting import finish_figure, panels_over_time
from flyball.view.recording import Channel, Panel
from flyball.view.result_plots import plot_curves, write_standard_plots
from tests.results.made_up import slider_crank
from tests.view.test_animate import still

T = np.linspace(0, 1, 50)


@pytest.fixture(scope="module")
def result() -> Result:
    return slider_crank()


def test_a_curve_on_top_of_others_knows_how_many_it_hides() -> None:
    wave = np.sin(9 * T)
    gapped = np.where(T > 0.5, np.nan, wave)
    assert hidden_counts([wave, wave + 1e-4, -wave, wave, gapped]) == [0, 1, 0, 2, 3]
    assert hidden_counts([np.full(50, 2.0), np.full(50, 2.0)]) == [0, 1]
    assert hidden_counts([np.zeros(50), np.full(50, 1e-12)]) == [0, 0]  # all that there is to see is their difference
    assert hidden_counts([np.full(50, np.nan)]) == [0]


def test_hidden_curves_are_dashed(result: Result) -> None:
    m = fb.Mechanism("twins", planar=True)
    for k in range(3):
        m.add(fb.Body(f"b{k}", mass=1, inertia=1, position=(0, float(k == 2))))
    (ax,) = plot_curves(still(m), "b0.y", "b1.y", "b2.y").axes
    assert [line.get_linestyle() for line in ax.lines] == ["-", "--", "-"]


def test_curves_that_would_be_straight_lines_get_a_panel_of_their_own() -> None:
    big, small, level = (
        Channel(k, "rad", v) for k, v in (("big", 50 * T), ("small", np.sin(9 * T)), ("level", 0 * T + 3))
    )
    parts = split_panel(Panel("angle", (big, small, level)))
    assert [[c.name for c in p.curves] for p in parts] == [["big", "level"], ["small"]]
    nearly = Channel("nearly constant", "J", 100 + 1e-3 * T)
    parts = split_panel(Panel("energy", (Channel("kinetic", "J", 100 * T), nearly)))
    assert len(parts) == 1


def test_axes_say_what_they_show() -> None:
    def channels(*names: str, unit: str = "m") -> list[Channel]:
        return [Channel(k, unit, T) for k in names]

    assert panel_label(channels("a.displacement", "b.displacement")) == "displacement"
    assert panel_label(channels("a.x", "b.x")) == "length"
    assert panel_label(channels("a.force", "b.effort", unit="N")) == "force"
    assert panel_label(channels("s", unit="furlong")) == ""


def test_panels_are_not_overcrowded() -> None:
    (panel,) = panels_by_unit([Channel(f"c{k}", "m", T) for k in range(30)])
    assert len(panel.curves) == MAX_PANEL_CURVES
    assert panel.note == f"{MAX_PANEL_CURVES} of 30 curves"


def test_the_figures_hold_the_result_s_numbers(result: Result) -> None:
    drawn = {f.name: f for f in standard_figures(result)}
    assert list(drawn) == ["energy", "coordinates", "reactions", "actuation"]
    curves = {c.name: c.values for f in drawn.values() for p in f.panels for c in p.curves}
    assert np.array_equal(curves["balance"], result.energy.balance)
    assert np.array_equal(curves["A.angle"], result["A"].angle)
    assert np.allclose(curves["A"], np.linalg.norm(result["A"].force, axis=1))
    assert np.array_equal(curves["motor.effort"], result["motor"].effort)
    assert f"{result.energy.drift:.2g} J" in drawn["energy"].panels[-1].note
    assert "D*" in [c.name for c in drawn["reactions"].panels[0].curves]  # undetermined, says the health
    assert "* redundancy leaves some components undetermined" in drawn["reactions"].note


def test_spatial_motions_have_positions_over_time_and_paths_from_three_sides(tmp_path: Path) -> None:
    m = fb.Mechanism("two", gravity=(0, 0, -10))
    m.add(fb.Body("a", mass=1, inertia=(1, 1, 1)), fb.Body("b", mass=1, inertia=(1, 1, 1), position=(1, 2, 3)))
    r = still(m)
    assert [f.name for f in standard_figures(r)] == ["energy", "positions"]
    z = next(f for f in standard_figures(r) if f.name == "positions").panels[2]
    assert (z.label, z.curves[1].name, z.curves[1].values.tolist()) == ("z", "b", [3.0, 3.0])
    assert [p.name for p in write_standard_plots(r, tmp_path)] == ["energy.png", "positions.png", "paths.png"]


def test_legends_lie_beside_the_curves(result: Result) -> None:
    figure = plot_curves(result, "A", "slider")
    figure.canvas.draw()
    for ax in figure.axes:
        box, legend = ax.get_window_extent(), ax.get_legend().get_window_extent()
        assert legend.x0 >= box.x1 - 1
        assert legend.x1 <= figure.bbox.x1 + 1


@pytest.mark.parametrize(("size", "text"), [(1e-6, "×10⁻⁶"), (3e12, "×10¹²"), (2.0, "")])
def test_a_common_power_of_ten_is_told_at_the_axis(size: float, text: str) -> None:
    drawing = panels_over_time(T, (Panel("x", (Channel("a", "m", size * np.linspace(-1.0, 1.0, len(T))),)),))
    finish_figure(drawing, None)
    drawing.canvas.draw()
    assert drawing.axes[0].yaxis.get_offset_text().get_text() == text
