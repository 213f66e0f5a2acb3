"""A mass of 1 kg on a slide, with a spring of 10 N/m and a damper of 2 N s/m: P = 1 / (s^2 + 2 s + 10)."""

from __future__ import annotations

import flyball as fb


def slide(*controllers, force: str = "pid", **parameters: float) -> fb.Mechanism:
    """The slide "A" under a force that controllers say."""
    m = fb.Mechanism("slide", planar=True, parameters=parameters)
    m.add(fb.Body("cart", mass=1.0, inertia=1.0))
    m.add(fb.Prismatic("A", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("spring", coordinate="A.displacement", stiffness=10, damping=2))
    m.add(*controllers)
    m.add(fb.Actuator("drive", coordinate="A.displacement", force=force))
    return m


TIGHT = {"rtol": 1e-11, "atol": 1e-12}


def pendulum(ki: float) -> fb.Mechanism:
    """A rod of 2 kg held at an angle r by a PID: the set point turns the weight's stiffness, 9.81 cos(r)."""
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, -9.81), parameters={"r": 0.7})
    m.add(fb.Body("rod", mass=2.0, inertia=0.1, position=(0, -0.5)))
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.PID("pid", setpoint="r", measured="A.angle", kp=60, ki=ki, kd=20, filter=0.05))
    m.add(fb.Motor("motor", "A", torque="pid"))
    return m
