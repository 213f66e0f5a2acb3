"""Events whose expressions are zero but for rounding never happen; what truly passes zero does, however small it is."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import flyball as fb
from tests.layers import both_layers

pytestmark = both_layers
C, S = float(np.cos(0.37)), float(np.sin(0.37))
METHODS = (
    {"method": "dop853"}, {"method": "rk45"}, {"method": "radau"}, {"method": "generalised-alpha", "step": 5e-3},
    {"method": "variational", "step": 5e-3}, {"method": "auto"},
)  # fmt: skip


def twice() -> fb.Mechanism:
    """Two equal double pendulums, the second mirrored and elsewhere."""
    m = fb.Mechanism("twice", planar=True, gravity=(0, -9.81))
    for n, x, s in (("a", 0.1, 1.0), ("b", -7.3, -1.0)):
        m.add(fb.Body(n, mass=1, inertia=0.1, position=(x + s * 0.61, 0.37)))
        m.add(fb.Body(n + "2", mass=1, inertia=0.1, position=(x + s * 1.41, 0.17)))
        m.add(fb.Revolute("j" + n, "ground", n, at=(x, 0.13)))
        m.add(fb.Revolute("k" + n, n, n + "2", at=(x + s * 1.01, 0.27)))
    return m


def upright() -> fb.Mechanism:
    """A mass between two equal springs, all of it turned by an angle: it stays on a line."""

    def turned(x: float, y: float) -> tuple[float, float]:
        return C * x - S * y, S * x + C * y

    m = fb.Mechanism("upright", planar=True, gravity=turned(0, -9.81))
    m.add(fb.Body("a", mass=1, inertia=0.1, position=turned(0, -0.7)))
    for k, x in (("l", -1.1), ("r", 1.1)):
        at = [turned(x, 0.2), turned(0, -0.7)]
        m.add(fb.SpringDamper("s" + k, "ground", "a", at=at, stiffness=30, length=1.0))
    return m


def in_a_plane() -> fb.Mechanism:
    """Two links in space that swing in an upright plane."""
    m = fb.Mechanism("in a plane", gravity=(0, 0, -9.81))
    for n, r in (("a", 0.8), ("b", 1.6)):
        m.add(fb.Body(n, mass=1, inertia=[0.1] * 3, position=(C * r, S * r, -0.3)))
    m.add(fb.Spherical("S", "ground", "a", at=(0, 0, 0)))
    m.add(fb.Spherical("T", "a", "b", at=(C * 1.2, S * 1.2, -0.3)))
    return m


GHOSTS = {
    twice: ("a2.y - b2.y", "a2.vx + b2.vx", "1e6*(a.y - b.y)", "1e-6*(a2.vy - b2.vy)", "ka.rate + kb.rate", "a.x + b.x + 7.2"),
    upright: (f"{C}*a.x + {S}*a.y", f"{C}*a.vx + {S}*a.vy", "sl.length - sr.length", "sl.rate - sr.rate"),
    in_a_plane: (f"{C}*b.y - {S}*b.x", f"{C}*b.vy - {S}*b.vx"),
}  # fmt: skip


@pytest.mark.parametrize("kw", METHODS, ids=lambda kw: kw["method"])
@pytest.mark.parametrize("made", GHOSTS, ids=lambda made: made.__name__)
def test_rounding_is_no_event_and_costs_no_steps(made, kw):
    if kw["method"] == "variational":
        kw = {**kw, "coordinates": "absolute"}
    plain = made().simulate(3.0, outputs=3, **kw).health.steps
    for when in GHOSTS[made]:
        m = made()
        m.add(fb.Event("e", when, direction="either"))
        r = m.simulate(3.0, outputs=3, **kw)
        assert len(r.events) == 0, (when, r.events.t)
        assert r.health.steps <= 1.1 * plain + 3, when


def slow(scale: float, threshold: float, kw: dict) -> fb.Mechanism:
    m = fb.Mechanism("slow", planar=True, gravity=(0, 0))
    m.add(
        fb.Body("b", mass=1, inertia=1, velocity=(scale, 0)), fb.Prismatic("P", "ground", "b", at=(0, 0), axis=(1, 0))
    )
    m.add(fb.Event("e", f"b.x > {threshold!r}"))
    return m


@pytest.mark.parametrize("kw", METHODS[:4], ids=lambda kw: kw["method"])
@pytest.mark.parametrize("scale", [1e-9, 1e-6, 1.0, 1e6, 1e9])
def test_slow_and_small_passings_happen(scale, kw):
    """x = scale t: past scale / 3, at a third of a second."""
    r = slow(scale, scale / 3, kw).simulate(1.0, outputs=2, **kw)
    assert r.events["e"].t == pytest.approx([1 / 3], abs=1e-8)


@pytest.mark.parametrize("law", ["{}*b.x - {}", "b.vx*({}*b.x - {})"])
@pytest.mark.parametrize("factor", [1e-9, 1.0, 1e9])
def test_the_size_of_an_expression_does_not_matter(factor, law):
    m = fb.Mechanism("scaled", planar=True, gravity=(0, 0))
    m.add(fb.Body("b", mass=1, inertia=1, velocity=(1, 0)))
    m.add(fb.Event("e", law.format(factor, 0.25 * factor), direction="either"))
    for t_end in (0.25, 1.0):  # at the very end of the motion, and within it
        assert m.simulate(t_end, outputs=2).events["e"].t == pytest.approx([0.25], abs=1e-12)


@pytest.mark.parametrize("kw", METHODS[:4], ids=lambda kw: kw["method"])
@pytest.mark.parametrize(("direction", "many"), [("falling", 1), ("rising", 0)])
def test_what_lies_and_is_lifted_has_passed_zero_once(direction, many, kw):
    """It falls 0.2 m, rests, and is lifted at t = 1 s: its height gets to zero once and never comes from below."""
    m = fb.Mechanism("lifted", planar=True, gravity=(0, -10))
    m.add(fb.Body("b", mass=1, inertia=0.1, position=(0.3, 0.2)))
    m.add(fb.Prismatic("P", "ground", "b", at=(0.3, 0), axis=(0, 1), displacement=0.2))
    m.add(fb.Limit("floor", "P.displacement", lower=0, restitution=0))
    m.add(fb.Actuator("lift", "P.displacement", force="where(t < 1, 0, 15)"), fb.Event("e", "b.y", direction=direction))
    r = m.simulate(2.0, outputs=2, **kw)
    assert r["b.y"][-1] == pytest.approx(2.5, abs=1e-5)
    assert len(r.events["e"]) <= many


def at_rest() -> fb.Mechanism:
    """An elastic rope and a spring, both drawn at their free lengths; friction and an event on a rate."""
    m = fb.Mechanism("at rest", planar=True, gravity=(0, 0))
    m.add(fb.Body("a", mass=0.93, inertia=0.037, position=(0.688, 0.331)))
    m.add(fb.Body("b", mass=0.73, inertia=0.029, position=(-0.345, 0.033)))
    m.add(fb.Revolute("R", "ground", "a", at=(0.375, 0.338)))
    m.add(fb.Prismatic("P", "ground", "b", at=(-0.333, 0.041), axis=(0.67, 0.74)))
    over = [(0.748, 0.7), (-0.018, 0.404), (0.462, 0.462)]
    m.add(fb.Rope("rope", bodies=["a", "b", "ground"], at=over, stiffness=1e4, damping=5))
    m.add(fb.SpringDamper("pull", "ground", "a", at=((0.802, 0.608), (0.688, 0.331)), stiffness=77))
    m.add(fb.JointFriction("dry", "P", static=0.16, kinetic=0.1))
    m.add(fb.Event("e", "P.displacement_rate", direction="falling", do=[fb.Impulse("b", (0.66, -1.8))]))
    return m


@pytest.mark.parametrize("method", ["dop853", "rk45", "radau"])
@pytest.mark.parametrize("rtol", [1e-7, 1e-9, 1e-11])
def test_friction_that_carries_nothing_does_not_slip_by_rounding(method, rtol):
    """Nothing acts, so nothing happens, and no steps are spent on it; later it moves by what the tolerance allows."""
    r = at_rest().simulate(1.0, outputs=3, method=method, rtol=rtol, atol=rtol / 100)
    assert len(r.events) == 0, str(r.events)
    assert r.health.steps < 12


@pytest.mark.parametrize("method", ["dop853", "rk45", "radau"])
@pytest.mark.parametrize("rtol", [1e-7, 1e-9])
def test_friction_whose_load_vanishes_as_all_comes_to_rest_does_not_slip(method, rtol):
    """Two links that friction holds together turn about the ground, and a brake of 2 N m stops them after I w / 2."""
    m = fb.Mechanism("stopped", planar=True, gravity=(0, 0))
    m.add(fb.Body("a", mass=1.3, inertia=0.1, position=(0.31, 0.12), angular_velocity=2.0))
    m.add(fb.Body("b", mass=0.7, inertia=0.01, position=(0.625, 0.24), angular_velocity=2.0))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=(0.61, 0.23)))
    m.add(fb.Brake("brake", "A.angle", capacity=2.0), fb.JointFriction("dry", "B", static=0.8, radius=0.1))
    r = m.simulate(3.0, outputs=3, method=method, rtol=rtol, atol=rtol / 100)
    stop = 0.11 + 1.3 * (0.31**2 + 0.12**2) + 0.7 * (0.625**2 + 0.24**2)
    assert [(e.name, e.kind) for e in r.events] == [("brake", "stick")]
    assert r.events.t == pytest.approx([stop], abs=100 * rtol)


@pytest.mark.parametrize("method", ["dop853", "rk45", "radau"])
def test_a_stop_that_a_force_begins_to_press_stays_closed(method):
    """The force begins as the square of time, and turns round where its slow factor passes zero."""
    factor = "0.55156 + 1.89745*sin(4.222972*t + 3.755868) + 2.712994*cos(8.199426*t + 0.265272)"
    m = fb.Mechanism("pressed", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("b", mass=1.447660, inertia=0.2), fb.Prismatic("P", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.Actuator("push", "P.displacement", force=f"({factor})*step(t, 1.021894743, 0, 1.734124731, 1)"))
    m.add(fb.Limit("stop", "P.displacement", lower=-0.41, upper=0, restitution=0.5))
    known = {"sin": np.sin, "cos": np.cos}
    turns = brentq(lambda t: eval(factor, known | {"t": t}), 1.03, 1.1, xtol=1e-14)
    r = m.simulate(1.3, outputs=3, method=method, rtol=1e-9, atol=1e-11)
    assert [e.kind for e in r.events] == ["close", "open"]
    assert r.events.t == pytest.approx([1.021894743, turns], abs=1e-9)


@pytest.mark.parametrize("method", ["dop853", "rk45", "radau"])
def test_a_rate_that_begins_at_zero_where_a_law_has_a_corner_passes_it_once(method):
    """A torque of 0.01 N m turns it until the brake stops it, where 0.01 t = (2 / 9) (1 - cos 9 t).

    The corner of the capacity at t = 0 makes the first step so short that angles tell nothing of rates.
    """
    m = fb.Mechanism("braked", gravity=(0, 0, 0))
    m.add(fb.Body("b", mass=1, inertia=[0.02] * 3, position=(0.1, -0.35, 0.19), orientation=(-0.8, -0.37, 0.64)))
    m.add(fb.Revolute("R", "ground", "b", at=(0.106, -0.362, 0.209), axis=(-0.54, 0.84, 0.001)))
    m.add(fb.Motor("push", "R", torque=0.01), fb.Brake("brake", "R.angle", capacity="2*abs(sin(9*t))"))
    m.add(fb.Event("e", "R.angle_rate", direction="either"))
    stop = brentq(lambda t: 0.01 * t - 2 / 9 * (1 - np.cos(9 * t)), 1e-4, 1e-2, xtol=1e-15)
    r = m.simulate(0.01, outputs=3, method=method, rtol=1e-9, atol=1e-11)
    assert r.events["e"].t == pytest.approx([stop], abs=1e-9)
