"""Copies of a mechanism on the page: bodies and curves are listed by the groups of their names."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import flyball as fb
from flyball.view.animation import record_motion
from flyball.view.page import animation_page
from tests.layers import cached


@cached
def motion() -> fb.Result:
    arm, m = (fb.Mechanism(k, planar=True, gravity=(0, -9.81)) for k in ("arm", "pair"))
    arm.add(fb.Body("bar", mass=1, inertia=0.1, position=(0.3, 0)), fb.Revolute("A", "ground", "bar", at=(0, 0)))
    m.add(arm, prefix="left")
    m.add(arm, prefix="right", at=(1, 0), mirror="x")
    m.add(fb.Body("weight", mass=1, inertia=0.1))
    return m.simulate(0.1, outputs=11)


def test_bodies_and_curves_are_listed_by_group(opened: Callable[..., Any]) -> None:
    tab = opened(animation_page(record_motion(motion())))
    groups = tab.locator(".legend details.group")
    assert groups.locator("summary").all_inner_texts() == ["left", "right"]
    assert groups.nth(1).locator(".name").all_inner_texts() == ["right.bar"]
    assert tab.locator(".legend > ul > li:not(.folded) .name").all_inner_texts() == ["weight"]
    groups.nth(1).locator("summary").click()
    assert not groups.nth(1).locator(".name").is_visible()
    tab.evaluate("document.querySelector('.picker').hidden = false")
    tab.locator(".picker input[type=search]").fill("angle")
    folded = tab.locator(".picker details.group")
    assert folded.locator("summary").all_inner_texts() == ["left", "right"]
    assert all(name.startswith("left.") for name in folded.first.locator(".name").all_inner_texts())
    assert tab.errors == []
