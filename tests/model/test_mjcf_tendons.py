"""Tendons of MJCF: forces against MuJoCo itself, and what becomes of limits, friction and equalities."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest

import flyball as fb

mujoco = pytest.importorskip("mujoco")

BODIES = """
  <option gravity="0 0.3 -9.81"/><compiler angle="radian"/>
  <worldbody>
    <site name="anchor" pos="0.1 -0.2 1.4"/><site name="hook" pos="0.8 0.5 1"/>
    <body name="a" pos="0 0 1"><joint name="A" axis="0 1 0" ref="0.2"/><geom type="box" size=".2 .05 .04" pos=".2 0 0"/>
      <site name="s1" pos=".3 .02 .1" euler=".1 .2 .3"/>
      <body name="b" pos=".4 0 0" euler=".3 0 .2"><joint name="B" axis="0 1 1"/><geom type="box" size=".1 .05 .04" pos=".1 0 0"/>
        <site name="s2" pos=".1 .0 .1"/><site name="s3" pos=".2 .1 0"/>
        <body name="c" pos=".2 0 0"><joint name="S" type="slide" axis="1 0 0"/><geom size=".05"/><site name="s4"/></body>
      </body></body>
    <body name="ball" pos="0.5 0.5 0.5"><joint name="Q" type="ball"/><geom type="ellipsoid" size=".1 .2 .3" pos=".1 0 0"/>
      <site name="s5" pos=".1 .1 .1"/></body>
  </worldbody>"""
TENDONS = """
  <tendon>
    <fixed name="pair" stiffness="30" damping="2" springlength="0.1"><joint joint="A" coef="1.5"/><joint joint="B" coef="-0.7"/></fixed>
    <fixed name="band" stiffness="20" springlength="-0.1 0.05"><joint joint="B" coef="1"/><joint joint="S" coef="3"/></fixed>
    <fixed name="one" stiffness="20"><joint joint="S" coef="2"/></fixed>
    <fixed name="pull"><joint joint="A" coef="0.4"/><joint joint="S" coef="-2"/></fixed>
    <spatial name="line" stiffness="50" damping="1.2"><site site="anchor"/><site site="s2"/></spatial>
    <spatial name="long" stiffness="40" springlength="1.65 1.8"><site site="hook"/><site site="s1"/><site site="s3"/><site site="s5"/></spatial>
    <spatial name="muscle"><site site="anchor"/><site site="s1"/><site site="s4"/></spatial>
  </tendon>
  <actuator><motor name="m1" tendon="pull" gear="3"/><position name="p1" tendon="pair" kp="5" gear="0.5"/>
    <motor name="m2" tendon="muscle" gear="-2"/><general name="g2" tendon="muscle" gainprm="3" biastype="affine" biasprm="1 -4 -2" gear="1.5"/>
    <motor name="m3" joint="A"/></actuator>"""


def read(tmp_path, inside, quiet=True):
    path = tmp_path / "robot.xml"
    path.write_text(f"<mujoco>{inside}</mujoco>")
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always", fb.ModelWarning)
        m = fb.load(path)
    told = [str(x.message) for x in found]
    return m, mujoco.MjModel.from_xml_path(str(path)), " ".join(told)


def test_forces_of_tendons(tmp_path):
    """Springs, dampers, dead bands and actuators at random states."""
    m, M, told = read(tmp_path, BODIES + TENDONS)
    assert "tendon" not in told
    controls = np.array([0.4, -0.3, 1.2, 0.7, -1.1])
    m.parameters.update({f"control_{M.actuator(k).name}": u for k, u in enumerate(controls)})
    p, D = m.prepare(coordinates="joint"), mujoco.MjData(M)
    x = p.convention("mujoco", joints=[M.joint(k).name for k in range(M.njnt)])
    M.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    rng, n = np.random.default_rng(2), len(p.v)
    deadbands = set()
    for _ in range(12):
        q, (v, a) = p.step(p.q, 0.4 * rng.normal(size=n)), rng.normal(size=(2, n))
        D.qpos, D.qvel, D.qacc = x.from_flyball(q, v, a)
        D.ctrl = controls
        mujoco.mj_inverse(M, D)
        mujoco.mj_fwdActuation(M, D)
        deadbands.add((D.ten_length[M.tendon("band").id] > 0.05, D.ten_length[M.tendon("long").id] > 1.8))
        mine = p.mass_matrix(q) @ a - p.forces(0.0, q, v)
        theirs = x.forces_to_flyball(q, D.qfrc_inverse - D.qfrc_actuator)
        np.testing.assert_allclose(mine, theirs, rtol=1e-10, atol=1e-10 * np.abs(theirs).max())
    assert len(deadbands) > 2


def test_limits_friction_and_equalities(tmp_path):
    """What is soft in MuJoCo is rigid here."""
    inside = """
      <tendon>
        <fixed name="stop" limited="true" range="-0.2 0.3" frictionloss="0.4"><joint joint="A" coef="1"/><joint joint="B" coef="2"/></fixed>
        <fixed name="t1"><joint joint="A" coef="1"/><joint joint="B" coef="1"/></fixed>
        <fixed name="t2"><joint joint="B" coef="2"/><joint joint="S" coef="5"/></fixed>
        <fixed name="t3"><joint joint="S" coef="2"/></fixed>
        <spatial name="rope" limited="true" range="0 1.2"><site site="anchor"/><site site="s2"/><site site="s4"/></spatial>
      </tendon>"""
    m, _, told = read(tmp_path, BODIES + inside)
    assert "tendon" not in told
    limit, brake, rope = m["stop_limit"], m["stop_friction"], m["rope_limit"]
    assert (limit.coordinate, limit.weights) == (("A.angle", "B.angle"), (1, 2)) == (brake.coordinate, brake.weights)
    assert (limit.lower, limit.upper, brake.capacity) == (-0.2, 0.3, 0.4)
    assert (rope.bodies, rope.length, rope.stiffness) == (("anchor", "s2", "s4"), 1.2, None)
    equalities = """<equality><tendon name="e" tendon1="t1" tendon2="t2" polycoef="0.05 -0.5 0 0 0"/></equality>"""
    m, M, _ = read(
        tmp_path, BODIES + inside.replace("limited", 'user="0" limited').replace('"true"', '"false"') + equalities
    )
    run = m.changed({"stop_friction": None}).simulate(0.4, outputs=5)
    a, b, s = (run[k] for k in ("A.angle", "B.angle", "S.displacement"))
    np.testing.assert_allclose(
        (a + b) - M.tendon_length0[M.tendon("t1").id],
        0.05 - 0.5 * (2 * b + 5 * s - M.tendon_length0[M.tendon("t2").id]),
        atol=1e-9,
    )
    assert np.ptp(a) > 0.01
    equalities = """<equality><tendon name="e" tendon1="t1" polycoef="0.05 0 0 0 0"/><tendon name="f" tendon1="t3" polycoef="0.1 0 0 0 0"/>
      <joint name="g" joint1="A" polycoef="0.1 0 0 0 0"/></equality>"""
    m, M, _ = read(tmp_path, BODIES + inside.replace('"true"', '"false"') + equalities)
    run = m.changed({"stop_friction": None}).simulate(0.1, outputs=3)
    np.testing.assert_allclose(run["S.displacement"], 0.05, atol=1e-12)
    np.testing.assert_allclose(run["A.angle"], 0.2 + 0.1, atol=1e-12)
    np.testing.assert_allclose(run["B.angle"], M.tendon_length0[M.tendon("t1").id] + 0.05 - 0.3, atol=1e-10)


@pytest.mark.parametrize(
    ("inside", "match"),
    [
        ('<tendon><spatial name="w"><site site="anchor"/><geom geom="g"/><site site="s2"/></spatial></tendon>', r"tendon w \(it wraps around a geom, and paths are straight"),
        ('<tendon><spatial name="w"><site site="anchor"/><site site="s1"/><pulley divisor="2"/><site site="hook"/><site site="s2"/></spatial></tendon>', r"tendon w \(pulleys divide it"),
        ('<tendon><spatial name="w"><site site="s2"/><site site="s3"/></spatial></tendon>', r"tendon w \(all its sites are on one body"),
        ('<tendon><spatial name="w" frictionloss="1" limited="true" range="0.1 2"><site site="s1"/><site site="s3"/></spatial></tendon>', r"lower limit of tendon w \(a path has no stop.*friction of tendon w \(a path has no friction"),
        ('<tendon><fixed name="w"><joint joint="A" coef="0"/></fixed></tendon>', r"tendon w \(its coefficients are 0\)"),
        ('<tendon><spatial name="w"><site site="s1"/><site site="hook"/></spatial></tendon><equality><tendon name="e" tendon1="w"/></equality>', r"equality e \(read of fixed tendons only\)"),
        ('<tendon><fixed name="w"><joint joint="A" coef="2"/></fixed><fixed name="u"><joint joint="A" coef="1"/></fixed></tendon><equality><tendon name="e" tendon1="w" tendon2="u" polycoef="0 2 0 0 0"/></equality>', r"equality e \(its coefficients cancel\)"),
        ('<equality><joint name="e" joint1="A" joint2="B" polycoef="0 1 2 0 0"/></equality>', r"equality e \(its polynomial is not linear\)"),
        ('<actuator><muscle name="x" joint="A" lengthrange="0 1"/></actuator>', r"actuator x \(it has activation states\)"),
        ('<actuator><motor name="x" joint="Q"/></actuator>', r"actuator x \(it acts on neither a hinge, nor a slide, nor a tendon that is read\)"),
        ('<keyframe><key qvel="1 0 0 0 0 0"/></keyframe>', r"1 keyframes \(states are set by Initial\)"),
        ('<worldbody><body gravcomp="1"><joint stiffness="1 2"/><geom size="1"/></body></worldbody><option density="1"/>', "gravity compensation of bodies; forces of a fluid.*; nonlinear stiffness or damping of joints"),
        ('<equality><weld name="e" body1="a" body2="ball" relpose="1 0 0 1 0 0 0"/></equality>', r"relpose of equality e \(bodies are welded as they are in qpos0\)"),
        ('<worldbody><geom name="h" type="hfield" hfield="h"/></worldbody><asset><hfield name="h" nrow="3" ncol="3" size="1 1 1 1"/></asset>', r"geom h of ground \(hfield\)"),
        ('<actuator><motor name="x" joint="A" ctrllimited="true" ctrlrange="-1 1"/></actuator>', r"ranges of control and force of actuators \(x: parameters have no range\)"),
    ],
)  # fmt: skip
def test_what_is_not_read_is_listed_with_the_reason(tmp_path, inside, match):
    bodies = BODIES.replace('<geom size=".05"/>', '<geom name="g" size=".05"/>')
    path = tmp_path / "robot.xml"
    path.write_text(f"<mujoco>{bodies}{inside}</mujoco>")
    with pytest.warns(fb.ModelWarning, match=match):
        fb.load(path)


def test_sites_are_connected_and_welded(tmp_path):
    """Equalities of sites bring them together, where the bodies may be apart in the reference configuration."""
    sites = """<worldbody><body name="d" pos="0 0 0.2"><freejoint/><geom size=".1"/><site name="eye" pos="0 .1 0" euler="0 0 1"/></body></worldbody>
      <equality><{} name="e" site1="hook" site2="eye"/></equality>"""
    for kind in ("connect", "weld"):
        m, _, _ = read(tmp_path, BODIES + sites.format(kind))
        run = m.simulate(0.05, outputs=3)
        np.testing.assert_allclose(run["eye"].position, run["hook"].position, atol=1e-9)
        if kind == "weld":
            np.testing.assert_allclose(run["eye"].rotation, run["hook"].rotation, atol=1e-9)


def test_a_joint_starts_within_its_range(tmp_path):
    """Where that of qpos0 is not permitted, in the middle."""
    m, _, _ = read(
        tmp_path, BODIES.replace('name="S" type="slide"', 'name="S" type="slide" limited="true" range="0.1 0.3"')
    )
    assert m.simulate(0.01, outputs=2)["S.displacement"][0] == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("inside", "match"),
    [
        ('<fixed name="w" limited="true" range="0.3 1"><joint joint="B" coef="1"/><joint joint="S" coef="2"/></fixed>', "tendon w begins at 0, outside 0.3 to 1"),
        ('<spatial name="w" limited="true" range="0 0.1"><site site="s1"/><site site="hook"/></spatial>', "tendon w begins at .*, outside 0 to 0.1"),
        ('<spatial name="w" limited="true" range="5 9"><site site="s1"/><site site="hook"/></spatial>', ""),
    ],
)  # fmt: skip
def test_tendons_that_begin_outside_their_range_are_named(tmp_path, inside, match):
    """The motion is refused there; where the joints' initial values bring them into the range there is no remark."""
    m, _, told = read(tmp_path, f"{BODIES}<tendon>{inside}</tendon>")
    if match:
        assert re.search(match + ". A motion cannot begin there: add Initial elements", told)
        with pytest.raises(fb.ModelError, match="the motion starts beyond it"):
            m.simulate(0.01, outputs=2)
    else:
        assert "begins at" not in told
    slide = BODIES.replace('name="S" type="slide"', 'name="S" type="slide" limited="true" range="0.3 0.4"')
    if "fixed" in inside:
        assert "begins at" not in read(tmp_path, f"{slide}<tendon>{inside}</tendon>")[2]


