"""Laws with corners where the state decides: integrated from corner to corner, and held on them (Filippov)."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from tests.layers import both_layers

pytestmark = both_layers
FINE = {"rtol": 1e-11}


def cart(force, mass=1.0, tables=(), **start) -> fb.Mechanism:
    m = fb.Mechanism("cart", planar=True)
    m.gravity = (0, 0)
    m.add(*tables, fb.Body("cart", mass=mass, inertia=1, position=(0, 0), **start))
    m.add(fb.Prismatic("track", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.Actuator("drive", "track.displacement", force=force))
    return m


def moved(m, t_end, **more):
    r = m.simulate(t_end, **{**FINE, "outputs": 11, **more})
    return r, r["cart"].position[:, 0], r["cart"].velocity[:, 0]


def test_friction_that_a_user_writes_comes_to_true_rest():
    """-mu m g sign(v): v^2 / (2 mu g), and then exactly nothing."""
    r, x, v = moved(cart("-0.3*2*9.81*sign(rate)", mass=2.0, velocity=(3, 0)), 4.0)
    at = r.events[0].t
    assert at == pytest.approx(3 / (0.3 * 9.81), rel=1e-12)
    assert x[-1] == pytest.approx(9 / (2 * 0.3 * 9.81), rel=1e-12)
    assert (v[r.t > at] == 0.0).all() and np.ptp(x[r.t > at]) < 1e-14


def test_the_mass_on_a_spring_stops_where_friction_holds_it():
    """Half swings about +-F/k: amplitudes fall by 2 F/k each until |x| <= F/k."""
    m, k, F, start = 2.0, 100.0, 7.0, 1.0
    r, x, v = moved(cart(f"-{k}*(value + {start}) - {F}*sign(rate)", mass=m), 10.0)
    n, amplitude = 0, start
    while amplitude > F / k:
        amplitude, n = amplitude - 2 * F / k, n + 1
    stop = (-1.0) ** n * amplitude - start
    assert r.events[0].t == pytest.approx(n * np.pi / np.sqrt(k / m), rel=1e-9)
    assert x[-1] == pytest.approx(stop, abs=1e-9) and abs(v[-1]) < 1e-12


def test_it_breaks_away_when_the_force_grows():
    r, x, v = moved(cart("2*t - 3*sign(rate)"), 3.0)
    assert [e.kind for e in r.events] == ["hold", "leave"]
    assert r.events[1].t == pytest.approx(1.5, rel=1e-9)
    assert v[-1] == pytest.approx(1.5**2, rel=1e-9) and x[-1] == pytest.approx(1.5**3 / 3, rel=1e-9)


def test_sliding_along_a_switching_line():
    """x'' = -U sign(v + c x): onto the line in finite time, and along it as exp(-c t), to the digits."""
    U, c, x0 = 2.0, 1.0, 1.0
    r, x, v = moved(cart(f"-{U}*sign(rate + {c}*(value + {x0}))"), 6.0, outputs=61)
    reached = r.events[0].t
    # a parabola x0 - U t^2 / 2 up to the line -U t + c (x0 - U t^2 / 2) = 0
    expected = (-U + np.sqrt(U * U + 2 * c * c * U * x0)) / (c * U)
    assert reached == pytest.approx(expected, rel=1e-9)
    on = r.t > reached
    there = (x0 - U * expected**2 / 2) * np.exp(-c * (r.t[on] - expected))
    assert x[on] + x0 == pytest.approx(there, abs=1e-9) and v[on] == pytest.approx(-c * there, abs=1e-9)
    assert len(r.events) == 1 and r.health.steps < 300


def test_the_limit_cycle_of_a_relay():
    """x'' = -sign(x): parabolas, period 4 v0, amplitude v0^2 / 2; a hundred cycles."""
    r, x, v = moved(cart("-sign(value)", velocity=(1, 0)), 400.0, outputs=401)
    s = r.t % 4.0
    exact = np.where(s < 2.0, s - s**2 / 2, -(s - 2.0) + (s - 2.0) ** 2 / 2)
    assert x == pytest.approx(exact, abs=1e-8)
    assert r.health.steps < 2000


def test_the_limit_cycle_of_a_relay_with_damping():
    """x'' + x' = -sign(x + T x') with T < 0 keeps on swinging: period and amplitude by the half cycle's equations."""
    T = -0.5
    from scipy.optimize import brentq

    # from the switching line (a, -a/T) under x'' + x' = -1 to the opposite point after half a period h
    def there(h, a):
        w = -a / T  # velocity on the line
        e = np.exp(-h)
        return a + (w + 1.0) * (1.0 - e) - h, (w + 1.0) * e - 1.0

    def miss(h):
        # v(h) = -w gives w, then x(h) = -a
        e = np.exp(-h)
        w = (1.0 - e) / (1.0 + e)
        return there(h, -T * w)[0] + (-T * w)

    h = brentq(miss, 0.5, 20.0, xtol=1e-15)
    e = np.exp(-h)
    w = (1.0 - e) / (1.0 + e)
    m = cart(f"-rate - sign(value + {-T * w} + {T}*rate)", velocity=(w, 0))
    r, x, v = moved(m, 20 * h, outputs=np.linspace(0, 20 * h, 21))
    assert np.abs(x[::2]).max() < 1e-8 and v[::2] == pytest.approx(w, abs=1e-8)
    assert v[1::2] == pytest.approx(-w, abs=1e-8)


