"""Robots in URDF: what of the file becomes what of the mechanism, and what is said of the rest."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import flyball as fb

ARM = """<?xml version="1.0"?>
<robot name="arm">
  <material name="blue"><color rgba="0 0 1 1"/></material>
  <link name="base"><visual><geometry><box size="0.2 0.2 0.1"/></geometry></visual></link>
  <link name="upper-arm">
    <inertial>
      <origin xyz="0.3 0 0" rpy="0 0 1.5707963267948966"/>
      <mass value="2"/>
      <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.1"/>
    </inertial>
    <visual>
      <origin xyz="0.3 0 0" rpy="0 1.5707963267948966 0"/>
      <geometry><cylinder radius="0.04" length="0.6"/></geometry><material name="blue"/>
    </visual>
  </link>
  <link name="slide"><inertial><mass value="0.5"/><inertia ixx=".01" ixy="0" ixz="0" iyy=".01" iyz="0" izz=".01"/></inertial></link>
  <link name="tool"/>
  <joint name="shoulder" type="revolute">
    <origin xyz="0 0 0.4" rpy="0 0 0"/><parent link="base"/><child link="upper-arm"/><axis xyz="0 2 0"/>
    <limit lower="-1" upper="2" effort="10" velocity="3"/><dynamics damping="0.7" friction="0.2"/>
  </joint>
  <joint name="rail" type="prismatic">
    <origin xyz="0.6 0 0" rpy="0 0 0"/><parent link="upper-arm"/><child link="slide"/><axis xyz="1 0 0"/>
    <limit lower="0.1" upper="0.3"/>
  </joint>
  <joint name="flange" type="fixed">
    <origin xyz="0 0.1 0" rpy="0 0 1.5707963267948966"/><parent link="slide"/><child link="tool"/>
  </joint>
