"""Euler angles of every sequence: from them, to them, where they are singular, and continuous over time."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from ..errors import ModelError, SingularOrientationError, SingularOrientationWarning
from ..math.scalar import atan2
from ..math.turns import sequence_quaternion
from .arrays import joined, split
from .checks import numbers, orientations, place
from .sequences import INTRINSIC, Sequence, find
from .vectors import SINGULAR

UNDETERMINED = 1e-12  # distance [rad] below which nothing but rounding tells the outer angles apart
TURN = 2 * np.pi


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
    low, high = _pairs(e, s)
    middle, distance = _middle(low, high, s)
    if singular != "choose" and np.any(distance < SINGULAR):
        _tell(e, s, middle, distance, singular)
    total, difference = (
        2 * atan2(low[1], low[0]),
        2 * atan2(high[1], high[0]),
    )  # of the first and the last about the axes
    third = 0.5 * (total - difference)
    first = 0.5 * (total + difference)
    if s.extrinsic:
        first, third, difference = third, first, -difference
    blind = distance < UNDETERMINED
    if np.any(blind):
        third = np.where(blind, _held(third, blind) if continuous else 0.0, third)
        near_low = _length(low) > _length(high)
        first = np.where(blind, np.where(near_low, total - third, difference + third), first)
    angles = joined((_wrapped(first), middle, _wrapped(third)))
    return unwrap(angles, sequence) if continuous else angles


def bryant(orientation: Any, *, continuous: bool = False, singular: str = "warn") -> np.ndarray:
    """Bryant angles (..., 3) [rad] of orientations: about x, then the new y, then the newer z; singular at -+ pi/2.

    The same as `euler` with "XYZ", which says the rest.
    """
    return euler(orientation, "XYZ", continuous=continuous, singular=singular)


def from_bryant(angles: Any) -> np.ndarray:
    """Unit quaternions of Bryant angles (..., 3) [rad]; `from_euler` with "XYZ"."""
    return from_euler(angles, "XYZ")


def distance_to_singular(orientation: Any, sequence: str = "XYZ") -> np.ndarray:
    """How far [rad], in [0, pi/2], the middle Euler angle of orientations is from where the sequence is singular.

    Raises
    ------
    ModelError
        If it is not an orientation, or there is no such sequence.
    """
    s = find(sequence)
    e = orientations(orientation, "rotations.distance_to_singular")
    return _middle(*_pairs(e.real, s), s)[1]


def is_singular(orientation: Any, sequence: str = "XYZ", tolerance: float = SINGULAR) -> np.ndarray:
    """Whether the Euler angles of orientations are singular: their middle angle within ``tolerance`` [rad] of it.

    Raises
    ------
    ModelError
        If it is not an orientation, or there is no such sequence.
    """
    return distance_to_singular(orientation, sequence) < tolerance


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
    same, crossing = (_wrapped((y[1:] - x[:-1]).real) for y in (x, other))
    changes = (crossing**2).sum(axis=-1) < (same**2).sum(axis=-1)
    odd = np.cumsum(changes, axis=0) % 2 == 1
    x = np.concatenate([x[:1], np.where(odd[..., None], other[1:], x[1:])])
    turns = np.cumsum(np.round(np.diff(x.real, axis=0) / TURN), axis=0)
    return np.concatenate([x[:1], x[1:] - TURN * turns])


def _wrapped(angle: np.ndarray) -> np.ndarray:
    """Less the nearest whole number of turns."""
    return angle - TURN * np.round(angle.real / TURN)


def _length(pair: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    return np.sqrt(pair[0].real ** 2 + pair[1].real ** 2)


def _pairs(e: np.ndarray, s: Sequence) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """cos(beta/2) and |sin(beta/2)| times cosine and sine of half the sum and half the difference of the outer angles.

    For sequences like ZXZ beta is the middle angle. R_k(c) of the others is a turn about axis i seen from a frame that
    is turned by a right angle about axis j, so they are of the same kind with another beta.
    """
    i, j, _ = s.axes
    p = s.parity
    w, qi, qj, qk = e[..., 0], e[..., 1 + i], e[..., 1 + j], e[..., 1 + 3 - i - j]
    if s.proper:
        return (w, qi), (qj, p * qk)
    w, qi, qj, qk = w + p * qj, qi + qk, qj - p * w, qk - qi
    return (w, qi), (-p * qj, -qk)


def _middle(low: tuple, high: tuple, s: Sequence) -> tuple[np.ndarray, np.ndarray]:
    """Middle angle and its distance from the closest singular one."""
    a, b = (np.sqrt(x * x + y * y) for x, y in (low, high))
    beta = 2 * np.asarray(atan2(b, a))
    middle = beta if s.proper else s.parity * (0.5 * np.pi - beta)
    distance = 2 * np.arctan2(np.minimum(a.real, b.real), np.maximum(a.real, b.real))
    return middle, distance


def _held(third: np.ndarray, blind: np.ndarray) -> np.ndarray:
    """The third angle of the time before wherever it is not determined, of the first determined one at the start."""
    n = len(third)
    times = np.arange(n).reshape(n, *(1,) * (third.ndim - 1))
    last = np.maximum.accumulate(np.where(blind, -1, times), axis=0)
    held = np.take_along_axis(third, np.where(last < 0, np.argmin(blind, axis=0)[None], last), axis=0)
    return np.where(np.all(blind, axis=0), 0.0, held)


def _tell(e: np.ndarray, s: Sequence, middle: np.ndarray, distance: np.ndarray, how: str) -> None:
    """Warn of or refuse singular orientations."""
    close = distance < SINGULAR
    k = tuple(int(i) for i in np.argwhere(close)[0])
    count = f"{np.count_nonzero(close)} of {close.size} orientations are" if close.ndim else "the orientation is"
    where = f"the first{place(k)}: " if close.ndim else ""
    text = (
        f"Euler angles {s.name!r}: {count} within {SINGULAR:g} rad of a singular middle angle ({where}"
        f"{middle[k].real:.9g} rad, {distance[k]:.2g} rad from it), where only the sum or difference of the outer "
        f"angles is determined; {remedy(e[k], 'the quaternion')}"
    )
    if how == "raise":
        raise SingularOrientationError(text, s.name, float(middle[k].real), float(distance[k]))
    warnings.warn(text, SingularOrientationWarning, stacklevel=3)


def remedy(e: np.ndarray, instead: str) -> str:
    """What to use at an orientation: the sequence farthest from singular there, or something without singularities."""
    distances = [float(distance_to_singular(e, name)) for name in INTRINSIC]
    best = int(np.argmax(np.round(distances, 9)))
    return (
        f"use another sequence ({INTRINSIC[best]!r} is {distances[best]:.2g} rad away from singular there) or {instead}"
    )
