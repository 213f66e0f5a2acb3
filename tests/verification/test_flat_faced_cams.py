"""Flat-faced cams: lift, force and contact point of an eccentric disk, an oscillating lever, conjugate pairs."""

import numpy as np
import pytest

import flyball as fb
from tests.layers import both_layers

R, E, W = 0.05, 0.02, 30.0
TURNS = np.linspace(0, 2 * np.pi, 72, endpoint=False)
DISK = [(R * np.cos(a), R * np.sin(a) - E) for a in TURNS]  # lowest as drawn
OVAL = [(0.05 * np.cos(a), 0.04 * np.sin(a)) for a in TURNS]


def tappet(profile=DISK, planar=True, force=200.0, **more):
    z = () if planar else (0,)
    m = fb.Mechanism("tappet", planar=planar)
    inertia = 1e-4 if planar else (1e-4,) * 3
    at = (0, max(p[1] for p in profile), *z)
    m.add(fb.Body("cam", mass=1, inertia=inertia), fb.Body("follower", mass=0.5, inertia=inertia, position=at))
    spin, slide = ({}, {"axis": (0, 1)}) if planar else ({"axis": (0, 0, 1)}, {"axis": (0, 1, 0)})
    guide = fb.Translational if planar else fb.Prismatic
    m.add(fb.Revolute("shaft", "ground", "cam", at=(0, 0, *z), **spin))
    m.add(guide("guide", "ground", "follower", at=at, **slide))
    m.add(fb.FlatFacedCam("face", "cam", "follower", points=profile, at=at, normal=(0, 1, *z), **spin, **more))
    m.add(fb.PointForce("press", "follower", force=(0, -force, *z)), fb.Driver("motor", "shaft.angle", f"{W}*t"))
    return m


@both_layers
@pytest.mark.parametrize("planar", [True, False])
def test_lift_of_an_eccentric_disk(planar):
    """Lift e (1 - cos a); the force is m y'' + press, at the distance e sin(a) from the axis: the motor's torque."""
    r = tappet(planar=planar).simulate(0.4, outputs=21, rtol=1e-8)
    a = W * r.t
    assert r["guide.displacement"] == pytest.approx(E * (1 - np.cos(a)), abs=2e-8)
    force = 200 + 0.5 * E * W**2 * np.cos(a)
    assert r["face.fy"] == pytest.approx(force, rel=1e-4)
    assert r["face.fx"] == pytest.approx(np.zeros(21), abs=1e-9)
    assert r["motor.effort"] == pytest.approx(force * E * np.sin(a), abs=5e-3)
    assert not r.health.warnings


def test_lever():
    """The face passes through the pivot of a lever, so the centre of the disk keeps the distance R from the face."""
    pivot, centre = np.array([0.2, 0.0]), np.array([0.0, -E])
    m = fb.Mechanism("lever", planar=True)
    away = centre - pivot
    along = np.arctan2(away[1], away[0]) - np.arcsin(R / np.hypot(*away))  # direction of the face from the pivot
    normal = (np.sin(along), -np.cos(along))
    m.add(fb.Body("cam", mass=1, inertia=1e-3), fb.Body("lever", mass=0.5, inertia=1e-3, position=(0.2, 0)))
    m.add(fb.Revolute("shaft", "ground", "cam", at=(0, 0)), fb.Revolute("pin", "ground", "lever", at=(0.2, 0)))
    m.add(fb.FlatFacedCam("face", "cam", "lever", points=DISK, at=(0.2, 0), normal=normal))
    m.add(fb.PointTorque("press", "lever", torque=5.0), fb.Driver("motor", "shaft.angle", f"{W}*t"))
    r = m.simulate(0.3, outputs=13, rtol=1e-8)
    c = np.stack([E * np.sin(W * r.t), -E * np.cos(W * r.t)], axis=1) - pivot
    exact = np.arctan2(c[:, 1], c[:, 0]) - np.arcsin(R / np.hypot(*c.T)) - along
    assert r["pin.angle"] == pytest.approx((exact + np.pi) % (2 * np.pi) - np.pi, abs=1e-7)


def test_lost_contact_and_form_closure():
    """Without enough pressure the face would lift off: warned of; a conjugate cam pulls it back, without a warning."""
    loose = tappet(force=5.0).simulate(0.4, outputs=21)
    assert any("face" in w and "pull" in w for w in loose.health.warnings)
    kept = tappet(force=5.0, conjugate=True).simulate(0.4, outputs=21)
    assert not kept.health.warnings
    exact = 5 + 0.5 * E * W**2 * np.cos(W * kept.t)
    assert kept["face.fy"] == pytest.approx(exact, abs=0.02)


def test_conjugate_profile():
    """Two faces at a constant distance touch both cams: the second constraint is fulfilled, and redundant."""
    breadth = 0.12
    pair = tappet(OVAL)
    first = pair["face"]
    second = first.conjugate_points(breadth)
    top = 0.04
    pair.add(fb.FlatFacedCam("other", "cam", "follower", points=second, at=(0, top - breadth), normal=(0, -1)))
    assert pair.mobility().redundancy == 1
    lone, both = (m.kinematics(np.linspace(0, 0.2, 9)) for m in (tappet(OVAL), pair))
    assert both["guide.displacement"] == pytest.approx(lone["guide.displacement"], abs=1e-7)
    yoke = np.array(tappet()["face"].conjugate_points(2 * R))
    assert np.hypot(*(yoke - np.array([0, -E])).T) == pytest.approx(np.full(len(yoke), R), abs=1e-6)
    with pytest.raises(fb.ModelError, match=r"conjugate profile for a breadth .* is concave"):
        first.conjugate_points(0.01)


def test_undercut_is_named():
    radius = 0.05 * (1 + 0.3 * np.cos(2 * TURNS))
    hollow = np.stack([radius * np.cos(TURNS), radius * np.sin(TURNS)], axis=1)
    with pytest.raises(fb.ModelError, match=r"concave near \(.*undercut"):
        tappet(hollow)


def test_static_force_linear_model_and_equations():
    m = tappet(OVAL, force=0.0)
    m.add(fb.CoordinateSpring("spring", "guide.displacement", stiffness=1000.0))
    free = m.changed({"motor": None})
    rest = free.equilibrium()
    assert rest["shaft.angle"] == pytest.approx(0.0, abs=1e-8)
    assert free.modes(about=rest).eigenvalues is not None
    eq = free.symbolic(coordinates="joint")
    assert len(eq.g) == 1