</robot>
"""


def read(tmp_path, text=ARM, **options):
    path = tmp_path / "arm.urdf"
    path.write_text(text)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.ModelWarning)
        return fb.load(path, **options)


def test_an_arm(tmp_path):
    """Kinematics, inertia, stops, damping and friction, in closed form."""
    m = read(tmp_path)
    p = m.prepare(coordinates="joint")
    assert p.names == ("shoulder.angle", "rail.displacement")
    q, v, a = np.array([0.3, 0.2]), np.array([0.5, -0.4]), np.array([0.2, 0.7])
    c, s = np.cos(q[0]), np.sin(q[0])
    along = np.array([c, 0, -s])  # the arm turns about y
    position, R = p.pose("tool", q)
    np.testing.assert_allclose(position, [0, 0.1, 0.4] + (0.6 + q[1]) * along, atol=1e-14)
    np.testing.assert_allclose(
        R, np.array([along, [0, 1, 0], [s, 0, c]]).T @ [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-14
    )
    r, g = 0.6 + q[1], 9.80665  # the inertia about y of the arm is written as iyy of turned axes: ixx
    M = np.diag([0.1 + 2 * 0.3**2 + 0.01 + 0.5 * r**2, 0.5])
    np.testing.assert_allclose(p.crba(q), M, rtol=1e-13, atol=1e-15)
    bias = [2 * 0.5 * r * v[0] * v[1] - g * c * (2 * 0.3 + 0.5 * r), -0.5 * r * v[0] ** 2 - 0.5 * g * s]
    np.testing.assert_allclose(p.rnea(q, v, a), M @ a + bias, rtol=1e-12)
    forces = p.forces(0.0, q, v) + bias  # of damping and friction
    np.testing.assert_allclose(forces, [-0.7 * v[0] - 0.2, 0], atol=1e-12)
    assert [(e.name, e.lower, e.upper) for e in m.limits] == [
        ("shoulder_limit", -1.0, 2.0), ("rail_limit", 0.1, 0.3),
    ]  # fmt: skip
    assert p.q[1] == pytest.approx(0.2)  # zero is not permitted: the middle
    assert m["upper_arm"].color == "#0000ff"
    assert m.simulate(0.5)["shoulder.angle"].max() <= 2.0 + 1e-9


def test_a_floating_robot(tmp_path):
    m = read(tmp_path, floating=True, text=ARM.replace('<link name="base">', '<link name="base"><inertial><mass value="3"/>'
             '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'))  # fmt: skip
    p = m.prepare(coordinates="joint")
    assert p.names[0] == "base.x" and len(p.v) == 8
    np.testing.assert_allclose(p.aba(p.q, np.zeros(8), np.zeros(8))[:3], [0, 0, -9.80665], atol=1e-12)


def test_a_joint_that_follows_another(tmp_path):
    """mimic: value = multiplier * value of the other + offset."""
    text = ARM.replace('<limit lower="0.1" upper="0.3"/>', '<limit lower="-1" upper="1"/>'
                       '<mimic joint="shoulder" multiplier="0.1" offset="0.05"/>')  # fmt: skip
    m = read(tmp_path, text)
    run = m.simulate(0.3, outputs=11)
    np.testing.assert_allclose(run["rail.displacement"], 0.1 * run["shoulder.angle"] + 0.05, atol=1e-9)


def test_what_is_not_used_is_listed(tmp_path):
    path = tmp_path / "arm.urdf"
    text = ARM.replace("</robot>", "<transmission/><gazebo/></robot>").replace(
        '<box size="0.2 0.2 0.1"/>', '<mesh filename="package://arm/base.stl"/>'
    )
    path.write_text(text)
    with pytest.warns(
        fb.ModelWarning,
        match=r"arm.urdf: not used: .*transmission.*limit effort.*gazebo.*in line 4: there is no file package://arm/base.stl",
    ):
        fb.load(path)


MOTOR = """
  <transmission name="gear">
    <type>transmission_interface/SimpleTransmission</type>
    <joint name="shoulder"><hardwareInterface>effort</hardwareInterface><offset>0.3</offset></joint>
    <actuator name="motor-1"><mechanicalReduction>-50</mechanicalReduction></actuator>
  </transmission>
</robot>
"""


def test_a_transmission_is_a_motor_behind_gears(tmp_path):
    """The joint's torque is the reduction times that of the motor, a parameter."""
    m = read(tmp_path, ARM.replace("</robot>", MOTOR))
    p = m.prepare(coordinates="joint")
    q, v = np.array([0.3, 0.2]), np.array([0.5, -0.4])
    free = p.forces(0.0, q, v)
    assert m.parameters == {"control_motor_1": 0.0}
    m.parameters["control_motor_1"] = 0.2
    driven = m.prepare(coordinates="joint").forces(0.0, q, v)
    np.testing.assert_allclose(driven - free, (-50 * 0.2, 0), atol=1e-12)
    assert m["motor_1"].coordinate == "shoulder.angle"


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (("transmission_interface/SimpleTransmission", "DifferentialTransmission"), r"transmission of type DifferentialTransmission, which is not SimpleTransmission> \(line 30\)"),
        (('joint name="shoulder"><', 'joint name="flange"><'), r"transmission of a fixed joint> \(line 30\)"),
        (("", ""), r"<hardwareInterface> \(line 32\)"),
    ],
)  # fmt: skip
def test_what_is_not_used_of_transmissions(tmp_path, change, match):
    path = tmp_path / "arm.urdf"
    path.write_text(ARM.replace("</robot>", MOTOR.replace(*change) if change[0] else MOTOR))
    with pytest.warns(fb.ModelWarning, match=match):
        fb.load(path)


BOX = "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


