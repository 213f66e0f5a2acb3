"""Ropes over pulleys and drums with a radius, against closed forms."""

import numpy as np
import pytest

import flyball as fb
from flyball.errors import ModelError
from flyball.model.model_files import dumps, loads
from tests.layers import both_layers
from tests.mechanisms import example
from tests.symbolic.test_engine_agreement import agree

G = 9.81
R = 0.1
TURNED = np.array([[2, -2, 1], [1, 2, 2], [-2, -1, 2]]) / 3.0


def atwood(*, inertia=None, planar=True, **rope):
    """Masses of 2 and 3 kg, 4 m below a pulley without friction, or below a wheel with inertia."""

    def p(x, y):
        return (x, y) if planar else (x, y, 0.0)

    about, axis = (0.1, {}) if planar else ((0.1,) * 3, {"axis": (0, 0, 1)})
    m = fb.Mechanism("atwood", planar=planar, gravity=p(0, -G), parameters={"r": R})
    for name, mass, x in (("a", 2, -R), ("b", 3, R)):
        m.add(fb.Body(name, mass=mass, inertia=about, position=p(x, -4)))
        m.add(fb.Prismatic(f"{name}_guide", "ground", name, at=p(x, -4), axis=p(0, 1)))
    ends = p(-R, -4), p(0, 0), p(R, -4)
    if inertia is None:
        m.add(fb.Rope("rope", ("a", "ground", "b"), at=ends, radii=(0, "-r", 0), **axis, **rope))
        return m
    m.add(fb.Body("wheel", mass=1, inertia=inertia if planar else (inertia,) * 3))
    m.add(fb.Revolute("axle", "ground", "wheel", at=p(0, 0), **axis))
    m.add(fb.Rope("left", ("a", "wheel"), at=ends[:2], radii=(0, "-r"), turns=(0, 6), **axis, **rope))
    m.add(fb.Rope("right", ("wheel", "b"), at=ends[1:], radii=("-r", 0), turns=(6, 0), **axis, **rope))
    return m


@pytest.mark.parametrize("planar", [True, False])
def test_atwood_machine(planar):
    r = atwood(planar=planar).simulate(0.5)
    assert r["a_guide.displacement"] == pytest.approx(0.5 * G / 5 * r.t**2, abs=1e-9)
    assert r["rope.tension"] == pytest.approx(2 * 2 * 3 / 5 * G, rel=1e-9)
    assert r["rope.length"] == pytest.approx(8.0 + np.pi * R, rel=1e-12)
    assert r["rope.wrap_2"] == pytest.approx(np.pi, rel=1e-9)
    assert r["rope.load_2"] == pytest.approx(2 * r["rope.tension"], rel=1e-9)
    assert np.abs(r["energy.balance"]).max() < 1e-9


@both_layers
def test_wheel_with_inertia_over_several_turns():
    """The rope sticks to the wheel: (m_a + m_b + J / r^2) a = (m_b - m_a) g, over more than three turns."""
    J = 0.02
    r = atwood(inertia=J).simulate(2.2)
    a = G / (5 + J / R**2)
    assert r["b_guide.displacement"] == pytest.approx(-0.5 * a * r.t**2, abs=1e-7)
    assert r["axle.angle"][-1] == pytest.approx(-0.5 * a * r.t[-1] ** 2 / R, rel=1e-7)
    assert abs(r["axle.angle"][-1]) > 6 * np.pi
    assert r["left.tension"] == pytest.approx(2 * (G + a), rel=1e-7)
    assert r["right.tension"] == pytest.approx(3 * (G - a), rel=1e-7)
    assert r["left.wrap_2"] == pytest.approx(12 * np.pi - r["axle.angle"], rel=1e-9)
    assert r["right.wrap_1"] == pytest.approx(12 * np.pi + r["axle.angle"], rel=1e-9)
    assert r["left.length"] == pytest.approx(4.0 + 12 * np.pi * R, rel=1e-9)