def test_armature_of_a_tendon(tmp_path):
    """Along one coordinate it is that of a rotor with the tendon's coefficient as its ratio; else it is listed."""
    inside = """<tendon><fixed name="one" armature="0.3"><joint joint="S" coef="-2"/></fixed>
      <fixed name="two" armature="0.3"><joint joint="S" coef="2"/><joint joint="A" coef="1"/></fixed></tendon>"""
    m, M, told = read(tmp_path, BODIES + inside)
    assert "armature of tendon two (inertia is read along one coordinate)" in told and "tendon one" not in told
    bare, _, _ = read(tmp_path, BODIES)
    p, r = m.prepare(coordinates="joint"), bare.prepare(coordinates="joint")
    k = p.names.index("S.displacement")
    assert p.mass_matrix(p.q)[k, k] - r.mass_matrix(r.q)[k, k] == pytest.approx(0.3 * 4, rel=1e-12)


def test_errors_name_the_file(tmp_path):
    path = tmp_path / "robot.xml"
    path.write_text("<mujoco>" + BODIES.replace('type="slide"', 'type="slide" damping="-1"') + "</mujoco>")
    with pytest.raises(fb.ModelError, match=r"robot.xml: CoordinateSpring 'S_spring': damping is -1; it must be"):
        fb.load(path)
    (tmp_path / "folder.xml").mkdir()
    with pytest.raises(fb.ModelError, match="cannot be read: it is a folder"):
        fb.load(tmp_path / "folder.xml")
