"""The report in a real browser: its numbers are the result's, names stay text, everything is in the one file."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

import flyball as fb
from flyball.results.result import Result
from tests.mechanisms import EXAMPLES
from tests.results.made_up import slider_crank
from tests.view.conftest import Opened
from tests.view.test_animate import still
from tests.view.test_page import Open

BAD = "</script><script>hacked=1</script><b>{{boot}}"


@pytest.fixture(scope="module")
def result() -> Result:
    return slider_crank()


def rows(tab: Opened, name: str) -> list[list[str]]:
    """Cells of a table's body."""
    return tab.locator(f"#table-{name} tbody tr").evaluate_all(
        "rows => rows.map((row) => [...row.cells].map((cell) => cell.textContent))"
    )


def column(tab: Opened, name: str, head: str) -> list[str]:
    heads = tab.locator(f"#table-{name} thead th").all_text_contents()
    return [row[heads.index(head)] for row in rows(tab, name)]


def test_the_figures_at_the_top_are_those_of_the_health(opened: Open, result: Result) -> None:
    tab = opened(result.report())
    assert tab.locator("h1").inner_text() == "slider/crank"
    assert tab.locator(".verdict").inner_text() == "The run reached its end."
    values = tab.locator(".cards dd[data-value]").evaluate_all("all => all.map((dd) => Number(dd.dataset.value))")
    h = result.health
    wanted = [h.freedoms, len(h.redundant), h.energy_drift, h.violation, h.velocity_violation, h.steps]
    np.testing.assert_array_equal(values, wanted)  # not a number where it was not measured, too
    shown = dict(row[:2] for row in rows(tab, "run"))
    for term, text in h.lines():
        assert shown[term] == text
    assert tab.errors == []
    assert tab.foreign == []


def test_tables_hold_the_model(opened: Open, result: Result) -> None:
    tab = opened(result.report())
    assert column(tab, "parameters", "name") == ["speed", "k"]
    assert [float(x) for x in column(tab, "parameters", "value [SI]")] == pytest.approx([2 * np.pi, 100], rel=1e-3)
    assert column(tab, "bodies", "body") == ["crank", "rod", "slider"]
    assert [float(x) for x in column(tab, "bodies", "mass [kg]")] == [1, 1, 1]
    assert tab.locator("#table-bodies tfoot td").all_text_contents()[:2] == ["all", "3"]
    assert column(tab, "joints", "kind") == ["Revolute"] * 3 + ["Translational"]
    largest = [float(x) for x in column(tab, "joints", "largest |force| [N]")]
    assert largest == pytest.approx([np.linalg.norm(result[k].force, axis=1).max() for k in "ABCD"], rel=1e-3)
    assert column(tab, "joints", "not determined") == ["", "", "", "force y, torque"]
    assert column(tab, "forces", "between") == ["slider – ground", "eye – ground", "on slider"]
    assert "stiffness = k" in column(tab, "forces", "as written")[0]
    assert column(tab, "drivers", "law") == ["speed*t"]


def test_plots_follow_the_time_and_lead_it(opened: Open, result: Result) -> None:
    tab = opened(result.report(), "t=0.25")
    i = int(np.argmin(np.abs(result.t - 0.25)))
    for figure, name, value in (
        ("coordinates", "A.angle", result["A"].angle[i]),
        ("reactions", "B", np.linalg.norm(result["B"].force[i])),
        ("energy", "kinetic", result.energy.kinetic[i]),
    ):
        curve = tab.locator(f"[data-figure={figure}] .curve").filter(has=tab.get_by_text(name, exact=True))
        assert curve.locator(".value").inner_text().replace("−", "-") == f"{value:.4g}"
    area = tab.locator("[data-figure=coordinates] .u-over").first
    area.scroll_into_view_if_needed()
    box = area.bounding_box()
    tab.mouse.click(box["x"] + 0.75 * box["width"], box["y"] + 20)
    assert tab.time == pytest.approx(0.75, abs=0.01)


