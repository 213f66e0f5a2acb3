"""Small mechanisms of textbooks on control, their parameters by name."""

from __future__ import annotations

import flyball as fb
from tests.mechanisms import example


def cart(**changed) -> fb.Mechanism:
    """A pendulum upright on a cart that a force pushes."""
    p = {"M": 2.0, "m": 0.5, "l": 0.3, "J": 0.02, "g": 9.81} | changed
    m = fb.Mechanism("pendulum on a cart", planar=True, gravity=(0, "-g"), parameters=p)
    m.add(fb.Body("cart", mass="M", inertia=1), fb.Body("rod", mass="m", inertia="J", position=(0, "l")))
    m.add(fb.Prismatic("rail", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.Revolute("pin", "cart", "rod", at=(0, 0)))
    m.add(fb.PointForce("push", "cart", at=(0, 0), force=("0", "0")))
    return m


def two_masses(**changed) -> fb.Mechanism:
    """Two masses between springs and a damper, the first pushed."""
    p = {"m1": 1.0, "m2": 0.5, "k1": 40.0, "k2": 15.0, "c": 0.3} | changed
    m = fb.Mechanism("two masses", planar=True, parameters=p)
    m.add(fb.Body("first", mass="m1", inertia=1), fb.Body("second", mass="m2", inertia=1, position=(1, 0)))
    m.add(fb.Prismatic("slide 1", "ground", "first", at=(0, 0), axis=(1, 0)))
    m.add(fb.Prismatic("slide 2", "ground", "second", at=(1, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("wall", "slide 1.displacement", stiffness="k1"))
    m.add(fb.SpringDamper("between", "first", "second", at=((0, 0), (1, 0)), stiffness="k2", damping="c"))
    m.add(fb.PointForce("push", "first", at=(0, 0), force=("0", "0")))
    return m


def quarter_car(**changed) -> fb.Mechanism:
    """A quarter of a car on a tyre, over a road that a driver moves."""
    p = {"body": 300.0, "wheel": 40.0, "k": 2e4, "c": 1500.0, "tyre": 1.8e5} | changed
    m = fb.Mechanism("quarter car", planar=True, parameters=p)
    for name, mass, y in (("road", 1, 0.0), ("wheel", "wheel", 0.3), ("car", "body", 0.8)):
        m.add(fb.Body(name, mass=mass, inertia=1, position=(0, y)))
        m.add(fb.Prismatic(f"{name} slide", "ground", name, at=(0, y), axis=(0, 1)))
    m.add(fb.SpringDamper("tyre", "road", "wheel", at=((0, 0), (0, 0.3)), stiffness="tyre"))
    m.add(fb.SpringDamper("strut", "wheel", "car", at=((0, 0.3), (0, 0.8)), stiffness="k", damping="c"))
    m.add(fb.Driver("profile", "road slide.displacement", "0.0"))
    return m


def ball_on_beam(**changed) -> fb.Mechanism:
    """A ball that rolls in a beam which a motor tilts; its middle on the axis of the beam."""
    p = {"m": 0.1, "R": 0.015, "J": 0.02, "Jb": 9e-6, "g": 9.81} | changed
    m = fb.Mechanism("ball on a beam", planar=True, gravity=(0, "-g"), parameters=p)
    m.add(fb.Body("beam", mass=1, inertia="J"), fb.Body("ball", mass="m", inertia="Jb"))
    m.add(fb.Revolute("pivot", "ground", "beam", at=(0, 0)))
    m.add(fb.WheelOnLine("groove", "beam", "ball", at=(0, "-R"), axis=(1, 0), centre=(0, 0)))
    m.add(fb.Motor("drive", joint="pivot", torque="0"))
    return m


def watt(**changed) -> fb.Mechanism:
    """Watt's governor on its engine: see the example."""
    return example("governor_criterion.py", **changed)
