"""Friction: a row holds its quantity up to a limit of its force; the element is a force while it slides."""

from __future__ import annotations

import numpy as np

from ...numerics.complementarity.dense_problem import AT_REST, FRICTION_LINE, SLIDING
from .switch_kind import BY_RATE, G_HOLDS, G_SLIDES, INTERVAL, OFF, STATIC, Instant, ProblemRow, SwitchKind


class Friction(SwitchKind):
    """A row whose limit follows from the law of its element; only a limit that depends on a load carries impulses."""

    def velocity_rows(self, n: Instant, s: int, at: tuple[float, ...], still: bool) -> list[ProblemRow]:
        """Return its row if its limit depends on a load."""
        if not n.is_loaded(s):
            return []
        held = still or n.mode[s] != OFF
        way, rate = (STATIC, 0.0) if held else (sign_of(n.rate[s]), n.rate[s])
        return [ProblemRow(s, FRICTION_LINE, 1.0, way, rate, state=AT_REST)]

    def acceleration_rows(self, n: Instant, s: int, at: tuple[float, ...], still: bool) -> list[ProblemRow]:
        """Return its row: sticking at rest, or sliding under a load."""
        if still:
            return [ProblemRow(s, FRICTION_LINE, way=STATIC, state=AT_REST)]
        if not n.is_loaded(s):
            return []
        sign = sign_of(n.rate[s])
        return [ProblemRow(s, SLIDING, way=sign, rate=float(n.rate[s]), direction=sign)]

    def direction(self, n: Instant, s: int, still: bool, in_problem: bool) -> float:
        """Return the sign of the rate; at rest zero, or `BY_RATE` if no row can hold it."""
        return float(np.sign(n.rate[s])) if not still else 0.0 if in_problem else BY_RATE

    def push_direction(self, x: float, bounds: tuple[float, float], near: float) -> float:
        """Return 0: it holds either way."""
        return 0.0


def sign_of(x: float) -> float:
    """Return 1 for a positive number, else -1."""
    return 1.0 if x > 0.0 else -1.0


FRICTION = Friction(
    guards=(G_HOLDS, G_SLIDES), forces=INTERVAL, kinetic=True, role="has friction",
    closing=("stick", "sticks"), opening=("slip", "slides"), states=("sticks", "slides"),
)  # fmt: skip
"""Friction of a joint, a brake, a clutch."""
