"""Kinds of switches: constraint rows that are active at times, such as stops, friction and locks."""

from __future__ import annotations

STOP, FRICTION, ONE_WAY, LOCK, BRANCH, ELASTIC, RATCHET, SLIP, EDGE = range(9)
"""STOP: keeps its quantity between two bounds. FRICTION: holds its quantity until the force exceeds a limit. ONE_WAY:
allows positive rates only. LOCK: active or not as events say. BRANCH: a nonsmooth point of a law, without a row.
ELASTIC: a force, without a row, that pushes back beyond two bounds and never pulls. RATCHET: a stop at the last of many
teeth that was passed. SLIP: a tangent of a contact point that sticks or slides while its STOP is closed. EDGE: distance
of a contact point from the end of its face, without a row.
"""
FROZEN = 4.0
"""Direction value of an elastic switch that is open; one less: pressed at its upper side, one more: at its lower side.
A force formula that gets a value below `STATIC` plus one half determines its side itself.
"""
TURN = 1e-9
"""Rate, in lengths of the mechanism or rad at its own rate, at which a ratchet counts as reversed.

A ratchet at rest is so monitored for either direction in which it may start.
"""
STATIC = 2.0
"""Value in place of the sliding direction: effort formulas then return the largest value that can be held at rest."""
BY_RATE = 8.0
"""Value in place of the sliding direction: the sign of the rate is used, and zero effort at rest.

Used for friction on coordinates that a driver moves or that cannot move, which a row cannot hold.
"""
