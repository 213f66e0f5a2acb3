"""What the health of a motion that was computed in parts tells late."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

from ...results import doubts
from ...results.result import Result
from ..motion.residual import acceleration_violation


def finished(result: Result, parts: Sequence[Result]) -> Result:
    """The parts end to end, ``result``, with a health that knows what each of them does."""
    if len(parts) == 1:
        return result
    health = result.health
    health.late = {"mobility": parts[0].health.late["mobility"], "energy_drift": lambda: result.energy.drift}
    if isinstance(health.options.get("method"), Mapping):  # accelerations of steps by impulses are means
        health.late |= {
            "doubtful": partial(doubts.of_impulses, result),
            "warnings": partial(doubts.warnings_of_impulses, result),
        }
        return result
    health.late |= {
        "acceleration_violation": partial(acceleration_violation, result),
        "creep": partial(doubts.creep, result),
        "warnings": partial(doubts.warnings, result),
        "doubtful": partial(doubts.doubtful, result),
    }
    return result