def test_springs_with_a_corner():
    """Another stiffness on either side: half periods add up; by where, max and min, abs."""
    a, b = 10.0, 20.0
    for law in [
        "-where(value < 0, 400*value, 100*value)",
        "-100*max(value, 0) - 400*min(value, 0)",
        "-250*value + 150*abs(value)",
        "-100*value - where(not value >= 0, 300, 0)*value",
    ]:
        r, x, v = moved(cart(law, velocity=(1, 0)), 10 * (np.pi / a + np.pi / b))
        assert x[-1] == pytest.approx(0.0, abs=1e-9) and v[-1] == pytest.approx(1.0, rel=1e-9)
        assert r.health.rejected < 10 * 20


def test_a_table_with_corners_holds_its_energy():
    """A spring of straight pieces: a quarter of its period is the sum of closed forms."""
    table = fb.Table("pull", x=[-3, -1, 1, 3], y=[7, 1, -1, -7], interpolation="linear", beyond="line")
    r, x, v = moved(cart("pull(value)", velocity=(2, 0), tables=(table,)), 1.0, outputs=2)
    # inside: x = 2 sin t up to x = 1; outside x'' = -1 - 3 (x - 1)
    t1 = np.pi / 6
    v1, w, s = 2 * np.cos(t1), np.sqrt(3.0), 1.0 - np.pi / 6
    assert x[-1] == pytest.approx(1 - 1 / 3 + np.cos(w * s) / 3 + v1 / w * np.sin(w * s), abs=1e-9)
    assert v[-1] == pytest.approx(-w / 3 * np.sin(w * s) + v1 * np.cos(w * s), abs=1e-9)


def test_a_force_between_bodies_by_its_length():
    """A spring that only pulls: its own length decides, which nothing else measures."""
    m = fb.Mechanism("pair", planar=True)
    m.gravity = (0, 0)
    m.add(fb.Body("cart", mass=1, inertia=1, position=(2, 0), velocity=(1, 0)))
    m.add(fb.Prismatic("track", "ground", "cart", at=(2, 0), axis=(1, 0)))
    m.add(fb.SpringDamper("cord", "ground", "cart", at=((0, 0), (2, 0)), force="100*max(0, length - 2)"))
    r = m.simulate(np.pi / 10 + 0.5, outputs=2, **FINE)
    assert r["cart"].velocity[-1, 0] == pytest.approx(-1.0, rel=1e-9)
    assert r["cart"].position[-1, 0] == pytest.approx(1.5, abs=1e-9)


def test_two_corners_at_once():
    """Two blocks pulled over a table by one law each: both come to rest, at their own times."""
    m = fb.Mechanism("two", planar=True)
    m.gravity = (0, 0)
    for name, v in (("a", 1.0), ("b", 2.0)):
        m.add(fb.Body(name, mass=1, inertia=1, position=(0, 0), velocity=(v, 0)))
        m.add(fb.Prismatic(f"{name} track", "ground", name, at=(0, 0), axis=(1, 0)))
        m.add(fb.Actuator(f"{name} friction", f"{name} track.displacement", force="-2*sign(rate)"))
    r = m.simulate(3.0, outputs=2, **FINE)
    assert [e.t for e in r.events] == pytest.approx([0.5, 1.0], rel=1e-10)
    assert r["a"].position[-1, 0] == pytest.approx(0.25, rel=1e-10)
    assert r["b"].position[-1, 0] == pytest.approx(1.0, rel=1e-10)
    assert r["a"].velocity[-1, 0] == r["b"].velocity[-1, 0] == 0.0


