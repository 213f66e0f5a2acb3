"""Bodies that roll, by themselves, after sliding, and against rolling and spinning friction."""

import numpy as np
import pytest

import flyball as fb

from .contact_scenes import G, floor, stepped

R, M = 0.1, 2.0
ROUND = {  # shape, k = J / (m r^2)
    "sphere": (fb.Sphere(radius=R), 2 / 5),
    "cylinder": (fb.Cylinder(radius=R, length=0.2, orientation=(np.pi / 2, 0, 0)), 1 / 2),
    "hoop": (fb.Cylinder(radius=R, length=0.02, orientation=(np.pi / 2, 0, 0)), 1.0),
}


def body(kind, planar=False, **fields):
    """It lies on the floor, its axis along y (along z in the plane)."""
    shape, k = ROUND[kind]
    J = k * M * R**2
    if planar:
        shape = fb.Sphere(radius=R)
        return fb.Body("body", mass=M, inertia=J, shape=shape, position=(0, R), **fields)
    inertia = (J, J, J) if kind == "sphere" else (J / 2 + 1e-3, J, J / 2 + 1e-3)
    return fb.Body("body", mass=M, inertia=inertia, shape=shape, position=(0, 0, R), **fields)


@pytest.mark.parametrize("kind", ROUND)
@pytest.mark.parametrize("planar", [False, True])
def test_it_rolls_down(kind, planar):
    """a = g sin / (1 + k), exactly, and without losing energy."""
    m = floor(20, planar, friction=0.5)
    m.add(body(kind, planar))
    run = stepped(m, 1.0, 5e-3)
    a = G * np.sin(np.radians(20)) / (1 + ROUND[kind][1])
    assert run["body"].vx[-1] == pytest.approx(a, rel=1e-6)
    assert run["body"].x[-1] == pytest.approx(a / 2, rel=1e-6)
    assert run.energy.total[-1] == pytest.approx(run.energy.total[0], abs=1e-6)


@pytest.mark.parametrize("kind", ROUND)
def test_it_rolls_and_slides_where_friction_is_small(kind):
    """a = g (sin - mu cos), and turning by mu m g cos r / J, if mu < tan k / (1 + k)."""
    m = floor(40, friction=0.1)
    m.add(body(kind))
    run = stepped(m, 0.5, 5e-3)["body"]
    s, c, k = np.sin(np.radians(40)), np.cos(np.radians(40)), ROUND[kind][1]
    assert run.vx[-1] == pytest.approx(0.5 * G * (s - 0.1 * c), rel=1e-6)
    assert run.angular_velocity[-1] == pytest.approx([0, 0.5 * 0.1 * G * c / (k * R), 0], abs=1e-4)


@pytest.mark.parametrize("kind", ROUND)
@pytest.mark.parametrize("planar", [False, True])
def test_sliding_becomes_rolling(kind, planar):
    """v -> v / (1 + k) at any step; until then it slides with mu g."""
    m = floor(0, planar, friction=0.3)
    m.add(body(kind, planar, velocity=(2, 0) if planar else (2, 0, 0)))
    run = stepped(m, 1.0, 5e-3, outputs=21)
    k = ROUND[kind][1]
    assert run["body"].vx[-1] == pytest.approx(2 / (1 + k), rel=1e-6)
    slides = run.t < 2 * k / (1 + k) / (0.3 * G) - 0.005
    assert run["body"].vx[slides] == pytest.approx(2 - 0.3 * G * run.t[slides], abs=1e-6)
    assert run.exchanged["friction_loss"][-1] == pytest.approx(M * 2**2 / 2 * k / (1 + k), rel=1e-6)


@pytest.mark.parametrize("step", [5e-3, 1e-3])
def test_rolling_friction_stops_a_ball(step):
    """A ball rolls on with v - a t, a = g d / (r (1 + k)), d the lever of rolling friction; then it lies."""
    m = floor(friction=0.5, rolling_friction=0.002)
    m.add(body("sphere", velocity=(0.3, 0, 0), angular_velocity=(0, 0.3 / R, 0)))
    a = G * 0.002 / R / 1.4
    run = stepped(m, 3.0, step, outputs=61)
    rolls = run.t < 0.3 / a - step
    assert run["body"].vx[rolls] == pytest.approx(0.3 - a * run.t[rolls], abs=1e-6)
    assert run["body"].x[-1] == pytest.approx(0.3**2 / (2 * a), rel=2e-3)
    assert np.abs(run["body"].velocity[-1]).max() < 1e-9


