"""Contact in motions that go from touch to touch, against closed forms."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

import flyball as fb
from flyball.constraints.switches.contact_slip import SLIP
from flyball.constraints.switches.stop import STOP
from flyball.engine.loads import ONSET_LENGTH, ONSET_SPEED, direction_in_space
from flyball.numerics.complementarity.dense_problem import AT_REST, FRICTION_DISC, FRICTION_DISC_2, UNILATERAL
from flyball.simulation.events import instant_problem
from flyball.simulation.events.instant_problem import ProblemRow
from flyball.tables.table_definitions import SwitchNumbers

G = 9.81
TIGHT = {"method": "dop853", "rtol": 1e-11, "atol": 1e-12}


def scene(*parts, planar=False, gravity=None, **contact):
    usual = (0, -G) if planar else (0, 0, -G)
    m = fb.Mechanism("scene", planar=planar, gravity=usual if gravity is None else gravity)
    m.add(*parts, fb.Contact(**contact))
    return m


def floor(planar=False):
    return fb.Ground("floor", shape=fb.Plane(normal=(0, 1) if planar else (0, 0, 1)))


@pytest.mark.parametrize("planar", [False, True])
def test_a_ball_bounces_to_rest(planar):
    """Times, heights and the sum of the series t1 (1 + e) / (1 - e); then it lies there."""
    r, h, e = 0.1, 0.5, 0.6
    at = (0.0, r + h) if planar else (0.0, 0.0, r + h)
    ball = fb.Body("ball", shape=fb.Sphere(radius=r), density=1000, position=at)
    first = np.sqrt(2 * h / G)
    tops = first * (1 + 2 * np.cumsum(e ** np.arange(1, 9))) - first * e ** np.arange(1, 9)
    whole = first * (1 + e) / (1 - e)
    times = [0.0, *tops, whole + 0.1, whole + 1.0]
    run = scene(floor(planar), ball, planar=planar, friction=0.3, restitution=e).simulate(
        whole + 1.0, outputs=times, **TIGHT
    )
    z = run["ball"].position[:, -1]
    assert np.allclose(z[1:9], r + h * e ** (2 * np.arange(1, 9)), rtol=0, atol=1e-8)
    assert np.allclose(z[-2:], r, rtol=0, atol=1e-12)
    hits = np.array([x.t for x in run.events])
    assert np.allclose(hits[:8], first * (1 + 2 * np.r_[0.0, np.cumsum(e ** np.arange(1, 8))]), rtol=0, atol=1e-8)
    assert abs(next(x.t for x in run.events if x.kind == "rest") - whole) < 1e-9
    weight = G * run.values.bodies["ball"].mass
    assert np.isclose(run["floor-ball"].normal[-1], weight, rtol=1e-9)
    assert np.allclose(run["ball"].contact_force[-1], weight * np.eye(len(at))[-1], atol=1e-9 * weight)
    assert np.abs(run.energy.balance).max() < 1e-9 * weight * h


def test_a_ball_with_backspin_slides_then_rolls():
    """Slip dies at 7/2 mu g; then it rolls at v - 2/7 of the first slip (Coriolis 1835)."""
    r, mu, v, w = 0.1, 0.2, np.array([3.0, 0.0, 0.0]), np.array([4.0, -30.0, 2.0])
    ball = fb.Body("ball", shape=fb.Sphere(radius=r), density=1000, position=(0, 0, r), velocity=v, angular_velocity=w)
    slip = v + np.cross(w, (0, 0, -r))
    speed = np.linalg.norm(slip)
    rolls = speed / (3.5 * mu * G)
    run = scene(floor(), ball, friction=mu).simulate(
        2 * rolls, outputs=[0.0, 0.5 * rolls, 1.5 * rolls, 2 * rolls], **TIGHT
    )
    d = slip / speed
    path = v * 0.5 * rolls - 0.5 * mu * G * (0.5 * rolls) ** 2 * d
    assert np.allclose(run["ball"].position[1, :2], path[:2], rtol=0, atol=1e-9)
    assert np.allclose(run["ball"].velocity[-1], v - 2 / 7 * slip, rtol=0, atol=1e-9)
    assert any(abs(x.t - rolls) < 1e-8 for x in run.events)
    touch, weight = run["floor-ball"], G * run.values.bodies["ball"].mass
    assert np.allclose(touch.friction, (mu * weight, mu * weight, 0.0, 0.0), rtol=0, atol=1e-8 * weight)
    assert np.allclose(touch.slip, (speed, 0.5 * speed, 0.0, 0.0), rtol=0, atol=1e-9)
    assert np.allclose(run.contacts.at(0.5 * rolls).force[0], (*-mu * weight * d[:2], weight), rtol=1e-9)
    assert np.isclose(touch.work[-1], -0.5 * weight / G * 2 / 7 * speed**2, rtol=1e-9)
    assert np.abs(run.energy.balance).max() < 1e-9 * run.energy.kinetic[0]


@pytest.mark.parametrize("static", [0.3, 0.4])
@pytest.mark.parametrize("heading", [0.6, 2.2, -1.0])
def test_a_ball_that_is_pulled_faster_and_faster_begins_to_slip(heading, static):
    """Rolling takes 2/7 of the force m c t: up to 7/2 mu0 g / c; then a = c t - mu g, all along the force."""
    r, mu, c = 0.1, 0.3, 20.0
    d = np.array([np.cos(heading), np.sin(heading)])
    ball = fb.Body("ball", shape=fb.Sphere(radius=r), mass=2, position=(0, 0, r))
    pull = fb.PointForce("pull", "ball", force=(f"{2 * c * d[0]}*t", f"{2 * c * d[1]}*t", 0))
    slips = 3.5 * static * G / c
    end = slips + 0.2
    m = scene(floor(), ball, pull, friction=mu, static_friction=static)
    run = m.simulate(end, outputs=[0.0, slips, slips + 0.01, end], **TIGHT)
    t = run.t
    since = np.maximum(t - slips, 0.0)
    rolled = np.minimum(t, slips)
    x = 5 * c / 42 * rolled**3 + 5 * c / 14 * rolled**2 * since
    x += c * (slips * since**2 / 2 + since**3 / 6) - mu * G * since**2 / 2
    slip = c / 2 * (t**2 - slips**2) - 3.5 * mu * G * since
    assert np.allclose(run["ball"].position[:, :2], np.outer(x, d), rtol=0, atol=1e-8)
    turning = 5 / 14 * c * rolled**2 + 2.5 * mu * G * since
    assert np.allclose(run["ball"].angular_velocity[:, :2] * r, np.outer(turning, (-d[1], d[0])), rtol=0, atol=1e-7)
    assert np.allclose(run["floor-ball"].slip[2:], slip[2:], rtol=0, atol=1e-7)
    assert np.allclose(run.contacts.at(end).force[0], (*-mu * 2 * G * d, 2 * G), rtol=0, atol=1e-6)


def braked_wheel():
    """A wheel that a driver holds, and a brake on it: friction on what nothing free moves."""
    wheel = fb.Body("wheel", mass=1.0, inertia=1.0, position=(5, 5))
    turn = fb.Revolute("W", "ground", "wheel", at=(5, 5))
    return wheel, turn, fb.Driver("held", "W.angle", "0*t"), fb.Brake("brake", "W.angle", capacity=2.0)


@pytest.mark.parametrize("beside", [(), braked_wheel()], ids=["alone", "beside a braked wheel"])
@pytest.mark.parametrize("steep", [0.4, 0.8])
def test_a_block_thrown_up_a_slope(steep, beside):
    """It stops after v / (g (sin + mu cos)), stays if mu > tan, else slides back at g (sin - mu cos)."""
    mu, v = 0.5, 2.0
    g = G * np.array([-np.sin(steep), -np.cos(steep)])
    block = fb.Body("block", shape=fb.Box(edges=(0.4, 0.1, 0.1)), density=500, position=(0, 0.05), velocity=(v, 0))
    m = scene(floor(True), block, *beside, planar=True, gravity=g, friction=mu)
    up = G * (np.sin(steep) + mu * np.cos(steep))
    down = max(0.0, G * (np.sin(steep) - mu * np.cos(steep))) if mu < np.tan(steep) else 0.0
    stops = v / up
    run = m.simulate(stops + 0.5, outputs=[0.0, 0.5 * stops, stops, stops + 0.5], **TIGHT)
    top = 0.5 * v * stops
    assert np.allclose(run["block.x"][1], 0.75 * top, rtol=0, atol=1e-9)
    assert np.allclose(run["block.x"][2:], (top, top - 0.5 * down * 0.25), rtol=0, atol=1e-9)
    assert abs(next(x.t for x in run.events if x.t > 0.0) - stops) < 1e-8
    assert np.allclose(run["block.y"], 0.05, rtol=0, atol=1e-12)


def test_the_lower_of_two_blocks_is_pulled_away():
    """mu1 between the blocks, mu2 on the floor: a2 = mu1 g, a1 = (F - mu1 m2 g - mu2 (m1 + m2) g) / m1."""
    low = fb.Body("low", shape=fb.Box(edges=(1.0, 0.2, 0.1)), mass=2.0, position=(0, 0.1), material="steel")
    top = fb.Body("top", shape=fb.Box(edges=(0.2, 0.2, 0.1)), mass=1.0, position=(0, 0.3), material="wood")
    m = fb.Mechanism("stack", planar=True, gravity=(0, -G))
    m.add(floor(True), fb.Material("steel", friction=0.2), fb.Material("wood", friction=0.2))
    m.add(low, top, fb.MaterialPair("steel", "wood", friction=0.3))
    m.add(fb.Contact(friction=0.2), fb.PointForce("pull", "low", force=("20 N", 0), at=(0, 0.1)))
    t = 0.2
    run = m.simulate(t, outputs=[0.0, t], **TIGHT)
    slow, fast = 0.3 * G, (20.0 - 0.3 * G - 0.2 * 3 * G) / 2.0
    assert np.allclose(
        (run["top.x"][-1], run["low.x"][-1]), (0.5 * slow * t * t, 0.5 * fast * t * t), rtol=0, atol=1e-9
    )
    assert np.allclose((run["top.y"][-1], run["low.y"][-1]), (0.3, 0.1), rtol=0, atol=1e-11)


def test_a_block_rocks():
    """Housner (1963): each impact leaves 1 - 3/2 sin^2 alpha of the angular velocity; times by quadrature."""
    b, h = 0.1, 0.4
    R, alpha, tilt = np.hypot(b, h), np.arctan2(b, h), 0.1
    corner = np.array([b, 0.0])
    c, s = np.cos(-tilt), np.sin(-tilt)
    middle = corner + np.array([[c, -s], [s, c]]) @ np.array([-b, h])
    block = fb.Body("block", shape=fb.Box(edges=(2 * b, 2 * h, 0.1)), density=1000, position=middle, angle=-tilt)
    square = 3 * G / (4 * R)
    # theta' of the angle that is left, from rest at tilt: with theta = tilt - u^2 the root is smooth at the start
    rate = lambda a: np.sqrt(2 * square * (np.cos(alpha - tilt) - np.cos(alpha - a)))  # noqa: E731
    quarter = quad(lambda u: 2 * u / rate(tilt - u * u), 0, np.sqrt(tilt), epsabs=1e-13, epsrel=1e-13)[0]
    ratio = 1 - 1.5 * np.sin(alpha) ** 2
    hit = rate(0.0)
    m = scene(floor(True), block, planar=True, friction=5.0)
    run = m.simulate(quarter + 0.02, outputs=[0.0, 0.5 * quarter, quarter + 0.02], **TIGHT)
    first = next(x for x in run.events if x.kind == "impact")
    assert abs(first.t - quarter) < 1e-8
    after = first.after["block.omega"]
    assert np.isclose(after, ratio * hit, rtol=1e-8)


def test_two_balls_collide_elastically():
    r = 0.1
    a = fb.Body("a", shape=fb.Sphere(radius=r), mass=2.0, position=(0, 0, 0), velocity=(1.0, 0, 0))
    b = fb.Body("b", shape=fb.Sphere(radius=r), mass=1.0, position=(1.0, 0.1, 0.05))
    run = scene(a, b, gravity=(0, 0, 0), friction=0.0, restitution=1.0).simulate(2.0, outputs=3, **TIGHT)
    across = np.array([0.0, 0.1, 0.05])
    along = np.sqrt(4 * r * r - across @ across)
    n = np.array([along, *across[1:]]) / (2 * r)
    push = 2 * 2.0 * 1.0 / 3.0 * n[0] * n
    assert abs(run.events[0].t - (1.0 - along)) < 1e-9
    assert np.allclose(run["a"].velocity[-1], np.array([1.0, 0, 0]) - push / 2.0, rtol=0, atol=1e-9)
    assert np.allclose(run["b"].velocity[-1], push, rtol=0, atol=1e-9)
    assert len(run.events) == 1


R_HILL, R_BALL, START = 1.0, 0.1, 0.05


def on_a_hill(friction):
    """Where a ball from rest at START leaves a fixed ball: the cosine."""
    hill = fb.Ground("hill", shape=fb.Sphere(radius=R_HILL))
    p = (R_HILL + R_BALL) * np.array([np.sin(START), np.cos(START)])
    ball = fb.Body("ball", mass=1.0, inertia=0.4 * R_BALL**2, shape=fb.Sphere(radius=R_BALL), position=p)
    run = scene(hill, ball, planar=True, friction=friction).simulate(1.6, outputs=2, **TIGHT)
    left = next(x for x in run.events if x.kind == "part")
    return left.after["ball.y"] / (R_HILL + R_BALL)


def test_a_smooth_ball_leaves_a_hill():
    """At cos = 2/3 of that of the start."""
    assert np.isclose(on_a_hill(0.0), 2 / 3 * np.cos(START), rtol=0, atol=1e-9)


def test_a_rough_ball_leaves_a_hill():
    """Rolling where cos = 10/17 of that of the start; friction 1e4 lets it slip for the last 12 microseconds."""
    assert np.isclose(on_a_hill(1e4), 10 / 17 * np.cos(START), rtol=0, atol=1e-5)


def test_a_ball_rolls_slips_and_leaves_a_hill():
    """Beside an integration by SciPy of both motions."""
    mu, L = 0.5, R_HILL + R_BALL
    grip = lambda t, y: 2 / 7 * G * np.sin(y[0]) - mu * (G * np.cos(y[0]) - L * y[1] ** 2)  # noqa: E731
    pull = lambda t, y: G * np.cos(y[0]) - L * y[1] ** 2  # noqa: E731
    grip.terminal = pull.terminal = True
    usual = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-14}
    rolls = solve_ivp(lambda t, y: (y[1], 5 / 7 * G / L * np.sin(y[0])), (0, 2), (START, 0.0), events=grip, **usual)
    slides = solve_ivp(
        lambda t, y: (y[1], (G * np.sin(y[0]) - mu * (G * np.cos(y[0]) - L * y[1] ** 2)) / L),
        (0, 2), rolls.y[:, -1], events=pull, **usual,
    )  # fmt: skip
    assert np.isclose(on_a_hill(mu), np.cos(slides.y[0, -1]), rtol=0, atol=1e-8)


def test_a_block_slides_off_a_table():
    """Its corner passes the edge, then the table's corner carries it; it tips when its middle passes the edge."""
    table = fb.Ground("table", shape=fb.Box(edges=(2.0, 1.0, 0.1)), position=(0, -0.5))
    box = fb.Body("b", shape=fb.Box(edges=(0.4, 0.2, 0.1)), density=500, position=(0.5, 0.1), velocity=(2.0, 0))
    run = scene(table, box, planar=True, friction=0.0).simulate(1.0, outputs=[0.0, 0.2, 0.25, 1.0], **TIGHT)
    t = [x.t for x in run.events if x.kind == "part"]
    assert np.allclose(t[:2], (0.15, 0.25), rtol=0, atol=1e-9)
    assert np.allclose(run["b"].position[:3], [(0.5, 0.1), (0.9, 0.1), (1.0, 0.1)], rtol=0, atol=1e-10)
    assert run["b"].angle[-1] < -0.5
    assert np.isclose(run.energy.total[-1], run.energy.total[0], rtol=1e-10)


