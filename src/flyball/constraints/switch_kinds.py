"""Kinds of switches: constraint rows that hold at times, as stops, friction and locks do."""

from __future__ import annotations

STOP, FRICTION, ONE_WAY, LOCK, BRANCH, ELASTIC, RATCHET, SLIP, EDGE = range(9)
"""What keeps its quantity between two values; what holds it until too much pulls; what lets its rate be positive
only; what is held or not as events say; a corner of a law, which has no row; what pushes back beyond two values and
never pulls, a force without a row; a stop at the last of many teeth that was passed; a direction in which a place of
contact sticks or slides, as long as its STOP is closed; how far such a place is from the end of its face, without a
row."""
FROZEN = 4.0
"""Way of an elastic switch that is open; one less: pressed at its upper side, one more: at its lower. A force that is
told anything less than `STATIC` and a half looks where it is by itself."""
TURN = 1e-9
"""Rate, in lengths of the mechanism or rad at its own rate, at which a ratchet has turned round: so one at rest is
watched whichever way it begins to go."""
STATIC = 2.0
"""In place of the way of sliding: asks the effort of a force for the most that it holds at rest."""
BY_RATE = 8.0
"""In place of the way of sliding: that of the rate, and none at rest. Of friction on what nothing free moves, which a
row cannot hold: a coordinate that a driver moves, or that cannot move at all."""
