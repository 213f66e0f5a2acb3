"""Kinds that results tell apart, by the words that they print."""

PASSAGE, LOCK_UP, BIFURCATION, SELF_MOTION = "regular passage", "lock-up", "bifurcation", "self-motion"
"""Of singular positions."""
