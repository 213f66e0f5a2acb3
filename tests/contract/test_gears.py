"""Gear pairs: ratio and sense from the bodies themselves, however the joints are written down; planetary trains."""

from itertools import product

import numpy as np
import pytest

import flyball as fb
from tests.layers import both_layers

pytestmark = both_layers

AXIS = np.array([1.0, 2.0, -2.0]) / 3.0
TEETH = (17, 13)
VARIANTS = list(product((False, True), repeat=4))


def wheel(name, position, inertia=(0.03, 0.04, 0.06)):
    return fb.Body(
        name, mass=1.0, inertia=inertia, position=position, orientation=(0.1, 0.5, -0.3), com=(0.01, 0, 0.02)
    )


def geared(internal, flipped, swapped, moving, planar=False):
    """Two gears on a carrier (ground, or an arm that turns about a third axis), the second joint written otherwise."""
    m = fb.Mechanism("gears", planar=planar)
    n = {} if planar else {"axis": tuple(AXIS)}
    points = [(0.0, 0.0), (0.4, 0.1), (-0.3, 0.2)] if planar else [(0, 0, 0), (0.4, -0.3, -0.1), (0.1, -0.4, 0.2)]
    if planar:
        m.add(*(fb.Body(k, mass=1.0, inertia=0.05, position=p) for k, p in zip("ABC", points, strict=True)))
    else:
        m.add(*(wheel(k, p) for k, p in zip("ABC", points, strict=True)))
    m.add(fb.Revolute("arm", "ground", "C", at=points[2], **n))
    carrier = "C" if moving else "ground"
    m.add(fb.Revolute("a", carrier, "A", at=points[0], **n))
    other = {} if planar else {"axis": tuple(-AXIS if flipped else AXIS)}
    ends = ("B", carrier) if swapped else (carrier, "B")
    m.add(fb.Revolute("b", *ends, at=points[1], angle=0.7, **other))
    m.add(fb.GearPair("mesh", joint_1="a", joint_2="b", teeth=TEETH, internal=internal))
    m.add(fb.Initial("a.angle", rate=9.0), fb.Initial("arm.angle", rate=-2.0))
    m.add(fb.Motor("m", joint="a", torque="0.3*cos(5*t)"), fb.TorsionalSpringDamper("s", joint="arm", stiffness=5.0))
    return m


def spin(result, name, axis):
    w = result[name].angular_velocity
    return w if w.ndim == 1 else w @ axis


@pytest.mark.parametrize(("internal", "flipped", "swapped", "moving"), VARIANTS)
@pytest.mark.parametrize("planar", [False, True], ids=["space", "plane"])
def test_ratio_and_sense(internal, flipped, swapped, moving, planar):
    """External gears turn against one another as seen from their carrier, a ring with its pinion, in the ratio z1/z2."""
    r = geared(internal, flipped, swapped, moving, planar).simulate(1.5, outputs=31, rtol=1e-8)
    own = [spin(r, k, AXIS) - (spin(r, "C", AXIS) if moving else 0.0) for k in "AB"]
    ratio = TEETH[0] / TEETH[1] * (1.0 if internal else -1.0)
    assert np.ptp(own[0]) > 0.05
    assert own[1] == pytest.approx(ratio * own[0], abs=1e-9)
    assert r.health.energy_drift < 1e-7
    assert r.health.violation < 1e-12
    assert r.health.freedoms == 2


@pytest.mark.parametrize("planar", [False, True], ids=["space", "plane"])
def test_torque_through_the_mesh(planar):
    """(J1 + J2 (z1/z2)^2) alpha_1 = T on a fixed carrier; the mesh's effort is what turns the second gear."""
    m = geared(False, True, True, False, planar)
    r = m.simulate(1.0, outputs=11)
    torque = 0.3 * np.cos(5.0 * r.t)
    J = []
    for k, p in zip("AB", ("a", "b"), strict=True):
        b = r.values.bodies[k]
        I = b.R @ b.inertia @ b.R.T
        arm = b.c - r.values.poses.ends(m[p])[0][0]
        n = np.array([0.0, 0.0, 1.0]) if planar else AXIS
        J.append(n @ I @ n + b.mass * (arm @ arm - (n @ arm) ** 2))
    ratio = TEETH[0] / TEETH[1]
    alpha = torque / (J[0] + J[1] * ratio**2)
    assert r["a"].acceleration == pytest.approx(alpha, rel=1e-9)
    sign = 1.0 if planar else -1.0  # of the second joint's coordinate: in space its axis is turned round as well
    mesh = r["mesh"].effort("b.angle")
    assert mesh == pytest.approx(J[1] * r["b"].acceleration, rel=1e-9)
    assert r["b"].acceleration == pytest.approx(sign * ratio * alpha, rel=1e-9)
    assert r["mesh"].effort("a.angle") == pytest.approx(J[0] * alpha - torque, rel=1e-9)