@both_layers
def test_block_and_tackle():
    """A load on two parts of a rope: it moves half as far as the rope, with twice its tension."""
    m = fb.Mechanism("tackle", planar=True, gravity=(0, -G))
    m.add(
        fb.Body("block", mass=20, inertia=1, position=(0, -2)), fb.Body("weight", mass=12, inertia=1, position=(3, -2))
    )
    m.add(fb.Prismatic("B", "ground", "block", at=(0, -2), axis=(0, 1)))
    m.add(fb.Prismatic("W", "ground", "weight", at=(3, -2), axis=(0, 1)))
    at = ((-0.2, 0), (0, -2), (1.6, 0), (3, -2))
    m.add(fb.Rope("rope", ("ground", "block", "ground", "weight"), at=at, radii=(0, 0.2, -1.4, 0)))
    r = m.simulate(0.3)
    a = (20 - 2 * 12) * G / (20 + 4 * 12)  # of the block, downwards
    assert r["B.displacement"] == pytest.approx(-0.5 * a * r.t**2, abs=1e-9)
    assert r["W.displacement"] == pytest.approx(a * r.t**2, abs=1e-9)
    assert r["rope.tension"] == pytest.approx(20 * (G - a) / 2, rel=1e-9)
    assert r["rope.load_2"] == pytest.approx(2 * r["rope.tension"], rel=1e-9)
    assert r["rope.length"] == pytest.approx(6.0 + np.pi * 1.6, rel=1e-12)


@both_layers
@pytest.mark.parametrize("side", [1, -1])
def test_rope_that_unwinds_from_a_fixed_cylinder(side):
    """Its end runs along the involute at constant speed v: l^2 = l_0^2 + 2 r v t, over two turns and more."""
    v, start = 3.0, 0.2
    m = fb.Mechanism("involute", planar=True, gravity=(0, 0))
    m.add(fb.Body("mass", mass=2, inertia=0.1, position=(start, side * -R), velocity=(0, -side * v)))
    rope = fb.Rope("rope", ("ground", "mass"), at=((0, 0), (start, side * -R)), radii=(side * R, 0), turns=(4, 0))
    m.add(rope)
    r = m.simulate(2.5)
    length = np.sqrt(start**2 + 2 * R * v * r.t)
    turned = (length - start) / R
    assert turned[-1] > 3 * np.pi
    assert r["rope.wrap_1"] == pytest.approx(8 * np.pi - turned, abs=1e-6)
    assert np.hypot(r["mass.vx"], r["mass.vy"]) == pytest.approx(v, rel=1e-7)
    assert r["rope.tension"] == pytest.approx(2 * v**2 / length, rel=1e-6)
    assert np.hypot(r["mass.x"], r["mass.y"]) == pytest.approx(np.hypot(length, R), rel=1e-7)
    assert r["rope.length"] == pytest.approx(start + 8 * np.pi * R, rel=1e-9)


@pytest.mark.parametrize("second", [0.5, -0.5])
def test_lengths_of_open_and_crossed_belts(second):
    """From a drum around a pulley and back: two tangents sqrt(d^2 - (r_2 - r_1)^2), wrap pi + 2 asin((r_2 - r_1) / d)."""
    d, first = 2.0, -0.3
    m = fb.Mechanism("belt", planar=True)
    m.add(fb.Body("pulley", mass=1, inertia=1, position=(d, 0)), fb.Fixed("F", "ground", "pulley", at=(d, 0)))
    m.add(fb.Body("drum", mass=1, inertia=1), fb.Revolute("J", "ground", "drum", at=(0, 0)))
    m.add(fb.Rope("belt", ("drum", "pulley", "drum"), at=((0, 0), (d, 0), (0, 0)), radii=(first, second, first)))
    r = m.simulate(0.1)
    more = abs(second) - abs(first) if first * second > 0 else abs(second) + abs(first)
    wrap = np.pi + 2 * np.arcsin(more / d)
    assert r["belt.wrap_2"] == pytest.approx(wrap, rel=1e-12)
    assert r["belt.length"] == pytest.approx(2 * np.sqrt(d**2 - more**2) + abs(second) * wrap, rel=1e-12)


def drum(planar=True, **rope):
    """A load on a rope that is wound three turns on a drum, which a motor turns; in space turned by `TURNED`."""

    def p(x, y):
        return (x, y) if planar else tuple((TURNED @ (x, y, 0.0)).tolist())

    about, more = (0.1, {}) if planar else ((0.1,) * 3, {"axis": tuple(TURNED[:, 2].tolist())})
    m = fb.Mechanism("hoist", planar=planar, gravity=p(0, -G), parameters={"r": R, "k": 5e3})
    m.add(fb.Body("load", mass=10, inertia=about, position=p(1 + 0.2, -2)))
    m.add(fb.Prismatic("hoist", "ground", "load", at=p(1.2, -2), axis=p(0, 1)))
    m.add(fb.Body("drum", mass=5, inertia=0.2 if planar else (0.2,) * 3))
    m.add(fb.Revolute("J", "ground", "drum", at=p(0, 0), **more))
    at = (p(0, 0), p(1, 0.5), p(1.2, -2))
    m.add(fb.Rope("rope", ("drum", "ground", "load"), at=at, radii=("-r", -0.2, 0), turns=(3, 0, 0), **more, **rope))
    return m


