"""Results from closed-form motions: no simulation, so no compiler."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

import flyball as fb
from flyball.results.contacts import ContactBodies, Contacts
from flyball.results.convergence import Convergence
from flyball.results.health import ContactHealth, Health
from flyball.results.part_views.bodies import BodySetMotion
from flyball.results.result import Result
from flyball.tables.structure import structure
from flyball.tables.values import values

R, L = 0.3, 0.6


def mechanism() -> fb.Mechanism:
    """A slider crank with a spring, a force and a driver."""
    m = fb.Mechanism("slider/crank", planar=True, gravity=(0, -9.81), parameters={"speed": "60 rpm", "k": 200.0})
    m.add(fb.Body("crank", mass=1, inertia=0.01, com=(R / 2, 0)))
    m.add(fb.Body("rod", mass=1, inertia=0.03, position=(R + L / 2, 0)))
    m.add(fb.Body("slider", mass=1, inertia=0, position=(R + L, 0)))
    m.add(fb.Frame("eye", "rod", position=(0, 0.1)))
    m.add(fb.Revolute("A", "ground", "crank", at=(0, 0)), fb.Revolute("B", "crank", "rod", at=(R, 0)))
    m.add(fb.Revolute("C", "rod", "slider", at=(R + L, 0)))
    m.add(fb.Translational("D", "ground", "slider", at=(R + L, 0), axis=(1, 0)))
    m.add(fb.SpringDamper("spring", "slider", "ground", at=((R + L, 0), (1.6, 0)), stiffness="k", damping=2))
    m.add(fb.SpringDamper("dash/pot", "eye", "ground", at=((0.6, 0.1), (0.6, 1)), damping=2))
    m.add(fb.PointForce("push", "slider", force=("20*sin(speed*t)", 0)))
    m.add(fb.Driver("motor", "A.angle", "speed*t"))
    return m


def healthy(undetermined: dict | None = None, **options: object) -> Health:
    """A health report that says all is well."""
    names = tuple(undetermined or ())
    found = SimpleNamespace(freedoms=0, redundant=names, undetermined=undetermined or {}, cut="")
    late = {"mobility": found, "energy_drift": 1e-9}
    return Health(True, "reached the end", 1e-12, float("nan"), 10, 1, 99, 50, 0.5, options, late=late)


def slider_crank(n: int = 41, speed: float = 2 * np.pi) -> Result:
    """Positions and velocities are exact; accelerations and multipliers are made up."""
    m = mechanism()
    x = values(structure(m), {"speed": speed, "k": 100.0})
    t = np.linspace(0, 1, n)
    a = speed * t
    b = -np.arcsin(R * np.sin(a) / L)
    da, db = speed + 0 * t, -R * speed * np.cos(a) / (L * np.cos(b))
    s = R * np.cos(a) + L * np.cos(b)
    ds = -R * da * np.sin(a) - L * db * np.sin(b)
    zero = 0 * t
    q = [R / 2 * np.cos(a), R / 2 * np.sin(a), a, (R * np.cos(a) + s) / 2, R * np.sin(a) / 2, b, s, zero, zero]
    v = [-R / 2 * da * np.sin(a), R / 2 * da * np.cos(a), da]
    v += [(-R * da * np.sin(a) + ds) / 2, R * da * np.cos(a) / 2, db, ds, zero, zero]
    random = np.random.default_rng(1)
    states, vdot, lam = (random.normal(size=(n, k)) for k in (len(x.structure.states), 9, len(x.structure.rows)))
    health = healthy({"D": ("force y", "torque")}, max_step=np.inf)
    result = Result(m, x, t, np.stack(q, 1), np.stack(v, 1), states, vdot, lam, health)
    result.final = (1.0, np.r_[result.q[-1], result.v[-1], states[-1]])
    return result


def thrown(n: int = 5, planar: bool = False) -> Result:
    """A block at rest on a floor beside three balls of two sizes that fly and spin, with made-up contact forces.

    The balls are in free flight: closed form, as far as they go.
    """
    g = np.array([0, -10.0, 0]) if planar else np.array([0, 0, -10.0])
    up = -g / 10.0
    start = np.array([[1.0, 2, 0], [2, 2, 0], [3, 2, 0]])
    m = fb.Mechanism("thrown", planar=planar, gravity=tuple(g[:2]) if planar else tuple(g))
    m.add(fb.Ground("floor", shape=[fb.Plane(normal=tuple(up)), fb.Plane(normal=(1, 0, 0), position=(-1, 0, 0))]))
    m.add(fb.Body("block", shape=fb.Box(edges=(0.4, 0.4, 0.4)), density=1000))
    m.add(fb.Bodies("balls", shape=fb.Sphere(radius=0.1), density=500, position=start[:, : 2 if planar else 3],
                    scale=[1, 1, 0.5], color="teal"))  # fmt: skip
    m.add(fb.Contact(friction=0.3))
    x = values(structure(m))
    t = np.linspace(0, 0.4, n)
    still = np.zeros((n, x.structure.nv))
    r = Result(m, x, t, np.tile(x.q, (n, 1)), still, np.zeros((n, 0)), still, np.zeros((n, 0)), healthy())
    r.final = (0.4, np.r_[r.q[-1], r.v[-1]])
    mass = np.array([2.0, 2.0, 0.25])
    p = start + np.array([1.0, 0, 0]) * t[:, None, None] + 0.5 * g * t[:, None, None] ** 2
    v = np.tile(np.array([1.0, 0, 0]), (n, 3, 1)) + g * t[:, None, None]
    w = np.tile(np.array([0, 0, 4.0]), (n, 3, 1))
    q = np.tile(np.stack([np.cos(2 * t), 0 * t, 0 * t, np.sin(2 * t)], 1)[:, None], (1, 3, 1))
    J = (0.004 * mass * np.array([1, 1, 0.25]))[:, None, None] * np.eye(3)
    r.bulk = {"balls": BodySetMotion("balls", mass, J, np.zeros((3, 3)), p, q, v, w)}
    k = 2 * n
    force = np.tile(np.array([[320.0], [5.0]]) * up + [[1.0, 0, 0], [0, 0, 0]], (n, 1))
    r.contacts = Contacts(
        t, ContactBodies(("block", "balls", "ground"), (-1, 3, -1)), 2 * np.arange(n + 1), np.tile([(4, 0), (4, 2)], (n, 1)),
        np.tile(start[:2], (n, 1)), np.tile(up, (k, 1)), np.linspace(0, -1e-4, k), force, np.tile([0, 1], n),
        np.full(k, 0.3), Convergence(t, np.arange(n + 1), *np.ones((6, n)), solver="Gauss-Seidel"), planar,
    )  # fmt: skip
    r.exchanged = {"friction_loss": t**2, "impact_loss": 0 * t}
    r.health.contact = ContactHealth(
        "Gauss-Seidel: free bodies only", "Poisson's", most=2, worst_overlap=1e-4, size=0.1
    )
    return r
