"""Faces with a round edge: polygons whose corners lie on it."""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt

CORNERS_OF_DISC = 8
UPRIGHT = 1e-4  # lean [rad] below which the corners stay where they are in the shape
HALF = sqrt(0.5)


@formula
def across(d):
    """Unit vector (x, y) along which d leans away from z, and by how much; x where it does not."""
    s = sqrt(d[0] * d[0] + d[1] * d[1])
    return ((d[0] / s, d[1] / s) if s > 0.0 else (1.0, 0.0)), s


@formula
def disc(r, z, up, d, room, at):
    """Corners of the disc of radius r at height z that looks up (1) or down (-1): how many.

    Where d leans, the first corner is the point of the disc that is farthest along d, so that a tilted disc touches
    with its very rim.
    """
    (x, y), s = across(d)
    if s < UPRIGHT:
        x, y = 1.0, 0.0
    x, y = r * x, r * y
    for k in range(CORNERS_OF_DISC):
        room[at + k, 0], room[at + k, 1], room[at + k, 2] = x, y, z
        x, y = HALF * (x - up * y), HALF * (y + up * x)
    return CORNERS_OF_DISC