def test_rolling_friction_holds_on_a_slope():
    """Up to tan = d / r a ball does not roll."""
    for slope, holds in ((1.1, True), (1.2, False)):
        m = floor(slope, friction=0.5, rolling_friction=0.002)
        m.add(body("sphere"))
        run = stepped(m, 1.0, 5e-3)["body"]
        s, c = np.sin(np.radians(slope)), np.cos(np.radians(slope))
        assert run.vx[-1] == pytest.approx(0.0 if holds else G * (s - 0.02 * c) / 1.4, abs=1e-7)


def test_spinning_friction_stops_a_ball():
    """w - 5/2 g d t / r^2, d the lever: at rest after 2 w r^2 / (5 g d)."""
    m = floor(friction=0.5, spinning_friction=0.001)
    m.add(body("sphere", velocity=(0, 0, 0), angular_velocity=(0, 0, 3)))
    slow = 2.5 * G * 0.001 / R**2
    run = stepped(m, 2.0, 5e-3, outputs=101)
    spins = run.t < 3 / slow - 0.005
    assert run["body"].angular_velocity[spins, 2] == pytest.approx(3 - slow * run.t[spins], abs=1e-6)
    assert np.abs(run["body"].angular_velocity[-1]).max() < 1e-9
    assert run["body"].position[-1] == pytest.approx([0, 0, R], abs=1e-9)


def unbalanced(step, held, span=1.0, off=0.03, tilt=0.54):
    """A ball with its mass centre off its middle rolls to and fro; ``held``: by a spring, of next to no stiffness."""
    m = floor(friction=5.0)
    ball = fb.Sphere(radius=0.1, position=(0, 0, off))
    inertia = (2e-3, 2e-3, 2e-3)
    at = (0, 0, 0.1 - off * np.cos(tilt))
    m.add(fb.Body("ball", shape=ball, mass=1, inertia=inertia, com=(0, 0, 0), position=at, orientation=(0, tilt, 0)))
    if held:
        m.add(fb.SpringDamper("spring", "ground", "ball", at=((0, 0, 9), at), stiffness=1e-6))
    return stepped(m, span, step, outputs=101)


def test_an_unbalanced_ball_keeps_its_energy():
    """To the third order in the step: 0.5 % in 5 s at 10 ms, of that above rest. It neither slides nor is hit."""
    off = {}
    for step in (1e-2, 5e-3, 2.5e-3):
        run = unbalanced(step, False, 5.0, off=0.06, tilt=2.0)
        off[step] = abs(run.energy.total[-1] - run.energy.total[0]) / (run.energy.total[0] - G * 0.04)
        assert run.energy.numerical_loss[-1] == pytest.approx(run.energy.total[0] - run.energy.total[-1], abs=1e-9)
        assert np.abs([run.energy.impact_loss, run.energy.friction_loss]).max() < 1e-9
        assert not run.health.doubtful
    assert off[1e-2] < 1e-2
    assert off[1e-2] > 5 * off[5e-3] > 25 * off[2.5e-3]


@pytest.mark.parametrize("step", [5e-3, 1e-3])
def test_an_unbalanced_ball_on_a_spring_keeps_its_energy(step):
    """The same of what belongs to a mechanism."""
    run = unbalanced(step, True)
    assert abs(run.energy.total[-1] / run.energy.total[0] - 1) < 1e-5
    assert not run.health.doubtful


CELT = np.array([0.2, 0.03, 0.02])  # semi-axes
SKEW = np.array([[2e-4, -2e-5, 0], [-2e-5, 1.6e-3, 0], [0, 0, 1.7e-3]])
DROP = np.array([0, 0, 0.01])  # from the mass centre to the ellipsoid's


def celt(spin, tilt):
    """An ellipsoid of 1 kg that rolls, its principal axes of inertia askew."""
    up = np.array([0, np.sin(tilt), np.cos(tilt)])
    foot = DROP - CELT**2 * up / np.sqrt((CELT**2 * up**2).sum())
    turned = np.array([[1, 0, 0], [0, up[2], -up[1]], [0, up[1], up[2]]])
    m = floor(friction=5.0)
    shape = fb.Ellipsoid(semi_axes=CELT, position=DROP)
    place = {"position": (0, 0, -(turned @ foot)[2]), "orientation": (tilt, 0, 0)}
    moves = {"velocity": np.cross(turned @ foot, [0, 0, spin]), "angular_velocity": (0, 0, spin)}
    m.add(fb.Body("stone", mass=1, inertia=SKEW, com=(0, 0, 0), shape=shape, **place, **moves))
    return m