@pytest.mark.parametrize("planar", [True, False])
def test_hoist_with_a_drum(planar):
    torque = 12.0
    m = drum(planar)
    m.add(fb.Motor("M", "J", torque=torque))
    r = m.simulate(1.5)
    a = (torque / R - 10 * G) / (10 + 0.2 / R**2)
    assert r["hoist.displacement"] == pytest.approx(0.5 * a * r.t**2, abs=1e-8)
    assert r["rope.tension"] == pytest.approx(10 * (G + a), rel=1e-8)
    assert r["rope.wrap_1"] == pytest.approx(6 * np.pi + r["J.angle"], rel=1e-10)
    d, more = np.hypot(1.0, 0.5), 0.1
    fall = np.arctan2(0.5, 1.0) + np.arcsin(more / d) + np.pi / 2
    assert r["rope.wrap_2"] == pytest.approx(fall, rel=1e-10)
    assert r["rope.load_2"] == pytest.approx(2 * np.sin(fall / 2) * r["rope.tension"], rel=1e-10)
    assert r["rope.length"][0] == pytest.approx(np.sqrt(d**2 - more**2) + 2.5 + 0.2 * fall + 0.6 * np.pi, rel=1e-12)


def test_elastic_rope_swings_and_goes_slack():
    """On a drum that is held: m g / k and sqrt(k / m). Thrown up the load flies free, with the rope slack."""
    m = drum(stiffness="k")
    m.add(fb.Driver("D", "J.angle", "0"))
    r = m.simulate(1.0)
    w = np.sqrt(5e3 / 10)
    assert r["hoist.displacement"] == pytest.approx(-10 * G / 5e3 * (1 - np.cos(w * r.t)), abs=1e-6)
    assert m.modes(about=m.equilibrium()).omega[0] == pytest.approx(w, rel=1e-6)
    thrown = drum()
    thrown.add(fb.Driver("D", "J.angle", "0"), fb.Initial("hoist.displacement", rate=1.0))
    r = thrown.simulate(0.3)
    back = 2.0 / G
    free = r.t < back
    assert r["hoist.displacement"][free] == pytest.approx((r.t - 0.5 * G * r.t**2)[free], abs=1e-9)
    assert r["rope.taut"][free].max() == 0.0
    assert r["rope.taut"][-1] == 1.0
    assert [e.t for e in r.events if e.name == "rope_limit"] == pytest.approx([back], abs=1e-8)


