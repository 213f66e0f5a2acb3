"""Mechanisms on driven bases: Coriolis and centrifugal effects, efforts of drivers, and the energy that they put in."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import flyball as fb
from tests.layers import both_layers
from tests.mechanisms import G

pytestmark = both_layers


def turntable(law, planar=True, mass=2.0):
    """A slider 0.3 m from the centre of a turntable, free to slide out along a radius; the table is driven."""
    m = fb.Mechanism("turntable", planar=planar, gravity=None if planar else (0, 0, -G))
    point = (lambda *p: p) if planar else (lambda *p: (*p, 0.0))
    normal = {} if planar else {"axis": (0, 0, 1)}
    m.add(fb.Body("table", mass=5.0, inertia=0.4 if planar else (0.2, 0.2, 0.4)))
    m.add(fb.Body("slider", mass=mass, inertia=0.01 if planar else (0.01, 0.02, 0.01), position=point(0.3, 0.0)))
    m.add(fb.Revolute("bearing", "ground", "table", at=point(0.0, 0.0), **normal))
    slide = fb.Translational if planar else fb.Prismatic
    m.add(slide("slot", "table", "slider", at=point(0.0, 0.0), axis=point(1.0, 0.0), displacement=0.3))
    m.add(fb.Driver("motor", "bearing.angle", law), fb.Initial("slot.displacement", rate=0.0))
    return m


@pytest.mark.parametrize("planar", [True, False])
def test_slider_on_a_turntable(planar):
    """r'' = w^2 r: r = r0 cosh w t; the slot bears the Coriolis force 2 m w r', the motor its moment (closed form)."""
    w, m, r0 = 3.0, 2.0, 0.3
    r = turntable("3*t", planar).simulate(1.0, rtol=1e-12, atol=1e-13, outputs=51)
    ch, sh = np.cosh(w * r.t), np.sinh(w * r.t)
    c, s = np.cos(w * r.t), np.sin(w * r.t)
    radius, speed = r0 * ch, r0 * w * sh
    assert r["slot"].displacement == pytest.approx(radius, abs=1e-9)
    assert r["slot"].rate == pytest.approx(speed, abs=1e-9)
    assert r["slot"].acceleration == pytest.approx(w * w * radius, abs=1e-8)
    assert r["slider"].position[:, :2] == pytest.approx(np.column_stack([radius * c, radius * s]), abs=1e-9)
    across = 2 * m * w * speed
    assert r["slot"].force[:, :2] == pytest.approx(np.column_stack([-across * s, across * c]), abs=1e-7)
    if not planar:
        assert r["slot"].force[:, 2] == pytest.approx(np.full(51, m * G), abs=1e-8)
    assert r["motor"].effort == pytest.approx(across * radius, abs=1e-7)
    work = m * w * w * r0 * r0 * sh**2  # half into the radial speed, half into the circumferential
    assert r["motor"].work == pytest.approx(work, abs=1e-8)
    assert r.energy.kinetic - r.energy.kinetic[0] == pytest.approx(work, abs=1e-8)
    assert r.health.energy_drift < 1e-8


@pytest.mark.parametrize("planar", [True, False])
def test_slider_on_a_turntable_that_swings(planar):
    """A table driven by 2 sin 3t: r'' = phi'^2 r by itself; the slot bears m (r phi'' + 2 r' phi')."""
    r = turntable("2*sin(3*t)", planar).simulate(2.0, rtol=1e-12, atol=1e-13, outputs=51)
    phi, phi1, phi2 = 2 * np.sin(3 * r.t), 6 * np.cos(3 * r.t), -18 * np.sin(3 * r.t)
    alone = solve_ivp(
        lambda t, y: (y[1], 36 * np.cos(3 * t) ** 2 * y[0]), (0, 2), (0.3, 0), "DOP853", r.t, rtol=1e-13, atol=1e-13
    )
    radius, speed = alone.y
    size = radius[-1]
    assert size > 10.0
    assert r["bearing"].angle == pytest.approx(phi, abs=1e-11)
    assert r["slot"].displacement == pytest.approx(radius, abs=1e-9 * size)
    across = 2.0 * (radius * phi2 + 2 * speed * phi1)
    e = np.column_stack([-np.sin(phi), np.cos(phi)])
    assert (r["slot"].force[:, :2] * e).sum(axis=1) == pytest.approx(across, rel=1e-8, abs=1e-6)
    rotors = (0.4 + 0.01) * phi2
    assert r["motor"].effort == pytest.approx(rotors + radius * across, rel=1e-8, abs=1e-6)
    assert r.health.energy_drift < 1e-8 * r.energy.kinetic.max()


def shaken_pendulum(kind):
    """A pendulum whose pivot is shaken sideways: by a driven slide, or by a driver of the carriage's coordinate."""
    m = fb.Mechanism("shaken pendulum", planar=True, gravity=(0, -G))
    m.add(fb.Body("carriage", mass=3.0, inertia=0.2))
    m.add(fb.Body("rod", mass=1.5, inertia=0.08, position=(0, -0.4)))
    m.add(fb.Translational("rail", "ground", "carriage", at=(0, 0), axis=(1, 0)))
    m.add(fb.Revolute("pivot", "carriage", "rod", at=(0, 0)), fb.Initial("pivot.angle", rate=2.0))
    m.add(fb.Driver("shaker", {"joint": "rail.displacement", "point": "carriage.x"}[kind], "0.2*sin(5*t)"))
    return m


