"""A planetary gear train: a motor drives the sun, the ring stands still, a brake holds the carrier back.

Willis: with the ring at rest the sun turns 1 + z_ring / z_sun times as fast as the carrier, and the carrier has as many
times the torque. Two of the three planets repeat what the first one says: the constraints are redundant, and say so.

Run it with ``flyball run examples/planetary.py``.
"""

import math

import flyball as fb

SUN, PLANET, RING = 24, 18, 60  # teeth; the ring has as many as the sun and two planets
MODULE = 0.005  # pitch diameter per tooth [m]


def gear(name: str, teeth: int, mass: float, position: tuple[float, float], color: str) -> fb.Body:
    """A wheel with the moment of inertia of a disk."""
    radius = MODULE * teeth / 2
    return fb.Body(name, mass=mass, inertia=mass * radius**2 / 2, position=position, color=color)


def mechanism(planets: int = 3) -> fb.Mechanism:
    """Sun, carrier and evenly spaced planets; the ring is part of ground."""
    arm = MODULE * (SUN + PLANET) / 2
    m = fb.Mechanism("planetary gear", planar=True, parameters={"torque": 2.0, "brake": "0.35 N*m*s"})
    m.add(fb.Body("carrier", mass=0.8, inertia=4e-3, color="#b8c0c8"), gear("sun", SUN, 1.2, (0, 0), "#c08a3e"))
    m.add(fb.Revolute("carrier bearing", "ground", "carrier", at=(0, 0)))
    m.add(fb.Revolute("sun bearing", "carrier", "sun", at=(0, 0)))
    for k in range(1, planets + 1):
        a = 2 * math.pi * (k - 1) / planets + math.pi / 2
        at = (arm * math.cos(a), arm * math.sin(a))
        m.add(gear(f"planet {k}", PLANET, 0.7, at, "#a63d2f"))
        m.add(fb.Revolute(f"pin {k}", "carrier", f"planet {k}", at=at))
        m.add(fb.GearPair(f"sun mesh {k}", joint_1="sun bearing", joint_2=f"pin {k}", teeth=(SUN, PLANET)))
        ring = {"joint_1": f"pin {k}", "joint_2": "carrier bearing"}
        m.add(fb.GearPair(f"ring mesh {k}", **ring, teeth=(PLANET, RING), internal=True))
    m.add(fb.Sensor("speed", "carrier bearing.rate"))
    m.add(fb.PointTorque("motor", "sun", torque="torque"), fb.PointTorque("load", "carrier", torque="-brake*speed"))
    return m
