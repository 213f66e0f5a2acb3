"""Random scenes never gain energy, whatever the law, friction, restitution, shapes and step; no overlap makes speed.

Their momentum changes by the impulses that the table of contacts has.
"""

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


def plank(seed):
    """A plank on a hinge that a ball hits at one end; within the same step its other end hits balls above it."""
    rng = np.random.default_rng(seed)
    m = fb.Mechanism("plank", gravity=(0, 0, 0))
    m.add(fb.Body("plank", shape=fb.Box(edges=(1.2, 0.4, 0.05)), density=10 ** rng.uniform(1, 3)))
    m.add(fb.Revolute("hinge", "ground", "plank", at=(0, 0, 0), axis=(0, 1, 0)))
    for k in range(5):
        place = (0.45, 0, 0.1) if k == 0 else (-0.15 * k + 0.05, 0, 0.0851 + rng.uniform(0, 1e-3))
        m.add(
            fb.Body(
                f"b{k}", shape=fb.Sphere(radius=0.06), density=10 ** rng.uniform(2, 4), position=place,
                velocity=(0, 0, -3.0 if k == 0 else 0.0), angular_velocity=tuple(rng.uniform(-3, 3, 3)),
            )
        )  # fmt: skip
    m.add(fb.Contact(friction=rng.uniform(0, 0.8), restitution=rng.uniform(0.3, 1.0)))
    return m, 2e-3


@pytest.mark.parametrize("law", ["poisson", "sequential"])
@pytest.mark.parametrize(("make", "seed"), [(plank, k) for k in range(5)] + [(scene, k) for k in range(3)])
def test_momentum_changes_by_the_impulses_of_the_table(make, seed, law):
    """m (v+ - v-) = (sum of forces + m g) step of every free body in every step, rows within their cones."""
    m, step = make(seed) if make is plank else make(seed, False)
    n = int(0.4 / step) + 1
    choices = {"impacts": law} if law == "sequential" else {"restitution": law}
    run = m.simulate(0.4, outputs=n, method=fb.Stepping(step=float(step), tolerance=1e-9, **choices))
    assert run.health.steps == n - 1
    c, names = run.contacts, run.contacts.names()
    moved = 0.0
    for name, body in m.mass_properties().bodies.items():
        if not name.startswith("b") or isinstance(m[name].shape, fb.Cone):  # its mass centre is not where it is placed
            continue
        force = np.tile(body.mass * np.array(m.gravity), (n, 1))
        for side, sign in ((0, -1.0), (1, 1.0)):
            rows = np.array([pair[side] == name for pair in names], bool)
            np.add.at(force, c.when[rows], sign * c.force[rows])
        change = body.mass * np.diff(run[name].velocity, axis=0)
        assert change == pytest.approx(step * force[1:], abs=1e-9 * np.abs(body.mass * run[name].velocity).max())
        moved = max(moved, np.abs(c.force).max(initial=0.0))
    assert moved > 0.0
    held = np.linalg.norm(c.tangential_force, axis=1)
    assert (held <= (1 + 1e-6) * c.friction * c.normal_force + 1e-9 * np.abs(c.force).max()).all()
