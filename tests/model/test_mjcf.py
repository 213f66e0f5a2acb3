"""Models in MJCF, against MuJoCo itself."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import flyball as fb

mujoco = pytest.importorskip("mujoco")

ROBOT = """<mujoco model="robot">
  <option gravity="0.5 0 -9.81"/>
  <default><joint damping="0.1"/><default class="heavy"><geom density="2000"/></default></default>
  <worldbody>
    <geom type="plane" size="1 1 .1"/>
    <body name="post" pos="1 0 0"><geom size=".1"/></body>
    <body name="torso" pos="0 0 1" euler="10 -20 5">
      <joint name="root" type="free" damping="0"/><geom type="box" size=".1 .2 .3" mass="2" pos=".05 0 0"/>
      <body name="arm" pos="0 .3 0" euler="10 20 30">
        <joint name="turn" axis="0 0 1" range="-90 90" limited="true" ref="10"/>
        <joint name="lift" axis="0 1 0" pos="0.1 0 0" stiffness="3" springref="5"/>
        <geom class="heavy" type="capsule" fromto="0 0 0 .4 0 0" size=".04"/>
        <body name="ball" pos=".5 0 0"><joint name="b" type="ball" damping="0"/>
          <geom type="ellipsoid" size=".1 .05 .07" pos=".1 0 0"/></body>
      </body>
      <body name="tail-1" pos="0 -.3 0"><joint name="s" type="slide" axis="1 0 0"/><geom size=".05" mass=".3"/>
        <body name="tip" pos="0 0 .1"><geom type="cylinder" size=".02 .1"/></body></body>
    </body>
  </worldbody>
  <actuator><motor name="m1" joint="turn" gear="5"/><position name="p2" joint="lift" kp="7"/></actuator>
</mujoco>
"""


def read(tmp_path, text=ROBOT):
    path = tmp_path / "robot.xml"
    path.write_text(text)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.ModelWarning)
        return fb.load(path), mujoco.MjModel.from_xml_path(str(path))


def test_the_same_dynamics(tmp_path):
    """Mass matrix, and forces of gravity, motion, springs, damping and actuators, in MuJoCo's velocities."""
    m, M = read(tmp_path)
    m.parameters.update(control_m1=0.4, control_p2=-0.3)
    p, D = m.prepare(coordinates="joint"), mujoco.MjData(M)
    assert p.names[0] == "torso.x" and p.names[6:8] == ("turn.angle", "lift.angle")
    rng = np.random.default_rng(0)
    n = len(p.v)
    joints = [*range(6, 8), n - 1]
    shift = np.zeros(n)
    shift[[*range(6), *joints]] = rng.normal(size=9)
    q, v, a = p.step(p.q, shift), *rng.normal(size=(2, n))
    x, R = p.pose("torso", q)
    D.qpos[:3] = x
    mujoco.mju_mat2Quat(D.qpos[3:7], R.ravel())
    for name, value in (("turn", q[7]), ("lift", q[8]), ("s", q[-1])):
        D.qpos[M.joint(name).qposadr] += value  # ours are measured from the drawn configuration
    J, rate = p.frame_jacobian("torso", q), p.frame_jacobian_rate("torso", q, v) @ v
    T = np.zeros((n, n))
    T[:3], T[3:6] = J[:3], R.T @ J[3:]
    T[6, 6] = T[7, 7] = T[-1, -1] = 1.0
    T[8:11, 8:11] = p.pose("ball", p.q)[1].T  # ours is in the axes that were the world's as drawn
    D.qvel, D.qacc = T @ v, T @ a
    D.qacc[:3] += rate[:3]
    D.qacc[3:6] += R.T @ rate[3:]
    D.ctrl = 0.4, -0.3
    mujoco.mj_inverse(M, D)
    mujoco.mj_fwdActuation(M, D)
    full = np.zeros((n, n))
    mujoco.mj_fullM(M, full, D.qM) if hasattr(D, "qM") else mujoco.mj_fullM(M, D, full)
    np.testing.assert_allclose(p.crba(q), T.T @ full @ T, atol=1e-10)
    forces = p.crba(q) @ a - p.forces(0.0, q, v)
    np.testing.assert_allclose(forces, T.T @ (D.qfrc_inverse - D.qfrc_actuator), atol=1e-9)
    for name in ("tip", "ball", "arm"):
        np.testing.assert_allclose(p.pose(name, q)[0], D.body(name).xpos, atol=1e-12)
    assert (m["turn_limit"].lower, m["turn_limit"].upper) == pytest.approx((-np.pi / 2, np.pi / 2))
    assert m["tail_1"].mass == pytest.approx(0.3)


def test_equalities_are_hard_joints(tmp_path):
    """A four-bar: its loop is closed by connect, and two joints are coupled."""
    text = """<mujoco><option gravity="0 -9.81 0"/><compiler angle="radian"/><worldbody>
      <body name="crank"><joint name="A" axis="0 0 1"/><geom type="capsule" fromto="0 0 0 0 .2 0" size=".01"/>
        <body name="coupler" pos="0 .2 0"><joint name="B" axis="0 0 1"/>
          <geom type="capsule" fromto="0 0 0 .5 .3 0" size=".01"/></body></body>
      <body name="rocker" pos=".6 0 0"><joint name="D" axis="0 0 1"/>
        <geom type="capsule" fromto="0 0 0 -.1 .5 0" size=".01"/></body>
      <body name="wheel" pos="2 0 0"><joint name="W" axis="0 0 1"/><geom size=".1"/></body>
      </worldbody><equality><connect name="C" body1="coupler" body2="rocker" anchor=".5 .3 0"/>
      <joint name="gear" joint1="W" joint2="A" polycoef="0 -2 0 0 0"/></equality></mujoco>"""
    m, _ = read(tmp_path, text)
    run = m.simulate(1.0, outputs=11)
    np.testing.assert_allclose(run["W.angle"], -2 * run["A.angle"], atol=1e-8)
    tip = [run["rocker"].position + run["rocker"].rotation @ (-0.1, 0.5, 0)]
    bar = [run["coupler"].position + run["coupler"].rotation @ (0.5, 0.3, 0)]
    np.testing.assert_allclose(tip, bar, atol=1e-9)


def test_errors_and_remarks(tmp_path):
    path = tmp_path / "robot.xml"
    path.write_text(ROBOT)
    with pytest.warns(fb.ModelWarning, match=r"robot.xml: not used: contact of geoms"):
        fb.load(path)
    path.write_text(ROBOT.replace("<geom size", "<geam size", 1))
    with pytest.raises(fb.ModelError, match=r"robot.xml: XML Error: .*line"):
        fb.load(path)
    with pytest.raises(fb.ModelError, match="there is no such file"):
        fb.load(tmp_path / "none.xml")
