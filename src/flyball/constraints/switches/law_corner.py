"""Corners of laws: arguments of ``abs``, ``max``, ``where`` whose sign selects the branch of a law."""

from __future__ import annotations

from .switch_kind import G_CORNER, SwitchKind

CORNER = SwitchKind(guards=(G_CORNER,), numbers=())
"""A nonsmooth point of a law, without a row."""
