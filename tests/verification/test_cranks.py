"""Crank mechanisms of the examples against their closed forms: slider-crank in space, quick return, straight line, cam."""

import numpy as np
import pytest

from tests.layers import both_layers, cached
from tests.mechanisms import G, example

pytestmark = both_layers

TURN = 2 * np.pi


def test_spatial_slider_crank():
    """|B - C| = 0.3 with the crank's end B = (0, 0.1 - 0.08 sin a, 0.12 + 0.08 cos a) and C = (x, 0, 0)."""
    r = example("spatial_slider_crank.toml").simulate(2.0, rtol=1e-11, atol=1e-13, outputs=201)
    a = TURN * r.t
    p, q = -0.1 * np.sin(a) + 0.12 * np.cos(a), -0.1 * np.cos(a) - 0.12 * np.sin(a)
    x = np.sqrt(0.3**2 - 0.1**2 - 0.12**2 - 0.08**2 - 0.16 * p)
    v = -0.08 * TURN * q / x
    acceleration = (0.08 * TURN**2 * p - v * v) / x
    assert np.ptp(x) > 0.1
    assert r["slider.x"] == pytest.approx(x, abs=1e-13)
    assert r["guide.displacement"] == pytest.approx(x, abs=1e-13)
    assert r["slider.vx"] == pytest.approx(v, abs=1e-12)
    assert r["slider.ax"] == pytest.approx(acceleration, abs=1e-11)
    assert r.health.freedoms == 0


def test_spatial_slider_crank_cross():
    """The second axis of the universal joint's cross is fixed in the slider, the first in the rod, always square."""
    r = example("spatial_slider_crank.toml").simulate(1.0, outputs=41)
    end = np.stack([0 * r.t, 0.1 - 0.08 * np.sin(TURN * r.t), 0.12 + 0.08 * np.cos(TURN * r.t)], axis=1)
    along = r["rod"].rotation @ np.array([2, -1, -2]) / 3
    assert 0.3 * along == pytest.approx(r["slider"].position - end, abs=1e-10)
    first = np.cross(along, (0, 1, 0))  # square to the rod, as drawn, and to the slider's axis y, as the joint asks
    tilt = np.arctan2(first[:, 0], first[:, 2])
    assert r["cross"].angle_2 == pytest.approx(-(tilt - np.pi / 4), abs=1e-9)


CRANK, CENTRES, LEVER, LINK, HEIGHT = 0.15, 0.3, 0.6, 0.3, 0.57


def shaper(a):
    """Lever angle and ram position of the quick return at crank angle a from upright (may be complex)."""
    lever = np.arctan(CRANK * np.sin(a) / (CENTRES + CRANK * np.cos(a)))
    x = -LEVER * np.sin(lever)
    return lever, x - np.sqrt(LINK**2 - (LEVER * np.cos(lever) - HEIGHT) ** 2)


def shaper_energy(a):
    """Energy of motion per squared crank rate, times two, and height times weight; a may be complex."""
    h = 1e-30
    lever, ram = shaper(a + 1j * h)
    rise = LEVER * np.cos(lever) - HEIGHT
    link = np.arcsin(rise / LINK)  # angle of the link over the horizontal
    middle = ram + LINK / 2 * np.cos(link), HEIGHT + rise / 2
    lever1, link1, ram1, x1, y1 = (c.imag / h for c in (lever, link, ram, *middle))
    mass = 3 * CRANK**2 / 2 + 6 * LEVER**2 / 3 * lever1**2 + 12 * ram1**2
    mass += 1.5 * (x1**2 + y1**2 + LINK**2 / 12 * link1**2)
    return mass, G * (6 * LEVER / 2 * np.cos(lever.real) + 1.5 * middle[1].real)


@cached
def quick_return():
    m = example("quick_return.toml")
    return m.simulate(1.0, rtol=1e-11, atol=1e-13, outputs=361)  # one degree a step


def test_quick_return_time_ratio():
    """The ram reverses where the crank is square to the lever, 120 degrees either side of upright: 240 to 120, 2 to 1.

    Textbook: (180 deg + 2 asin(crank / centres)) / (180 deg - 2 asin(crank / centres)).
    """
    r = quick_return()
    alpha = np.degrees(2 * np.arcsin(CRANK / CENTRES))
    assert (180 + alpha) / (180 - alpha) == pytest.approx(2.0)
    v = r["ram.vx"]
    assert abs(v[120]) < 1e-12
    assert abs(v[240]) < 1e-12
    assert (v[:120] < 0).all()
    assert (v[121:240] > 0).all()
    assert (v[241:] < 0).all()


