"""Inertias in motion: the accelerations that closed forms ask for, from inertias described in every way.

The body has three different moments and a mass centre off its reference point, so that a wrong sign, a transposed
rotation or a forgotten term of the parallel axis theorem shows.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flyball as fb
from tests.layers import both_layers

pytestmark = both_layers

MASS = 7.0
MOMENTS = np.array([0.9, 1.4, 2.1])
TURN = Rotation.from_rotvec((0.5, -0.9, 0.4))  # principal axes in the reference frame
COM = np.array([0.3, -0.2, 0.5])
ABOUT = np.array([-0.4, 0.6, 0.1])
REFERENCE = Rotation.from_rotvec((-0.3, 0.2, 1.0))  # the reference frame in the world
R = TURN.as_matrix()
J = R @ np.diag(MOMENTS) @ R.T  # about the mass centre, in the reference frame


def moved(inertia: np.ndarray, d: np.ndarray) -> np.ndarray:
    """To a point at d from the mass centre, by Steiner's theorem in components."""
    x, y, z = d
    return inertia + MASS * np.array(
        [[y * y + z * z, -x * y, -x * z], [-x * y, x * x + z * z, -y * z], [-x * z, -y * z, x * x + y * y]]
    )


def box() -> fb.Box:
    """The box with these moments: its edges are a_i^2 = 6 (sum of moments - 2 moment) / mass."""
    edges = np.sqrt(6 * (MOMENTS.sum() - 2 * MOMENTS) / MASS)
    return fb.Box(edges=edges, position=COM, orientation=TURN)


def corners() -> fb.Mesh:
    """The same box as a mesh."""
    v = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 2 * box().edges
    f = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4)]
    return fb.Mesh(vertices=v @ R.T + COM, faces=[*f, (1, 5, 7), (1, 7, 3)])


WAYS = {
    "matrix": {"mass": MASS, "com": COM, "inertia": J},
    "matrix about a point": {"mass": MASS, "com": COM, "inertia": moved(J, ABOUT - COM), "inertia_about": ABOUT},
    "moments in turned axes": {"mass": MASS, "com": COM, "inertia": MOMENTS, "inertia_axes": TURN},
    "about a point in turned axes": {
        "mass": MASS,
        "com": COM,
        "inertia": R.T @ moved(J, ABOUT - COM) @ R,
        "inertia_about": ABOUT,
        "inertia_axes": TURN,
    },
    "box": {"mass": MASS, "shape": box()},
    "mesh": {"mass": MASS, "shape": corners()},
}


def body(name: str, **fields: object) -> fb.Body:
    return fb.Body(name, position=(1, 2, 3), orientation=REFERENCE, **fields)


@pytest.mark.parametrize("way", WAYS)
def test_all_ways_are_one_body(way: str) -> None:
    m = fb.Mechanism("m")
    m.add(body("b", **WAYS[way]))
    b = m.mass_properties(drawn=True)["b"]
    assert b.com == pytest.approx(COM, abs=1e-14)
    assert b.inertia == pytest.approx(J, abs=1e-13)
    assert b.moments == pytest.approx(MOMENTS)
    assert np.abs(b.axes.T @ R) == pytest.approx(np.eye(3), abs=1e-13)


@pytest.mark.parametrize("way", WAYS)
def test_free_rotation_obeys_euler(way: str) -> None:
    """At the start J alpha = -w x J w, in the reference frame; the mass centre keeps its velocity."""
    w = np.array([1.0, -2.0, 1.5])
    m = fb.Mechanism("m")
    m.add(body("b", **WAYS[way], angular_velocity=REFERENCE.apply(w), velocity=(0.1, 0.2, 0.3)))
    r = m.simulate(0.01, outputs=2)
    alpha = -np.linalg.solve(J, np.cross(w, J @ w))
    assert REFERENCE.inv().apply(r["b"].angular_acceleration[0]) == pytest.approx(alpha, abs=1e-11)
    arm = REFERENCE.apply(COM)  # reference point from mass centre: -arm; its acceleration follows from the motion
    a, ww = REFERENCE.apply(alpha), REFERENCE.apply(w)
    assert r["b"].acceleration[0] == pytest.approx(-np.cross(a, arm) - np.cross(ww, np.cross(ww, arm)), abs=1e-10)


@pytest.mark.parametrize("way", WAYS)
def test_a_physical_pendulum(way: str) -> None:
    """About a fixed axis e through P: (e . J_P e) angle'' = e . (c x m g), and its energy at the end of a swing."""
    axis, P = np.array([0.6, 0.0, 0.8]), np.array([0.5, 1.0, 2.0])
    g = np.array([0, 0, -9.81])
    m = fb.Mechanism("m", gravity=g)
    m.add(body("b", **WAYS[way]), fb.Revolute("A", "ground", "b", at=P, axis=axis))
    r = m.simulate(1.0, outputs=11)
    c = (1, 2, 3) + REFERENCE.apply(COM) - P
    Q = REFERENCE.as_matrix()
    about = axis @ moved(Q @ J @ Q.T, c) @ axis
    assert r["A"].angle_acceleration[0] == pytest.approx(axis @ np.cross(c, MASS * g) / about, rel=1e-10)
    turned = Rotation.from_rotvec(axis * r["A"].angle[-1]).apply(c)
    assert about * r["A"].angle_rate[-1] ** 2 / 2 == pytest.approx(MASS * g @ (turned - c), rel=1e-6)


def test_a_planar_body_with_a_solid_swings_as_in_space() -> None:
    """A link with a hole hung on its pin: m d g = J_P angle'' with the link's own inertia, planar and spatial."""
    link = fb.Link(start=(0, 0, 0), end=(0.5, 0, 0), width=0.1, thickness=0.02)
    hole = fb.Cylinder(radius=0.03, length=0.02, position=(0.5, 0, 0), hole=True)
    found = []
    for planar in (True, False):
        m = fb.Mechanism("m", planar=planar, gravity=(0, -9.81) if planar else (0, -9.81, 0))
        m.add(fb.Body("b", density=7850, shape=[link, hole]))
        m.add(fb.Revolute("A", "ground", "b", at=(0, 0, 0), axis=None if planar else (0, 0, 1)))
        found.append(m.simulate(1.0, outputs=11, rtol=1e-9)["A"])
    assert found[0].angle == pytest.approx(found[1].angle, abs=1e-8)
    area, out = 0.5 * 0.1 + np.pi * 0.05**2, np.pi * 0.03**2
    half = np.pi * 0.05**2 / 2, 2 / 3 * 0.05**3, np.pi * 0.05**4 / 8  # half a disc: area, first and second moment
    x2 = 0.1 * 0.5**3 / 3 + half[2] + half[0] * 0.5**2 + 2 * 0.5 * half[1] + half[2] - out * (0.25 + 0.03**2 / 4)
    y2 = 0.5 * 0.1**3 / 12 + np.pi * 0.05**4 / 4 - out * 0.03**2 / 4
    first = area * 0.25 - out * 0.5
    assert found[0].angle_acceleration[0] == pytest.approx(-9.81 * first / (x2 + y2), rel=1e-10)
