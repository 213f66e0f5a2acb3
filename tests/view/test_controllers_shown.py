"""Controllers' signals are in the report, in the standard pictures and on the page; without a unit there are no brackets."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import pytest

import flyball as fb
from flyball.results.result import Result
from flyball.view.animation import record_motion
from flyball.view.figures import standard_figures
from flyball.view.result_plots import standard_pictures
from tests.control.slide import slide


@pytest.fixture(scope="module")
def result() -> Result:
    pid = fb.PID("pid", setpoint="0.2 + 0*t", measured="A.displacement", kp=80, ki=60, kd=12, filter=0.02, period=0.01)
    two = fb.StateSpace("K", inputs=["t"], D=[[1e-3], [1e3]], outputs=["small", "large"])
    return slide(pid, two).simulate(0.5, outputs=51)


def test_what_is_to_be_followed_stands_beside_what_follows(result: Result) -> None:
    found = {f.name: f for f in standard_figures(result)}["controllers"]
    names = [[c.name for c in p.curves] for p in found.panels]
    assert ["pid.setpoint", "pid.measured"] in names
    outputs = [n for n in names if "pid.setpoint" not in n]
    assert {k for n in outputs for k in n} == {"pid.output", "K.small", "K.large"}
    assert not any({"K.small", "K.large"} <= set(n) for n in outputs)  # a millionth would be a straight line
    curve = next(c for p in found.panels for c in p.curves if c.name == "pid.output")
    assert curve.values.tolist() == result["pid.output"].tolist()
    assert "controllers" in [p.name for p in standard_pictures(result)]
    assert 'id="plot-controllers"' in result.report()


def test_the_page_opens_with_them(result: Result) -> None:
    shown = record_motion(result).plotted
    assert shown[:4] == ("pid.setpoint", "pid.measured", "pid.output", "K.small")
    assert "A.displacement" not in shown  # which is pid.measured
    assert "energy.total" in shown


def test_a_large_mechanism_offers_them() -> None:
    m = slide(fb.PID("pid", setpoint=1, measured="A.displacement", kp=1))
    m.add(*(fb.Body(f"b{k}", mass=1, inertia=1, position=(0.0, k + 1.0)) for k in range(60)))
    names = [c.name for c in record_motion(m.simulate(0.01, outputs=2)).channels]
    assert {"pid.setpoint", "pid.measured", "pid.output"} <= set(names)
    assert "pid.error" not in names


def test_no_unit_no_brackets(result: Result, tmp_path: Path) -> None:
    for ax in result.plot("pid.output", "A.displacement", "A.rate").axes:
        assert "[]" not in ax.get_ylabel()
    result.to_csv(tmp_path / "a.csv")
    with open(tmp_path / "a.csv", encoding="utf-8") as file:
        head = next(csv.reader(file))
    assert "pid.output" in head
    assert "A.displacement [m]" in head
    assert not any("[]" in name for name in head)
    m = slide(fb.Lag("lag", of="ref", time=1), force="lag", ref=1.0)
    linear = m.linearize(["ref"], ["lag.output", "A.displacement"], about=m.equilibrium())
    said = [text for _, text in linear.lines()]
    assert any(text.startswith("A.displacement [m]") for text in said)
    assert not any("[]" in text for text in said)
    for output in (None, "lag.output"):
        drawn = linear.bode("ref", output)
        assert not any(
            "[]" in x.get_text() or "dB of ]" in x.get_text() for x in drawn.findobj(lambda a: hasattr(a, "get_text"))
        )


def test_columns_of_the_report_end_together(result: Result) -> None:
    text = result.report()
    columns = [re.findall(r'<article id="plot-(\w+)"', part) for part in text.split('<div class="column">')[1:]]
    chosen = standard_figures(result)
    assert len(columns) == 2
    assert sorted(k for column in columns for k in column) == sorted(f.name for f in chosen)
    assert columns[0][0] == "energy"
    panels = {f.name: len(f.panels) for f in chosen}
    left, right = (sum(panels[k] + 0.3 for k in column) for column in columns)
    assert abs(left - right) <= min(panels[k] + 0.3 for k in max(columns, key=lambda c: sum(panels[k] for k in c)))
