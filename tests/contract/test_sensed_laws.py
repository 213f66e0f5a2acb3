"""Laws that name sensors: drivers that couple coordinates nonlinearly, and forces by measured quantities."""

import numpy as np
import pytest

import flyball as fb
from tests.layers import both_layers
from tests.mechanisms import rod

pytestmark = both_layers

G = 9.81


def two_wheels(law, **parameters):
    """Wheel A under a torque; wheel B, whose angle follows a law of A's."""
    m = fb.Mechanism("follow", parameters=parameters)
    m.add(
        fb.Body("a", mass=1.0, inertia=(0.05, 0.06, 0.08)),
        fb.Body("b", mass=1.0, inertia=(0.02, 0.03, 0.05), position=(1, 0, 0)),
    )
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0, 0), axis=(0, 0, 1), angle=0.4))
    m.add(fb.Revolute("B", "b", "ground", at=(1, 0, 0), axis=(0, 0, 1)))
    m.add(
        fb.Sensor("s", "A.angle"),
        fb.Motor("m", joint="A", torque="0.5 + 0.1*angle"),
        fb.Initial("A.angle", value=0.4, rate=9.0),
    )
    m.add(fb.Driver("d", "B.angle", law))
    return m


@pytest.mark.parametrize("timed", [False, True])
def test_driver_that_follows_a_sensor(timed):
    """b = asin(sin(a) / 2) + h(t), over many turns of a: Lagrange's equation of the one freedom left.

    (J_a + J_b f'^2) a'' = T - J_b f' (f'' a'^2 + h'').
    """
    law = "asin(0.5*sin(s))" + (" + 0.3*sin(4*t)" if timed else "")
    r = two_wheels(law).simulate(2.0, outputs=81, rtol=1e-10, atol=1e-12)
    a, b = r["A"].angle, r["B"].angle
    h, h1, h2 = (0.3 * np.sin(4 * r.t), 1.2 * np.cos(4 * r.t), -4.8 * np.sin(4 * r.t)) if timed else (0.0, 0.0, 0.0)
    assert np.ptp(a) > 4.0 * np.pi
    assert b == pytest.approx(np.arcsin(0.5 * np.sin(a)) + h, abs=1e-10)
    root = np.sqrt(1.0 - 0.25 * np.sin(a) ** 2)
    f1 = 0.5 * np.cos(a) / root
    f2 = -0.5 * np.sin(a) / root + 0.125 * np.sin(a) * np.cos(a) ** 2 / root**3
    rate = r["A"].rate
    assert r["B"].rate == pytest.approx(f1 * rate + h1, abs=1e-9)
    torque = 0.5 + 0.1 * a
    second = (torque - 0.05 * f1 * (f2 * rate**2 + h2)) / (0.08 + 0.05 * f1**2)
    assert r["A"].acceleration == pytest.approx(second, abs=1e-7)
    assert r["B"].acceleration == pytest.approx(f1 * second + f2 * rate**2 + h2, abs=1e-7)
    assert r["d"].effort == pytest.approx(0.05 * r["B"].acceleration, abs=1e-8)
    assert r.health.violation < 1e-12
    assert r.health.energy_drift < 1e-7
    assert r.health.freedoms == 1


def test_driver_that_follows_two_sensors():
    """z = x y: three slides, two of them free; Lagrange's equations of x and y with cross terms."""
    m = fb.Mechanism("product", planar=True)
    mass = {"x": 1.0, "y": 2.0, "z": 1.5}
    for k, name in enumerate(mass):
        m.add(fb.Body(name, mass=mass[name], inertia=0.1, position=(0, k)))
        m.add(fb.Translational(f"s{name}", "ground", name, at=(0, k), axis=(1, 0), displacement=(0.7, -1.1, -0.77)[k]))
    m.add(
        fb.Sensor("u", "sx.displacement"), fb.Sensor("v", "sy.displacement"), fb.Driver("d", "sz.displacement", "u*v")
    )
    m.add(fb.Initial("sx.displacement", value=0.7, rate=1.3), fb.Initial("sy.displacement", value=-1.1, rate=0.4))
    m.add(fb.PointForce("f", "x", force=(2.0, 0)))
    r = m.simulate(1.5, outputs=31, rtol=1e-8)
    (x, dx, ddx), (y, dy, ddy), (z, _, ddz) = (
        (r[f"s{k}"].displacement, r[f"s{k}"].rate, r[f"s{k}"].acceleration) for k in mass
    )
    assert z == pytest.approx(x * y, abs=1e-12)
    assert ddz == pytest.approx(ddx * y + 2 * dx * dy + x * ddy, abs=1e-9)
    assert 1.0 * ddx + 1.5 * ddz * y == pytest.approx(np.full(31, 2.0), abs=1e-9)
    assert 2.0 * ddy + 1.5 * ddz * x == pytest.approx(np.zeros(31), abs=1e-9)
    assert r.health.energy_drift < 1e-7


