"""Point masses have velocities and no turns; rings without mass pass on what acts on them. Closed forms, both layers."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipj, ellipk

import flyball as fb

G = 9.81
LAYERS = ("absolute", "joint")
PLANES = pytest.mark.parametrize("planar", [True, False])
layered = pytest.mark.parametrize("layer", LAYERS)


def empty(planar=False, **more):
    return fb.Mechanism("points", planar=planar, gravity=(0, -G) if planar else (0, 0, -G), **more)


def flat(planar, x, z):
    """A point of the x-z plane, which is the mechanism's own where that is planar."""
    return (x, z) if planar else (x, 0.0, z)


def pendulum(planar, *places, mass=1.0):
    """Point masses, each on a rod from the one before."""
    m = empty(planar)
    before, at = "ground", flat(planar, 0, 0)
    for k, (x, z) in enumerate(places):
        here = flat(planar, x, z)
        m.add(fb.Body(f"p{k}", mass=mass, inertia=0, position=here))
        m.add(fb.Distance(f"rod{k}", before, f"p{k}", at=(at, here)))
        before, at = f"p{k}", here
    return m


@PLANES
@layered
def test_a_pendulum_swings_as_elliptic_functions_say(planar, layer):
    """sin(a/2) = k sn(K - w t), let go at the angle a0 with k = sin(a0/2)."""
    a0, length = 2.0, 1.3
    m = pendulum(planar, (length * np.sin(a0), -length * np.cos(a0)))
    run = m.simulate(4, outputs=41, coordinates=layer, rtol=1e-10, atol=1e-12)
    k = np.sin(a0 / 2)
    sn = ellipj(ellipk(k * k) - np.sqrt(G / length) * run.t, k * k)[0]
    angle = 2 * np.arcsin(k * sn)
    p = run["p0"].position
    assert np.abs(p[:, 0] - length * np.sin(angle)).max() < 1e-7
    assert np.abs(p[:, -1] + length * np.cos(angle)).max() < 1e-7
    assert run.values.structure.nv == (2 if planar else 3)
    assert not np.abs(run["p0"].angular_velocity).max() > 0.0


@layered
def test_a_spherical_pendulum_turns_where_momentum_and_energy_let_it(layer):
    """Between heights that are zeros of the cubic of energy and angular momentum."""
    m = empty()
    m.add(fb.Body("bob", mass=2, inertia=(0, 0, 0), position=(1, 0, 0), velocity=(0, 1.5, 0)))
    m.add(fb.Distance("rod", "ground", "bob", at=((0, 0, 0), (1, 0, 0))))
    run = m.simulate(6, outputs=601, coordinates=layer, rtol=1e-10, atol=1e-12)
    p, v = run["bob"].position, run["bob"].velocity
    moment = p[:, 0] * v[:, 1] - p[:, 1] * v[:, 0]
    assert np.abs(moment - 1.5).max() < 1e-8
    lowest = min(np.roots([2 * G, -(1.5**2), -2 * G]).real)  # (1.5^2 - 2 g z) (1 - z^2) = 1.5^2
    assert p[:, 2].min() == pytest.approx(lowest, abs=1e-3)
    assert p[:, 2].min() > lowest - 1e-8
    assert p[:, 2].max() < 1e-8


