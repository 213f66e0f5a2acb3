"""By what a motion with contact is computed where nothing is said: from touch to touch, or by steps of impulses."""

from __future__ import annotations

import re

import numpy as np
import pytest

import flyball as fb
from flyball.simulation import method_choice

G = 9.81
ADAPTIVE, STEPS = "dop853, event-driven", "impulse time stepping"


def floor(planar=False):
    return fb.Ground("floor", shape=fb.Plane(normal=(0, 1) if planar else (0, 0, 1)))


def box(name="box", at=(0, 0, 0.1), **more):
    return fb.Body(name, shape=fb.Box(edges=(0.4, 0.3, 0.2)), density=500, position=at, **more)


def ball(name="ball", at=(0, 0, 0.5), **more):
    return fb.Body(name, shape=fb.Sphere(radius=0.1), density=1000, position=at, **more)


def scene(*parts, planar=False, **contact):
    m = fb.Mechanism("scene", planar=planar, gravity=(0, -G) if planar else (0, 0, -G))
    m.add(floor(planar), *parts, fb.Contact(**{"friction": 0.3} | contact))
    return m


def test_few_places_are_gone_through_from_touch_to_touch():
    run = scene(ball(), restitution=0.5).simulate(0.4, outputs=3)
    assert run.health.method == ADAPTIVE
    assert ("method", ADAPTIVE) in run.health.lines()
    assert run.events[0].t == pytest.approx(np.sqrt(2 * 0.4 / G), rel=1e-9)


def test_without_contact_nothing_is_said():
    m = fb.Mechanism("fall", gravity=(0, 0, -G))
    m.add(ball())
    assert m.simulate(0.1, outputs=2).health.method == ""


@pytest.mark.parametrize(
    ("parts", "why"),
    [
        ([box(f"b{k}", (k, 0, 0.1)) for k in range(7)], r"at more than|the box of 'b0' on the box of 'b1'"),
        ([ball(f"b{k}", (k, 0, 0.1)) for k in range(10)], "at 55 points, too many"),
        ([fb.Bodies("balls", shape=fb.Sphere(radius=0.1), density=1000, position=[(0, 0, 1)])], "is many bodies"),
    ],
)
def test_many_or_unknown_places_are_left_to_steps(parts, why):
    run = scene(*parts).simulate(0.01, outputs=2)
    assert run.health.method.startswith(STEPS + ": ")
    assert re.search(why, run.health.method)


def test_what_only_an_integration_knows_decides(monkeypatch):
    monkeypatch.setattr(method_choice, "FEW", 2)
    many = [ball(f"b{k}", (k, 0, 0.1)) for k in range(2)]
    m = scene(*many)
    m.add(fb.Event("late", "t > 0.005", do=[fb.Stop()]))
    run = m.simulate(0.01, outputs=2)
    assert run.t[-1] == pytest.approx(0.005)
    assert run.health.method == f"{ADAPTIVE}: {STEPS} does not support Event 'late'"
    m = scene(*many)
    assert m.simulate(0.01, outputs=2, rtol=1e-9).health.method.endswith("impulse time stepping does not support rtol=")
    assert m.simulate(0.01, outputs=2, coordinates="joint").health.method.startswith(ADAPTIVE)
    assert m.simulate(0.01, outputs=2, max_step=0.01).health.method.startswith(STEPS)


@pytest.mark.parametrize("more", [{"rtol": 1e-9}, {"max_steps": 1000}, {"specialize": True}, {"coordinates": "joint"}])
def test_what_no_method_knows_is_refused_by_name(more):
    m = scene(fb.Body("egg", shape=fb.Ellipsoid(semi_axes=(0.1, 0.1, 0.2)), density=1000, position=(0, 0, 1)))
    with pytest.raises(fb.ModelError, match=rf"the ellipsoid of 'egg'(?s:.*){next(iter(more))}(?s:.*)Leave one"):
        m.simulate(0.1, **more)
    name = next(iter(more))
    with pytest.raises(fb.ModelError, match=f"{name}.*does nothing with impulse|leave coordinates out"):
        m.simulate(0.1, method="impulse", **more)