def test_the_same_by_short_impulses():
    """A box thrown onto the floor, tumbling, with friction: impulse time stepping come nearer as they get shorter."""
    ball = fb.Body("ball", shape=fb.Sphere(radius=0.1), density=1000, position=(0, 0, 0.4), velocity=(1, 0.3, 0),
                   angular_velocity=(3, 20, 5))  # fmt: skip
    m = scene(floor(), ball, friction=0.2, restitution=0.5)
    exact = m.simulate(1.2, outputs=[0.0, 1.2], **TIGHT)["ball"].position[-1]
    miss = [
        np.linalg.norm(m.simulate(1.2, outputs=[0.0, 1.2], method=fb.Stepping(step=h))["ball"].position[-1] - exact)
        for h in (4e-3, 5e-4)
    ]
    assert miss[1] < 0.3 * miss[0] < 0.01


@pytest.mark.parametrize("layer", ["absolute", "joint"])
@pytest.mark.parametrize("e", [0.0, 0.5, 0.8, 1.0])
def test_newtons_cradle_whose_struck_balls_leave_together(e, layer):
    """Of four the three that rest touch: they are struck as one, leave with (1 + e) / 4 of the speed, and swing as one."""
    m = fb.Mechanism("cradle", planar=True, gravity=(0, -G))
    for i in range(4):
        m.add(fb.Body(f"b{i}", position=(0.2 * i, -1), shape=fb.Sphere(radius=0.1), mass=1))
        m.add(fb.Revolute(f"J{i}", "ground", f"b{i}", at=(0.2 * i, 0)))
    m.add(fb.Initial("J0.angle", value=-0.5), fb.Contact(friction=0, restitution=e))
    run = m.simulate(1.4, outputs=15, rtol=1e-9, coordinates=layer)
    rate, angle = (np.array([run[f"J{i}.{what}"] for i in range(4)]) for what in ("rate", "angle"))
    height = 0.5 * 1.004 * rate[:, -1] ** 2 / G + 1 - np.cos(angle[:, -1])
    if 0 < e < 1:
        share = np.array([1 - 3 * e, 1 + e, 1 + e, 1 + e]) / 4
        assert height == pytest.approx(share**2 * (1 - np.cos(0.5)), abs=1e-8)
    assert np.ptp(angle[1:3], axis=0).max() < 1e-9 and len(run.events) < 10 and not run.health.warnings


