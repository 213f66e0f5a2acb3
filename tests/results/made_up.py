"""A slider crank's result from its closed-form motion: no simulation, so no compiler."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

import flyball as fb
from flyball.results.health import Health
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
    found = SimpleNamespace(freedoms=0, redundant=tuple(undetermined or ()), undetermined=undetermined or {})
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