def test_a_driver_in_place_of_a_cardan_shaft():
    """tan b = cos(beta) tan a: a driver that says so moves like the joint itself, forces and all."""
    beta = 0.6
    out = np.array([np.sin(beta), 0, np.cos(beta)])

    def shafts():
        m = fb.Mechanism("cardan")
        m.add(fb.Body("a", mass=1.0, inertia=(0.05, 0.06, 0.08)), fb.Body("b", mass=1.0, inertia=(0.03, 0.03, 0.05)))
        m.add(fb.Revolute("A", "ground", "a", at=(0, 0, -1), axis=(0, 0, 1)))
        m.add(fb.Revolute("B", "ground", "b", at=tuple(out), axis=tuple(out)))
        m.add(fb.TorsionalSpringDamper("s", joint="B", stiffness=0.1), fb.Motor("m", joint="A", torque=0.4))
        return m

    one, two = shafts(), shafts()
    one.add(fb.Universal("U", "a", "b", at=(0, 0, 0), axes=((1, 0, 0), np.cross(out, (1.0, 0, 0)))))
    two.add(fb.Sensor("a_angle", "A.angle"))
    two.add(fb.Driver("d", "B.angle", f"atan2(sin(a_angle), cos(a_angle)*{float(np.cos(beta))!r})"))
    joint, driver = (
        (x.add(fb.Initial("A.angle", value=0.0, rate=7.0)), x.simulate(1.0, outputs=41, rtol=1e-10, atol=1e-12))[1]
        for x in (one, two)
    )
    for name in ("A", "B"):
        for what in ("angle", "rate", "acceleration"):
            x, y = getattr(joint[name], what), getattr(driver[name], what)
            assert y == pytest.approx(x, abs=1e-6 * (1.0 + np.abs(x).max())), (name, what)
    assert np.ptp(joint["A"].angle) > 2.0 * np.pi


def arm(planar):
    """An arm on a pin with a tip, drawn aside."""
    m = fb.Mechanism("arm", planar=planar, gravity=(0, -G) if planar else (0, -G, 0))
    if planar:
        m.add(fb.Body("b", mass=1.2, inertia=0.05, position=(0.3, 0.1), angle=0.6))
        m.add(fb.Revolute("A", "ground", "b", at=(0, 0)), fb.Frame("tip", "b", position=(0.3, 0.1)))
    else:
        m.add(
            fb.Body("b", mass=1.2, inertia=(0.05, 0.06, 0.08), position=(0.3, 0.1, 0.05), orientation=(0.2, 0.1, 0.4))
        )
        m.add(
            fb.Revolute("A", "ground", "b", at=(0, 0, 0), axis=(0.3, -0.2, 1)),
            fb.Frame("tip", "b", position=(0.3, 0.1, 0.2)),
        )
    m.add(fb.Initial("A.angle", rate=3.0))

    for name, p in (("eye", (0.5, 0.9, 0.2)), ("anchor", (-0.6, 0.4, -0.1))):
        m.add(fb.Frame(name, "ground", position=p[: 2 if planar else 3]))
    return m


SAME = {  # sensors, the force that names them, the force that says the same without
    "angle and rate": (
        {"a": "A.angle", "w": "A.rate"},
        lambda p: fb.Motor("f", joint="A", torque="-4*a - 0.3*w*abs(w)"),
        lambda p: fb.TorsionalSpringDamper("f", joint="A", stiffness=4.0, torque="-0.3*rate*abs(rate)"),
    ),
    "point and its velocity": (
        {"y": "tip.y", "v": "tip.vy"},
        lambda p: fb.PointForce("f", "tip", force=("0", "-50*(y - 0.2) - 2*v", *(() if p else ("0",)))),
        lambda p: fb.CoordinateSpring("f", coordinate="tip.y", stiffness=50.0, damping=2.0, rest=0.2),
    ),
    "length of a spring": (
        {"l": "probe.length", "d": "probe.rate"},
        lambda p: fb.SpringDamper("f", "eye", "tip", force="30*(l - 0.4) + 2*d"),
        lambda p: fb.SpringDamper("f", "eye", "tip", stiffness=30.0, damping=2.0, length=0.4),
    ),
}


