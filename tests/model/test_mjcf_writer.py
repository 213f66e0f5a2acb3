"""Mechanisms written as MJCF: read by MuJoCo, whose dynamics are compared, and read back."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest

import flyball as fb
from flyball.model.body import frame_of
from flyball.model.element import resolve
from flyball.model.inertia import checked_shapes
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
    assert again.parameters == {"control_motor": 2.0}
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


UNWRITTEN = {
    "MJCF has no Bushing": fb.Bushing("x", "b0", "b5", at=(0, 0, 0), stiffness=3),
    "its law is not a multiple of a parameter": fb.Actuator("x", "r.angle", force="2*u + 1"),
    "its law is not a multiple of a parameter ": fb.Motor("x", "r", torque=3),
    "its law is not a multiple of a parameter  ": fb.CoordinateSpring("x", "r.angle", stiffness=1, force="u"),
    "its damping acts only where its spring does": fb.Limit("x", "r.angle", lower=1, stiffness=3, damping=1),
    "b0.x is not the coordinate of a hinge or slide": fb.CoordinateSpring("x", "b0.x", stiffness=1),
    "friction is a number in MJCF, the same at rest": fb.Brake("x", "r.angle", capacity="u"),
    "the format prescribes no motion": fb.Driver("x", "r.angle", "sin(t)"),
    "the file starts at the reference configuration": fb.Initial("r.angle", value=0.1),
    "the file has no laws": fb.Lag("x", of="u", time=1),
    "the file has no events": fb.Event("x", "t > 1", do=[fb.Stop()]),
    "the file describes the motion only": fb.Sensor("x", "r.angle"),
    "contact is not written": fb.Material("x", friction=0.3),
    "stops are soft in MuJoCo": fb.Limit("x", "arm.angle", lower=-1, restitution=0.3),
}


@pytest.mark.parametrize("reason", UNWRITTEN)
def test_what_is_left_out_is_listed_with_the_reason(tmp_path, reason):
    m = forest()
    m.add(UNWRITTEN[reason])
    with pytest.warns(fb.ModelWarning, match=rf"MJCF has no counterpart of .*\({reason.strip()}\); the file lacks"):
        m.save(tmp_path / "m.xml")


def tendons() -> fb.Mechanism:
    """Springs, dampers, stops, friction and motors along sums of coordinates and along paths."""
    m = forest()
    m.parameters.update(tension=0.7, pull=-0.4, torque=1.5)
    pair = {"coordinate": ["r.angle", "arm.angle", "p.displacement"], "weights": [1, "-0.5", 3]}
    m.add(
        fb.CoordinateSpring("pair", **pair, stiffness=4, damping=0.3, rest=0.2),
        fb.Actuator("pull it", **pair, force="pull"),
    )
    m.add(
        fb.Limit("soft", **pair, lower=-0.3, upper=0.1, stiffness=7),
        fb.Limit("one", "arm.angle", upper=0.2, stiffness=5),
    )
    m.add(fb.CoordinateSpring("more", "r.angle", stiffness=1.3, damping=1), fb.Motor("turn", "r", torque="-2*torque"))
    m.add(fb.SpringDamper("line", "b0", "tool", at=((1, 2, 3), (0, 1, 0)), stiffness=3, damping=0.2))
    m.add(fb.PathSpring("path", ["ground", "b6", "tool"], stiffness=5, damping=0.1, length=1.7))
    m.add(fb.PathSpring("muscle", ["b5", "b2", "b3"], force="10*tension"))
    m.add(fb.Rope("cord", ["b0", "b5", "b7"], stiffness=8, length=2))
    return m


def test_tendons(tmp_path):
    """Forces at random states, in MuJoCo and read back."""
    m = tendons()
    M, remarks = written(m, tmp_path / "tendons.xml")
    assert not remarks
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.ModelWarning)
        again = fb.load(tmp_path / "tendons.xml")
    controls = {"motor": 2.0, "pull_it": -0.4, "turn": 1.5, "muscle": 0.7}
    again.parameters.update({f"control_{k}": x for k, x in controls.items()})
    p, r, D = m.prepare(coordinates="joint"), again.prepare(coordinates="joint"), mujoco.MjData(M)
    D.ctrl = [controls[M.actuator(k).name.replace(" ", "_")] for k in range(M.nu)]
    np.testing.assert_allclose(M.key_ctrl[0], D.ctrl)
    x, y = (
        convention(p, M),
        r.convention("mujoco", joints=[M.joint(k).name.removesuffix("_free") for k in range(M.njnt)]),
    )
    M.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    rng = np.random.default_rng(1)
    for _ in range(3):
        q, (v, a) = p.step(p.q, 0.5 * rng.normal(size=len(p.v))), rng.normal(size=(2, len(p.v)))
        D.qpos, D.qvel, D.qacc = x.from_flyball(q, v, a)
        mujoco.mj_inverse(M, D)
        mujoco.mj_fwdActuation(M, D)
        theirs = D.qfrc_inverse - D.qfrc_actuator
        forces = p.mass_matrix(q) @ a - p.forces(0.0, q, v)
        np.testing.assert_allclose(x.forces_to_flyball(q, theirs), forces, atol=1e-10 * abs(forces).max())
        q, v, a = y.to_flyball(D.qpos, D.qvel, D.qacc)
        forces = r.mass_matrix(q) @ a - r.forces(0.0, q, v)
        np.testing.assert_allclose(y.forces_to_flyball(q, theirs), forces, atol=1e-10 * abs(forces).max())


def test_stops_of_tendons_and_couplings_of_three(tmp_path):
    m = forest()
    m.add(
        fb.Limit("both", ["r.angle", "arm.angle"], weights=[1, 2], lower=-0.4),
        fb.Brake("rubs", ["r.angle", "arm.angle"], weights=[1, 1], capacity=0.3),
    )
    m.add(
        fb.Rope("leash", ["ground", "b6"], length=9),
        fb.Coupler("sum", ["r.angle", "arm.angle", "p.displacement"], weights=[2, 1, 4], value=0.6),
    )
    _, remarks = written(m, tmp_path / "m.xml")
    assert not remarks
    again = fb.load(tmp_path / "m.xml")
    assert (again["both_limit"].weights, again["both_limit"].lower) == ((1, 2), -0.4)
    assert again["rubs_friction"].capacity == 0.3
    assert again["leash_limit"].length == 9
    (found,) = again.couplings
    assert found.coordinates == ("r.angle", "arm.angle", "p.displacement")
    np.testing.assert_allclose(np.array(found.weights) / found.weights[0] * 2, (2, 1, 4))
    assert found.value / found.weights[0] * 2 == pytest.approx(0.6)


def test_gears(tmp_path):
    m = fb.Mechanism("gears", planar=True)
    m.add(fb.Body("a", mass=1, inertia=1), fb.Body("b", mass=1, inertia=1, position=(1, 0)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "b", "ground", at=(1, 0), angle=0.3))
    m.add(fb.GearPair("mesh", "A", "B", teeth=(20, 30)))
    written(m, tmp_path / "m.xml")
    again = fb.load(tmp_path / "m.xml")
    for x in (m, again):
        x.add(fb.Actuator("motor", "A.angle", force=1))
    a, b = (x.simulate(0.5, outputs=3) for x in (m, again))
    np.testing.assert_allclose(b["B.angle"], a["B.angle"], rtol=1e-9)
    assert np.ptp(a["B.angle"]) > 0.05


SHAPES = [
    fb.Box(edges=(0.3, 0.2, 0.1), orientation=(0, 0, 0.3)),
    fb.Sphere(radius=0.2),
    fb.Capsule(radius=0.1, length=0.3, orientation=(0, 1.2, 0)),
    fb.Cylinder(radius=0.1, length=0.05),
    fb.Ellipsoid(semi_axes=(0.1, 0.2, 0.3)),
    fb.Rod(start=(0, 0), end=(0.4, 0.1), radius=0.02),
    fb.Tube(radius=0.1, inner_radius=0.07, length=0.2),
    fb.Link(start=(0, 0), end=(0.4, 0.1), width=0.1, thickness=0.02),
    fb.Prism(outline=((0, 0), (0.3, 0), (0.3, 0.1), (0.1, 0.1), (0.1, 0.3), (0, 0.3)), thickness=0.04),
    fb.Cone(radius=0.1, height=0.3),
    fb.Torus(radius=0.2, tube_radius=0.05),
]


@pytest.mark.parametrize("planar", [True, False], ids=["plane", "space"])
@pytest.mark.parametrize("shape", SHAPES, ids=lambda s: type(s).__name__)
def test_shapes(tmp_path, shape, planar):
    """The corners of the picture, in the plane too; what has no geom of its own is a mesh. Holes are not drawn."""
    at = (1, 2) if planar else (1, 2, 3)
    turn = {"angle": 0.4} if planar else {"orientation": (0.4, 0.2, -0.3)}
    if not planar:
        shape = replace(shape, **{k: (*getattr(shape, k), 0) for k in ("start", "end") if hasattr(shape, k)})
    hole = fb.Sphere(radius=0.001, hole=True)
    m = fb.Mechanism("shapes", planar=planar)
    m.add(fb.Body("b", density=1000, shape=(shape, hole), position=at, **turn))
    m.add(fb.Ground("g", shape=replace(shape, looks=True), position=at, **turn))
    M, remarks = written(m, tmp_path / "shapes.xml")
    assert not remarks
    assert M.ngeom == 2
    again = fb.load(tmp_path / "shapes.xml")
    mine, theirs = (np.concatenate([corners(x, e) for e in (*x.ground, *x.bodies) if e.shapes()]) for x in (m, again))
    gaps = np.linalg.norm(mine[:, None] - theirs[None], axis=2)
    assert max(gaps.min(axis=0).max(), gaps.min(axis=1).max()) < 1e-6  # MuJoCo's meshes have single precision


def corners(m, e):
    """Corners of the picture of a body or a part of ground, in the world as drawn."""
    s, n, _ = checked_shapes(e, {}, m.planar)[0]
    v = s.mesh(n)[0]
    p, R = frame_of(e, resolve(e, {})) if isinstance(e, fb.Ground) else m.prepare().pose(e.name, m.prepare().q)
    return p + v @ R.T