def test_quick_return_positions_and_velocities():
    """Lever: tan = r sin a / (c + r cos a), its rate r (r + c cos a) / (r^2 + c^2 + 2 r c cos a); the ram follows it."""
    r = quick_return()
    a = TURN * r.t
    lever, ram = shaper(a)
    assert r["pivot.angle"] == pytest.approx(lever, abs=1e-12)
    assert r["ram.x"] == pytest.approx(ram, abs=1e-12)
    size = CRANK**2 + CENTRES**2 + 2 * CRANK * CENTRES * np.cos(a)
    assert r["slot.displacement"] == pytest.approx(np.sqrt(size), abs=1e-12)
    assert r["pivot.rate"] == pytest.approx(TURN * CRANK * (CRANK + CENTRES * np.cos(a)) / size, abs=1e-11)
    assert r["ram.vx"] == pytest.approx(TURN * shaper(a + 1e-30j)[1].imag / 1e-30, abs=1e-10)
    assert r["slot.angle"] == pytest.approx(a - lever, abs=1e-11)  # of the pin in the lever


def test_quick_return_motor_torque():
    """The motor gives what the energies gain and the cut takes, at every angle (balance of powers)."""
    r = quick_return()
    h = 1e-4
    for k in range(0, 361, 15):
        a = TURN * r.t[k]
        ((m1, v1), (m0, v0)), v = (shaper_energy(a + d) for d in (h, -h)), r["ram.vx"][k]
        s = np.clip(-v / 0.05, 0, 1)
        force = 2000 * s**3 * (10 - 15 * s + 6 * s * s)
        gain = (TURN**2 * (m1 - m0) / 2 + v1 - v0) / (2 * h)
        assert r["motor.effort"][k] == pytest.approx(gain - force * v / TURN, abs=2e-5)
        assert r["cutting"].force[k] == pytest.approx(-force, abs=1e-6)


def test_peaucellier_draws_a_straight_line():
    """x = (long^2 - short^2) / (2 crank) to rounding, y = x tan(angle / 2), while the crank swings through 140 degrees."""
    r = example("peaucellier.toml").simulate(4.0, rtol=1e-10, atol=1e-12, outputs=401)
    x = (0.5**2 - 0.2**2) / (2 * 0.2)
    a = np.radians(70) * np.sin(np.pi * r.t)
    assert np.ptp(r["pencil.y"]) > 0.7
    assert r["pencil.x"] == pytest.approx(np.full(401, x), abs=1e-14)
    assert r["pencil.y"] == pytest.approx(x * np.tan(a / 2), abs=1e-13)
    assert r["pencil.vx"] == pytest.approx(np.zeros(401), abs=1e-12)
    rate = np.radians(70) * np.pi * np.cos(np.pi * r.t)
    assert r["pencil.vy"] == pytest.approx(x * rate / (2 * np.cos(a / 2) ** 2), abs=1e-12)
    assert r.health.freedoms == 0
    assert r.health.redundant == ()


def eccentric(a):
    """Height of the roller's centre over the shaft, its first and second derivative by the angle."""
    e, both = 0.02, 0.065
    s, c = np.sin(a), np.cos(a)
    root = np.sqrt(both**2 - (e * s) ** 2)
    n = e * e * s * c / root
    return root - e * c, e * s - n, e * c - e * e * (c * c - s * s) / root - n * n / root


def cam(points, outputs=101):
    r = example("cam.py", points=points).simulate(0.4, rtol=1e-10, atol=1e-12, outputs=outputs)
    w = 300 * TURN / 60
    y, y1, y2 = eccentric(w * r.t)
    return r, (y, w * y1, w * w * y2)


def test_cam_follows_the_circle():
    """An eccentric circle under a roller: lift and its derivatives in closed form; the profile is a spline of its points."""
    r, (y, v, a) = cam(360)
    assert r["follower.y"] == pytest.approx(y, abs=2e-11)
    assert r["follower.vy"] == pytest.approx(v, abs=1e-7)
    assert r["follower.ay"] == pytest.approx(a, abs=5e-4 * 20)  # a cubic spline has the curvature to second order only


def test_cam_converges_with_its_points():
    """A cubic spline's error falls with the fourth power of its spacing, its curvature's with the second."""
    errors = []
    for points in (24, 48, 96):
        r, (y, _, a) = cam(points, 401)
        errors.append((np.abs(r["follower.y"] - y).max(), np.abs(r["follower.ay"] - a).max()))
    fall = np.log2(np.array(errors[:-1]) / errors[1:])
    assert fall[:, 0] == pytest.approx([4, 4], abs=0.3)
    assert fall[:, 1] == pytest.approx([2, 2], abs=0.3)


def test_cam_contact_force():
    """The contact carries inertia, weight and spring, along the line of the centres; it always pushes."""
    r, (y, _, a) = cam(360)
    up = 0.3 * (a + G) + 2000 * (0.02 + y - y[0])
    angle = 10 * np.pi * r.t
    slope = 0.02 * np.sin(angle) / (y + 0.02 * np.cos(angle))  # of that line, off the vertical
    force = r["contact"].force
    assert up.min() > 15
    assert force[:, 1] == pytest.approx(up, abs=5e-3)
    assert force[:, 0] == pytest.approx(-up * slope, abs=5e-3)