@pytest.mark.parametrize("planar", [True, False], ids=["plane", "space"])
@pytest.mark.parametrize("case", SAME)
def test_a_force_by_sensors_is_the_force_by_its_own_inputs(case, planar):
    sensors, by_sensor, plain = SAME[case]
    results = []
    for make in (by_sensor, plain):
        m = arm(planar)
        m.add(fb.SpringDamper("probe", "eye", "tip"))
        m.add(*(fb.Sensor(k, of) for k, of in sensors.items()), make(planar))
        results.append(m.simulate(1.0, outputs=21, rtol=1e-10, atol=1e-12))
    one, two = results
    assert two["b"].position == pytest.approx(one["b"].position, abs=1e-8)
    assert two["A"].acceleration == pytest.approx(one["A"].acceleration, abs=1e-6)
    assert one.health.energy_drift < 1e-6
    for k, of in sensors.items():
        assert (one[k].value == one[of]).all()
        assert (one[f"{k}.value"] == one[of]).all()


@pytest.mark.parametrize("planar", [True, False], ids=["plane", "space"])
def test_an_actuator_by_the_length_of_a_rope(planar):
    """The rope's length is the way over its points, and its rate the rate of that."""
    m = arm(planar)
    m.add(fb.Rope("line", bodies=("eye", "tip", "anchor"), stiffness=1e-9))
    m.add(fb.Sensor("l", "line.length"), fb.Sensor("d", "line.rate"))
    m.add(fb.Actuator("f", coordinate="A.angle", force="-3*(l - 1.5) - 0.4*d"))
    h = 1e-5
    t = np.unique(np.r_[0.0, (np.linspace(0.1, 0.9, 9)[:, None] + (-h, 0.0, h)).ravel()])
    r = m.simulate(1.0, outputs=t, rtol=1e-10, atol=1e-12)
    way = sum(np.linalg.norm(r["tip"].position - r[k].position, axis=1) for k in ("eye", "anchor"))
    assert r["l"].value == pytest.approx(way, abs=1e-12)
    assert r["d"].value[2::3] == pytest.approx((way[3::3] - way[1::3]) / (2 * h), abs=1e-6)
    assert r["f"].force == pytest.approx(-3.0 * (way - 1.5) - 0.4 * r["d"].value, abs=1e-12)
    assert r.health.energy_drift < 1e-6


def test_drag_by_angular_velocities():
    """A torque -c w in the world's axes on a tumbling body: its angular momentum falls at that rate."""
    m = fb.Mechanism("drag")
    m.add(fb.Body("b", mass=1.0, inertia=(0.2, 0.3, 0.4), orientation=(0.3, 0.5, -0.2), angular_velocity=(3, -2, 4)))
    m.add(*(fb.Sensor(f"w{a}", f"b.omega_{a}") for a in "xyz"))
    m.add(fb.PointTorque("drag", "b", torque=("-0.1*wx", "-0.1*wy", "-0.1*wz")))
    r = m.simulate(2.0, outputs=401, rtol=1e-10, atol=1e-12)
    w, R = r["b"].angular_velocity, r["b"].rotation
    L = np.einsum("nij,j,nkj,nk->ni", R, (0.2, 0.3, 0.4), R, w)
    turned = np.cumsum((w[1:] + w[:-1]) / 2 * np.diff(r.t)[:, None], axis=0)
    assert L[1:] - L[0] == pytest.approx(-0.1 * turned, abs=1e-5)
    assert np.linalg.norm(L[-1]) < 0.7 * np.linalg.norm(L[0])
    assert r.health.energy_drift < 1e-8


