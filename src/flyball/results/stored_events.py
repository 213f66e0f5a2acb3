"""Events of a result as the texts and arrays that its file holds, and back."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from ..tables.values import Values, values
from .events import Happening
from .struck import Struck

if TYPE_CHECKING:
    from .result import Result


def packed(result: Result) -> tuple[dict[str, str], dict[str, np.ndarray]]:
    """Texts and arrays; none where nothing happened. States before and after are rows, nan where they are not kept."""
    if not len(result.events):
        return {}, {}
    states = {f"events_{k}": _rows([getattr(h, k) for h in result.events], len(result.final[1])) for k in SIDES}
    if n := len(result.model.parameters):
        for k in SIDES:
            every = [getattr(h, k) for h in result.events]
            told = [np.full(n, np.nan) if m is None else m.values.system.const[:n].real for m in every]
            states[f"events_{k}_parameters"] = np.array(told)
    told = [h.as_dict() | ({"struck": x.plain()} if isinstance(x := h.impulses, Struck) else {}) for h in result.events]
    return {"events": json.dumps(told)}, states


SIDES = ("before", "after")


def _rows(moments: list[Any], n: int) -> np.ndarray:
    out = np.full((len(moments), n), np.nan)
    for k, m in enumerate(moments):
        if m is not None:
            out[k] = m.y
    return out


def unpack(stored: dict[str, Any], result: Result) -> None:
    """Give a result what its file holds of events.

    Raises
    ------
    ValueError
        If the arrays do not fit together.
    """
    told = json.loads(stored.get("events", "[]"))
    sides = [stored[f"events_{k}"] for k in SIDES] if told else [np.zeros((0, 0))] * 2
    if any(len(x) != len(told) for x in sides):
        raise ValueError(f"{len(told)} events, and states of {[len(x) for x in sides]}")
    if told:
        sides = [[None if np.isnan(y).any() else y for y in x] for x in sides]
        tables = zip(*(_tables(stored, k, result) for k in SIDES), strict=True)
        result.events = [  # type: ignore[assignment]
            Happening(**_own(one, before is not None), before=before, after=after, tables=both)
            for one, before, after, both in zip(told, *sides, tables, strict=True)
        ]


def _own(one: dict[str, Any], known: bool) -> dict[str, Any]:
    """What an event is made of; ``known``: with its states, by which all impulses are found."""
    struck = one.pop("struck", None)
    if struck is not None and known:
        one["impulses"] = Struck(struck["own"], np.array(struck["rows"]), tuple(map(tuple, struck["blows"])))
    return one | {"done": tuple(one["done"])}


def _tables(stored: dict[str, Any], side: str, result: Result) -> list[Values]:
    """The mechanism with the parameters of each event, before or after it."""
    names, rows = list(result.model.parameters), stored.get(f"events_{side}_parameters")
    if rows is None:
        return [result.values] * len(stored[f"events_{side}"])
    made: dict[tuple[float, ...], Values] = {}
    for told in {tuple(row) for row in rows.tolist()}:
        known = not np.isnan(told).any()
        own = dict(zip(names, told, strict=True))
        made[told] = values(result.values.structure, own) if known else result.values
    return [made[tuple(row)] for row in rows.tolist()]