@pytest.mark.parametrize("scale", [(-1, 1, 1), (0.1, -2, -3), (-1, -1, -1), (1, 2, 3)])
def test_scaled_and_mirrored_meshes(tmp_path, scale):
    """A mirror image keeps its normals outwards: the volume by Gauss's theorem stays positive."""
    (tmp_path / "box.obj").write_text(BOX)
    text = ARM.replace(
        '<box size="0.2 0.2 0.1"/>', f'<mesh filename="box.obj" scale="{scale[0]} {scale[1]} {scale[2]}"/>'
    )
    (mesh,) = read(tmp_path, text)["base_shape"].shapes()
    t = mesh.triangulation
    assert not t.flaws
    assert t.integrals.volume == pytest.approx(abs(np.prod(scale)))
    np.testing.assert_allclose(t.integrals.centre, np.array(scale) * (0.25, 0.5, 0.75), atol=1e-12)


def collada(path, meter="0.01"):
    """A red box of 1 by 2 by 3 units, written by trimesh."""
    trimesh = pytest.importorskip("trimesh")
    pytest.importorskip("collada")
    box = trimesh.creation.box((1, 2, 3))
    box.visual.face_colors = [200, 10, 30, 255]
    text = trimesh.exchange.dae.export_collada(box).decode()
    path.write_text(text.replace("<asset>", f'<asset><unit name="unit" meter="{meter}"/>'))


def test_collada_meshes_have_their_unit_and_colour(tmp_path):
    collada(tmp_path / "box.dae")
    text = ARM.replace('name="slide"><', 'name="slide"><visual><geometry><mesh filename="box.dae" scale="1 -1 2"/></geometry></visual>'
                       '<visual><geometry><mesh filename="box.dae"/></geometry></visual><')  # fmt: skip
    m = read(tmp_path, text)
    mirrored, plain = (x.triangulation for x in m["slide"].shapes())
    np.testing.assert_allclose(np.ptp(plain.v, axis=0), (0.01, 0.02, 0.03), rtol=1e-12)
    assert mirrored.integrals.volume == pytest.approx(2 * 6e-6) == 2 * plain.integrals.volume
    assert plain.color == "#c80a1e"
    m = read(tmp_path, text.replace(' scale="1 -1 2"', ""))
    assert m["slide"].color == "#c80a1e"
    blue = text.replace(' scale="1 -1 2"/></geometry>', '/></geometry><material name="blue"/>')
    assert read(tmp_path, blue)["slide"].color == "#0000ff"


@pytest.mark.parametrize(
    ("mesh", "match"),
    [
        ('filename="box.dae" scale="1 0 1"', "<mesh> in line 4: it is scaled by 1 0 1, which leaves no solid"),
        ('filename="none.dae"', "<mesh> in line 4: there is no file none.dae"),
        ('filename="box.step"', "box.step is not of a kind that can be read: .stl, .obj, .ply, .off, .dae"),
        ('filename="broken.dae"', "broken.dae' cannot be read as DAE"),
    ],
)
def test_meshes_that_cannot_be_shown_are_listed_with_the_reason(tmp_path, mesh, match):
    collada(tmp_path / "box.dae")
    (tmp_path / "box.step").write_text("")
    (tmp_path / "broken.dae").write_text("<COLLADA><library")
    path = tmp_path / "arm.urdf"
    path.write_text(ARM.replace('<box size="0.2 0.2 0.1"/>', f"<mesh {mesh}/>"))
    with pytest.warns(fb.ModelWarning, match=match):
        fb.load(path)


def test_without_pycollada_the_package_is_named(tmp_path, monkeypatch):
    collada(tmp_path / "box.dae")
    monkeypatch.setitem(__import__("sys").modules, "collada", None)
    path = tmp_path / "arm.urdf"
    path.write_text(ARM.replace('<box size="0.2 0.2 0.1"/>', '<mesh filename="box.dae"/>'))
    with pytest.warns(
        fb.ModelWarning, match=r"reading .dae files takes the package collada: pip install 'flyball\[meshes\]'"
    ):
        fb.load(path)


