"""Bodies dragged with the mouse: joints stay closed, and a spring pulls as a spring does."""

from __future__ import annotations

import time

import numpy as np
import pytest

import flyball as fb
from flyball.assembly.compiled_mechanism import compile_mechanism
from flyball.live.body_points import connected_mass, effective_mass
from flyball.live.dragging import AssemblyDrag, DragTarget
from flyball.live.options import make_sliders
from flyball.live.stepping import SPRING_FREQUENCY, LiveStepping
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
    """k = m w^2 with w = SPRING_FREQUENCY / dt: it hangs by g / w^2."""
    dt = 1 / 60
    x = LiveStepping(stone(-9.81), {}, dt)
    result = pull(x, target("stone", (0, 0, 0), (0.5, 0.2, 0), True), 400)
    sag = 9.81 * (dt / SPRING_FREQUENCY) ** 2
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


def test_a_driven_body_cannot_be_pulled():
    page = Page(fb.load(FOUR_BAR))
    page.ask("start")
    page.session.receive('{"do": "drag", "body": "crank", "at": [0, 0.1, 0], "to": [1, 1, 0], "by": "force", "t": 0}')
    for _ in range(20):
        if "error" in page.ask("shown"):
            break
        time.sleep(0.02)
    assert "cannot be pulled at this point: its joints and drivers leave it no motion" in page.text


def pendulum() -> fb.Mechanism:
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, -9.81))
    m.add(
        fb.Body("rod", mass=2.0, inertia=0.3, com=(0.5, 0), position=(0, 0)),
        fb.Revolute("A", "ground", "rod", at=(0, 0)),
    )
    return m


def test_the_effective_mass_of_a_pinned_rod_is_its_moment_of_inertia_over_the_squared_distance():
    m = fb.Mechanism("rod", planar=True)
    m.add(
        fb.Body("rod", mass=2.0, inertia=0.3, com=(0.5, 0), position=(0, 0)),
        fb.Revolute("A", "ground", "rod", at=(0, 0)),
    )
    c = compile_mechanism(m.snapshot(), solved=False)
    c.at(0.0, c.values.q, np.zeros(3))
    about_the_pin = 0.3 + 2.0 * 0.5**2
    for r in (0.1, 0.5, 1.5):
        assert effective_mass(c, "rod", np.array([r, 0, 0])) == pytest.approx(about_the_pin / r**2, rel=1e-12)
    assert effective_mass(c, "rod", np.zeros(3)) == np.inf
    assert connected_mass(c, "rod") == 2.0


def slider_crank(angle: float) -> fb.Mechanism:
    m = fb.Mechanism("slider crank", planar=True, gravity=(0, 0))
    m.add(fb.Body("crank", mass=1, position=(0, 0), com=(0.1, 0), inertia=0.01))
    m.add(fb.Body("rod", mass=1, position=(0.2, 0), com=(0.3, 0), inertia=0.02))
    m.add(fb.Body("slider", mass=0.5, position=(0.8, 0), inertia=1e-3))
    m.add(fb.Revolute("A", "ground", "crank", at=(0, 0)), fb.Revolute("B", "crank", "rod", at=(0.2, 0)))
    m.add(fb.Revolute("C", "rod", "slider", at=(0.8, 0)))
    m.add(fb.Prismatic("D", "ground", "slider", at=(0.8, 0), axis=(1, 0)), fb.Initial("A.angle", value=angle, rate=0))
    return m


@pytest.mark.parametrize("angle", [0.003, 0.02, 0.2])
def test_a_slider_pulled_from_near_its_dead_centre_comes_to_the_mouse(angle):
    """The energy is at most that of the spring with the mass of all bodies, at the distance of the start."""
    dt = 1 / 60
    x = LiveStepping(slider_crank(angle), {}, dt)
    result = pull(x, target("slider", (0, 0, 0), (0.6, 0, 0), True), 600)
    assert result["slider"].position[-1, 0] == pytest.approx(0.6, abs=1e-6)
    spring = 0.5 * 2.5 * (SPRING_FREQUENCY / dt * 0.2) ** 2
    assert 0.0 < result.energy.kinetic.max() < spring
    assert result.energy.kinetic[-1] < 1e-12 * spring


def test_a_box_that_rests_on_the_floor_with_friction_is_pulled_and_lifted():
    m = fb.Mechanism("box", gravity=(0, 0, -9.81))
    m.add(fb.Body("box", mass=1, position=(0, 0, 0.1), inertia=(0.01, 0.01, 0.01), shape=fb.Box(edges=(0.2, 0.2, 0.2))))
    m.add(fb.Ground("floor", shape=fb.Plane()), fb.Contact(friction=0.5))
    dt = 1 / 60
    x = LiveStepping(m, {}, dt)
    result = pull(x, target("box", (0, 0, 0), (1.0, 0, 0.5), True), 200)
    sag = 9.81 * (dt / SPRING_FREQUENCY) ** 2
    np.testing.assert_allclose(result["box"].position[-1], [1.0, 0, 0.5 - sag], atol=2e-3)


@pytest.mark.parametrize("planar", [True, False])
def test_a_point_mass_is_stepped_and_pulled(planar):
    m = fb.Mechanism("point", planar=planar, gravity=(0, -9.81) if planar else (0, -9.81, 0))
    m.add(fb.Body("p", mass=2, inertia=0))
    x = LiveStepping(m, {}, 1 / 60)
    fall = x.motion([x.advance({}, None, 1, 1.0)[-1] for _ in range(6)])
    assert fall["p"].position[-1, 1] == pytest.approx(-0.5 * 9.81 * 0.1**2)
    hangs = pull(x, target("p", (0, 0, 0), (0.5, 0, 0), True), 400)
    np.testing.assert_allclose(hangs["p"].position[-1, :2], [0.5, -9.81 * (1 / 60 / SPRING_FREQUENCY) ** 2], atol=1e-6)


def test_a_speed_beyond_what_can_be_computed_omits_steps_and_says_so():
    x = LiveStepping(pendulum(), {}, 1 / 60)
    x.advance({}, None, 1, 1.0)
    x.begin_pace()
    time.sleep(0.01)
    last = x.advance({}, None, None, 1e9)[-1]
    assert last.t == x.sample().t < 1e6
    assert "of real time and not 1e+09" in x.slow_remark()


def test_sets_of_bodies_move_while_stepping():
    m = fb.Mechanism("rain", gravity=(0, 0, -9.81))
    m.add(fb.Bodies("drops", shape=fb.Sphere(radius=0.01), density=1000, position=[(0, 0, 1), (1, 0, 2)]))
    m.add(fb.Contact(friction=0))
    x = LiveStepping(m, {}, 0.01)
    result = x.motion([x.advance({}, None, 1, 1.0)[-1] for _ in range(10)])
    t = result.t
    fall = result.bulk["drops"].position[:, :, 2]
    np.testing.assert_allclose(fall - [1, 2], np.tile(-0.5 * 9.81 * t**2, (2, 1)).T, atol=0.5 * 9.81 * 0.01 * t[-1])
