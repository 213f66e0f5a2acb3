"""The narrow phase behind a door: the search is compiled without it, and a pile of spheres never compiles it."""

from __future__ import annotations

from ..compiler.door import door
from .desk import ASKED_1, ASKED_2, REACH
from .narrow import collide


@door
def between(G, M, B, C, D, task):
    """Contacts of the two shapes that ``B`` names, into its ``room``: how many; C and D are not read."""
    return collide(G, M, B.count[ASKED_1], B.count[ASKED_2], B.real[REACH], B.room)


@door
def nothing(G, M, B, C, D, task):
    """No contacts: stands for `between` where no pair asks for it."""
    return 0
