"""Robots under controllers of joints."""

from __future__ import annotations

from collections.abc import Sequence

import flyball as fb

ARM = ["shoulder.angle", "elbow.angle"]


def arm(controller: fb.ComputedTorque | fb.GravityCompensatedPD, *others, **parameters) -> fb.Mechanism:
    """Two links in the vertical plane; masses of 2 kg and of the load, centres in the middle of 0.5 m."""
    m = fb.Mechanism("arm", planar=True, gravity=(0, -9.81), parameters={"load": 1.0} | parameters)
    m.add(fb.Body("upper", mass=2, inertia=0.05, position=(0.25, 0)))
    m.add(fb.Body("lower", mass="load", inertia=0.03, position=(0.75, 0)))
    m.add(fb.Revolute("shoulder", "ground", "upper", at=(0, 0)), fb.Revolute("elbow", "upper", "lower", at=(0.5, 0)))
    m.add(*others, controller)
    return driven(m, controller)


def driven(m: fb.Mechanism, controller: fb.ComputedTorque | fb.GravityCompensatedPD) -> fb.Mechanism:
    """The mechanism with an actuator along every controlled coordinate."""
    for coordinate, output in zip(controller.coordinates, controller.output_names, strict=True):
        m.add(fb.Actuator(f"{output} drive", coordinate=coordinate, force=f"{controller.name}.{output}"))
    return m


def crane(controller: fb.ComputedTorque | fb.GravityCompensatedPD, length: float = 1.0, mass: float = 1.0, *others):
    """Four joints in space: a slide, a joint that carries its bodies in reverse order, a skew axis, a fixed tool."""

    def at(*x: float) -> tuple[float, ...]:
        return tuple(length * c for c in x)

    def inertia(*x: float) -> tuple[float, ...]:
        return tuple(mass * length**2 * c for c in x)

    m = fb.Mechanism("crane", gravity=at(1.0, -2.0, -9.0))
    m.add(fb.Body("column", mass=5 * mass, inertia=inertia(0.3, 0.2, 0.4), position=at(0, 0.1, 0.5)))
    m.add(fb.Body("boom", mass=3 * mass, inertia=inertia(0.1, 0.3, 0.25), position=at(0.5, 0, 1)))
    m.add(fb.Body("carriage", mass=1.5 * mass, inertia=inertia(0.02, 0.04, 0.03), position=at(1, 0.1, 0.9)))
    m.add(fb.Body("hand", mass=mass, inertia=inertia(0.02, 0.01, 0.015), position=at(1.2, 0.1, 0.7)))
    m.add(fb.Body("tool", mass=0.5 * mass, inertia=inertia(0.004, 0.01, 0.007), position=at(1.3, 0, 0.6)))
    m.add(fb.Revolute("turn", "ground", "column", at=at(0, 0, 0), axis=(0, 0, 1)))
    m.add(fb.Revolute("lift", "boom", "column", at=at(0, 0, 1), axis=(0, 1, 0), angle=0.3))
    m.add(fb.Prismatic("run", "boom", "carriage", at=at(0.5, 0, 1), axis=(1, 0.2, 0)))
    m.add(fb.Revolute("wrist", "carriage", "hand", at=at(1, 0, 0.9), axis=(1, 1, 1)))
    m.add(fb.Fixed("grip", "hand", "tool", at=at(1.2, 0, 0.6)))
    m.add(*others, controller)
    return driven(m, controller)


CRANE = ["turn.angle", "lift.angle", "run.displacement", "wrist.angle"]


def decay(e0: float, rate: float, k: Sequence[float], t):
    """The solution of e'' + kd e' + kp e = 0 with two different real or complex roots; k = (kp, kd)."""
    import numpy as np

    a, b = np.roots([1.0, k[1], k[0]]).astype(complex)
    A = (rate - b * e0) / (a - b)
    return (A * np.exp(a * t) + (e0 - A) * np.exp(b * t)).real
