"""Small mechanisms with stops, ropes and latches, and what is asked of their motions."""

from __future__ import annotations

import numpy as np

import flyball as fb

G = 9.81
TIGHT = {"rtol": 1e-11, "atol": 1e-13}
LAYERS = ("absolute", "joint")


def slider(*parts, gravity=G, mass=2.0, speed=0.0, height=0.0):
    """A block on a vertical guide, its coordinate the height over where it is drawn."""
    m = fb.Mechanism("slider", planar=True, gravity=(0, -gravity))
    m.add(fb.Body("block", mass=mass, inertia=0.1, position=(0, height), velocity=(0, speed)))
    m.add(fb.Prismatic("guide", "ground", "block", at=(0, 0), axis=(0, 1), displacement=height))
    m.add(*parts)
    return m


def wheels(*inertias, rates=None, torques=None):
    """Wheels in bearings side by side: joints A, B, ... of bodies a, b, ..."""
    m = fb.Mechanism("wheels", planar=True)
    for k, inertia in enumerate(inertias):
        low, up = "abcd"[k], "ABCD"[k]
        rate = rates[k] if rates else 0.0
        m.add(fb.Body(low, mass=1.0, inertia=inertia, position=(k, 0), angular_velocity=rate))
        m.add(fb.Revolute(up, "ground", low, at=(k, 0)))
        if torques and torques[k]:
            m.add(fb.Motor(f"motor {up}", up, torque=torques[k]))
    return m


def run(m, t_end, coordinates, outputs=101, **more):
    """The motion, with the adaptive integrator."""
    return m.simulate(t_end, outputs=outputs, coordinates=coordinates, **TIGHT, **more)


def times(r, name):
    """When something happened to an element, what holds as the motion begins left out."""
    return np.array([e.t for e in r.events if name in e.name and e.t > 0.0])
