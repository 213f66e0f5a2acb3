"""What a mover carries, in the world: vectors of its axes, velocities of its points."""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.vec import add, cross, load3, load9, mv, sub


@formula
def rotated(M, m, a):
    """A vector in the axes of mover m, along the world's."""
    return mv(load9(M.pose, m, 3), a)


@formula
def velocity_there(M, m, a):
    """Velocity of the point that is at a, along the world's axes, from the origin of mover m."""
    return add(load3(M.twist, m, 0), cross(load3(M.twist, m, 3), a))


@formula
def velocity(M, m, p):
    """Velocity of mover m at a point of the world; of what stands still (-1) there is none."""
    if m < 0:
        return (0.0, 0.0, 0.0)
    return velocity_there(M, m, sub(p, load3(M.pose, m, 0)))
