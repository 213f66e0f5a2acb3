"""The session of a live page: its numbers are the engine's, only the newest value is run, faults become messages."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flyball as fb
from flyball.live import session
from flyball.live.options import make_sliders
from flyball.live.session import MAX_INVALID_MESSAGES, ClosedPage, exchange_messages, slow_remark
from tests.live.pages import FOUR_BAR, Page, options, read
from tests.mechanisms import example


def falling(gravity: float = -9.81) -> fb.Mechanism:
    m = fb.Mechanism("falling", planar=True, gravity=(0, gravity), parameters={"mass": "2 kg", "push": 0.0})
    m.add(fb.Body("stone", mass="mass", inertia=0.1, position=(0, 0)))
    m.add(fb.PointForce("wind", "stone", force=("push", 0)))
    return m


# ---- sliders


def test_ranges_are_given_or_chosen_in_the_unit_as_written():
    m = fb.Mechanism("m", parameters={"speed": "60 rpm", "zero": 0.0, "back": -2.0, "twice": "2*back", "arm": "0.2 m"})
    s = make_sliders(m, {"speed": ("3.141592653589793 rad/s", "90 rpm"), "arm": (0.1, "300 mm")})
    assert "twice" not in s
    assert [(x.low, x.high, x.chosen) for x in s.values()] == [
        (pytest.approx(30.0), pytest.approx(90.0), False),
        (-1.0, 1.0, True),
        (-4.0, -1.0, True),
        (0.1, pytest.approx(0.3), False),
    ]
    assert s["speed"].quantity == "60.0 rpm"


@pytest.mark.parametrize(
    ("ranges", "told"),
    [
        ({"sped": (1, 2)}, "no parameter 'sped'.*did you mean 'speed'"),
        ({"twice": (1, 2)}, "follows from others"),
        ({"speed": (2, 1)}, "the first must be less than the second"),
        ({"speed": (1, float("inf"))}, "both finite"),
        ({"speed": ("1 kg", "2 kg")}, "expected"),
        ({"speed": ("70 rpm", "90 rpm")}, "must contain the parameter's value, '60 rpm': give another range"),
        ({"speed": 3}, "give the least and the largest value"),
        ({"speed": (None, 3)}, "neither a number nor a quantity"),
    ],
)
def test_what_is_no_range_is_refused(ranges, told):
    m = fb.Mechanism("m", parameters={"speed": "60 rpm", "twice": "2*speed"})
    with pytest.raises(fb.ModelError, match=told):
        make_sliders(m, ranges)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"t_end": 0.0}, "t_end must be greater than 0"),
        ({"outputs": 1}, "outputs is 1; it must be at least 2"),
        ({"port": 70000}, "port is 70000"),
        ({"ranges": [1]}, "ranges"),
    ],
)
def test_options_are_checked(given, told):
    with pytest.raises(fb.ModelError, match=told):
        options(**given)


# ---- runs


def test_numbers_of_a_run_are_the_engines():
    page = Page(fb.load(FOUR_BAR))
    assert page.ask("set", name="speed", value=90) == ["busy", "run"]
    expected = fb.load(FOUR_BAR).simulate(1.0, outputs=101, parameters={"speed": "90.0 rpm"})
    for name in ("A.angle", "D.angle", "motor.effort", "energy.total"):
        np.testing.assert_array_equal(page.channel(name), expected[name].astype("f4"))
    assert page.newest["run"]["values"]["speed"] == 90.0


def test_only_the_newest_value_is_run():
    page = Page(example("slider_crank.toml"))
    for value in np.linspace(60, 120, 40):
        page.session.receive(json.dumps({"do": "set", "name": "speed", "value": value}))
    assert page.work() == ["busy", "run"]
    assert page.newest["run"]["values"]["speed"] == 120.0


def test_a_newer_value_ends_a_run():
    """The first run is asked whether a newer value waits, and there is one."""
    page = Page(example("governor.toml"), t_end=20.0)
    newer = [30.0, 40.0]

    def poll() -> None:
        if newer:
            page.session.receive(json.dumps({"do": "set", "name": "ball", "value": newer.pop()}))

    page.session.receive(json.dumps({"do": "set", "name": "ball", "value": 5.5}))
    kinds = page.work(poll)
    assert kinds.count("run") == 1
    assert kinds.count("busy") == 3
    assert page.newest["run"]["values"]["ball"] == 30.0


def test_errors_have_the_words_of_the_terminal_and_the_page_goes_on():
    page = Page(fb.load(FOUR_BAR))
    assert page.ask("set", name="crank", value=3.0) == ["busy", "error"]
    with pytest.raises(fb.FlyballError) as raised:
        fb.load(FOUR_BAR).simulate(1.0, outputs=101, parameters={"crank": 3.0})
    assert page.text == str(raised.value)
    assert page.ask("set", name="crank", value=0.21) == ["busy", "run"]


def test_a_motion_that_stops_is_shown_as_far_as_it_goes():
    page = Page(example("peaucellier.toml"))
    assert page.ask("set", name="long", value=55.0) == ["busy", "run", "error"]
    assert 2 <= len(page.newest["run"]["recording"]["t"]) < 101


def test_the_mechanism_is_shown_until_the_first_motion_is_computed():
    page = Page(example("slider_crank.toml"))
    assert "<svg" in page.newest["model"]["picture"]


def test_slow_computations_say_so():
    assert slow_remark(0.9, 5.0) == ""
    assert slow_remark(6.0, 3.0) == "slow: 2 s of computing for 1 s of motion"


# ---- files


def test_an_edited_file_is_shown_and_moved_sliders_stay(tmp_path: Path):
    path = tmp_path / "m.toml"
    text = FOUR_BAR.read_text(encoding="utf-8")
    path.write_text(text, encoding="utf-8")
    page = Page(lambda: fb.load(path), path)
    page.ask("set", name="speed", value=75)
    page.ask("set", name="crank", value=0.19)
    assert page.work() == []
    path.write_text(text.replace("crank = 0.2 ", "crank = 0.15 ").replace("mass = 1.2", "mass = 1.3"), encoding="utf-8")
    assert waited(page) == ["model", "busy", "run"]
    assert page.newest["run"]["values"] == {"speed": 75.0, "crank": 0.15}
    path.write_text("planar = true\n[parameters", encoding="utf-8")
    assert waited(page) == ["error"]
    with pytest.raises(fb.ModelError) as raised:
        fb.load(path)
    assert page.text == str(raised.value)
    path.write_text(text, encoding="utf-8")
    assert waited(page) == ["model", "busy", "run"]


def waited(page: Page) -> list[str]:
    """What comes of a change of the file, which is noticed after a while."""
    for _ in range(40):
        if kinds := page.work():
            return kinds
        time.sleep(page.session.wait() or 0.01)
    raise AssertionError("the change was not noticed")


# ---- stepping


def test_steps_are_those_of_the_stepper():
    m = example("governor.toml")
    page = Page(m)
    assert page.ask("step") == ["motion", "stepping", "motion"]
    dt = page.newest["stepping"]["dt"]
    page.ask("shown")
    page.ask("step")
    sim = m.stepper(dt, outputs=["shaft.angle_rate"] if "shaft" in m.joints else [])
    sim.step(steps=2)
    assert page.newest["motion"]["recording"]["t"][-1] == pytest.approx(2 * dt)
    body = next(b for b in page.newest["motion"]["recording"]["bodies"] if b["name"] == "slider")
    np.testing.assert_allclose(body["p"].reshape(3, -1)[:, -1], sim.pose("slider")[0], atol=1e-6)


def test_curves_grow_while_it_steps_and_stop_when_it_is_paused():
    page = Page(falling())
    page.ask("start")
    times: list[float] = []
    while len(times) < 12:
        time.sleep(page.session.wait() or 0.0)
        if "motion" in page.work():
            times += page.newest["motion"]["recording"]["t"].tolist()
        page.ask("shown")
    assert np.diff(times).min() > 0
    y = page.channel("stone.y", "motion")
    t = page.newest["motion"]["recording"]["t"]
    np.testing.assert_allclose(y, -0.5 * 9.81 * t**2, rtol=1e-5)
    page.ask("pause")
    assert page.session.wait() is None
    assert page.work() == []


def test_a_page_that_does_not_draw_gets_no_more_pictures():
    page = Page(falling())
    page.ask("start")
    for _ in range(5):
        time.sleep(0.04)
        page.work()
    assert page.session.wait() is None  # until it says that it has drawn one
    page.session.receive('{"do": "shown"}')
    assert page.session.wait() is not None


def test_a_parameter_of_laws_acts_at_once_and_another_begins_anew():
    page = Page(falling(0.0))
    page.ask("step")
    assert page.ask("set", name="push", value=1.0) == []
    page.ask("step")
    assert page.channel("stone.vx", "motion")[-1] == pytest.approx(0.5 * page.newest["stepping"]["dt"], rel=1e-5)
    assert page.ask("set", name="mass", value=3.0) == ["busy", "run"]
    page.ask("step")
    assert page.newest["motion"]["recording"]["t"][-1] == pytest.approx(page.newest["stepping"]["dt"])


def test_what_cannot_be_stepped_says_so():
    page = Page(example("cam_follower.toml"))
    assert page.ask("start") == ["error"]
    with pytest.raises(fb.ModelError) as raised:
        example("cam_follower.toml").stepper(0.1)
    assert page.text == str(raised.value)


@pytest.mark.parametrize(
    "others",
    [
        [{"do": "set", "name": "mass", "value": 3.0}],
        [{"do": "drag", "body": "stone", "at": [0, 0, 0], "to": [1, 0, 0], "by": "assembly"}],
    ],
)
def test_a_step_with_other_requests_at_once_leaves_no_work_behind(others):
    page = Page(falling())
    page.ask("step")
    for message in [*others, {"do": "step"}, *others]:
        page.session.receive(json.dumps(message))
    page.work()
    page.work()
    assert page.session.wait() is None
    assert page.work() == []


# ---- messages


@pytest.mark.parametrize(
    "text",
    [
        "",
        "x",
        "[]",
        "{}",
        '{"do": "dance"}',
        '{"do": ["set"]}',
        "[" * 100_000,
        b"\xff\xfe",
        '{"do": "set"}',
        '{"do": "set", "name": "speed"}',
        '{"do": "set", "name": "sped", "value": 1}',
        '{"do": "set", "name": "speed", "value": NaN}',
        '{"do": "set", "name": "speed", "value": 1e999}',
        '{"do": "set", "name": "speed", "value": true}',
        '{"do": "set", "name": "speed", "value": 1' + "0" * 400 + "}",
        '{"do": "speed", "value": 0}',
        '{"do": "drag", "body": "crank", "at": [0, 0], "to": [0, 0, 0], "by": "assembly"}',
        '{"do": "drag", "body": "crank", "at": [0, 0, NaN], "to": [0, 0, 0], "by": "assembly"}',
        '{"do": "drag", "body": "A", "at": [0, 0, 0], "to": [0, 0, 0], "by": "assembly"}',
        '{"do": "drag", "body": "crank", "at": [0, 0, 0], "to": [0, 0, 0], "by": "magic"}',
        '{"do": "drag", "body": "crank", "at": [0, 0, 0], "to": [0, 0, 0], "by": "force"}',
    ],
)
def test_invalid_messages_are_refused_and_change_nothing(text):
    page = Page(fb.load(FOUR_BAR))
    with pytest.raises(fb.ModelError):
        page.session.receive(text)
    assert page.work() == []
    assert page.ask("set", name="speed", value=61) == ["busy", "run"]


def exchanged(session, messages: list[str]) -> tuple[str, int]:
    """Why a page is closed that sends these messages, and how many of them were received."""
    waiting = iter(messages)
    received = 0

    def receive(timeout: float | None) -> str:
        nonlocal received
        text = next(waiting, None)
        if text is None:
            raise ClosedPage("no more messages")
        received += 1
        return text

    with pytest.raises(ClosedPage) as closed:
        exchange_messages(session, receive, lambda _: None)
    return str(closed.value), received


def test_only_invalid_messages_in_succession_close_a_page():
    m = falling()
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1))))
    assert Page(m).newest["model"]["movable"] == ["stone"]
    drag = json.dumps({"do": "drag", "body": "floor", "at": [0, 0, 0], "to": [1, 0, 0], "by": "assembly"})
    assert exchanged(Page(m).session, [drag] * 200) == ("no more messages", 200)
    mixed = ["nonsense"] * MAX_INVALID_MESSAGES + ['{"do": "pause"}']
    assert exchanged(Page(m).session, 3 * mixed)[0] == "no more messages"
    assert exchanged(Page(m).session, ["nonsense"] * 99) == ("too many invalid messages", MAX_INVALID_MESSAGES + 1)


def test_a_chosen_range_is_finite():
    s = make_sliders(fb.Mechanism("m", parameters={"large": 1e308, "negative": -1.5e308}))
    assert all(np.isfinite([x.low, x.high]).all() and x.low <= x.value <= x.high for x in s.values())


def test_a_long_run_says_how_far_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session, "PROGRESS_AFTER", 0.0)
    monkeypatch.setattr(session, "PROGRESS_INTERVAL", 0.0)
    page = Page(fb.load(FOUR_BAR), t_end=200.0)
    said: list[dict[str, Any]] = []
    page.session.receive(json.dumps({"do": "set", "name": "speed", "value": 61.0}))
    list(page.session.work(tell=lambda message: said.append(read(message))))
    assert said
    assert {x["kind"] for x in said} == {"busy"}


def test_progress_names_the_rest_of_the_time() -> None:
    found = session.progress(0.02, 1.5, 60.0)
    assert found["text"] == "computing: 2 % of 60 s, about 74 s more"
    assert found["slow"] == "slow: 1.2 s of computing for 1 s of motion"
    assert session.progress(0.95, 0.9, 60.0) == {"text": "computing", "slow": ""}