def test_a_sensed_angle_counts_turns():
    """Wound up by three turns, with a table of the sensor's value for the spring."""
    m = fb.Mechanism("wound")
    m.add(
        fb.Body("b", mass=1.0, inertia=(0.02, 0.03, 0.04)),
        fb.Revolute("A", "ground", "b", at=(0, 0, 0), axis=(1, 2, 2)),
    )
    m.add(fb.Initial("A.angle", value=6.0 * np.pi), fb.Sensor("a", "A.angle"))
    m.add(fb.Table("curve", x=[-20.0, 0.0, 20.0], y=[2.0, 0.0, -2.0], interpolation="linear"))
    m.add(fb.Motor("f", joint="A", torque="curve(a)"))
    J = np.array([1, 2, 2]) / 3.0 @ (np.array([0.02, 0.03, 0.04]) * np.array([1, 2, 2]) / 3.0)
    r = m.simulate(5.0, outputs=26, rtol=1e-8)
    assert r["A"].angle == pytest.approx(6.0 * np.pi * np.cos(np.sqrt(0.1 / J) * r.t), abs=1e-5)


@pytest.mark.parametrize("planar", [True, False], ids=["plane", "space"])
def test_imu(planar):
    """On an arm at a steady speed w: w^2 r towards the axle and gravity's support, in the unit's own turned axes."""
    w, reach = 4.0, 0.6
    m = fb.Mechanism("imu", planar=planar, gravity=(0, -G) if planar else (0, -G, 0))
    m.add(fb.Body("b", mass=1.0, inertia=0.1 if planar else (0.1, 0.2, 0.3)))
    m.add(
        fb.Revolute("A", "ground", "b", at=(0, 0) if planar else (0, 0, 0), **({} if planar else {"axis": (0, 0, 1)}))
    )
    m.add(
        fb.Frame(
            "unit",
            "b",
            position=(reach, 0.0, 0.1)[: 2 if planar else 3],
            **({"angle": 0.5} if planar else {"orientation": (0.4, 0.0, 0.5)}),
        )
    )
    m.add(fb.IMU("imu", "unit"), fb.Driver("d", "A.angle", f"{w}*t"))
    r = m.simulate(1.0, outputs=11)
    c, s, o = np.cos(w * r.t), np.sin(w * r.t), 0 * r.t
    specific = np.stack([-(w**2) * reach * c, -(w**2) * reach * s + G, o], axis=1)
    c5, s5, c4, s4 = np.cos(0.5), np.sin(0.5), np.cos(0.4), np.sin(0.4)
    turn = np.array([[c5, -s5, 0], [s5, c5, 0], [0, 0, 1.0]])
    if not planar:
        turn = np.array([[1, 0, 0], [0, c4, -s4], [0, s4, c4]]) @ turn
    arm_axes = np.stack([np.stack([c, -s, o], 1), np.stack([s, c, o], 1), np.stack([o, o, o + 1], 1)], axis=1)
    shown = np.einsum("ji,nkj,nk->ni", turn, arm_axes, specific)
    gyro = turn.T @ (0, 0, w)
    curves = ("fx", "fy") if planar else ("fx", "fy", "fz")
    for k, name in enumerate(curves):
        assert r[f"imu.{name}"] == pytest.approx(shown[:, k], abs=1e-8)
    for k, name in ((2, "w"),) if planar else enumerate(("wx", "wy", "wz")):
        assert r[f"imu.{name}"] == pytest.approx(np.full(11, gyro[k]), abs=1e-10)
    assert r["imu"].specific_force == pytest.approx(shown, abs=1e-8)


def test_imu_in_free_fall_shows_nothing():
    m = fb.Mechanism("fall", gravity=(1, 2, -9))
    m.add(fb.Body("b", mass=1.0, inertia=(0.1, 0.2, 0.3), angular_velocity=(1, 2, 3)), fb.IMU("imu", "b"))
    r = m.simulate(1.0, outputs=5)
    assert r["imu"].specific_force == pytest.approx(np.zeros((5, 3)), abs=1e-12)
    assert r["imu"].angular_velocity == pytest.approx(np.einsum("nji,nj->ni", r["b"].rotation, r["b"].angular_velocity))


def test_rod_is_a_body_for_sensors_too():
    """A sensor of a reaction is an output: it equals the joint's own curve."""
    m = fb.Mechanism("rod", gravity=(0, 0, -G))
    m.add(rod("r", (0, 0, 0), (1, 0, 0), thickness=1e-2), fb.Revolute("A", "ground", "r", at=(0, 0, 0), axis=(0, 1, 0)))
    m.add(fb.Sensor("load", "A.fz"), fb.Sensor("power", "energy.kinetic"))
    r = m.simulate(0.5, outputs=5)
    assert (r["load"].value == r["A"].force[:, 2]).all()
    assert (r["power"].value == r.energy.kinetic).all()
