"""States in the conventions of other programs: against the definitions by differences, and against the programs."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import flyball as fb
from flyball.model.geometry import quaternion_to_matrix

INERTIA = '<inertia ixx="0.3" ixy="0.01" ixz="0.02" iyy="0.4" iyz="0.03" izz="0.5"/>'
PARENTS = {"b": "a", "z": "a", "c": "b", "d": "b"}
KINDS = {"b": "revolute", "z": "continuous", "c": "prismatic", "d": "revolute"}


def robot(tmp_path):
    """A free robot whose branches are written in another order than their names have."""
    text = '<robot name="walker">'
    for k, link in enumerate("abczd"):
        text += f"""<link name="{link}"><inertial><origin xyz="0.1 -0.2 {0.1 * k}" rpy="0.3 0.1 {k}"/>
          <mass value="{1 + k}"/>{INERTIA}</inertial></link>"""
    for k, link in enumerate("zdcb"):
        text += f"""<joint name="{link}_joint" type="{KINDS[link]}"><origin xyz="0.2 {0.1 * k} 0" rpy="0.1 {k} 0.2"/>
          <parent link="{PARENTS[link]}"/><child link="{link}"/><axis xyz="0.1 {k} 1"/>
          <limit lower="-2" upper="2" effort="1" velocity="1"/></joint>"""
    path = tmp_path / "walker.urdf"
    path.write_text(text + "</robot>")
    return path


def load(path, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.ModelWarning)
        m = fb.load(path, **options)
        return m.prepare(coordinates="joint")


def states(p, k=5):
    rng = np.random.default_rng(3)
    q = np.array([p.step(p.q, rng.normal(size=len(p.v))) for _ in range(k)])
    return q, *rng.normal(size=(2, k, len(p.v)))


@pytest.fixture
def walker(tmp_path):
    return load(robot(tmp_path), floating=True)


JOINTS = ["d_joint", "b_joint", "z_joint", "c_joint"]


@pytest.mark.parametrize("program", ["pinocchio", "mujoco", "drake"])
def test_there_and_back(walker, program):
    p, x = walker, walker.convention(program, joints=JOINTS)
    q, v, a = states(p)
    found = x.to_flyball(*x.from_flyball(q, v, a))
    q[:, p.names.index("z_joint.angle") + 1] %= 2 * np.pi  # they differ by whole turns
    found[0][:, p.names.index("z_joint.angle") + 1] %= 2 * np.pi
    for mine, theirs in zip((q, v, a), found, strict=True):
        np.testing.assert_allclose(theirs, mine, atol=1e-13)
    one = x.from_flyball(q[2], v[2])
    np.testing.assert_allclose(one[1], x.from_flyball(q, v)[1][2], atol=1e-15)
    np.testing.assert_array_equal(x.from_flyball(q[2]), one[0])
    tau = a
    forces = x.forces_from_flyball(q, tau)
    np.testing.assert_allclose(x.forces_to_flyball(q, forces), tau, atol=1e-13)
    power = (forces * x.from_flyball(q, v)[1]).sum(axis=1)
    np.testing.assert_allclose(power, (tau * v).sum(axis=1), rtol=1e-12)
    np.testing.assert_allclose(x.velocity_matrix(q[1]) @ v[1], x.from_flyball(q, v)[1][1], atol=1e-14)
    assert x.names[6:] == ("d_joint.angle", "b_joint.angle", "z_joint.angle", "c_joint.displacement")


@pytest.mark.parametrize("program", ["pinocchio", "mujoco", "drake"])
def test_velocities_are_rates(walker, program):
    """Of the origin of the base, of its axes, and accelerations of the velocities, by differences along a motion."""
    p, x = walker, walker.convention(program, joints=JOINTS)
    q, v, a = (y[0] for y in states(p))
    h = 1e-4

    def at(t):
        return x.from_flyball(p.step(q, t * v + 0.5 * t**2 * a), v + t * a)

    _, V, A = x.from_flyball(q, v, a)
    (Q1, V1), (Q0, V0) = at(h), at(-h)
    np.testing.assert_allclose((V1 - V0) / (2 * h), A, atol=1e-6)
    place, turn = (slice(4, 7), slice(0, 4)) if program == "drake" else (slice(0, 3), slice(3, 7))
    position, R = p.pose("a", q)
    Q = x.from_flyball(q)
    np.testing.assert_allclose(Q[place], position, atol=1e-14)
    scalar_first = [3, 0, 1, 2] if program == "pinocchio" else [0, 1, 2, 3]
    matrices = [quaternion_to_matrix(y[turn][scalar_first]) for y in (Q, Q1, Q0)]
    np.testing.assert_allclose(matrices[0], R, atol=1e-14)
    W = R.T @ (matrices[1] - matrices[2]) / (2 * h)
    spin, shift = np.array([W[2, 1], W[0, 2], W[1, 0]]), (Q1 - Q0)[place] / (2 * h)
    wanted = {"pinocchio": (R.T @ shift, spin), "mujoco": (shift, spin), "drake": (R @ spin, shift)}[program]
    np.testing.assert_allclose(V[:6], np.concatenate(wanted), atol=1e-6)


def test_pinocchio(tmp_path, walker):
    pin = pytest.importorskip("pinocchio")
    p = walker
    model = pin.buildModelFromUrdf(str(robot(tmp_path)), pin.JointModelFreeFlyer())
    model.gravity.linear = np.array(p.model.gravity, float)
    data = model.createData()
    x = p.convention("pinocchio", joints=list(model.names)[2:])
    assert (x.nq, len(x.names)) == (model.nq, model.nv)
    for q, v, a in zip(*states(p), strict=True):
        Q, V, A = x.from_flyball(q, v, a)
        tau, T = pin.rnea(model, data, Q, V, A), x.velocity_matrix(q)
        np.testing.assert_allclose(x.forces_to_flyball(q, tau), p.rnea(q, v, a), rtol=1e-10, atol=1e-10)
        assert pin.computeKineticEnergy(model, data, Q, V) == pytest.approx(p.energies(q, v)[0], rel=1e-12)
        M = np.triu(pin.crba(model, data, Q))
        np.testing.assert_allclose(T.T @ (M + np.triu(M, 1).T) @ T, p.mass_matrix(q), atol=1e-11)


def test_drake(tmp_path, walker):
    pytest.importorskip("pydrake")
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    p, plant = walker, MultibodyPlant(0.0)
    Parser(plant).AddModels(str(robot(tmp_path)))
    plant.mutable_gravity_field().set_gravity_vector(np.array(p.model.gravity, float))
    plant.Finalize()
    joints = sorted((plant.get_joint(i) for i in plant.GetJointIndices()), key=lambda j: j.velocity_start())
    x, context = p.convention("drake", joints=[j.name() for j in joints if j.num_velocities() == 1]), None
    context = plant.CreateDefaultContext()
    for q, v, a in zip(*states(p), strict=True):
        Q, V, A = x.from_flyball(q, v, a)
        plant.SetPositions(context, Q)
        plant.SetVelocities(context, V)
        tau = plant.CalcMassMatrix(context) @ A + plant.CalcBiasTerm(context)
        tau -= plant.CalcGravityGeneralizedForces(context)
        np.testing.assert_allclose(x.forces_to_flyball(q, tau), p.rnea(q, v, a), rtol=1e-10, atol=1e-10)
        assert plant.CalcKineticEnergy(context) == pytest.approx(p.energies(q, v)[0], rel=1e-12)


def test_mujoco(tmp_path):
    """With a ball joint, joints that begin at other values than zero, and a second free body between others."""
    mujoco = pytest.importorskip("mujoco")
    text = """<mujoco><worldbody>
      <body name="torso" pos="0 0 1" euler="10 -20 5"><freejoint name="root"/><geom type="box" size=".1 .2 .3" pos=".05 0 0"/>
        <body name="arm" pos="0 .3 0" euler="10 20 30"><joint name="turn" axis="0 0 1" ref="10"/>
          <geom type="capsule" fromto="0 0 0 .4 0 0" size=".04"/>
          <body name="ball" pos=".5 0 0" euler="40 0 0"><joint name="b" type="ball"/>
            <geom type="ellipsoid" size=".1 .05 .07" pos=".1 0 0"/></body></body></body>
      <body name="stone" pos="1 1 1" euler="0 30 0"><freejoint/><geom type="box" size=".1 .2 .1" pos=".3 0 0"/></body>
      <body name="cart" pos="0 -.3 0"><joint name="s" type="slide" axis="1 0 0" ref="0.3"/><geom size=".05"/></body>
      </worldbody></mujoco>"""
    path = tmp_path / "robot.xml"
    path.write_text(text)
    p, M = load(path), mujoco.MjModel.from_xml_path(str(path))
    D, n = mujoco.MjData(M), len(p.v)
    x = p.convention("mujoco", joints=["torso", "turn", "b", "stone", "s"])
    np.testing.assert_allclose(x.from_flyball(p.q), M.qpos0, atol=1e-14)
    M.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    for q, v, a in zip(*states(p), strict=True):
        D.qpos, D.qvel, D.qacc = x.from_flyball(q, v, a)
        mujoco.mj_inverse(M, D)
        forces = x.forces_to_flyball(q, D.qfrc_inverse)
        np.testing.assert_allclose(forces, p.rnea(q, v, a), rtol=1e-9, atol=1e-9 * abs(forces).max())
        for name in ("ball", "stone", "cart"):
            np.testing.assert_allclose(p.pose(name, q)[0], D.body(name).xpos, atol=1e-12)
            np.testing.assert_allclose(p.pose(name, q)[1].ravel(), D.body(name).xmat, atol=1e-12)
    assert n == M.nv


def test_what_has_no_counterpart(walker):
    with pytest.raises(fb.ModelError, match="'chrono' is no program"):
        walker.convention("chrono")
    with pytest.raises(fb.ModelError, match=r"form several branches.*joints="):
        walker.convention("drake")
    with pytest.raises(fb.ModelError, match=r"'c_joint' is missing.*z_joint, "):
        walker.convention("drake", joints=JOINTS[:-1])
    x = walker.convention("mujoco", joints=JOINTS)
    with pytest.raises(fb.ModelError, match=r"q has the shape \(3,\)"):
        x.to_flyball(np.zeros(3))
    with pytest.raises(fb.ModelError, match="quaternion is zero"):
        x.to_flyball(np.zeros(x.nq))
    with pytest.raises(fb.ModelError, match="give v too"):
        x.from_flyball(walker.q, a=walker.v)
    m = fb.Mechanism("points", gravity=(0, 0, -9.81))
    m.add(fb.Body("p", mass=1, inertia=0))
    with pytest.raises(fb.ModelError, match="'p' is no free rigid body in space: mujoco"):
        m.prepare(coordinates="joint").convention("mujoco")
