"""The speed at which a motion is played, and the word on output times that are too far apart."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import flyball as fb
from flyball.view.animation import animation_html, record_motion
from flyball.view.playback import EASY_FREQUENCY, playback_of, suitable_speed
from tests.mechanisms import example


def rotor(speed: str) -> fb.Mechanism:
    m = fb.Mechanism("rotor", planar=True, parameters={"speed": speed})
    m.add(fb.Body("rotor", mass=1, inertia=1), fb.Revolute("A", "ground", "rotor", at=(0, 0)))
    m.add(fb.Driver("motor", "A.angle", "speed*t"))
    return m


def swing(frequency: float, amplitude: float) -> fb.Mechanism:
    m = fb.Mechanism("swing", planar=True, parameters={"f": frequency, "a": amplitude})
    m.add(fb.Body("block", mass=1, inertia=1), fb.Prismatic("slide", "ground", "block", at=(0, 0), axis=(1, 0)))
    m.add(fb.Driver("motor", "slide.displacement", "a*sin(2*pi*f*t)"))
    return m


def shown(m: fb.Mechanism, t_end: float, outputs: int) -> tuple[float, str]:
    r = m.simulate(t_end, outputs=outputs)
    return tuple(playback_of(r, np.arange(len(r.t))))


@pytest.mark.parametrize(
    ("duration", "frequency", "speed"),
    [
        (5.0, 1.0, 1.0),  # once a second: real time
        (5.0, 50.0, 0.02),  # 3000 rpm: once a second, played at 1/50
        (5.0, 500.0, 0.002),
        (0.03, 0.0, 0.01),  # 30 ms take 3 s at 1/100
        (0.3, 1.0, 0.1),
        (4.0, 0.0, 1.0),
        (200.0, 0.01, 10.0),  # quickened to 20 s
        (200.0, 1.0, 2.0),  # ... but not beyond what is easy to see
        (200.0, 10.0, 0.2),
    ],
)
def test_the_fastest_thing_is_easy_to_follow(duration, frequency, speed):
    assert suitable_speed(duration, frequency) == speed
    assert frequency * speed <= EASY_FREQUENCY
    assert duration / speed >= 2.0


def test_an_engine_at_3000_rpm_and_a_run_of_30_ms_are_watchable():
    assert shown(rotor("3000 rpm"), 1.0, 1001) == (0.02, "")
    speed, _ = shown(example("andrews.toml"), 0.03, 301)
    assert speed == 0.01  # 3 s


def test_a_small_fast_oscillation_counts_as_a_fast_turn_does():
    assert shown(swing(50.0, 1e-4), 1.0, 2001)[0] == 0.02
    assert shown(swing(1.0, 0.5), 5.0, 501)[0] == 1.0


def test_output_times_too_far_apart_are_named_with_how_many_would_do():
    """At 50 turns a second and 100 outputs a second: half a turn between two; eight to a turn are 401 outputs."""
    speed, remark = shown(rotor("3000 rpm"), 1.0, 101)
    assert speed == 0.02
    assert remark == (
        "rotor turns by 0.5 of a turn between two output times: too far apart to show its motion; "
        "outputs=401 would show it"
    )
    assert shown(rotor("3000 rpm"), 1.0, 401)[1] == ""
    assert shown(rotor("3000 rpm"), 1.0, 395)[1] != ""


def test_a_long_fast_motion_needs_a_shorter_run():
    """A page shows 2001 times: 250 turns, which are 5 s at 50 turns a second."""
    assert shown(rotor("3000 rpm"), 20.0, 1001)[1].endswith("2001 outputs of a motion of at most 5 s would show it")


def test_one_time_has_no_speed():
    r = rotor("60 rpm").simulate(1.0, outputs=5)
    assert tuple(playback_of(r, np.array([0]))) == (1.0, "")


def test_the_page_opens_at_that_speed_and_says_it(opened: Any) -> None:
    tab = opened(animation_html(rotor("3000 rpm").simulate(0.4, outputs=41)))
    chosen = tab.locator("select[name=speed] option:checked")
    assert chosen.inner_text() == "1/50 of real time"
    assert "0.5 of a turn between two output times" in tab.locator(".remark").inner_text()
    tab.keyboard.press("-")
    assert chosen.inner_text() == "1/100 of real time"


@pytest.mark.parametrize(
    ("typed", "words"),
    [
        ("1/300", "1/300 of real time"),
        ("0.004", "1/250 of real time"),
        ("3", "3 × real time"),
        ("7x", "7 × real time"),
        ("real time", "real time"),
        ("1/40 of real time", "1/40 of real time"),
    ],
)
def test_any_speed_can_be_typed(opened: Any, typed: str, words: str) -> None:
    tab = opened(animation_html(rotor("60 rpm").simulate(5.0, outputs=101)))
    assert tab.locator(".remark").is_hidden()
    tab.select_option("select[name=speed]", "type")
    field = tab.locator("input[name=typed-speed]")
    field.fill("fast")
    field.press("Enter")
    assert field.is_visible()  # and says what it expects
    field.fill(typed)
    field.press("Enter")
    assert tab.locator("select[name=speed] option:checked").inner_text() == words
    assert field.is_hidden()
    assert tab.errors == []


def test_every_example_has_a_speed_in_round_numbers():
    for name in ("governor.toml", "bouncing_ball.toml", "rattleback.toml", "stewart.py", "point_mass_pendulum.toml"):
        recording = record_motion(example(name).simulate(1.0, outputs=101))
        assert f"{recording.speed:.0e}"[0] in "125"
