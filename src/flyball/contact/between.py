"""The narrow phase behind doors: the search is compiled without it, and nobody compiles shapes that are not there.

Each door writes the contacts of the two shapes that ``B`` names into its ``room`` and returns how many; C and D are not
read.
"""

from __future__ import annotations

from ..compiler.kernels import Kernel, kernel
from .broad.desk import ASKED_1, ASKED_2, REACH, Search
from .kinds import FIELD, PLANAR
from .narrow.collide import collide, collide_convex, collide_planar
from .tables import Geometry, Movers


@kernel
def between(G: Geometry, M: Movers, B: Search, C: Search, D: Search, task: int) -> int:
    """Of any kind."""
    return collide(G, M, B.count[ASKED_1], B.count[ASKED_2], B.real[REACH], B.room)


@kernel
def between_convex(G: Geometry, M: Movers, B: Search, C: Search, D: Search, task: int) -> int:
    """Of convex kinds."""
    return collide_convex(G, M, B.count[ASKED_1], B.count[ASKED_2], B.real[REACH], B.room)


@kernel
def between_planar(G: Geometry, M: Movers, B: Search, C: Search, D: Search, task: int) -> int:
    """Of the kinds of planar mechanisms."""
    return collide_planar(G, M, B.count[ASKED_1], B.count[ASKED_2], B.real[REACH], B.room)


@kernel
def nothing(G: Geometry, M: Movers, B: Search, C: Search, D: Search, task: int) -> int:
    """No contacts: stands for `between` where no pair asks for it."""
    return 0


def door_for(kinds: set[int]) -> Kernel:
    """The one to compile for shapes of these kinds."""
    if kinds <= PLANAR:
        return between_planar
    return between if FIELD in kinds else between_convex
