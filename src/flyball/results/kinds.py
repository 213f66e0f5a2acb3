"""Kinds that results tell apart, by the words that they print."""

PASSAGE, LOCK_UP, BIFURCATION, SELF_MOTION = "regular passage", "lock-up", "bifurcation", "self-motion"
"""Of singular positions."""

AT_ONCE = ("event", "impact", "kick", "jam", "rest", "turn", "hold", "leave")
SWITCHED = ("close", "open", "stick", "slip", "lock", "overrun", "latch", "unlatch", "taut", "slack", "touch", "part")
HAPPENED = frozenset((*AT_ONCE, *SWITCHED))
"""What happenings may be."""
