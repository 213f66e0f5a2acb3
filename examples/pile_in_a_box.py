"""Balls and bricks poured into a box: they come to rest, and the box carries their weight.

Run it with ``flyball run examples/pile_in_a_box.py --t-end 3 --outputs 91 --out out``.
"""

import numpy as np

import flyball as fb

SIDE, TALL, THICK = 1.0, 0.6, 0.04  # of the box [m]
PITCH, ROW = 0.16, 5  # distance of what is poured, and how many lie in a row


def mechanism(count: int = 200) -> fb.Mechanism:
    """``count`` bodies, every other one a brick."""
    m = fb.Mechanism("pile in a box", gravity=(0, 0, -9.81))
    across, wide = (SIDE + THICK) / 2, SIDE + 2 * THICK
    walls = [fb.Box(edges=(wide, THICK, TALL), position=(0, y, TALL / 2)) for y in (-across, across)]
    walls += [fb.Box(edges=(THICK, SIDE, TALL), position=(x, 0, TALL / 2)) for x in (-across, across)]
    bottom = fb.Box(edges=(wide, wide, THICK), position=(0, 0, -THICK / 2))
    k = np.arange(count)
    rows = np.stack([k % ROW, k // ROW % ROW, k // ROW**2], axis=1) - ((ROW - 1) / 2, (ROW - 1) / 2, 0)
    start = PITCH * rows + (0, 0, 0.12)
    start[:, :2] += np.random.default_rng(1).uniform(-0.01, 0.01, (count, 2))
    m.add(
        fb.Ground("box", shape=[bottom, *walls], color="#9aa6b3"),
        fb.Ground("floor", shape=fb.Plane(position=(0, 0, -THICK))),
        fb.Bodies("balls", shape=fb.Sphere(radius=0.06), density=1000, position=start[::2], color="#e5862b"),
        fb.Bodies("bricks", shape=fb.Box(edges=(0.14, 0.1, 0.07)), density=1000, position=start[1::2], color="#2f6fb7"),
        fb.Contact(friction=0.4),
    )
    return m
