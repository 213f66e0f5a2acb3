"""Mechanisms that several tests share, each built by a few lines of the public interface."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np

import flyball as fb

EXAMPLES = Path(__file__).parent.parent / "examples"
G = 9.81


def example(name: str, **options) -> fb.Mechanism:
    """A mechanism of the examples folder."""
    if name.endswith(".py"):
        return runpy.run_path(str(EXAMPLES / name))["mechanism"](**options)
    return fb.load(EXAMPLES / name)


def rod(name: str, a, b, mass: float = 1.0, thickness: float = 1e-6, **more) -> fb.Body:
    """A slender rod from a to b in space; about its own axis it has ``thickness`` times its other inertia."""
    a, b = np.array(a, float), np.array(b, float)
    length = np.linalg.norm(b - a)
    d = np.outer(b - a, b - a) / length**2
    inertia = mass * length**2 / 12 * (np.eye(3) - d + thickness * d)
    return fb.Body(name, mass=mass, inertia=inertia, position=(a + b) / 2, **more)


def planar_rod(name: str, a, b, mass: float = 1.0, **more) -> fb.Body:
    """A slender rod from a to b in the plane, x along it."""
    d = np.subtract(b, a)
    return fb.Body(
        name,
        mass=mass,
        inertia=mass * (d @ d) / 12,
        position=tuple((np.add(a, b) / 2).tolist()),
        angle=float(np.arctan2(d[1], d[0])),
        **more,
    )


def free_body(inertia=(1.0, 2.0, 3.0), w=(0.1, 0.0, 1.0), velocity=(0.0, 0.0, 0.0)) -> fb.Mechanism:
    """A single body without any force."""
    m = fb.Mechanism("free body")
    m.add(fb.Body("b", mass=2.0, inertia=inertia, angular_velocity=w, velocity=velocity))
    return m


def four_bar(gravity=(0, -G)) -> fb.Mechanism:
    """A planar crank-rocker: ground 0.5, crank 0.2, coupler 0.5, rocker 0.4 m, drawn closed."""
    a, d = np.zeros(2), np.array([0.5, 0.0])
    b = 0.2 * np.array([np.cos(1.0), np.sin(1.0)])
    c = circles(b, 0.5, d, 0.4)
    m = fb.Mechanism("four-bar", planar=True, gravity=gravity)
    m.add(planar_rod("crank", a, b), planar_rod("coupler", b, c, 1.5), planar_rod("rocker", d, c, 0.8))
    m.add(fb.Revolute("A", "ground", "crank", at=(0, 0)), fb.Revolute("B", "crank", "coupler", at=b))
    m.add(fb.Revolute("C", "coupler", "rocker", at=c), fb.Revolute("D", "ground", "rocker", at=d))
    return m


def circles(p, r: float, q, s: float) -> np.ndarray:
    """The upper intersection of the circles about p and q with radii r and s, p left of q."""
    d = np.subtract(q, p)
    size = np.hypot(*d)
    x = (size**2 + r * r - s * s) / (2 * size)
    e = d / size
    return np.add(p, x * e + np.sqrt(r * r - x * x) * np.array([-e[1], e[0]]))


BRICARD_POINTS = [(0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1)]
BRICARD_AXES = [(0, 1, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0)]


def bricard() -> fb.Mechanism:
    """Bricard's mechanism, IFToMM benchmark A04: five rods and ground, six hinges, movable by its special lengths only."""
    P = BRICARD_POINTS
    m = fb.Mechanism("Bricard", gravity=(0, -G, 0))
    names = ["ground", *(f"rod {i}" for i in range(1, 6)), "ground"]
    for i in range(5):
        m.add(rod(names[i + 1], P[i], P[i + 1]))
    for i in range(6):
        m.add(fb.Revolute(f"R{i + 1}", names[i], names[i + 1], at=P[i], axis=BRICARD_AXES[i]))
    return m


def door(upper=fb.Revolute, lower=fb.Revolute, gravity=(0, 0, -G)) -> fb.Mechanism:
    """A door 0.8 m wide and 2 m high that hangs at x = y = 0 on two hinges 1.6 m apart."""
    m = fb.Mechanism("door", gravity=gravity)
    m.add(fb.Body("leaf", mass=30.0, inertia=(10.0, 11.6, 1.6), position=(0.4, 0, 1)))
    for name, kind, z in (("upper", upper, 1.8), ("lower", lower, 0.2)):
        axis = {"axis": (0, 0, 1)} if kind is fb.Revolute else {}
        m.add(kind(name, "ground", "leaf", at=(0, 0, z), **axis))
    return m


def spatial_four_bar(driven: bool = False) -> fb.Mechanism:
    """The example; with ``driven`` its crank turns at 12 rad/s by a driver."""
    m = example("spatial_four_bar.toml")
    if driven:
        m.initial.clear()
        m.add(fb.Driver("motor", "A.angle", "12*t"))
    return m


def hanging_bodies() -> fb.Mechanism:
    """Three free bodies with three different principal moments each, joined by springs: nothing from outside."""
    m = fb.Mechanism("springs")
    m.add(fb.Body("a", mass=1.0, inertia=(0.02, 0.03, 0.04), position=(0, 0, 0), angular_velocity=(1, 2, -1)))
    m.add(
        fb.Body(
            "b",
            mass=2.0,
            inertia=(0.05, 0.03, 0.06),
            position=(1, 0.2, 0),
            orientation=("20 deg", "-35 deg", "50 deg"),
            velocity=(0.3, -0.2, 0.5),
        )
    )
    m.add(fb.Body("c", mass=0.5, inertia=(0.01, 0.015, 0.02), position=(0.3, 1, 0.4), velocity=(0, 1, 0)))
    m.add(fb.SpringDamper("ab", "a", "b", at=((0.1, 0, 0), (0.8, 0.1, 0)), stiffness=60.0, length=0.5))
    m.add(fb.SpringDamper("bc", "b", "c", at=((1, 0.3, 0.1), (0.4, 0.9, 0.3)), stiffness=40.0, length=0.6))
    m.add(fb.Spherical("ball", "a", "c", at=(0.1, 0.5, 0.1)))
    return m
