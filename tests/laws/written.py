"""Laws of time as programs, and their values by Python."""

from __future__ import annotations

import numpy as np

import flyball as fb
from flyball.laws.compilation import compile_law
from flyball.model.expressions import Expression

TABLES = (
    fb.Table("blow", x=[0, 3.3, 3.3005, 3.301, 10], y=[0, 0, 2000, 0, 0], interpolation="linear"),
    fb.Table("saw", x=[0, 0.3, 1], y=[0, 1, 0], interpolation="linear", beyond="repeat"),
    fb.Table("bow", x=[-3, -1, 0.5, 2, 4], y=[1, -1, 0, 3, 2], beyond="line"),
    fb.Table("rise", x=[-3, -1, 0.5, 2, 4], y=[0, 0, 1, 1, 2], interpolation="monotone", beyond="hold"),
)


def program(text: str) -> tuple[list[int], np.ndarray, int]:
    """Code, constants and start of a law of t, value, rate and the tables."""
    code: list[int] = []
    const: list[float] = []
    places = {}
    for table in TABLES:
        places[table.name] = len(const)
        const += table.data()
    law = Expression.parse(text, [table.name for table in TABLES])
    at, _ = compile_law(law, ["t", "value", "rate"], [], code, const, tables=places)
    return code, np.array(const), at


def values(text: str, t: np.ndarray) -> np.ndarray:
    """The law's values at times."""
    tables = {table.name: table for table in TABLES}
    with np.errstate(all="ignore"):
        return Expression.parse(text, list(tables)).evaluate({"t": t}, tables) + 0.0 * t
