"""Marks of events on time axes: of plots and of the page's bar."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.results.events import Happening
from flyball.view.animate import record
from flyball.view.marks import LINES, marks


@pytest.fixture(scope="module")
def run():
    m = fb.Mechanism("slide", planar=True)
    m.add(fb.Body("block", mass=2.0, inertia=1.0), fb.Prismatic("A", "ground", "block", at=(0, 0), axis=(1, 0)))
    m.add(fb.Initial("A.displacement", rate=3.0))
    return m.simulate(1.0, outputs=11)


def few():
    return [Happening(0.2, "hit", "impact"), Happening(0.2, "open", "event"), Happening(0.6, "hit", "impact")]


def test_what_is_close_together_is_one_mark(run):
    run.events = [*few(), Happening(0.601, "hit", "impact")]
    assert [(m.t, m.text, m.line) for m in marks(run)] == [(0.2, "open, hit", True), (0.6, "hit (2 times)", True)]
    run.events = ()
    assert marks(run) == ()


def test_of_very_many_only_seldom_ones_are_lines(run):
    run.events = sorted([*few(), *(Happening(t, "tick", "event") for t in np.linspace(0, 1, 400))], key=lambda h: h.t)
    every = marks(run)
    assert len(every) < 260
    assert [m.text.split(",")[0] for m in every if m.line] == ["open", "hit"]


def test_plots_have_lines_and_names(run):
    run.events = few()
    first, second = run.plot("A.displacement", "A.rate").axes
    for ax in (first, second):
        lines = [c.get_segments() for c in ax.collections]
        assert [s[0][0] for s in lines[0]] == [0.2, 0.6]
        assert ax.get_xlim() == (0.0, 1.0)
    assert [t.get_text() for t in first.texts] == ["open, hit", "hit"]
    assert not second.texts
    run.events = [Happening(t, "tick", "event") for t in np.linspace(0, 1, LINES + 10)]
    ax = run.plot("A.rate").axes[0]
    assert not ax.texts
    heights = [s[0][1] for c in ax.collections for s in c.get_segments()]
    assert min(heights) > 0.9  # ticks at the upper edge


def test_the_bar_of_the_page_tells_and_goes_there(run, browser, tmp_path):
    from tests.view.conftest import Opened

    run.events = few()
    assert [m.t for m in record(run).marks] == [0.2, 0.6]
    run.to_html(tmp_path / "page.html")
    page = Opened(browser, (tmp_path / "page.html").as_uri() + "#t=0")
    ticks = page.tab.locator(".bar .event")
    assert ticks.count() == 2
    assert ticks.nth(0).get_attribute("title") == "open, hit, 0.2 s"
    ticks.nth(1).click()
    assert page.time == pytest.approx(0.6)
    bar, tick = page.tab.locator(".bar .track").bounding_box(), ticks.nth(1).bounding_box()
    assert tick["x"] + tick["width"] / 2 == pytest.approx(bar["x"] + 7.5 + 0.6 * (bar["width"] - 15), abs=1.0)
    assert page.errors == []
    page.tab.close()
