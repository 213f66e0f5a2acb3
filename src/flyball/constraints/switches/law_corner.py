"""Corners of laws: arguments of ``abs``, ``max``, ``where`` whose sign selects the branch of a law."""

from __future__ import annotations

from .guard_kinds import G_CORNER
from .switch_kind import SwitchKind

CORNER = SwitchKind(guards=(G_CORNER,), numbers=())
"""A nonsmooth point of a law, without a row."""
