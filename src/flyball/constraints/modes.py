"""Kinds of rows that hold at times and let go at others."""

from __future__ import annotations

STOP, FRICTION, ONE_WAY, LOCK, BRANCH = range(5)
SLIP, EDGE = 7, 8
"""What keeps its quantity between two values; what holds it until too much pulls; what lets its rate be positive
only; what is held or not as events say; a corner of a law, which has no row. SLIP: a direction in which a place of
contact sticks or slides, as long as its STOP is closed. EDGE, which has no row: how far such a place is from the end of
the face that it is on."""
STATIC = 2.0
"""In place of the way of sliding: asks the effort of a force for the most that it holds at rest."""
