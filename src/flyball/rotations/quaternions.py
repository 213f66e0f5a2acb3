"""Quaternion, matrix, and what can be done with rotations: composition, inverse, distance, interpolation."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import ModelError
from ..math.scalar import atan2
from ..math.vec import mv, quaternion_matrix, quaternion_product
from .arrays import joined, split
from .checks import numbers, orientations, place, quaternion_of, rotation_matrices
from .stumpff import arc
from .vectors import from_rotation_vector


def quaternion(orientation: Any, *, continuous: bool = False) -> np.ndarray:
    """Unit quaternions, also called Euler parameters, scalar first.

    Parameters
    ----------
    orientation : quaternions (..., 4), rotation matrices (..., 3, 3) or a SciPy ``Rotation``
        Quaternions of any length but zero are divided by it and keep their sign; matrices give a scalar part >= 0.
    continuous : bool
        Take the first axis as time and choose of q and -q, one orientation, the closest to the one before.

    Returns
    -------
    (..., 4) array

    Raises
    ------
    ModelError
        If a quaternion is zero or a matrix is not a rotation.
    """
    e = orientations(orientation, "rotations.quaternion")
    if not continuous or e.ndim < 2 or len(e) < 2:
        return e
    turned = (e[1:] * e[:-1]).sum(axis=-1, keepdims=True).real < 0
    signs = np.cumprod(np.where(turned, -1.0, 1.0), axis=0)
    return np.concatenate([e[:1], e[1:] * signs])


def matrix(orientation: Any) -> np.ndarray:
    """Rotation matrices (..., 3, 3) of quaternions (or of matrices, which are checked).

    R_AB of a frame B seen from A takes components along B to components along A; its columns are B's axes along A.

    Raises
    ------
    ModelError
        If a quaternion is zero or a matrix is not a rotation.
    """
    R = joined(quaternion_matrix(*split(orientations(orientation, "rotations.matrix"))))
    return R.reshape(*R.shape[:-1], 3, 3)


def from_matrix(matrix: Any) -> np.ndarray:
    """Unit quaternions (..., 4), scalar part >= 0, of rotation matrices (..., 3, 3) (Shepperd 1978).

    Raises
    ------
    ModelError
        If a matrix is not orthonormal to 1e-9 or is left-handed; `nearest` makes it a rotation.
    """
    return quaternion_of(rotation_matrices(matrix, "rotations.from_matrix"))


def nearest(matrix: Any) -> np.ndarray:
    """Unit quaternions (..., 4) of the rotations closest to real matrices (..., 3, 3) in the least-squares sense.

    For measured or rounded matrices. The orthogonal polar factor by singular values (Kabsch 1976).

    Raises
    ------
    ModelError
        If the closest rotation is not unique: two singular values vanish, or the matrix mirrors and its two least
        singular values are the same.
    """
    A = numbers(matrix, (3, 3), "rotations.nearest")
    if np.iscomplexobj(A):
        raise ModelError("rotations.nearest: the matrix is complex; give a real one")
    U, s, Vt = np.linalg.svd(A)
    hand = np.sign(np.linalg.det(U @ Vt))
    unique = s[..., 1] + hand * s[..., 2] > 1e-9 * s[..., 0]
    if not np.all(unique):
        k = tuple(int(i) for i in np.argwhere(~unique)[0])
        raise ModelError(
            f"rotations.nearest{place(k)}: no single rotation is closest to a matrix with determinant "
            f"{np.linalg.det(A[k]):.3g} and singular values {s[k].tolist()}; give three columns near a right-handed "
            "set of unit vectors"
        )
    U[..., :, 2] *= hand[..., None]
    return quaternion_of(U @ Vt)


def compose(*orientations_: Any) -> np.ndarray:
    """Rotations one after the other: compose(R_AB, R_BC) is R_AC, the last one applied first to a vector.

    Parameters
    ----------
    orientations_ : quaternions (..., 4) or matrices (..., 3, 3); leading axes are broadcast

    Returns
    -------
    (..., 4) array of unit quaternions; of none, no rotation

    Raises
    ------
    ModelError
        If one is not an orientation.
    """
    e = np.array([1.0, 0, 0, 0])
    for value in orientations_:
        e = joined(quaternion_product(split(e), split(orientations(value, "rotations.compose"))))
    return e


def inverse(orientation: Any) -> np.ndarray:
    """Unit quaternions (..., 4) of the opposite rotations: R_BA from R_AB.

    Raises
    ------
    ModelError
        If it is not an orientation.
    """
    return orientations(orientation, "rotations.inverse") * np.array([1.0, -1, -1, -1])


def apply(orientation: Any, vectors: Any) -> np.ndarray:
    """Vectors (..., 3) turned by the rotations: components along B become components along A by R_AB.

    Raises
    ------
    ModelError
        If it is not an orientation, or the vectors do not have three components.
    """
    R = quaternion_matrix(*split(orientations(orientation, "rotations.apply")))
    return joined(mv(R, split(numbers(vectors, (3,), "rotations.apply: vectors"))))


def relative(a: Any, b: Any) -> np.ndarray:
    """Unit quaternions (..., 4) of B as seen from A: R_AB = R_WA^T R_WB from the orientations a = R_WA and b = R_WB.

    Raises
    ------
    ModelError
        If one is not an orientation.
    """
    return compose(inverse(orientations(a, "rotations.relative")), orientations(b, "rotations.relative"))


def angular_distance(a: Any, b: Any) -> np.ndarray:
    """Angle [rad] in [0, pi] of the one turn that leads from a to b.

    Raises
    ------
    ModelError
        If one is not an orientation.
    """
    e = relative(a, b)
    v = e[..., 1:]
    w = np.where(e[..., 0].real < 0, -e[..., 0], e[..., 0])
    return 2 * np.asarray(atan2(np.sqrt((v * v).sum(axis=-1)), w))


def slerp(a: Any, b: Any, part: Any) -> np.ndarray:
    """Unit quaternions part of the way from a to b, at constant angular velocity about one axis (Shoemake 1985).

    Parameters
    ----------
    a, b : orientations
    part : array
        0 gives a, 1 gives b (up to the sign of the quaternion); numbers outside go on beyond. Broadcast against the
        leading axes. The shorter way is taken; of two half turns, the one that the quaternions name.

    Raises
    ------
    ModelError
        If one is not an orientation.
    """
    e = relative(a, b)
    e = np.where(e[..., :1].real < 0, -e, e)
    phi = numbers(part, (), "rotations.slerp: part")[..., None] * (arc(e) * e[..., 1:])
    return compose(a, from_rotation_vector(phi))


def random(shape: int | tuple[int, ...] = (), seed: Any = None) -> np.ndarray:
    """Unit quaternions (*shape, 4) spread evenly over all orientations (normal numbers by length, Muller 1959).

    Parameters
    ----------
    shape : int or tuple
        How many; () gives one.
    seed : int or numpy.random.Generator
        Makes them repeatable.
    """
    shape = (shape,) if isinstance(shape, int) else tuple(shape)
    e = np.random.default_rng(seed).standard_normal((*shape, 4))
    return e / np.linalg.norm(e, axis=-1, keepdims=True)
