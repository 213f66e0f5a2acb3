"""What stops, ropes, freewheels and ratchets must have held: no bound is passed, and nothing pulls that can only push."""

from __future__ import annotations

import numpy as np

from flyball.constraints.switches.latches import ONE_WAY, RATCHET
from flyball.constraints.switches.stop import STOP
from flyball.model.contact_point import Touch
from flyball.results.result import Result

PAST, PULLED = 1e-7, 1e-6


def against(r: Result) -> str:
    """What was passed or pulled, in words; empty if nothing was."""
    numbers = r.values.system.switch_numbers
    for k, x in enumerate(r.values.structure.switches):
        e = x.element
        if (
            isinstance(e, Touch)
            or e.category not in ("forces", "limits")
            or x.switch.kind not in (STOP, ONE_WAY, RATCHET)
        ):
            continue
        told = r[e.name]
        rope = e.category == "forces"
        way = 1.0 if x.switch.kind == STOP else float(e.outward(r.values.numbers[e.name]))
        value, rate = way * (told.length if rope else told.value), way * told.rate
        push, closed = (told.tension, told.taut) if rope else (way * told.force, np.abs(told.closed))
        if x.switch.kind == STOP and not rope:
            push = push * told.closed
        past = {
            STOP: np.maximum(numbers.lower[k] - value, value - numbers.upper[k]),
            ONE_WAY: np.maximum.accumulate(value) - value,
            RATCHET: np.maximum.accumulate(value) - value - numbers.pitch[k],
        }[x.switch.kind]
        size = max(1.0, r.values.length)
        if past.max() > PAST * size:
            return f"{e.title} is passed by {past.max():.3g}"
        if x.switch.kind == ONE_WAY and -rate.min() > PAST * (size + np.abs(rate).max()):
            return f"{e.title} goes back with {-rate.min():.3g}"
        if -push.min() > PULLED * (1.0 + np.abs(push).max()):
            return f"{e.title} pulls with {-push.min():.3g} while it is closed: {closed[push.argmin()]:.0f}"
    return ""
