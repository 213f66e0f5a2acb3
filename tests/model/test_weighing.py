"""Bodies of several shapes: densities, masses, holes, looks; in space and in the plane."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

import flyball as fb


def weight(shape: object, planar: bool = False, **fields: object):
    m = fb.Mechanism("m", planar=planar)
    m.add(fb.Body("b", shape=shape, **fields))
    return m.mass_properties(drawn=True)["b"]


def test_a_dumbbell() -> None:
    """Two balls and a rod of other materials, one ball weighed: sums of masses and of m d^2 by hand."""
    b = weight(
        [
            fb.Sphere(radius=0.1, position=(-0.5, 0, 0)),
            fb.Sphere(radius=0.1, position=(0.5, 0, 0), mass=40.0),
            fb.Rod(start=(-0.5, 0, 0), end=(0.5, 0, 0), radius=0.02, density=2700),
        ],
        density=7850,
    )
    ball, rod = 7850 * 4 / 3 * pi * 1e-3, 2700 * pi * 4e-4
    mass = ball + 40 + rod
    x = 0.5 * (40 - ball) / mass
    assert b.mass == pytest.approx(mass)
    assert b.com == pytest.approx([x, 0, 0])
    along = 0.4 * 0.01 * (ball + 40) + rod * 4e-4 / 2
    across = 0.4 * 0.01 * (ball + 40) + (ball + 40) / 4 + rod * (3 * 4e-4 + 1) / 12 - mass * x**2
    assert np.diag(b.inertia) == pytest.approx([along, across, across])
    assert b.volume == pytest.approx(2 * 4 / 3 * pi * 1e-3 + pi * 4e-4)


def test_holes_are_taken_away() -> None:
    """A bored cylinder is a tube; a plate with an eccentric hole is lighter on one side."""
    tube = weight(fb.Tube(radius=2, inner_radius=1, length=3), density=5)
    bored = weight([fb.Cylinder(radius=2, length=3), fb.Cylinder(radius=1, length=3, hole=True)], density=5)
    assert bored.mass == pytest.approx(tube.mass, rel=1e-14)
    assert bored.inertia == pytest.approx(tube.inertia, rel=1e-13)
    assert bored.volume == pytest.approx(tube.volume, rel=1e-14)
    hole = fb.Cylinder(radius=0.5, length=0.1, position=(1, 0, 0), hole=True)
    plate = fb.Body("p", density=1, shape=[fb.Box(edges=(4, 4, 0.1)), hole])
    assert plate.solids() == plate.shapes()[:1]  # a hole is not drawn
    b = weight(plate.shape, density=1)
    out = pi * 0.25
    assert b.com == pytest.approx([-out / (16 - out), 0, 0])
    assert b.mass == pytest.approx(0.1 * (16 - out))


def test_a_mass_is_shared_out() -> None:
    """By volume; by volume times density where all have one; inertias go with it."""
    shapes = [fb.Box(edges=(1, 1, 1)), fb.Box(edges=(1, 1, 3), position=(4, 0, 0))]
    b = weight(shapes, mass=8.0)
    assert b.mass == 8.0
    assert b.com == pytest.approx([3, 0, 0])
    assert b.inertia[0, 0] == pytest.approx(2 * 2 / 12 + 6 * 10 / 12)
    dense = [fb.Box(edges=(1, 1, 1), density=9), fb.Box(edges=(1, 1, 3), position=(4, 0, 0), density=1)]
    b = weight(dense, mass=8.0)
    assert b.com == pytest.approx([1, 0, 0])
    assert b.inertia[0, 0] == pytest.approx(6 * 2 / 12 + 2 * 10 / 12)
    assert b.volume == pytest.approx(4)


def test_looks_weigh_nothing() -> None:
    seen = [fb.Sphere(radius=1), fb.Box(edges=(9, 9, 9), looks=True)]
    assert weight(seen, density=1).mass == pytest.approx(4 / 3 * pi)
    body = fb.Body("b", density=1, shape=seen)
    assert body.solids() == tuple(seen)
    given = weight(seen, mass=1, inertia=(1, 2, 2.5))
    assert given.volume is None
    assert np.diag(given.inertia) == pytest.approx([1, 2, 2.5])


def test_com_may_repeat_what_the_shapes_say() -> None:
    b = weight(fb.Cone(radius=1, height=4), density=1, com=(0, 0, 1))
    assert b.com == pytest.approx([0, 0, 1])


@pytest.mark.parametrize("z", [0.0, 0.7])
def test_solids_in_the_plane(z: float) -> None:
    """A planar body counts with its mass, its mass centre in the plane and its inertia about z, wherever z is."""
    cone = fb.Cone(radius=0.3, height=0.8, position=(0.2, 0.1, z), orientation=("90 deg", 0, 0))
    flat = weight(cone, planar=True, density=100)
    solid = weight(cone, density=100)
    assert flat.mass == pytest.approx(solid.mass)
    assert flat.com == pytest.approx(solid.com[:2])
    assert flat.com == pytest.approx([0.2, 0.1 - 0.2])  # the axis lies along -y
    assert flat.inertia == pytest.approx(solid.inertia[2, 2])
    assert flat.moments == pytest.approx([solid.inertia[2, 2]])
    two = weight(fb.Box(edges=(1, 2, 3), position=(1, 2)), planar=True, mass=12)
    assert two.com == pytest.approx([1, 2])
    assert two.inertia == pytest.approx(5)
    bar = weight(fb.Link(start=(0, 0), end=(1, 0), width=0.1, thickness=0.01), planar=True, mass=1)
    assert bar.com == pytest.approx([0.5, 0])


def test_parameters_change_shapes() -> None:
    m = fb.Mechanism("m", parameters={"r": "10 cm", "rho": 1000})
    m.add(fb.Body("b", shape=fb.Sphere(radius="r", density="rho")))
    big = m.mass_properties(drawn=True, parameters={"r": 0.2})
    assert big.total.mass == pytest.approx(8 * m.mass_properties(drawn=True).total.mass)