@pytest.mark.parametrize("kind", ["joint", "point"])
def test_pendulum_on_a_shaken_pivot(kind):
    """(J + m l^2) theta'' = -m l (g sin theta + x'' cos theta), integrated by itself; shaker's force and work."""
    m, l, J, M = 1.5, 0.4, 0.08, 3.0
    r = shaken_pendulum(kind).simulate(3.0, rtol=1e-12, atol=1e-13, outputs=61)
    v, a = np.cos(5 * r.t), -5 * np.sin(5 * r.t)

    def second(t, theta):
        return -m * l * (G * np.sin(theta) - 5 * np.sin(5 * t) * np.cos(theta)) / (J + m * l * l)

    alone = solve_ivp(
        lambda t, y: (y[1], second(t, y[0]), (M + m) * -5 * np.sin(5 * t) * np.cos(5 * t)
                      + m * l * np.cos(5 * t) * (second(t, y[0]) * np.cos(y[0]) - y[1] ** 2 * np.sin(y[0]))),
        (0, 3), (0, 2.0, 0), "DOP853", r.t, rtol=1e-13, atol=1e-14,
    )  # fmt: skip
    theta, rate, work = alone.y
    assert np.ptp(theta) > 1.0
    assert r["pivot"].angle == pytest.approx(theta, abs=1e-9)
    assert r["pivot"].rate == pytest.approx(rate, abs=1e-9)
    sideways = m * (a + l * (second(r.t, theta) * np.cos(theta) - rate**2 * np.sin(theta)))
    assert r["pivot"].force[:, 0] == pytest.approx(sideways, abs=1e-7)
    assert r["shaker"].effort == pytest.approx(M * a + sideways, abs=1e-7)
    assert r["shaker"].work == pytest.approx(work, abs=1e-8)
    gained = 0.5 * (M + m) * v**2 + m * l * rate * v * np.cos(theta) + 0.5 * (J + m * l * l) * rate**2
    gained += m * G * l * (1 - np.cos(theta))
    assert r.energy.total - r.energy.total[0] == pytest.approx(gained - gained[0], abs=1e-8)
    assert r["shaker"].work == pytest.approx(gained - gained[0], abs=1e-8)
    assert r.health.energy_drift < 1e-8


TILTED = np.array([1.0, -2.0, 2.0]) / 3
CENTRE = np.array([0.5, 0.0, 0.2])
PRINCIPAL = np.array([0.11, 0.23, 0.3])  # three different moments, along the drawn axes of the rotor turned by SKEW
SKEW = Rotation.from_rotvec([0.4, -0.3, 0.7])


def gyroscope():
    """A rotor driven by sin(t) about a tilted axis that rides on a mast, which is driven by t + t^2/4."""
    m = fb.Mechanism("driven gyroscope", gravity=(0, 0, -G))
    m.add(fb.Body("mast", mass=4.0, inertia=(0.5, 0.6, 0.3), position=(0.1, 0.05, 0)))
    m.add(fb.Body("rotor", mass=2.0, inertia=tuple(PRINCIPAL), inertia_axes=SKEW, position=(0.6, 0.1, 0.25)))
    m.add(fb.Revolute("bearing", "ground", "mast", at=(0, 0, 0), axis=(0, 0, 1)))
    m.add(fb.Revolute("tilted", "mast", "rotor", at=CENTRE, axis=TILTED))
    m.add(fb.Driver("turn", "bearing.angle", "t + t**2/4"), fb.Driver("swing", "tilted.angle", "sin(t)"))
    return m


def pose(t):
    """Exact rotation matrix and mass centre of the rotor, and those of the mast; t may be complex."""

    def turn(axis, s, c):
        K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
        return np.eye(3) + s * K + (1 - c) * K @ K

    a, b = t + t * t / 4, np.sin(t)
    mast = turn(np.array([0, 0, 1.0]), np.sin(a), np.cos(a))
    rotor = mast @ turn(TILTED, np.sin(b), np.cos(b))
    return rotor, mast @ CENTRE + rotor @ (np.array([0.6, 0.1, 0.25]) - CENTRE), mast, mast @ np.array([0.1, 0.05, 0])


def velocities(t):
    """Angular velocity of the rotor and the mass centres' velocities by complex steps of the exact pose."""
    e = 1e-30
    R, p, Q, c = pose(t + 1j * e)
    W = (R.imag / e) @ R.real.T
    return np.array([W[2, 1], W[0, 2], W[1, 0]]), p.imag / e, c.imag / e


def momenta(t):
    """Angular momentum of the rotor about its mass centre, and its linear momentum; of the mast about the z axis."""
    w, v, u = velocities(t)
    R, _, _, c = pose(t)
    axes = R @ SKEW.as_matrix()
    mast = 0.3 * (1 + t / 2) + 4.0 * np.cross(c, u)[2]
    return axes @ (PRINCIPAL * (axes.T @ w)), 2.0 * v, mast


