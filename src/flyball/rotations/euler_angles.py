"""Euler angles of every sequence: from them, to them, where they are singular, and continuous over time."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import ModelError
from ..math.scalar import atan2
from ..math.turns import sequence_quaternion
from .arrays import joined, split
from .checks import numbers, orientations
from .continuous import held, unwrap, wrapped
from .sequences import Sequence, find
from .singular import SINGULAR, Pair, middle_angle, pairs, tell

UNDETERMINED = 1e-12  # distance [rad] below which nothing but rounding tells the outer angles apart


def from_euler(angles: Any, sequence: str = "XYZ") -> np.ndarray:
    """Unit quaternions of Euler angles.

    Parameters
    ----------
    angles : (..., 3) array [rad]
        In the order of the turns, of any size.
    sequence : str
        Upper case for turns about the moving axes (intrinsic): "XYZ", Bryant angles, turns about x, then the new y,
        then the newer z. Lower case for turns about the fixed axes (extrinsic): "xyz" about x, then the fixed y, then
        the fixed z, which is "ZYX" with the angles reversed. As in SciPy.

    Returns
    -------
    (..., 4) array
        Smooth in the angles: its sign is that of the product of the three turns.

    Raises
    ------
    ModelError
        If there is no such sequence, or the angles are not three numbers each.
    """
    s = find(sequence)
    eta = s.ordered(numbers(angles, (3,), "rotations.from_euler"))
    return joined(sequence_quaternion(*s.axes, *split(eta)))


def euler(orientation: Any, sequence: str = "XYZ", *, continuous: bool = False, singular: str = "warn") -> np.ndarray:
    """Euler angles of orientations.

    Parameters
    ----------
    orientation : quaternions (..., 4), rotation matrices (..., 3, 3) or a SciPy ``Rotation``
    sequence : str
        As in `from_euler`.
    continuous : bool
        Take the first axis as time and let the angles go on without jumps, as in `unwrap`. Then the middle angle may
        leave its usual range, and whole turns count.
    singular : "warn", "raise" or "choose"
        What to do within 1e-7 rad of a singular middle angle, where the orientation tells only the sum or difference of
        the outer two well: warn, raise an exception, or nothing.

    Returns
    -------
    (..., 3) array [rad], in the order of the turns
        Outer angles in [-pi, pi]; the middle one in [-pi/2, pi/2], or in [0, pi] if the outer axes are the same.
        Always angles of the orientation given, to rounding, never NaN. Where nothing but rounding tells the outer ones
        apart (1e-12 rad), the third is 0, or with ``continuous`` that of the time before (the next one at the start).

    Raises
    ------
    SingularOrientationError
        At a singular orientation, if asked for.
    ModelError
        If it is not an orientation, or there is no such sequence.

    Notes
    -----
    Half sums and half differences of the outer angles are angles of pairs of components of the quaternion: Bernardes
    and Viollet, "Quaternion to Euler angles conversion: a direct, general and computationally efficient method", PLoS
    ONE 17 (2022).
    """
    s = find(sequence)
    if singular not in ("warn", "raise", "choose"):
        raise ModelError(f'rotations.euler: singular={singular!r}; give "warn", "raise" or "choose"')
    e = orientations(orientation, "rotations.euler")
    if continuous and e.ndim < 2:
        raise ModelError(
            "rotations.euler: continuous=True needs a series of orientations; give them along the first axis"
        )
    low, high = pairs(e, s)
    middle, distance = middle_angle(low, high, s)
    if singular != "choose" and np.any(distance < SINGULAR):
        tell(e, s, middle, distance, singular)
    first, third = _outer_angles(low, high, s, distance < UNDETERMINED, continuous)
    angles = joined((wrapped(first), middle, wrapped(third)))
    return unwrap(angles, sequence) if continuous else angles


def _outer_angles(low: Pair, high: Pair, s: Sequence, blind: np.ndarray, continuous: bool) -> tuple:
    """First and third angle from the directions of their half sum and half difference.

    Where only one of these is determined (``blind``), the third angle is chosen.
    """
    total, difference = 2 * atan2(low[1], low[0]), 2 * atan2(high[1], high[0])  # of those about the first and last axis
    first, third = 0.5 * (total + difference), 0.5 * (total - difference)
    if s.extrinsic:
        first, third, difference = third, first, -difference
    if np.any(blind):
        third = np.where(blind, held(third, blind) if continuous else 0.0, third)
        squares = [x.real**2 + y.real**2 for x, y in (low, high)]
        first = np.where(blind, np.where(squares[0] > squares[1], total - third, difference + third), first)
    return first, third


def bryant(orientation: Any, *, continuous: bool = False, singular: str = "warn") -> np.ndarray:
    """Bryant angles (..., 3) [rad] of orientations: about x, then the new y, then the newer z; singular at -+ pi/2.

    The same as `euler` with "XYZ", which says the rest.
    """
    return euler(orientation, "XYZ", continuous=continuous, singular=singular)


def from_bryant(angles: Any) -> np.ndarray:
    """Unit quaternions of Bryant angles (..., 3) [rad]; `from_euler` with "XYZ"."""
    return from_euler(angles, "XYZ")
