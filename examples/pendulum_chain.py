"""A chain of n rods, 1 m and 1 kg in all, let go straight at 30 degrees below the horizontal.

Run it with ``flyball run examples/pendulum_chain.py --t-end 10 --out out``.
"""

import math

import flyball as fb


def mechanism(links: int = 10) -> fb.Mechanism:
    """A hanging chain of ``links`` equal rods."""
    m = fb.Mechanism(f"chain of {links}", planar=True, gravity=(0, -9.81))
    length = 1 / links
    c, s = math.cos(math.radians(-30)), math.sin(math.radians(-30))
    before = "ground"
    for i in range(links):
        start, middle = i * length, (i + 0.5) * length
        m.add(
            fb.Body(f"rod {i}", mass=length, inertia=length**3 / 12, position=(middle * c, middle * s), angle="-30 deg")
        )
        m.add(fb.Revolute(f"joint {i}", before, f"rod {i}", at=(start * c, start * s)))
        before = f"rod {i}"
    return m
