"""Inverse kinematics of frames: closed forms, all solutions of an arm of six joints, stops, singular positions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flyball as fb

UR5 = ((0, 0.089159, np.pi / 2), (-0.425, 0, 0), (-0.39225, 0, 0), (0, 0.10915, np.pi / 2), (0, 0.09465, -np.pi / 2),
       (0, 0.0823, 0))  # fmt: skip
"""a [m], d [m], alpha [rad] of the joints, as the manufacturer gives them (Denavit and Hartenberg)."""


def denavit_hartenberg(q):
    """Poses of all links, (7, 4, 4)."""
    out = [np.eye(4)]
    for (a, d, alpha), x in zip(UR5, q, strict=True):
        c, s, ca, sa = np.cos(x), np.sin(x), np.cos(alpha), np.sin(alpha)
        step = [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
        out.append(out[-1] @ np.array(step))
    return np.array(out)


@pytest.fixture(scope="module")
def ur5():
    m = fb.Mechanism("UR5", gravity=(0, 0, -9.81))
    T = denavit_hartenberg(np.zeros(6))
    for k in range(1, 7):
        R = tuple(map(tuple, T[k, :3, :3]))
        m.add(fb.Body(f"link{k}", mass=1, inertia=(0.1, 0.1, 0.1), position=tuple(T[k, :3, 3]), orientation=R))
        before = f"link{k - 1}" if k > 1 else "ground"
        m.add(fb.Revolute(f"J{k}", before, f"link{k}", at=tuple(T[k - 1, :3, 3]), axis=tuple(T[k - 1, :3, 2])))
    return m


def test_all_eight_solutions(ur5):
    """Of a generic pose; each is checked by the product of the manufacturer's transformations."""
    p = ur5.prepare(coordinates="joint")
    for seed in range(1, 6):
        q = np.random.default_rng(seed).uniform(-1.2, 1.2, 6) + (0, 0, 1.4, 0, 1.3, 0)
        T = denavit_hartenberg(q)[-1]
        found = p.inverse_kinematics("link6", T[:3, 3], T[:3, :3], near=q)
        assert len(found) == 8 and found.freedoms == 0 and not found.singular.any()
        np.testing.assert_allclose(found.q[0], q, atol=1e-8)
        for x in found.q:
            np.testing.assert_allclose(denavit_hartenberg(x)[-1], T, atol=1e-9)
        assert (abs(found.q - q) <= np.pi + 1e-9).all()


def test_two_links():
    """Elbow up and down, by the law of cosines; at the end of the reach both are one, and singular."""
    a, b = 0.5, 0.3
    m = fb.Mechanism("arm", planar=True)
    m.add(fb.Body("A", mass=1, inertia=0.1, position=(a / 2, 0)), fb.Body("B", mass=1, inertia=0.1, position=(a, 0)))
    m.add(fb.Frame("tip", "B", position=(b, 0)))
    m.add(fb.Revolute("J", "ground", "A", at=(0, 0)), fb.Revolute("K", "A", "B", at=(a, 0)))
    p = m.prepare(coordinates="joint")
    x, y = 0.4, 0.35
    elbow = np.arccos((x**2 + y**2 - a**2 - b**2) / (2 * a * b))
    found = p.inverse_kinematics("tip", (x, y))
    wanted = sorted((np.arctan2(y, x) - np.arctan2(b * np.sin(e), a + b * np.cos(e)), e) for e in (elbow, -elbow))
    np.testing.assert_allclose(sorted(map(tuple, found.q)), wanted, atol=1e-9)
    assert "2 configurations" in repr(found)
    end = p.inverse_kinematics("tip", ((a + b) * np.cos(0.3), (a + b) * np.sin(0.3)))
    np.testing.assert_allclose(end.q[0], (0.3, 0.0), atol=1e-4)  # the error is of second order there
    assert end.singular.all() and end.freedoms == 0
    with pytest.raises(fb.NotConverged, match=r"'tip' has this pose, from 100 starts.*misses it by 0.1 m"):
        p.inverse_kinematics("tip", (a + b + 0.1, 0))
    angle = p.inverse_kinematics("B", rotation=1.0)
    assert angle.freedoms == 1
    np.testing.assert_allclose(np.cos(angle.q.sum(axis=1) - 1.0), 1.0, atol=1e-12)
    limited = m.changed({})
    limited.add(fb.Limit("stop", "K.angle", lower=0.0, upper=3.0))
    turned = m.changed({"K": fb.Revolute("K", "A", "B", at=(a, 0), angle=1.0)})  # as drawn its angle is 1
    turned.add(fb.Limit("stop", "K.angle", lower=1.0, upper=4.0))
    (same,) = turned.prepare(coordinates="joint").inverse_kinematics("tip", (x, y)).q
    assert same[1] == pytest.approx(elbow)
    (only,) = limited.prepare(coordinates="joint").inverse_kinematics("tip", (x, y)).q
    assert only[1] == pytest.approx(elbow)


