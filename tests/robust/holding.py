"""What holds at times, judged after the fact: nothing pulls that can only push, nothing open is passed, no event missed."""

from __future__ import annotations

import itertools
import math

import numpy as np

import flyball as fb
from flyball.results.result import Result

PULLS = 1e-6  # of the largest force or torque of any row, over the motion
PASSED = 1e-7  # of the mechanism's length (or a radian), of the fastest rate


def misheld(r: Result, m: fb.Mechanism) -> str:
    """What is held against its rule at an output time, in words; empty if nothing is."""
    curves = {k: v for k, (_, v) in r.channels().items()}
    most = max(
        np.abs(r.multipliers).max(initial=0.0),
        *(np.abs(v).max() for k, v in curves.items() if k.endswith(".force")),
        0.0,
    )
    for e in m.elements():
        bad = _wrong(e, {k[len(e.name) + 1 :]: v for k, v in curves.items() if k.startswith(f"{e.name}.")}, r, most)
        if bad:
            return f"{e.title} {bad}"
    return ""


def _wrong(e, own, r: Result, most: float) -> str:
    length = r.values.length
    if isinstance(e, fb.Event):
        return _unseen(e, r)
    if "taut" in own:
        pull, long = -own["tension"].min(), 0.0
        if e.stiffness is None:
            long = (own["length"] - _length(e, own)).max()
    elif "closed" in own:
        side = np.sign(own["closed"]) * getattr(e, "direction", 1.0)
        pull = -(own["force"] * side).min()
        long = _beyond(e, own) if getattr(e, "stiffness", None) is None else 0.0
    elif "gap" in own:
        pull, long = -own["normal"].min(), -own["gap"].min()
    else:
        return ""
    if pull > PULLS * most + 1e-12:
        return f"pulls by {pull:.3g} where {most:.3g} act"
    if long > PASSED * max(length, 1.0, np.abs(own.get("rate", np.zeros(1))).max()):
        return f"is passed by {long:.3g}"
    return ""


def _length(e: fb.Rope, own) -> float:
    """Of a rope: given, or as long as it was drawn, wherever its bodies were assembled."""
    if isinstance(e.length, int | float):
        return float(e.length)
    return sum(math.dist(a, b) for a, b in itertools.pairwise(e.at)) if e.at else own["length"][0]


def _beyond(e, own) -> float:
    """How far an open one is passed."""
    x = own["value"]
    if isinstance(e, fb.Limit):
        sides = [(-1.0, e.lower), (1.0, e.upper)]
        return max(((s * (x - b)).max() for s, b in sides if isinstance(b, int | float)), default=0.0)
    if isinstance(e, fb.Backlash):
        return float(np.abs(x).max() - 0.5 * e.gap)
    if isinstance(e, fb.OneWay):
        return float(-(e.direction * own["rate"]).min())
    return 0.0


def _unseen(e: fb.Event, r: Result) -> str:
    """Of an event that is only noted, where a coordinate passes a number: where it was not."""
    name, _, number = e.when.rpartition(" - ")
    if e.do or e.times is not None or name not in r.channels():
        return ""
    x, at = r.channels()[name][1] - float(number), [h.t for h in r.events if h.name == e.name]
    size = 1e-9 * max(1.0, np.abs(x).max())
    for i, (a, b) in enumerate(itertools.pairwise(x)):
        rises, falls = a < -size and b > size, a > size and b < -size
        asked = (rises and e.direction != "falling") or (falls and e.direction != "rising")
        if asked and not any(r.t[i] - 1e-9 <= t <= r.t[i + 1] + 1e-9 for t in at):
            return f"is not noted between {r.t[i]:.6g} and {r.t[i + 1]:.6g} s"
    return ""
