"""Sampled controllers: their sampling instants in a motion, and messages where there are too many or none."""

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
    0.5  # if at least this part of the steps end at sampling instants, sampling is named as the reason for their number
)


PERIOD_REMEDY = "Give a longer period (it is in seconds, or a text such as '1 ms'), or more steps (max_steps=)"


class SampledController(NamedTuple):
    """A sampled controller."""

    title: str
    period: float
    offset: float

    def between(self, a: float, b: float) -> int:
        """Return the number of sampling instants after ``a`` and before ``b``."""
        first = max(0, math.floor((a - self.offset) / self.period + INSTANT_TOLERANCE) + 1)
        return max(0, math.ceil((b - self.offset) / self.period - INSTANT_TOLERANCE) - first)

    def description(self, a: float, b: float) -> str:
        """Describe how many sampling instants lie between two times."""
        return (
            f"{self.title} has a period of {self.period:g} s: from t = {a:.6g} s to the end at {b:.6g} s it is sampled "
            f"{self.between(a, b):.3g} times, and each ends a step"
        )


def sampled_by_period(c: CompiledMechanism) -> list[SampledController]:
    """Return the sampled controllers, shortest period first."""
    s, numbers = c.structure, c.values.numbers
    if not s.sampled:
        return []
    names = dict.fromkeys(name for name, *_ in s.sampled)
    found = [SampledController(s.model[k].title, float(numbers[k].period), float(numbers[k].offset)) for k in names]
    return sorted(found, key=lambda x: x.period)


def refuse_too_often(c: CompiledMechanism, span: tuple[float, float], most: int) -> None:
    """Refuse a motion with more sampling instants than ``max_steps``, unless an event could end it earlier.

    Raises
    ------
    ModelError
        Naming the controller, its period and the number of instants.
    """
    for x in [] if c.structure.model.events else sampled_by_period(c)[:1]:
        if x.between(*span) > most:
            raise ModelError(f"{x.description(*span)}; max_steps = {most}. {PERIOD_REMEDY}")


def sampling_limits_steps(c: CompiledMechanism, clock: ex.StepState, t_start: float) -> str:
    """Name the controller whose sampling causes most steps, and the instants still to come; empty if there is none."""
    t, end = float(clock.real.t), _end_of_motion(clock)
    for x in sampled_by_period(c)[:1]:
        if x.between(t_start, t) >= SAMPLING_SHARE * clock.count.accepted:
            return (
                f"max_steps = {clock.count.limit} steps were taken up to t = {t:.6g} s. {x.description(t, end)}. "
                f"{PERIOD_REMEDY}"
            )
    return ""


def never_sampled(c: CompiledMechanism, clock: ex.StepState) -> tuple[str, ...]:
    """Return remarks on controllers whose first instant lies beyond the end; none where events might change that."""
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
    """Return the end time of the motion [s]; the end time of the loop may be earlier."""
    return float(max(clock.real.t_end, clock.times[-1] if len(clock.times) else -math.inf))


# The sampling schedule of a motion.


LOW_ORDER_METHOD = "rk45"  # for short intervals


def sampling(
    c: CompiledMechanism, R: Tableau, lower: bool, span: tuple[float, float], rows: tuple[int, int]
) -> SampledControllers | None:
    """Return the sampled controllers of a mechanism with their schedule between two times; None if there are none.

    Parameters
    ----------
    c : CompiledMechanism
    R : Tableau
    lower : bool
        Whether a method of lower order may be used where intervals are short.
    span : (float, float)
        First and last time [s]; at the last nothing is sampled.
    rows : (int, int)
        Width of an output row, and number of rows in the buffer.
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
