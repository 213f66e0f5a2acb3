"""Bodies without inertia, about some axis or at all, which only rows hold: implicit methods, both layers."""

import numpy as np
import pytest

import flyball as fb
from tests.layers import both_layers

G = 9.81


def points(*places):
    """Points of 1 kg on hinges, each on the one before."""
    m = fb.Mechanism("points", planar=True, gravity=(0, -G))
    before, at = "ground", 0.0
    for n, x in enumerate(places):
        m.add(fb.Body(f"b{n}", mass=1, inertia=0, position=(x, 0)), fb.Revolute(f"A{n}", before, f"b{n}", at=(at, 0)))
        before, at = f"b{n}", x
    return m


def in_space():
    m = fb.Mechanism("point", gravity=(0, 0, -G))
    m.add(fb.Body("b0", mass=1, inertia=(0, 0, 0), position=(1, 0, 0)))
    m.add(fb.Revolute("A0", "ground", "b0", at=(0, 0, 0), axis=(0, 1, 0)))
    return m


def rod():
    """Of no thickness, oblique to its body's axes, on a ball joint."""
    d = np.array([1.0, 2.0, 2.0]) / 3.0
    m = fb.Mechanism("rod", gravity=(0, 0, -G))
    m.add(fb.Body("b0", mass=1, inertia=(np.eye(3) - np.outer(d, d)) / 12, position=tuple(d / 2)))
    m.add(fb.Universal("A0", "ground", "b0", at=(0, 0, 0), axes=((2, -1, 0), (2, 4, -5))))
    return m


def link():
    """Of neither mass nor inertia, on a spring to what it carries."""
    m = fb.Mechanism("link", planar=True, gravity=(0, -G))
    m.add(fb.Body("b0", mass=0, inertia=0, position=(0.5, 0)), fb.Revolute("A", "ground", "b0", at=(0, 0)))
    m.add(fb.Body("b1", mass=1, inertia=0.1, position=(1, 0)), fb.Revolute("B", "b0", "b1", at=(1, 0)))
    m.add(fb.SpringDamper("s", "b0", "b1", at=((0.5, 0), (1.2, 0.1)), stiffness=10))
    return m


@pytest.mark.parametrize(
    ("method", "near"),
    [({"method": "radau"}, 3e-7), ({"method": "generalised-alpha", "step": 2e-3}, 1e-4)],
)
@pytest.mark.parametrize("made", [lambda: points(1.0), lambda: points(1.0, 2.0), in_space, rod, link])
@both_layers
def test_they_move_as_by_the_explicit_method(made, method, near):
    m = made()
    exact = m.simulate(0.8, outputs=9, method="dop853", rtol=1e-10)
    r = m.simulate(0.8, outputs=9, **method)
    assert max(np.abs(r[b.name].position - exact[b.name].position).max() for b in m.bodies) < near
    assert not r.health.warnings


def test_a_point_is_a_pendulum_of_its_length():
    """Falling from the level: w^2 = 2 g / l sin(phi)."""
    r = points(1.0).simulate(0.5, outputs=6, method="radau", coordinates="absolute", rtol=1e-9)
    low = -r["b0"].position[:, 1]
    assert np.square(r["b0"].velocity).sum(axis=1) == pytest.approx(2 * G * low, abs=1e-6)
