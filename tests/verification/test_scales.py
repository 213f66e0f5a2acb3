"""What must not matter: units, where the origin is, the order of joints; and what redundancy leaves determined."""

import dataclasses

import numpy as np
import pytest

import flyball as fb
from tests.layers import both_layers
from tests.mechanisms import G, door, four_bar, spatial_four_bar

pytestmark = both_layers


def scaled(base, length=1.0, mass=1.0, shift=None):
    """The same mechanism in other units of length and mass, moved as a whole; joints given by ``at`` only."""
    n = base.assemble().compiled.values

    def point(p, moves=True):
        p = length * np.asarray(p, float)[: 2 if base.planar else 3]
        return tuple((p + shift[: len(p)] if moves and shift is not None else p).tolist())

    m = fb.Mechanism("scaled", planar=base.planar, gravity=point(base.gravity, moves=False))
    for b in base.bodies:
        d, given = n.bodies[b.name], n.numbers[b.name]
        J = mass * length**2 * (d.inertia[2, 2] if base.planar else d.inertia)
        m.add(
            dataclasses.replace(
                b,
                mass=mass * d.mass,
                inertia=J,
                position=point(given.position),
                velocity=None if given.velocity is None else point(given.velocity, moves=False),
            )
        )
    for j in base.joints:
        m.add(dataclasses.replace(j, at=point(n.numbers[j.name].at)))
    m.add(*base.initial)
    return m


def turning_four_bar():
    m = four_bar()
    m.add(fb.Initial("A.angle", rate=5.0))
    return m


UNITS = [(1e3, 1.0), (1e-3, 1.0), (1.0, 1e3), (1e3, 1e3), (1e-3, 1e-3)]  # mm; km; g; mm and g; km and t


@pytest.mark.parametrize(("length", "mass"), UNITS)
@pytest.mark.parametrize("make", [turning_four_bar, spatial_four_bar])
def test_units_change_nothing(make, length, mass):
    """Angles, positions and reactions in other units: the same motion, to what the tolerance leaves (1e-11)."""
    one = scaled(make()).simulate(2.0, rtol=1e-11, atol=1e-13, outputs=21)
    two = scaled(make(), length, mass).simulate(2.0, rtol=1e-11, atol=1e-13, outputs=21)
    force, torque = length * mass, length**2 * mass
    for j in one.model.joints:
        for k, unit in (("force", force), ("torque", torque)):
            a, b = getattr(one[j.name], k), getattr(two[j.name], k) / unit
            assert b == pytest.approx(a, abs=3e-7 * max(1.0, np.abs(a).max())), (j.name, k)
    for b in one.model.bodies:
        assert two[b.name].position / length == pytest.approx(one[b.name].position, abs=3e-8)
    assert two["A"].angle == pytest.approx(one["A"].angle, abs=3e-8)
    assert two.energy.kinetic / torque == pytest.approx(one.energy.kinetic, rel=1e-7, abs=1e-9)
    assert two.health.violation < 1e-12 * length
    assert (two.health.freedoms, two.health.redundant) == (one.health.freedoms, one.health.redundant)


@pytest.mark.parametrize("make", [turning_four_bar, spatial_four_bar])
def test_far_from_the_origin(make):
    """A million metres away: the same motion but for rounding.

    Coordinates are multiples of 2.3e-10 m there, so the joints of parts that are some decimetres long are closed to
    1e-9 rad. Some hundred steps add up to 1e-7 to 2e-6 rad, as the digits happen to fall.
    """
    shift = np.array([1e6, -2e6, 5e5])
    near = scaled(make()).simulate(2.0, outputs=21)
    far = scaled(make(), shift=shift).simulate(2.0, outputs=21)
    assert far["A"].angle == pytest.approx(near["A"].angle, abs=4e-6)
    assert far["A"].rate == pytest.approx(near["A"].rate, abs=4e-5)
    for b in near.model.bodies:
        moved = far[b.name].position - near[b.name].position
        assert moved == pytest.approx(np.tile(shift[: moved.shape[1]], (21, 1)), abs=4e-6)
    for j in near.model.joints:
        force = near[j.name].force
        assert far[j.name].force == pytest.approx(force, abs=1e-5 * np.abs(force).max())
    assert far.health.violation < 5e-9
    assert far.energy.drift < 1e-6


