"""Marks of events on time axes: of plots and of the page's bar."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import flyball as fb
from flyball.results.events import EventRecord
from flyball.view.animation import record_motion
from flyball.view.event_marks import LETTER_WIDTH, MAX_MARK_LINES, event_marks, place_names


@pytest.fixture(scope="module")
def run():
    m = fb.Mechanism("slide", planar=True)
    m.add(fb.Body("block", mass=2.0, inertia=1.0), fb.Prismatic("A", "ground", "block", at=(0, 0), axis=(1, 0)))
    m.add(fb.Initial("A.displacement", rate=3.0))
    return m.simulate(1.0, outputs=11)


def few():
    return [EventRecord(0.2, "hit", "impact"), EventRecord(0.2, "open", "event"), EventRecord(0.6, "hit", "impact")]


def test_what_is_close_together_is_one_mark(run):
    run.events = [*few(), EventRecord(0.601, "hit", "impact")]
    assert [(m.t, m.text, m.line) for m in event_marks(run)] == [(0.2, "open, hit", True), (0.6, "hit ×2", True)]
    assert [m.label for m in event_marks(run)] == ["open, hit ×3", ""]  # each name once, with how often in all
    run.events = ()
    assert event_marks(run) == ()


def test_of_very_many_only_seldom_ones_are_lines(run):
    run.events = sorted([*few(), *(EventRecord(t, "tick", "event") for t in np.linspace(0, 1, 400))], key=lambda h: h.t)
    every = event_marks(run)
    assert len(every) < 260
    assert [m.text.split(",")[0] for m in every if m.line] == ["open", "hit"]


def test_plots_have_lines_and_names(run):
    run.events = few()
    first, second = run.plot("A.displacement", "A.rate").axes
    for ax in (first, second):
        lines = [c.get_segments() for c in ax.collections]
        assert [s[0][0] for s in lines[0]] == [0.2, 0.6]
        assert ax.get_xlim() == (0.0, 1.0)
    written = [t for t in first.texts if t.get_text()]
    assert [t.get_text() for t in written] == ["open, hit ×2"]
    first.figure.draw_without_rendering()
    assert written[0].get_window_extent().y0 > first.get_window_extent().y1  # above the curves
    assert not second.texts
    run.events = [EventRecord(t, "tick", "event") for t in np.linspace(0, 1, MAX_MARK_LINES + 10)]
    ax = run.plot("A.rate").axes[0]
    assert not ax.texts
    heights = [s[0][1] for c in ax.collections for s in c.get_segments()]
    assert min(heights) > 0.9  # ticks at the upper edge


def clock():
    """Names of two events that alternate, one that happens once between them, and stops that happen most often."""
    ticks = [EventRecord(t, "tick" if k % 2 else "tock", "event") for k, t in enumerate(np.linspace(0.05, 0.95, 10))]
    stops = [EventRecord(t, "stop", "impact") for t in np.linspace(0.02, 0.98, 17)]
    return sorted([*ticks, *stops, EventRecord(0.31, "too fast", "event")], key=lambda h: h.t)


def test_every_name_is_written_where_there_is_room(run):
    run.events = clock()
    found = [m for m in event_marks(run) if m.label]
    assert {m.label for m in found} == {"tick ×5", "tock ×5", "too fast", "stop ×17"}
    assert min(found, key=lambda m: m.rank).label == "too fast"  # the most seldom first
    width = 400.0
    names = place_names(found, [width * m.t for m in found], width)
    assert len(names) == 4
    for a, b in itertools.permutations(names, 2):  # no line goes up through a name, no two names overlap
        ends = sorted((width * a.mark.t, width * a.mark.t + (1 if a.right else -1) * LETTER_WIDTH * len(a.mark.label)))
        if b.lane >= a.lane:
            assert not ends[0] < width * b.mark.t < ends[1]
    narrow = place_names(found, [10.0 * m.t + 60.0 for m in found], 130.0)
    assert "too fast" in {n.mark.label for n in narrow}


def test_marks_on_the_page_s_plots(run, browser, tmp_path):
    """A mark on a gridline is seen, in a colour that is neither the grid's nor the cursor's, and named when pointed at."""
    from tests.view.conftest import Opened

    run.events = [EventRecord(0.5, "half way", "event")]
    run.to_html(tmp_path / "page.html")
    page = Opened(browser, (tmp_path / "page.html").as_uri() + "#t=0&theme=light")
    area = page.tab.locator(".plot .u-over").first
    box = area.bounding_box()
    column = page.evaluate(
        """() => {
          const { chart } = { chart: document.querySelector(".plot canvas") };
          const over = document.querySelector(".plot .u-over");
          const scale = chart.width / chart.clientWidth;
          const x = Math.round((over.offsetLeft + 0.5 * over.clientWidth) * scale);
          const data = chart.getContext("2d").getImageData(x - 2, over.offsetTop * scale, 5, over.clientHeight * scale).data;
          const violet = [];
          for (let k = 0; k < data.length; k += 4) {
            const [r, g, b, a] = data.slice(k, k + 4);
            if (a > 100 && r - g > 60 && b - g > 40) violet.push(k);
          }
          return violet.length / over.clientHeight;
        }"""
    )
    assert column > 0.4  # dashed
    page.tab.mouse.move(box["x"] + 0.5 * box["width"] + 2, box["y"] + 20)
    tip = page.tab.locator(".plot .mark-tip").first
    assert tip.is_visible()
    assert tip.inner_text() == "half way, 0.5 s"
    page.tab.mouse.move(box["x"] + 0.8 * box["width"], box["y"] + 20)
    assert not tip.is_visible()
    assert page.errors == []
    page.tab.close()


def test_the_bar_of_the_page_tells_and_goes_there(run, browser, tmp_path):
    from tests.view.conftest import Opened

    run.events = few()
    assert [m.t for m in record_motion(run).marks] == [0.2, 0.6]
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