def test_the_model_file_can_be_read_and_copied(opened: Open, result: Result) -> None:
    tab = opened(result.report())
    tab.context.grant_permissions(["clipboard-read", "clipboard-write"])
    tab.locator("#file summary").click()
    tab.locator("[data-copy]").click()
    tab.wait_until(lambda: tab.locator("[data-copy]").inner_text() == "Copied")
    text = tab.locator("#toml").text_content()
    assert tab.evaluate("navigator.clipboard.readText()").rstrip() == text.rstrip()
    from flyball.model.model_files import loads

    assert loads(text, fb.Mechanism) == result.model
    assert tomllib.loads(text)["name"] == "slider/crank"


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_light_and_dark(opened: Open, result: Result, scheme: str) -> None:
    tab = opened(
        result.report(show=("reactions", "elements", "loads", "moments", "names")), "t=0.3", color_scheme=scheme
    )
    assert tab.evaluate("document.documentElement.dataset.theme") == scheme
    paper = tab.evaluate("getComputedStyle(document.body).backgroundColor")
    assert (paper == "rgb(255, 255, 255)") == (scheme == "light")
    assert len(tab.screenshot(full_page=True)) > 50_000
    assert tab.evaluate("flyball.webgl()")
    assert tab.errors == []


@pytest.mark.parametrize("width", [320, 390])
def test_on_a_phone_the_tools_lie_beside_one_another(opened: Open, width: int) -> None:
    tab = opened(fb.load(EXAMPLES / "governor.toml").simulate(0.1, outputs=11).report())
    tab.set_viewport_size({"width": width, "height": 844})
    tab.settle()
    views, legend = (tab.locator(k).first.bounding_box() for k in (".views", ".legend > button"))
    assert views["y"] + views["height"] <= legend["y"]
    assert tab.errors == []


def test_the_page_scrolls_and_keys_are_the_picture_s_only_when_it_is_meant(opened: Open, result: Result) -> None:
    tab = opened(result.report(), "t=0.3&show=")
    tab.mouse.move(5, 5)
    tab.keyboard.press("g")
    assert tab.evaluate("flyball.shown()") == []
    tab.locator(".stage").hover()
    tab.keyboard.press("g")
    assert tab.evaluate("flyball.shown()") == ["grid"]
    before = tab.evaluate("scrollY")
    tab.mouse.wheel(0, 200)
    tab.wait_until(lambda: tab.evaluate("scrollY") > before)


def test_names_of_the_user_stay_text(opened: Open) -> None:
    m = fb.Mechanism(BAD, parameters={"p": 1})
    m.add(
        fb.Body(BAD, mass="p", inertia=(1, 1, 1)), fb.Revolute(BAD + "2", "ground", BAD, at=(1, 0, 0), axis=(0, 0, 1))
    )
    m.add(fb.PointForce(BAD + "3", BAD, force=("1", 0, 0)))
    r = still(m)
    r.health.message = BAD
    r.health.success = False
    tab = opened(r.report(paths=[BAD]))
    assert tab.evaluate("window.hacked") is None
    assert tab.title() == BAD
    assert tab.locator("h1").text_content() == BAD
    assert tab.locator(".verdict").text_content() == f"The run stopped: {BAD}"
    assert rows(tab, "bodies")[0][0] == BAD
    assert rows(tab, "joints")[0][0] == BAD + "2"
    assert rows(tab, "forces")[0][0] == BAD + "3"
    assert BAD in tab.locator("#toml").text_content()
    assert tab.locator("b").count() == 0
    assert tab.errors == []


def test_the_governor_s_report_is_one_small_file(opened: Open) -> None:
    r = fb.load(EXAMPLES / "governor.toml").simulate(0.5, outputs=501)
    text = r.report()
    assert len(text.encode()) < 1_000_000
    assert len(r.html().encode()) < 1_000_000
    tab = opened(text, "t=0.2&show=reactions")
    arrows = {a["name"]: a["vector"] for a in tab.evaluate("flyball.arrows()")}
    assert set(arrows) == {"bearing", "left hinge", "right hinge"}  # the guide carries next to nothing
    np.testing.assert_allclose(arrows["bearing"], r["bearing"].force[200], rtol=1e-5, atol=1e-4)
    assert float(tab.locator("#table-bodies tfoot td").nth(1).inner_text()) == pytest.approx(13.9)
    assert tab.errors == []
    assert tab.foreign == []
