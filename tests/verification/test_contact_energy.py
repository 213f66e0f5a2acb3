"""Random scenes never gain energy, whatever the law, friction, restitution, shapes and step; no overlap makes speed."""

import numpy as np
import pytest

import flyball as fb

from .contact_scenes import G

SHAPES = (
    fb.Sphere(radius=0.1),
    fb.Box(edges=(0.3, 0.2, 0.15)),
    fb.Capsule(radius=0.07, length=0.2),
    fb.Cylinder(radius=0.1, length=0.2),
    fb.Cone(radius=0.12, height=0.2),
)
FLAT = (
    fb.Cylinder(radius=0.1, length=0.1),
    fb.Box(edges=(0.3, 0.2, 0.1)),
    fb.Capsule(radius=0.07, length=0.2, orientation=(0, np.pi / 2, 0)),
)
LAWS = ("poisson", "moreau", "newton", "sequential")
MORE = 1e-9  # of the energy at the start, the most that may come


def scene(seed, planar):
    """A dozen bodies that fly about between floor and walls."""
    rng = np.random.default_rng(seed)
    m = fb.Mechanism("scene", planar=planar, gravity=(0, -G) if planar else (0, 0, -G))
    walls = [(0, 1), (1, 0), (-1, 0)] if planar else [(0, 0, 1), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)]
    up = 1 if planar else 2
    for k, n in enumerate(walls):
        at = 0.0 if n[up] else -0.6
        m.add(fb.Ground(f"wall{k}", shape=fb.Plane(normal=n), position=tuple(at * np.array(n))))
    shapes = FLAT if planar else SHAPES
    d = 2 if planar else 3
    for k in range(12):
        at = np.zeros(d)
        at[0] = -0.4 + 0.4 * (k % 3)
        if not planar:
            at[1] = -0.2 + 0.4 * (k // 3 % 2)
        at[up] = 0.25 + 0.4 * (k // (3 if planar else 6))
        turn = {"angle": rng.uniform(-3, 3)} if planar else {"orientation": tuple(rng.uniform(-3, 3, 3))}
        spin = rng.uniform(-8, 8) if planar else tuple(rng.uniform(-8, 8, 3))
        m.add(
            fb.Body(
                f"b{k}", shape=shapes[rng.integers(len(shapes))], density=10 ** rng.uniform(2, 4), position=tuple(at),
                velocity=tuple(rng.uniform(-3, 3, d)), angular_velocity=spin, **turn,
            )
        )  # fmt: skip
    static = rng.uniform(0, 1)
    m.add(
        fb.Contact(
            friction=rng.uniform(0, 1) * static,
            static_friction=static,
            restitution=rng.choice([0.0, rng.uniform(0, 1), 1.0]),
        )
    )
    return m, rng.choice([2e-3, 5e-3, 1e-2])


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("planar", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_energy_never_grows(seed, planar, law):
    """Its changes are what friction and impacts took, to rounding, and it never rises but by lifts out of overlaps."""
    m, step = scene(seed, planar)
    choices = {"impacts": law} if law == "sequential" else {"restitution": law}
    run = m.simulate(1.0, outputs=int(1 / step) + 1, method=fb.Stepping(step=float(step), **choices))
    E = run.energy.total - run.energy.total[-1]  # above rest, about
    assert E[0] > 10
    taken = sum(np.diff(run.exchanged[k]) for k in ("impact_loss", "friction_loss", "numerical_loss"))
    assert np.diff(E) == pytest.approx(-taken, abs=1e-9 * E[0])
    assert np.diff(run.energy.friction_loss).min() >= -1e-12 * E[0]
    c = run.contacts
    held = np.linalg.norm(c.tangential_force, axis=1)
    assert (held <= (1 + 1e-6) * c.friction * c.normal_force + 1e-9 * np.abs(c.force).max()).all()
    weight = G * sum(b.mass for b in m.mass_properties().bodies.values())
    assert np.diff(E).max() <= MORE * E[0] + weight * run.health.contact.worst_overlap
