"""Numbers for the symbols of a state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..constraints.curve import point
from ..constraints.registry import Kind
from ..equations.records import load
from ..equations.rows import parameters
from ..errors import ModelError
from ..graph.arrays import objects
from ..graph.values import evaluate
from ..math.spline import BREAKS
from ..math.vec import mtv, sub
from .formulated import Formulated, Place

POINTS = 20  # of a curve between two of its breaks that are looked at first


def named_state(x: Formulated, t: float, q: np.ndarray, v: np.ndarray) -> dict[str, Any]:
    """The engine's arrays by the names of the symbols."""
    T = x.traced
    out: dict[str, Any] = {T.t.data.name: t}
    for symbol, drawn, value in zip(T.q, x.drawn, q, strict=True):
        out[symbol.data.name] = _plain(value + drawn.real)
    return out | {symbol.data.name: _plain(value) for symbol, value in zip(T.v, v, strict=True)}


def _plain(x: Any) -> Any:
    """A number as Python's own."""
    return x.item() if isinstance(x, np.generic) else x


def places_at(x: Formulated, places: Sequence[Place], values: Mapping[str, Any]) -> dict[str, Any]:
    """Places on curves of followers: the points of the curves nearest to them, at one instant.

    Raises
    ------
    ModelError
        If the values are arrays, of which each instant would have places of its own.
    """
    S, W, out = x.traced.system, x.traced.work, {}
    if any(np.ndim(v) for v in values.values()):
        names = [p.symbol.data.name for p in places]
        raise ModelError(
            f"give {', '.join(names)} too: places on curves are found for one instant only, not for arrays"
        )
    for place in places:
        t = x.values.structure.terms[place.term]
        records = [c for k in (t.F, t.M) for part in load(W.FK, k)[:2] for c in part]
        given = [*x.cleaned(objects([*records, *parameters(S.term_parameters, place.term)])), *S.const]
        numbers = [float(np.real(n)) for n in evaluate(given, values)]
        F, M = ((tuple(n[:3]), tuple(n[3:])) for n in (numbers[:12], numbers[12:24]))
        out[place.symbol.data.name] = nearest(t.formula.of_kind, tuple(numbers[24:32]), F, M, np.array(numbers[32:]))
    return out


def nearest(kind: Kind, par: tuple[float, ...], F: tuple, M: tuple, data: np.ndarray) -> float:
    """Parameter of the point of a curve that is nearest to M: of points on it the nearest, then by Newton's method."""
    at = int(par[1])
    breaks = data[at + BREAKS : at + BREAKS + int(data[at + 1])]
    s = np.linspace(breaks[0], breaks[-1], POINTS * len(breaks))
    x, _, _, y, _, _ = point(par, s, data)
    p = mtv(F[1], sub(M[0], F[0]))
    guess = s[np.argmin((x - p[0]) ** 2 + (y - p[1]) ** 2)]
    assert kind.foot is not None
    return float(kind.foot(par, F, M, float(guess), data))
