"""Bodies dragged with the mouse: joints stay closed, and a spring pulls as a spring does."""

from __future__ import annotations

import time

import numpy as np
import pytest

import flyball as fb
from flyball.live.dragging import AssemblyDrag, DragTarget
from flyball.live.options import make_sliders
from flyball.live.stepping import SPRING_PHASE, LiveStepping
from tests.live.pages import FOUR_BAR, Page
from tests.mechanisms import bricard, example


def target(body: str, at, to, by_force: bool = False) -> DragTarget:
    return DragTarget(body, np.array(at, float), np.array(to, float), by_force, 0.0)


def dragged(m: fb.Mechanism) -> AssemblyDrag:
    return AssemblyDrag(m, {}, m.simulate(0.1, outputs=3), 0)


def links(result) -> np.ndarray:
    """Distances of the hinges of the four-bar from the poses of its bodies: 0 where they are closed."""

    def point(body: str, drawn, at) -> np.ndarray:
        a = result[body].angle[0]
        R = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
        return result[body].position[0] + R @ (np.array(at) - np.array(drawn))

    crank, coupler, rocker = (0, 0.1), (0.25, 0.35), (0.55, 0.25)
    return np.array(
        [
            point("crank", crank, (0, 0)),
            point("crank", crank, (0, 0.2)) - point("coupler", coupler, (0, 0.2)),
            point("coupler", coupler, (0.5, 0.5)) - point("rocker", rocker, (0.5, 0.5)),
            point("rocker", rocker, (0.6, 0)) - np.array([0.6, 0]),
        ]
    )


def test_a_dragged_four_bar_stays_closed_for_two_turns_of_its_crank():
    drag = dragged(fb.load(FOUR_BAR))
    for a in np.linspace(0.0, 4 * np.pi, 160):
        result = drag.move(target("crank", (0, 0.1, 0), (-0.3 * np.sin(a), 0.3 * np.cos(a), 0)))
        assert np.abs(links(result)).max() < 1e-9
        assert drag.closure < 1e-11
        assert result["crank"].angle[0] == pytest.approx(a, abs=0.01)  # the crank points at the mouse, turns counted
    assert result["A.angle"][0] == pytest.approx(4 * np.pi, abs=0.01)


@pytest.mark.parametrize("away", [(5, 3, 0), (-4, 0, 0), (0.2, -6, 0)])
def test_a_point_out_of_reach_comes_as_near_as_it_can(away):
    """The least distance over all positions, found by turning the crank."""
    drag = dragged(fb.load(FOUR_BAR))
    at = (0.1, 0.2, 0)
    for _ in range(60):
        result = drag.move(target("coupler", at, away))

    def where(r) -> np.ndarray:
        a, p = r["coupler"].angle, r["coupler"].position
        return np.stack(
            [p[:, 0] + np.cos(a) * at[0] - np.sin(a) * at[1], p[:, 1] + np.sin(a) * at[0] + np.cos(a) * at[1]], 1
        )

    assert np.abs(links(result)).max() < 1e-9
    turned = fb.load(FOUR_BAR).kinematics(2001, t_end=1.0)
    distances = np.linalg.norm(where(turned) - np.array(away)[:2], axis=1)
    own = np.linalg.norm(where(result)[0] - np.array(away)[:2])
    local = [d for a, d, b in zip(np.roll(distances, 1), distances, np.roll(distances, -1)) if d <= min(a, b)]
    assert min(abs(own - d) for d in local) < 1e-4


@pytest.mark.parametrize(
    ("make", "body"),
    [
        (bricard, None),
        (lambda: example("spatial_four_bar.toml"), "coupler"),
        (lambda: example("peaucellier.toml"), "crank"),
        (lambda: example("planetary.py"), "carrier"),
        (lambda: example("rolling_disk.toml"), None),
        (lambda: example("quick_return.toml"), "crank"),
    ],
)
def test_loops_gears_and_redundant_joints_stay_closed(make, body):
    m = make()
    drag, rng = dragged(m), np.random.default_rng(1)
    body = body or m.bodies[0].name
    start = m.assemble()
    for _ in range(12):
        to = rng.uniform(-1, 1, 3) * (1, 1, 0 if m.planar else 1)
        drag.move(target(body, (0.05, 0.02, 0), to))
        assert drag.closure < 1e-9
    assert start is not None


