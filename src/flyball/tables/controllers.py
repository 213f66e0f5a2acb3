"""States of controllers: the first of all states, each with the law of its rate; laws read them as they read sensors.

Their columns among what is measured are known only when all is numbered (`branches.settle`): until then their places
stand in the code as negative numbers, from `CONTROLS` downwards.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..model.controller import Controller
from ..model.model import Model
from ..model.wiring import given, signal, wired
from .specs import Structure

CONTROLS = -1_000_000_000
"""Place of the first state until columns are known; below those of switches' ways."""


def states(s: Structure) -> None:
    """Give every state of a controller its number, before all other states."""
    s.controls = wired(s.model)
    for x in s.controls:
        s.state(x.name)


def names(model: Model) -> dict[str, Controller]:
    """Every name in laws and signals of controllers, and a controller that uses it."""
    out: dict[str, Controller] = {}
    for e in model.controllers:
        laws = [x.law for x in wired(model) if x.controller is e] + [signal(model, e, name) for name in e.signals()]
        laws += [given(model, e, name) for name in e.ordered() or ()]
        out |= dict.fromkeys((name for law in laws for name in law.names), e)
    return out


def slots(s: Structure) -> None:
    """Have laws find the states."""
    s.slots |= {x.name: CONTROLS - k for k, x in enumerate(s.controls)}


def table(s: Structure) -> None:
    """The laws of the rates."""
    laws, s.sampled, s.ordered = [], [], []
    for k, x in enumerate(s.controls):
        at = s.law(x.law, (), None if x.controller.sampled else x.controller)
        laws.append(-1 if x.controller.sampled else at)
        if x.controller.sampled:
            s.sampled.append((x.controller.name, k, at, not x.signal))
    s.tables["control_laws"] = np.array(laws, np.int64)
    for e in s.model.controllers:
        if ordered := e.ordered():
            s.ordered += [(e, ordered, [s.law(given(s.model, e, name), ()) for name in ordered])]


def initial(s: Structure, numbers: Mapping[str, Any]) -> list[Any]:
    """What the states begin with; ``numbers`` are those of elements, by name."""
    found = {e.name: {x.name: x.initial for x in e.states(numbers[e.name])} for e in s.model.controllers}
    return [found[x.controller.name].get(x.state, 0.0) for x in s.controls]
