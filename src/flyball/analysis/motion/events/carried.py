"""What a motion that goes on knows of the one before it, besides where and how that ended."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

from .here import Here
from .rest import Bounces


def carried(here: Here) -> dict[str, Any]:
    """How often events happened, what they were as they last did, bounces and swings of late; plain data, by names."""
    names = _names(here) if here.bounces or here.swings else []
    bounces = [[*names[s], b.count, b.last, b.before] for s, b in here.bounces.items()]
    swings = [[*names[s], *past] for s, past in here.swings.items()]
    every = {"counts": dict(here.counts), "true": list(here.true), "bounces": bounces, "swings": swings}
    every |= {"zero": dict(here.zero), "sides": dict(here.sides)}
    return {k: x for k, x in every.items() if x}


def take_up(here: Here, before: Mapping[str, Any]) -> None:
    """Go on with it. What the mechanism does not have any more is left out."""
    names = {e.name for e in here.structure.model.events}
    known = {name: s for s, name in enumerate(_names(here))}
    here.counts = {k: int(n) for k, n in before.get("counts", {}).items() if k in names}
    here.zero = {k: float(x) for k, x in before.get("zero", {}).items() if k in names}
    here.sides = {k: float(x) for k, x in before.get("sides", {}).items() if k in names}
    here.true = [k for k in before.get("true", ()) if k in names]
    for element, label, which, count, last, previous in before.get("bounces", ()):
        if (s := known.get((element, label, which))) is not None:
            here.bounces[s] = Bounces(int(count), float(last), float(previous))
    for element, label, which, *past in before.get("swings", ()):
        if (s := known.get((element, label, which))) is not None:
            here.swings[s] = [float(t) for t in past]


def _names(here: Here) -> list[tuple[str, str, int]]:
    """What switches are called, in files too: element, label, which of these."""
    seen: Counter[tuple[str, str]] = Counter()
    out = []
    for spec in here.structure.switches:
        name = spec.element.name, spec.switch.label
        out.append((*name, seen[name]))
        seen[name] += 1
    return out
