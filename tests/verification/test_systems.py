"""Systems of the examples against closed forms and matrices of their own: bogie, press, platforms, shafts, differential."""

from __future__ import annotations

import runpy

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from tests.mechanisms import EXAMPLES, example

BOGIE = {"m": 1500.0, "Iz": 900.0, "M": 3000.0, "I": 3500.0, "r": 0.46, "b": 0.75, "a": 1.25, "conicity": 0.1}
CREEP, PRIMARY_X, PRIMARY_Y, SECONDARY, DAMPING = 6e6, 4e6, 5e6, 3e5, 2e4  # the springs' half distance across is 1 m


def bogie_matrix(speed: float) -> np.ndarray:
    """A (12 x 12) of lateral displacement and yaw of both wheelsets and the frame, each with its rate."""
    q = BOGIE
    K, C = np.diag([0, 0, 0, 0, 2 * SECONDARY, 2 * SECONDARY]), np.diag([0, 0, 0, 0, 2 * DAMPING, 2 * DAMPING])
    for y, side in ((0, 1), (2, -1)):
        K[y, y + 1] -= 2 * CREEP
        K[y + 1, y] += 2 * CREEP * q["b"] * q["conicity"] / q["r"]
        C[y, y] += 2 * CREEP / speed
        C[y + 1, y + 1] += 2 * CREEP * q["b"] ** 2 / speed
        lateral, yaw = np.zeros(6), np.zeros(6)  # what the axle boxes of the wheelset are strained by
        lateral[[y, 4, 5]] = 1, -1, -side * q["a"]
        yaw[[y + 1, 5]] = 1, -1
        K = K + 2 * PRIMARY_Y * np.outer(lateral, lateral) + 2 * PRIMARY_X * np.outer(yaw, yaw)
    M = np.diag([q["m"], q["Iz"], q["m"], q["Iz"], q["M"], q["I"]])
    return np.block([[np.zeros((6, 6)), np.eye(6)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])


def test_bogies_eigenvalues_and_critical_speed():
    m = example("bogie.py")
    for speed in (20.0, 60.0, 100.0):
        found = m.linearize(parameters={"speed": speed}).eigenvalues
        expected = np.linalg.eigvals(bogie_matrix(speed))
        apart = np.abs(np.subtract.outer(found, expected)).min(axis=0)
        assert apart.max() < 1e-9 * np.abs(expected).max()
    locus = m.root_locus("speed", np.linspace(60, 100, 5))
    critical = brentq(lambda v: np.linalg.eigvals(bogie_matrix(v)).real.max(), 60, 100, xtol=1e-10)
    assert [(c.kind, c.value) for c in locus.crossings] == [("flutter", pytest.approx(critical, rel=1e-8))]


@pytest.mark.parametrize("stiff", [False, True])
def test_klingels_wavelength(stiff):
    """At low speed of a free wheelset, and of a rigid bogie: 2 pi sqrt(r (b^2 + a^2) / (conicity b))."""
    soft = {"secondary": 0.0, "secondary_damping": 0.0}
    primary = 1e11 if stiff else 1.0
    m = example("bogie.py", speed=1.0, primary_x=primary, primary_y=primary, **soft)
    eigenvalues = m.linearize().eigenvalues
    wavelengths = 2 * np.pi / eigenvalues.imag[(eigenvalues.imag > 0.1) & (eigenvalues.imag < 1)]
    q = BOGIE
    klingel = 2 * np.pi * np.sqrt(q["r"] * (q["b"] ** 2 + stiff * q["a"] ** 2) / (q["conicity"] * q["b"]))
    assert wavelengths == pytest.approx(klingel * np.ones(1 if stiff else 2), rel=1e-5)


PRESS_MASS, SHAFT, ECCENTRICITY, ROD = 6620.0, 2.2, 0.05, 0.6
TURN = 2 * np.pi * 2  # rad/s


def test_press_sinks_by_its_weight_and_has_six_modes_on_its_mounts():
    """Bounce, yaw, and in each vertical plane a sway and a rock, with the second-order work of the static force."""
    stiffness, shear, x, y = 1e6, 4e5, 0.5, 0.9
    m = example("press.py", speed=0.0, mount_damping=0.0)
    rest = m.equilibrium()
    weight = PRESS_MASS * 9.81
    assert 1 - rest["frame.z"] == pytest.approx(weight / (4 * stiffness), rel=1e-10)
    wrist = SHAFT + ECCENTRICITY - ROD
    masses, heights = np.array([6000, 200, 120, 300]), np.array([1, SHAFT, wrist + ROD / 2, wrist])
    height = masses @ heights / PRESS_MASS
    apart = masses @ (heights - height) ** 2
    squares = [4 * stiffness / PRESS_MASS, 4 * shear * (x**2 + y**2) / (2500 + 6 + 0.5 + 8)]
    for inertia, arm in ((5000 + 10 + 5 + 9 + apart, y), (3500 + 6 + 5 + 9 + apart, x)):
        tilt = 4 * (stiffness * arm**2 + shear * height**2) - weight * height
        K = np.array([[4 * shear, 4 * shear * height], [4 * shear * height, tilt]])
        squares.extend(np.linalg.eigvals(np.linalg.solve(np.diag([PRESS_MASS, inertia]), K)))
    assert np.sort(m.modes(about=rest).omega) == pytest.approx(np.sqrt(np.sort(squares)), rel=1e-8)


def test_press_shakes_the_ground_by_its_moving_masses_only():
    """The vertical motion is that of one mass on a spring and a damper; the small roll adds a thousandth."""
    t = np.linspace(9.0, 9.5, 200, endpoint=False)  # a turn, after the start has died away
    run = example("press.py").simulate(10, outputs=[0, *t, 10])
    wrist = ECCENTRICITY * np.cos(TURN * t) - np.sqrt(ROD**2 - (ECCENTRICITY * np.sin(TURN * t)) ** 2)
    stroke = run["guide.displacement"][1:-1]
    assert stroke == pytest.approx(wrist - (ECCENTRICITY - ROD), abs=1e-11)
    assert np.ptp(stroke) == pytest.approx(2 * ECCENTRICITY, rel=1e-3)
    moment = 300 * wrist + 120 * (wrist + ECCENTRICITY * np.cos(TURN * t)) / 2
    omega = 2 * np.pi * np.fft.rfftfreq(200, 0.5 / 200)
    mount = 4e6 + 4e4j * omega
    response = omega**2 * np.fft.rfft(moment) / (mount - PRESS_MASS * omega**2)
    lift = np.fft.irfft(response, 200)
    weight = PRESS_MASS * 9.81
    assert run["frame.z"][1:-1] == pytest.approx(1 - weight / 4e6 + lift, abs=3e-3 * np.ptp(lift))
    force, ground = np.fft.irfft(mount * response, 200), sum(run[f"mount {k}.fz"][1:-1] for k in (1, 2, 3, 4))
    assert ground == pytest.approx(weight - force, abs=3e-3 * np.ptp(force))
    idle = example("press.py", press_force=0.0).simulate(10, outputs=[0, *t, 10])
    assert idle["mount 1.fz"] == pytest.approx(run["mount 1.fz"], abs=1e-4 * np.ptp(force))
    assert np.ptp(run["drive.effort"]) > 5 * np.ptp(idle["drive.effort"])


PLATFORMS = runpy.run_path(str(EXAMPLES / "parallel_platforms.py"))
G = np.array([0.0, 0.0, -9.81])


def test_leg_forces_of_the_hexapod():
    """Six lines of force hold the platform; each leg's weight is carried square to it by both of its ends."""
    m = PLATFORMS["hexapod"]("0")
    assert len(m.bodies) == 13
    found = m.inverse_dynamics([0.0, 0.1])
    lines, load, along = np.zeros((6, 6)), np.r_[-500 * G, 0, 0, 0], np.zeros(6)
    for k, (foot, top) in enumerate(PLATFORMS["HEXAPOD"]):
        length = np.linalg.norm(top - foot)
        d, arm = (top - foot) / length, top - np.array([0, 0, 1.2])
        across = np.cross(length / 4 * np.cross(d, 20 * G) + 3 * length / 4 * np.cross(d, 8 * G), d) / length
        lines[:, k] = np.r_[d, np.cross(arm, d)]
        load -= np.r_[across, np.cross(arm, across)]
        along[k] = -8 * G @ d
    forces = np.linalg.solve(lines, load) + along
    assert [found[f"drive {k}"].effort[0] for k in range(1, 7)] == pytest.approx(forces, rel=1e-10)


def test_platform_of_the_test_facility_moves_as_asked():
    """Pose, and the eight strokes that it needs in closed form."""
    m = PLATFORMS["mechanism"]()
    assert len(m.bodies) == 17
    free = PLATFORMS["platform"]("facility", PLATFORMS["FACILITY"]).check()
    assert (free.gruebler, free.freedoms, free.redundancy) == (6, 6, 0)
    run = m.simulate(2, outputs=101)
    t = run.t
    position = np.column_stack([0.06 * np.sin(6 * t), 0.04 * np.sin(9 * t), 1.2 + 0.05 * np.sin(12 * t)])
    angles = np.column_stack([0.04 * np.sin(7 * t), 0.05 * np.sin(10 * t), 0.06 * np.sin(8 * t)])
    turned = Rotation.from_euler("ZYX", angles)
    assert run["platform"].position == pytest.approx(position, abs=1e-9)
    assert run["platform"].rotation == pytest.approx(turned.as_matrix(), abs=1e-9)
    for k, (foot, top) in enumerate(PLATFORMS["FACILITY"], start=1):
        length = np.linalg.norm(position + turned.apply(top - [0, 0, 1.2]) - foot, axis=1)
        assert run[f"slide {k}.displacement"] == pytest.approx(length - np.linalg.norm(top - foot), abs=1e-9)


def test_reactions_of_the_test_facility_sum_to_its_weight():
    still = {"x": "0.05", "y": "-0.03", "z": "1.25", "roll": "0.05", "pitch": "0.04", "yaw": "-0.06"}
    run = PLATFORMS["mechanism"](still).simulate(0.1, outputs=3)
    feet = sum(run[f"foot {k}"].force for k in range(1, 9))
    drives = np.column_stack([run[f"drive {axis}.effort"] for axis in "xyz"])
    assert feet + drives == pytest.approx(np.tile(-(500 + 8 * 28) * G, (3, 1)), abs=1e-8)


def shafts(omega: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angles of both shafts by torque on the first, of the two equations of motion."""
    rope = 2 * (2e4 + 10j * omega)
    one = 0.1**2 * rope + 0.05j * omega - 0.05 * omega**2
    two = 0.2**2 * rope + 500 + 2j * omega - 0.4 * omega**2
    determinant = one * two - (0.1 * 0.2 * rope) ** 2
    return two / determinant, 0.1 * 0.2 * rope / determinant


def test_torsional_frequencies_and_transfer_functions_of_two_shafts():
    m = example("two_shafts.py")
    linear = m.linearize(["motor"], ["shaft 1.angle", "shaft 2.angle"])
    omega = np.geomspace(1, 500, 30)
    for angle, expected in zip(("shaft 1.angle", "shaft 2.angle"), shafts(omega), strict=True):
        assert linear.response(omega, "motor", angle) == pytest.approx(expected, rel=1e-10)
    undamped = example("two_shafts.py", rope_damping=0.0, rubber_damping=0.0, damper=0.0)
    rope, inertia = 4e4, np.array([0.05, 0.4])
    K = np.array([[rope * 0.01, -rope * 0.02], [-rope * 0.02, rope * 0.04 + 500]])
    a, b = np.trace(K / inertia[:, None]) / 2, np.linalg.det(K) / inertia.prod()
    squares = a + np.array([-1, 1]) * np.sqrt(a**2 - b)
    assert undamped.modes().omega == pytest.approx(np.sqrt(squares), rel=1e-10)


def test_two_shafts_on_inelastic_ropes_are_one_oscillator():
    """The first shaft turns twice as far as the second."""
    m = example("two_shafts.py", elastic=False)
    (found,) = (x for x in m.modes().eigenvalues if x.imag > 0)
    inertia, damping = 0.05 * 4 + 0.4, 0.05 * 4 + 2
    assert found == pytest.approx(np.roots([inertia, damping, 500])[0], rel=1e-10)
    run = m.simulate(1, outputs=101)
    assert run["shaft 1.angle"] == pytest.approx(2 * run["shaft 2.angle"], abs=1e-12)


@pytest.mark.parametrize("pinions", [1, 2])
def test_differential_keeps_the_mean_speed_and_splits_the_torque_in_halves(pinions):
    """Two linear equations: of the cage's speed c, and of half the difference d of the wheels' speeds c + d and c - d."""
    run = example("differential.py", pinions=pinions).simulate(4, outputs=81, rtol=1e-10)
    left, right = run["speed_left"].value, run["speed_right"].value
    assert left + right == pytest.approx(2 * run["cage bearing.angle_rate"], abs=1e-12)
    inertia = np.array([
        0.05 + pinions * (1e-4 + 0.2 * 0.06**2) + 2 * 0.5,
        2 * 0.5 + pinions * 1e-4 * (24 / 16) ** 2,
    ])  # fmt: skip
    A = -np.array([[2.5, 0.5 - 2], [0.5 - 2, 2.5]]) / inertia[:, None]
    end = np.linalg.solve(A, [-20 / inertia[0], 0])
    mean, half = np.array([end - expm(A * t) @ end for t in run.t]).T
    assert left == pytest.approx(mean + half, abs=1e-7)
    assert right == pytest.approx(mean - half, abs=1e-7)
    assert (end.sum(), end[0] - end[1]) == pytest.approx((20 / 2 / 0.5, 20 / 2 / 2))
    slopes = np.array([A @ (expm(A * t) @ end) for t in run.t])  # minus the accelerations
    for name, speed, sense, resistance in (("left", left, 1, 0.5), ("right", right, -1, 2)):
        torque = sum(run[f"{name} mesh {k}.effort_1"] for k in range(1, pinions + 1))
        assert torque == pytest.approx(resistance * speed - 0.5 * (slopes @ [1, sense]), abs=1e-6)