def test_capstan():
    """Euler and Eytelwein: a rope slides around a post where one tension is exp(mu phi) times the other.

    The post carries a ring without mass of its own that turns with the rope, braked by the smaller tension times that
    ratio less one.
    """
    mu, k = 0.3, 2e4
    ratio = float(np.exp(mu * np.pi))
    m = fb.Mechanism("capstan", planar=True, gravity=(0, -G), parameters={"heavy": 6.0})
    for name, mass, x in (("a", 2, -R), ("b", "heavy", R)):
        m.add(fb.Body(name, mass=mass, inertia=0.1, position=(x, -1)))
        m.add(fb.Prismatic(f"{name}_guide", "ground", name, at=(x, -1), axis=(0, 1)))
    m.add(fb.Body("ring", mass=0.1, inertia=1e-5), fb.Revolute("post", "ground", "ring", at=(0, 0)))
    m.add(fb.Rope("left", ("a", "ring"), at=((-R, -1), (0, 0)), radii=(0, -R), turns=(0, 3), stiffness=k, damping=200))
    m.add(fb.Rope("right", ("ring", "b"), at=((0, 0), (R, -1)), radii=(-R, 0), turns=(3, 0), stiffness=k, damping=200))
    free = 1.0 + 6 * np.pi * R
    m.add(fb.Sensor("one", "left.length"), fb.Sensor("two", "right.length"))
    smaller = f"max(0, min(one, two) - {free!r})*{k}"
    m.add(fb.Brake("friction", "post.angle", capacity=f"{R}*{ratio - 1.0!r}*{smaller}"))
    r = m.simulate(0.4, parameters={"heavy": 0.95 * 2 * ratio})
    assert abs(r["post.angle_rate"][-1]) < 1e-6
    assert r["right.tension"][-1] / r["left.tension"][-1] == pytest.approx(0.95 * ratio, rel=1e-3)
    r = m.simulate(0.4, parameters={"heavy": 1.3 * 2 * ratio})
    assert r["right.tension"][-1] / r["left.tension"][-1] == pytest.approx(ratio, rel=1e-3)
    heavy = 1.3 * 2 * ratio
    a = G * (heavy - 2 * ratio) / (heavy + 2 * ratio)
    assert r["b_guide.displacement_rate"][-1] - r["b_guide.displacement_rate"][len(r.t) // 2] == pytest.approx(
        -a * (r.t[-1] - r.t[len(r.t) // 2]), rel=2e-2
    )


def test_files_and_reflections():
    m = drum(length="5 m")
    assert loads(dumps(m), fb.Mechanism, "hoist.toml") == m
    assert "rope_limit" not in dumps(m)
    m = drum()
    m.add(fb.Motor("M", "J", torque=12.0))
    whole = fb.Mechanism("pair", planar=True, gravity=(0, -G))
    whole.add(m, prefix="one")
    whole.add(m, prefix="two", mirror="x", at=(4, 0))
    r = whole.simulate(0.5)
    assert r["two.rope.tension"] == pytest.approx(drum_tension(12.0), rel=1e-8)
    assert r["one.rope.tension"] == pytest.approx(drum_tension(12.0), rel=1e-8)


def test_other_analyses():
    """At rest the drum bears m g r; the rope has the same length and wrap in kinematics; it can be released."""
    m = drum()
    m.add(fb.CoordinateSpring("spring", "J.angle", stiffness=100, rest=10 * G * R / 100.0))
    e = m.equilibrium()
    assert e["J.angle"] == pytest.approx(0.0, abs=1e-9)
    assert e["rope.tension"] == pytest.approx(10 * G, rel=1e-8)
    assert e["rope.wrap_1"] == pytest.approx(6 * np.pi, rel=1e-9)
    assert m.modes(about=e).omega[0] == pytest.approx(np.sqrt(100.0 / (10 * R**2 + 0.2)), rel=1e-6)
    driven = drum()
    driven.add(fb.Driver("D", "J.angle", "t"), fb.Event("cut", "t > 0.1", do=[fb.Release("rope")]))
    r = driven.simulate(0.3)
    assert r["rope.tension"][-1] == 0.0
    assert r["hoist.displacement_acceleration"][-1] == pytest.approx(-G, rel=1e-9)


def drawn_length(r):
    """Length of the rope of `drum` as drawn, for a drum of radius r."""
    d, more = np.hypot(1.0, 0.5), 0.2 - r
    return (
        np.sqrt(d**2 - more**2) + 2.5 + 0.2 * (np.arctan2(0.5, 1.0) + np.arcsin(more / d) + np.pi / 2) + 6 * np.pi * r
    )


def test_derivatives_with_respect_to_a_radius():
    """An elastic rope that is stretched by 1 cm as drawn: acceleration k (l(r) - l_0) / m - g."""
    m = drum(stiffness="k", length=float(drawn_length(R)) - 0.01)
    m.add(fb.Driver("D", "J.angle", "0"))
    s = m.sensitivity(["hoist.displacement_acceleration"], ["r"])
    step = 1e-6
    slope = 5e3 / 10 * (drawn_length(R + step) - drawn_length(R - step)) / (2 * step)
    assert float(np.ravel(s.derivatives)[0]) == pytest.approx(slope, rel=1e-6)


def test_symbolic_equations():
    """Those of an elastic rope give the accelerations of the motion."""
    m = drum(stiffness="k")
    agree(m)
    assert "r*J.angle" in str(m.symbolic())


def test_two_circles_that_touch_stop_the_motion_by_name():
    m = fb.Mechanism("m", planar=True, gravity=(0, 0))
    m.add(fb.Body("mass", mass=2, inertia=0.1, position=(0.2, -R), velocity=(0, 3.0)))
    m.add(fb.Rope("rope", ("ground", "mass"), at=((0, 0), (0.2, -R)), radii=(R, 0), turns=(4, 0)))
    with pytest.raises(fb.SimulationError, match=r"RopeSpan 'rope_1' has no length left: 'ground' \(radius 0.1 m\)"):
        m.simulate(0.2)


def drum_tension(torque):
    """Tension of the rope of `drum`."""
    return 10 * (G + (torque / R - 10 * G) / (10 + 0.2 / R**2))


@pytest.mark.parametrize(
    ("fields", "why"),
    [
        ({"radii": (0, -0.2)}, "3 bodies need as many radii and turns"),
        ({"turns": (3, 0)}, "3 bodies need as many radii and turns"),
        ({"turns": (3, 0.5, 0)}, "turns 2 is 0.5; it is 0 at a point, a whole number at a pulley"),
        ({"turns": (3, 0, 1)}, "turns 3 is 1; it is 0 at a point"),
        ({"radii": ("-r", "r - r", 0)}, "radius 2, 'r - r', is 0"),
        ({"radii": (-0.6, 0.6, 0), "turns": None}, "points 1 and 2 are 1.11803 m apart, .* no line touches both"),
        ({"drum": "J.angle", "radius": 0.1}, "a drum is an end with a radius"),
        ({"at": None}, "give the centres of its pulleys"),
        ({"axis": (0, 0, 1)}, "leave axis out"),
        ({"radii": None}, "turns and axis are those of pulleys"),
    ],
)
def test_refused_pulleys(fields, why):
    m = fb.Mechanism("m", planar=True, parameters={"r": R})
    m.add(fb.Body("load", mass=1, inertia=1, position=(1.2, -2)), fb.Body("drum", mass=5, inertia=0.2))
    m.add(fb.Revolute("J", "ground", "drum", at=(0, 0)))
    own = {"at": ((0, 0), (1, 0.5), (1.2, -2)), "radii": ("-r", -0.2, 0), "turns": (3, 0, 0)} | fields
    with pytest.raises(ModelError, match=why):
        m.add(fb.Rope("rope", ("drum", "ground", "load"), **own))


def test_refused_in_space():
    m = fb.Mechanism("m", planar=False)
    m.add(fb.Body("load", mass=1, inertia=(1, 1, 1), position=(1, 0, -2)))
    with pytest.raises(ModelError, match="give the axis of its pulleys"):
        m.add(fb.Rope("rope", ("ground", "load"), at=((0, 0, 0), (1, 0, -2)), radii=(0.1, 0)))
    with pytest.raises(ModelError, match=r"points 1 and 2 are .* apart along the axis"):
        m.add(fb.Rope("rope", ("ground", "load"), at=((0, 0.5, 0), (1, 0, -2)), radii=(0.1, 0), axis=(0, 1, 0)))


def test_crane():
    """The load rises at half the speed of the rope and hangs on two parts; the drum bears tension times radius."""
    r = example("crane.toml").simulate(8.0, outputs=401)
    assert r["shaft.angle"][-1] == pytest.approx(12.5, abs=1e-6)
    assert r["block.y"][-1] - r["block.y"][0] == pytest.approx(0.5 * 0.2 * 12.5, abs=0.01)
    assert r["rope.length"] == pytest.approx(r["rope.length"][0], rel=1e-10)
    moving = (r.t > 1.0) & (r.t < 5.0)
    assert r["rope.tension"][moving].mean() == pytest.approx(500 * G / 2, rel=0.01)
    still = moving | (r.t > 6.1)
    assert r["motor.torque"][still] == pytest.approx(0.2 * r["rope.tension"][still], rel=1e-8)
    assert r["rope.wrap_1"] == pytest.approx(6 * np.pi + r["shaft.angle"], abs=1e-8)


@pytest.mark.parametrize("rise", [0.5, 2.0])
def test_a_rope_that_leaves_its_pulley_is_named(rise):
    """Over the top of a pulley of 0.2 m from (-1, 0) to (1, y): it leaves the pulley where its ends are in one line."""
    m = fb.Mechanism("lifted", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("hook", mass=1, inertia=0.1, position=(1, -1)))
    m.add(
        fb.Prismatic("guide", "ground", "hook", at=(1, -1), axis=(0, 1)),
        fb.Driver("lift", "guide.displacement", f"{rise}*t"),
    )
    at = ((-1, 0), (0, 0), (1, -1))
    m.add(fb.Rope("rope", ("ground", "ground", "hook"), at=at, radii=(0, -0.2, 0), stiffness=100.0))
    run = m.simulate(1.0)
    leaves = -1 + rise * run.t > 2 * np.tan(np.arcsin(0.2))  # the tangent from (-1, 0) rises by arcsin 0.2
    assert ((run["rope.wrap_2"] < 0) == leaves).all()
    named = [w for w in run.health.warnings if "it has left the pulley on 'ground' (point 2)" in w]
    assert len(named) == leaves.any()


def bollard(heavy, *, mu=0.3, turns=0, planar=True, light=2.0, radius=None, **rope):
    """Masses on an elastic rope around a fixed cylinder, half a turn and more, with friction."""

    def p(x, y):
        return (x, y) if planar else tuple((TURNED @ (x, y, 0.0)).tolist())

    about, axis = (0.1, {}) if planar else ((0.1,) * 3, {"axis": tuple(TURNED[:, 2].tolist())})
    m = fb.Mechanism("bollard", planar=planar, gravity=p(0, -G), parameters={"r": R, "mu": mu, "heavy": heavy})
    for name, mass, x in (("a", light, -R), ("b", "heavy", R)):
        m.add(fb.Body(name, mass=mass, inertia=about, position=p(x, -1)))
        m.add(fb.Prismatic(f"{name}_guide", "ground", name, at=p(x, -1), axis=p(0, 1)))
    own = {"stiffness": 2e4, "damping": 400, "friction": "mu"} | rope
    at, radii = (p(-R, -1), p(0, 0), p(R, -1)), (0, radius or "-r", 0)
    m.add(fb.Rope("rope", ("a", "ground", "b"), at=at, radii=radii, turns=(0, turns, 0), **axis, **own))
    return m


@pytest.mark.parametrize(("planar", "turns"), [(True, 0), (True, 2), (False, 1)])
@pytest.mark.parametrize("lowered", [True, False])
def test_a_rope_slips_around_a_bollard(planar, turns, lowered):
    """Euler and Eytelwein: T_2 = exp(mu wrap) T_1 in the direction of slip; the heavier mass accelerates evenly."""
    wrap = np.pi + 2 * np.pi * turns
    ratio = np.exp(0.1 * wrap) if lowered else np.exp(-0.1 * wrap)
    heavy = 1.5 * 2 * ratio if lowered else 2 / 1.5 * ratio
    r = bollard(heavy, mu=0.1, turns=turns, planar=planar).simulate(0.5)
    a = G * (heavy - 2 * ratio) / (heavy + 2 * ratio)
    late = r.t > 0.35
    assert (r["rope.tension_2"] / r["rope.tension_1"])[late] == pytest.approx(ratio, rel=1e-9)
    assert r["b_guide.displacement_acceleration"][late] == pytest.approx(-a, rel=1e-4)
    assert r["rope.tension_1"][late] == pytest.approx(2 * (G + a), rel=1e-4)
    assert r["rope.tension"] == pytest.approx(np.maximum(r["rope.tension_1"], r["rope.tension_2"]), rel=1e-12)
    assert r["rope.wrap_2"] == pytest.approx(wrap, rel=1e-9)
    assert r["rope_slip.wrap"] == pytest.approx(wrap, rel=1e-9)
    assert r["rope.load_2"] == pytest.approx(r["rope.tension_1"] + r["rope.tension_2"], rel=1e-9)
    assert r["rope.length"][0] == pytest.approx(2.0 + R * wrap, rel=1e-12)
    speed = np.abs(r["rope_slip.rate"])
    heat = np.abs(r["rope.tension_2"] - r["rope.tension_1"]) * speed
    assert r["rope_slip.heat"][-1] == pytest.approx(np.trapezoid(heat, r.t), rel=1e-3)
    assert np.abs(r["energy.balance"]).max() < 1e-5
    assert r["rope.work"][-1] < -r["rope_slip.heat"][-1]  # with the loss of its damping, and what stretches it


@both_layers
def test_a_small_force_holds_a_load_on_a_windlass():
    """Within the cone the rope sticks: three and a half turns hold 60 times the weight, at rest."""
    ratio = np.exp(0.2 * 7 * np.pi)
    r = bollard(0.7 * 2 * ratio, mu=0.2, turns=3).simulate(4.0)
    assert np.abs(r["b_guide.displacement_rate"][-1]) < 1e-5
    assert r["rope.tension_2"][-1] == pytest.approx(0.7 * ratio * 2 * G, rel=1e-4)
    assert r["rope.tension_1"][-1] == pytest.approx(2 * G, rel=1e-4)
    assert r["rope_slip.rate"][r.t > 3.0] == pytest.approx(0.0, abs=1e-12)


def test_a_rope_that_is_belayed_stays_within_the_cone():
    """From a fixed end around a post to a load, with a straight part that does not move, and a rope that goes slack."""
    m = fb.Mechanism("belay", planar=True, gravity=(0, -G))
    m.add(fb.Body("b", mass=5, inertia=0.1, position=(R, -1)))
    m.add(fb.Prismatic("guide", "ground", "b", at=(R, -1), axis=(0, 1)), fb.Initial("guide.displacement", rate=1.0))
    at = ((-1, R), (0, 0), (R, -1))
    rope = {"radii": (0, -R, 0), "stiffness": 2e4, "damping": 400, "friction": (0, 0.25, 0)}
    m.add(fb.Rope("rope", ("ground", "ground", "b"), at=at, **rope))
    r = m.simulate(2.0)
    one, two, ratio = r["rope.tension_1"], r["rope.tension_2"], np.exp(0.25 * np.pi / 2)
    assert np.all(two <= one * ratio * (1 + 1e-9) + 1e-9)
    assert np.all(one <= two * ratio * (1 + 1e-9) + 1e-9)
    flight = r.t < 2.0 / G
    assert r["guide.displacement"][flight] == pytest.approx((r.t - 0.5 * G * r.t**2)[flight], abs=1e-8)
    assert two[flight].max() == r["rope.taut"][flight].max() == 0.0
    assert two[-1] == pytest.approx(5 * G, rel=1e-3)
    assert np.abs(r["energy.balance"]).max() < 1e-4


def test_band_brake():
    """A band around half of a wheel that is driven: T_1 + T_2 keep their sum, and the torque is r (T_1 - T_2)."""
    mu, tight = 0.2, 0.01
    m = fb.Mechanism("band", planar=True)
    m.add(fb.Body("wheel", mass=3, inertia=0.02), fb.Revolute("axle", "ground", "wheel", at=(0, 0)))
    m.add(fb.Motor("motor", "axle", speed="-4"), fb.Initial("axle.angle", rate=-4))
    at, free = ((-R, -1), (0, 0), (R, -1)), 2.0 + np.pi * R - tight
    own = {"stiffness": 2e4, "damping": 50, "friction": mu, "length": float(free)}
    m.add(fb.Rope("band", ("ground", "wheel", "ground"), at=at, radii=(0, -R, 0), **own))
    r = m.simulate(3.0)
    assert r["axle.angle"][-1] == pytest.approx(-12.0, abs=1e-6)
    assert r["band.wrap_2"] == pytest.approx(np.pi, rel=1e-9)
    late, pull = r.t > 1.0, 2e4 * tight
    most, ratio = 2 * pull / (1 + np.exp(-mu * np.pi)), np.exp(mu * np.pi)
    assert r["band.tension_1"][late] == pytest.approx(most, rel=1e-6)
    assert r["band.tension_2"][late] == pytest.approx(most / ratio, rel=1e-6)
    assert -r["motor.torque"][late] == pytest.approx(R * 2 * pull * np.tanh(mu * np.pi / 2), rel=1e-6)


@both_layers
@pytest.mark.parametrize("mu", [0.5, 0.02])
def test_a_wheel_is_turned_by_a_rope_that_sticks_or_slips(mu):
    """It turns with the rope: (m_a + m_b + J / r^2) a = (m_b - m_a) g; or by r (T_2 - T_1), less than the rope moves."""
    J, ratio = 0.02, np.exp(mu * np.pi)
    m = atwood(stiffness=4e4, damping=800, friction=mu)
    m = m.changed({"rope": None})
    m.add(fb.Body("wheel", mass=1, inertia=J), fb.Revolute("axle", "ground", "wheel", at=(0, 0)))
    ends = (-R, -4), (0, 0), (R, -4)
    m.add(fb.Rope("rope", ("a", "wheel", "b"), at=ends, radii=(0, "-r", 0), stiffness=4e4, damping=800, friction=mu))
    r = m.simulate(0.8)
    late, torque = r.t > 0.6, R * (r["rope.tension_2"] - r["rope.tension_1"])
    assert r["axle.angle_acceleration"] == pytest.approx(-torque / J, rel=1e-8, abs=1e-8)
    if mu > 0.1:
        a = G / (5 + J / R**2)
        assert r["rope_slip.slip"] == pytest.approx(0.0, abs=1e-2)
        assert r["axle.angle_acceleration"][late] == pytest.approx(-a / R, rel=1e-3)
    else:
        a = G * (3 - 2 * ratio) / (3 + 2 * ratio)
        assert r["b_guide.displacement_acceleration"][late] == pytest.approx(-a, rel=1e-3)
        assert torque[late] == pytest.approx(R * 2 * (G + a) * (ratio - 1), rel=1e-3)


def test_equilibrium_within_the_cone():
    ratio = np.exp(0.3 * np.pi)
    e = bollard(0.9 * 2 * ratio).equilibrium()
    assert e["rope.tension_1"] == pytest.approx(2 * G, rel=1e-8)
    assert e["rope.tension_2"] == pytest.approx(0.9 * 2 * ratio * G, rel=1e-8)
    assert e["rope_slip.slip"] == pytest.approx(0.0, abs=1e-12)


def test_events_of_a_rope_with_friction():
    """Its tensions are signals of its slip; it cannot be released, as it has no limit."""
    m = bollard(30.0)
    m.add(fb.Event("tight", "rope_slip.tension_2 > 100", do=[fb.Stop()]))
    r = m.simulate(1.0)
    assert r["rope.tension_2"][-1] == pytest.approx(100, rel=1e-6)
    with pytest.raises(ModelError, match="Rope 'rope' has friction, and forces in place of a limit"):
        m.add(fb.Event("cut", "t > 0.1", do=[fb.Release("rope")]))
    with pytest.raises(ModelError, match=r"'rope.tension' is known only after the accelerations are"):
        m.add(fb.Event("over", "rope.tension > 100", do=[fb.Stop()]))


def test_friction_in_files_and_groups():
    m = bollard(30.0, friction=(0, "mu", 0))
    assert loads(dumps(m), fb.Mechanism, "bollard.toml") == m
    assert "slip" not in dumps(m)
    whole = fb.Mechanism("pair", planar=True, gravity=(0, -G))
    whole.add(m, prefix="one")
    whole.add(m, prefix="two", mirror="x", at=(4, 0))
    r, alone = whole.simulate(0.1), m.simulate(0.1)
    for name in ("one", "two"):
        assert r[f"{name}.rope.tension_2"][-1] == pytest.approx(alone["rope.tension_2"][-1], rel=1e-6)


@pytest.mark.parametrize(
    ("fields", "why"),
    [
        ({"friction": -0.1}, "friction is -0.1; it must not be negative"),
        ({"friction": (0, 0.1)}, "friction has 2 numbers; give one, or one for each of 3 points"),
        ({"friction": (0.1, 0, 0)}, "friction 1 is 0.1; there is none at a point or at an end"),
        ({"radii": (0, 0, 0)}, "there is friction at no pulley between its ends; it is possible at one"),
        ({"radii": None}, "friction acts around pulleys and cylinders; give their radii="),
        ({"stiffness": None, "damping": 0}, "Of inextensible ropes it is not available"),
        ({"damping": 0}, "give stiffness= and damping="),
        ({"feed": "t"}, "feed and friction are both given"),
        ({"name": "the rope"}, "give it a name of one word"),
    ],
)
def test_refused_friction(fields, why):
    m = fb.Mechanism("m", planar=True)
    m.add(fb.Body("load", mass=1, inertia=1, position=(1.2, -2)))
    own = {"at": ((0, 0), (1, 0.5), (1.2, -2)), "radii": (0, -0.2, 0), "friction": 0.2, "stiffness": 1e4, "damping": 9}
    own = {"name": "rope", "bodies": ("ground", "ground", "load")} | own | fields
    with pytest.raises(ModelError, match=why):
        m.add(fb.Rope(**own))


def test_an_equilibrium_names_a_rope_that_has_left_its_pulley():
    """A spring lifts the load above the pulley, which no rope would then touch."""
    m = fb.Mechanism("off", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("b", mass=1, inertia=0.01, position=(1.1, -1)))
    ends = ("ground", "ground", "b")
    m.add(fb.Rope("r", ends, at=((0, 0), (1, 0), (1.1, -1)), radii=(0, -0.1, 0), stiffness=1e4, damping=100))
    m.add(fb.CoordinateSpring("upright", "b.angle", stiffness=5, damping=1))
    assert not m.equilibrium().notes
    m.add(fb.SpringDamper("lift", "ground", "b", at=((1.1, 3), (1.1, -1)), stiffness=200, damping=20, length=0.5))
    assert any("has left the pulley" in note for note in m.equilibrium().notes)
