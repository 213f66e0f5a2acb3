"""Tangents of a contact point that stick or slide, and the distance of the point from the end of its face."""

from __future__ import annotations

from .switch_kind import DISC, G_CONE, G_EDGE, G_TURNS, SwitchKind

SLIP = SwitchKind(
    guards=(G_CONE, G_TURNS), forces=DISC, kinetic=True, numbers=("static_friction", "kinetic_friction"),
    role="has friction", closing=("stick", "sticks"), opening=("slip", "slides"),
)  # fmt: skip
"""A tangent that sticks or slides while the gap of its contact point is closed."""
EDGE = SwitchKind(guards=(G_EDGE,), numbers=())
"""The distance of a contact point from the end of its face, without a row."""