def test_the_message_of_a_drag_shows_a_closed_position():
    page = Page(fb.load(FOUR_BAR))
    assert page.drag("crank", [0, 0.1, 0], [0.3, 0.0, 0], t=0.3) == ["motion"]
    assert page.newest["motion"]["restart"] is True
    assert page.drag("crank", [0, 0.1, 0], [0.3, -0.1, 0], t=0.3) == ["motion"]
    assert page.newest["motion"]["restart"] is False
    assert page.newest["motion"]["closure"] < 1e-9
    assert page.ask("release") == []


def test_what_has_no_freedom_says_so():
    m = fb.Mechanism("frame", planar=True)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Fixed("f", "ground", "b", at=(0, 0)))
    page = Page(m)
    assert page.drag("b", [0, 0, 0], [1, 1, 0]) == ["error"]
    assert "its joints leave that point no motion" in page.text


# ---- by a spring


def stone(gravity: float) -> fb.Mechanism:
    m = fb.Mechanism("stone", planar=True, gravity=(0, gravity))
    m.add(fb.Body("stone", mass=3.0, inertia=0.2, position=(0, 0)))
    return m


def pull(x: LiveStepping, at: DragTarget, steps: int) -> fb.Result:
    return x.motion([x.advance({}, at, 1, 1.0)[-1] for _ in range(steps)])


def test_a_pulled_body_hangs_below_the_mouse_by_its_weight_over_the_stiffness():
    """k = m w^2 with w = SPRING_PHASE / dt: it hangs by g / w^2."""
    dt = 1 / 60
    x = LiveStepping(stone(-9.81), {}, dt)
    result = pull(x, target("stone", (0, 0, 0), (0.5, 0.2, 0), True), 400)
    sag = 9.81 * (dt / SPRING_PHASE) ** 2
    np.testing.assert_allclose(result["stone"].position[-1], [0.5, 0.2 - sag], atol=1e-6)
    assert np.abs(result["stone"].velocity[-1]).max() < 1e-6


def test_a_body_pulled_at_its_rim_comes_to_hang_from_that_point():
    x = LiveStepping(stone(-9.81), {}, 1 / 60)
    result = pull(x, target("stone", (0.3, 0, 0), (0.0, 1.0, 0), True), 60)
    assert np.isfinite(result["stone"].position).all()
    a, p = result["stone"].angle, result["stone"].position
    grip = p + 0.3 * np.stack([np.cos(a), np.sin(a)], 1)
    assert np.linalg.norm(grip[-20:] - (0, 1), axis=1).max() < 0.2


@pytest.mark.parametrize(
    "name", ["governor.toml", "spatial_four_bar.toml", "rope_pendulum.toml", "planetary.py", "heavy_top.toml"]
)
def test_pulling_is_stable_for_bodies_in_mechanisms(name):
    m = example(name)
    x = LiveStepping(m, make_sliders(m), 1 / 120)
    body = m.bodies[-1].name
    sliders = make_sliders(m)
    at = target(body, (0, 0, 0), (0.1, 0.1, 0.0 if m.planar else 0.1), True)
    result = x.motion([x.advance(sliders, at, 1, 1.0)[-1] for _ in range(240)])
    assert np.isfinite(result.v).all()
    assert np.abs(result[body].position).max() < 10.0


def test_a_driven_body_does_not_give_way():
    page = Page(fb.load(FOUR_BAR))
    page.ask("start")
    page.session.receive('{"do": "drag", "body": "crank", "at": [0, 0.1, 0], "to": [1, 1, 0], "by": "force", "t": 0}')
    for _ in range(20):
        if "error" in page.ask("shown"):
            break
        time.sleep(0.02)
    assert "does not give way at this point: joints or drivers hold it" in page.text


def test_sets_of_bodies_move_while_stepping():
    m = fb.Mechanism("rain", gravity=(0, 0, -9.81))
    m.add(fb.Bodies("drops", shape=fb.Sphere(radius=0.01), density=1000, position=[(0, 0, 1), (1, 0, 2)]))
    m.add(fb.Contact(friction=0))
    x = LiveStepping(m, {}, 0.01)
    result = x.motion([x.advance({}, None, 1, 1.0)[-1] for _ in range(10)])
    t = result.t
    fall = result.bulk["drops"].position[:, :, 2]
    np.testing.assert_allclose(fall - [1, 2], np.tile(-0.5 * 9.81 * t**2, (2, 1)).T, atol=0.5 * 9.81 * 0.01 * t[-1])
