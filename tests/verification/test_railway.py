"""Wheelsets on track and on rollers: Klingel's wavelength, curving, irregular track, a lifted wheel."""

import runpy

import numpy as np
import pytest
from scipy.optimize import brentq

import flyball as fb
from flyball.forces.rolling_contact import hertz, kalker_coefficients, kalker_table
from tests.mechanisms import EXAMPLES

RADIUS, HALF, CONE, HEAD, SPEED = 0.46, 0.75, 0.05, 0.3, 2.0
LOAD = (1500.0 + 50.0) * 9.81 / 2.0


def wheelset(roller=None, speed=SPEED, drive=True, **more):
    """A wheelset in a light box that does not turn, on track or on rollers."""
    m = fb.Mechanism("wheelset", gravity=(0, 0, -9.81))
    ahead = (0 if roller else speed, 0, 0)
    m.add(fb.Body("box", mass=50, inertia=(50, 50, 50), position=(0, 0, RADIUS), velocity=ahead))
    m.add(fb.Body("set", mass=1500, inertia=(900, 100, 900), position=(0, 0, RADIUS), velocity=ahead,
                  angular_velocity=(0, speed / RADIUS, 0)))  # fmt: skip
    m.add(fb.Revolute("axle", "box", "set", at=(0, 0, RADIUS), axis=(0, 1, 0)))
    m.add(fb.CoordinateSpring("upright", "box.pitch", stiffness=1e4, damping=1e3))
    given = {"radius": RADIUS, "conicity": CONE, "inclination": CONE, "dissipation": 0.5, "wheel_load": LOAD, **more}
    for name, side in (("left", 1), ("right", -1)):
        rail = f"roller {name}" if roller else "ground"
        if roller:
            centre = (0, side * HALF, -roller)
            m.add(fb.Body(rail, mass=500, inertia=(50, 100, 50), position=centre))
            m.add(fb.Revolute(f"{name} axle", "ground", rail, at=centre, axis=(0, 1, 0)))
            m.add(fb.Driver(f"{name} drive", f"{name} axle.angle", f"-{speed / roller}*t"))
        at = {"at": (0, side * HALF, 0), "axis": (0, side, 0)}
        m.add(fb.WheelOnRail(name, rail, "set", **at, roller_radius=roller, **given))
    if roller:
        m.add(fb.PointInPlane("hold", "ground", "box", at=(0, 0, RADIUS), axis=(1, 0, 0)))
    return m


def klingel(roller=None):
    """Wavelength of pure rolling: contact angles, roll of the wheelset and shift of contact included."""
    shift = HEAD * CONE / HALF * (1.0 + (RADIUS / roller if roller else 0.0))
    return 2.0 * np.pi * np.sqrt(RADIUS * HALF / (CONE * (1.0 + shift)))


@pytest.mark.parametrize("roller", [None, 0.5, 1.0])
def test_klingels_wavelength_on_track_and_on_rollers(roller):
    m = wheelset(roller)
    running = ["axle.angle", *(["left axle.angle", "right axle.angle"] if roller else ["box.x"])]
    steady = m.equilibrium(turning=running)
    eigenvalues = m.linearize(about=steady).eigenvalues
    hunting = eigenvalues[(eigenvalues.imag > 0.3) & (eigenvalues.imag < 1.1)]
    assert 2.0 * np.pi * SPEED / hunting.imag == pytest.approx([klingel(roller)], rel=2e-4)
    assert np.abs(hunting.real).max() < 0.01


def test_a_motion_follows_klingels_sine_and_keeps_its_energy_account():
    m = wheelset(speed=10.0)
    m.add(fb.Initial("box.y", value=1e-4))
    run = m.simulate(2.6, outputs=1301)
    y, x = run["set.y"], run["set.x"]
    k = np.flatnonzero(y[1:] * y[:-1] < 0.0)
    zeros = x[k] + (x[k + 1] - x[k]) * y[k] / (y[k] - y[k + 1])
    assert len(zeros) == 3
    assert 2.0 * np.diff(zeros) == pytest.approx(klingel(), rel=0.01)
    assert run.health.energy_drift < 1e-6
    borne = run["left.vertical_force"] + run["right.vertical_force"]
    assert borne[600:] == pytest.approx(2.0 * LOAD, rel=0.01)


def test_a_wheelset_steers_through_a_curve_about_the_rolling_line():
    """A free wheelset swings about r e / (R c (1 + h c / e)) off the centre, where its wheels roll without slip."""
    R, speed, duration = 2400.0, 10.0, 2.0 * klingel() / 10.0
    m = fb.Mechanism("curve", gravity=(0, 0, -9.81))
    m.add(fb.Body("set", mass=1550, inertia=(900, 100, 900), position=(0, 0, RADIUS), velocity=(speed, 0, 0),
                  angular_velocity=(0, speed / RADIUS, 0)))  # fmt: skip
    shift = RADIUS * HALF / (R * CONE * (1.0 + HEAD * CONE / HALF))
    for name, side in (("left", 1), ("right", -1)):
        given = {"radius": RADIUS, "conicity": CONE, "inclination": CONE, "dissipation": 0.5, "wheel_load": LOAD}
        at = {"at": (0, side * HALF, 0), "axis": (0, side, 0)}
        m.add(fb.WheelOnRail(name, "ground", "set", **at, curve_radius=R - side * HALF, **given))
    run = m.simulate(duration, outputs=401)
    outwards = np.hypot(run["set.x"], run["set.y"] - R) - R
    assert (outwards.mean(), outwards.max()) == pytest.approx((shift, 2.0 * shift), rel=0.05)
    assert run["left.distance"][-1] == pytest.approx(speed * duration * (R - HALF) / R, rel=1e-3)


