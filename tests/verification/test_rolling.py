"""Rolling without slip and knife edges against closed forms."""

import numpy as np
import pytest

import flyball as fb
from tests.layers import both_layers
from tests.mechanisms import G, example

pytestmark = both_layers


def test_disk_rolls_round_its_circle():
    """Steady motion of a thin uniform disk; rate from moment of momentum about the centre (see the example's head).

    The reaction is weight and centripetal force at the lowest point, and nothing else.
    """
    r = example("rolling_disk.toml").simulate(10.0, rtol=1e-11, atol=1e-13, outputs=201)
    R, circle, lean, m = 0.5, 1.5, np.radians(20), 2.0
    A, C = m * R**2 / 4, m * R**2 / 2
    rate = np.sqrt(m * G * R * np.sin(lean) / (np.cos(lean) * (A * np.sin(lean) + (C + m * R**2) * circle / R)))
    a = rate * r.t
    out = np.stack([np.cos(a), np.sin(a), 0 * a], axis=1)
    ahead = np.stack([-np.sin(a), np.cos(a), 0 * a], axis=1)
    up = np.array([0.0, 0.0, 1.0])
    assert a[-1] > 2 * np.pi
    assert r["disk"].position == pytest.approx(circle * out + R * np.cos(lean) * up, abs=1e-10)
    assert r["disk"].velocity == pytest.approx(circle * rate * ahead, abs=1e-10)
    assert r["disk"].rotation[:, :, 2] == pytest.approx(np.cos(lean) * out + np.sin(lean) * up, abs=1e-10)
    assert r["contact"].force == pytest.approx(m * G * up - m * rate**2 * circle * out, abs=1e-8)
    assert r.energy.drift < 1e-10


def upright(speed: float, moment: float, lean: float = 1e-5) -> fb.Mechanism:
    """A disk or hoop (C = moment m R^2) of R = 0.5 m that rolls straight along x, a little off upright."""
    R, m = 0.5, 1.0
    C = moment * m * R * R
    w = fb.Mechanism("upright", gravity=(0, 0, -G))
    at = (0, R * np.sin(lean), R * np.cos(lean))
    axle = np.array([0, np.cos(lean), -np.sin(lean)])
    w.add(
        fb.Body(
            "disk",
            mass=m,
            inertia=(C / 2, C / 2, C),
            position=at,
            orientation=np.array([(0, np.sin(lean), np.cos(lean)), (1, 0, 0), axle]).T,
            velocity=(speed, 0, 0),
            angular_velocity=speed / R * axle,
        )
    )
    w.add(fb.RollingDisk("floor", "ground", "disk", at=at, axis=axle, radius=R))
    return w


@pytest.mark.parametrize(("moment", "threshold"), [(0.5, G * 0.5 / 3), (1.0, G * 0.5 / 4)])
@pytest.mark.parametrize("factor", [0.95, 1.05])
def test_upright_wheel_is_stable_above_its_speed(moment, threshold, factor):
    """Uniform disk: stable iff v^2 > g R / 3; hoop: iff v^2 > g R / 4 (Routh; any text on rigid dynamics).

    Linearised, s the lean and h the heading: A h'' = C v s' / R and (A + m R^2) s'' = m g R s - (C + m R^2) v h' / R,
    here from a lean without any rate.
    """
    R, m = 0.5, 1.0
    A, C = moment * m * R * R / 2, moment * m * R * R
    v = np.sqrt(factor * threshold)
    r = upright(v, moment).simulate(3.0, rtol=1e-11, atol=1e-14, outputs=301)
    lean = np.arcsin(-r["disk"].rotation[:, 2, 2])
    falls, steers = m * G * R / (A + m * R * R), (C + m * R * R) * C * v * v / (A * R * R) / (A + m * R * R)
    growth = falls - steers
    assert (growth > 0) == (factor < 1)
    expected = 1e-5 * (falls * np.cosh(np.emath.sqrt(growth) * r.t).real - steers) / growth
    assert lean == pytest.approx(expected, rel=1e-5, abs=1e-10)


@pytest.mark.parametrize(("speed", "reels"), [(1.25, True), (1.31, False)])
def test_upright_disk_bracketed(speed, reels):
    """A uniform disk of R = 0.5 m: threshold 1.278671185254 m/s; nudged by 1e-6 rad it reels below and not above."""
    assert np.sqrt(G * 0.5 / 3) == pytest.approx(1.278671185254, abs=1e-12)
    r = upright(speed, 0.5, lean=1e-6).simulate(20.0, outputs=401)
    lean = np.abs(np.arcsin(r["disk"].rotation[:, 2, 2]))
    assert lean.max() > 0.2 if reels else lean.max() < 1e-4


@pytest.mark.parametrize(
    ("name", "acceleration", "friction"),
    [
        ("ball", 3.503571428571, 0.164957219768),
        ("cylinder", 3.27, 0.192450089730),
        ("hoop", 2.4525, 0.288675134595),
    ],
)
def test_rolling_down_thirty_degrees(name, acceleration, friction):
    """a = g sin(30 deg) / (1 + k) with k = 2/5, 1/2, 1; friction needed tan(30 deg) k / (1 + k)."""
    r = example("rolling_race.toml").simulate(1.2, rtol=1e-10, atol=1e-12)
    down = np.array([np.cos(np.pi / 6), 0, -0.5])
    way = (r[name].position - r[name].position[0]) @ down
    assert way == pytest.approx(acceleration * r.t**2 / 2, abs=1e-8)
    assert r[name].acceleration @ down == pytest.approx(np.full(len(r.t), acceleration), abs=1e-8)
    force, torque = r[f"{name} rolls"].reaction(axes="joint")
    along = np.hypot(force[:, 0], force[:, 1])
    assert (force[:, 2] > 0).all()
    assert along / force[:, 2] == pytest.approx(np.full(len(r.t), friction), abs=1e-8)


