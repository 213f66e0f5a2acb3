"""What can be shown in the picture besides the bodies, and what one can do in it: compared with the numbers."""

from __future__ import annotations

import numpy as np
import pytest

from flyball.view.page import animation_page
from flyball.view.recording import SHOW_OPTIONS, Recording
from tests.view.recordings import SYMBOLS, loaded, planar
from tests.view.test_page import Open


def turned(recording: Recording, body: str, point: tuple[float, float, float], i: int) -> np.ndarray:
    """Where a point of a body is in the world at a sample."""
    b = next(b for b in recording.bodies if b.name == body)
    w, u = b.q[i, 0], b.q[i, 1:]
    v = np.array(point)
    return b.p[i] + v + 2 * np.cross(u, np.cross(u, v) + w * v)


@pytest.mark.parametrize("flat", [False, True])
def test_arrows_stand_where_forces_act_and_are_those_forces(opened: Open, flat: bool) -> None:
    recording = loaded(flat)
    tab = opened(animation_page(recording), "t=0&show=loads,reactions,elements,moments")
    for i in (3, 17, 40):
        tab.evaluate("(t) => flyball.seek(t)", float(recording.t[i]))
        shown = {(a["name"], a["what"]): a for a in tab.evaluate("flyball.arrows()")}
        wanted = {(a.name, a.what): a for a in recording.arrows}
        assert shown.keys() == wanted.keys()
        for key, a in wanted.items():
            np.testing.assert_allclose(shown[key]["at"], turned(recording, a.body, a.position, i), atol=1e-5)
            np.testing.assert_allclose(shown[key]["vector"], a.vector[i], rtol=1e-5, atol=1e-5)
        per_newton = [
            shown[k, "force"]["length"] / np.linalg.norm(wanted[k, "force"].vector[i]) for k in ("push", "base")
        ]
        assert per_newton[0] == pytest.approx(per_newton[1])  # one scale for all forces
    assert tab.errors == []


def test_arrows_are_painted_from_the_point_towards_where_the_force_points(opened: Open) -> None:
    """In the picture itself: the pixels that an arrow changes begin at its point and lie along its direction."""
    recording = loaded(flat=True)
    i = 12
    tab = opened(animation_page(recording), f"t={float(recording.t[i])!r}&show=")
    bare = tab.picture()
    tab.evaluate("flyball.show('loads')")
    changed = np.argwhere(np.abs(tab.picture() - bare).max(axis=2) > 40)[:, ::-1].astype(float)
    (arrow,) = tab.evaluate("flyball.arrows()")
    start = np.array(tab.evaluate("flyball.pixel('b1', [0.1, 0, 0])"))
    direction = np.array(arrow["vector"][:2]) * [1, -1]  # y of pixels goes down
    direction /= np.linalg.norm(direction)
    along = (changed - start) @ direction
    across = (changed - start) @ [-direction[1], direction[0]]
    scale = np.linalg.norm(np.array(tab.evaluate("flyball.pixel('b1', [1.1, 0, 0])")) - start)  # px in a metre
    assert along.min() == pytest.approx(0, abs=4)
    assert along.max() == pytest.approx(scale * arrow["length"], abs=4)
    assert np.abs(across).max() < 12
    assert abs(across.mean()) < 1


def test_switches_show_and_hide(opened: Open) -> None:
    tab = opened(animation_page(loaded()), "t=0.5&show=")
    assert tab.evaluate("[flyball.shown(), flyball.arrows(), flyball.axes()]") == [[], [], []]
    bare = tab.picture()
    for name in SHOW_OPTIONS:
        if name == "contacts":  # nothing touches: no such switch
            continue
        tab.evaluate("(name) => flyball.show(name)", name)
        assert tab.evaluate("flyball.shown()") == [name]
        # moments alone add to nothing, of the elements there is a moment only, names are no part of the drawing
        if name not in ("moments", "elements", "names"):
            assert np.abs(tab.picture() - bare).max() > 20, name
        tab.evaluate("(name) => flyball.show(name, false)", name)
    assert np.abs(tab.picture() - bare).max() < 20
    assert tab.errors == []


def test_moments_are_shown_with_forces_only(opened: Open) -> None:
    tab = opened(animation_page(loaded()), "t=0.5&show=reactions")
    kinds = "flyball.arrows().map(({ what }) => what)"
    assert tab.evaluate(kinds) == ["force"]
    tab.evaluate("flyball.show('moments')")
    assert sorted(tab.evaluate(kinds)) == ["force", "moment"]