def test_a_bump_of_the_track_moves_the_wheel():
    """A slow wheelset follows the rails."""
    m = wheelset(speed=1.0, vertical="2e-3*step5(distance, 0.2, 0, 0.8, 1)")
    run = m.simulate(1.0, outputs=101)
    assert run["set.z"][-1] - run["set.z"][0] == pytest.approx(2e-3, abs=2e-5)


def test_the_end_of_a_profile_is_told():
    m = wheelset(rail_arcs=[(0.3, 0.02)])
    m.add(fb.PointForce("push", "box", force=(0, 3e4, 0)))
    with pytest.raises(fb.SimulationError, match=r"WheelOnRail .*reached the end of the rail's profile"):
        m.simulate(2.0)


BOGIE = runpy.run_path(str(EXAMPLES / "bogie_on_rollers.py"))


def kalker_matrix(speed):
    """A (12 x 12) of the bogie on track: lateral displacement and yaw of both wheelsets and the frame, and their rates.

    Linear theory (A. H. Wickens, *Fundamentals of Rail Vehicle Dynamics*, 2003, chapter 2): a cone of slope d on heads
    of the radius h rolls by G y, G = d / (e - r d), when it moves by y, and its contacts then slip by y e / (e - r d).
    """
    n = BOGIE["mechanism"]().environment()
    r, e, d, h = (n[k] for k in ("wheel_radius", "half_gauge", "conicity", "head"))
    load = ((n["frame_mass"] + 2 * n["wheelset_mass"] + 2 * n["box_mass"]) * 9.81 + n["car_weight"]) / 4
    modulus, shear = 0.5 * 210e9 / (1 - 0.28**2), 0.5 * 210e9 / 1.28
    depth = (load / hertz(0.5 / r, 0.5 / h, modulus, 1.0)[2]) ** (2 / 3)
    a, b, _ = hertz(0.5 / r, 0.5 / h, modulus, depth)
    C = kalker_coefficients(np.array(kalker_table(0.28)), 0, a / b)
    f11, f22, f23 = shear * a * b * C[0], shear * a * b * C[1], shear * (a * b) ** 1.5 * C[2]
    roll, slip, cone = d / (e - r * d), e / (e - r * d), d * (e + h * d) / (e - r * d)
    secondary, damping = 2 * n["secondary"], 2 * n["secondary_damping"]
    K, D = np.diag([0, 0, 0, 0, secondary, secondary]), np.diag([0, 0, 0, 0, damping, damping])
    M = np.diag([*[n["wheelset_mass"] + n["box_mass"] + 900 * roll**2, 920] * 2, n["frame_mass"], 3500])
    one = np.eye(6)
    for k, side in ((0, 1), (2, -1)):
        y, yaw = one[k], one[k + 1]
        L = slip * y
        D = D + 2 * f22 / speed * np.outer(L, L) + 2 * f11 * e**2 / speed * np.outer(yaw, yaw)
        K = K - 2 * f22 * np.outer(L, yaw) + 2 * f11 * e * cone / r * np.outer(yaw, y)
        D = D + 2 * f23 / speed * (np.outer(L, yaw) - np.outer(yaw, L))  # spin
        K = K + 2 * f23 * (np.outer(yaw, yaw) - roll / r * np.outer(L, y))
        K = K + 2 * load * (roll * cone / d * np.outer(y, y) - e * d * np.outer(yaw, yaw))  # gravity
        lateral, turn = y - one[4] - side * n["half_base"] * one[5], yaw - one[5]
        K = K + 2 * n["primary_y"] * np.outer(lateral, lateral) + 2 * n["primary_x"] * np.outer(turn, turn)
    return np.block([[np.zeros((6, 6)), one], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]])


def test_critical_speed_of_the_bogie_against_matrices_and_on_rollers():
    """On rollers the bogie hunts at the critical speed of the matrices for track, on track not yet (2 % above it)."""
    critical = brentq(lambda v: np.linalg.eigvals(kalker_matrix(v)).real.max(), 20, 100)
    assert critical == pytest.approx(50.8, abs=0.1)
    assert BOGIE["growth"](False, critical) < 1e-6 < 0.1 < BOGIE["growth"](True, critical)


@pytest.mark.parametrize(("speed", "least", "most"), [("160 km/h", 0.0, 3e-4), ("200 km/h", 8e-3, 11e-3)])
def test_the_bogie_hunts_between_its_flanges_above_the_critical_speed_only(speed, least, most):
    run = BOGIE["mechanism"](speed=speed).simulate(4.0, outputs=801, rtol=1e-4)
    assert least <= np.abs(run["wheelset 1.y"][-200:]).max() < most
    limit = 0.35 * run["left 1.normal_force"] + 1.0
    assert (np.hypot(run["left 1.longitudinal_force"], run["left 1.lateral_force"]) < 1.2 * limit).all()