def sleigh(t_end, **options):
    return example("chaplygin_sleigh.toml").simulate(t_end, rtol=1e-12, atol=1e-14, **options)


def test_chaplygin_sleigh():
    """v = V tanh(l t), omega = W / cosh(l t): V = 1.469693845670 m/s, l = 0.544331053952 1/s for W = 2 rad/s."""
    V, rate, W = 1.469693845670, 0.544331053952, 2.0
    assert pytest.approx(W * np.sqrt(0.5 + 0.2**2), abs=1e-12) == V
    assert pytest.approx(0.2 * V / (0.5 + 0.2**2), abs=1e-12) == rate
    r = sleigh(10.0)
    heading = np.stack([np.cos(r["sleigh.angle"]), np.sin(r["sleigh.angle"])], axis=1)
    v = (r["sleigh"].velocity * heading).sum(axis=1)
    across = r["sleigh"].velocity[:, 1] * heading[:, 0] - r["sleigh"].velocity[:, 0] * heading[:, 1]
    assert v == pytest.approx(V * np.tanh(rate * r.t), abs=1e-10)
    assert across == pytest.approx(0 * v, abs=1e-13)
    assert r["sleigh.omega"] == pytest.approx(W / np.cosh(rate * r.t), abs=1e-10)
    assert r["sleigh.angle"] == pytest.approx(2 * W / rate * np.arctan(np.tanh(rate * r.t / 2)), abs=1e-10)
    assert r.energy.drift < 1e-11
    force = (r["skate"].force * np.stack([-heading[:, 1], heading[:, 0]], axis=1)).sum(axis=1)
    # what turns the centre of mass: m (v omega + a omegadot)
    omega = W / np.cosh(rate * r.t)
    assert force == pytest.approx(omega * V * np.tanh(rate * r.t) * (1 - 0.2 * rate / V), abs=1e-10)


def test_chaplygin_sleigh_ends_on_a_straight_line():
    """Its heading tends to pi W / (2 l) = 5.771474235728 rad."""
    r = sleigh(60.0, outputs=11)
    assert r["sleigh.angle"][-1] == pytest.approx(5.771474235728, abs=1e-8)
    assert r["sleigh.omega"][-1] == pytest.approx(0.0, abs=1e-10)


def bicycle(speed):
    """The benchmark bicycle of Meijaard, Papadopoulos, Ruina and Schwab (Proc. R. Soc. A 463, 2007), z upwards."""
    tilt, base, trail = np.pi / 10, 1.02, 0.08
    m = fb.Mechanism("bicycle", gravity=(0, 0, -9.81))
    m.add(fb.Body("rear", mass=2, inertia=(0.0603, 0.12, 0.0603), position=(0, 0, 0.3)))
    frame = ((9.2, 0, -2.4), (0, 11, 0), (-2.4, 0, 2.8))
    m.add(fb.Body("frame", mass=85, inertia=frame, position=(0.3, 0, 0.9)))
    fork = ((0.05892, 0, 0.00756), (0, 0.06, 0), (0.00756, 0, 0.00708))
    m.add(fb.Body("fork", mass=4, inertia=fork, position=(0.9, 0, 0.7), velocity=(speed, 0, 0)))
    m.add(fb.Body("front", mass=3, inertia=(0.1405, 0.28, 0.1405), position=(base, 0, 0.35)))
    m.add(fb.Revolute("rear hub", "frame", "rear", at=(0, 0, 0.3), axis=(0, 1, 0)))
    m.add(fb.Revolute("head", "frame", "fork", at=(base + trail, 0, 0), axis=(-np.sin(tilt), 0, np.cos(tilt))))
    m.add(fb.Revolute("front hub", "fork", "front", at=(base, 0, 0.35), axis=(0, 1, 0)))
    m.add(fb.RollingDisk("rear rolls", "ground", "rear", at=(0, 0, 0.3), axis=(0, 1, 0), radius=0.3))
    m.add(fb.RollingDisk("front rolls", "ground", "front", at=(base, 0, 0.35), axis=(0, 1, 0), radius=0.35))
    return m


def test_a_bicycle_rides_straight_on():
    """Weave, castering and capsize at 5 m/s, by the published digits of the benchmark."""
    m = bicycle(5.0)
    e = m.equilibrium(turning=["frame.x", "rear hub.angle", "front hub.angle"])
    assert e.speeds == pytest.approx({"frame.x": 5.0, "rear hub.angle": 5 / 0.3, "front hub.angle": 5 / 0.35})
    found = m.linearize(about=e).eigenvalues
    for published in (-0.77534188219585 + 4.46486771378823j, -14.0783896927982, -0.32286642900409):
        assert np.abs(found - published).min() < 1e-6, published


def test_what_a_steady_motion_cannot_fulfil_is_named():
    """Wheels that turn while all else stands still slip: not a force of 1e-13 N is in the way, but a joint."""
    with pytest.raises(
        fb.NotConverged, match=r"RollingDisk '\w+ rolls' is not fulfilled .*rolls along, too \(one of frame\.x"
    ):
        bicycle(5.0).equilibrium(turning=["rear hub.angle"])