# ------------------------------------------------------------------------------------------------- redundant door

WIDTH, LOW, HIGH = 0.8, 0.2, 1.8
HINGES = ("force x", "force y", "force z", "torque x", "torque y")


def hung(upper, lower, length=1.0, mass=1.0, order=1, inertia=1.0, middle=None):
    """The door, in other units, with its joints in another order, with another inertia, or with a third hinge."""
    base = door(upper, lower)
    if middle is not None:
        base.add(middle("middle", "ground", "leaf", at=(0, 0, 1), axis=(0, 0, 1)))
    s = scaled(base, length, mass)
    m = fb.Mechanism("door", gravity=s.gravity)
    m.add(dataclasses.replace(s["leaf"], inertia=inertia * np.array(s["leaf"].inertia)))
    m.add(*s.joints[::order])
    return m


CHANGES = {
    "as it is": {},
    "mm": {"length": 1e3},
    "t": {"mass": 1e-3},
    "mm and g": {"length": 1e3, "mass": 1e3},
    "other order": {"order": -1},
    "mm, g, other order": {"length": 1e3, "mass": 1e3, "order": -1},
    "heavy to turn": {"inertia": 1e3},
}


@pytest.mark.parametrize("change", CHANGES)
def test_door_on_two_balls_by_statics(change):
    """W b / h sideways, up and down together W; only how they share W is undetermined, and it is flagged."""
    more = CHANGES[change]
    length, mass = more.get("length", 1.0), more.get("mass", 1.0)
    r = hung(fb.Spherical, fb.Spherical, **more).simulate(0.2, outputs=3)
    assert r.health.undetermined == {"upper": ("force z",), "lower": ("force z",)}
    assert (r.health.freedoms, set(r.health.redundant)) == (1, {"upper", "lower"})
    weight = 30 * G
    couple = weight * WIDTH / 2 / (HIGH - LOW)
    up, low = (r[k].force / (mass * length) for k in ("upper", "lower"))
    assert up[:, :2] == pytest.approx(np.tile([-couple, 0], (3, 1)), abs=1e-8)
    assert low[:, :2] == pytest.approx(np.tile([couple, 0], (3, 1)), abs=1e-8)
    assert (up + low)[:, 2] == pytest.approx(np.full(3, weight), abs=1e-8)


@pytest.mark.parametrize("middle", [None, fb.Revolute])
@pytest.mark.parametrize("change", CHANGES)
def test_door_on_hinges_by_statics(change, middle):
    """On two hinges or three every component but the moment about the axis is shared and flagged; their sums are not."""
    more = CHANGES[change]
    length, mass = more.get("length", 1.0), more.get("mass", 1.0)
    r = hung(fb.Revolute, fb.Revolute, middle=middle, **more).simulate(0.2, outputs=3)
    heights = {"upper": HIGH, "lower": LOW} | ({"middle": 1.0} if middle else {})
    assert r.health.undetermined == dict.fromkeys(heights, HINGES)
    assert r.health.freedoms == 1
    force, moment = np.zeros((3, 3)), np.zeros((3, 3))
    for name, z in heights.items():
        f, t = r[name].force / (mass * length), r[name].torque / (mass * length**2)
        assert t[:, 2] == pytest.approx(np.zeros(3), abs=1e-8)
        force, moment = force + f, moment + t + np.cross([0, 0, z], f)
    assert force == pytest.approx(np.tile([0, 0, 30 * G], (3, 1)), abs=1e-8)
    assert moment == pytest.approx(np.tile([0, -30 * G * WIDTH / 2, 0], (3, 1)), abs=1e-8)
    assert r["upper"].angle == pytest.approx(np.zeros(3), abs=1e-12)