def celt_exact(spin, tilt, t):
    """Spin about the vertical, by the equations in body axes (Kane and Levinson 1982): J w' + w x J w = r x F."""
    from scipy.integrate import solve_ivp

    def rates(_, y):
        w, n = y[:3], y[3:]
        n1, size = np.cross(n, w), np.sqrt((CELT**2 * n * n).sum())
        r = DROP - CELT**2 * n / size
        r1 = -(CELT**2) * n1 / size + CELT**2 * n * (CELT**2 * n * n1).sum() / size**3
        known = np.cross(r1, w) + np.cross(w, np.cross(r, w)) + G * n
        x, y_, z = r
        X = np.array([[0, -z, y_], [z, 0, -x], [-y_, x, 0]])
        return np.r_[np.linalg.solve(SKEW - X @ X, np.cross(r, known) - np.cross(w, SKEW @ w)), n1]

    up = np.array([0, np.sin(tilt), np.cos(tilt)])
    y = solve_ivp(rates, (0, t[-1]), np.r_[spin * up, up], "DOP853", t, rtol=1e-9, atol=1e-11).y
    return (y[:3] * y[3:]).sum(axis=0)


def test_a_rattleback_rocks_up_from_its_spin():
    """Rocking grows by what spin loses, which a method that takes energy would eat; what it takes is told and judged."""
    tilt = np.radians(3.0)
    run = stepped(celt(-5.0, tilt), 2.0, 2.5e-4, outputs=21)
    assert run["stone.omega_z"] == pytest.approx(celt_exact(-5.0, tilt, run.t), abs=0.1)
    assert abs(run.energy.total[-1] - run.energy.total[0]) < 5e-3 * run.energy.kinetic[0]
    assert not run.health.doubtful
    rough = stepped(celt(-5.0, tilt), 5.0, 1e-3, outputs=26)
    lost = rough.energy.total[0] - rough.energy.total[-1]
    assert lost > 0.02 * rough.energy.kinetic[0]
    assert rough.energy.numerical_loss[-1] == pytest.approx(lost, rel=1e-6)
    assert any("numerical_loss" in text for text in rough.health.doubtful) and "doubtful" in rough.health.status


def test_a_rattleback_converges_to_its_equations():
    """With half the step half of the error of its spin is left, and half of the energy that stepping takes."""
    tilt = np.radians(3.0)
    off, lost = [], []
    for step in (2e-4, 1e-4, 5e-5):
        run = stepped(celt(-5.0, tilt), 2.0, step, outputs=5)
        off.append(np.abs(run["stone.omega_z"] - celt_exact(-5.0, tilt, run.t)).max())
        lost.append(run.energy.numerical_loss[-1] / run.energy.kinetic[0])
    assert off[2] < 3e-3
    for x in (off, lost):
        assert x[0] > 1.5 * x[1] > 1.5**2 * x[2]


def test_a_ball_rolls_down_a_sphere():
    """As 7/10 v^2 = g (R + r) (cos a - cos b) has it, to the second order in the step: its normal turns."""
    from scipy.integrate import quad
    from scipy.interpolate import CubicSpline

    size, a, b = 1.1, 0.1, 0.8  # it leaves at cos b = 10/17 cos a

    def f(s):  # b = a + s^2 takes the root at the start away
        return 2 * s / np.sqrt(10 / 7 * G / size * (np.cos(a) - np.cos(a + s * s)))

    exact, off, overlap = quad(f, 1e-9, np.sqrt(b - a))[0], [], []
    for step in (8e-3, 4e-3, 2e-3):
        m = fb.Mechanism("scene", gravity=(0, 0, -G))
        m.add(fb.Ground("hill", shape=fb.Sphere(radius=1.0)))
        m.add(fb.Body("ball", shape=fb.Sphere(radius=0.1), mass=1, position=(size * np.sin(a), 0, size * np.cos(a))))
        m.add(fb.Contact(friction=5.0))
        n = round(1.02 * exact / step)
        run = stepped(m, n * step, step, outputs=n + 1)
        angle = np.arctan2(run["ball"].x, run["ball"].z)
        off.append(abs(CubicSpline(angle, run.t)(b) - exact))
        overlap.append(run.health.contact.worst_overlap)
        assert abs(run.energy.total[-1] / run.energy.total[0] - 1) < 1e-4
    assert off[0] < 2e-5
    assert off[0] > 3 * off[1] > 9 * off[2]
