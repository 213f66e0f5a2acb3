"""Scenes of contact: a floor, which may be a slope, and what is put on it."""

import numpy as np

import flyball as fb

G = 9.81
BOX = fb.Box(edges=(0.2, 0.2, 0.1))


def floor(slope=0.0, planar=False, **contact):
    """A plane, and gravity that is inclined by ``slope`` degrees towards x; everything touches it."""
    a = np.radians(slope)
    down = (G * np.sin(a), -G * np.cos(a)) if planar else (G * np.sin(a), 0, -G * np.cos(a))
    m = fb.Mechanism("scene", planar=planar, gravity=down)
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1) if planar else None)))
    m.add(fb.Contact(**contact))
    return m


def stepped(m, span, step, outputs=2, **choices):
    """Simulate by steps of ``step`` seconds."""
    return m.simulate(span, outputs=outputs, method=fb.Stepping(step=step, **choices))
