"""Copies of a mechanism in another: names, parameters, laws, controllers, events, files."""

import numpy as np
import pytest

import flyball as fb
from flyball.model.model_files import dumps, loads


def pendulum(**more) -> fb.Mechanism:
    """A driven pendulum that names everything there is: parameters, a sensor, a table, a controller, an event."""
    m = fb.Mechanism("pendulum", gravity=(0, 0, -9.81), parameters={"l": 0.4, "m": "2*l", "k": "3 N/m"} | more)
    m.add(
        fb.Body(
            "bob", mass="m", inertia=("0.1*l", 0.02, 0.03), position=("l", 0, 0), shape=fb.Cone(radius=0.05, height=0.1)
        )
    )
    m.add(fb.Revolute("A", "ground", "bob", at=(0, 0, 0), axis=(0, 1, 0), angle="10 deg"))
    m.add(fb.Frame("tip", "bob", position=("0.5*l", 0.1, 0), orientation=("20 deg", 0, "0.1*l")))
    m.add(fb.Sensor("side", "tip.y"), fb.Sensor("turn", "A.angle"), fb.IMU("imu", "tip"))
    m.add(fb.Table("curve", x=(-9, 0, 9), y=(-3, 0, 2)))
    m.add(fb.PID("pid", setpoint="0.1*sin(t)", measured="A.angle", kp="k", ki=1.0))
    m.add(fb.Motor("motor", "A", torque="pid - 0.1*rate + curve(side) + 0.2*pid.error*(2 m) + turn"))
    m.add(fb.SpringDamper("spring", "ground", "tip", stiffness="k", damping=0.1, length=0.3))
    m.add(
        fb.PointForce("wind", "bob", force=("0.1*t", "side", 0)), fb.PointTorque("twist", "bob", torque=(0, 0.1, "t"))
    )
    m.add(fb.Event("fast", when="A.angle > 20 deg", do=[fb.Set("k", "2*k"), fb.Set("pid.integral", 0.0)], times=1))
    m.add(fb.Initial("A.angle", rate=1.0), fb.Limit("stop", "A.angle", upper="80 deg"))
    return m


def two() -> fb.Mechanism:
    m = fb.Mechanism("two", gravity=(0, 0, -9.81), parameters={"stiff": 5.0})
    m.add(pendulum(), prefix="left", at=(0, 1, 0))
    m.add(pendulum(), prefix="right", at=(0, -1, 0), mirror="y", parameters={"k": "stiff", "l": 0.5})
    return m


def test_names_parameters_and_laws_are_those_of_the_copy():
    m = two()
    assert m["left.motor"].torque == (
        "left.pid - 0.1*rate + left.curve((left.side + -1.0)) + 0.2*left.pid.error*(2 m) + left.turn"
    )
    assert m["right.motor"].torque.startswith("right.pid - 0.1*rate + right.curve(((-right.side) + -1.0))")
    assert m.parameters["left.m"] == "2*left.l" and m.parameters["right.k"] == "stiff"
    env = m.environment()
    assert (env["left.m"], env["right.m"], env["right.k"]) == (0.8, 1.0, 5.0)
    assert m["right.fast"].do == (fb.Set("right.k", "2*right.k"), fb.Set("right.pid.integral", 0.0))
    assert m["right.A"].axis == (0.0, 1.0, 0.0)
    assert m["right.ground"].body == m["right.spring"].body_i.replace("right.ground", "ground")
    assert [e.name for e in m.initial] == ["left.A.angle", "right.A.angle"]


def test_a_copy_moves_as_the_original_and_its_image_as_the_image():
    alone, m = pendulum(), fb.Mechanism("two", gravity=(0, 0, -9.81))
    m.add(alone, prefix="left", at=(0, 1, 0))
    m.add(alone, prefix="right.inner", at=(2, 0, 1), mirror="y")
    one, both = (x.simulate(0.3, outputs=4, rtol=1e-10, atol=1e-12) for x in (alone, m))
    for name in ("A.angle", "A.rate", "pid.integral", "motor.torque", "spring.force", "imu.fx", "bob.x"):
        for prefix, shift in (("left", 0.0), ("right.inner", 2.0 if name == "bob.x" else 0.0)):
            assert both[f"{prefix}.{name}"] == pytest.approx(one[name] + shift, rel=1e-6, abs=1e-7), (prefix, name)
    assert both["right.inner.tip.y"] == pytest.approx(-one["tip.y"], abs=1e-8)
    assert [x.name for x in both.events if "fast" in x.name].__len__() == 2


def test_files_have_the_parts_one_by_one():
    m = two()
    assert loads(dumps(m), fb.Mechanism) == m


