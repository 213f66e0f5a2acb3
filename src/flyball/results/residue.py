"""By how much accelerations miss the rates of the velocities: what a rough tolerance leaves of forces.

Accelerations are solved anew at every output time, from a position and a velocity that are right to the tolerance. A
stiff spring makes a large force of a small error of its length, and neither positions nor the energy balance show it.
Where output times are closer than steps the velocities between them are those of the method's polynomial: its rate is
what the method took the acceleration for, and what the equations miss of it is their residue (defect).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .result import Result

PART = 0.1  # of a body's largest acceleration by which it may miss the rate of the velocity
OFTEN = 0.1  # part of the output times at which it may miss it by more: jumps and short transients
CLOSE = 2  # output times to a step on average at least: else velocities between them are not one polynomial's
BESIDE = 0.1  # part of the fastest body's acceleration, and of gravity, that counts where a body has less of its own
LEAST = 16  # output times at least


def missed(result: Result) -> str:
    """What is to be said of accelerations that are not the rates of the velocities; nothing where they are.

    Of 1100 random motions, stiff ones among them, at tolerances from 0.1 to 1e-7, none is named whose accelerations
    were right; none at 1e-4 and less.
    """
    steps = result.health.steps
    if not 0 < CLOSE * steps <= len(result.t) or len(result.t) < LEAST or result.health.contact is not None:
        return ""
    found = (_worst(piece, angular) for piece in result.pieces or (result,) for angular in (False, True))
    often, name, off, own, unit = max(found, default=(0.0, "", 0.0, 0.0, ""))
    if not often > OFTEN:
        return ""
    finer = "shorter step" if result.health.options.get("step") else "smaller rtol"
    return (
        f"accelerations, and forces and reactions with them, are rough: that of {name!r} misses the rate of its "
        f"velocity by up to {off:.2g} {unit}, where that comes to {own:.2g} {unit}; a {finer} makes them better"
    )


def _worst(r: Result, angular: bool) -> tuple[float, str, float, float, str]:
    """Part of the output times at which a body's acceleration is off, its name, by how much, of what, and the unit."""
    S, length, inner = r.values.system, r.values.length, slice(2, -2)
    rows = np.flatnonzero(np.r_[True, np.diff(r.t) > 0.0])
    t, unit = r.t[rows], "rad/s^2" if angular else "m/s^2"
    if len(t) < LEAST:
        return 0.0, "", 0.0, 0.0, unit
    least = BESIDE * (float(np.linalg.norm(S.gravity)) + length / float(np.ptp(t)) ** 2) / (length if angular else 1.0)
    found = []
    for name, b in r.values.structure.place.items():
        if b < 0:
            continue
        _, _, w, v, alpha, a = r.records.body(b)
        v, a = (np.transpose(x)[rows] for x in ((w, alpha) if angular else (v, a)))
        near = _rate(t, v, 1)
        unsure = 2.0 * np.linalg.norm((near - _rate(t, v, 2))[inner], axis=1)
        off = np.linalg.norm((a - near)[inner], axis=1) - unsure
        found.append((name, off, float(np.linalg.norm(near[inner], axis=1).max())))
    least = max(least, BESIDE * max((own for _, _, own in found), default=0.0))
    parts = ((float((off > PART * max(own, least)).mean()), n, float(off.max()), own, unit) for n, off, own in found)
    return max(parts, default=(0.0, "", 0.0, 0.0, unit))


def _rate(t: np.ndarray, v: np.ndarray, k: int) -> np.ndarray:
    """Derivative at every time of the parabola through it and those k before and after; nothing at the ends."""
    out = np.zeros_like(v)
    before, after = (t[k:-k] - t[: -2 * k])[:, None], (t[2 * k :] - t[k:-k])[:, None]
    slopes = (v[k:-k] - v[: -2 * k]) / before, (v[2 * k :] - v[k:-k]) / after
    out[k:-k] = (slopes[0] * after + slopes[1] * before) / (before + after)
    return out