def test_meshes_are_found_beside_the_package(tmp_path):
    folder = tmp_path / "arm_description" / "meshes"
    folder.mkdir(parents=True)
    (folder / "base.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    text = ARM.replace(
        '<box size="0.2 0.2 0.1"/>', '<mesh filename="package://arm_description/meshes/base.obj" scale="2 2 2"/>'
    )
    (tmp_path / "arm_description" / "arm.urdf").write_text(text)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.ModelWarning)
        m = fb.load(tmp_path / "arm_description" / "arm.urdf")
    (mesh,) = m["base_shape"].shapes()
    assert mesh.path.endswith("base.obj") and mesh.scale == 2.0


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (("<robot", "<sdf"), r"arm.urdf is no XML: mismatched tag: line 29"),
        ((ARM, "<sdf/>"), r"arm.urdf, line 1: <sdf> is not URDF"),
        (('child link="slide"', 'child link="sledge"'), r"line 22: joint 'rail' connects the link 'sledge', which does not exist"),
        (('type="prismatic"', 'type="screw"'), "line 22: joint 'rail' has the unknown type 'screw'"),
        (('parent link="base"', 'parent link="slide"'), "form a cycle"),
        (('child link="tool"', 'child link="slide"'), "line 26: link 'slide' is the child of two joints, 'rail' and 'flange'"),
        (('<mass value="2"/>', '<mass value="nan"/>'), "line 8: value='nan' of <mass>: a finite number is needed"),
        (('<mass value="2"/>', ""), "line 6: <inertial> '' needs <mass>"),
        (('<mass value="2"/>', '<mass value="-2"/>'), "line 6: the mass of link 'upper-arm' is negative"),
        (('<axis xyz="1 0 0"/>', '<axis xyz="0 0 0"/>'), "the axis of joint 'rail' is zero"),
        (('lower="0.1" upper="0.3"', 'lower="0.4" upper="0.3"'), "limits of joint 'rail' are reversed: 0.4 to 0.3"),
        (('type="fixed"', 'type="continuous"'), "link 'tool' moves, and neither it nor a link beyond it has mass"),
        (('name="tool"', 'name="slide"'), "there are two links 'slide'"),
        (('name="tool"', 'name=" "'), "line 17: a link has an empty name"),
        (('<mass value="2"/>', '<mass value="1_0"/>'), "line 8: value='1_0' of <mass>: a finite number is needed"),
        (('<mass value="2"/>', '<mass value="2"/><mass value="3"/>'), "line 8: <inertial> of 'upper-arm' has a second <mass>; leave one out"),
        (('<axis xyz="1 0 0"/>', '<axis xyz="1 0 0"/><axis xyz="0 1 0"/>'), "line 23: <joint> of 'rail' has a second <axis>"),
        (('<axis xyz="1 0 0"/>', '<mimic joint="rail"/>'), "joint 'rail' follows itself"),
        (('<axis xyz="1 0 0"/>', '<mimic joint="shoulder" multiplier="0"/>'), "line 23: the multiplier of joint 'rail' is 0"),
        (("<robot", '<!DOCTYPE r [<!ENTITY a "' + 1000 * "a" + '"><!ENTITY b "' + 1000 * "&a;" + '"><!ENTITY c "' + 1000 * "&b;" + '">]><robot title="&c;"'), "arm.urdf is no XML: limit on input amplification"),
        (('version="1.0"', 'version="1.0" encoding="nonsense"'), "arm.urdf is no XML: unknown encoding: nonsense"),
        (('<link name="tool"/>', '<xacro:arm/>'), "line 17: <xacro:arm> is a macro; expand the file first"),
        (("</robot>", MOTOR.replace('"shoulder"', '"elbow"')), "line 32: transmission 'gear' drives the joint 'elbow', which does not exist"),
        (("</robot>", MOTOR.replace("-50", "0")), "line 33: <mechanicalReduction> of transmission 'gear' is '0'; one finite number is needed, not 0"),
        (("</robot>", MOTOR.replace("-50", "fifty")), "transmission 'gear' is 'fifty'; one finite number"),
        (("</robot>", MOTOR.replace("</robot>", "") + MOTOR.replace("gear", "gear2").replace("motor-1", "motor-2")), "transmissions 'gear' and 'gear2' drive one joint, 'shoulder'"),
        (("</robot>", MOTOR.replace("<actuator ", "<actuator name='x'/><actuator ")), "line 30: transmission 'gear' has 2 <actuator>; a SimpleTransmission has one"),
    ],
)  # fmt: skip
def test_errors_name_file_line_and_element(tmp_path, change, match):
    text = ARM.replace(*change)
    assert text != ARM
    with pytest.raises(fb.ModelError, match=match):
        read(tmp_path, text)