@pytest.mark.parametrize("at", [(0.2, 0.0, 0.0), (0.0, 0.2, 0.0), (0.12, 0.16, 0.0)])
def test_a_ball_goes_round_another(at):
    """Pressed by 3 N: N = 3 - m v^2 / (2 r), also where their middles are exactly level."""
    out = np.array(at) / 0.2
    along = np.cross((0, 0, 1), out)
    m = scene(
        fb.Ground("post", shape=fb.Sphere(radius=0.1)),
        fb.Body("ball", shape=fb.Sphere(radius=0.1), mass=2, position=at, velocity=tuple(0.4 * along)),
        fb.PointForce("push", "ball", force=tuple(-3 * out)),
        friction=0,
        gravity=(0, 0, 0),
    )
    run = m.simulate(0.01, outputs=2, **TIGHT)
    (place,) = (e.name for e in run.model.forces if e.name != "push")
    assert run[place].normal[0] == pytest.approx(3 - 2 * 0.4**2 / 0.2, abs=1e-12)


def slipping(rate, way, length=0.2):
    """What the rules of slips at an instant read of one place, whose slips are switches 1 and 2."""
    values = SimpleNamespace(values=SimpleNamespace(length=length))
    rates = np.array([0.0, *rate])
    here = SimpleNamespace(c=values)
    return SimpleNamespace(rate=rates, way=np.array([0.0, *way]), still=np.full(3, 1e-12), here=here)


