"""Drivers of a pose: Euler's equations, Newton's law, and inverse dynamics of an arm give what they carry."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flyball as fb
from tests.layers import both_layers

pytestmark = both_layers

ANGLES = ("yaw", "pitch", "roll")
MOMENTS = np.array((0.05, 0.08, 0.11))
LAWS = {"yaw": "2*t - 0.4*t**2", "pitch": "1.2*sin(3*t)", "roll": "0.3 + 7*t + 0.3*sin(2*t)"}  # more than two turns
PATH = {"x": "0.2 + sin(t)", "y": "0.3*t**2", "z": "cos(2*t) - 1"}


def value(law: str, t: np.ndarray) -> np.ndarray:
    """A law at some times."""
    return eval(law, {"t": t, "sin": np.sin, "cos": np.cos})


def axes(R: np.ndarray) -> np.ndarray:
    """Axes (n, 3, 3) about which yaw, pitch and roll turn, as rows: z of the world, its product with x, x of the frame."""
    z, x = np.broadcast_to([0.0, 0.0, 1.0], (len(R), 3)), R[:, :, 0]
    n = np.cross(z, x)
    return np.stack([z, n / np.linalg.norm(n, axis=1)[:, None], x], axis=1)


def torque_by_euler(r: fb.Result, name: str) -> np.ndarray:
    """Torque about the mass centre that gives a body its measured motion, world axes."""
    b = r[name]
    w, a = (np.einsum("nji,nj->ni", b.rotation, x) for x in (b.angular_velocity, b.angular_acceleration))
    return np.einsum("nij,nj->ni", b.rotation, MOMENTS * a + np.cross(w, MOMENTS * w))


def test_a_body_on_a_ball_joint_follows_its_angles():
    """The efforts are the components of Euler's torque along the axes of the angles; yaw and roll count turns."""
    m = fb.Mechanism("turned", gravity=(0, 0, -9.81))
    m.add(fb.Body("b", mass=2, inertia=tuple(MOMENTS)), fb.Spherical("ball", "ground", "b", at=(0, 0, 0)))
    m.add(*(fb.Driver(f"drive {k}", f"ball.{k}", law) for k, law in LAWS.items()))
    r = m.simulate(2, outputs=101)
    for k, law in LAWS.items():
        assert r[f"ball.{k}"] == pytest.approx(value(law, r.t), abs=1e-12)
    assert r["b"].rotation == pytest.approx(
        Rotation.from_euler("ZYX", np.stack([value(LAWS[k], r.t) for k in ANGLES], axis=1)).as_matrix(), abs=1e-12
    )
    along = np.einsum("nki,ni->nk", axes(r["b"].rotation), torque_by_euler(r, "b"))
    efforts = np.stack([r[f"drive {k}.effort"] for k in ANGLES], axis=1)
    assert efforts == pytest.approx(along, abs=1e-11)
    power = sum(r[f"drive {k}.effort"] * r[f"ball.{k}_rate"] for k in ANGLES)
    assert power == pytest.approx((torque_by_euler(r, "b") * r["b"].angular_velocity).sum(axis=1), abs=1e-10)
    assert r.energy.drift < 1e-7


def test_an_angle_driven_alone_pushes_square_to_the_axes_of_the_others():
    m = fb.Mechanism("pitched", gravity=(0, 0, -9.81))
    m.add(fb.Body("b", mass=2, inertia=tuple(MOMENTS), position=(0, 0, 0), angular_velocity=(3, 1.5, 2)))
    m.add(fb.Driver("drive", "b.pitch", "0.3*sin(5*t)"))
    r = m.simulate(1, outputs=51)
    T, h = torque_by_euler(r, "b"), axes(r["b"].rotation)
    assert np.einsum("ni,nki->nk", T, h[:, (0, 2)]) == pytest.approx(np.zeros((51, 2)), abs=1e-9)
    assert r["drive.effort"] == pytest.approx(np.einsum("ni,ni->n", T, h[:, 1]), abs=1e-9)
    assert np.abs(r["drive.effort"]).max() > 0.1
    assert r.energy.drift < 1e-6


def test_a_frame_follows_a_trajectory():
    """Six drivers of a frame off the mass centre carry its weight, inertia and moments, by Newton's law and Euler's."""
    m = fb.Mechanism("carried", gravity=(0, 0, -9.81))
    m.add(fb.Body("b", mass=2, inertia=tuple(MOMENTS), position=(0.4, 0, 0), com=(0.1, -0.05, 0.2)))
    m.add(fb.Frame("grip", "b", position=(0.3, 0.1, -0.2), orientation=(0.4, -0.2, 0.9)))
    laws = {**PATH, **LAWS}
    m.add(*(fb.Driver(f"drive {k}", f"grip.{k}", law) for k, law in laws.items()))
    r = m.simulate(2, outputs=101)
    for k, law in laws.items():
        assert r[f"grip.{k}"] == pytest.approx(value(law, r.t), abs=1e-11)
    b, grip = r["b"], r["grip"]
    centre = np.einsum("nij,j->ni", b.rotation, (0.1, -0.05, 0.2))
    w, alpha = b.angular_velocity, b.angular_acceleration
    a = b.acceleration + np.cross(alpha, centre) + np.cross(w, np.cross(w, centre))
    force = 2.0 * (a - (0, 0, -9.81))
    assert np.stack([r[f"drive {k}.effort"] for k in "xyz"], axis=1) == pytest.approx(force, abs=1e-9)
    arm = grip.position - b.position - centre  # from the mass centre to the grip
    torque = torque_by_euler(r, "b") - np.cross(arm, force)
    efforts = np.stack([r[f"drive {k}.effort"] for k in ANGLES], axis=1)
    assert efforts == pytest.approx(np.einsum("nki,ni->nk", axes(grip.rotation), torque), abs=1e-9)
    assert r.energy.drift < 1e-6 * np.abs(r.energy.kinetic).max()


