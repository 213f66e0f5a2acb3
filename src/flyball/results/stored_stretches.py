"""What held between the events of a result as the arrays that its file holds, and back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..tables.values import Values, values
from .stretches import Stretch, stretched

if TYPE_CHECKING:
    from .result import Result

FIRST = "stretch_"
ARRAYS = ("rows", "lost", "given", "switch", "end")


def packed(result: Result) -> dict[str, np.ndarray]:
    """Arrays by name, none that are empty; none at all where nothing can switch."""
    if result.stretches is None:
        return {}
    every = result.stretches.all
    out = {FIRST + name: np.array([getattr(x, name) for x in every], float) for name in ARRAYS}
    out[FIRST + "sigma"] = result.stretches.sigma
    out[FIRST + "last_sigma"] = every[-1].ways[:, -1:]
    n = len(result.model.parameters)
    out[FIRST + "parameters"] = np.array([x.values.system.const[:n].real for x in every], float).reshape(len(every), n)
    return {name: x for name, x in out.items() if x.size}


def switched(stored: dict[str, Any]) -> bool:
    """Whether the result of a file was computed with rows that have modes."""
    return FIRST + "rows" in stored


def unpack(stored: dict[str, Any], result: Result) -> None:
    """Give a result what its file holds of stretches.

    Raises
    ------
    ValueError
        If the arrays do not fit together.
    """
    if FIRST + "rows" not in stored:
        return
    rows, times = stored[FIRST + "rows"].astype(int), len(result.t)
    n, ny = len(rows), len(result.final[1])
    empty = {"switch": (n, 5, 0), "sigma": (0, times), "last_sigma": (0, 1), "parameters": (n, 0), "end": (n, ny)}
    stored = {FIRST + name: np.zeros(shape) for name, shape in empty.items()} | stored
    sigma = stored[FIRST + "sigma"]
    if rows.sum() != times or sigma.shape[1] != times:
        raise ValueError(f"{rows.sum()} times between events, and {times} in all")
    made, first, out = dict[tuple[float, ...], Values](), 0, list[Stretch]()
    for k, n in enumerate(rows.tolist()):
        told = tuple(stored[FIRST + "parameters"][k].tolist())
        if told not in made:
            own = dict(zip(result.model.parameters, told, strict=True))
            last = k == len(rows) - 1
            made[told] = result.values if last else values(result.values.structure, own)
        way = sigma[:, first : first + n] if n else stored[FIRST + "last_sigma"]
        numbers = (stored[FIRST + name][k] for name in ("lost", "given"))
        lost, given = map(float, numbers)
        out.append(Stretch(n, stored[FIRST + "switch"][k], way, made[told], lost, given, stored[FIRST + "end"][k]))
        first += n
    result.stretches = stretched(out)