def test_the_legend_of_forces_says_how_large_they_get(opened: Open) -> None:
    recording = loaded()
    tab = opened(animation_page(recording), "t=0.5&show=loads,reactions,elements,moments")
    largest = np.linalg.norm(recording.arrows[0].vector, axis=1).max()
    text = tab.locator(".forces").inner_text()
    assert f"Given loads\nup to {largest:.4g} N" in text
    assert f"Joint reactions\nup to 50 N, {8 * np.sin(recording.t).max():.4g} N m" in text
    assert "Springs, motors, drivers\nup to 7 N m" in text
    tab.evaluate("flyball.show('loads', false)")
    assert "Given loads" not in tab.locator(".forces").inner_text()


def test_arrows_grow_with_their_size(opened: Open) -> None:
    tab = opened(animation_page(loaded()), "t=0.5&show=loads")
    length = "flyball.arrows()[0].length"
    before = tab.evaluate(length)
    tab.keyboard.press("]")
    tab.keyboard.press("]")
    assert before < tab.evaluate(length) <= 4 * before
    tab.click(".show")
    tab.locator("[name=arrow-size]").fill("-1")
    assert tab.evaluate("flyball.arrows().length ? flyball.arrows()[0].length : 0") < 0.3 * before


def test_axes_stand_on_their_bodies(opened: Open) -> None:
    recording = loaded()
    tab = opened(animation_page(recording), "t=0&show=world,bodies,frames")
    i = 25
    tab.evaluate("(t) => flyball.seek(t)", float(recording.t[i]))
    shown = {a["name"]: a["at"] for a in tab.evaluate("flyball.axes()")}
    assert shown["world"] == [0, 0, 0]
    assert len(shown) == 2 + len(recording.bodies)
    np.testing.assert_allclose(shown["b4"], recording.bodies[4].p[i], atol=1e-5)
    np.testing.assert_allclose(shown["base"], turned(recording, "b1", (0.2, 0, 0), i), atol=1e-5)


def test_paths_are_those_of_the_points(opened: Open) -> None:
    recording = loaded()
    tab = opened(animation_page(recording))
    (path,) = tab.evaluate("flyball.paths()")
    assert path["name"] == "tip"
    wanted = [turned(recording, "b1", (0.5, 0, 0), i) for i in range(len(recording.t))]
    np.testing.assert_allclose(path["points"], wanted, atol=1e-5)


def test_a_rope_is_slack_when_it_is_longer_than_its_way(opened: Open) -> None:
    recording = loaded()
    tab = opened(animation_page(recording))
    assert tab.evaluate("(flyball.seek(0.1), flyball.slack())") == []
    assert tab.evaluate("(flyball.seek(1.9), flyball.slack())") == ["slack"]


@pytest.mark.parametrize("flat", [False, True])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_everything_is_drawn_in_light_and_dark(opened: Open, flat: bool, scheme: str) -> None:
    tab = opened(animation_page(loaded(flat)), f"t=1&show={','.join(SHOW_OPTIONS)}", color_scheme=scheme)
    assert tab.evaluate("document.documentElement.dataset.theme") == scheme
    picture = tab.picture()
    assert (picture.mean() > 128) == (scheme == "light")
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 500
    names = tab.locator(".names span").all_text_contents()
    assert {"b0", "base", *SYMBOLS} <= set(names)
    assert tab.errors == []
    assert tab.foreign == []


def test_a_click_selects_a_part_and_its_card_follows_the_time(opened: Open) -> None:
    recording = loaded()
    tab = opened(animation_page(recording), "t=0&show=")
    x, y = tab.evaluate("flyball.pixel('b0', [0.08, 0.08, 0.05])")
    box = tab.locator(".stage").bounding_box()
    tab.mouse.click(box["x"] + x, box["y"] + y)
    assert tab.evaluate("flyball.selected()") == "b0"
    card = tab.locator(".card")
    assert card.locator("h2").inner_text() == "b0"
    assert card.locator("p").inner_text() == "Body, 1 kg"
    tab.evaluate("flyball.seek(0.5)")
    assert card.locator("td.value").all_inner_texts() == [f"{np.cos(0.5):.4g}", f"−{np.sin(0.5):.4g}"]
    card.get_by_role("button", name="plot").nth(1).click()
    assert "b0.vx" in tab.locator(".plot .name").all_inner_texts()
    tab.keyboard.press("Escape")
    assert tab.evaluate("flyball.selected()") is None
    assert card.is_hidden()


