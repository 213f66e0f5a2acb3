"""Mechanisms written as MJCF: read by MuJoCo, whose dynamics are compared, and read back."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import flyball as fb
from tests.analyses.test_closed_loops import four_bar, spatial_four_bar

mujoco = pytest.importorskip("mujoco")
INERTIA = ((0.3, 0.01, 0.02), (0.01, 0.4, 0.03), (0.02, 0.03, 0.5))


def forest() -> fb.Mechanism:
    """A free tree with joints of several coordinates, and an arm on ground with stops, springs and losses."""
    rng = np.random.default_rng(5)
    m = fb.Mechanism("forest", gravity=(0.3, -1, -9.81), parameters={"u": 2.0})
    for k in range(9):
        place = {"position": tuple(rng.normal(size=3)), "orientation": tuple(rng.normal(size=3))}
        shape = fb.Box(edges=(0.1, 0.2, 0.3), position=(0.1, 0, 0)) if k == 1 else None
        m.add(fb.Body(f"b{k}", mass=1 + 0.3 * k, inertia=INERTIA, com=(0.1, 0.2, -0.1), **place, shape=shape))
    at, axis = ([tuple(x) for x in rng.normal(size=(9, 3))] for _ in range(2))
    m.add(fb.Revolute("r", "b0", "b1", at=at[0], axis=axis[0]), fb.Spherical("s", "b1", "b2", at=at[1]))
    m.add(fb.Prismatic("p", "b3", "b2", at=at[2], axis=axis[1], displacement=0.2))  # the other way round
    m.add(fb.Universal("u4", "b0", "b4", at=at[3], axes=((1, 0, 0), (0, 1, 0)), angle_1=0.3))
    m.add(fb.Revolute("arm", "b5", "ground", at=at[4], axis=axis[2], angle=0.4))
    m.add(fb.Cylindrical("c", "b5", "b6", at=at[5], axis=axis[3]), fb.Fixed("f", "b6", "b7", at=at[6]))
    m.add(fb.Planar("plane", "b7", "b8", at=at[7], axis=axis[4]))
    m.add(fb.Frame("tool", "b3", position=(0.1, 0.2, 0.3), orientation=(0.1, 0.2, 0.3)))
    m.add(fb.CoordinateSpring("spring", "arm.angle", stiffness=3, damping=0.2, rest=0.1))
    m.add(fb.CoordinateSpring("damping", "r.angle", damping=0.3), fb.Actuator("motor", "p.displacement", force="3*u"))
    m.add(fb.RotorInertia("rotor", "arm.angle", inertia=0.02, ratio=3))
    m.add(fb.RotorInertia("spindle", "p.displacement", inertia=1e-3, ratio=40))
    m.add(fb.Limit("stop", "r.angle", lower=-1.5), fb.Brake("rub", "c.angle", capacity=0.0))
    return m


def written(m, path):
    """The model in MuJoCo, and the warning."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always", fb.ModelWarning)
        m.save(path)
    return mujoco.MjModel.from_xml_path(str(path)), " ".join(str(x.message) for x in found)


def convention(p, M):
    """MuJoCo's convention; joints with several coordinates are several joints there."""
    owners = dict.fromkeys(n.partition(".")[0] for n in p.names)
    names = [M.joint(k).name for k in range(M.njnt)]
    order = dict.fromkeys(next((x for x in owners if n == x or n.startswith(f"{x}_")), n) for n in names)
    return p.convention("mujoco", joints=[x.removesuffix("_free") for x in order])


def test_a_forest(tmp_path):
    m = forest()
    M, remarks = written(m, tmp_path / "forest.xml")
    assert not remarks
    p, D = m.prepare(coordinates="joint"), mujoco.MjData(M)
    x = convention(p, M)
    np.testing.assert_allclose(x.from_flyball(p.q), M.qpos0, atol=1e-12)
    M.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    rng = np.random.default_rng(0)
    for _ in range(3):
        q, (v, a) = p.step(p.q, rng.normal(size=len(p.v))), rng.normal(size=(2, len(p.v)))
        D.qpos, D.qvel, D.qacc = x.from_flyball(q, v, a)
        D.ctrl[0] = 2.0
        mujoco.mj_inverse(M, D)
        mujoco.mj_fwdActuation(M, D)
        forces = p.mass_matrix(q) @ a - p.forces(0.0, q, v)
        theirs = x.forces_to_flyball(q, D.qfrc_inverse - D.qfrc_actuator)
        np.testing.assert_allclose(theirs, forces, atol=1e-9 * abs(forces).max())
        np.testing.assert_allclose(D.site("tool").xpos, p.pose("tool", q)[0], atol=1e-12)
        np.testing.assert_allclose(D.site("tool").xmat, p.pose("tool", q)[1].ravel(), atol=1e-12)
    assert M.jnt_range[M.joint("r").id, 0] == -1.5
    assert M.body_geomnum[M.body("b1").id] == 1


