"""Euler angles over time: without jumps, through singular orientations too."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import ModelError
from .checks import numbers
from .sequences import find

TURN = 2 * np.pi


def unwrap(angles: Any, sequence: str = "XYZ") -> np.ndarray:
    """Euler angles over time without jumps: of all that give an orientation, those closest to the ones before.

    An orientation has two families of Euler angles, (a, b, c) and (a + pi, pi - b, c + pi), or (a + pi, -b, c + pi) if
    the outer axes are the same, and whole turns may be added to each angle. A motion through a singular orientation
    goes over from one family to the other.

    Parameters
    ----------
    angles : (n, ..., 3) array [rad]
        The first axis is time. Steps must be small enough for the closest to be the right ones; beside a singular
        orientation the outer angles turn fast.
    sequence : str
        As in `from_euler`.

    Returns
    -------
    (n, ..., 3) array [rad], starting with the angles given first

    Raises
    ------
    ModelError
        If there is no such sequence, or the angles are not a series of three numbers each.
    """
    s = find(sequence)
    x = numbers(angles, (3,), "rotations.unwrap")
    if x.ndim < 2:
        raise ModelError("rotations.unwrap: give a series of angles (n, ..., 3), time along the first axis")
    if len(x) < 2:
        return x
    other = x * np.array([1.0, -1.0, 1.0]) + np.pi * np.array([1.0, 0.0 if s.proper else 1.0, 1.0])
    same, crossing = (wrapped((y[1:] - x[:-1]).real) for y in (x, other))
    changes = (crossing**2).sum(axis=-1) < (same**2).sum(axis=-1)
    odd = np.cumsum(changes, axis=0) % 2 == 1
    x = np.concatenate([x[:1], np.where(odd[..., None], other[1:], x[1:])])
    turns = np.cumsum(np.round(np.diff(x.real, axis=0) / TURN), axis=0)
    return np.concatenate([x[:1], x[1:] - TURN * turns])


def wrapped(angle: np.ndarray) -> np.ndarray:
    """Less the nearest whole number of turns."""
    return angle - TURN * np.round(angle.real / TURN)


def held(third: np.ndarray, blind: np.ndarray) -> np.ndarray:
    """The third angle of the time before wherever it is not determined, of the first determined one at the start."""
    n = len(third)
    times = np.arange(n).reshape(n, *(1,) * (third.ndim - 1))
    last = np.maximum.accumulate(np.where(blind, -1, times), axis=0)
    held = np.take_along_axis(third, np.where(last < 0, np.argmin(blind, axis=0)[None], last), axis=0)
    return np.where(np.all(blind, axis=0), 0.0, held)
