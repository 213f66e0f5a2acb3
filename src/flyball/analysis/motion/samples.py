"""How often the sampled controllers of a motion are sampled: too often to be meant, or never."""

from __future__ import annotations

import math
from typing import NamedTuple

from ...equations.sampled import NEAR
from ...errors import ModelError
from ...numerics.integrators import clock as ex
from ..compiled import Compiled

SHARE = 0.5  # part of all steps that end where a controller is sampled, from which on that is why they are many


REMEDY = "Give a longer period (it is in seconds, or a text such as '1 ms'), or more steps (max_steps=)"


class Often(NamedTuple):
    """A sampled controller."""

    title: str
    period: float
    offset: float

    def between(self, a: float, b: float) -> int:
        """At how many instants after ``a`` and before ``b`` it is sampled."""
        first = max(0, math.floor((a - self.offset) / self.period + NEAR) + 1)
        return max(0, math.ceil((b - self.offset) / self.period - NEAR) - first)

    def told(self, a: float, b: float) -> str:
        """How many instants lie between two times, in words."""
        return (
            f"{self.title} has a period of {self.period:g} s: from t = {a:.6g} s to the end at {b:.6g} s it is sampled "
            f"{self.between(a, b):.3g} times, and each ends a step"
        )


def often(c: Compiled) -> list[Often]:
    """The sampled controllers, the one of the shortest period first."""
    s, numbers = c.structure, c.values.numbers
    if not s.sampled:
        return []
    names = dict.fromkeys(name for name, *_ in s.sampled)
    found = [Often(s.model[k].title, float(numbers[k].period), float(numbers[k].offset)) for k in names]
    return sorted(found, key=lambda x: x.period)


def refuse_too_often(c: Compiled, span: tuple[float, float], most: int) -> None:
    """Refuse a motion that has more instants of sampling than it may have steps, where no event can end it before.

    Raises
    ------
    ModelError
        Naming the controller, its period and how many instants there are.
    """
    for x in [] if c.structure.model.events else often(c)[:1]:
        if x.between(*span) > most:
            raise ModelError(f"{x.told(*span)}; max_steps = {most}. {REMEDY}")


def too_often(c: Compiled, clock: ex.Clock, begun: float) -> str:
    """Which controller it is for whose sake steps are so many, and what lies ahead; nothing if it is none."""
    t, end = float(clock.real.t), _end(clock)
    for x in often(c)[:1]:
        if x.between(begun, t) >= SHARE * clock.count.accepted:
            return f"max_steps = {clock.count.limit} steps were taken by t = {t:.6g} s. {x.told(t, end)}. {REMEDY}"
    return ""


def never(c: Compiled, clock: ex.Clock) -> tuple[str, ...]:
    """What to say of controllers whose first instant lies beyond the end; nothing where events might change that."""
    if c.structure.model.events or not c.structure.sampled:
        return ()
    end = _end(clock)
    return tuple(
        f"{x.title} is never sampled: its first instant is at offset = {x.offset:g} s, the motion ends at {end:.6g} s; "
        f"its signals are 0 all the time"
        for x in often(c)
        if x.offset >= end - NEAR * x.period
    )


def _end(clock: ex.Clock) -> float:
    """When a motion ends [s]: what is integrated at once may end before."""
    return float(max(clock.real.t_end, clock.times[-1] if len(clock.times) else -math.inf))
