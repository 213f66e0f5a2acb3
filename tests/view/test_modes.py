"""The page of modes in a real browser: it swings as the modes do, by itself and without a network."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

import flyball as fb
from flyball.results.modes import Modes
from flyball.view.mode_animation import modes_page
from tests.view.conftest import Opened

Open = Callable[..., Opened]


def carts(damping: float = 0.2) -> fb.Mechanism:
    """Two carts in a row; equal masses and springs: golden ratio."""
    m = fb.Mechanism("<b>carts</b>", planar=True)
    for name, x in (("A", 1.0), ("B", 2.0)):
        m.add(fb.Body(name, mass=1, inertia=1, position=(x, 0)))
        m.add(fb.Translational(f"on {name}", "ground", name, at=(x, 0), axis=(1, 0)))
    m.add(fb.SpringDamper("s", "ground", "A", at=((0, 0), (1, 0)), stiffness=100, damping=damping))
    m.add(fb.SpringDamper("u", "A", "B", at=((1, 0), (2, 0)), stiffness=100))
    return m


def upright() -> fb.Mechanism:
    """A rod that stands on its end: it falls over, whichever way it turns."""
    m = fb.Mechanism("upright", gravity=(0, 0, -9.81))
    m.add(fb.Body("rod", mass=1, inertia=(1 / 12, 1 / 12, 0.01), position=(0, 0, 0.5)))
    m.add(fb.Spherical("foot", "ground", "rod", at=(0, 0, 0)))
    return m


@pytest.fixture(scope="module")
def two() -> Modes:
    return carts().modes()


def where(tab: Opened, part: float) -> np.ndarray:
    """Positions of the bodies after a part of the period."""
    return tab.poses(tab.evaluate("flyball.begin()") + 2.0 * part)[:, 0]


def test_bodies_swing_along_the_mode(opened: Open, two: Modes) -> None:
    tab = opened(modes_page(two, amplitude=0.05), "mode=1&play=0")
    assert tab.evaluate("flyball.mode()") == "1"
    golden = (1 + math.sqrt(5)) / 2  # B moves as much as A times it, or A as much as B times it the other way
    for k, ratio in ((0, golden), (1, -1 / golden)):
        tab.locator(".modes tbody tr").nth(k).click()
        assert tab.evaluate("flyball.mode()") == str(k)
        assert where(tab, 0.0) == pytest.approx(where(tab, 1.0), abs=1e-6)
        swing = where(tab, 0.0) - [1.0, 2.0]
        assert swing[1] / swing[0] == pytest.approx(ratio, rel=0.02)
        assert np.abs(swing).max() == pytest.approx(0.05 * two.point.values.length, rel=1e-4)
        assert where(tab, 0.5) - [1.0, 2.0] == pytest.approx(-swing, rel=0.02)
    assert tab.errors == []
    assert tab.foreign == []


def test_frequencies_and_damping_are_listed(opened: Open, two: Modes) -> None:
    tab = opened(modes_page(two), "play=0")
    rows = tab.locator(".modes > table:first-child tbody tr").all_inner_texts()
    said = [row.split() for row in rows]
    assert [float(row[1]) for row in said] == pytest.approx(two.frequency, rel=1e-3)
    assert [float(row[3]) for row in said] == pytest.approx(two.damping_ratio, rel=1e-3)
    assert tab.locator("h1").inner_text() == "<b>carts</b>: modes"
    period = float(tab.locator(".total").inner_text().split()[1])
    assert period == pytest.approx(1 / two.frequency[0], abs=5e-3)


def test_amplitude_and_keys(opened: Open, two: Modes) -> None:
    tab = opened(modes_page(two), "play=0")
    before = where(tab, 0.0) - [1.0, 2.0]
    tab.evaluate(
        "const a = document.querySelector('[name=amplitude]'); a.value = 3; a.dispatchEvent(new Event('input'))"
    )
    assert where(tab, 0.0) - [1.0, 2.0] == pytest.approx(3 * before, rel=1e-5)
    tab.keyboard.press("ArrowDown")
    assert tab.evaluate("flyball.mode()") == "1"
    tab.keyboard.press("ArrowDown")  # there is none
    assert tab.evaluate("flyball.mode()") == "1"
    tab.keyboard.press("Space")
    begin = tab.evaluate("flyball.begin()")
    tab.wait_until(lambda: tab.time > begin + 0.3)
    assert tab.time <= begin + 2.0


def test_unstable_ones_are_flagged_and_rigid_ones_come_last(opened: Open) -> None:
    modes = upright().modes()
    assert sorted(modes.kinds) == ["decay", "decay", "rigid", "unstable", "unstable"]
    tab = opened(modes_page(modes, count=4), "play=0")
    kinds = tab.locator(".modes .kind").all_inner_texts()
    assert sorted(kinds) == ["decay", "decay", "unstable", "unstable"]
    assert tab.locator(".modes tr.unstable").count() == 2
    assert "2 unstable" in tab.locator(".summary").text_content()
    tab.locator(".modes tr.unstable").first.click()
    turns = []
    for scale in (1, 2):
        tab.evaluate(
            "(s) => { const a = document.querySelector('[name=amplitude]'); a.value = s;"
            "a.dispatchEvent(new Event('input')) }",
            scale,
        )
        q = tab.poses(tab.evaluate("flyball.begin()"))[0, 3:]
        turns.append(2 * math.atan2(np.linalg.norm(q[1:]), abs(q[0])))
    assert turns[0] > 0.05
    assert turns[1] == pytest.approx(2 * turns[0], rel=1e-4)


def test_what_cannot_be_shown_is_refused(two: Modes) -> None:
    with pytest.raises(fb.ModelError, match="amplitude and count must be greater than 0"):
        modes_page(two, amplitude=0.0)
    held = carts()
    held.add(fb.Driver("a", "on A.displacement", "0"), fb.Driver("b", "on B.displacement", "0"))
    with pytest.raises(fb.ModelError, match="has no modes to show"):
        modes_page(held.modes())


def test_a_state_is_a_result_that_says_what_it_is(two: Modes) -> None:
    """Neither a mode's motion nor the state it is about claims to be a simulation."""
    for result, said in ((two.point, "one state"), (two.motion(0), "mode 0, not a simulation")):
        lines = dict(result.health.lines())
        assert lines["status"] == said
        assert lines["freedoms"] == "2"
        assert "energy balance" not in lines
        assert len(result.html()) > 100_000
