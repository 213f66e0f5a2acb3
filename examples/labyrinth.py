"""A ball in a tilting labyrinth: two drivers tilt the board, the ball rolls along its walls.

Run it with ``flyball run examples/labyrinth.py --t-end 6 --outputs 181 --out out``.
"""

import math

import flyball as fb

SIDE, THICK, HIGH = 0.3, 0.01, 0.014  # of the board and its walls [m]
RADIUS = 0.012  # of the ball
WALLS = (  # middle x, y; length, direction
    (0.0, SIDE / 2, SIDE, "x"),
    (0.0, -SIDE / 2, SIDE, "x"),
    (SIDE / 2, 0.0, SIDE, "y"),
    (-SIDE / 2, 0.0, SIDE, "y"),
    (-0.03, 0.07, 0.24, "x"),
    (0.03, -0.0, 0.24, "x"),
    (-0.03, -0.07, 0.24, "x"),
)


def mechanism(tilt: float = 0.08) -> fb.Mechanism:
    """Tilted by up to ``tilt`` [rad] about both axes."""
    m = fb.Mechanism("labyrinth", gravity=(0, 0, -9.81), parameters={"tilt": tilt})
    edges = {"x": lambda a: (a + THICK, THICK, HIGH), "y": lambda a: (THICK, a + THICK, HIGH)}
    walls = [fb.Box(edges=edges[way](a), position=(x, y, HIGH / 2)) for x, y, a, way in WALLS]
    board = fb.Box(edges=(SIDE + THICK, SIDE + THICK, THICK), position=(0, 0, -THICK / 2))
    start = (-SIDE / 2 + 0.03, SIDE / 2 - 0.03, RADIUS)
    m.add(
        fb.Body("board", shape=(board, *walls), density=600, color="#d8b98c"),
        fb.Body("ball", shape=fb.Sphere(radius=RADIUS), density=7800, position=start, color="#2f6fb7"),
        fb.Universal("gimbal", "ground", "board", at=(0, 0, 0), axes=((1, 0, 0), (0, 1, 0))),
        fb.Driver("about x", "gimbal.angle_1", "0.7*tilt*(1 - cos(0.5*t))"),
        fb.Driver("about y", "gimbal.angle_2", f"tilt*sin({math.pi / 2:.6f}*t)"),
        fb.Contact(friction=0.4),
    )
    return m