def test_drag_by_the_square_is_no_corner():
    """-c v |v| has no jump in its slope: nothing is watched."""
    r, x, v = moved(cart("-0.5*rate*abs(rate)", velocity=(4, 0)), 3.0)
    assert v[-1] == pytest.approx(4 / (1 + 0.5 * 4 * 3), rel=1e-9)
    assert not r.health.events


TWISTING = "-3*sign(value) - sign(rate)"
SHORTER = np.sqrt((3 - 1) / (3 + 1))  # ratio of speeds from one way through x = 0 to the next


@pytest.mark.parametrize("rate", [0.5, -2.0])
def test_swings_that_come_ever_faster_end_on_two_corners(rate):
    """The twisting algorithm: a swing at speed w lasts w/4 out and w/sqrt(8) back; then x and v are zero for good."""
    r, x, v = moved(cart(TWISTING, velocity=(rate, 0)), 6.0, outputs=61)
    end = abs(rate) * (1 / 4 + 1 / np.sqrt(8)) / (1 - SHORTER)
    assert [e.kind for e in r.events] == ["hold", "hold"]
    assert [e.t for e in r.events] == pytest.approx([end, end], abs=1e-10)
    assert np.abs(x[r.t > end]).max() < 1e-13 and np.abs(v[r.t > end]).max() < 1e-13


@pytest.mark.parametrize("law", [TWISTING, "-3*sign(value)"])
def test_what_begins_on_its_corners_stays_there(law):
    r, x, v = moved(cart(law), 3.0)
    assert (x == 0.0).all() and (v == 0.0).all()


def test_both_corners_bear_as_long_as_they_can():
    """3 + 1 hold, in proportion: until the force is 4, at t = 6, when both let go at once."""
    r, x, v = moved(cart(f"{TWISTING} + max(0, t - 2)", velocity=(0.5, 0)), 8.0)
    assert [e.kind for e in r.events] == ["hold", "hold", "leave", "leave"]
    assert [e.t for e in r.events[2:]] == pytest.approx([6.0, 6.0], abs=1e-9)
    assert x[-1] == pytest.approx(2**3 / 6, abs=1e-9) and v[-1] == pytest.approx(2**2 / 2, abs=1e-9)


def test_a_relay_holds_what_begins_at_rest_until_it_is_pulled_away():
    r, x, v = moved(cart("-3*sign(value) + t"), 5.0)
    assert [e.kind for e in r.events] == ["hold", "leave"] and r.events[1].t == pytest.approx(3.0, abs=1e-9)
    assert x[-1] == pytest.approx(2**3 / 6, abs=1e-9)


@pytest.mark.parametrize(("pull", "moves"), [(2, 0.0), (10, 7.0), (-10, -7.0)])
@pytest.mark.parametrize("law", ["-3*sign(rate)", "-2*sign(value) - sign(rate)"])
def test_a_force_that_jumps_pulls_what_is_held_away(law, pull, moves):
    """A law of time has no zero to be found where it jumps."""
    r, x, v = moved(cart(f"{law} + where(t < 1, 0, {pull})"), 2.0)
    assert x[-1] == pytest.approx(moves / 2, abs=1e-9) and v[-1] == pytest.approx(moves, abs=1e-9)


def test_what_is_held_stays_where_other_things_happen():
    """A corner that holds does not let go by rounding when something else is decided."""
    m = cart("-3*sign(rate) - sign(value - 0.04)", velocity=(0.5, 0))
    m.add(fb.Event("look", "sin(40*t)", do=[]))
    r, x, v = moved(m, 2.0)
    assert np.ptp(x[r.t > 0.2]) < 1e-14


def test_a_bounce_at_the_instant_of_a_corner_of_the_speed():
    """Falls with g = 10 and hits at 2 m/s; below that speed exactly nothing else acts, so it rises with 1 m/s."""
    m = cart("-10 + where(rate + 2 < 0, 100, 0)")
    m.add(fb.Limit("floor", "track.displacement", lower=-0.2, restitution=0.5))
    r, x, _v = moved(m, 0.4, outputs=[0.0, 0.2, 0.3, 0.4])
    assert x == pytest.approx([0.0, -0.2, -0.15, -0.2], abs=1e-9)
    assert r["drive"].force[1:3] == pytest.approx([-10.0, -10.0])


