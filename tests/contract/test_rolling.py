"""Wheels, balls and blades that roll and glide: closed forms of mechanics without slip."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flyball as fb
from tests.layers import both_layers

pytestmark = both_layers

G = 9.81


def disk(lean, rate, spin, m=2.0, R=0.3, tread=0.0, A=0.03, C=0.05, circle=None):
    """A disk that leans by ``lean`` from upright, precesses at ``rate`` and spins at ``spin`` about its own axle.

    With the plane z = 0: the axle is tilted about the direction of travel (y), the lowest point towards +x.
    """
    m_ = fb.Mechanism("disk", gravity=(0, 0, -G))
    up = np.array([np.sin(lean), 0, np.cos(lean)])  # from the contact to the centre, less the tread's radius
    axle = np.array([np.cos(lean), 0, -np.sin(lean)])
    centre = R * up + (0, 0, tread)
    w = rate * np.array([0, 0, 1.0]) + spin * axle
    arm = -centre
    v = -np.cross(w, arm)
    turn = Rotation.from_matrix(np.column_stack([up, np.cross(axle, up), axle]))
    m_.add(
        fb.Body(
            "disk",
            mass=m,
            inertia=(A, A, C),
            position=tuple(centre),
            orientation=turn,
            velocity=tuple(v),
            angular_velocity=tuple(w),
        )
    )
    m_.add(fb.RollingDisk("roll", "ground", "disk", at=tuple(centre), axis=tuple(axle), radius=R, tread=tread))
    return m_


@pytest.mark.parametrize("tread", [0.0, 0.04])
def test_disk_rolls_steadily_on_a_circle(tread):
    """Steady precession: the moment of gravity and of the circle's force about the centre is the rate of the spin.

    With lean a, precession W about the vertical and spin s about the axle, contact at rho = -R up - r z from the
    centre: v = -w x rho, dv/dt = W z x v, and rho x (m (dv/dt - g)) = d/dt (C w_a a + A w_u u + A w_t t)
    (any text on the rolling disk, as Routh, *Advanced Rigid Dynamics*, article 244); solved here for s.
    """
    m, R, A, C, lean, W = 2.0, 0.3, 0.03, 0.05, -0.35, 1.7
    up, axle = np.array([np.sin(lean), 0, np.cos(lean)]), np.array([np.cos(lean), 0, -np.sin(lean)])
    z = np.array([0, 0, 1.0])
    rho = -R * up - tread * z

    def imbalance(s):
        w = W * z + s * axle
        a = np.cross(W * z, -np.cross(w, rho))
        L = A * w + (C - A) * (w @ axle) * axle
        return (np.cross(W * z, L) - np.cross(rho, m * (a + G * z)))[1]

    s0, s1 = imbalance(0.0), imbalance(1.0)
    spin = -s0 / (s1 - s0)
    r = disk(lean, W, spin, m, R, tread, A, C).simulate(3.0, outputs=61, rtol=1e-11, atol=1e-13)
    turned = Rotation.from_rotvec(np.outer(W * r.t, z)).as_matrix()
    assert r["disk"].position[:, 2] == pytest.approx(np.full(61, r["disk"].position[0, 2]), abs=1e-8)
    w = turned @ (W * z + spin * axle)
    assert r["disk"].angular_velocity == pytest.approx(w, abs=1e-6)
    velocity = turned @ -np.cross(W * z + spin * axle, rho)
    assert r["disk"].velocity == pytest.approx(velocity, abs=1e-6)
    force = m * (np.cross(W * z, velocity) + G * z)
    assert r["roll"].force == pytest.approx(force, abs=1e-5)
    assert r["roll"].torque == pytest.approx(np.cross(turned @ rho, force), abs=1e-5), "about the disk's centre"
    assert r.health.energy_drift < 1e-9


@pytest.mark.parametrize("slope", [0.0, 0.2])
def test_ball_rolls_down_a_slope(slope):
    """a = 5/7 g sin(slope), the grip 2/7 m g sin(slope); across the slope it goes on as it began, spinning as it did."""
    n = np.array([np.sin(slope), 0, np.cos(slope)])
    down = np.array([np.cos(slope), 0, -np.sin(slope)])
    m, R = 1.5, 0.1
    J = 0.4 * m * R**2
    mech = fb.Mechanism("ball", gravity=(0, 0, -G))
    w = np.cross(n, (0, 0.8, 0)) / R + 4.0 * n
    ball = fb.Body("ball", mass=m, inertia=(J, J, J), position=R * n, velocity=(0, 0.8, 0), angular_velocity=w)
    mech.add(ball, fb.RollingBall("roll", "ground", "ball", at=R * n, radius=R, normal=n))
    r = mech.simulate(2.0, outputs=21, rtol=1e-11, atol=1e-13)
    a = 5.0 / 7.0 * G * np.sin(slope)
    way = 0.5 * a * r.t[:, None] ** 2 * down + 0.8 * r.t[:, None] * np.array([0, 1.0, 0])
    assert r["ball"].position - R * n == pytest.approx(way, abs=1e-7)
    assert r["ball"].angular_velocity @ n == pytest.approx(np.full(21, 4.0), abs=1e-8)
    force = m * a * down - m * np.array([0, 0, -G])
    assert r["roll"].force == pytest.approx(np.tile(force, (21, 1)), abs=1e-8)
    assert r["roll"].torque == pytest.approx(np.tile(np.cross(-R * n, force), (21, 1)), abs=1e-9)


@pytest.mark.parametrize("normal", [(0, 0, 1), (0.3, -0.4, 0.8)])
def test_ball_on_a_turntable(normal):
    """A ball without gravity circles at 2/7 of the turntable's speed, wherever it began."""
    n = np.array(normal) / np.linalg.norm(normal)
    W, m, R = 3.0, 0.7, 0.05
    J = 0.4 * m * R**2
    x = np.cross(n, (1.0, 0, 0))
    p = 0.4 * x / np.linalg.norm(x)
    v = np.array([0.2, -0.1, 0.3])
    v = v - (v @ n) * n
    mech = fb.Mechanism("turntable")
    mech.add(fb.Body("table", mass=5.0, inertia=(1, 1, 1), angular_velocity=W * n))
    # no slip: v + w x (-R n) = W n x p
    w = np.cross(n, v - np.cross(W * n, p)) / R
    mech.add(fb.Body("ball", mass=m, inertia=(J, J, J), position=p + R * n, velocity=v, angular_velocity=w))
    mech.add(fb.Revolute("axle", "ground", "table", at=(0, 0, 0), axis=n), fb.Driver("motor", "axle.angle", f"{W}*t"))
    mech.add(fb.RollingBall("roll", "table", "ball", at=p + R * n, radius=R, normal=n))
    r = mech.simulate(4.0, outputs=81, rtol=1e-10, atol=1e-12)
    turn = Rotation.from_rotvec(np.outer(2.0 / 7.0 * W * r.t, n)).as_matrix()
    middle = p + np.cross(n, v) / (2.0 / 7.0 * W)
    assert r["ball"].velocity == pytest.approx(turn @ v, abs=1e-7)
    assert r["ball"].position - R * n == pytest.approx(middle + turn @ (p - middle), abs=1e-7)
    assert r.health.energy_drift < 1e-8


