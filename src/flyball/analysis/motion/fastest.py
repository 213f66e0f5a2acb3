"""The fastest that a motion could do about its present state, and what of it it does."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...equations.engine import MOTION, evaluate
from ...numerics.arnoldi import largest
from ...numerics.integrators import clock as ex
from ...numerics.integrators.step import scaled
from ...tables.system import VALUE, assign
from ..compiled import Compiled

LAST = 12  # stage of dop853 that is at the end of the step, as is the one before
PRODUCTS = 6  # with derivatives
ELSE = 0.03  # part of the first vector that is in no direction
SMALL = 1e-7  # differences, as part of the state


def fastest(c: Compiled, clock: ex.Clock, pace: float) -> complex:
    """Largest eigenvalue of the derivatives of (q, v, x)' by these at the state of a motion [1/s].

    x are states of controllers; modes are what they are. Where steps are as wide as is stable their last two stages
    differ by what is fast, so that a few products find it. Nothing of the motion's own scratch is touched.

    Parameters
    ----------
    c : Compiled
    clock : Clock
        Where the motion is, with the stages of its last step.
    pace : float
        About how fast it could be [1/s]: by it velocities are compared with positions.
    """
    s, y = c.structure, clock.y[ex.NOW]
    n, parts = s.nq + s.nv + len(s.controls) - len(s.sampled), [slice(0, s.nq), slice(s.nq, s.nq + s.nv)]
    if n > s.nq + s.nv:
        parts.append(slice(s.nq + s.nv, n))
    unit, size = np.ones(n), np.maximum(np.abs(y[:n]), 1.0)
    unit[parts[1]] = pace
    rates = _rates(c, float(clock.real.t), n)
    here = rates(y)

    def product(x: np.ndarray) -> np.ndarray:
        way, out = x * unit, np.zeros(n)
        for part in parts:  # each by itself: by rates of 1e6/s and more one would be lost beside another
            most = np.max(np.abs(way[part]) / size[part], initial=0.0)
            if most > 0.0:
                moved = y.copy()
                moved[part] += SMALL / most * way[part]
                out += (rates(moved) - here) * (most / SMALL)
        return out / unit

    return largest(product, _start(clock, unit), PRODUCTS) if n else 0j


def bend(clock: ex.Clock) -> float:
    """By how much rates have changed over the last step, in units of the tolerance [1/s].

    Over the fastest rate: what swings as fast is about so large, or less.
    """
    y = clock.y
    return float(scaled(clock, clock.K[0] - y[ex.OLD_RATE], np.abs(y[ex.NOW]), int(clock.count.controlled)))


def _rates(c: Compiled, t: float, n: int) -> Callable[[np.ndarray], np.ndarray]:
    other = c.again()
    assign(other.work.modes, c.work.modes)
    assign(other.work.options, c.work.options)
    other.work.sensed[VALUE] = c.work.sensed[VALUE]

    def rates(x: np.ndarray) -> np.ndarray:
        status, dy = evaluate(other.values.system, other.work, t, x.copy(), MOTION)
        return dy[:n].copy() if status == 0 else np.full(n, np.nan)

    return rates


def _start(clock: ex.Clock, unit: np.ndarray) -> np.ndarray:
    n = len(unit)
    other = np.random.default_rng(0).uniform(-1.0, 1.0, n)
    other /= np.linalg.norm(other)
    if len(clock.K) <= LAST:
        return other
    way = (clock.K[LAST] - clock.K[LAST - 1])[:n] / unit
    size = np.linalg.norm(way)
    return way / size + ELSE * other if 0.0 < size < np.inf else other
