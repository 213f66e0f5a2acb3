"""Coordinates of ball joints and orientations of bodies: against SciPy, other elements, closed forms; singular positions."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flyball as fb
from tests.layers import both_layers

pytestmark = both_layers

ANGLES = ("yaw", "pitch", "roll")
ROTATION = tuple(f"rotation_{a}" for a in "xyz")


def ball(gravity=(0, 0, -9.81), **body) -> fb.Mechanism:
    """A body on a ball joint at the origin."""
    m = fb.Mechanism("ball", gravity=gravity)
    m.add(fb.Body("b", **{"mass": 2, "inertia": (0.05, 0.08, 0.11), "position": (0.1, 0.2, -0.3)} | body))
    m.add(fb.Spherical("ball", "ground", "b", at=(0, 0, 0)))
    return m


def pivoted(deflection: float, **body) -> fb.Mechanism:
    """An axially symmetric pendulum of length 0.5 on a ball joint of frames, deflected about x."""
    m = fb.Mechanism("pivoted", gravity=(0, 0, -9.81))
    tilt = Rotation.from_euler("x", deflection)
    at = tuple(tilt.apply((0, 0, -0.5)))
    m.add(fb.Body("b", mass=2, inertia=(0.05, 0.05, 0.02), position=at, orientation=(deflection, 0, 0), **body))
    m.add(fb.Frame("socket", "ground"), fb.Frame("head", "b", position=(0, 0, 0.5)))
    m.add(fb.Spherical("ball", "socket", "head"))
    return m


def test_coordinates_are_those_of_scipy():
    r = ball(angular_velocity=(2, -1, 1.5)).simulate(1, outputs=401)
    turn = Rotation.from_matrix(r["b"].rotation)
    assert np.abs(r["ball.pitch"]).max() < 1.4, "away from the singular position"
    for owner in ("ball", "b"):
        found = np.stack([r[f"{owner}.{k}"] for k in ANGLES], axis=1)
        assert found == pytest.approx(np.unwrap(turn.as_euler("ZYX"), axis=0), abs=1e-12)
        rates = np.stack([r[f"{owner}.{k}_rate"] for k in ANGLES], axis=1)
        assert np.gradient(found, r.t, axis=0)[1:-1] == pytest.approx(rates[1:-1], abs=1e-3)
    assert np.stack([r[f"ball.{k}"] for k in ROTATION], axis=1) == pytest.approx(turn.as_rotvec(), abs=1e-12)
    for curve in (f"ball.{k}" for k in (*ANGLES, *ROTATION, "deflection")):
        rate, acceleration = r[f"{curve}_rate"], r[f"{curve}_acceleration"]
        smooth = slice(20, -20)  # the deflection starts at 0, with a kink
        assert np.gradient(rate, r.t)[smooth] == pytest.approx(acceleration[smooth], abs=2e-3 * np.ptp(acceleration)), (
            curve
        )
    cosine = r["b"].rotation[:, 2, 2]
    assert r["ball.deflection"] == pytest.approx(np.arccos(np.clip(cosine, -1, 1)), abs=1e-7)


def test_angles_of_bodies_count_turns_in_curves_sensors_and_laws():
    """A free body spins five times about an inclined axis; a law sees the angle that the curve shows."""
    m = fb.Mechanism("free", gravity=None)
    m.add(fb.Body("b", mass=1, inertia=(0.1, 0.1, 0.1), angular_velocity=(0.3, 0.2, 3.1)))
    plain = m.simulate(10, outputs=201)
    m.add(fb.Sensor("heading", "b.yaw"), fb.Sensor("turning", "b.yaw_rate"))
    m.add(fb.PointTorque("torque", "b", torque=(0, 0, "0*heading + 0*turning")))
    r = m.simulate(10, outputs=201)
    assert r["b.yaw"][-1] > 9 * np.pi
    assert r["b.yaw"] == pytest.approx(plain["b.yaw"], abs=1e-6)
    assert r["heading"].value == pytest.approx(r["b.yaw"], abs=1e-12)
    assert r["turning"].value == pytest.approx(r["b.yaw_rate"], abs=1e-12)


def test_a_controller_holds_a_heading():
    m = fb.Mechanism("craft", gravity=None)
    m.add(fb.Body("b", mass=1, inertia=(0.1, 0.2, 0.3), angular_velocity=(0.01, 0.02, 0.5)))
    m.add(fb.PID("pid", setpoint="7", measured="b.yaw", kp=2.0, kd=1.5, filter=0.05))  # more than a turn
    m.add(fb.PointTorque("thrusters", "b", torque=(0, 0, "pid"), axes="body"))
    assert m.simulate(20)["b.yaw"][-1] == pytest.approx(7.0, abs=1e-3)


def test_springs_along_the_rotation_vector_are_a_bushing():
    springs, bushing = (ball(angular_velocity=(1, 2, -1)) for _ in range(2))
    for a, k in zip("xyz", (3, 4, 5), strict=True):
        springs.add(fb.CoordinateSpring(f"spring {a}", f"ball.rotation_{a}", stiffness=k))
    bushing.add(fb.Bushing("bushing", "ground", "b", at=(0, 0, 0), stiffness=0, torsional_stiffness=(3, 4, 5)))
    one, two = (m.simulate(2, rtol=1e-10, atol=1e-12) for m in (springs, bushing))
    assert one["b"].position == pytest.approx(two["b"].position, abs=1e-9)
    assert one.energy.drift < 1e-8


def test_a_cone_stops_a_pendulum():
    """The deflection at the stop, the speed after it, and the force of a steady rotation along the cone."""
    m = ball()
    m.add(fb.Limit("cone", "ball.deflection", upper="30 deg", restitution=0.5))
    r = m.simulate(1.5)
    assert np.radians(29.9) < r["ball.deflection"].max() < np.radians(30) + 1e-9
    assert len(r.events) > 1
    assert r.energy.drift < 1e-6
    half, rate = np.radians(30), 9.0
    spun = pivoted(half, angular_velocity=(0, 0, rate))
    spun.add(fb.Limit("cone", "ball.deflection", upper="30 deg"))
    r = spun.simulate(0.5, rtol=1e-10, atol=1e-12)
    across, along = 0.05 + 2 * 0.25, 0.02  # moments about the pivot
    force = 2 * 9.81 * 0.5 * np.sin(half) - (across - along) * rate**2 * np.sin(half) * np.cos(half)
    assert force < 0.0, "pressed outwards"
    assert r["cone.force"] == pytest.approx(np.full(len(r.t), force), rel=1e-6)


@pytest.mark.parametrize("names", [["ball"], ["ball.roll", "ball.pitch", "ball.yaw"]])
def test_an_event_locks_all_rotations(names):
    m = ball()
    m.add(fb.Event("hold", "t > 0.3", do=[fb.Lock(x) for x in names]))
    m.add(fb.Event("let", "t > 0.6", do=[fb.Release("ball")]))
    r = m.simulate(1, outputs=101)
    still = (r.t > 0.305) & (r.t < 0.595)
    assert np.ptp(r["b"].position[still], axis=0) == pytest.approx(np.zeros(3), abs=1e-12)
    assert np.ptp(r["b"].position[r.t > 0.6], axis=0).max() > 0.01


def test_whole_turns_of_drivers_and_initial_values():
    m = ball()
    m.add(fb.Initial("ball.pitch", value="50 deg", rate=0.3), fb.Initial("ball.roll", value="-170 deg"))
    m.add(fb.Driver("drive", "ball.yaw", "21 + t"))
    r = m.simulate(0.1, outputs=5)
    assert r["ball.yaw"] == pytest.approx(21 + r.t, abs=1e-12)
    assert np.degrees([r["ball.pitch"][0], r["ball.roll"][0]]) == pytest.approx([50, -170], abs=1e-9)
    assert r["ball.pitch_rate"][0] == pytest.approx(0.3, abs=1e-9)
    free = fb.Mechanism("free", gravity=None)
    free.add(fb.Body("b", mass=1, inertia=(0.1, 0.1, 0.1)), fb.Driver("drive", "b.roll", "-50 + t"))
    free.add(fb.Initial("b.yaw", value="30 rad"))
    r = free.simulate(0.1, outputs=5, coordinates="absolute")
    assert r["b.roll"] == pytest.approx(-50 + r.t, abs=1e-12)
    assert r["b.yaw"][0] == pytest.approx(30.0, abs=1e-9)


def test_damped_pendulum_on_a_ball_joint_is_linearised_about_its_angles():
    """Small swings of a pendulum with springs along roll and pitch: sqrt((k + m g l) / J) about x and y."""
    m = pivoted(0.0)
    m.add(fb.CoordinateSpring("s", "ball.roll", stiffness=3), fb.CoordinateSpring("p", "ball.pitch", stiffness=7))
    m.add(fb.CoordinateSpring("y", "b.yaw", stiffness=0.5))
    found = m.linearize(outputs=["ball.roll", "ball.rotation_x", "b.pitch_rate"])
    swings = np.sort(np.abs(found.eigenvalues.imag))[::2]
    J, weight = 0.05 + 2 * 0.25, 2 * 9.81 * 0.5
    exact = np.sort(np.sqrt([(3 + weight) / J, (7 + weight) / J, 0.5 / 0.02]))
    assert swings == pytest.approx(exact, rel=1e-9)
    assert found.C[0] == pytest.approx(found.C[1], abs=1e-12)


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (ANGLES, "ball.yaw, which Driver 'yaw' uses, is at a pitch of 90 deg, where roll and yaw are undefined"),
        (ROTATION, "ball.rotation_x, which Driver 'rotation_x' uses, is at half a turn"),
    ],
)
def test_singular_positions_are_named(names, message):
    m = ball()
    m.add(*(fb.Driver(k, f"ball.{k}", law) for k, law in zip(names, ("0.3*t", "3*t", "0.1*t"), strict=True)))
    with pytest.raises(fb.SimulationError, match=message):
        m.simulate(3)


def test_a_deflection_is_not_driven_away_from_zero():
    m = ball()
    m.add(fb.Driver("drive", "ball.deflection", "t"))
    with pytest.raises(fb.AssemblyError, match=r"a motion of 'ball\.deflection' at a dead centre"):
        m.assemble()


def test_a_jump_of_a_coordinate_of_a_force_is_a_health_warning():
    """A body that swings through half a turn in one plane: the components change their sign."""
    m = ball(gravity=None, position=(0, 0, 0), angular_velocity=(0, 2, 0))
    m.add(fb.CoordinateSpring("spring", "ball.rotation_y", stiffness=1e-6))
    (warning,) = m.simulate(2, outputs=101).health.warnings
    assert "ball.rotation_y, which CoordinateSpring 'spring' uses, changes by -35" in warning


def test_a_steady_rotation_of_a_ball_joint_is_refused():
    with pytest.raises(fb.ModelError, match="a rotation about one axis needs a Revolute in place of Spherical 'ball'"):
        ball().equilibrium(turning=["ball.yaw"])


def test_friction_along_one_rotation_of_a_ball_is_refused():
    m = ball()
    with pytest.raises(fb.ModelError, match=r"all rotations of Spherical 'ball' slip on one surface\. Use a Bushing"):
        m.add(fb.JointFriction("friction", "ball", coordinate="roll", static=0.1, radius=0.02))
    with pytest.raises(fb.ModelError, match="'b' has the coordinates x, y, z, roll, pitch, yaw, not 'angle'"):
        m.add(fb.Driver("drive", "b.angle", "t"))
