"""The page of compared motions: ghosts where the other motions are, curves, measured values, tables, refusals."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flyball as fb
from tests.results.test_differences import cart
from tests.view.conftest import Opened


@pytest.fixture(scope="module")
def motions() -> tuple[fb.Result, fb.Result]:
    return cart().simulate(1.5, outputs=151), cart().simulate(1.5, outputs=101, parameters={"omega": 2.2})


@pytest.fixture
def page(browser: Any, tmp_path: Path) -> Callable[..., Opened]:
    def open_page(run: fb.Result, **options: Any) -> Opened:
        run.to_html(tmp_path / "page.html", **options)
        return Opened(browser, f"{(tmp_path / 'page.html').as_uri()}#t=0.75")

    return open_page


def test_a_ghost_is_where_its_motion_is_and_can_be_hidden(page, motions):
    first, other = motions
    tab = page(first, others={"fast": other}, label="slow")
    (ghost,) = tab.evaluate("flyball.ghosts()")
    at = next(p for p in ghost["pose"])
    assert ghost["label"] == "fast"
    assert at[0] == pytest.approx(np.sin(2.2 * 0.75), abs=1e-4)
    assert [x.strip() for x in tab.locator(".compared li").all_inner_texts()] == ["slow", "fast"]
    assert tab.locator(".plot").count() == tab.evaluate("document.querySelectorAll('.value.beside').length")
    tab.locator(".compared li", has_text="fast").click()
    assert tab.evaluate("flyball.ghosts()[0].hidden")
    assert tab.locator(".value.beside").count() == 0
    assert tab.errors == []
    assert tab.foreign == []


def test_tables_have_the_rows_of_the_plotted_curves(page, motions):
    first, other = motions
    tab = page(first, others={"fast": other}, label="slow")
    told = tab.locator(".differences").inner_text()
    assert "omega\t2\t2.2" in told
    assert "interpolated between output times" in told
    shown = tab.locator(".differences tr:visible").all_inner_texts()
    assert any(row.startswith("slide.displacement") for row in shown)
    assert not any(row.startswith("cart.vx") for row in shown)
    tab.locator(".pick").click()
    tab.locator(".choice", has_text="cart.vx").click()
    shown = tab.locator(".differences tr:visible").all_inner_texts()
    assert any(row.startswith("cart.vx") for row in shown)


INK = """() => {
    const canvas = document.querySelector(".plot canvas");
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let dark = 0;
    for (let k = 0; k < data.length; k += 4) dark += data[k + 3] > 200 && Math.max(data[k], data[k + 1], data[k + 2]) < 80;
    return dark;
}"""


def test_measured_values_are_dots_and_figures(page, motions):
    t = np.linspace(0.0, 1.5, 16)
    off = np.where(np.arange(16) == 5, 0.6, 0.5)
    x = np.sin(2.0 * t)
    tab = page(motions[0], measured={"t": t, "cart.x [mm]": 1e3 * (x + off)})
    tab.settle()
    row = tab.locator(".differences tbody tr").inner_text().split("\t")
    r_squared = 1 - (off**2).mean() / (x + off).var()
    assert row == ["cart.x", f"{np.sqrt((off**2).mean()):.4g} m", "0.6 m", "0.5", f"{r_squared:.5g}".replace("-", "−")]
    assert tab.locator(".compared").inner_text().strip() == "measured: arrays"
    assert tab.evaluate(INK) > 16 * 8
    assert tab.errors == []
    plain = page(motions[0])
    plain.settle()
    assert plain.evaluate(INK) == 0


def test_a_report_compares_too(motions, tmp_path):
    first, other = motions
    first.to_report(tmp_path / "report.html", others={"fast": other})
    assert (tmp_path / "report.html").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"label": "slow"}, "label='slow' is for a page with others"),
        ({"others": {"cart": None}}, "'cart' of another motion must be a text that differs from 'cart'"),
        ({"others": {"": None}}, "must be a text"),
        ({"others": dict.fromkeys("abcdefg")}, "7 other motions are too many for one page; give at most 6"),
    ],
)
def test_labels_that_do_not_tell_motions_apart_are_refused(motions, options, message):
    with pytest.raises(fb.ModelError, match=message):
        motions[0].html(**options)