def test_disk_rolls_upright_down_a_slope():
    """Straight down: a = g sin / (1 + C / (m R^2)); it neither turns nor leans, and the grip turns it."""
    slope, m, R, C = 0.25, 2.0, 0.3, 0.07
    n, down = np.array([np.sin(slope), 0, np.cos(slope)]), np.array([np.cos(slope), 0, -np.sin(slope)])
    mech = fb.Mechanism("disk", gravity=(0, 0, -G))
    axes = Rotation.from_matrix(np.column_stack([down, -n, (0, 1.0, 0)]))
    mech.add(fb.Body("disk", mass=m, inertia=(0.04, 0.04, C), position=R * n, orientation=axes))
    mech.add(fb.RollingDisk("roll", "ground", "disk", at=R * n, axis=(0, 1, 0), radius=R, normal=n))
    r = mech.simulate(1.5, outputs=16, rtol=1e-11, atol=1e-13)
    a = G * np.sin(slope) / (1.0 + C / (m * R**2))
    assert r["disk"].position - R * n == pytest.approx(0.5 * a * np.outer(r.t**2, down), abs=1e-8)
    assert r["disk"].angular_velocity == pytest.approx(np.outer(a * r.t / R, (0, 1, 0)), abs=1e-8)
    assert r["roll"].torque == pytest.approx(np.tile((0, C * a / R, 0), (16, 1)), abs=1e-8)
    assert r["roll"].force == pytest.approx(np.tile(m * a * down + m * G * np.array([0, 0, 1]), (16, 1)), abs=1e-7)