def test_a_part_stands_on_a_body():
    """What stands on ground in the part stands on the body, in the place that it has in the reference configuration."""
    m = fb.Mechanism("cart", gravity=(0, 0, -9.81))
    cart = fb.Body("cart", mass=5, inertia=(1, 1, 1), position=(1, 0, 0.5), orientation=(0, 0, "90 deg"))
    m.add(cart, fb.Prismatic("rail", "ground", "cart", at=(0, 0, 0), axis=(1, 0, 0)))
    m.add(pendulum(), prefix="top", at=(1, 0, 1), on="cart")
    assert m["top.A"].body_i == "cart" and m["top.A"].at == (1.0, 0.0, 1.0)
    ground = m["top.ground"]
    assert ground.body == "cart" and ground.position == pytest.approx((0, 0, 0.5))
    r = m.simulate(1e-3, outputs=2)
    assert r["top.ground"].position[0] == pytest.approx((1, 0, 1))
    assert np.reshape(r["top.ground"].rotation[0], (3, 3)) == pytest.approx(np.eye(3), abs=1e-12)


def test_groups_in_groups():
    pair, m = fb.Mechanism("pair", gravity=(0, 0, -9.81)), fb.Mechanism("m", gravity=(0, 0, -9.81))
    for k in (0, 1):
        pair.add(pendulum(), prefix=f"p{k}", at=(0, k, 0))
    m.add(pair, prefix="front", at=(1, 0, 0))
    assert m["front.p1.bob"].position == ("front.p1.l + 1.0", 1.0, 0.0)
    assert m.environment()["front.p1.m"] == 0.8
    assert "front.p1.A" in m and "front" in m.groups and "front" not in m


FILE = """
name = "row"
gravity = [0, 0, -9.81]

[parameters]
k = 2.0

[definitions.post.parameters]
h = 0.3

[[definitions.post.bodies]]
name = "top"
mass = 1
inertia = [1, 1, 1]
position = [0, 0, "h"]

[[bodies]]
name = "link"
repeat = 4
mass = 0.5
inertia = [1, 1, 1]
position = ["0.1*{i}", 0, "-{2*i+1}*k"]

[[assemblies]]
prefix = "post"
of = "post"
repeat = 3
at = ["0.5*{i}", 0, 0]
parameters = {h = "k/{i+1}"}

[[joints]]
type = "Revolute"
name = "pin"
repeat = 3
body_i = "link_{i}"
body_j = "link_{i+1}"
at = ["0.1*{i}", 0, 0]
axis = [0, 1, 0]

[[joints]]
type = "Fixed"
name = "foot"
body_i = "ground"
body_j = "post_1.top"
at = [0, 0, 0]
"""


def test_tables_of_files_stand_for_several_parts():
    m = loads(FILE, fb.Mechanism)
    assert [b.name for b in m.bodies] == [*(f"link_{i}" for i in range(4)), *(f"post_{i}.top" for i in range(3))]
    assert m["link_3"].position == ("0.1*3", 0, "-7*k")
    assert (m["pin_2"].body_i, m["pin_2"].body_j) == ("link_2", "link_3")
    assert m["post_2.top"].position == ("0.5*2", 0.0, "post_2.h")
    assert m.environment()["post_2.h"] == pytest.approx(2 / 3)
    assert loads(dumps(m), fb.Mechanism) == m


def test_a_file_is_a_part_of_another(tmp_path):
    pendulum().save(tmp_path / "pendulum.toml")
    (tmp_path / "both.toml").write_text(
        'name = "both"\ngravity = [0, 0, -9.81]\n[[assemblies]]\nprefix = "b"\nfile = "pendulum.toml"\nmirror = "x"\n'
    )
    m = fb.Mechanism("both", gravity=(0, 0, -9.81))
    m.add(pendulum(), prefix="b", mirror="x")
    assert fb.load(tmp_path / "both.toml") == m


def test_results_and_summaries_are_by_group():
    m = two()
    r = m.simulate(0.01, outputs=2)
    left = r["left"]
    assert (left["bob.x"] == r["left.bob.x"]).all() and (left["bob"].position == r["left.bob"].position).all()
    assert "left" in r and "bob.x" in left and "bob.q" not in left and "left.bob.x" not in left
    assert left.parts()[0] == "bob" and "A.angle" in left.names()
    with pytest.raises(fb.ModelError, match=r"'left' has no part named 'bop' \(did you mean 'bob'\?\)"):
        left["bop.x"]
    assert "bodies     2: left.bob, right.bob" in str(m) and "sensors    6: left.* (3), right.* (3)" in str(m)
    assert "parameters 7: stiff = 5.0, left.* (3), right.* (3)" in str(m)
