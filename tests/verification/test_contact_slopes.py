"""A block on a slope: it sticks below the angle of friction, and slides above it with Coulomb's acceleration."""

import numpy as np
import pytest

import flyball as fb

from .contact_scenes import BOX, G, floor, stepped


def sliding(slope):
    """Coulomb's acceleration down a slope, mu = 1/2."""
    return G * (np.sin(np.radians(slope)) - 0.5 * np.cos(np.radians(slope)))


def block(slope, planar=False):
    """A block on a slope with mu = 1/2."""
    m = floor(slope, planar, friction=0.5)
    if planar:
        m.add(fb.Body("block", shape=fb.Box(edges=(0.2, 0.1, 0.2)), density=1000, position=(0, 0.05)))
    else:
        m.add(fb.Body("block", shape=BOX, density=1000, position=(0, 0, 0.05)))
    return m


@pytest.mark.parametrize("slope", [15, 25, 26.5])
@pytest.mark.parametrize("planar", [False, True])
def test_it_does_not_creep_below_the_angle_of_friction(slope, planar):
    """Less than 1e-6 mm in a second, atan(1/2) = 26.57 degrees."""
    run = stepped(block(slope, planar), 1.0, 5e-3)["block"]
    assert np.abs(run.position[-1] - run.position[0]).max() < 1e-9
    assert np.abs(run.velocity[-1]).max() < 1e-9


@pytest.mark.parametrize("slope", [30, 40])
@pytest.mark.parametrize("planar", [False, True])
def test_it_slides_as_coulomb_says(slope, planar):
    """Exactly, at any step: acceleration to 1e-6, no gap of 1e-9 m, no chatter of the forces."""
    run = stepped(block(slope, planar), 1.0, 5e-3, outputs=201)
    v, x = run["block"].vx, run["block"].x
    assert v[-1] == pytest.approx(sliding(slope), rel=1e-6)
    assert x[-1] == pytest.approx(sliding(slope) / 2, rel=1e-6)
    assert np.diff(v) == pytest.approx(sliding(slope) * 0.005, rel=1e-4)
    assert np.abs(run.contacts.gap).max() < 1e-9
    n, m = np.cos(np.radians(slope)) * G, 4.0
    force = run.contacts.on("block").force[1:]
    assert force[:, 1 if planar else 2] == pytest.approx(m * n, rel=1e-5)
    assert force[:, 0] == pytest.approx(-0.5 * m * n, rel=1e-5)
    assert run.health.contact.worst_overlap < 1e-9


@pytest.mark.parametrize("step", [5e-3, 2.5e-3])
def test_the_convex_law_floats(step):
    """Without Coulomb's law what slides is above the floor by mu h v, within a step's change of it."""
    run = stepped(block(30), 1.0, step, outputs=11, coulomb=False)
    z, v = run["block"].z - 0.05, run["block"].vx
    assert z[-1] == pytest.approx(0.5 * step * v[-1], rel=5e-3)
    assert v[-1] == pytest.approx(sliding(30), rel=5e-3)


def test_a_slope_that_is_drawn_as_one():
    """A plane with a normal of its own and a block turned with it are the same as inclined gravity."""
    a = np.radians(30)
    m = fb.Mechanism("slope", gravity=(0, 0, -G))
    n, along = np.array([np.sin(a), 0, np.cos(a)]), np.array([np.cos(a), 0, -np.sin(a)])
    m.add(fb.Ground("floor", shape=fb.Plane(normal=tuple(n))), fb.Contact(friction=0.5))
    turn = (0, a, 0)
    m.add(fb.Body("block", shape=BOX, density=1000, position=tuple(0.05 * n), orientation=turn))
    run = stepped(m, 1.0, 5e-3)["block"]
    assert run.velocity[-1] == pytest.approx(sliding(30) * along, abs=1e-6)
    assert run.position[-1] == pytest.approx(0.05 * n + sliding(30) / 2 * along, abs=1e-6)


@pytest.mark.parametrize("shape", [BOX, fb.Sphere(radius=0.1)])
def test_a_height_field_that_is_a_slope(shape):
    """Over its triangles a block slides and a ball rolls as on a plane: g (sin a - mu cos a), and 5/7 g sin a."""
    angle, mu = np.radians(20.0), 0.2
    x = np.arange(9)[:, None] * 0.5 + np.zeros((1, 5))
    m = fb.Mechanism("hill", gravity=(0, 0, -G))
    m.add(fb.Ground("hill", shape=fb.HeightField(heights=-np.tan(angle) * x, dx=0.5), position=(-0.5, -1, 0)))
    m.add(fb.Contact(friction=mu))
    up = np.array([np.sin(angle), 0, np.cos(angle)])
    over = (0.1 if isinstance(shape, fb.Sphere) else 0.05) * up - [0, 0, 0.5 * np.tan(angle)]
    m.add(fb.Body("b", shape=shape, density=1000, position=tuple(over), orientation=(0, angle, 0)))
    run = stepped(m, 0.5, 2.5e-3)
    along = np.array([np.cos(angle), 0, -np.sin(angle)])
    pull = 5 / 7 * np.sin(angle) if isinstance(shape, fb.Sphere) else np.sin(angle) - mu * np.cos(angle)
    assert run["b"].velocity[-1] @ along == pytest.approx(0.5 * G * pull, rel=1e-4)
    assert abs(run["b"].velocity[-1] @ up) < 1e-6