def test_phase_holds_over_a_thousand_turns_and_a_restart():
    """17 teeth on 13, in space: after a thousand turns, gone on with midway, the teeth still stand where they should."""
    m = fb.Mechanism("clock")
    m.add(wheel("A", (0, 0, 0)), wheel("B", (0.4, -0.3, -0.1)))
    m.add(fb.Revolute("a", "ground", "A", at=(0, 0, 0), axis=AXIS))
    m.add(fb.Revolute("b", "B", "ground", at=(0.4, -0.3, -0.1), axis=AXIS, angle=1.0))
    m.add(fb.GearPair("mesh", joint_1="a", joint_2="b", teeth=TEETH))
    m.add(fb.Initial("a.angle", rate=2.0 * np.pi * 100.0))
    half = m.simulate(5.0, outputs=3, rtol=1e-6)
    r = m.simulate(10.0, outputs=3, start=half, rtol=1e-6)
    first, second = r["a"].angle[-1], r["b"].angle[-1]
    assert first == pytest.approx(2000.0 * np.pi, rel=1e-4)
    assert 17.0 * first - 13.0 * (second - 1.0) == pytest.approx(0.0, abs=1e-6)
    for k, angle in (("A", first), ("B", -(second - 1.0))):
        turned = r[k].rotation[-1] @ half[k].rotation[0].T
        c, s = np.cos(angle), np.sin(angle)
        cross = np.array([[0, -AXIS[2], AXIS[1]], [AXIS[2], 0, -AXIS[0]], [-AXIS[1], AXIS[0], 0]])
        assert turned == pytest.approx(c * np.eye(3) + s * cross + (1 - c) * np.outer(AXIS, AXIS), abs=1e-6)


def test_planetary_gear_set():
    """Willis: with the ring held (w_sun - w_arm) / (w_ring - w_arm) = -z_ring / z_sun, planet and all."""
    sun, planet = 20, 16
    ring = sun + 2 * planet
    m = fb.Mechanism("planetary", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("sun", mass=1.0, inertia=0.01), fb.Body("arm", mass=0.5, inertia=0.02))
    m.add(fb.Body("planet", mass=0.4, inertia=0.004, position=(0.36, 0)))
    m.add(fb.Revolute("ring", "ground", "arm", at=(0, 0)), fb.Revolute("inner", "arm", "sun", at=(0, 0)))
    m.add(fb.Revolute("outer", "planet", "arm", at=(0.36, 0)))
    m.add(fb.GearPair("g1", joint_1="inner", joint_2="outer", teeth=(sun, planet)))
    m.add(fb.GearPair("g2", joint_1="outer", joint_2="ring", teeth=(planet, ring), internal=True))
    m.add(fb.Driver("motor", "sun.angle", "30*t + 5*t**2"))
    r = m.simulate(4.0, outputs=41)
    w = {k: r[k].angular_velocity for k in ("sun", "arm", "planet")}
    assert w["sun"] == pytest.approx(30.0 + 10.0 * r.t, rel=1e-9)
    assert w["arm"] == pytest.approx(w["sun"] * sun / (sun + ring), rel=1e-9)
    assert (w["sun"] - w["arm"]) == pytest.approx(-ring / sun * (0.0 - w["arm"]), rel=1e-9)
    assert (w["planet"] - w["arm"]) == pytest.approx(-sun / planet * (w["sun"] - w["arm"]), rel=1e-9)
    assert r["arm"].angle == pytest.approx((30.0 * r.t + 5.0 * r.t**2) * sun / (sun + ring), abs=1e-7)
    assert r.health.energy_drift < 1e-5
    assert r.health.freedoms == 0


def test_gears_in_slots_know_their_axis():
    """In the plane all axes point out of it, also those of pins whose slots point against one another."""
    m = fb.Mechanism("pins", planar=True)
    m.add(
        fb.Body("A", mass=1.0, inertia=0.1, angular_velocity=2.0), fb.Body("B", mass=1.0, inertia=0.1, position=(1, 0))
    )
    m.add(
        fb.PinInSlot("a", "ground", "A", at=(0, 0), axis=(1, 0)),
        fb.PinInSlot("b", "ground", "B", at=(1, 0), axis=(-1, 0)),
    )
    m.add(fb.GearPair("mesh", joint_1="a", joint_2="b", teeth=(10, 20)))
    r = m.simulate(1.0, outputs=3)
    assert r["B"].angular_velocity == pytest.approx(-0.5 * r["A"].angular_velocity, rel=1e-12)