def test_an_inertia_that_no_body_has_is_raised(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(ARM.replace('iyy="0.01" iyz="0" izz="0.1"', 'iyy="0.01" iyz="0" izz="0.2"'))
    with pytest.warns(
        fb.ModelWarning, match=r"principal moments of upper-arm \(0.01, 0.1, 0.2 becomes 0.055, 0.145, 0.2 kg m\^2\)"
    ):
        m = fb.load(path)
    np.testing.assert_allclose(np.linalg.eigvalsh(np.array(m["upper_arm"].inertia)), [0.055, 0.145, 0.2])


def test_a_shape_without_extent_is_left_out(tmp_path):
    m = read(tmp_path, ARM.replace('<box size="0.2 0.2 0.1"/>', '<box size="0 0 0"/>'))
    assert m.find("base_shape") is None


def test_floating_is_for_robots(tmp_path):
    (tmp_path / "m.toml").write_text("[mechanism]\nname = 'x'\n")
    with pytest.raises(fb.ModelError, match="floating=True is for robots"):
        fb.load(tmp_path / "m.toml", floating=True)


def test_written_and_read_again(tmp_path):
    """The dynamics of the mechanism that is read are those of the one that was written."""
    m = fb.Mechanism("arm", gravity=(0, 0, -9.80665))
    box = fb.Box(edges=(0.1, 0.2, 0.3), position=(0.1, 0, 0), orientation=(0.1, 0.2, 0.3), looks=True)
    m.add(fb.Body("a", mass=2, inertia=((0.3, 0.01, 0), (0.01, 0.4, 0.02), (0, 0.02, 0.5)), com=(0.1, 0.2, 0.3),
                  position=(0.5, 0, 0.2), orientation=(0.3, -0.2, 0.5), shape=box))  # fmt: skip
    m.add(fb.Body("b", mass=1, inertia=(0.1, 0.1, 0.1), position=(1, 0, 0)))
    m.add(fb.Body("c", mass=0.5, inertia=(0.1, 0.1, 0.1), position=(1, 1, 0)), fb.Frame("tip", "c", position=(0, 0, 1)))
    m.add(fb.Revolute("J", "ground", "a", at=(0, 0, 0.1), axis=(1, 1, 0)))
    m.add(fb.Prismatic("K", "b", "a", at=(0.7, 0, 0), axis=(0, 1, 2)))  # reversed
    m.add(fb.Revolute("L", "b", "c", at=(1, 0.5, 0), axis=(0, 0, 1)))
    m.add(fb.Limit("stop", "J.angle", lower="-20 deg", upper=1.0), fb.CoordinateSpring("d", "J.angle", damping=0.4))
    m.add(fb.Brake("f", "K.displacement", capacity=0.3))
    path = tmp_path / "arm.urdf"
    m.save(path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.ModelWarning)
        n = fb.load(path)
    p, r = m.prepare(coordinates="joint"), n.prepare(coordinates="joint")
    assert p.names == r.names
    rng = np.random.default_rng(0)
    q, v, a = rng.uniform(-1, 1, (3, 3))
    np.testing.assert_allclose(r.rnea(q, v, a), p.rnea(q, v, a), rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(r.pose("tip", q)[0], p.pose("tip", q)[0], atol=1e-13)
    np.testing.assert_allclose(r.forces(0, q, v), p.forces(0, q, v), rtol=1e-11, atol=1e-11)
    assert (n["J_limit"].lower, n["J_limit"].upper) == (pytest.approx(np.radians(-20)), 1.0)
    assert n["a"].shapes()[0].edges == (0.1, 0.2, 0.3)


@pytest.mark.parametrize("turn", [(0.3, 0.2, 0.1), (0.3, np.pi / 2, 0.1), (0.1, 1.57079632679, -0.2)])
def test_orientations_are_written_exactly(tmp_path, turn):
    """Also where roll and yaw turn about one axis; a root link of the file's own becomes ground again."""
    text = ARM.replace(
        'rpy="0 0 1.5707963267948966"/><parent link="slide"',
        f'rpy="{turn[0]} {turn[1]} {turn[2]}"/><parent link="slide"',
    )
    m = read(tmp_path, text)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.ModelWarning)
        m.save(tmp_path / "again.urdf")
        n = fb.load(tmp_path / "again.urdf")
    q = np.array([0.4, 0.2])
    (x, R), (y, Q) = (k.prepare(coordinates="joint").pose("tool", q) for k in (m, n))
    np.testing.assert_allclose(Q, R, atol=1e-15 * 10)
    np.testing.assert_allclose(y, x, atol=1e-14)


def test_names_that_change_are_told(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(ARM.replace('"base"', '"ground"'))
    with pytest.warns(fb.ModelWarning, match="other names here: ground is ground_, upper-arm is upper_arm"):
        fb.load(path)


def test_what_cannot_be_written(tmp_path):
    m = fb.Mechanism("m")
    m.add(fb.Body("a", mass=1, inertia=(1, 1, 1)), fb.Body("b", mass=1, inertia=(1, 1, 1), position=(1, 0, 0)))
    m.add(fb.Revolute("J", "ground", "a", at=(0, 0, 0), axis=(0, 0, 1)))
    with pytest.raises(fb.ModelError, match="several parts that no joint connects"):
        m.save(tmp_path / "m.urdf")
    m.add(
        fb.Revolute("K", "a", "b", at=(1, 0, 0), axis=(0, 0, 1)),
        fb.SpringDamper("s", "a", "b", stiffness=1, at=((0, 0, 0), (1, 1, 0))),
    )
    with pytest.warns(fb.ModelWarning, match="no counterpart of SpringDamper 's'"):
        m.save(tmp_path / "m.urdf")
    m.add(fb.Revolute("L", "ground", "b", at=(1, 0, 0), axis=(0, 0, 1)))
    with pytest.raises(fb.ModelError, match="close a loop"):
        m.save(tmp_path / "m.urdf")
    ball = m.changed({"L": None, "K": None})
    ball.add(fb.Spherical("K", "a", "b", at=(1, 0, 0)))
    with pytest.raises(fb.ModelError, match=r"Spherical 'K' has no counterpart in URDF"):
        ball.save(tmp_path / "m.urdf")


def test_equal_limits_fix_a_joint(tmp_path):
    text = ARM.replace('lower="0.1" upper="0.3"', 'lower="0.3" upper="0.3"')
    p = read(tmp_path, text).prepare(coordinates="joint")
    assert p.names == ("shoulder.angle",)
    np.testing.assert_allclose(p.pose("tool", [0.0])[0], (0.9, 0.1, 0.4), atol=1e-14)
    p = read(tmp_path, text.replace('lower="-1" upper="2"', 'lower="0.5" upper="0.5"')).prepare(coordinates="joint")
    assert not len(p.v)
    along = (np.cos(0.5), 0, -np.sin(0.5))
    np.testing.assert_allclose(p.pose("tool", [])[0], [0, 0.1, 0.4] + 0.9 * np.array(along), atol=1e-14)


def test_motors_and_shapes_are_written_and_what_is_not_has_a_reason(tmp_path):
    """Motors are simple transmissions; holes are not drawn; rods are cylinders, tubes have no counterpart."""
    m = fb.Mechanism("arm", gravity=(0, 0, -9.80665), parameters={"u": 0.2})
    rod = fb.Rod(start=(0, 0, 0), end=(0.4, 0, 0), radius=0.02, looks=True)
    hole, tube = fb.Box(edges=(0.01, 0.01, 0.01), hole=True), fb.Tube(radius=0.1, inner_radius=0.05, length=0.2)
    m.add(fb.Body("a", mass=2, inertia=(0.1, 0.1, 0.1), shape=(rod, tube)))
    m.add(fb.Body("b", density=100, shape=(fb.Box(edges=(0.1, 0.2, 0.3)), hole), position=(1, 0, 0)))
    m.add(
        fb.Revolute("J", "ground", "a", at=(0, 0, 0), axis=(0, 1, 0)),
        fb.Revolute("K", "a", "b", at=(1, 0, 0), axis=(0, 1, 0)),
    )
    m.add(
        fb.Motor("drive", "J", torque="-30*u"), fb.Motor("other", "J", torque=2), fb.Ground("floor", shape=fb.Plane())
    )
    m.add(fb.Limit("soft", "K.angle", lower=0, stiffness=3), fb.Sensor("angle", "K.angle"))
    reasons = (
        r"Ground 'floor' \(ground has no shapes in URDF\), Sensor 'angle' \(the file describes the motion only\), Motor 'other' "
        r"\(URDF has damping and friction of joints and simple transmissions\), Limit 'soft' \(URDF has rigid stops of "
        r"joints\), Tube of a \(URDF has boxes, cylinders, spheres and mesh files\)"
    )
    with pytest.warns(fb.ModelWarning, match=reasons):
        m.save(tmp_path / "arm.urdf")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.ModelWarning)
        n = fb.load(tmp_path / "arm.urdf")
    assert n["drive"].coordinate == "J.angle" and n["drive"].force == "-30.0*control_drive"
    (shape,) = n["a"].shapes()
    assert (shape.radius, shape.length) == (0.02, 0.4)
    np.testing.assert_allclose(shape.position, (0.2, 0, 0), atol=1e-15)
    assert len(n["b"].shapes()) == 1
    assert n["b"].mass == pytest.approx(100 * (0.006 - 1e-6))


def test_odd_but_sound_files(tmp_path):
    """UTF-16, axes that are not of unit length, names of meshes that no file can have, a long chain without masses."""
    path = tmp_path / "arm.urdf"
    text = ARM.replace('<axis xyz="0 2 0"/>', '<axis xyz="0 1e200 0"/>')
    mesh = f'<mesh filename="{5000 * "x"}.stl"/>'
    for encoding, box in (("utf-8", "<geometry/>"), ("utf-16", f"<geometry>{mesh}</geometry>")):
        path.write_bytes(text.replace('<geometry><box size="0.2 0.2 0.1"/></geometry>', box).encode(encoding))
        with pytest.warns(
            fb.ModelWarning, match=r"cannot be drawn \(<(geometry> in line 4: it is empty|mesh> in line 4: there is no)"
        ):
            m = fb.load(path)
        np.testing.assert_allclose(m["shoulder"].axis, (0, 1, 0), atol=1e-15)
    links = "".join(f'<link name="l{k}"/>' for k in range(1100))
    joints = "".join(
        f'<joint name="j{k}" type="continuous"><parent link="l{k}"/><child link="l{k + 1}"/></joint>'
        for k in range(1099)
    )
    path.write_text(f'<robot name="r">{links}{joints}</robot>')
    with pytest.raises(fb.ModelError, match="link 'l1' moves, and neither it nor a link beyond it has mass"):
        fb.load(path)
