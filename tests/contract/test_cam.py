"""Cams: eccentric circles have closed forms, for points and rollers, on cams that stand, move and turn many times."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flyball as fb
from tests.layers import both_layers

pytestmark = both_layers

RADIUS, OFF = 0.1, 0.03
CIRCLE = [(OFF + RADIUS * np.cos(u), RADIUS * np.sin(u)) for u in np.linspace(0, 2 * np.pi, 160, endpoint=False)]
EXACT = 3e-9  # a spline through 160 points of a circle is this near to it [m]


def lifted(angle, roller, offset=0.0, side=1.0):
    """Height of a follower on the y axis at x = offset over an eccentric disk that has turned by an angle."""
    cx, cy = OFF * np.cos(angle), OFF * np.sin(angle)
    return cy + np.sqrt((RADIUS + side * roller) ** 2 - (offset - cx) ** 2)


def eccentric(roller, offset=0.0, speed=8.0, side=1.0):
    """A cam that turns at a steady speed about the origin, and a follower that slides along y."""
    m = fb.Mechanism("cam", planar=True, gravity=(0, -9.81))
    y = lifted(0.0, roller, offset, side)
    m.add(
        fb.Body("cam", mass=1.0, inertia=0.01), fb.Body("follower", mass=0.5, inertia=0.01, position=(offset, y + 0.2))
    )
    m.add(fb.Revolute("axle", "ground", "cam", at=(0, 0)), fb.Driver("motor", "axle.angle", f"{speed}*t"))
    m.add(fb.Translational("guide", "ground", "follower", at=(offset, y), axis=(0, 1)))
    m.add(fb.Cam("touch", "cam", "follower", points=CIRCLE, at=(offset, y), radius=roller))
    return m


@pytest.mark.parametrize(
    ("roller", "offset", "side"), [(0.0, 0.0, 1.0), (0.02, 0.0, 1.0), (0.015, 0.01, 1.0), (0.02, 0.0, -1.0)]
)
def test_eccentric_disk_lifts_its_follower(roller, offset, side):
    """y = e sin + sqrt((R + r)^2 - (x - e cos)^2): position, velocity, acceleration, force; outside and inside."""
    speed = 8.0
    r = eccentric(roller, offset, speed, side).simulate(2.0, outputs=101, rtol=1e-8)
    angle, h = speed * r.t, 1e-3
    y, ahead, behind = (lifted(angle + d, roller, offset, side) for d in (0.0, h, -h))
    start = r["guide"].displacement[0]
    assert start == pytest.approx(0.0, abs=1e-9)
    assert r["guide"].displacement == pytest.approx(y - y[0], abs=10 * EXACT)
    assert r["guide"].rate == pytest.approx(speed * (ahead - behind) / (2 * h), abs=1e-5)
    second = speed**2 * (ahead - 2 * y + behind) / h**2
    assert r["guide"].acceleration == pytest.approx(second, abs=2e-2)
    assert r["touch"].force[:, 1] == pytest.approx(0.5 * (r["guide"].acceleration + 9.81), rel=1e-9)
    # the force is along the common normal, through the disk's centre
    normal = np.column_stack([offset - OFF * np.cos(angle), y - OFF * np.sin(angle)])
    f = r["touch"].force
    sine = (
        (f[:, 0] * normal[:, 1] - f[:, 1] * normal[:, 0]) / np.linalg.norm(f, axis=1) / np.linalg.norm(normal, axis=1)
    )
    assert sine == pytest.approx(np.zeros(101), abs=1e-5)
    assert r.health.energy_drift < 1e-6


def test_many_turns():
    """The place on the profile goes round with the cam, and the follower is where it should be after fifty turns."""
    turns = 50.0
    r = eccentric(0.02, speed=20.0 * np.pi).simulate(turns / 10.0, outputs=51, rtol=1e-6)
    assert r["guide"].displacement == pytest.approx(lifted(20.0 * np.pi * r.t, 0.02) - lifted(0.0, 0.02), abs=1e-7)
    length = 2.0 * np.pi * RADIUS
    assert abs(np.ptp(r["touch.place"])) == pytest.approx(turns * length, rel=1e-3)


def test_cam_carried_about_in_space():
    """Both ends on one moving base: seen from the base the motion is that of a cam at rest with its weight turned off."""
    axis = np.array([1.0, -2.0, 2.0]) / 3.0
    R = Rotation.align_vectors([axis], [[0, 0, 1.0]])[0].as_matrix()
    p = np.array([0.3, -0.2, 0.5])
    y = lifted(0.0, 0.02)
    m = fb.Mechanism("carried")
    m.add(
        fb.Body("base", mass=2.0, inertia=(0.2, 0.3, 0.4), position=p, velocity=(1, 0, 2), angular_velocity=(1, 2, -3))
    )
    m.add(fb.Body("cam", mass=1.0, inertia=(0.01, 0.012, 0.02), position=p, velocity=(1, 0, 2)))
    at = p + R @ (0, y, 0.01)
    m.add(fb.Body("follower", mass=0.5, inertia=(0.01, 0.02, 0.015), position=at + R @ (0, 0.1, 0)))
    m.add(fb.Revolute("axle", "base", "cam", at=p, axis=axis), fb.Driver("motor", "axle.angle", "8*t"))
    m.add(fb.Prismatic("guide", "base", "follower", at=at, axis=R @ (0, 1.0, 0)))
    frame = np.linalg.inv(triad_of(axis)) @ R
    points = [tuple((frame @ (*c, 0.0))[:2]) for c in CIRCLE]
    m.add(fb.Cam("touch", "cam", "follower", points=points, centre=p, axis=axis, at=at, radius=0.02))
    r = m.simulate(1.5, outputs=31)
    assert r["guide"].displacement == pytest.approx(lifted(8.0 * r.t, 0.02) - y, abs=10 * EXACT)
    assert r.health.energy_drift < 1e-6
    assert np.linalg.norm(r["touch"].force @ axis) < 1e6  # it is a number
    for k in range(31):
        n = r["cam"].rotation[k] @ axis
        assert abs(r["touch"].force[k] @ n) < 1e-9 * np.linalg.norm(r["touch"].force[k]) + 1e-9


def triad_of(axis):
    """The axes that a joint given by its axis has."""
    from flyball.model.geometry import triad

    return triad(axis)


def test_open_profile_and_gravity():
    """A bead on a wire y = x^2 / (4 f): its energy tells its speed, at the lowest point it carries m (g + v^2 / r)."""
    f = 0.25
    x = np.linspace(-1.5, 1.5, 121)
    m = fb.Mechanism("bead", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("bead", mass=0.3, inertia=1e-3, position=(-1.0, 1.0 / (4 * f))))
    m.add(
        fb.Cam(
            "wire",
            "ground",
            "bead",
            points=np.column_stack([x, x**2 / (4 * f)]),
            closed=False,
            at=(-1.0, 1.0 / (4 * f)),
        )
    )
    r = m.simulate(2.0, outputs=401)
    px, py = r["bead"].position.T
    assert py == pytest.approx(px**2 / (4 * f), abs=1e-6)
    speed2 = (r["bead"].velocity ** 2).sum(axis=1)
    assert speed2 == pytest.approx(2 * 9.81 * (1.0 / (4 * f) - py), abs=1e-6)
    k = int(np.argmin(py))
    assert np.linalg.norm(r["wire"].force[k]) == pytest.approx(0.3 * (9.81 + speed2[k] / (2 * f)), rel=1e-3)
    assert np.ptp(px) > 1.9


def test_a_follower_drawn_beside_the_profile_is_brought_to_it():
    m = fb.Mechanism("beside", planar=True)
    m.add(fb.Body("point", mass=1.0, inertia=1.0, position=(0.3, 0.05)))
    m.add(fb.Cam("touch", "ground", "point", points=CIRCLE, at=(0.3, 0.05), radius=0.02))
    a = m.assemble()
    assert np.hypot(a.q[0] - OFF, a.q[1]) == pytest.approx(RADIUS + 0.02, abs=1e-7)
    assert a.moved["point"] < 0.2


def beaded(**profile):
    """A bead without weight on the half circle of radius 1 below its ends (-1, 0) and (1, 0), thrown along it at 2 m/s."""
    u = np.linspace(-np.pi, 0, 41)
    m = fb.Mechanism("bead", planar=True)
    m.add(fb.Body("bead", mass=0.3, inertia=1e-3, position=(0, -1), velocity=(2, 0)))
    points = np.column_stack([np.cos(u), np.sin(u)])
    m.add(fb.Cam("wire", "ground", "bead", points=points, at=(0, -1), closed=False, **profile))
    return m


def test_a_profile_that_is_not_closed_has_ends():
    """The motion stops at the end, after a quarter of the circle, and names it; all up to there is kept."""
    with pytest.raises(
        fb.SimulationError, match=r"the follower of Cam 'wire' is at an end of the profile, point 40 at"
    ) as e:
        beaded().simulate(2.0, outputs=21)
    assert e.value.t == pytest.approx(np.pi / 4, rel=1e-5)
    assert "beyond='line'" in str(e.value) and e.value.result.t[-1] == pytest.approx(0.7)
    m = beaded()
    m.add(fb.Driver("drive", "bead.x", "1.25*t"), fb.Driver("still", "bead.angle", "0"))
    with pytest.raises(fb.FlyballError, match=r"at an end of the profile"):
        m.simulate(1.0)


def test_a_profile_goes_straight_on_beyond_its_ends_if_it_says_so():
    r = beaded(beyond="line").simulate(2.0, outputs=21)
    late = r.t > np.pi / 4
    assert r["bead.x"][late] == pytest.approx(np.ones(late.sum()), abs=5e-4)
    assert r["bead.y"][late] == pytest.approx(2 * (r.t[late] - np.pi / 4), abs=1e-4)


def test_ends_of_profiles_are_checked():
    closed = fb.Cam("wire", "ground", "bead", points=CIRCLE, at=(0.13, 0), beyond="line")
    m = fb.Mechanism("m", planar=True)
    m.add(fb.Body("bead", mass=1, inertia=1))
    with pytest.raises(fb.ModelError, match=r"beyond= has no effect on a closed profile"):
        m.add(closed)
    with pytest.raises(
        fb.ModelError, match=r"in the reference configuration its follower is beyond an end of the profile"
    ):
        m.add(fb.Cam("wire", "ground", "bead", points=[(0, 0), (1, 0.1), (2, 0.1), (3, 0)], at=(3.2, 0), closed=False))