def test_events_by_impulses_are_refused():
    m = scene(ball())
    m.add(fb.Event("late", "t > 0.005"))
    with pytest.raises(
        fb.ModelError, match=r"impulse time stepping does not support Event 'late'; the adaptive(?s:.*)leave method out"
    ):
        m.simulate(0.1, method="impulse")


@pytest.mark.parametrize(("called", "meant"), [("impulses", "impulse"), ("dop583", "dop853"), ("RK45", "rk45")])
def test_a_method_by_another_name(called, meant):
    with pytest.raises(fb.ModelError, match=rf"unknown method '{called}' \(did you mean '{meant}'\?\); choose one of"):
        scene(ball()).simulate(0.1, method=called)


@pytest.mark.parametrize("off", [0.0, 1e-9, -1e-9, -1e-6])
def test_what_is_put_on_the_ground_rests(off):
    """At its height, to rounding, above and below: it lies there, and its weight is carried."""
    b = fb.Body("box", shape=fb.Box(edges=(0.4, 0.3, 0.2)), density=500, position=(0.3, 0.15 + off))
    run = scene(b, planar=True).simulate(0.1, outputs=3)
    assert run.health.method == ADAPTIVE
    p = run["box"].position
    assert np.allclose(p[:, -1], 0.15, rtol=0, atol=1e-8)
    assert np.abs(p - p[0]).max() < 1e-8
    assert run["box"].contact_force[-1, -1] == pytest.approx(500 * 0.024 * G, rel=1e-8)
    assert bool(run.health.warnings) == (off == -1e-6)


@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("off", [0.0, -1e-9])
def test_a_box_in_space_rests(friction, off):
    """With friction its corners share it in many ways: by steps."""
    run = scene(box(at=(0, 0, 0.1 + off)), friction=friction).simulate(0.1, outputs=3)
    assert run.health.method.startswith(STEPS if friction else ADAPTIVE)
    assert ("share friction among 8 corners is not determined" in run.health.method) == (friction > 0)
    assert np.allclose(run["box"].position, (0, 0, 0.1), rtol=0, atol=1e-8)


def test_a_stack_that_overlaps_by_rounding_stands():
    low, top = box("low", (0, 0.15 - 1e-8)), box("top", (0.02, 0.45 - 3e-8))
    run = scene(low, top, planar=True).simulate(0.1, outputs=2)
    assert run.health.method == ADAPTIVE
    assert run["low.y"][-1] == pytest.approx(0.15, abs=1e-10)
    assert run["top.y"][-1] == pytest.approx(0.45, abs=1e-10)
    assert not run.health.warnings


def test_what_is_deep_in_something_is_left_to_steps():
    m = scene(ball(at=(0, 0, 0.09)))
    run = m.simulate(0.02, outputs=2)
    assert run.health.method.startswith(f"{STEPS}, since")
    assert "ground and 'ball' overlap at the start by 0.01 m" in run.health.method
    assert run["ball.z"][-1] == pytest.approx(0.1, abs=1e-5)
    with pytest.raises(fb.ModelError, match=r"Touch 'floor-ball'.* overlap at the start by 0.01 m; move one"):
        m.simulate(0.02, method="dop853")
    m.add(fb.Event("late", "t > 0.005"))
    with pytest.raises(fb.ModelError, match=r"overlap at the start"):
        m.simulate(0.02)


def test_a_motion_by_impulses_goes_on_by_impulses():
    m = scene(ball())
    first = m.simulate(0.1, outputs=2, method="impulse")
    assert m.simulate(0.2, outputs=2, start=first).health.method == (
        f"{STEPS}: as in the motion that this one continues"
    )
    assert m.simulate(0.2, outputs=2, start=m.simulate(0.1, outputs=2)).health.method == ADAPTIVE
