"""Axis and angle, rotation vector, Gibbs vector (Rodrigues parameters), Cayley's matrix, modified Rodrigues parameters.

With the turn theta about the unit axis n:

    rotation vector theta n        Gibbs vector tan(theta/2) n        modified Rodrigues parameters tan(theta/4) n

All have the same components along the frame before and the frame after the turn.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import ModelError, SingularOrientationError
from .arrays import skew
from .checks import numbers, orientations, place, unit_vectors
from .singular import SINGULAR
from .stumpff import arc, stumpff


def _short(orientation: Any, what: str) -> np.ndarray:
    """Of the two quaternions of an orientation the one with scalar part >= 0: turns of at most pi."""
    e = orientations(orientation, what)
    return np.where(e[..., :1].real < 0, -e, e)


def axis_angle(orientation: Any) -> tuple[np.ndarray, np.ndarray]:
    """Axis and angle of the one turn that gives an orientation.

    Returns
    -------
    axis : (..., 3) array, unit length; where nothing turns every axis would do, and it is (0, 0, 1)
    angle : (...) array [rad] in [0, pi]; at pi both n and -n would do, and the quaternion given chooses

    Raises
    ------
    ModelError
        If it is not an orientation.
    """
    e = _short(orientation, "rotations.axis_angle")
    v = e[..., 1:]
    factor = arc(e)
    largest = np.abs(v.real).max(axis=-1, keepdims=True, initial=0.0)
    still = largest == 0
    n = np.where(still, np.array([0.0, 0.0, 1.0]), v / np.where(still, 1.0, largest))
    size = np.sqrt((n * n).sum(axis=-1, keepdims=True))
    return n / size, (factor * largest * size)[..., 0]


def from_axis_angle(axis: Any, angle: Any) -> np.ndarray:
    """Unit quaternions of turns about axes (..., 3), of any length but zero, by angles (...) [rad]; broadcast.

    Angles may go beyond pi: the quaternion of a whole turn is (-1, 0, 0, 0), which is no rotation too.

    Raises
    ------
    ModelError
        If an axis is zero.
    """
    n = unit_vectors(axis, "rotations.from_axis_angle: axis")
    half = 0.5 * numbers(angle, (), "rotations.from_axis_angle: angle")[..., None]
    n, half = np.broadcast_arrays(n, half + np.zeros(3))
    return np.concatenate([np.cos(half[..., :1]), np.sin(half) * n], axis=-1)


def rotation_vector(orientation: Any) -> np.ndarray:
    """Rotation vectors (..., 3) [rad]: the axis times the angle, which is in [0, pi].

    The logarithm of the rotation. At a half turn both signs would do, and the quaternion given chooses.

    Raises
    ------
    ModelError
        If it is not an orientation.
    """
    e = _short(orientation, "rotations.rotation_vector")
    return arc(e) * e[..., 1:]


def from_rotation_vector(vector: Any) -> np.ndarray:
    """Unit quaternions of rotation vectors (..., 3) [rad] of any length: the exponential of the rotation.

    Raises
    ------
    ModelError
        If the vectors do not have three components.
    """
    phi = numbers(vector, (3,), "rotations.from_rotation_vector")
    c0, c1, *_ = stumpff(0.25 * (phi * phi).sum(axis=-1, keepdims=True))
    return np.concatenate([c0, 0.5 * c1 * phi], axis=-1)


def gibbs(orientation: Any) -> np.ndarray:
    """Gibbs vectors (..., 3), also called Rodrigues parameters: tan(theta/2) along the axis.

    Raises
    ------
    SingularOrientationError
        If an orientation is a half turn, to 1e-7 rad: the vector is infinite there.
    ModelError
        If it is not an orientation.
    """
    e = _short(orientation, "rotations.gibbs")
    distance = np.pi - 2 * np.arctan2(np.sqrt((e[..., 1:].real ** 2).sum(axis=-1)), e[..., 0].real)
    if np.any(distance < SINGULAR):
        k = np.unravel_index(int(np.argmin(distance)), distance.shape)
        raise SingularOrientationError(
            f"rotations.gibbs{place(tuple(map(int, k)))}: the turn is {distance[k]:.2g} rad from half a turn (rule: "
            f"at least {SINGULAR:g}), where the Gibbs vector is infinite; use the quaternion, the rotation vector or "
            "the modified Rodrigues parameters",
            angle=float(np.pi - distance[k]),
            distance=float(distance[k]),
        )
    return e[..., 1:] / e[..., :1]


def from_gibbs(vector: Any) -> np.ndarray:
    """Unit quaternions, scalar part > 0, of Gibbs vectors (..., 3).

    Raises
    ------
    ModelError
        If the vectors do not have three components.
    """
    g = numbers(vector, (3,), "rotations.from_gibbs")
    e = np.concatenate([np.ones_like(g[..., :1]), g], axis=-1)
    return e / np.sqrt((e * e).sum(axis=-1, keepdims=True))


def cayley(orientation: Any) -> np.ndarray:
    """Skew-symmetric matrices S (..., 3, 3) with R = (1 + S) (1 - S)^-1 (Cayley 1846), S b = gibbs x b.

    Raises
    ------
    SingularOrientationError
        If an orientation is a half turn, to 1e-7 rad.
    ModelError
        If it is not an orientation.
    """
    return skew(gibbs(orientation))


def from_cayley(matrix: Any) -> np.ndarray:
    """Unit quaternions, scalar part > 0, of the rotations R = (1 + S) (1 - S)^-1 of skew-symmetric matrices S.

    Raises
    ------
    ModelError
        If a matrix is not skew-symmetric to 1e-9 of its largest entry.
    """
    S = numbers(matrix, (3, 3), "rotations.from_cayley")
    off = np.abs(S + np.swapaxes(S, -1, -2)).max(axis=(-1, -2), initial=0.0)
    bad = off > 1e-9 * np.abs(S).max(axis=(-1, -2), initial=0.0)
    if np.any(bad):
        k = tuple(int(i) for i in np.argwhere(bad)[0])
        raise ModelError(
            f"rotations.from_cayley{place(k)}: S + S^T has an entry {off[k]:.2g}; S must be skew-symmetric, as "
            "(S - S^T)/2 is"
        )
    return from_gibbs(np.stack([S[..., 2, 1], S[..., 0, 2], S[..., 1, 0]], axis=-1))


def modified_rodrigues(orientation: Any) -> np.ndarray:
    """Modified Rodrigues parameters (..., 3): tan(theta/4) along the axis; never longer than 1 (Wiener 1962).

    Raises
    ------
    ModelError
        If it is not an orientation.
    """
    e = _short(orientation, "rotations.modified_rodrigues")
    return e[..., 1:] / (1 + e[..., :1])


def from_modified_rodrigues(vector: Any) -> np.ndarray:
    """Unit quaternions of modified Rodrigues parameters (..., 3) of any length.

    Raises
    ------
    ModelError
        If the vectors do not have three components.
    """
    m = numbers(vector, (3,), "rotations.from_modified_rodrigues")
    square = (m * m).sum(axis=-1, keepdims=True)
    return np.concatenate([1 - square, 2 * m], axis=-1) / (1 + square)
