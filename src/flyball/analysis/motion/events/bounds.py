"""Bounds of what stops: quantities and their values in words, and how far beyond them a motion is."""

from __future__ import annotations

import math

import numpy as np

from ....constraints.modes import RATCHET, STOP
from ....model.touch import Touch
from ....tables.specs import Structure
from ....tables.switches import SwitchSpec
from ....tables.system import HELD, OFF, VALUE
from .here import Here

NOTHING = 1e-12  # m or rad: printed as 0


def units(s: Structure) -> list[str]:
    """Of every switch the unit of its quantity: m or rad."""
    rows = len(s.rows)
    measures = {t.row - rows: t.formula.measure for t in s.terms if t.measured}
    return ["m" if measures.get(x.measured) == "m" else "rad" for x in s.switches]


def sizes(s: Structure, length: float) -> np.ndarray:
    """Of every switch what its quantity is compared with: the mechanism's length, or a radian, (ns,)."""
    return np.array([length if unit == "m" else 1.0 for unit in units(s)])


def quantity(spec: SwitchSpec) -> str:
    """Name of the quantity of a switch, for messages."""
    if spec.switch.path:
        return "its gap" if isinstance(spec.element, Touch) else "its length"
    return repr(spec.switch.along[0]) if len(spec.switch.along) == 1 else f"the play of {', '.join(spec.switch.along)}"


def told(x: float, unit: str) -> str:
    """A value with its unit; an angle in degrees too."""
    if abs(x) < NOTHING:
        return f"0 {unit}"
    return f"{x:.6g} m" if unit == "m" else f"{x:.6g} rad ({math.degrees(x):.4g} deg)"


def rule(spec: SwitchSpec, x: float, bounds: tuple[float, float], unit: str) -> str:
    """What a quantity is, and what it must be."""
    lower, upper = bounds
    must = f"at least {told(lower, unit)}" if x < lower else f"at most {told(upper, unit)}"
    return f"{quantity(spec)} is {told(x, unit)} and must be {must}"


def beyond(here: Here, near: np.ndarray) -> dict[int, float]:
    """Switches that are beyond their bounds by more than ``near``, or off the tooth that holds them, and how far.

    A stop that holds and is not at its bound any more, on its free side, lets go. Quantities of the state are in the
    scratch.
    """
    S, W, out = here.c.system, here.c.work, dict[int, float]()
    ways = W.sensed[VALUE, W.sensed.shape[1] - W.modes.mode.shape[0] :]
    for s, spec in enumerate(here.structure.switches):
        x, kind = W.sensed[VALUE, spec.measured], S.switches.kind[s]
        if kind == RATCHET and W.modes.mode[s] == HELD:
            tooth, pitch = S.switch_numbers.tooth[s], S.switch_numbers.pitch[s]
            off = (W.modes.hold[s] - tooth) / pitch
            past = abs(off - round(off)) * pitch
        elif kind == STOP:
            past = max(W.modes.lower[s] - x, x - W.modes.upper[s])
            if W.modes.mode[s] == HELD and past <= near[s]:
                side = (W.modes.lower if ways[s] > 0.0 else W.modes.upper)[s]
                W.modes.hold[s] = side
                if abs(x - side) > near[s]:
                    W.modes.mode[s], ways[s] = OFF, 0.0
        else:
            continue
        if past > near[s]:
            out[s] = float(past)
    return out