def test_and_back(tmp_path):
    m = forest()
    written(m, tmp_path / "forest.xml")
    with warnings.catch_warnings():
        warnings.simplefilter("error", fb.ModelWarning)
        again = fb.load(tmp_path / "forest.xml")
    again.parameters["control_motor"] = 2.0
    p, r = m.prepare(coordinates="joint"), again.prepare(coordinates="joint")
    a, b = p.acceleration(0.0, p.q, p.v), r.acceleration(0.0, r.q, r.v)
    for name in ("b2", "b3", "b4", "b8", "tool"):
        for x, y in zip(p.pose(name, p.q), r.pose(name, r.q), strict=True):
            np.testing.assert_allclose(x, y, atol=1e-12)
        np.testing.assert_allclose(p.frame_jacobian(name, p.q) @ a, r.frame_jacobian(name, r.q) @ b, atol=1e-8)
    assert again["r_limit"].lower == -1.5


@pytest.mark.parametrize("make", [four_bar, spatial_four_bar])
def test_closed_loops(tmp_path, make):
    """At rest, as MuJoCo's equalities leave out the part of accelerations that velocities cause; soft to 1e-4."""
    m = make()
    wheel = (2, 0) if m.planar else (2, 0, 0)
    m.add(fb.Body("wheel", mass=1, inertia=0.1 if m.planar else (0.1,) * 3, position=wheel))
    m.add(fb.Revolute("E", "ground", "wheel", at=wheel, **({} if m.planar else {"axis": (0, 0, 1)})))
    m.add(fb.Coupler("gear", ["D.angle", "E.angle"], weights=[1, -2]))
    M, remarks = written(m, tmp_path / "four_bar.xml")
    assert not remarks
    D = mujoco.MjData(M)
    mujoco.mj_forward(M, D)
    p = m.prepare(coordinates="joint")
    a = p.aba(p.q, p.v, np.zeros(len(p.v)))
    theirs = {M.joint(k).name: D.qacc[M.jnt_dofadr[k]] for k in range(M.njnt)}
    mine = {n.partition(".")[0]: x for n, x in zip(p.names, a, strict=True)}
    for name in set(mine) & set(theirs):
        assert theirs[name] == pytest.approx(mine[name], rel=2e-3), name
    again = fb.load(tmp_path / "four_bar.xml").prepare(coordinates="joint")
    b = dict(zip(again.names, again.acceleration(0.0, again.q, again.v), strict=True))
    for n, x in zip(p.names, a, strict=True):
        if n in b:
            assert b[n] == pytest.approx(x, rel=1e-8), n
    assert {"A.angle", "E.angle"} <= set(b)


def test_what_mjcf_does_not_have(tmp_path):
    path = tmp_path / "m.xml"
    m = forest()
    m.add(fb.SpringDamper("rope", "b0", "b5", stiffness=3), fb.CoordinateSpring("more", "r.angle", damping=1))
    with pytest.warns(fb.ModelWarning, match=r"no counterpart of SpringDamper 'rope', CoordinateSpring 'more'; the"):
        m.save(path)
    m = forest()
    m.add(fb.Body("b9", mass=1, inertia=INERTIA), fb.Screw("screw", "b0", "b9", at=(0, 0, 0), axis=(0, 0, 1), lead=0.1))
    with pytest.raises(fb.ModelError, match="Screw 'screw' has no counterpart in MJCF"):
        m.save(path)
    m = fb.Mechanism("rails", planar=True)
    m.add(fb.Body("cart", mass=1, inertia=1))
    m.add(*(fb.Prismatic(f"rail{k}", "ground", "cart", at=(0, k), axis=(1, 0)) for k in range(2)))
    with pytest.raises(
        fb.ModelError, match="'rail1' closes a loop; MJCF can close loops by Spherical, Fixed, Revolute"
    ):
        m.save(path)
    m = fb.Mechanism("thin", gravity=(0, 0, -9.81))
    m.add(fb.Body("rod", mass=1, inertia=(0, 0.1, 0.1)))
    m.add(fb.Revolute("J", "ground", "rod", at=(0, 0, 0), axis=(0, 1, 0)))
    with pytest.raises(fb.ModelError, match="'rod' moves and has no inertia about some axis"):
        m.save(path)
