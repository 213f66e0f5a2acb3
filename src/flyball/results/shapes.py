"""A mode as a motion: the mechanism swung along its shape."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..equations.tree import retract
from .health import Health
from .result import Result

if TYPE_CHECKING:
    from .modes import Modes

SLOWEST = 1.0  # period [s] of a mode that does not oscillate


def motion(m: Modes, k: int, amplitude: float, outputs: int) -> Result:
    """See `Modes.motion`. To first order in the amplitude the joints stay closed."""
    x = m.point
    rate = abs(m.eigenvalues[k].imag)
    period = 2.0 * np.pi / rate if rate > 0.0 else SLOWEST
    t = np.linspace(0.0, period, outputs)
    length = x.values.length
    scale = np.array([1.0 if u == "m" else length for u in m.units])
    shape = m.shapes[:, k] * (amplitude * length / np.abs(scale * m.shapes[:, k]).max())
    swing = np.exp(2j * np.pi * t / period)
    step, speed, acceleration = (
        ((2j * np.pi / period) ** n * shape[:, None] * swing).real for n in range(3)
    )  # (nv, outputs) each
    q = np.repeat(x.q.T, outputs, axis=1)
    retract(x.values.system, q, step)
    states = np.repeat(x.states, outputs, axis=0)
    lam = np.repeat(x.multipliers, outputs, axis=0)
    health = Health(True, f"mode {k}, not a simulation", 0.0, 0.0, 0, 0, 0, 0, 0.0, late=dict(x.health.late))
    return Result(x.model, x.values, t, np.ascontiguousarray(q.T), speed.T, states, acceleration.T, lam, health)