def slope(f, t, h=1e-3):
    """Derivative by central differences of sixth order."""
    return sum(k * (f(t + j * h) - f(t - j * h)) for j, k in ((1, 45), (2, -9), (3, 1))) / (60 * h)


def test_driven_about_a_tilted_axis_that_moves():
    """Pose, rates and accelerations are those of the laws; efforts and reactions are the rates of the momenta."""
    r = gyroscope().simulate(3.0, rtol=1e-12, atol=1e-13, outputs=31)
    rotor = r["rotor"]
    for k, t in enumerate(r.t):
        R, p, _, _ = pose(t)
        w, v, _ = velocities(t)
        assert rotor.rotation[k] == pytest.approx(R, abs=1e-11)
        assert rotor.position[k] == pytest.approx(p, abs=1e-11)
        assert rotor.angular_velocity[k] == pytest.approx(w, abs=1e-11)
        assert rotor.velocity[k] == pytest.approx(v, abs=1e-11)
        assert rotor.angular_acceleration[k] == pytest.approx(slope(lambda x: velocities(x)[0], t), abs=1e-9)
        assert rotor.acceleration[k] == pytest.approx(slope(lambda x: velocities(x)[1], t), abs=1e-9)
    assert r["tilted"].acceleration == pytest.approx(-np.sin(r.t), abs=1e-10)
    assert r["bearing"].acceleration == pytest.approx(np.full(31, 0.5), abs=1e-10)
    for k, t in enumerate(r.t):
        spin, push, mast = (slope(lambda x, i=i: momenta(x)[i], t) for i in range(3))
        force = push - 2.0 * np.array([0, 0, -G])
        Q = pose(t)[2]
        arm = rotor.position[k] - Q @ CENTRE
        moment = spin + np.cross(arm, force)  # about the hinge: what mast and motor together exert on the rotor
        axis = Q @ TILTED
        assert r["tilted"].force[k] == pytest.approx(force, abs=1e-8)
        assert r["swing"].effort[k] == pytest.approx(moment @ axis, abs=1e-8)
        assert r["tilted"].torque[k] == pytest.approx(moment - axis * (moment @ axis), abs=1e-8)
        passed_on = moment + np.cross(Q @ CENTRE, force)
        assert r["turn"].effort[k] == pytest.approx(mast + passed_on[2], abs=1e-8)
    assert r.health.freedoms == 0
    assert r.health.energy_drift < 1e-8


def test_pendulum_in_a_driven_frame_about_a_tilted_axis():
    """Free about a tilted axis on a mast that turns by sin 2t: Kane's equation of the one freedom, integrated by itself.

    It is linear in b'', so two evaluations of the moment about the axis, at b'' = 0 and 1, give b''.
    """
    m = fb.Mechanism("free gyroscope", gravity=(0, 0, -G))
    for e in gyroscope().elements():
        if e.name not in ("turn", "swing"):
            m.add(e)
    m.add(fb.Driver("turn", "bearing.angle", "sin(2*t)"), fb.Initial("tilted.angle", rate=1.0))
    r = m.simulate(2.0, rtol=1e-12, atol=1e-13, outputs=21)

    def turn(axis, x):
        return Rotation.from_rotvec(x * np.asarray(axis)).as_matrix()

    def motion(t, b, b1, b2):
        """Velocities' rates for given angle, rate and acceleration: w', v' and the present axis and arm."""
        a1, a2 = 2 * np.cos(2 * t), -4 * np.sin(2 * t)
        Q = turn((0, 0, 1), np.sin(2 * t))
        R = Q @ turn(TILTED, b)
        n, z = Q @ TILTED, np.array([0, 0, 1.0])
        arm, hinge = R @ (np.array([0.6, 0.1, 0.25]) - CENTRE), Q @ CENTRE
        w = a1 * z + b1 * n
        al = a2 * z + b2 * n + b1 * np.cross(a1 * z, n)
        acc = np.cross(a2 * z, hinge) + np.cross(a1 * z, np.cross(a1 * z, hinge))
        acc = acc + np.cross(al, arm) + np.cross(w, np.cross(w, arm))
        axes = R @ SKEW.as_matrix()
        J = axes @ np.diag(PRINCIPAL) @ axes.T
        spin = J @ al + np.cross(w, J @ w)
        return n @ (spin + np.cross(arm, 2.0 * (acc + np.array([0, 0, G]))))

    def rates(t, y):
        at_zero = motion(t, *y, 0.0)
        return y[1], -at_zero / (motion(t, *y, 1.0) - at_zero)

    alone = solve_ivp(rates, (0, 2), (0, 1.0), "DOP853", r.t, rtol=1e-12, atol=1e-13)
    assert np.ptp(alone.y[0]) > 1.0
    assert r["tilted"].angle == pytest.approx(alone.y[0], abs=1e-8)
    assert r["tilted"].rate == pytest.approx(alone.y[1], abs=1e-8)
    assert r.health.energy_drift < 1e-8
