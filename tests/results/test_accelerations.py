"""Accelerations that miss the constraints are told; those that are only rounding, of what is balanced, are not."""

import numpy as np
import pytest

import flyball as fb
from flyball.results.diagnostics import MAX_ACCELERATION_VIOLATION
from flyball.results.motion_record import record_motion
from tests.layers import both_layers
from tests.mechanisms import example
from tests.robust.families import made

pytestmark = both_layers
G = 9.81


def beam(planar=True, gravity=G):
    """A beam at rest on two hinges: what they carry along it is undetermined."""
    down = (0, -gravity) if planar else (0, 0, -gravity)
    m = fb.Mechanism("beam", planar=planar, gravity=down)
    m.add(
        fb.Body("b", mass=3, inertia=0.1 if planar else (0.1, 0.1, 0.1), position=(0.5, 0) if planar else (0.5, 0, 0))
    )
    for name, x in (("A", 0), ("B", 1)):
        at, axis = ((x, 0), None) if planar else ((0.5, x, 0), (0, 1, 0))
        m.add(fb.Revolute(name, "ground", "b", at=at, axis=axis))
    return m


def lift(stages=4):
    """A scissor lift that stands: every crossing a hinge, one foot on a rail, a prop between the feet."""
    m = fb.Mechanism("lift", planar=True, gravity=(0, -G))
    for k in range(stages):
        y = 0.5 * k
        m.add(fb.Body(f"l{k}", mass=1, inertia=0.1, position=(0.5, y + 0.25), angle=np.arctan2(0.5, 1)))
        m.add(fb.Body(f"r{k}", mass=1, inertia=0.1, position=(0.5, y + 0.25), angle=-np.arctan2(0.5, 1)))
        m.add(fb.Revolute(f"X{k}", f"l{k}", f"r{k}", at=(0.5, y + 0.25)))
        if k:
            m.add(
                fb.Revolute(f"P{k}", f"l{k - 1}", f"r{k}", at=(1, y)),
                fb.Revolute(f"Q{k}", f"r{k - 1}", f"l{k}", at=(0, y)),
            )
    m.add(fb.Revolute("foot", "ground", "l0", at=(0, 0)), fb.PinInSlot("rail", "ground", "r0", at=(1, 0), axis=(1, 0)))
    m.add(fb.Distance("prop", "ground", "r0", at=((0, 0), (1, 0))))
    return m


def train():
    """A planetary train without gravity in steady motion: no force, no acceleration but towards the middle."""
    m = fb.Mechanism("train", planar=True)
    m.add(
        fb.Body("sun", mass=1, inertia=0.01, angular_velocity=12), fb.Body("arm", mass=1, inertia=0.02, position=(0, 0))
    )
    m.add(
        fb.Body("planet", mass=1, inertia=0.01, position=(0.3, 0)),
        fb.Body("other", mass=1, inertia=0.01, position=(-0.3, 0)),
    )
    m.add(fb.Revolute("S", "ground", "sun", at=(0, 0)), fb.Revolute("C", "ground", "arm", at=(0, 0)))
    for name, x in (("planet", 0.3), ("other", -0.3)):
        m.add(fb.Revolute(f"P {name}", "arm", name, at=(x, 0)))
        m.add(fb.Coupler(f"mesh {name}", ("S.angle", f"P {name}.angle", "C.angle"), weights=(0.1, 0.2, -0.1)))
        m.add(fb.Coupler(f"ring {name}", (f"P {name}.angle", "C.angle"), weights=(0.2, 0.5)))
    return m


@pytest.mark.parametrize(
    "make",
    [beam, lambda: beam(planar=False), lambda: beam(gravity=0), lift, train, lambda: example("toggle_press.toml"),
     lambda: example("car_axis.toml"), lambda: example("planetary.py"), lambda: example("bricard.toml")],
    ids=["beam", "beam in space", "beam without gravity", "lift", "train", "toggle press", "car axis", "planetary", "Bricard"],
)  # fmt: skip
def test_rounding_is_no_reason_for_a_warning(make):
    r = make().simulate(0.2, outputs=5)
    assert r.health.acceleration_violation < 1e-3 * MAX_ACCELERATION_VIOLATION
    assert not any("accelerations" in w for w in r.health.warnings)


