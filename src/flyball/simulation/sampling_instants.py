"""Sampled controllers: their sampling instants in a motion, and messages where they are far too many or none."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..assembly.compiled_mechanism import CompiledMechanism
from ..engine.sampled_controllers import INSTANT_TOLERANCE, SampledControllers, SamplePlan
from ..errors import ModelError
from ..numerics.integrators import time_loop as ex
from ..numerics.integrators.butcher_tableaux import Tableau, tableau

SAMPLING_SHARE = (
    0.5  # part of all steps that end where a controller is sampled, from which on that is why they are many
)


PERIOD_REMEDY = "Give a longer period (it is in seconds, or a text such as '1 ms'), or more steps (max_steps=)"


class SampledController(NamedTuple):
    """A sampled controller."""

    title: str
    period: float
    offset: float

    def between(self, a: float, b: float) -> int:
        """At how many instants after ``a`` and before ``b`` it is sampled."""
        first = max(0, math.floor((a - self.offset) / self.period + INSTANT_TOLERANCE) + 1)
        return max(0, math.ceil((b - self.offset) / self.period - INSTANT_TOLERANCE) - first)

    def told(self, a: float, b: float) -> str:
        """How many instants lie between two times, in words."""
        return (
            f"{self.title} has a period of {self.period:g} s: from t = {a:.6g} s to the end at {b:.6g} s it is sampled "
            f"{self.between(a, b):.3g} times, and each ends a step"
        )


def sampled_by_period(c: CompiledMechanism) -> list[SampledController]:
    """The sampled controllers, the one of the shortest period first."""
    s, numbers = c.structure, c.values.numbers
    if not s.sampled:
        return []
    names = dict.fromkeys(name for name, *_ in s.sampled)
    found = [SampledController(s.model[k].title, float(numbers[k].period), float(numbers[k].offset)) for k in names]
    return sorted(found, key=lambda x: x.period)


def refuse_too_often(c: CompiledMechanism, span: tuple[float, float], most: int) -> None:
    """Refuse a motion that has more instants of sampling than it may have steps, where no event can end it before.

    Raises
    ------
    ModelError
        Naming the controller, its period and how many instants there are.
    """
    for x in [] if c.structure.model.events else sampled_by_period(c)[:1]:
        if x.between(*span) > most:
            raise ModelError(f"{x.told(*span)}; max_steps = {most}. {PERIOD_REMEDY}")


def sampling_limits_steps(c: CompiledMechanism, clock: ex.StepState, t_start: float) -> str:
    """Which controller it is for whose sake steps are so many, and what lies ahead; nothing if it is none."""
    t, end = float(clock.real.t), _end_of_motion(clock)
    for x in sampled_by_period(c)[:1]:
        if x.between(t_start, t) >= SAMPLING_SHARE * clock.count.accepted:
            return (
                f"max_steps = {clock.count.limit} steps were taken by t = {t:.6g} s. {x.told(t, end)}. {PERIOD_REMEDY}"
            )
    return ""


def never_sampled(c: CompiledMechanism, clock: ex.StepState) -> tuple[str, ...]:
    """What to say of controllers whose first instant lies beyond the end; nothing where events might change that."""
    if c.structure.model.events or not c.structure.sampled:
        return ()
    end = _end_of_motion(clock)
    return tuple(
        f"{x.title} is never sampled: its first instant is at offset = {x.offset:g} s, the motion ends at {end:.6g} s; "
        f"its signals are 0 all the time"
        for x in sampled_by_period(c)
        if x.offset >= end - INSTANT_TOLERANCE * x.period
    )


def _end_of_motion(clock: ex.StepState) -> float:
    """When a motion ends [s]: what is integrated at once may end before."""
    return float(max(clock.real.t_end, clock.times[-1] if len(clock.times) else -math.inf))


# When the sampled controllers of a motion are sampled, and by which laws.


LOW_ORDER_METHOD = "rk45"  # for short intervals


def sampling(
    c: CompiledMechanism, R: Tableau, lower: bool, span: tuple[float, float], rows: tuple[int, int]
) -> SampledControllers | None:
    """What samples the controllers of a mechanism between two times; None if none is sampled.

    Parameters
    ----------
    c : Compiled
    R : Tableau
    lower : bool
        Whether a method of lower order may be taken where intervals are short.
    span : (float, float)
        First and last time [s]; at the last nothing is sampled.
    rows : (int, int)
        Width of a row of output, and how many there is room for.
    """
    s, numbers = c.structure, c.values.numbers
    if not s.sampled:
        return None
    clocks: dict[tuple[float, float], int] = {}
    table = []
    for name, state, law, later in s.sampled:
        n = numbers[name]
        table.append((clocks.setdefault((n.period, n.offset), len(clocks)), state, law, later))
    first = [max(0, math.ceil((span[0] - offset) / period - INSTANT_TOLERANCE)) for period, offset in clocks]
    plan = SamplePlan(
        np.array(list(clocks), float),
        np.array(first, np.int64),
        np.array(table, np.int64),
        np.zeros(len(table)),
        np.array([span[1]]),
        np.array([1 if lower else -1, 1, 0, 0], np.int64),
    )
    return SampledControllers(plan, R, tableau(LOW_ORDER_METHOD), *rows)
