"""Numbers for the symbols of a state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..constraints.registry import KINDS
from ..equations.records import load
from ..equations.rows import parameters
from ..graph.values import evaluate
from .formulated import Formulated, Place


def named_state(x: Formulated, t: float, q: np.ndarray, v: np.ndarray) -> dict[str, Any]:
    """The engine's arrays by the names of the symbols."""
    T = x.traced
    out: dict[str, Any] = {T.t.data.name: t}
    for symbol, own, value in zip(T.q, x.own_q, q, strict=True):
        drawn = symbol - own
        out[symbol.data.name] = value + (float(drawn.real) if hasattr(drawn, "real") else float(drawn))
    return out | {symbol.data.name: value for symbol, value in zip(T.v, v, strict=True)}


def places_at(
    x: Formulated, places: Sequence[Place], values: Mapping[str, Any], hints: Mapping[str, float]
) -> dict[str, Any]:
    """Places on curves of followers, by Newton's method from where they are at the start.

    Each is found for one instant; values that are arrays need theirs given.
    """
    S, W, out = x.traced.system, x.traced.work, {}
    for place in places:
        name = place.symbol.data.name
        t = x.values.structure.terms[place.term]
        records = [_flat(load(W.FK, k)) for k in (t.F, t.M)]
        given = [*x.cleaned(_objects([*records[0], *records[1], *parameters(S.term_x, place.term)])), *S.const]
        numbers = [complex(n).real if isinstance(n, complex) else float(n) for n in evaluate(given, values)]
        F, M, par = _record(numbers[:24]), _record(numbers[24:48]), tuple(numbers[48:56])
        foot = KINDS[t.formula.kind].foot
        assert foot is not None
        out[name] = foot(par, F, M, hints[name], np.array(numbers[56:]))
    return out


def _flat(record: tuple) -> list[Any]:
    return [c for part in record for c in part]


def _record(numbers: Sequence[float]) -> tuple:
    sizes, out, at = (3, 9, 3, 3, 3, 3), [], 0
    for n in sizes:
        out.append(tuple(numbers[at : at + n]))
        at += n
    return tuple(out)


def _objects(x: Sequence[Any]) -> np.ndarray:
    out = np.empty(len(x), object)
    out[:] = x
    return out