def test_redundant_mechanisms_are_not_suspected():
    """Two thirds of them once were."""
    looked = 0
    for seed in range(16):
        case = made("redundant", seed)
        try:
            r = case.mechanism.simulate(0.1, outputs=5, max_steps=1000)
        except fb.FlyballError:
            continue
        assert r.health.acceleration_violation < MAX_ACCELERATION_VIOLATION, f"redundant {seed}"
        looked += 1
    assert looked >= 8


def line():
    """Two rods in line between two pivots, their joint moving across: to first order that is allowed, not to second."""
    m = fb.Mechanism("line", planar=True)
    m.add(fb.Body("a", mass=1, inertia=0.1, position=(0.5, 0), angular_velocity=1))
    m.add(fb.Body("b", mass=1, inertia=0.1, position=(1.5, 0)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=(1, 0)))
    m.add(fb.Revolute("C", "ground", "b", at=(2, 0)))
    return m


@pytest.mark.parametrize("stabilization", ["none", "baumgarte"])
def test_accelerations_that_cannot_be_are_told(stabilization):
    """gamma = 2 of 2: no force along the rods turns them."""
    r = line().simulate(1e-3, outputs=3, stabilization=stabilization)
    assert r.health.acceleration_violation > 0.1
    assert any("accelerations violate the constraints" in w for w in r.health.warnings)


@pytest.mark.parametrize("make", [beam, lambda: example("slider_crank.toml")])
@pytest.mark.parametrize("part", [1e-4, 1e-2])
def test_accelerations_that_were_spoilt_are_told(make, part):
    """By a part of those that would be there without the constraints."""
    r = make().simulate(0.1, outputs=3)
    r.vdot[:, 0] += part * G
    r.record = record_motion(r)
    assert r.health.acceleration_violation > 0.05 * part
    assert any("accelerations violate the constraints" in w for w in r.health.warnings)


def _flat_arch(rise):
    """Two bars of weight 10 N, hinged at both ends and between: each end bears H = 10 N * 0.25 / rise."""
    m = fb.Mechanism("arch", planar=True, gravity=(0, -10))
    for name, x in (("a", 0.25), ("b", 0.75)):
        m.add(fb.Body(name, mass=1, inertia=0.01, position=(x, rise / 2)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=(0.5, rise)))
    m.add(fb.Revolute("C", "ground", "b", at=(1, 0)))
    return m


@pytest.mark.parametrize("specialize", [False, True])
@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
@pytest.mark.parametrize(
    ("rise", "rel"), [(1e-1, 1e-13), (1e-2, 1e-11), (1e-3, 1e-9), (1e-4, 1e-7), (3e-5, 1e-6), (1e-5, 1e-4)]
)
def test_the_thrust_of_a_flat_arch(rise, rel, coordinates, specialize):
    """At rest, where all accelerations are zero but for rounding; rounding grows with the fourth power of 1 / rise."""
    m = _flat_arch(rise)
    r = m.simulate(0.1, outputs=3, coordinates=coordinates, specialize=specialize)
    assert r["A"].force[:, 0] == pytest.approx(2.5 / rise, rel=rel)
    if rise > 2e-5:
        assert not r.health.warnings
    assert m.equilibrium()["A"].force[0, 0] == pytest.approx(2.5 / rise, rel=1e-9)


@pytest.mark.parametrize("rise", [5e-6, 3e-6, 2e-6])
@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
def test_a_thrust_that_is_wrong_is_doubted(rise, coordinates):
    r = _flat_arch(rise).simulate(0.1, outputs=3, coordinates=coordinates)
    assert abs(r["A"].force[0, 0] - 2.5 / rise) > 0.4 * 2.5 / rise
    assert any("accelerations violate the constraints" in w for w in r.health.warnings)
