"""A winding row of dominoes: the first one is pushed over, and the wave runs on at a speed of its own.

Run it with ``flyball run examples/dominoes.py --t-end 4 --outputs 121 --out out``.
"""

import numpy as np

import flyball as fb

THICK, WIDE, TALL = 0.008, 0.024, 0.048  # of a domino [m]
GAP = 0.024  # from one to the next [m]
PUSH = 6.0  # angular velocity of the first one [rad/s]


def mechanism(count: int = 100, bend: float = 1.2) -> fb.Mechanism:
    """``count`` dominoes; the row turns by ``bend`` [rad] to the left and to the right."""
    m = fb.Mechanism("dominoes", gravity=(0, 0, -9.81))
    heading = bend * np.sin(2 * np.pi * np.arange(count) / 50)
    steps = GAP * np.stack([np.cos(heading), np.sin(heading), 0 * heading], axis=1)
    start = np.cumsum(steps, axis=0)
    start[:, 2] = TALL / 2
    turn = np.stack([np.cos(heading / 2), 0 * heading, 0 * heading, np.sin(heading / 2)], axis=1)
    w, v = np.zeros((count, 3)), np.zeros((count, 3))
    w[0, 1], v[0, 0] = PUSH, PUSH * TALL / 2
    m.add(
        fb.Ground("table", shape=fb.Plane()),
        fb.Bodies(
            "dominoes",
            shape=fb.Box(edges=(THICK, WIDE, TALL)),
            density=1200,
            position=start,
            orientation=turn,
            velocity=v,
            angular_velocity=w,
            color="#c8465a",
        ),
        fb.Contact(friction=0.3),
    )
    return m
