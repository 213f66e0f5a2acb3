"""Mechanisms whose motions are known in closed form."""

from __future__ import annotations

import flyball as fb


def oscillator() -> fb.Mechanism:
    """x = x0 cos(sqrt(k / m) t), without damping."""
    m = fb.Mechanism("oscillator", planar=True, parameters={"k": "100 N/m", "c": 0.0, "mass": 1.0, "x0": 0.1})
    m.add(fb.Body("b", mass="mass", inertia=1.0, position=("x0", 0)))
    m.add(fb.Prismatic("slide", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("spring", coordinate="b.x", stiffness="k", damping="c"))
    return m


def pushed() -> fb.Mechanism:
    """After a time T it is at T^2 / 2 (a + 2 b): each force's part of a variance is known."""
    m = fb.Mechanism("pushed", planar=True, parameters={"a": 1.0, "b": 1.0, "idle": 1.0})
    m.add(fb.Body("block", mass=1.0, inertia=1.0))
    m.add(fb.Prismatic("slide", "ground", "block", at=(0, 0), axis=(1, 0)))
    m.add(fb.Actuator("first", "slide.displacement", force="a + 0*idle"))
    m.add(fb.Actuator("second", "slide.displacement", force="2*b"))
    return m