@pytest.mark.parametrize("speed", [1.0, 1e-3, -1e-3])
def test_a_straight_slip_keeps_its_direction_past_rest(speed):
    """Friction is smooth up to the instant at which a slip ends: past it the speed along the same direction is negative."""
    d = np.array([0.6, -0.8])
    assert direction_in_space(1.0, tuple(d), tuple(speed * d)) == pytest.approx((*d, speed), rel=1e-14)


@pytest.mark.parametrize("seed", range(5))
def test_instants_take_the_direction_of_a_motion_for_what_has_just_begun_to_slide(seed):
    rng = np.random.default_rng(seed)
    a = rng.uniform(0.0, 2 * np.pi)
    way, u = ONSET_LENGTH * np.array([np.cos(a), np.sin(a)]), 0.2 * ONSET_SPEED * rng.normal(size=2)
    u *= np.sign(way @ u)
    found = instant_problem._slip_direction(slipping(u, way), [1, 2])
    assert found == pytest.approx(np.ravel(direction_in_space(0.2, tuple(way), tuple(u))[:2]), abs=1e-13)


@pytest.mark.parametrize(
    ("speed", "faster", "begins"), [(0.0, 1.0, True), (1e-6, 1.0, True), (1e-6, -1.0, False), (1e-2, 1.0, False)]
)
def test_a_slip_begins_that_is_slow_and_gets_faster(speed, faster, begins):
    d = np.array([0.6, 0.8])
    assert instant_problem._slip_begins(slipping(speed * d, (0.0, 0.0)), [1, 2], d, faster * d) == begins


def test_a_slip_is_let_go_with_the_friction_that_it_held():
    """At the edge of its cone: 3 N of 0.3 times 10 N."""
    x, mu = np.array([10.0, 1.8, -2.4]), 0.3
    numbers = SwitchNumbers(*np.zeros((10, 3)))
    numbers.kinetic_friction[1:] = mu
    S = SimpleNamespace(switch_numbers=numbers)
    n = SimpleNamespace(fired=lambda guards, *kinds: {1}, kinds=[STOP, SLIP, SLIP], S=S)
    parts = [
        ProblemRow(0, UNILATERAL),
        ProblemRow(1, FRICTION_DISC, gain=mu, of=0),
        ProblemRow(2, FRICTION_DISC_2, gain=mu, of=0),
    ]
    found = x, np.full(3, AT_REST), np.array([np.inf, 3.0, 3.0]), np.full(3, 1e-9)
    out = instant_problem.sliding_at_cone(n, parts, found, np.zeros(0, int))
    assert [-p.gain * x[0] * p.direction for _, p in sorted(out.items())] == pytest.approx(x[1:], rel=1e-14)
