"""Where Euler angles are singular: how far an orientation is from it, what is told, what to use instead."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from ..errors import SingularOrientationError, SingularOrientationWarning
from ..math.scalar import atan2
from .checks import orientations, place
from .sequences import INTRINSIC, Sequence, find

SINGULAR = 1e-7  # distance [rad] from a singular orientation below which it counts as one
Pair = tuple[np.ndarray, np.ndarray]


def distance_to_singular(orientation: Any, sequence: str = "XYZ") -> np.ndarray:
    """How far [rad], in [0, pi/2], the middle Euler angle of orientations is from where the sequence is singular.

    Raises
    ------
    ModelError
        If it is not an orientation, or there is no such sequence.
    """
    s = find(sequence)
    e = orientations(orientation, "rotations.distance_to_singular")
    return middle_angle(*pairs(e.real, s), s)[1]


def is_singular(orientation: Any, sequence: str = "XYZ", tolerance: float = SINGULAR) -> np.ndarray:
    """Whether the Euler angles of orientations are singular: their middle angle within ``tolerance`` [rad] of it.

    Raises
    ------
    ModelError
        If it is not an orientation, or there is no such sequence.
    """
    return distance_to_singular(orientation, sequence) < tolerance


def pairs(e: np.ndarray, s: Sequence) -> tuple[Pair, Pair]:
    """Two points in the plane that hold the outer angles as polar angles and the middle one in their distances.

    The polar angle of the first is half the sum of the angles about the first and last axis, that of the second half
    their difference; the distances from the origin are as cos(beta/2) to sin(beta/2). For sequences like ZXZ beta is
    the middle angle. The last turn of the others is one about the first axis as seen from a frame that is turned by a
    right angle about the second, so these are of the same kind, with a beta of pi/2 less or more.
    """
    i, j, _ = s.axes
    p = s.parity
    w, qi, qj, qk = e[..., 0], e[..., 1 + i], e[..., 1 + j], e[..., 1 + 3 - i - j]
    if s.proper:
        return (w, qi), (qj, p * qk)
    w, qi, qj, qk = w + p * qj, qi + qk, qj - p * w, qk - qi
    return (w, qi), (-p * qj, -qk)


def middle_angle(low: Pair, high: Pair, s: Sequence) -> tuple[np.ndarray, np.ndarray]:
    """Middle angle and its distance from the closest singular one."""
    a, b = (np.sqrt(x * x + y * y) for x, y in (low, high))
    beta = 2 * np.asarray(atan2(b, a))
    middle = beta if s.proper else s.parity * (0.5 * np.pi - beta)
    distance = 2 * np.arctan2(np.minimum(a.real, b.real), np.maximum(a.real, b.real))
    return middle, distance


def tell(e: np.ndarray, s: Sequence, middle: np.ndarray, distance: np.ndarray, how: str) -> None:
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
