"""What surfaces are to each other, in arrays: carried beside the geometry, for whoever makes impulses of contacts."""

from __future__ import annotations

from typing import NamedTuple

from ..compiler.layout import Float2, Float3

# columns of Surfaces.pair
STATIC, KINETIC, RESTITUTION, ROLLING, SPINNING, ACROSS, STIFFNESS, MODULUS, EXPONENT, DISSIPATION, DAMPING = range(11)
WIDTH = 12


class Surfaces(NamedTuple):
    """Numbers of every pair of surfaces; which surface a shape has is its MATERIAL in the geometry.

    Friction with a grain is that along it. Where the grain stands square on the surface, that across it holds all
    around.
    """

    pair: Float3  # (k, k, 12): static and kinetic friction, restitution, rolling and spinning friction [m], how
    # many times as great both frictions are across the grain of one of the two (1: there is none); of the normal force
    # where it gives way (0 where it is hard): stiffness, or 4/3 E* [Pa] from which it follows, exponent of the overlap,
    # dissipation [s/m], damping [N s/m]; nan: they do not touch
    belt: Float2  # (ns, 3): velocity [m/s] of a shape's surface relative to its mover, in the mover's axes
    grain: Float2  # (ns, 3): direction (a unit vector, or 0) of its grain, in the mover's axes
