"""The animation page in a real browser: it shows the recording's numbers, by itself and without a network."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

from flyball.view.page import animation_page, notebook_iframe
from flyball.view.recording import Recording
from tests.view.conftest import Opened
from tests.view.recordings import NASTY, loaded, nasty, planar, spatial

Open = Callable[..., Opened]
NO_WEBGL = """
const getContext = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
  return kind.startsWith("webgl") ? null : getContext.call(this, kind, ...rest);
};
"""


def between(recording: Recording, time: float) -> np.ndarray:
    """Poses by interpolation in numpy: straight for positions, along the shorter great arc for orientations."""
    j = int(np.clip(np.searchsorted(recording.t, time), 1, recording.t.size - 1))
    f = (time - recording.t[j - 1]) / (recording.t[j] - recording.t[j - 1])
    rows = []
    for body in recording.bodies:
        a, b = body.q[j - 1], body.q[j]
        b = b if a @ b > 0 else -b
        angle = np.arccos(min(a @ b, 1.0))
        q = a if angle < 1e-9 else (np.sin((1 - f) * angle) * a + np.sin(f * angle) * b) / np.sin(angle)
        rows.append(np.concatenate([(1 - f) * body.p[j - 1] + f * body.p[j], q]))
    return np.array(rows)


@pytest.mark.parametrize("make", [planar, spatial, loaded])
def test_objects_stand_where_the_recording_says(opened: Open, make: Callable[[], Recording]) -> None:
    recording = make()
    tab = opened(animation_page(recording))
    t = recording.t
    for time in (t[0], t[7], t[20], t[-1], 0.3 * t[20] + 0.7 * t[21], 0.5 * (t[38] + t[39])):
        shown, wanted = tab.poses(time), between(recording, time)
        signs = np.sign(np.einsum("ij,ij->i", shown[:, 3:], wanted[:, 3:]))[:, None]
        np.testing.assert_allclose(shown[:, :3], wanted[:, :3], atol=1e-5)
        np.testing.assert_allclose(shown[:, 3:] * signs, wanted[:, 3:], atol=1e-5)
    assert tab.errors == []
    assert tab.foreign == []
    assert tab.evaluate("flyball.webgl()")


def test_picture_is_not_empty_and_follows_the_time(opened: Open) -> None:
    tab = opened(animation_page(planar()))
    shots = []
    for time in (0.0, 0.8):
        tab.evaluate("(t) => flyball.seek(t)", time)
        tab.settle()
        shots.append(tab.locator(".stage").screenshot())
    assert shots[0] != shots[1]
    assert min(map(len, shots)) > 8000  # bytes of PNG: a blank picture has far fewer


def test_plots_follow_the_time_and_lead_it(opened: Open) -> None:
    recording = planar()
    tab = opened(animation_page(recording), "t=1")
    assert tab.locator(".plot").count() == 2
    assert tab.locator(".plot .value").first.inner_text() == f"{np.sin(2.0):.4g}"
    before = tab.locator(".plot .cursor").first.bounding_box()["x"]
    area = tab.locator(".plot .u-over").nth(1).bounding_box()
    tab.mouse.click(area["x"] + 0.75 * area["width"], area["y"] + 20)
    assert tab.time == pytest.approx(3.0, abs=0.05)
    assert tab.locator(".plot .cursor").first.bounding_box()["x"] > before + 20


def test_channels_are_found_by_search(opened: Open) -> None:
    tab = opened(animation_page(spatial()))
    tab.click(".pick")
    tab.fill("input[type=search]", "signal 117")
    tab.check(".choice input")
    assert tab.locator(".plot").count() == 1  # one unit, one plot
    tab.uncheck("input[name=together]")
    assert tab.locator(".plot .name").all_inner_texts() == ["signal 1", "signal 117"]
    assert tab.locator(".plot").count() == 2


def test_playing_moves_the_time(opened: Open) -> None:
    tab = opened(animation_page(planar()), "t=0.5")
    assert not tab.evaluate("flyball.playing()")
    tab.keyboard.press("Space")
    tab.wait_until(lambda: tab.time > 0.7)
    tab.click("button[name=play]")
    stopped = tab.time
    tab.settle()
    assert tab.time == stopped
    tab.select_option("select[name=speed]", "10")
    tab.click("button[name=play]")
    tab.wait_until(lambda: tab.time < stopped)  # the loop has closed


def test_a_body_can_be_hidden_and_traced(opened: Open) -> None:
    tab = opened(animation_page(planar()))
    before = tab.locator(".stage").screenshot()
    tab.locator(".legend li").nth(1).hover()
    eye = tab.get_by_role("button", name="Show block", exact=True)
    eye.click()
    assert eye.get_attribute("aria-pressed") == "false"
    tab.locator(".legend li").first.hover()
    tab.locator(".legend .trail").first.click()
    tab.mouse.move(400, 400)
    tab.settle()
    assert tab.locator(".stage").screenshot() != before
    assert tab.errors == []


def test_the_legend_lists_what_is_seen(opened: Open) -> None:
    r = spatial()
    bare = dataclasses.replace(r.bodies[0], name="bare", shapes=())
    tab = opened(animation_page(dataclasses.replace(r, bodies=(*r.bodies, bare))))
    names = tab.locator(".legend li:not([hidden]) .name").all_text_contents()
    assert names == [b.name for b in r.bodies]


def test_dark_bodies_have_an_edge_on_dark_ground(opened: Open) -> None:
    r = spatial()
    dark = dataclasses.replace(r, bodies=tuple(dataclasses.replace(b, color="#15191e") for b in r.bodies))
    calls = {}
    for theme in ("light", "dark"):
        tab = opened(animation_page(dark), f"t=0&theme={theme}")
        tab.settle()
        calls[theme] = tab.evaluate("flyball.drawn().calls")
    assert calls["dark"] > calls["light"]


def test_picture_plots_and_animation_are_saved(opened: Open, tmp_path: Path) -> None:
    tab = opened(animation_page(dataclasses.replace(planar("a swing"), speed=4.0)))
    tab.click(".show")
    files = {}
    tab.evaluate("flyball.seek(4)")
    video = "mp4" if "MP4" in tab.locator("[name=save-video]").inner_text() else "webm"  # as the browser can
    kinds = {"png": ".png", "scene": ".svg", "svg": "-plots.svg", "gif": ".gif", "video": f".{video}"}
    for what, ending in kinds.items():
        with tab.expect_download() as download:
            tab.click(f"[name=save-{what}]")
        assert download.value.suggested_filename == f"a-swing{ending}"
        download.value.save_as(tmp_path / f"a{ending}")
        files[what] = (tmp_path / f"a{ending}").read_bytes()
    with Image.open(tmp_path / "a.png") as picture:
        assert len(np.unique(np.asarray(picture.convert("RGB")).reshape(-1, 3), axis=0)) > 20
    drawing = ElementTree.fromstring(files["svg"])
    space = "{http://www.w3.org/2000/svg}"
    names = [e.text for e in drawing.iter(f"{space}tspan")]
    assert names == tab.locator(".plot .curve .name").all_text_contents()
    assert all(e.get("d", "").count("L") > 50 for e in drawing.iter(f"{space}path"))
    assert files["video"][:4] == b"\x1a\x45\xdf\xa3" if video == "webm" else files["video"][4:8] == b"ftyp"
    assert len(files["video"]) > 2000
    assert tab.time == pytest.approx(4.0)
    assert tab.locator("[name=save-video]").inner_text() != "Recording: end"
    picture = ElementTree.fromstring(files["scene"])
    fills = [e.get("fill") for e in picture.iter(f"{space}path")]
    block = fills.index("rgb(0,128,128)")  # teal
    x, y = tab.evaluate("flyball.pixel('block')")
    numbers = re.findall(r"[-.0-9]+", list(picture.iter(f"{space}path"))[block].get("d"))
    corners = np.array(numbers, float).reshape(-1, 2)
    assert np.abs(corners.mean(axis=0) - [x, y]).max() < 3.0
    assert fills.count("none") > 4  # outlines, spring, hatching
    with Image.open(tmp_path / "a.gif") as film:
        assert film.n_frames == 20  # of 1 s
        assert film.info["duration"] == 50
        first = np.asarray(film.convert("RGB"), int)
        film.seek(10)
        assert (np.abs(np.asarray(film.convert("RGB"), int) - first).max(axis=2) > 60).sum() > 200
    assert tab.errors == []


def test_address_gives_time_and_theme(opened: Open) -> None:
    tab = opened(animation_page(spatial()), "t=1.25&theme=dark&view=top")
    assert tab.time == 1.25
    assert tab.evaluate("document.documentElement.dataset.theme") == "dark"
    tab.click(".theme")
    assert tab.evaluate("document.documentElement.dataset.theme") == "light"


def test_names_of_the_user_stay_text(opened: Open) -> None:
    tab = opened(animation_page(nasty()))
    assert tab.evaluate("window.hacked") is None
    assert tab.title() == NASTY
    assert tab.locator("h1").inner_text() == NASTY
    assert tab.evaluate("flyball.bodies()") == [NASTY]
    assert tab.locator(".legend .name").text_content() == NASTY
    assert tab.locator(".plot .name").text_content() == NASTY
    assert tab.locator(".summary dd").text_content() == NASTY
    assert tab.errors == []


def test_without_webgl_the_rest_works(opened: Open) -> None:
    recording = planar()
    tab = opened(animation_page(recording), "t=1", NO_WEBGL)
    assert "WebGL" in tab.locator(".message").inner_text()
    np.testing.assert_allclose(tab.poses(recording.t[30])[:, :3], [body.p[30] for body in recording.bodies], atol=1e-5)
    area = tab.locator(".plot .u-over").first.bounding_box()
    tab.mouse.click(area["x"] + 0.5 * area["width"], area["y"] + 20)
    assert tab.time == pytest.approx(2.0, abs=0.05)
    assert all("WebGL" in error for error in tab.errors)


def test_a_notebook_frame_runs_the_page(browser: Any, tmp_path: Path) -> None:
    path = tmp_path / "notebook.html"
    path.write_text(f"<!doctype html><body>{notebook_iframe(animation_page(planar()), 500)}</body>", encoding="utf-8")
    tab = browser.new_page(offline=True)
    tab.goto(path.as_uri())
    frame = tab.frame_locator("iframe")
    frame.locator("body[data-ready]").wait_for(timeout=300_000)
    assert tab.locator("iframe").bounding_box()["height"] == 500
    assert frame.locator("h1").inner_text() == "swing"
    assert frame.locator("button[name=play]").get_attribute("aria-label") == "Play"  # frames do not start by themselves
    tab.close()
