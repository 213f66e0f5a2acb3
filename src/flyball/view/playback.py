"""The speed at which a motion is played, chosen by the fastest thing in it, and whether the output times show it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from ..results.result import Result

EASY_FREQUENCY = 2.0
"""Turns or oscillations in a second of playing [Hz] that the eye follows easily."""
MIN_PLAYING_TIME, MAX_PLAYING_TIME = 2.0, 20.0
"""Durations [s] that a motion should take to play; a longer one is sped up as far as its motion stays easy to see."""
ROUND_FACTORS = (1.0, 2.0, 5.0, 10.0)
TURN_BETWEEN_OUTPUTS = 1.0 / 8.0
"""Largest turn of a body between two output times at which the turning can still be seen."""
MAX_OUTPUTS_SHOWN = 2001
"""Output times of which a page shows all."""
REVERSAL = 0.05
"""Velocity, relative to the largest of its component, that counts for a reversal: smaller ones are noise."""
SLOW_COMPONENT = 1e-3
"""Largest velocity of a component, relative to the fastest one of its kind, below which its oscillation is not seen."""


class Playback(NamedTuple):
    """How to play a motion.

    Attributes
    ----------
    speed : float
        Seconds of motion in a second of playing: 1, 2 or 5 times a power of ten.
    remark : str
        Where output times are too far apart to show the motion, and how many would do; else empty.
    """

    speed: float = 1.0
    remark: str = ""


def playback_of(result: Result, every: np.ndarray) -> Playback:
    """Return how to play a result, of which the output times ``every`` are shown."""
    t = result.t[every]
    duration = float(t[-1] - t[0]) if len(t) > 1 else 0.0
    if duration <= 0.0:
        return Playback()
    names = [b.name for b in result.model.bodies]
    spins = {name: _components(result[name].angular_velocity)[every] for name in names}
    speeds = {name: _components(result[name].velocity)[every] for name in names}
    rates = {name: np.sqrt((w * w).sum(axis=1)) for name, w in spins.items()}
    turning = max((float(np.nanmax(r, initial=0.0)) for r in rates.values()), default=0.0) / (2.0 * math.pi)
    swinging = max(_oscillation(spins.values(), duration), _oscillation(speeds.values(), duration))
    return Playback(suitable_speed(duration, max(turning, swinging)), _remark(t, rates))


def suitable_speed(duration: float, frequency: float) -> float:
    """Return the speed for a motion of this duration [s] whose fastest turning or oscillation has this frequency [Hz].

    It is at most the speed at which the fastest is easy to see, and at which the motion takes 2 s. It is real time if
    that is not too fast; a motion longer than 20 s is sped up to about this duration.
    """
    largest = min(EASY_FREQUENCY / frequency if frequency > 0.0 else math.inf, duration / MIN_PLAYING_TIME)
    return _round_down(min(largest, max(1.0, duration / MAX_PLAYING_TIME)))


def _round_down(speed: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten that is not above a speed."""
    power = 10.0 ** math.floor(math.log10(speed) + 1e-12)
    factor = max(f for f in ROUND_FACTORS if f * power <= speed * (1.0 + 1e-12))
    return factor * power if power >= 1.0 else factor / round(1.0 / power)


def _components(velocity: np.ndarray) -> np.ndarray:
    """Return components over time, (n, k)."""
    return np.asarray(velocity, float).reshape(len(velocity), -1)


def _oscillation(velocities, duration: float) -> float:
    """Return the highest frequency [Hz] of reversals of a component of velocities."""
    columns = [x for v in velocities for x in v.T if np.isfinite(x).all()]
    fastest = max((float(np.abs(x).max()) for x in columns), default=0.0)
    seen = [x for x in columns if np.abs(x).max() > SLOW_COMPONENT * fastest]
    return max((_reversals(x) for x in seen), default=0) / (2.0 * duration)


def _reversals(x: np.ndarray) -> int:
    """Return how often a velocity changes its sign."""
    clear = x[np.abs(x) > REVERSAL * np.abs(x).max()]
    return int((np.diff(np.sign(clear)) != 0.0).sum())


def _remark(t: np.ndarray, rates: dict[str, np.ndarray]) -> str:
    step = np.diff(t)
    turns = {
        name: float(np.nanmax(0.5 * (r[1:] + r[:-1]) * step, initial=0.0)) / (2.0 * math.pi)
        for name, r in rates.items()
    }
    name = max(turns, key=lambda k: turns[k], default="")
    if not name or turns[name] <= TURN_BETWEEN_OUTPUTS * (1.0 + 1e-9):
        return ""
    needed = _rounded_up(math.ceil((len(t) - 1) * turns[name] / TURN_BETWEEN_OUTPUTS - 1e-6) + 1)
    too_far = f"{name} turns by {turns[name]:.2g} of a turn between two output times: too far apart to show its motion"
    if needed <= MAX_OUTPUTS_SHOWN:
        return f"{too_far}; outputs={needed} would show it"
    span = (t[-1] - t[0]) * MAX_OUTPUTS_SHOWN / needed
    return f"{too_far}; {MAX_OUTPUTS_SHOWN} outputs of a motion of at most {span:.2g} s would show it"


def _rounded_up(count: int) -> int:
    """Return a number of outputs that is not below a count, with two digits, plus one: an even number of intervals."""
    step = 10 ** max(len(str(count - 1)) - 2, 0)
    return -(-(count - 1) // step) * step + 1
