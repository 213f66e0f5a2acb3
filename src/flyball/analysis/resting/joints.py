"""Closed contacts as joints, by which what is linear knows them: exact to second order, as stiffness needs it.

What sticks is a common point where one side is sharp, and rolls where it is round; what is smooth keeps its height. The
joints are given by their frames as the mechanism is drawn, and stay rows in any coordinates.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import ClassVar

import numpy as np

from ...constraints.blocks import COMMON_POINT, CONSTANT_DISTANCE, IN_PLANE, ON_PLANE, Row, no_slip
from ...model.element import element
from ...model.joint import Joint, WorldFrame

Rows = tuple[tuple[float, ...], ...]


@element
class ClosedContact(Joint):
    """A closed contact between frames F on ``body_i`` and M on ``body_j``.

    Parameters
    ----------
    name : str
    body_i, body_j : str
    frames : two tuples of 12 numbers
        F and M in the world as drawn: origin, rotation row by row.
    radii : tuple of two numbers [m]
        Of a disk, and of a ball; or the length of a link.
    """

    frames: tuple[tuple[float, ...], tuple[float, ...]]
    radii: tuple[float, float] = (0.0, 0.0)

    planar_normal: ClassVar[str] = "y"  # z is the normal of the contact
    drawn: ClassVar[str] = "point_in_plane"

    def placed(self, n: SimpleNamespace, planar: bool) -> dict[str, WorldFrame]:
        """Its frames."""
        F, M = (
            (np.array(x[:3], float), np.array(x[3:], float).reshape(3, 3)) for x in (self.frames[0], self.frames[1])
        )
        return {"F": F, "M": M}


@element
class CommonPoint(ClosedContact):
    """A sharp side sticks."""

    blocks: ClassVar = COMMON_POINT
    drawn: ClassVar[str] = "spherical"


@element
class PointOnFlat(ClosedContact):
    """A point M slides on a plane z = 0 of F; a ball's centre above it at the radius of the ball."""

    blocks: ClassVar = (IN_PLANE,)

    def constants(self, n: SimpleNamespace, row: Row, F: WorldFrame, M: WorldFrame) -> tuple[float, ...]:
        """The height."""
        return (*row.par[:6], self.radii[1])


@element
class SlidingDisk(ClosedContact):
    """A disk M slides on a plane z = 0 of F."""

    blocks: ClassVar[tuple[Row, ...]] = (ON_PLANE,)

    def constants(self, n: SimpleNamespace, row: Row, F: WorldFrame, M: WorldFrame) -> tuple[float, ...]:
        """The radii."""
        return (*row.par[:3], *self.radii, row.par[5], 0.0)


@element
class Rolling(SlidingDisk):
    """A ball or disk M rolls on a plane z = 0 of F."""

    blocks: ClassVar[tuple[Row, ...]] = (ON_PLANE, no_slip("x"), no_slip("y"))
    drawn: ClassVar[str] = "rolling"


@element
class Centres(ClosedContact):
    """Two balls, or a ball and a corner, that slide on each other: their centres keep their distance."""

    blocks: ClassVar = CONSTANT_DISTANCE
    drawn: ClassVar[str] = "link"

    def constants(self, n: SimpleNamespace, row: Row, F: WorldFrame, M: WorldFrame) -> tuple[float, ...]:
        """The distance."""
        return (*row.par[:6], self.radii[1])
