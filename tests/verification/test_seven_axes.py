"""The robot of seven axes against Pinocchio: recursive dynamics of rotors and links, and of the controller's rigid model."""

from __future__ import annotations

import runpy

import numpy as np
import pytest

import flyball as fb
from tests.mechanisms import EXAMPLES

pin = pytest.importorskip("pinocchio")
ROBOT = runpy.run_path(str(EXAMPLES / "seven_axes.py"))
COUNT = 4  # of axes; all seven agree as well, but the laws of their controller take some seconds to compile
AXES = range(1, COUNT + 1)


def pinocchio_model(rotors: bool):
    """The chain of links, each joint at the top of the link before, with or without a rotor as a branch at each joint."""
    model, carrier, at = pin.Model(), 0, pin.SE3.Identity()
    for k, (length, mass) in enumerate(zip(ROBOT["LENGTHS"][:COUNT], ROBOT["MASSES"], strict=False)):
        joint = pin.JointModelRY() if k % 2 else pin.JointModelRZ()
        if rotors:
            j = model.addJoint(carrier, joint, at, f"motor_{k + 1}")
            model.appendBodyToJoint(
                j, pin.Inertia(0.5, np.zeros(3), ROBOT["ROTORS"][k] * np.eye(3)), pin.SE3.Identity()
            )
        carrier = model.addJoint(carrier, joint, at, f"joint_{k + 1}")
        across = 0.01 + mass * length**2 / 12
        inertia = pin.Inertia(mass, np.array([0, 0, length / 2]), np.diag([across, across, 0.01]))
        model.appendBodyToJoint(carrier, inertia, pin.SE3.Identity())
        at = pin.SE3(np.eye(3), np.array([0, 0, length]))
    return model, model.createData()


def curves(run, names, what):
    return np.column_stack([run[f"{name}.{what}"] for name in names])


@pytest.fixture(scope="module")
def run():
    """From a bent posture in motion, so that all axes load each other and all motors slide; gears are twisted a little."""
    m = ROBOT["mechanism"](axes=COUNT)
    rates = (0.6, -0.5, 0.8, -0.7, 0.9, 0.6, -0.8)
    for j, angle, rate in zip(AXES, ROBOT["REACH"], rates, strict=False):
        m.add(fb.Initial(f"joint_{j}.angle", value=angle, rate=rate))
        m.add(fb.Initial(f"motor_{j}.angle", value=1.001 * angle, rate=rate))
    return m.simulate(0.05, outputs=21)


def test_accelerations_are_those_of_pinocchio(run):
    """Under the torques of motors, gears and friction."""
    model, data = pinocchio_model(rotors=True)
    names = list(model.names)[1:]
    q, v, a = (curves(run, names, what) for what in ("angle", "angle_rate", "angle_acceleration"))
    drive, gear, friction = (curves(run, [f"{x}_{j}" for j in AXES], y) for x, y in
                             (("drive", "torque"), ("gear", "force"), ("friction", "friction")))  # fmt: skip
    twist, rate = q[:, 1::2] - q[:, ::2], v[:, 1::2] - v[:, ::2]
    stiffness = np.array(ROBOT["STIFFNESS"][:COUNT])
    np.testing.assert_allclose(gear, -stiffness * (twist + 1e-3 * rate), atol=1e-8)
    assert (abs(friction) <= np.array(ROBOT["FRICTION"][:COUNT]) * (1 + 1e-9)).all()
    slides = abs(v[:, ::2]) > 1e-3
    assert slides.mean() > 0.5
    np.testing.assert_allclose(friction[slides], (-np.array(ROBOT["FRICTION"][:COUNT]) * np.sign(v[:, ::2]))[slides])
    torque = np.stack([drive + friction - gear, gear], axis=2).reshape(len(q), 2 * COUNT)
    for k in range(1, len(q) - 1):
        found = pin.aba(model, data, q[k], v[k], torque[k])
        assert a[k] == pytest.approx(found, abs=1e-6 * abs(a).max())


def test_the_controller_is_the_inverse_dynamics_of_pinocchio(run):
    """Of the rigid arm without rotors, with the commanded accelerations; rotors are added."""
    model, data = pinocchio_model(rotors=False)
    names = list(model.names)[1:]
    q, v = curves(run, names, "angle"), curves(run, names, "angle_rate")
    commanded = np.column_stack([run[f"ctc.joint_{j}_acceleration"] for j in AXES])
    drive = curves(run, [f"drive_{j}" for j in AXES], "torque")
    for k in range(len(q)):
        found = pin.rnea(model, data, q[k], v[k], commanded[k]) + np.array(ROBOT["ROTORS"][:COUNT]) * commanded[k]
        assert drive[k] == pytest.approx(found, abs=1e-9 * abs(drive).max())