@pytest.mark.parametrize("planar", [False, True], ids=["space", "plane"])
def test_skate_on_a_slope(planar):
    """A spinning skate on a slope goes to and fro across it, never down on average (Bloch, 2003, section 1.6).

    With the edge turning at the steady rate W from straight down: x = g sin(slope) / (2 W^2) sin^2(W t) down the
    slope, y = g sin(slope) / (2 W^2) (W t - sin(2 W t) / 2) across.
    """
    slope, W, m = 0.3, 2.5, 1.3
    g = G * np.sin(slope)
    mech = fb.Mechanism("skate", planar=planar, gravity=(g, 0) if planar else (g, 0, -G * np.cos(slope)))
    if planar:
        mech.add(fb.Body("skate", mass=m, inertia=0.1, angular_velocity=W))
        mech.add(fb.KnifeEdge("edge", "ground", "skate", at=(0, 0), axis=(1, 0)))
    else:
        mech.add(fb.Body("skate", mass=m, inertia=(0.05, 0.08, 0.1), angular_velocity=(0, 0, W)))
        mech.add(fb.KnifeEdge("edge", "ground", "skate", at=(0, 0, 0), axis=(1, 0, 0)))
        mech.add(fb.Planar("ice", "ground", "skate", at=(0, 0, 0), axis=(0, 0, 1)))
    r = mech.simulate(5.0, outputs=51, rtol=1e-10, atol=1e-12)
    x = g / (2 * W**2) * np.sin(W * r.t) ** 2
    y = g / (2 * W**2) * (W * r.t - np.sin(2 * W * r.t) / 2)
    assert r["skate"].position[:, :2] == pytest.approx(np.column_stack([x, y]), abs=1e-8)
    along = np.column_stack([np.cos(W * r.t), np.sin(W * r.t)])
    assert (r["edge"].force[:, :2] * along).sum(axis=1) == pytest.approx(np.zeros(51), abs=1e-9)
    across = np.column_stack([-along[:, 1], along[:, 0]])
    side = m * (W * g / W * np.sin(W * r.t) + g * np.sin(W * r.t))  # m v W, and gravity's part across the edge
    assert (r["edge"].force[:, :2] * across).sum(axis=1) == pytest.approx(side, abs=1e-7)


def test_wheel_carries_a_moving_plane():
    """A disk on a plate that it rolls on, nothing else outside: the plate goes the other way, momentum is kept."""
    m, M, R, C = 1.0, 3.0, 0.2, 0.02
    mech = fb.Mechanism("plate", gravity=(0, 0, -G))
    mech.add(fb.Body("plate", mass=M, inertia=(1, 1, 1)))
    mech.add(fb.Prismatic("rail", "ground", "plate", at=(0, 0, 0), axis=(1, 0, 0)))
    axes = Rotation.from_euler("x", -90, degrees=True)
    mech.add(fb.Body("disk", mass=m, inertia=(0.012, 0.012, C), position=(0, 0, R), orientation=axes))
    mech.add(fb.RollingDisk("roll", "plate", "disk", at=(0, 0, R), axis=(0, 1, 0), radius=R))
    mech.add(fb.PointTorque("drive", "disk", torque=(0, 0.5, 0)))
    r = mech.simulate(1.0, outputs=11)
    # disk: m a = H, C alpha = T - H R; plate: M b = -H; no slip: a - R alpha = b
    H = 0.5 * R / C / (1.0 / m + 1.0 / M + R**2 / C)
    assert r["disk"].acceleration[:, 0] == pytest.approx(np.full(11, H / m), rel=1e-9)
    assert r["plate"].acceleration[:, 0] == pytest.approx(np.full(11, -H / M), rel=1e-9)
    assert r["roll"].force[:, 0] == pytest.approx(np.full(11, H), rel=1e-9)
    assert m * r["disk"].velocity[:, 0] + M * r["plate"].velocity[:, 0] == pytest.approx(np.zeros(11), abs=1e-9)