def test_the_camera_follows_a_body(opened: Open) -> None:
    recording = planar()
    tab = opened(animation_page(recording), "t=0&select=block")
    where = "flyball.pixel('block')"
    tab.keyboard.press("f")
    before = tab.evaluate(where)
    tab.evaluate("flyball.seek(1.5)")
    tab.settle()
    assert tab.evaluate(where) == pytest.approx(before, abs=0.5)
    tab.keyboard.press("0")  # fit: follows no more
    tab.settle()
    tab.evaluate("flyball.seek(3)")
    tab.settle()
    moved = tab.evaluate(where)
    assert np.hypot(moved[0] - before[0], moved[1] - before[1]) > 5


@pytest.mark.parametrize(("view", "axis"), [("front", 1), ("side", 0), ("top", 2)])
def test_views_look_along_an_axis_and_hold_the_motion(opened: Open, view: str, axis: int) -> None:
    recording = loaded()
    tab = opened(animation_page(recording), f"t=0&view={view}&show=")
    camera = tab.evaluate("flyball.camera()")
    sight = np.subtract(camera["target"], camera["position"])
    assert abs(sight[axis]) / np.linalg.norm(sight) > 0.999
    size = tab.locator(".stage").bounding_box()
    for body in recording.bodies:
        x, y = tab.evaluate("(name) => flyball.pixel(name)", body.name)
        assert 0 < x < size["width"]
        assert 0 < y < size["height"]


def test_keys_and_their_help(opened: Open) -> None:
    tab = opened(animation_page(loaded()), "t=0&show=")
    for key, name in {
        "r": "reactions",
        "e": "elements",
        "a": "frames",
        "b": "bodies",
        "n": "names",
        "g": "grid",
    }.items():
        tab.keyboard.press(key)
        assert tab.evaluate("flyball.shown()") == [name]
        tab.keyboard.press(key)
    tab.keyboard.press("End")
    assert tab.time == 2.0
    tab.keyboard.press("Home")
    tab.keyboard.press("ArrowRight")
    assert 0 < tab.time < 0.1
    theme = tab.evaluate("document.documentElement.dataset.theme")
    tab.keyboard.press("d")
    assert tab.evaluate("document.documentElement.dataset.theme") != theme
    tab.keyboard.press("?")
    help_text = tab.locator("dialog.help[open]").inner_text()
    for words in ("play or pause", "joint reactions", "follow the selected body", "this help"):
        assert words in help_text
    tab.keyboard.press("r")  # does nothing while the help is open
    assert tab.evaluate("flyball.shown()") == []
    tab.keyboard.press("Escape")
    assert tab.locator("dialog.help[open]").count() == 0
    tab.click(".pick")
    tab.keyboard.type("grn")  # letters typed into a field are no keys
    assert tab.evaluate("flyball.shown()") == []
    assert tab.errors == []


def test_the_menu_holds_what_there_is_to_show(opened: Open) -> None:
    tab = opened(animation_page(planar()), "t=0")
    tab.click(".show")
    names = tab.locator(".menu input[type=checkbox]").evaluate_all("boxes => boxes.map(({ name }) => name)")
    assert names == ["world", "bodies", "frames", "names", "grid"]  # nothing of forces where none are recorded
    tab.check(".menu [name=names]")
    assert tab.locator(".names").is_visible()
    tab.mouse.click(300, 300)
    assert tab.locator(".menu").is_hidden()


def test_curves_that_coincide_are_dashed_and_those_of_another_size_apart(opened: Open) -> None:
    from dataclasses import replace

    from flyball.view.recording import Channel

    r = planar()
    wave = np.sin(r.t)
    channels = (Channel("a", "m", wave), Channel("b", "m", wave + 1e-4), Channel("tiny", "m", 1e-3 * wave))
    tab = opened(animation_page(replace(r, channels=channels, plotted=("a", "b", "tiny"))))
    assert tab.locator(".plot").count() == 2
    assert tab.locator(".plot").first.locator(".name").all_inner_texts() == ["a", "b"]
    marks = tab.locator(".plot").first.locator(".swatch").evaluate_all("marks => marks.map((m) => m.style.background)")
    assert "gradient" not in marks[0]
    assert "gradient" in marks[1]
