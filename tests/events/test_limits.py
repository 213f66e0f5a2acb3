"""Stops of coordinates, rigid and elastic, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipk

import flyball as fb
from tests.events.one_sided import LAYERS, TIGHT, G, run, slider, times

layers = pytest.mark.parametrize("coordinates", LAYERS)


@layers
def test_a_bouncing_slider(coordinates):
    """Times t_n+1 = t_n + 2 e^n v / g, heights e^2n h, losses (1 - e^2) m v^2 / 2 at each hit."""
    h, e, mass = 1.3, 0.8, 2.0
    r = run(
        slider(fb.Limit("floor", "guide.displacement", lower=0, restitution=e), height=h, mass=mass), 3.0, coordinates
    )
    v = np.sqrt(2 * G * h)
    wanted = v / G + np.r_[0.0, np.cumsum(2 * v / G * e ** np.arange(1, 20))]
    wanted = wanted[wanted < 3.0]
    assert times(r, "floor") == pytest.approx(wanted, abs=1e-8)
    lost = [x.lost for x in r.events]
    assert lost == pytest.approx([0.5 * mass * v**2 * e ** (2 * n) * (1 - e**2) for n in range(len(wanted))], rel=1e-8)
    top = r["guide"].displacement[(r.t > wanted[1]) & (r.t < wanted[2])].max()
    assert top <= h * e**4 + 1e-9
    assert np.abs(r.energy.balance).max() < 1e-8
    assert r["guide"].displacement.min() > -1e-9


@layers
def test_it_comes_to_rest_on_its_stop(coordinates):
    """The sum of its series: v/g (1 + e) / (1 - e), after which it rests and the stop carries its weight."""
    h, e, mass = 0.4, 0.5, 2.0
    r = run(
        slider(fb.Limit("floor", "guide.displacement", lower=0, restitution=e), height=h, mass=mass), 2.0, coordinates
    )
    end = np.sqrt(2 * h / G) * (1 + e) / (1 - e)
    rests = r.t > end + 1e-6
    assert np.abs(r["guide"].displacement[rests]).max() < 1e-10
    assert (r["guide"].rate[rests] == 0.0).all() or np.abs(r["guide"].rate[rests]).max() < 1e-12
    assert r["floor"].force[-1] == pytest.approx(mass * G, rel=1e-9)
    assert r["floor"].closed[-1] == 1.0
    assert times(r, "floor")[-1] == pytest.approx(end, abs=1e-6)


@layers
def test_it_rests_on_its_stop_from_the_start(coordinates):
    r = run(slider(fb.Limit("floor", "guide.displacement", lower=0)), 0.5, coordinates)
    assert r["guide"].displacement == pytest.approx(0.0, abs=1e-12)
    assert r["floor"].force == pytest.approx(2.0 * G, rel=1e-9)
    assert (r["floor"].closed == 1.0).all()


@layers
def test_a_pendulum_against_a_stop(coordinates):
    """Quarter of a period to the stop, half a period of the smaller swing between hits: 1 - cos falls by e^2 each time."""
    mass, length, inertia, e, start = 1.5, 0.7, 0.2, 0.6, 2.0
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, -G))
    at = (length * np.sin(start), -length * np.cos(start))
    m.add(fb.Body("rod", mass=mass, inertia=inertia, position=at, angle=start))
    m.add(fb.Revolute("pin", "ground", "rod", at=(0, 0), angle=start))
    m.add(fb.Limit("stop", "pin.angle", lower=0.0, restitution=e))
    slow = np.sqrt((inertia + mass * length**2) / (mass * length * G))

    def quarter(swing):
        return slow * ellipk(np.sin(swing / 2) ** 2)

    swings = np.arccos(1 - e ** (2 * np.arange(1, 5)) * (1 - np.cos(start)))
    wanted = quarter(start) + np.r_[0.0, np.cumsum([2 * quarter(x) for x in swings])]
    r = run(m, float(wanted[-1]) + 0.05, coordinates)
    assert times(r, "stop") == pytest.approx(wanted, abs=1e-8)


@layers
def test_a_mass_on_an_elastic_stop(coordinates):
    """Half an oscillation: it is pressed for pi sqrt(m/k) and leaves as fast as it came."""
    mass, k, v, gap = 2.0, 300.0, 1.5, 0.2
    m = slider(fb.Limit("buffer", "guide.displacement", upper=gap, stiffness=k), gravity=0.0, mass=mass, speed=v)
    r = run(m, 1.0, coordinates)
    on = gap / v
    assert times(r, "buffer") == pytest.approx([on, on + np.pi * np.sqrt(mass / k)], abs=1e-9)
    assert r["guide"].rate[-1] == pytest.approx(-v, abs=1e-9)
    pressed = (r.t > on) & (r.t < on + np.pi * np.sqrt(mass / k))
    w = np.sqrt(k / mass)
    assert r["buffer"].force[pressed] == pytest.approx(-mass * v * w * np.sin(w * (r.t[pressed] - on)), abs=1e-7)
    assert (r["buffer"].closed == np.where(pressed, -1.0, 0.0)).all()
    assert np.abs(r.energy.balance).max() < 1e-8


@layers
def test_a_damped_buffer_lets_go_before_it_pulls(coordinates):
    """x = v/w e^-dt sin wt until k x + c xdot = 0, at tan wt = -c w / (k - c d): then it leaves for good."""
    mass, k, c, v = 2.0, 300.0, 20.0, 1.5
    m = slider(
        fb.Limit("buffer", "guide.displacement", lower=-0.3, stiffness=k, damping=c), gravity=0.0, mass=mass, speed=-v
    )
    r = run(m, 1.0, coordinates)
    d = c / (2 * mass)
    w = np.sqrt(k / mass - d * d)
    last = (np.pi - np.arctan2(c * w, k - c * d)) / w
    assert times(r, "buffer") == pytest.approx([0.2, 0.2 + last], abs=1e-9)
    leaves = v * np.exp(-d * last) * (np.cos(w * last) - d / w * np.sin(w * last))
    assert r["guide"].rate[-1] == pytest.approx(-leaves, abs=1e-8)
    assert r["buffer"].force.min() >= 0.0, "it never pulls"
    assert np.abs(r.energy.balance).max() < 1e-8


@pytest.mark.parametrize(("lower", "upper"), [(-1.0, 1.0), (-1.1, 0.7), (-0.3, 1.9)])
@layers
def test_between_two_stops_without_loss(coordinates, lower, upper):
    """To and fro at constant speed: hits at even times, all found, and no others."""
    m = slider(fb.Limit("walls", "guide.displacement", lower=lower, upper=upper, restitution=1), gravity=0.0, speed=3.0)
    r = run(m, 20.0, coordinates)
    hits = (upper + (upper - lower) * np.arange(40)) / 3
    assert times(r, "walls") == pytest.approx(hits[hits < 20.0], abs=1e-8)
    assert np.abs(r["guide"].rate) == pytest.approx(3.0, abs=1e-9)


@pytest.mark.parametrize("side", [1.0, -1.0])
@layers
def test_a_stop_lets_go_where_the_push_on_it_ends(coordinates, side):
    """Pressed by 2 kg times (1 - t): from 1 s on it goes with (t - 1)^3 / 6, away from the stop."""
    place = 0.1 * side
    stop = fb.Limit("stop", "guide.displacement", **{"upper" if side > 0 else "lower": place})
    push = fb.PointForce("push", "block", force=(0, f"{2.0 * side} * (1 - t)"))
    r = run(slider(stop, push, gravity=0.0, height=place), 2.0, coordinates, outputs=21)
    after = np.maximum(r.t - 1.0, 0.0)
    assert r["guide"].displacement == pytest.approx(place - side * after**3 / 6, abs=1e-9)
    assert np.abs(r["stop"].force) == pytest.approx(2.0 * np.maximum(1.0 - r.t, 0.0), abs=1e-8)


def test_world_coordinate_of_a_body():
    """A ball thrown at a wall bounces off it as from a stop of its x."""
    m = fb.Mechanism("wall", planar=True, gravity=(0, -G))
    m.add(fb.Body("ball", mass=1.0, inertia=0.01, velocity=(2.0, 3.0)))
    m.add(fb.Limit("wall", "ball.x", upper=1.0, restitution=0.5))
    r = run(m, 1.0, "absolute")
    assert times(r, "wall") == pytest.approx([0.5], abs=1e-9)
    assert r["ball"].velocity[-1] == pytest.approx([-1.0, 3.0 - G], abs=1e-8)
    assert r.events[0].impulses["wall"] == pytest.approx(-3.0, abs=1e-8)


def test_steps_by_impulses_know_stops_and_refuse_the_rest():
    m = slider(fb.Limit("floor", "guide.displacement", lower=0, restitution=0.5), height=0.5)
    r = m.simulate(1.0, method="impulse")
    assert r["floor"].value == pytest.approx(r["guide"].displacement)
    assert np.isnan(r["floor"].force).all(), "they do not tell it"
    soft = slider(fb.Limit("floor", "guide.displacement", lower=0, stiffness=1e4, damping=10), height=0.5)
    assert soft.simulate(0.4, method="impulse")["floor"].force.max() > 100.0
    for part in (
        fb.OneWay("part", "guide.displacement"),
        fb.Ratchet("part", "guide.displacement", pitch=0.1),
        fb.Backlash("part", ("guide.displacement",), gap=0.1),
        fb.Rope("part", ("ground", "block"), at=((0, 3), (0, 0.5))),
    ):
        with pytest.raises(
            fb.ModelError, match=rf"impulse time stepping does not support {type(part).__name__} 'part'"
        ):
            slider(part, height=0.5).simulate(1.0, method="impulse")


def test_a_stop_that_starts_violated_is_refused():
    m = slider(fb.Limit("floor", "guide.displacement", lower=0.1), height=0.05)
    with pytest.raises(fb.FlyballError, match=r"Limit 'floor'.*0\.05.*0\.1"):
        m.simulate(0.1)


@pytest.mark.parametrize(
    "bounds", [{"lower": 0.1}, {"upper": 0.1}, {"lower": 0.1, "upper": 0.5}, {"lower": -0.5, "upper": 0.1}]
)
@layers
def test_a_start_beyond_a_stop_by_rounding_is_put_on_it(bounds, coordinates):
    """A slider without forces that begins 5e-7 m beyond its stop rests at it, and that is told."""
    past = -5e-7 if bounds.get("lower") == 0.1 else 5e-7
    m = slider(fb.Limit("stop", "guide.displacement", **bounds), height=0.1 + past, gravity=0.0)
    r = run(m, 0.5, coordinates)
    assert r["guide"].displacement == pytest.approx(0.1, abs=1e-12)
    assert "overlaps by up to 5e-07" in " ".join(r.health.warnings)


@pytest.mark.parametrize("stop", ["rope", "lower", "upper"])
def test_an_elastic_stop_that_is_just_reached_at_rest_never_pulls(stop):
    """Pressed by F for T, then pulled: (F / k) (1 - cos w t), then -F / k + ..., and free from where it is zero again."""
    F, k, T = 1.0, 100.0, 0.5
    way = -1.0 if stop == "lower" else 1.0
    m = fb.Mechanism("slide", planar=True)
    m.add(fb.Body("b", mass=1.0, inertia=1.0, position=(1, 0)))
    m.add(fb.Prismatic("S", "ground", "b", at=(1, 0), axis=(1, 0)))
    m.add(fb.Actuator("pull", "S.displacement", force=f"{way * F}*where(t < 0.5, 0, where(t < 1, 1, -1))"))
    if stop == "rope":
        m.add(fb.Rope("stop", ("ground", "b"), at=((0, 0), (1, 0)), stiffness=k))
    else:
        m.add(fb.Limit("stop", "S.displacement", **{stop: 0.0}, stiffness=k))
    w = np.sqrt(k)
    x, v = F / k * (1 - np.cos(w * T)), F / k * w * np.sin(w * T)
    size, phase = np.hypot(x + F / k, v / w), np.arctan2(v / w, x + F / k)
    free = (np.arccos(F / k / size) + phase) / w
    speed = -size * w * np.sin(w * free - phase)
    left = 1.0 - free
    run = m.simulate(2.0, outputs=[0.0, 1.0, 2.0], rtol=1e-11, atol=1e-13)
    assert way * run["S.displacement"] == pytest.approx([0.0, x, speed * left - 0.5 * F * left**2], abs=1e-8)
    assert times(run, "stop") == pytest.approx([0.5, 1.0 + free], abs=1e-5)  # pressed as soon as it can be told
    assert [h.kind for h in run.events] == (["taut", "slack"] if stop == "rope" else ["close", "open"])


@layers
@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("speed", [2.0, 1.0, -1.0])
def test_a_motion_that_begins_beyond_an_elastic_stop(side, speed, coordinates):
    """0.1 m beyond it with 30 N of the spring and 20 N s/m: faster out than 1.5 m/s it is free, else it is pushed.

    The depth is then e^-at (0.1 cos wt + b sin wt) until k y + c y' is nothing, and the block goes on as it left.
    """
    mass, k, c, depth = 2.0, 300.0, 20.0, 0.1
    bound = {"lower" if side > 0 else "upper": 0}
    m = slider(
        fb.Limit("buffer", "guide.displacement", **bound, stiffness=k, damping=c),
        gravity=0.0, mass=mass, speed=side * speed, height=-side * depth,
    )  # fmt: skip
    a = c / (2 * mass)
    w = np.sqrt(k / mass - a * a)
    b = (a * depth - speed) / w

    def pushed(t):
        """Depth and its rate."""
        cos, sin = np.cos(w * t), np.sin(w * t)
        fall = np.exp(-a * t)
        return fall * (depth * cos + b * sin), fall * ((w * b - a * depth) * cos - (w * depth + a * b) * sin)

    if k * depth > c * speed:
        leaves = brentq(lambda t: k * pushed(t)[0] + c * pushed(t)[1], 1e-6, 0.25)
        y, rate = pushed(leaves)
    else:
        leaves, y, rate = 0.0, depth, -speed
    at = np.array([0.0, 0.4 * leaves, leaves + 0.05, leaves + 0.3])
    r = m.simulate(at[-1], outputs=at[[0, 1, 2, 3]] if leaves else at[[0, 2, 3]], coordinates=coordinates, **TIGHT)
    wanted = np.where(r.t < leaves, pushed(r.t)[0], y + rate * (r.t - leaves))
    assert side * r["guide"].displacement == pytest.approx(-wanted, abs=1e-8)
    assert side * r["guide"].rate[-1] == pytest.approx(-rate, abs=1e-8)
    first = k * depth - c * speed if leaves else 0.0
    assert side * r["buffer"].force[0] == pytest.approx(first, abs=1e-7)


@layers
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_an_elastic_stop_that_is_released_takes_its_energy_along(side, coordinates):
    """Let go at the depth d it gives up k d^2 / 2; in force again deeper, it has the energy of that depth."""
    mass, k, v, on, off, again = 2.0, 300.0, 1.5, 0.1, 0.15, 0.17
    bound = {"lower" if side > 0 else "upper": 0}
    m = slider(
        fb.Limit("buffer", "guide.displacement", **bound, stiffness=k),
        fb.Event("go", f"t - {off}", do=fb.Release("buffer")), fb.Event("back", f"t - {again}", do=fb.Lock("buffer")),
        gravity=0.0, mass=mass, speed=-side * v, height=side * v * on,
    )  # fmt: skip
    r = m.simulate(0.3, outputs=[0.0, off, 0.16, 0.3], coordinates=coordinates, **TIGHT)
    w = np.sqrt(k / mass)
    depth, rate = v / w * np.sin(w * (off - on)), v * np.cos(w * (off - on))
    deeper = depth + rate * (again - off)
    turn = w * (0.3 - again)
    assert -side * r["guide"].displacement == pytest.approx(
        [-v * on, depth, depth + rate * 0.01, deeper * np.cos(turn) + rate / w * np.sin(turn)], abs=1e-8
    )
    given = r["energy.event_work"]
    assert given[-2:] == pytest.approx([-0.5 * k * depth**2, 0.5 * k * (deeper**2 - depth**2)], abs=1e-8)
    assert r.energy.drift < 1e-8


@layers
@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("speed", "push"), [(1.0, 0.0), (-1.0, 0.0), (0.0, 5.0), (0.0, -5.0)])
def test_a_motion_that_begins_at_an_elastic_stop(side, speed, push, coordinates):
    """Right at it its rate decides, and where it has none its acceleration: pressed for half an oscillation, or free."""
    mass, k = 2.0, 300.0
    bound = {"lower" if side > 0 else "upper": 0}
    m = slider(
        fb.Limit("buffer", "guide.displacement", **bound, stiffness=k),
        fb.Actuator("push", "guide.displacement", force=side * push),
        gravity=0.0, mass=mass, speed=side * speed,
    )  # fmt: skip
    w = np.sqrt(k / mass)
    r = m.simulate(0.2, outputs=[0.0, 0.1, 0.2], coordinates=coordinates, **TIGHT)
    wanted = speed * r.t + push / mass * r.t**2 / 2
    if speed < 0.0 or push < 0.0:
        wanted = speed / w * np.sin(w * r.t) + push / k * (1 - np.cos(w * r.t))
    assert side * r["guide"].displacement == pytest.approx(wanted, abs=1e-8)


@layers
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_buffer_that_is_caught_up_with_inside_of_it(side, coordinates):
    """Out faster than it is pushed it is free, until a force has slowed it: k y + c y' = 0; then it swings about F / k.

    The depth until then is 0.1 - 2 t + 50 t^2, so that the push is 15000 t^2 + 1400 t - 10.
    """
    mass, k, c, force = 2.0, 300.0, 20.0, 200.0
    bound = {"lower" if side > 0 else "upper": 0}
    m = slider(
        fb.Limit("buffer", "guide.displacement", **bound, stiffness=k, damping=c),
        fb.Actuator("push", "guide.displacement", force=-side * force),
        gravity=0.0, mass=mass, speed=side * 2.0, height=-side * 0.1,
    )  # fmt: skip
    met = (np.sqrt(1400.0**2 + 600000.0) - 1400.0) / 30000.0
    y, rate, rest = 0.1 - 2 * met + 50 * met**2, 100 * met - 2, force / k
    a = c / (2 * mass)
    w = np.sqrt(k / mass - a * a)
    r = m.simulate(0.12, outputs=[0.0, met, 0.06, 0.12], coordinates=coordinates, **TIGHT)
    on = r.t[2:] - met
    swing = (y - rest) * np.cos(w * on) + (rate + a * (y - rest)) / w * np.sin(w * on)
    wanted = [0.1, y, *(rest + np.exp(-a * on) * swing)]
    assert -side * r["guide"].displacement == pytest.approx(wanted, abs=1e-8)
    assert times(r, "buffer") == pytest.approx([met], abs=1e-8)


@pytest.mark.parametrize("coordinates", LAYERS)
@pytest.mark.parametrize("second", [fb.Limit("S1", "x.displacement", lower=-0.2, stiffness=2e4),
                                    fb.Event("out", "x.displacement + 0.2", do=fb.Impulse(on="b", impulse=(0, 0)))])  # fmt: skip
def test_a_damped_stop_that_has_let_go_stays_open_where_something_else_happens(second, coordinates):
    """A stop lets go inside, as its damper would pull; where it is left, another stop lets go or an event happens."""
    m = fb.Mechanism("stops", planar=True, gravity=(0, 0))
    m.add(fb.Body("b", mass=1, inertia=1, velocity=(-3.1, 0)))
    m.add(
        fb.Prismatic("x", "ground", "b", at=(0, 0), axis=(1, 0)), fb.Actuator("k", "x.displacement", force="-50*value")
    )
    m.add(fb.Limit("S0", "x.displacement", lower=-0.2, stiffness=657.6, damping=5.0), second)
    stiffness = 2e4 if isinstance(second, fb.Limit) else 0.0

    def rates(t, y):
        depth = -0.2 - y[0]
        stops = stiffness * depth + max(657.6 * depth - 5.0 * y[1], 0.0) if depth > 0 else 0.0
        return [y[1], -50 * y[0] + stops]

    exact = solve_ivp(rates, (0, 1), [0, -3.1], rtol=1e-10, atol=1e-12, max_step=1e-3).y
    for rtol in (1e-5, 1e-7):
        run = m.simulate(1.0, rtol=rtol, atol=1e-2 * rtol, outputs=51, coordinates=coordinates)
        assert run["b"].x[-1] == pytest.approx(exact[0, -1], abs=100 * rtol)
        assert run["S0"].force.min() >= 0.0
