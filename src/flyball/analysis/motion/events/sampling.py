"""When the sampled controllers of a motion are sampled, and by which laws."""

from __future__ import annotations

import math

import numpy as np

from ....equations.sampled import NEAR, Samples, Sampling
from ....numerics.integrators.tableaux import Tableau, tableau
from ...compiled import Compiled

LOWER = "rk45"  # for short intervals


def sampling(c: Compiled, R: Tableau, lower: bool, span: tuple[float, float], rows: tuple[int, int]) -> Sampling | None:
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
    first = [max(0, math.ceil((span[0] - offset) / period - NEAR)) for period, offset in clocks]
    plan = Samples(
        np.array(list(clocks), float),
        np.array(first, np.int64),
        np.array(table, np.int64),
        np.zeros(len(table)),
        np.array([span[1]]),
        np.array([1 if lower else -1, 1, 0, 0], np.int64),
    )
    return Sampling(plan, R, tableau(LOWER), *rows)
