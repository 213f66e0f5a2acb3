"""Contact forces of random scenes at every output time: Coulomb's cone, and Newton's law with the acceleration there."""

import numpy as np
import pytest

import flyball as fb

G = 9.81
SCENES = 10  # of each kind


def shape(rng, planar):
    return [
        lambda: fb.Sphere(radius=0.05, looks=True, contact=True),
        lambda: fb.Box(edges=(0.1, 0.1, 0.1), looks=True, contact=True),
    ][int(rng.integers(2))]()


def scene(rng, planar):
    """A body that rests on a plane, or slides on it: what pulls on it begins to move it, or does not."""
    lean, turn, mu = rng.uniform(0.0, 0.9), rng.uniform(0.0, 2 * np.pi), rng.uniform(0.05, 0.9)
    along = np.sin(lean) * np.array([np.cos(turn), np.sin(turn)])
    gravity = (G * np.sin(lean), -G * np.cos(lean)) if planar else (*(G * along), -G * np.cos(lean))
    m = fb.Mechanism("scene", planar=planar, gravity=gravity)
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1) if planar else (0, 0, 1))))
    push = float(rng.choice([0.0, 0.0, 0.3]))
    at, v = ((0, 0.05), (push, 0)) if planar else ((0, 0, 0.05), (push * np.cos(turn), push * np.sin(turn), 0))
    inertia = 0.002 if planar else [0.002] * 3
    m.add(fb.Body("b", mass=1.5, inertia=inertia, position=at, velocity=v, shape=shape(rng, planar)))
    m.add(fb.Contact(friction=float(mu)))
    return m, np.array(gravity), float(mu)


@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("method", ["dop853", "radau"])
def test_every_row_obeys_the_cone_and_newtons_law(planar, method):
    rng = np.random.default_rng(11)
    begins = 0
    for _ in range(SCENES):
        m, gravity, mu = scene(rng, planar)
        r = m.simulate(0.2, outputs=5, method=method)
        b, c = r["b"], r.contacts
        tangential = np.linalg.norm(c.tangential_force, axis=1)
        assert (c.normal_force > -1e-9).all()
        assert (tangential <= mu * c.normal_force + 1e-9).all()
        np.testing.assert_allclose(1.5 * (b.acceleration - gravity), b.contact_force, rtol=1e-7, atol=1e-7)
        begins += tangential[0] >= mu * c.normal_force[0] * (1 - 1e-9)
    assert begins > 1  # some slide from their first instant on


@pytest.mark.parametrize("edge", ["sphere", "corner"])
def test_friction_as_sliding_begins(edge):
    """At rest on a slope that is too steep: mu N at once, and not twice that."""
    lean, mu = 0.5, 0.2
    m = fb.Mechanism("slope", gravity=(G * np.sin(lean), 0, -G * np.cos(lean)))
    made = fb.Sphere(radius=0.05, looks=True, contact=True)
    made = fb.Box(edges=(0.1, 0.1, 0.1), looks=True, contact=True) if edge == "corner" else made
    m.add(fb.Ground("floor", shape=fb.Plane()), fb.Contact(friction=mu))
    m.add(fb.Body("b", mass=1, inertia=[0.01] * 3, position=(0, 0, 0.05), shape=made))
    r = m.simulate(0.1, outputs=4, method="dop853")
    N = G * np.cos(lean)
    np.testing.assert_allclose(r["b"].contact_force, np.tile((-mu * N, 0, N), (4, 1)), atol=1e-9)
