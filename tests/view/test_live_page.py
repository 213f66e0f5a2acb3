"""The live page in a real browser: its numbers are the engine's, it steps, is dragged, reloads and shows faults."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flyball as fb
from flyball.live import session
from flyball.live.server import LiveServer
from tests.live.pages import FOUR_BAR, options
from tests.mechanisms import example

pytest.importorskip("websockets", reason="websockets is not installed: no live page can be served")


class LiveTab:
    """A live page in a tab."""

    def __init__(self, browser: Any, address: str, **given: Any) -> None:
        self.errors: list[str] = []
        self.requests: list[str] = []
        self.tab = browser.new_page(**{"viewport": {"width": 900, "height": 640}} | given)
        self.tab.on("request", lambda request: self.requests.append(request.url))
        self.tab.on("pageerror", lambda error: self.errors.append(error.message))
        self.tab.on("console", lambda said: said.type in ("error", "warning") and self.errors.append(said.text))
        self.tab.goto(f"{address}#t=0")
        self.tab.wait_for_selector("body[data-ready]", timeout=300_000)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.tab, name)

    def wait_until(self, condition: str, *given: Any) -> None:
        """Wait for a condition in JavaScript."""
        self.tab.wait_for_function(condition, arg=list(given), timeout=60_000)

    def runs(self) -> int:
        return self.tab.evaluate("flyball.live.runs")

    def after_run(self, action: Callable[[], Any]) -> None:
        """Do something and wait for the run that it asks for."""
        before = self.runs()
        action()
        self.wait_until("([n]) => flyball.live.runs > n", before)

    def move(self, name: str, value: float) -> None:
        """Move a slider as a user does, step by step."""
        slider = self.tab.get_by_label(name, exact=True)
        for x in np.linspace(float(slider.input_value()), value, 6)[1:]:
            slider.evaluate("(s, x) => { s.value = x; s.dispatchEvent(new Event('input', { bubbles: true })); }", x)

    def fill(self, name: str, value: float) -> None:
        field = self.tab.get_by_label(f"Value of {name}", exact=True)
        field.fill(repr(value))
        field.press("Enter")

    def curve(self, name: str) -> np.ndarray:
        script = "(name) => Array.from(flyball.live.player.recording.channels.find((c) => c.name === name).values)"
        return np.array(self.tab.evaluate(script, name), float)

    def times(self) -> np.ndarray:
        return np.array(self.tab.evaluate("Array.from(flyball.live.player.recording.t)"))

    def pull(self, body: str, at: list[float], by: list[float], steps: int = 8, release: bool = True) -> None:
        """Drag a point of a body by pixels."""
        box = self.tab.locator(".stage").bounding_box()
        x, y = self.tab.evaluate("([body, at]) => flyball.pixel(body, at)", [body, at])
        x, y = x + box["x"], y + box["y"]
        self.tab.mouse.move(x, y)
        self.tab.mouse.down()
        for k in range(1, steps + 1):
            self.tab.mouse.move(x + by[0] * k / steps, y + by[1] * k / steps)
            self.tab.wait_for_timeout(40)
        if release:
            self.tab.mouse.up()

    @property
    def fault(self) -> str:
        box = self.tab.locator(".fault")
        return box.inner_text() if box.is_visible() else ""


Open = Callable[..., LiveTab]


@pytest.fixture
def live(browser: Any) -> Iterator[Open]:
    """Serves a mechanism, or what loads it, and opens its page."""
    ends: list[Callable[[], Any]] = []

    def open_live(load: Any, file: Path | None = None, view: dict[str, Any] | None = None, **given: Any) -> LiveTab:
        server = LiveServer(load if callable(load) else lambda: load, options(**given), file)
        thread = server.start()
        ends.extend([lambda: thread.join(timeout=60), server.stop])
        tab = LiveTab(browser, server.address, **view or {})
        ends.append(tab.close)
        return tab

    yield open_live
    for end in reversed(ends):
        end()


def poses(m: fb.Mechanism, time: int, **given: Any) -> np.ndarray:
    r = m.simulate(1.0, outputs=101, **given)
    return np.array([r[b.name].position[time] for b in m.bodies])


def test_numbers_on_the_page_are_the_engines(live: Open) -> None:
    tab = live(fb.load(FOUR_BAR))
    assert tab.locator(".waiting").inner_html() == ""  # the picture of the model has gone
    tab.after_run(lambda: tab.fill("speed", 90.0))
    expected = fb.load(FOUR_BAR).simulate(1.0, outputs=101, parameters={"speed": "90.0 rpm"})
    for name in ("A.angle", "C.angle", "motor.effort"):
        np.testing.assert_array_equal(tab.curve(name), expected[name].astype("f4"))
    tab.evaluate("flyball.seek(0.5)")
    shown = np.array(tab.evaluate("flyball.pose()"))[:, :2]
    np.testing.assert_allclose(shown, poses(fb.load(FOUR_BAR), 50, parameters={"speed": "90.0 rpm"}), atol=1e-6)
    label = tab.locator(".plot .curve", has_text="C.angle").locator(".value").inner_text()
    assert label == f"{expected['C.angle'][50]:.4g}".replace("-", "\N{MINUS SIGN}")
    assert tab.errors == []
    assert all(url.startswith(("http://127.0.0.1:", "data:", "blob:")) for url in tab.requests)


@pytest.mark.parametrize(
    "name", ["slider_crank.toml", "governor.toml", "stick_slip.toml", "rope_pendulum.toml", "planetary.py"]
)
def test_sliders_of_examples_end_at_the_newest_value(live: Open, name: str) -> None:
    m = example(name)
    tab = live(m)
    first = next(iter(m.parameters))
    tab.move(first, 1.3 * float(tab.get_by_label(first, exact=True).input_value()))
    wanted = float(tab.get_by_label(first, exact=True).input_value())
    tab.wait_until("([name, x]) => Math.abs(flyball.live.values[name] / x - 1) < 1e-6", first, wanted)
    assert tab.fault == ""
    assert tab.errors == []


def test_a_slider_keeps_camera_time_and_choices(live: Open) -> None:
    tab = live(example("spatial_slider_crank.toml"))
    tab.evaluate("flyball.look('top'); flyball.seek(0.25); flyball.show('names'); flyball.select(flyball.bodies()[0])")
    tab.click(".pick")
    tab.locator(".choice input").nth(5).check()
    tab.click(".pick")
    camera = "Object.values(flyball.camera()).flat()"
    state = "[flyball.time(), flyball.shown(), flyball.selected()]"
    sight = tab.evaluate(camera)
    before, curves = tab.evaluate(state), tab.locator(".plot .name").all_inner_texts()
    name = tab.evaluate("flyball.live.parameters[0].name")
    value = float(tab.get_by_label(f"Value of {name}", exact=True).input_value())
    tab.after_run(lambda: tab.fill(name, 1.02 * value))
    assert tab.evaluate(camera) == pytest.approx(sight, rel=1e-9)
    assert tab.evaluate(state) == before
    assert before[2] is not None
    assert tab.locator(".plot .name").all_inner_texts() == curves
    assert tab.errors == []


def test_ranges_that_were_chosen_are_marked(live: Open) -> None:
    tab = live(fb.load(FOUR_BAR), ranges={"speed": ("30 rpm", "90 rpm")})
    assert tab.locator(".parameter .name").all_inner_texts() == ["speed", "crank *"]
    assert tab.get_by_label("speed", exact=True).get_attribute("max") == "90"
    assert "No range was given" in tab.locator(".hint").inner_text()


def test_it_steps_pauses_and_goes_back(live: Open) -> None:
    tab = live(example("governor.toml"))
    tab.click("[name=run-live]")
    tab.wait_until("() => flyball.live.pictures > 6")
    assert tab.locator("[name=run-live]").inner_text() == "Pause"
    t = tab.times()
    assert np.diff(t).min() > 0
    assert tab.evaluate("flyball.time() === flyball.live.player.recording.t.at(-1)")
    tab.click("[name=run-live]")
    tab.wait_for_timeout(300)
    held = tab.times()[-1]
    tab.wait_for_timeout(200)
    assert tab.times()[-1] == held
    tab.click("[name=step-live]")
    tab.wait_until("([t]) => flyball.live.player.recording.t.at(-1) > t", held)
    sim = example("governor.toml").stepper(tab.times()[-1] - held)
    sim.step(steps=round(tab.times()[-1] / sim.dt))
    k = tab.evaluate("flyball.bodies()").index("slider")
    np.testing.assert_allclose(tab.evaluate("flyball.pose()")[k][:3], sim.pose("slider")[0], atol=1e-5)
    tab.after_run(lambda: tab.click("[name=reset-live]"))
    assert len(tab.times()) == 101
    assert tab.errors == []


def test_a_dragged_four_bar_follows_the_mouse_and_stays_closed(live: Open) -> None:
    tab = live(fb.load(FOUR_BAR))
    before = tab.curve("A.angle")[0]
    tab.pull("crank", [0, 0.02, 0], [-120, 40])
    tab.wait_until("() => flyball.live.closure !== null && flyball.live.pictures > 4")
    assert tab.evaluate("flyball.live.closure") < 1e-9
    crank, coupler, rocker = np.array(tab.evaluate("flyball.pose()"))[:3]
    assert _angle(crank) - before > 0.5  # it has turned to the left, towards the mouse

    def point(pose: np.ndarray, arm: tuple[float, float]) -> np.ndarray:
        a = _angle(pose)
        return pose[:2] + (np.cos(a) * arm[0] - np.sin(a) * arm[1], np.sin(a) * arm[0] + np.cos(a) * arm[1])

    np.testing.assert_allclose(point(crank, (0, -0.1)), (0, 0), atol=1e-6)
    np.testing.assert_allclose(point(crank, (0, 0.1)), point(coupler, (-0.25, -0.15)), atol=1e-6)
    np.testing.assert_allclose(point(coupler, (0.25, 0.15)), point(rocker, (-0.05, 0.25)), atol=1e-6)
    np.testing.assert_allclose(point(rocker, (0.05, -0.25)), (0.6, 0), atol=1e-6)
    assert np.isnan(tab.curve("motor.effort")).all()  # a position has no forces
    assert tab.errors == []


def _angle(pose: np.ndarray) -> float:
    return 2.0 * np.arctan2(pose[6], pose[3])


def test_a_body_is_pulled_by_a_spring_while_it_is_stepped(live: Open) -> None:
    m = fb.Mechanism("stone", planar=True)
    m.add(fb.Body("stone", shape=fb.Box(edges=(0.3, 0.2, 0.1)), density=1000, position=(0, 0)))
    tab = live(m)
    tab.click("[name=run-live]")
    tab.wait_until("() => flyball.live.pictures > 2")
    goal = "([x]) => Math.abs(flyball.pose()[0][0] - x) < 0.01"
    scale = tab.evaluate("flyball.pixel('stone', [1, 0, 0])[0] - flyball.pixel('stone', [0, 0, 0])[0]")
    tab.pull("stone", [0, 0, 0], [0.5 * scale, 0], release=False)
    assert tab.locator(".pull").is_visible()
    tab.wait_until(goal, 0.5)
    tab.mouse.up()
    assert tab.locator(".pull").is_hidden()
    assert tab.errors == []


def test_kept_motions_stay_in_a_colour(live: Open) -> None:
    tab = live(fb.load(FOUR_BAR))
    tab.click("[name=keep-live]")
    assert tab.locator(".variants .name").all_inner_texts() == ["speed 60 rpm, crank 0.2 m".replace(" m", "")]
    series = "flyball.live.player.plots.plots[0].chart.series.length"
    assert tab.evaluate(series) == 1 + 2 * tab.evaluate("flyball.live.player.plots.plots[0].channels.length")
    before = tab.locator(".stage").screenshot()
    tab.after_run(lambda: tab.fill("crank", 0.16))
    tab.evaluate("flyball.seek(0.3)")
    tab.wait_for_timeout(200)
    assert tab.locator(".stage").screenshot() != before
    tab.click("[name=keep-live]")
    assert tab.locator(".variants li").count() == 2
    kept = "(k) => flyball.live.variants.kept[k].mechanism.pose()[0]"
    assert tab.evaluate(kept, 0) != tab.evaluate(kept, 1)
    for _ in range(2):
        tab.locator(".variants button").first.click()
    assert tab.locator(".variants li").count() == 0
    assert tab.evaluate(series) == 1 + tab.evaluate("flyball.live.player.plots.plots[0].channels.length")
    assert tab.errors == []


def test_a_kept_motion_that_was_stepped_is_labelled_with_the_present_values(live: Open) -> None:
    m = fb.Mechanism("stone", planar=True, parameters={"push": 1.0})
    m.add(fb.Body("stone", mass=1, inertia=1, position=(0, 0)), fb.PointForce("wind", "stone", force=("push", 0)))
    tab = live(m)
    tab.click("[name=step-live]")
    tab.wait_until("() => flyball.live.pictures > 0")
    tab.fill("push", 3.0)
    tab.click("[name=keep-live]")
    assert tab.locator(".variants .name").all_inner_texts() == ["push 3"]


def test_a_value_that_no_answer_follows_is_sent_after_a_while(live: Open) -> None:
    tab = live(fb.load(FOUR_BAR))
    tab.after_run(lambda: tab.evaluate("flyball.live.sent = performance.now(); flyball.live.set('speed', 77)"))
    assert tab.evaluate("flyball.live.values.speed") == 77.0


def test_shapes_of_the_ground_are_not_dragged(live: Open) -> None:
    m = fb.Mechanism("box", gravity=(0, 0, -9.81))
    m.add(fb.Body("box", shape=fb.Box(edges=(0.1, 0.1, 0.1)), density=1000, position=(1, 0, 0)))
    m.add(fb.Ground("block", shape=fb.Box(edges=(0.5, 0.5, 0.5))))
    tab = live(m)
    tab.pull("block", [0, 0, 0], [50, 20])
    tab.wait_for_timeout(300)
    assert tab.fault == ""
    assert tab.evaluate("flyball.live.pictures") == 0


def test_an_edited_file_keeps_the_view_and_a_fault_has_the_words_of_the_terminal(live: Open, tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    text = FOUR_BAR.read_text(encoding="utf-8")
    path.write_text(text, encoding="utf-8")
    tab = live(lambda: fb.load(path), path)
    tab.evaluate("flyball.seek(0.4); flyball.show('names')")
    more = '\n[[bodies]]\nname = "weight"\nmass = 2\ninertia = 0.1\nposition = [0.3, -0.2]\n'
    tab.after_run(lambda: path.write_text(text + more, encoding="utf-8"))
    assert "weight" in tab.evaluate("flyball.bodies()")
    assert tab.locator(".legend li").count() == 4
    assert tab.evaluate("[flyball.time(), flyball.shown().includes('names')]") == [0.4, True]
    path.write_text(text.replace('body_j = "crank"', 'body_j = "krank"'), encoding="utf-8")
    with pytest.raises(fb.ModelError) as raised:
        fb.load(path)
    tab.wait_until("() => !document.querySelector('.fault').hidden")
    assert tab.fault == str(raised.value)
    tab.after_run(lambda: path.write_text(text, encoding="utf-8"))
    assert tab.fault == ""
    assert tab.evaluate("flyball.bodies()") == ["crank", "coupler", "rocker"]
    assert tab.errors == []


def test_contacts_sets_and_new_shapes_are_shown_anew(live: Open) -> None:
    m = fb.Mechanism("drop", gravity=(0, 0, -9.81), parameters={"edge": 0.2})
    m.add(fb.Ground("floor", shape=fb.Plane()))
    m.add(fb.Body("crate", shape=fb.Box(edges=("edge", 0.2, 0.2)), density=500, position=(0, 0, 0.3)))
    m.add(fb.Bodies("balls", shape=fb.Sphere(radius=0.05), density=1000, position=[(0.4, 0, 0.2), (-0.4, 0, 0.3)]))
    m.add(fb.Contact(friction=0.3))
    tab = live(m, t_end=0.5)
    tab.after_run(lambda: tab.fill("edge", 0.35))
    tab.click("[name=run-live]")
    tab.wait_until("() => flyball.time() < 0.5 && flyball.live.pictures > 6")
    tab.click("[name=run-live]")
    poses, now = tab.evaluate("[flyball.poses('balls'), flyball.time()]")  # of one picture: the last may still come
    heights, fall = [p[2] for p in poses], 0.5 * 9.81 * now**2
    assert heights == pytest.approx([max(0.05, h - fall) for h in (0.2, 0.3)], abs=0.03)
    assert tab.errors == []


def test_a_mechanism_that_cannot_be_stepped_or_run_says_why(live: Open) -> None:
    tab = live(example("cam_follower.toml"))
    tab.click("[name=run-live]")
    tab.wait_until("() => !document.querySelector('.fault').hidden")
    assert "a stepper of 'cam with a lifting follower' does not support" in tab.fault
    assert tab.locator("[name=run-live]").inner_text() == "Start"
    tab.after_run(lambda: tab.fill("lift", 7.0))
    assert tab.fault == ""


def test_a_slow_model_says_how_slow(live: Open, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session, "SLOW_RUN", 0.0)
    tab = live(fb.load(FOUR_BAR))
    assert "s of computing for 1 s of motion" in tab.locator(".slow").inner_text()
    monkeypatch.undo()
    tab.after_run(lambda: tab.fill("speed", 50.0))
    assert tab.locator(".slow").is_hidden()


def test_the_end_of_the_program_is_shown(browser: Any) -> None:
    server = LiveServer(lambda: fb.load(FOUR_BAR), options())
    thread = server.start()
    tab = LiveTab(browser, server.address)
    server.stop()
    thread.join(timeout=60)
    tab.wait_until("() => !document.querySelector('.fault').hidden")
    assert "The program has ended" in tab.fault
    assert tab.evaluate("(flyball.seek(0.5), flyball.time())") == 0.5  # the motion can still be looked at
    tab.close()
