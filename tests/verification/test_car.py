"""The car of four corners: made by hand, statics of its wheel loads, and the quarter car's bounce frequency."""

import itertools

import numpy as np
import pytest

import flyball as fb
from tests.layers import cached
from tests.mechanisms import example

CORNERS = {"front_left": (1.2, 1), "front_right": (1.2, -1), "rear_left": (-1.4, 1), "rear_right": (-1.4, -1)}
G = 9.81


def corner(m: fb.Mechanism, prefix: str, x: float, side: int, height: float, ahead: float) -> None:
    """Add a corner part by part, with the coordinates that it has in the car."""

    def at(p):
        return (x + p[0], side * p[1], p[2])

    def name(k):
        return f"{prefix}.{k}"

    for k, mass, inertia, p, com in (
        ("lower arm", 4.0, (0.06, 0.04, 0.09), (0, 0.35, 0.2), (0, 0.2 * side, -0.01)),
        ("upper arm", 2.0, (0.012, 0.01, 0.02), (0, 0.42, 0.4), (0, 0.13 * side, 0.01)),
        ("upright", 6.0, (0.08, 0.06, 0.04), (0, 0.7, 0.3), (0, 0, 0)),
        ("wheel", 16.0, (0.5, 0.8, 0.5), (0, 0.78, 0.3), (0, 0, 0)),
    ):
        m.add(fb.Body(name(k), mass=mass, inertia=inertia, position=at(p), com=com))
    m.add(fb.Frame(name("hub"), name("upright"), position=(0, 0.08 * side, 0)))
    m.add(fb.Revolute(name("lower pivot"), "chassis", name("lower arm"), at=at((0, 0.35, 0.2)), axis=(side, 0, 0)))
    m.add(fb.Revolute(name("upper pivot"), "chassis", name("upper arm"), at=at((0, 0.42, 0.4)), axis=(1, 0, 0.1)))
    m.add(fb.Spherical(name("lower ball"), name("lower arm"), name("upright"), at=at((0, 0.72, 0.18))))
    m.add(fb.Spherical(name("upper ball"), name("upper arm"), name("upright"), at=at((-0.01, 0.68, 0.42))))
    rod = (at((-0.12, 0.37, 0.24)), at((-0.12, 0.7, 0.23)))
    m.add(fb.Distance(name("tie rod"), "chassis", name("upright"), at=rod))
    m.add(fb.Fixed(name("bearing"), name("upright"), name("wheel"), at=at((0, 0.78, 0.3))))
    ends = (at((0, 0.44, 0.62)), at((0, 0.58, 0.187)))
    m.add(
        fb.SpringDamper(name("strut"), "chassis", name("lower arm"), at=ends, stiffness=4e4, damping=3e3, length=0.58)
    )
    way = f"(10*t - {ahead})"
    road = f"{2e5 * height}*step5({way}, 0, 0, 0.5, 1)*step5({way}, 0.5, 1, 1, 0)"
    m.add(fb.CoordinateSpring(name("tyre"), name("hub.z"), stiffness=2e5, damping=200.0, rest=0.3, force=road))


def by_hand() -> fb.Mechanism:
    m = fb.Mechanism("car", gravity=(0, 0, -G))
    m.add(fb.Body("chassis", mass=1100, inertia=(350, 1500, 1700), position=(0, 0, 0.5)))
    for prefix, (x, side) in CORNERS.items():
        corner(m, prefix, x, side, 0.05 * (side > 0), 2.0 if x > 0 else 4.6)
    m.add(fb.PointOnLine("guide", "ground", "chassis", at=(0, 0, 0.5), axis=(0, 0, 1)))
    pivots = ("front_left.lower pivot.angle", "front_right.lower pivot.angle")
    m.add(fb.CoordinateSpring("anti-roll bar", pivots, weights=(1, -1), stiffness=400))
    m.add(fb.Driver("heading", "chassis.yaw", 0))
    return m


@cached
def resting():
    return example("car.toml").equilibrium()


def test_it_moves_as_the_car_that_is_made_by_hand():
    runs = [m.simulate(0.5, outputs=6, rtol=1e-9, atol=1e-11) for m in (example("car.toml"), by_hand())]
    ends = ("chassis.z", "chassis.roll", "chassis.pitch", "anti-roll bar.force")
    each = ("hub.y", "hub.z", "wheel.x", "lower pivot.angle", "strut.force", "tyre.force", "tie rod.fy")
    for name in (*ends, *(f"{c}.{k}" for c, k in itertools.product(CORNERS, each))):
        one, other = (r[name] for r in runs)
        assert one == pytest.approx(other, rel=1e-6, abs=1e-6 * (1.0 + np.abs(other).max())), name
    assert np.abs(runs[0]["chassis.roll"]).max() > 1e-3  # the bump is on one side


def test_wheel_loads_follow_from_the_weights():
    e, m = resting(), example("car.toml")
    loads = {c: e[f"{c}.tyre.force"] for c in CORNERS}
    weight = {b.name: b.mass * G for b in m.bodies}
    assert sum(loads.values()) == pytest.approx(sum(weight.values()), rel=1e-9)
    at = {c: e[f"{c}.hub.x"] for c in CORNERS}
    moment = weight["chassis"] * e["chassis.x"] + sum(
        weight[b.name] * (e[f"{b.name}.x"] + b.com[0]) for b in m.bodies if b.com is not None
    )
    moment += sum(weight[f"{c}.{k}"] * e[f"{c}.{k}.x"] for c in CORNERS for k in ("upright", "wheel"))
    assert sum(loads[c] * at[c] for c in CORNERS) == pytest.approx(moment, rel=1e-3)
    for front, back in (("front_left", "rear_left"), ("front_right", "rear_right")):
        assert loads[front] == pytest.approx(0.5 * 1100 * G * 1.4 / 2.6 + 28 * G, rel=0.01)
        assert loads[back] == pytest.approx(0.5 * 1100 * G * 1.2 / 2.6 + 28 * G, rel=0.01)


def test_bounce_frequency_is_that_of_a_quarter_car():
    """Tyre and wheel rate in series carry a quarter of the chassis; the wheel rate is the strut's times its ratio squared."""
    m = fb.Mechanism("even", gravity=(0, 0, -G))
    m.add(fb.Body("chassis", mass=1100, inertia=(350, 1500, 1700), position=(0, 0, 0.5)))
    for prefix, (x, side) in {k: (np.sign(x) * 1.3, s) for k, (x, s) in CORNERS.items()}.items():
        corner(m, prefix, x, side, 0.0, 2.0)
    m.add(fb.Prismatic("guide", "ground", "chassis", at=(0, 0, 0.5), axis=(0, 0, 1)))
    e = m.equilibrium()
    rig = m.changed({f"{c}.tyre": None for c in CORNERS})
    for c in CORNERS:
        rig.add(fb.Driver(f"{c}.rig", f"{c}.hub.z", f"{e['front_left.hub.z']} + 0.01*t"))
    rig.add(fb.Driver("held", "guide.displacement", e["guide.displacement"]))
    r = rig.kinematics([-0.1, 0.1])
    ratio = np.diff(r["front_left.strut.length"])[0] / np.diff(r["front_left.hub.z"])[0]
    wheel = 4e4 * ratio**2
    quarter = 1.0 / (1.0 / wheel + 1.0 / 2e5) / 275.0
    modes = m.modes(about=e)
    slowest = min(x for x in np.abs(modes.eigenvalues.imag) if x > 1.0)
    assert slowest == pytest.approx(np.sqrt(quarter), rel=0.05)
