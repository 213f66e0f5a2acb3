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


def unbalanced(step, held):
    """A ball with its mass centre 3 cm off its middle rolls to and fro; ``held``: by a spring, of next to no stiffness."""
    m = floor(friction=5.0)
    tilt = np.cos(1.0)
    ball = fb.Sphere(radius=0.1, position=(0, 0, 0.03))
    inertia = (2e-3, 2e-3, 2e-3)
    at = (0, 0, 0.1 - 0.03 * tilt)
    m.add(fb.Body("ball", shape=ball, mass=1, inertia=inertia, com=(0, 0, 0), position=at, orientation=(0, 1.0, 0)))
    if held:
        m.add(fb.SpringDamper("spring", "ground", "ball", at=((0, 0, 9), at), stiffness=1e-6))
    return stepped(m, 1.0, step, outputs=101)


def test_an_unbalanced_ball_keeps_its_energy():
    """To the second order in the step: 1e-4 of it at 5 ms."""
    off = {}
    for step in (5e-3, 2.5e-3, 1.25e-3):
        run = unbalanced(step, False)
        off[step] = np.abs(run.energy.total / run.energy.total[0] - 1).max()
        assert not any("contacts gave" in w for w in run.health.warnings)
    assert off[5e-3] < 1e-4
    assert off[5e-3] > 3 * off[2.5e-3] > 9 * off[1.25e-3]


@pytest.mark.parametrize("step", [5e-3, 2e-4])
def test_energy_that_long_steps_give_is_told(step):
    """Of what belongs to a mechanism the turning of contacts is of the first order in the step."""
    run = unbalanced(step, True)
    grown = run.energy.total[-1] / run.energy.total[0] - 1
    assert 0 < grown < 5 * step
    assert any("contacts gave" in w for w in run.health.warnings) == (step > 1e-3)


def test_a_ball_rolls_down_a_sphere():
    """As 7/10 v^2 = g (R + r) (cos a - cos b) has it, to the second order in the step: its normal turns."""
    from scipy.integrate import quad

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
        off.append(abs(np.interp(b, angle, run.t) - exact))
        overlap.append(run.health.contact.worst_overlap)
        assert abs(run.energy.total[-1] / run.energy.total[0] - 1) < 1e-4
    assert off[0] < 2e-3
    assert off[0] > 3 * off[1] > 9 * off[2]