@PLANES
@layered
def test_a_double_pendulum_moves_as_lagrange_says(planar, layer):
    """Two masses, m1 = m2 and rods of 1 m and 0.7 m: Landau and Lifshitz, *Mechanics*, section 5, problem 1."""
    a, b, l1, l2 = 1.2, -0.5, 1.0, 0.7
    x, z = l1 * np.sin(a), -l1 * np.cos(a)
    m = pendulum(planar, (x, z), (x + l2 * np.sin(b), z - l2 * np.cos(b)))

    def rates(_, y):
        a, b, da, db = y
        c, s = np.cos(a - b), np.sin(a - b)
        M = [[2 * l1 * l1, l1 * l2 * c], [l1 * l2 * c, l2 * l2]]
        f = [-l1 * l2 * s * db * db - 2 * G * l1 * np.sin(a), l1 * l2 * s * da * da - G * l2 * np.sin(b)]
        return [da, db, *np.linalg.solve(M, f)]

    exact = solve_ivp(rates, (0, 2), [a, b, 0, 0], method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    run = m.simulate(2, outputs=2, coordinates=layer, rtol=1e-10, atol=1e-12)
    p0, p1 = (run[k].position[-1] for k in ("p0", "p1"))
    assert p0[[0, -1]] == pytest.approx([l1 * np.sin(exact[0]), -l1 * np.cos(exact[0])], abs=1e-7)
    assert (p1 - p0)[[0, -1]] == pytest.approx([l2 * np.sin(exact[1]), -l2 * np.cos(exact[1])], abs=1e-7)


@PLANES
def test_a_chain_of_beads_hangs_in_the_discrete_catenary(planar):
    """tan of each link's angle goes up by m g / H: the polygon of weights on a string (Huygens 1646)."""
    n, link, span, mass = 7, 0.5, 2.4, 0.3
    k = np.arange(n) - (n - 1) / 2

    def slopes(H):
        return np.arctan(mass * G * k / H)

    H = brentq(lambda H: link * np.cos(slopes(H)).sum() - span, 1e-3, 1e3, xtol=1e-13)
    ways = link * np.array([np.cos(slopes(H)), np.sin(slopes(H))]).T
    exact = np.cumsum(ways, axis=0)
    rough = exact + np.where(np.arange(n)[:, None] < n - 1, [[0.0, 0.02]], 0.0) * np.sin(3 * np.arange(n))[:, None]
    m = empty(planar)
    before, at = "ground", flat(planar, 0, 0)
    for i, (x, z) in enumerate(rough):
        last, here = i == n - 1, flat(planar, x, z)
        if not last:
            m.add(fb.Body(f"b{i}", mass=mass, inertia=0, position=here))
        m.add(fb.Distance(f"l{i}", before, "ground" if last else f"b{i}", at=(at, here), length=link))
        before, at = f"b{i}", here
    found = m.equilibrium()
    assert found.stability == "stable"
    p = np.array([found[f"b{i}"].position[0] for i in range(n - 1)])[:, [0, -1]]
    assert np.abs(p - exact[:-1]).max() < 1e-8
    pull = [np.linalg.norm(found[f"l{i}"].force[0]) for i in range(n)]
    assert pull == pytest.approx(H / np.cos(slopes(H)), rel=1e-8)


def gimbal(**rings):
    """A heavy gyroscope in two rings on crossed axes."""
    m = empty()
    rings = {"mass": 0, "inertia": 0} | rings
    m.add(fb.Body("outer", **rings), fb.Body("inner", **rings))
    m.add(fb.Body("rotor", mass=2, inertia=(0.02, 0.03, 0.05), com=(0, 0, 0.04)))
    m.add(fb.Revolute("A", "ground", "outer", at=(0, 0, 0), axis=(1, 0, 0)))
    m.add(fb.Revolute("B", "outer", "inner", at=(0, 0, 0), axis=(0, 1, 0)))
    m.add(fb.Revolute("C", "inner", "rotor", at=(0, 0, 0), axis=(0, 0, 1)))
    m.add(fb.Initial("A.angle", value=0.3, rate=0.5), fb.Initial("B.angle", value=0.2, rate=-0.4))
    m.add(fb.Initial("C.angle", value=0, rate=20))
    return m


def bryant(y):
    """Rates of Bryant angles (a, b, c) and of the angular velocity in body axes, of a heavy body on a fixed point."""
    a, b, c, *w = y
    w = np.array(w)
    J, arm = np.diag([0.02, 0.03, 0.05]) + 2 * 0.04**2 * np.diag([1, 1, 0]), np.array([0, 0, 0.04])
    ca, sa, cb, sb, cc, sc = (f(x) for x in (a, b, c) for f in (np.cos, np.sin))
    down = -np.array([sa * sc - ca * sb * cc, sa * cc + ca * sb * sc, ca * cb])  # of the world, in the body
    dw = np.linalg.solve(J, 2 * G * np.cross(arm, down) - np.cross(w, J @ w))
    u = w[0] * cc - w[1] * sc
    return [u / cb, w[0] * sc + w[1] * cc, w[2] - u * sb / cb, *dw]


@pytest.mark.parametrize("rings", [{}, {"mass": 0.5}], ids=["massless", "without inertia"])
@layered
def test_a_gyroscope_in_rings_without_inertia_moves_as_if_there_were_none(layer, rings):
    """Its angles are Bryant's, as Euler's equations have them."""
    da, db, dc, b = 0.5, -0.4, 20.0, 0.2
    w = [da * np.cos(b), db, dc + da * np.sin(b)]
    exact = solve_ivp(lambda _, y: bryant(y), (0, 1), [0.3, b, 0.0, *w], method="DOP853", rtol=1e-12, atol=1e-12)
    run = gimbal(**rings).simulate(1, outputs=2, coordinates=layer, rtol=1e-10, atol=1e-12)
    angles = [run[k].angle[-1] for k in "ABC"]
    assert angles == pytest.approx(exact.y[:3, -1], abs=1e-7)
    assert run.values.structure.nv == (18 if layer == "absolute" else 3)
    pins = [run[k].reaction()[0][-1] for k in "AB"] if rings == {} else None
    if pins:
        assert pins[0] == pytest.approx(pins[1], abs=1e-6)  # a ring without mass takes nothing


@layered
def test_a_ring_that_nothing_with_inertia_holds_is_refused(layer):
    m = empty()
    m.add(fb.Body("ring", mass=0, inertia=0))
    m.add(fb.Revolute("A", "ground", "ring", at=(0, 0, 0), axis=(1, 0, 0)))
    with pytest.raises(fb.ModelError, match=r"'ring' can turn about \(1, 0, 0\).*without any inertia"):
        m.simulate(1, coordinates=layer)


def test_a_knot_without_mass_is_refused_and_with_it_moves():
    def knot(mass):
        m = empty(True)
        m.add(fb.Body("knot", mass=mass, inertia=0, position=(0, -1)))
        m.add(fb.Distance("rod", "ground", "knot", at=((0, 0), (0, -1))))
        return m

    with pytest.raises(fb.ModelError, match="'knot' can move without any mass"):
        knot(0).simulate(1)
    assert knot(1).simulate(1)["knot"].position[-1] == pytest.approx([0, -1], abs=1e-12)


def test_mass_zero_with_an_inertia_is_refused():
    with pytest.raises(fb.ModelError, match="inertia=0 too"):
        empty(True).add(fb.Body("b", mass=0, inertia=1))


def arm(*more):
    """Two links, and a point mass hung from the tip, with what else there is."""
    m = empty(True)
    m.add(
        fb.Body("upper", mass=1, inertia=0.1, position=(0.5, 0)),
        fb.Body("lower", mass=1, inertia=0.1, position=(1.5, 0)),
    )
    m.add(fb.Revolute("A", "ground", "upper", at=(0, 0)), fb.Revolute("B", "upper", "lower", at=(1, 0)))
    m.add(fb.Body("load", mass=3, inertia=0, position=(2, -0.5), angle=0.4))
    m.add(fb.Distance("rope", "lower", "load", at=((2, 0), (2, -0.5))))
    m.add(*more)
    return m


def test_a_load_on_an_arm_moves_alike_in_both_layers():
    spring = fb.SpringDamper("spring", "ground", "load", at=((3, 0), (2, -0.5)), stiffness=20)
    wind = fb.PointForce("wind", "load", force=("3*sin(2*t)", 0))
    one, other = (arm(spring, wind).simulate(1, outputs=11, coordinates=c, rtol=1e-10, atol=1e-12) for c in LAYERS)
    assert (one.values.structure.nv, other.values.structure.nv) == (8, 4)
    assert np.abs(one["load"].position - other["load"].position).max() < 1e-8
    for run in (one, other):
        assert np.abs(run["load"].angle - 0.4).max() == 0.0
        assert run.health.energy_drift < 1e-7
        assert run["rope"].force[-1] == pytest.approx(one["rope"].force[-1], abs=1e-5)


OTHERWISE = {
    "off": (
        fb.SpringDamper("x", "ground", "load", at=((3, 0), (2.1, -0.5)), stiffness=20),
        "SpringDamper 'x' is attached off",
    ),
    "torque": (fb.PointTorque("x", "load", torque=1), "PointTorque 'x' needs its orientation"),
    "turned": (fb.PointForce("x", "load", force=(1, 0), axes="body"), "PointForce 'x' needs its orientation"),
    "pin": (fb.Revolute("x", "ground", "load", at=(2, -0.5)), ""),
}


@pytest.mark.parametrize("how", OTHERWISE)
@layered
def test_what_needs_an_orientation_is_told(how, layer):
    """A body that something could turn is no point mass: then it needs an inertia, or joints that hold it."""
    element, message = OTHERWISE[how]
    m = arm(element)
    if message:
        with pytest.raises(fb.ModelError, match=f"'load' can turn.*no point mass.*since {message}"):
            m.simulate(0.1, coordinates=layer)
    else:
        assert m.simulate(0.1, coordinates=layer)["load"].velocity[-1] == pytest.approx([0, 0], abs=1e-12)


def test_a_body_without_inertia_that_joints_hold_is_a_rigid_body():
    """Its orientation is theirs: a bob on an arm, a slider."""
    m = empty(True)
    m.add(fb.Body("bob", mass=1, inertia=0, position=(1, 0)))
    m.add(fb.Revolute("A", "ground", "bob", at=(0, 0)))
    run = m.simulate(0.3)
    assert run.values.structure.nv == 3 or "joint" in run.health.coordinates
    assert run["bob"].angle[-1] != 0.0


def test_an_inertia_that_is_a_parameter_is_no_point_mass():
    m = empty(True, parameters={"J": 0.0})
    m.add(fb.Body("bob", mass=1, inertia="J", position=(1, 0)))
    m.add(fb.Distance("rod", "ground", "bob", at=((0, 0), (1, 0))))
    with pytest.raises(fb.ModelError, match="without any inertia"):
        m.simulate(0.1)
    assert m.simulate(0.1, parameters={"J": 0.1}).values.structure.nv == 3


def test_parameters_that_move_an_end_off_the_centre_are_refused():
    m = empty(True, parameters={"x": 1.0})
    m.add(fb.Body("bob", mass=1, inertia=0, position=("x", 0)))
    m.add(fb.Distance("rod", "ground", "bob", at=((0, 0), (1, 0))))
    assert m.simulate(0.1).values.structure.nv == 2
    with pytest.raises(fb.ModelError, match=r"'bob' has no inertia and is a point mass.*0\.5 m off its centre"):
        m.simulate(0.1, parameters={"x": 1.5})


def test_balls_at_the_centre_join_rods_to_a_point_mass():
    """Two rods joined by a mass at their hinge: as if it were a part of one of them."""

    def joined(lump):
        m = empty()
        for k in (0, 1):
            m.add(fb.Body(f"rod{k}", mass=1, inertia=(0.01, 0.1, 0.1), position=(0.5 + k, 0, 0)))
        m.add(fb.Spherical("A", "ground", "rod0", at=(0, 0, 0)))
        if lump:
            m.add(fb.Body("lump", mass=2, inertia=0, position=(1, 0, 0)))
            m.add(fb.Spherical("B", "rod0", "lump", at=(1, 0, 0)), fb.Spherical("C", "lump", "rod1", at=(1, 0, 0)))
        else:
            m.add(fb.Body("lump", mass=2, inertia=(1e-9, 1e-9, 1e-9), position=(1, 0, 0)))
            m.add(fb.Spherical("C", "rod0", "rod1", at=(1, 0, 0)), fb.Fixed("B", "rod0", "lump", at=(1, 0, 0)))
        m.add(fb.Initial("rod1.z", rate=-1.0))
        return m

    end = joined(False).simulate(0.5, outputs=2, rtol=1e-9, atol=1e-11)["rod1"].position[-1]
    for layer in LAYERS:
        run = joined(True).simulate(0.5, outputs=2, coordinates=layer, rtol=1e-9, atol=1e-11)
        assert run["rod1"].position[-1] == pytest.approx(end, abs=1e-6)
