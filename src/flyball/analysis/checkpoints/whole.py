"""What the health of a motion that was computed in parts tells late."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from functools import partial
from typing import Any

from ...results import doubts
from ...results.result import Result
from ..motion.impulse.ending import made_energy
from ..motion.residual import acceleration_violation


def finished(result: Result, parts: Sequence[Result]) -> Result:
    """The parts end to end, ``result``, with a health that knows what each of them does."""
    if len(parts) == 1:
        return result
    health, late = result.health, parts[0].health.late
    found: dict[str, Any] = {
        "mobility": late["mobility"],
        "energy_drift": lambda: result.energy.drift,
        "acceleration_violation": partial(acceleration_violation, result),
        "creep": partial(doubts.creep, result),
        "warnings": partial(doubts.warnings, result),
    }
    health.late = {name: find for name, find in found.items() if name in late}
    if health.contact is not None:
        health.contact = dataclasses.replace(health.contact, notes=made_energy(result))
    return result
