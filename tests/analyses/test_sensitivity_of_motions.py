"""Sensitivities of motions in both layers: against closed forms, and against differences of runs of their own."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

import flyball as fb
from tests.analyses.made import G
from tests.layers import LAYERS

H = 1e-20


def by_step(function, *at):
    """Derivatives of a closed form by its last arguments, by a complex step of each."""
    return [function(*(a + 1j * H * (k == n) for k, a in enumerate(at))).imag / H for n in range(len(at))]


def damped() -> fb.Mechanism:
    m = fb.Mechanism("damped", planar=True, gravity=(0, 0), parameters={"m": 2.0, "c": 3.0, "k": 50.0, "x": 0.1})
    m.add(fb.Body("mass", mass="m", inertia=1, position=("1 + x", 0)))
    m.add(fb.Translational("rail", "ground", "mass", at=("1 + x", 0), axis=(1, 0)))
    m.add(fb.SpringDamper("damper", "ground", "mass", at=((0, 0), ("1 + x", 0)), damping="c"))
    m.add(fb.SpringDamper("spring", "ground", "mass", at=((0, 0), ("1 + x", 0)), stiffness="k", length=1))
    return m


@pytest.mark.parametrize("coordinates", LAYERS)
def test_work_and_energies_of_a_damped_oscillator(coordinates):
    """What the damper takes is what the total loses; by mass, damping, stiffness and start."""
    of = [
        "mass.x",
        "damper.work",
        "spring.work",
        "energy.total",
        "energy.kinetic",
        "energy.potential",
        "energy.balance",
    ]
    found = damped().sensitivity(of, analysis="motion", t_end=1.0, outputs=6, coordinates=coordinates)

    def state(t, m, c, k, x):
        a = c / (2 * m)
        w = np.sqrt(k / m - a * a)
        s = x * np.exp(-a * t) * (np.cos(w * t) + a / w * np.sin(w * t))
        return s, -x * np.exp(-a * t) * k / (m * w) * np.sin(w * t)

    def kinetic(t, m, c, k, x):
        return 0.5 * m * state(t, m, c, k, x)[1] ** 2

    def potential(t, m, c, k, x):
        return 0.5 * k * state(t, m, c, k, x)[0] ** 2

    forms = {
        "mass.x": lambda *p: 1 + state(*p)[0],
        "energy.kinetic": kinetic,
        "energy.potential": potential,
        "energy.total": lambda *p: kinetic(*p) + potential(*p),
        "spring.work": lambda *p: 0.5 * p[3] * p[4] ** 2 - potential(*p),
        "damper.work": lambda *p: kinetic(*p) + potential(*p) - 0.5 * p[3] * p[4] ** 2,
    }
    for name, form in forms.items():
        for i, t in enumerate(found.t):
            assert found.values[i, of.index(name)] == pytest.approx(form(t, 2.0, 3.0, 50.0, 0.1).real, abs=1e-8)
            exact = by_step(lambda *p, t=t, form=form: form(t, *p), 2.0, 3.0, 50.0, 0.1)
            assert found.derivatives[i, of.index(name)] == pytest.approx(exact, rel=1e-7, abs=1e-8), name
    assert found.derivatives[:, of.index("energy.balance")] == pytest.approx(0.0, abs=1e-7)


@pytest.mark.parametrize("coordinates", LAYERS)
def test_a_pendulum_by_elliptic_functions(coordinates):
    """sin(angle / 2) = k cd(w t, k), k = sin(start / 2), w = sqrt(g / l), of a point mass."""
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, "-g"), parameters={"g": 9.81, "l": 0.7, "start": 2.0})
    at = ("l*sin(start)", "-l*cos(start)")
    m.add(fb.Body("bob", mass=1.3, inertia=0, position=at))
    m.add(fb.Revolute("pivot", "ground", "bob", at=(0, 0), angle="start"))
    found = m.sensitivity(["pivot.angle", "bob.y"], analysis="motion", t_end=4.0, outputs=9, coordinates=coordinates)

    def angle(g, l, start):
        k = np.sin(start / 2)
        sn = ellipj(ellipk(k * k) - np.sqrt(g / l) * found.t, k * k)[0]
        return 2 * np.arcsin(k * sn)

    assert found.values[:, 0] == pytest.approx(angle(9.81, 0.7, 2.0), abs=1e-8)
    for name, p in found.parameters.items():
        h = 1e-3 * p
        values = [angle(**{**found.parameters, name: p + n * h}) for n in (-3, -2, -1, 1, 2, 3)]
        exact = np.array([-1, 9, -45, 45, -9, 1]) @ values / (60 * h)
        assert found["pivot.angle", name] == pytest.approx(exact, abs=1e-7)


@pytest.mark.parametrize("coordinates", LAYERS)
def test_changes_of_a_motion_that_is_none(coordinates):
    """A rod that hangs at rest while gravity tilts: the steps suit the changes, as nothing else asks for short ones."""
    m = fb.Mechanism("rod", planar=True, gravity=("side", -G), parameters={"side": 0.0})
    m.add(fb.Body("rod", mass=2, inertia=2 / 12, position=(0, -0.5)))
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0)))
    found = m.sensitivity(["A.angle", "A.fx"], analysis="motion", t_end=9.0, outputs=10, coordinates=coordinates)
    w = np.sqrt(1.5 * G)
    assert found["A.angle", "side"] == pytest.approx((1 - np.cos(w * found.t)) / G, abs=1e-7)


@pytest.mark.parametrize("coordinates", LAYERS)
def test_a_joint_angle_that_is_zero_and_a_parameter(coordinates):
    """The start is where a hinge is told to stand; its rotation, none as it is drawn, is not left out."""
    m = fb.Mechanism("arms", planar=True, gravity=(0, -G), parameters={"bend": 0.0, "k": 5.0})
    m.add(fb.Body("a", mass=1, inertia=0.1, position=(0.5, 0)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)))
    m.add(fb.Body("b", mass=1, inertia=0.1, position=("1 + 0.5*cos(bend)", "0.5*sin(bend)"), angle="bend"))
    m.add(fb.Revolute("B", "a", "b", at=(1, 0), angle="bend"))
    m.add(fb.TorsionalSpringDamper("spring", joint="B", stiffness="k", damping=0.1))
    found = m.sensitivity(
        ["b.x", "b.y", "spring.work", "energy.total"], analysis="motion", t_end=1.0, outputs=5,
        coordinates=coordinates, verify=True,
    )  # fmt: skip
    assert found.derivatives[0, 1, 0] == pytest.approx(0.5, abs=1e-12)
    assert found.difference < 1e-6


def driven_arms(m: fb.Mechanism) -> list[str]:
    m.add(fb.Body("a", mass=1, inertia=0.1, position=("l", 0)))
    m.add(fb.Body("b", mass="m", inertia=0.05, position=("2*l + 0.2", 0)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=("2*l", 0)))
    m.add(fb.Driver("drive", "A.angle", "0.3*sin(w*t)"))
    m.add(fb.TorsionalSpringDamper("s", joint="B", stiffness=2.0, damping="c"))
    return ["b.x", "drive.effort", "drive.work", "s.work", "energy.total", "B.angle", "A.fx"]


def rubbing_arms(m: fb.Mechanism) -> list[str]:
    m.add(fb.Body("a", mass="m", inertia=0.1, position=(0.5, 0), angular_velocity=4.0, velocity=(0, 2.0)))
    m.add(fb.Body("b", mass=1, inertia=0.1, position=("1 + l", 0)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=(1, 0)))
    for name in "AB":
        m.add(fb.JointFriction(f"rub {name}", name, static="c", kinetic="c", radius=0.05, stick_speed="w/10"))
    return ["b.x", "rub A.work", "rub B.friction", "energy.total", "A.fx"]


def sensing_slider(m: fb.Mechanism) -> list[str]:
    m.add(fb.Body("a", mass="m", inertia=0.1, position=("l", 0)), fb.Revolute("A", "ground", "a", at=(0, 0)))
    m.add(fb.Body("b", mass="m", inertia=0.1, position=(2, 0)))
    m.add(fb.Translational("P", "ground", "b", at=(2, 0), axis=(1, 0)))
    m.add(fb.Sensor("angle", "A.angle"), fb.Driver("drive", "P.displacement", "c*sin(w*angle)"))
    m.add(fb.Table("T", x=(-1, -0.4, 0, 0.4, 1), y=(-1.5, -0.5, 0, 0.3, 1.2), interpolation="cubic", beyond="hold"))
    m.add(fb.Actuator("push", "P.displacement", force="-10*m*T(value) - c*rate"))
    return ["a.x", "b.x", "drive.effort", "push.work", "energy.kinetic"]


@pytest.mark.parametrize("coordinates", LAYERS)
@pytest.mark.parametrize("built", [driven_arms, rubbing_arms, sensing_slider])
def test_drivers_friction_and_splines_against_runs_of_their_own(built, coordinates):
    """Drivers and springs, friction under its own reactions, a driver that follows a sensor with a spline beside it."""
    parameters = {"l": 0.4, "m": 1.5, "c": 0.2, "w": 3.0}
    m = fb.Mechanism("m", planar=True, gravity=(0, -G), parameters=parameters)
    of = built(m)
    to = ["m", "c", "w"] if built is rubbing_arms else None
    found = m.sensitivity(of, to or (), analysis="motion", t_end=0.5, outputs=3, coordinates=coordinates, verify=True)
    size = np.abs(found.derivatives).max(axis=(0, 2))
    apart = np.abs(found.derivatives - found.verification).max(axis=(0, 2))
    assert (apart < 1e-6 * size).all(), dict(zip(of, apart / size, strict=True))


@pytest.mark.parametrize("coordinates", LAYERS)
def test_a_free_body_in_space(coordinates):
    """Rotations about axes that turn; the energy is that of the start."""
    m = fb.Mechanism("free", gravity=(0, 0, 0), parameters={"J": 0.02, "s": 3.0})
    m.add(fb.Body("b", mass=1, inertia=("J", 0.03, 0.04), angular_velocity=("s", 0.1, 0.2)))
    m.add(fb.Frame("tip", "b", position=(1, 0.5, 0)))
    of = ["tip.x", "tip.y", "tip.vz", "energy.kinetic"]
    found = m.sensitivity(of, analysis="motion", t_end=1.0, outputs=3, coordinates=coordinates, verify=True)
    assert found.difference < 1e-6
    assert found["energy.kinetic", "J"] == pytest.approx([4.5] * 3, abs=1e-8)
    assert found["energy.kinetic", "s"] == pytest.approx([0.06] * 3, abs=1e-8)


@pytest.mark.parametrize("coordinates", LAYERS)
def test_rows_that_restrain_velocities_only(coordinates):
    """A hoop that rolls down a slope: g sin(slope) / 2 along it."""
    m = fb.load("examples/rolling_race.toml")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = m.sensitivity(
            ["hoop.x", "energy.kinetic"], ["slope"], analysis="motion", t_end=0.5, outputs=3, coordinates=coordinates,
            verify=True,
        )  # fmt: skip
    assert found.difference < 1e-6


@pytest.mark.parametrize("coordinates", LAYERS)
def test_rows_that_are_redundant(coordinates):
    """A plate on two hinges swings like a pendulum, by mass and by lever."""
    m = fb.Mechanism("plate", gravity=(0, 0, -G), parameters={"mass": 2.0, "lever": 0.2})
    m.add(fb.Body("plate", mass="mass", inertia=(0.1, 0.1, 0.1), position=(0.5, "-lever", 0)))
    for name, x in (("left", 0.0), ("right", 1.0)):
        m.add(fb.Revolute(name, "ground", "plate", at=(x, 0, 0), axis=(1, 0, 0)))
    of = ["left.angle", "plate.z", "energy.kinetic"]
    found = m.sensitivity(of, analysis="motion", t_end=0.5, outputs=3, coordinates=coordinates, verify=True)
    assert found.difference < 1e-6


@pytest.mark.parametrize("coordinates", LAYERS)
def test_works_where_drivers_leave_no_freedom(coordinates):
    """A mass on a rail, moved as a sin(w t): the driver gives its kinetic energy and what a damper takes."""
    m = fb.Mechanism("moved", planar=True, gravity=(0, 0), parameters={"m": 2.0, "c": 5.0, "a": 0.3, "w": 7.0})
    m.add(fb.Body("mass", mass="m", inertia=1, position=(1, 0)))
    m.add(fb.Translational("rail", "ground", "mass", at=(1, 0), axis=(1, 0)))
    m.add(fb.Driver("drive", "rail.displacement", "a*sin(w*t)"))
    m.add(fb.SpringDamper("damper", "ground", "mass", at=((0, 0), (1, 0)), damping="c"))
    of = ["damper.work", "drive.work", "energy.kinetic"]
    found = m.sensitivity(of, analysis="motion", t_end=1.0, outputs=5, coordinates=coordinates)

    def taken(t, m, c, a, w):
        return -c * a * a * w * w * (t / 2 + np.sin(2 * w * t) / (4 * w))

    def given(t, m, c, a, w):
        return -taken(t, m, c, a, w) + 0.5 * m * (a * w) ** 2 * (np.cos(w * t) ** 2 - 1)

    for i, t in enumerate(found.t):
        for k, form in enumerate((taken, given)):
            assert found.derivatives[i, k] == pytest.approx(
                by_step(lambda *p, t=t, form=form: form(t, *p), 2.0, 5.0, 0.3, 7.0), rel=1e-7, abs=1e-7
            )


def pushed(force: str) -> fb.Mechanism:
    """A mass that is moved along a rail by 0.3 m/s, against a force."""
    m = fb.Mechanism("pushed", planar=True, gravity=(0, 0), parameters={"k": 100.0, "x0": 0.1234})
    m.add(fb.Body("mass", mass=1, inertia=1))
    m.add(fb.Translational("rail", "ground", "mass", at=(0, 0), axis=(1, 0)))
    m.add(fb.Driver("drive", "rail.displacement", "0.3*t"))
    m.add(fb.Actuator("wall", "rail.displacement", force=force))
    return m


@pytest.mark.parametrize("coordinates", LAYERS)
def test_works_of_a_driven_mechanism_that_meets_a_wall(coordinates):
    """At a place that is a parameter: the power has a kink there, and its change with the place a jump."""
    m = pushed("-k*max(0, value - x0)")
    found = m.sensitivity(["wall.work"], analysis="motion", t_end=1.0, outputs=5, coordinates=coordinates)
    depth = np.maximum(0, 0.3 * found.t - 0.1234)
    assert found["wall.work", "k"] == pytest.approx(-0.5 * depth**2, abs=1e-9)
    assert found["wall.work", "x0"] == pytest.approx(100 * depth, abs=1e-5)


@pytest.mark.parametrize("coordinates", LAYERS)
def test_work_of_a_force_that_jumps_on_a_driven_way(coordinates):
    r = pushed("where(value > x0, -5, 0)").simulate(1.0, outputs=5, coordinates=coordinates)
    assert r["wall.work"] == pytest.approx(-5 * np.maximum(0, 0.3 * r.t - 0.1234), abs=2e-5)


@pytest.mark.parametrize("coordinates", LAYERS)
def test_andrews_squeezing_mechanism(coordinates):
    """Ten parameters over 0.03 s: angles by torque, spring, and by where its parts stand."""
    m = fb.load("examples/andrews.toml")
    to = ["torque", "stiffness", "beta", "theta", "xc", "d", "sd", "zt", "fa", "ea"]
    of = ["K1.angle", "K7.angle", "motor.work", "energy.kinetic"]
    given = {"analysis": "motion", "t_end": 0.03, "outputs": 3}
    found = m.sensitivity(of, to, coordinates=coordinates, **given)
    h = 1e-3
    r = {p: [m.simulate(0.03, outputs=3, rtol=1e-12, atol=1e-14, parameters={p: found.parameters[p] * (1 + n * h)})
             for n in (-2, -1, 1, 2)] for p in ("torque", "stiffness")}  # fmt: skip
    for p, runs in r.items():
        for name in of:
            values = [run[name][-1] for run in runs]
            exact = np.array([1, -8, 8, -1]) @ values / (12 * h * found.parameters[p])
            assert found[name, p][-1] == pytest.approx(exact, rel=1e-6)


def test_what_is_asked_in_vain_is_refused():
    m = damped()
    with pytest.raises(fb.ModelError, match="coordinates apply to a motion"):
        m.sensitivity(["mass.x"], coordinates="joint")
    with pytest.raises(fb.ModelError, match="unknown coordinates 'joints'"):
        m.sensitivity(["mass.x"], analysis="motion", t_end=1, coordinates="joints")
    with pytest.raises(fb.ModelError, match="has no parameters to take derivatives by"):
        fb.load("examples/heavy_top.toml").sensitivity(["top.x"])