def test_a_free_body():
    m = fb.Mechanism("free")
    m.add(fb.Body("b", mass=1, inertia=(1, 2, 3), position=(1, 0, 0)))
    p = m.prepare(coordinates="joint")
    found = p.inverse_kinematics("b", (0.3, -0.2, 0.1), (0.1, 0.2, 0.3), starts=30)
    assert len(found) == 1 and found.freedoms == 0
    x, R = p.pose("b", found.q[0])
    np.testing.assert_allclose(x, (0.3, -0.2, 0.1), atol=1e-12)
    np.testing.assert_allclose(R, Rotation.from_euler("XYZ", (0.1, 0.2, 0.3)).as_matrix(), atol=1e-12)


def test_a_free_base_with_a_stop():
    """A hand that only points: the stop of its one joint holds beside the quaternion of the base."""
    m = fb.Mechanism("hand")
    m.add(fb.Body("palm", mass=1, inertia=(1, 2, 3)), fb.Body("finger", mass=1, inertia=(1, 1, 1), position=(1, 0, 0)))
    m.add(fb.Revolute("knuckle", "palm", "finger", at=(0.5, 0, 0), axis=(0, 1, 0)))
    m.add(fb.Limit("stop", "knuckle.angle", lower=0.2, upper=0.9))
    p = m.prepare(coordinates="joint")
    found = p.inverse_kinematics("finger", (0.3, 0.4, 0.5), (0.1, 0.2, 0.3), starts=20)
    assert found.freedoms == 1
    assert ((found.q[:, 7] >= 0.2) & (found.q[:, 7] <= 0.9)).all()
    for q in found.q:
        np.testing.assert_allclose(p.pose("finger", q)[0], (0.3, 0.4, 0.5), atol=1e-9)


def test_bad_input(ur5):
    p = ur5.prepare(coordinates="joint")
    for given, match in (
        ({}, "a position, a rotation, or both"),
        ({"position": (1, 0)}, "expected 3 components"),
        ({"position": (np.nan, 0, 0)}, "finite"),
        ({"position": (0, 0, 0), "starts": 0}, "starts is 0"),
        ({"position": (0, 0, 0), "near": np.zeros(5)}, "q has the shape"),
    ):
        with pytest.raises(fb.ModelError, match=match):
            p.inverse_kinematics("link6", **given)
    for given in ({"position": ("300 mm", 0, 0)}, {"position": (0, 0, 0), "seed": -1}):
        with pytest.raises(fb.ModelError):
            p.inverse_kinematics("link6", **given)


def test_closed_loops_stay_closed():
    """A four-bar whose coupler point is given: both assembly modes, from the law of cosines."""
    m = fb.Mechanism("four-bar", planar=True)
    m.add(
        fb.Body("crank", mass=1, inertia=1, position=(0, 0.1)), fb.Body("coupler", mass=1, inertia=1, position=(0, 0.2))
    )
    m.add(fb.Body("rocker", mass=1, inertia=1, position=(0.6, 0)))
    m.add(fb.Revolute("A", "ground", "crank", at=(0, 0)), fb.Revolute("B", "crank", "coupler", at=(0, 0.2)))
    m.add(fb.Revolute("C", "coupler", "rocker", at=(0.5, 0.5)), fb.Revolute("D", "ground", "rocker", at=(0.6, 0)))
    p = m.prepare(coordinates="joint")
    assert p.rows
    x, y = 0.2 * np.sin(0.4), 0.2 * np.cos(0.4)  # the crank's end
    found = p.inverse_kinematics("coupler", (x, y))
    assert len(found) == 2 and found.freedoms == 0
    assert not found.singular.any()
    for q in found.q:
        assert abs(p.constraint(0.0, q)).max() < 1e-9
        np.testing.assert_allclose(p.pose("coupler", q)[0][:2], (x, y), atol=1e-9)


def test_turns_and_stops(ur5):
    """Stops of a whole turn on either side: solutions differ by more than turns, and the nearest comes first."""
    m = ur5.changed({})
    for k in range(1, 7):
        m.add(fb.Limit(f"stop {k}".replace(" ", "_"), f"J{k}.angle", lower=-2 * np.pi, upper=2 * np.pi))
    p = m.prepare(coordinates="joint")
    q = np.random.default_rng(1).uniform(-1.2, 1.2, 6) + (0, 0, 1.4, 0, 1.3, 0)
    T = denavit_hartenberg(q)[-1]
    found = p.inverse_kinematics("link6", T[:3, 3], T[:3, :3], near=q)
    assert len(found) == 8
    np.testing.assert_allclose(found.q[0], q, atol=1e-8)
    assert (abs(found.q) <= 2 * np.pi).all()
