"""A wrecking ball on a rope swings into a wall of bricks.

The wall is one set of bodies; the rope pulls and never pushes.

Run it with ``flyball run examples/wrecking_ball.py --t-end 3 --outputs 91 --out out``.
"""

import math

import numpy as np

import flyball as fb

BRICK = (0.25, 0.12, 0.1)  # along the wall, across, high [m]
RADIUS, ROPE, TOP = 0.2, 2.6, 3.2  # of the ball; length to its middle; height of the hook [m]


def wall(rows: int, columns: int) -> np.ndarray:
    """Middles of bricks in running bond, in the plane x = 0; every other row is shorter by one."""
    length, _, high = BRICK
    out = []
    for row in range(rows):
        n = columns - row % 2
        out += [(0.0, (k - (n - 1) / 2) * length * 1.002, (row + 0.5) * high) for k in range(n)]
    return np.array(out)


def mechanism(rows: int = 10, columns: int = 8, angle: float = 0.9) -> fb.Mechanism:
    """The ball is let go at ``angle`` [rad] from the vertical."""
    m = fb.Mechanism("wrecking ball", gravity=(0, 0, -9.81))
    hook = (-0.3, 0.0, TOP)
    start = (hook[0] - ROPE * math.sin(angle), 0.0, TOP - ROPE * math.cos(angle))
    m.add(
        fb.Ground("floor", shape=fb.Plane()),
        fb.Bodies(
            "bricks",
            shape=fb.Box(edges=(BRICK[1], BRICK[0], BRICK[2])),
            density=1800,
            position=wall(rows, columns),
            color="#b0673f",
        ),
        fb.Body("ball", shape=fb.Sphere(radius=RADIUS), density=7000, position=start, color="#3a4450"),
        fb.Rope("rope", ("ground", "ball"), at=(hook, start), stiffness="2e6 N/m", damping="2e4 N*s/m", length=ROPE),
        fb.Contact(friction=0.6),
    )
    return m