def test_an_arm_carries_the_same_by_inverse_dynamics():
    """Of an arm with six hinges whose flange follows a trajectory: J^T times the efforts are the torques of `rnea`."""

    def arm():
        m = fb.Mechanism("arm", gravity=(0, 0, -9.81))
        at = [(0, 0, 0.2 * k) for k in range(4)] + [(0.15, 0, 0.75), (0.15, 0.1, 0.8)]
        turn = [(0, 0, 1), (0, 1, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0)]
        for k, (p, axis) in enumerate(zip(at, turn, strict=True)):
            centre = tuple(np.add(p, (0.05, 0.02, 0.08)))
            m.add(fb.Body(f"link {k}", mass=2.0 - 0.2 * k, inertia=(0.02, 0.03, 0.01), position=centre))
            m.add(fb.Revolute(f"A{k}", f"link {k - 1}" if k else "ground", f"link {k}", at=p, axis=axis))
        m.add(fb.Frame("flange", "link 5", position=(0.05, 0.05, 0.1), orientation=(0.2, 0.1, -0.3)))
        return m

    m = arm()
    start = m.simulate(1e-9)["flange"]
    begin = dict(zip("xyz", start.position[0], strict=True)) | {k: start[k][0] for k in ANGLES}
    for k, (name, x) in enumerate(begin.items()):
        m.add(
            fb.Driver(f"drive {name}", f"flange.{name}", f"{float(x)!r} + {0.02 + 0.03 * (k > 2)}*sin({2 + 0.3 * k}*t)")
        )
    r = m.simulate(1, outputs=21, coordinates="joint")
    p = arm().prepare(coordinates="joint")
    tau = p.rnea(r.q, r.v, r.vdot)
    force = np.stack([r[f"drive {k}.effort"] for k in "xyz"], axis=1)
    torque = np.linalg.solve(
        axes(r["flange"].rotation), np.stack([r[f"drive {k}.effort"] for k in ANGLES], axis=1)[..., None]
    )
    J = p.frame_jacobian("flange", r.q)
    wrench = np.concatenate([force, torque[..., 0]], axis=1)
    assert np.einsum("nki,nk->ni", J, wrench) == pytest.approx(tau, abs=1e-9)
    assert np.abs(tau).max() > 1.0


def test_a_frame_follows_a_trajectory_in_the_plane():
    m = fb.Mechanism("carried", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("b", mass=2, inertia=0.1, position=(0.4, 0)), fb.Frame("grip", "b", position=(0.3, 0.1), angle=0.4))
    laws = {"x": PATH["x"], "y": PATH["y"], "angle": LAWS["roll"]}
    m.add(*(fb.Driver(f"drive {k}", f"grip.{k}", law) for k, law in laws.items()))
    r = m.simulate(2, outputs=101)
    for k, law in laws.items():
        assert r[f"grip.{k}"] == pytest.approx(value(law, r.t), abs=1e-12)
    force = 2.0 * (r["b"].acceleration + (0, 9.81))
    assert np.stack([r["drive x.effort"], r["drive y.effort"]], axis=1) == pytest.approx(force, abs=1e-9)
    arm = r["grip"].position - r["b"].position
    torque = 0.1 * r["b"].angular_acceleration - (arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0])
    assert r["drive angle.effort"] == pytest.approx(torque, abs=1e-9)


def test_kinematics_statics_and_linear_equations_take_orientations():
    """A body held at an angle carries its weight's moment; with one angle free it swings about that axis alone."""
    m = fb.Mechanism("held", gravity=(0, 0, -9.81))
    m.add(fb.Body("b", mass=2, inertia=(0.05, 0.05, 0.05), position=(0, 0, -0.5)))
    m.add(fb.Spherical("ball", "ground", "b", at=(0, 0, 0)))
    m.add(fb.Driver("yaw", "ball.yaw", 0.0), fb.Driver("pitch", "ball.pitch", "30 deg"))
    e = m.equilibrium()
    assert e["ball.roll"] == pytest.approx(0.0, abs=1e-9)
    assert e["pitch.effort"] == pytest.approx(2 * 9.81 * 0.5 * np.sin(np.radians(30)), rel=1e-9)
    swing = np.sort(np.abs(m.linearize(about=e).eigenvalues.imag))[-1]  # about the tilted x axis
    stiffness, inertia = 2 * 9.81 * 0.5 * np.cos(np.radians(30)), 0.05 + 2 * 0.25
    assert swing == pytest.approx(np.sqrt(stiffness / inertia), rel=1e-9)
    m.add(fb.Driver("roll", "b.roll", "t"))
    k = m.kinematics(21, t_end=1)
    assert k["ball.roll"] == pytest.approx(k.t, abs=1e-12)
    found = m.inverse_dynamics(21, t_end=1)
    assert found.drives["roll"].effort == pytest.approx(k["roll.effort"], abs=1e-12)
    assert found.drives["roll"].rate == pytest.approx(np.ones(21), abs=1e-9)
