"""Contacts at one point: of balls, and of what is a ball where it is nearest."""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from ...math.vec import add, dot, put3, scale, sub


@formula
def point(p, n, gap, name, room, k):
    """Write a contact."""
    put3(room, k, 0, p)
    put3(room, k, 3, n)
    room[k, 6], room[k, 7] = gap, name


@formula
def towards(a, b):
    """The unit vector from a to b and their distance; x where they are one point (or so near that it has no unit)."""
    d = sub(b, a)
    length = sqrt(dot(d, d))
    if length < 1e-150:
        return (1.0, 0.0, 0.0), 0.0
    return scale(1.0 / length, d), length


@formula
def balls(a, r, b, s, reach, room, k, name):
    """The contact of balls about a and b of radius r and s into row k, if it is within reach: 1 or 0."""
    n, length = towards(a, b)
    gap = length - r - s
    if not gap <= reach:
        return 0
    point(add(a, scale(r + 0.5 * gap, n)), n, gap, name, room, k)
    return 1
