"""Whole turns of angles that formulas find: they follow the mechanism through its whole range, without jumps.

atan2 knows an angle but for whole turns. Where one coordinate drives a mechanism, each angle is followed once round: it
comes back (a rocker), or has turned with it. Where several do, an angle is the one next to the drawn one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ....graph.node import Node
from ....graph.values import evaluate
from ....math.scalar import rounded
from ..definition import Definition

PLACES = 1441  # on two turns
WIDEST = 0.98 * math.pi  # from the middle of what an angle does beside its turns, where these can be told
TURN = 2.0 * math.pi


def continued(definitions: Sequence[Definition], known: Sequence[Node], start: Mapping[str, float]) -> list[Definition]:
    """The same, with angles that jump followed.

    Parameters
    ----------
    definitions : sequence of Definition
        In an order of evaluation.
    known : sequence of Node
        Coordinates that are given.
    start : mapping
        Numbers of all symbols in the drawn position.
    """
    values: dict[str, Any] = dict(start)
    if len(known) == 1:
        way = np.linspace(-TURN, TURN, PLACES)
        values[known[0].data.name] = start[known[0].data.name] + way
    else:
        rng = np.random.default_rng(2)
        way = rng.uniform(-math.pi, math.pi, PLACES)
        for x in known:
            values[x.data.name] = start[x.data.name] + rng.uniform(-math.pi, math.pi, PLACES)
    out: list[Definition] = []
    for d in definitions:
        if not d.closed:
            return [*out, *definitions[len(out) :]]  # what stands on what has no formula is not followed
        new = []
        for w, y in zip(d.symbols, d.values, strict=True):
            with np.errstate(all="ignore"):
                found = np.broadcast_to(np.asarray(evaluate([y], values)[0], float), len(way))
            if _is_angle(y):
                y, found = _followed((w, y, found), known, way, start)
            if w not in known:
                values[w.data.name] = found
            new.append(y)
        out.append(replace(d, values=tuple(new)))
    return out


def _is_angle(y: Any) -> bool:
    """Whether an arctangent is added up in a formula."""
    if not isinstance(y, Node):
        return False
    return y.op == "atan2" or (y.op in ("add", "multiply") and any(_is_angle(z) for z in y.args))


def _followed(
    what: tuple[Node, Any, np.ndarray], known: Sequence[Node], way: np.ndarray, start: Mapping[str, float]
) -> tuple[Any, np.ndarray]:
    """The formula with whole turns, if it needs some, and its values."""
    w, y, found = what
    drawn = start[w.data.name]
    if len(known) != 1:
        if not np.nanmax(np.abs(found - drawn), initial=0.0) > math.pi:
            return y, found
        return y + TURN * rounded((drawn - y) / TURN), found + TURN * np.round((drawn - found) / TURN)
    u = known[0]
    first, last = _range(found)
    there = found[first:last]
    if not np.abs(np.diff(there)).max(initial=0.0) > math.pi:
        return y, found
    smooth = np.unwrap(there)
    middle = len(way) // 2
    smooth += drawn - smooth[middle - first]
    half = (len(way) - 1) // 2
    turns = round((smooth[half] - smooth[0]) / TURN) if last - first == len(way) else 0
    beside = smooth - turns * way[first:last]
    centre = 0.5 * (beside.max() + beside.min())
    if beside.max() - centre > WIDEST:
        return y, found
    near = turns * (u - start[u.data.name]) + centre if turns else centre
    out = found.copy()
    out[first:last] = smooth
    return y + TURN * rounded((near - y) / TURN), out


def _range(found: np.ndarray) -> tuple[int, int]:
    """The range about the middle in which the mechanism closes."""
    middle = len(found) // 2
    gone = np.flatnonzero(~np.isfinite(found))
    before, behind = gone[gone < middle], gone[gone > middle]
    return (int(before[-1]) + 1 if len(before) else 0), (int(behind[0]) if len(behind) else len(found))