@pytest.mark.parametrize("restitution", [0.0, 1.0])
def test_what_a_users_friction_holds_is_hit_and_comes_to_rest_again(restitution):
    """Two of one mass: it takes over all of the other's speed u, or both go on with u / 2 and the friction of one."""
    a, u, gap = 5.0, 2.0, 0.5
    m = cart(f"-{a}*sign(rate)")
    m.add(fb.Body("other", mass=1, inertia=1, position=(-1, 0), velocity=(u, 0)))
    m.add(fb.Prismatic("rail", "ground", "other", at=(-1, 0), axis=(1, 0)))
    both = ("track.displacement", "rail.displacement")
    m.add(fb.Backlash("buffer", both, gap=2 * gap, restitution=restitution))
    v, slows = (u, a) if restitution == 1.0 else (u / 2, a / 2)
    t = gap / u
    r, x, _v = moved(m, 1.0, outputs=[0.0, t, t + v / slows / 2, 1.0])
    assert x == pytest.approx([0.0, 0.0, 3 / 8 * v**2 / slows, v**2 / slows / 2], abs=1e-10)
    assert [h.kind for h in r.events][:3] == ["hold", "impact", "leave"]
    assert [h.t for h in r.events if h.kind == "hold"] == pytest.approx([0.0, t + v / slows], abs=1e-10)


def test_two_frictions_on_one_body_that_stick_by_turns():
    """Coulomb's friction on the ground and on a belt, by signs; the same by elements; to the belt's speed and off it.

    Until pi/2 the ground holds it at x = 1, then the belt carries it, x = 1 + (sin t - 1) / 2, to x = 0 at 3 pi/2, where
    both speeds are zero; and friction of both drives it on, x'' = -x + .2 at first.
    """
    r, x, v = moved(cart("-(value + 1) - .5*sign(rate) - .7*sign(rate - .5*cos(t))"), 20.0)
    m = cart("-(value + 1)")
    m.add(fb.Body("belt", mass=1, inertia=1), fb.Prismatic("B", "ground", "belt", at=(0, 0), axis=(1, 0)))
    m.add(fb.Driver("D", "B.displacement", ".5*sin(t)"), fb.Brake("ground's", "track.displacement", capacity=0.5))
    m.add(fb.Clutch("belt's", "B.displacement", "track.displacement", capacity=0.7))
    _, y, w = moved(m, 20.0)
    assert x == pytest.approx(y, abs=1e-9) and v == pytest.approx(w, abs=1e-9)
    assert x[2] == pytest.approx((np.sin(4.0) - 1) / 2, abs=1e-9)
    s = 6.0 - 1.5 * np.pi
    assert x[3] == pytest.approx(-1 + 0.2 * (1 - np.cos(s)), abs=1e-9)


CARRIED = [  # law, speed of 1 kg after 2 s: what jumps with time carries u across its corner, not to it
    ("abs(where(t<1, 1, -3) + 1e-9*value)", 4.0),
    ("abs(where(t<1, 1, -3) - 1e-9*value)", 4.0),
    ("abs(where(t<1, -1, 3) + 1e-9*value)", 4.0),
    ("abs(where(t<1, -1, 3) - 1e-9*value)", 4.0),
    ("sign(where(t<1, 1, -3) + 1e-9*value)", 0.0),
    ("where(where(t<1, 1, -3) + 1e-9*value > 0, 2, 7)", 9.0),
    ("max(-5, min(5, where(t<1, 2, -9) + 1e-9*value))", -3.0),
    ("abs(where(t<1, 1, -3) + 1e-9*rate)", 4.0),
    ("abs(S + 1e-9*value)", 4.0),
    ("max(-2, min(2, S - 1e-9*value))", -1.0),
]


@pytest.mark.parametrize("method", ["dop853", "radau"])
@pytest.mark.parametrize(("law", "speed"), CARRIED)
def test_a_jump_carries_a_law_across_its_corner(law, speed, method):
    """The side is where u is then, however u goes on: back to the corner, as under every controller, or away."""
    sampled = (fb.State("S", period=1.0, next="where(t<0.5, 1, -3)"),) if "S" in law else ()
    r = cart(law, tables=sampled).simulate(2, outputs=3, method=method)
    assert r["cart.vx"][-1] == pytest.approx(speed, abs=1e-7)
