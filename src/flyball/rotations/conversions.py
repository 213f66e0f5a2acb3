"""Conversions between Euler angles, quaternions, matrices, axis and angle, rotation and Rodrigues vectors.

Also what can be done with rotations: composition, inverse, distance, interpolation; where Euler angles are
singular, and Euler angles over time without jumps. With the turn theta about the unit axis n:

    rotation vector theta n        Gibbs vector tan(theta/2) n        modified Rodrigues parameters tan(theta/4) n

All have the same components along the frame before and the frame after the turn.
"""

from __future__ import annotations

import warnings
from itertools import product
from math import factorial
from typing import Any, NamedTuple

import numpy as np

from ..errors import ModelError, SingularOrientationError, SingularOrientationWarning
from ..math.rotation import sequence_quaternion
from ..math.scalar import atan2
from ..math.vec import mv, quaternion_matrix, quaternion_product
from .arrays import (
    index_text,
    joined,
    number_array,
    orientations,
    quaternion_of,
    rotation_matrices,
    skew,
    split,
    unit_vectors,
)

INTRINSIC = tuple("".join(s) for s in product("XYZ", repeat=3) if s[0] != s[1] != s[2])
EXTRINSIC = tuple(s.lower() for s in INTRINSIC)


class Sequence(NamedTuple):
    """A sequence of turns, put in the order of the intrinsic one that gives the same rotation."""

    name: str
    axes: tuple[int, int, int]
    extrinsic: bool  # the angles come in the reverse order of the axes

    @property
    def proper(self) -> bool:
        """Whether the first and the last axis are the same (ZXZ), not three different ones (XYZ)."""
        return self.axes[0] == self.axes[2]

    @property
    def parity(self) -> int:
        """1 if the first two axes and the remaining one are right-handed in this order, else -1."""
        return 1 if (self.axes[1] - self.axes[0]) % 3 == 1 else -1

    def ordered(self, angles: np.ndarray) -> np.ndarray:
        """Angles (or anything along the last axis) from the user's order to that of the axes, or back."""
        return angles[..., ::-1] if self.extrinsic else angles


def _parse_sequence(name: str) -> Sequence:
    i, j, k = ("XYZ".index(c) for c in name.upper())
    return Sequence(name, (i, j, k) if name.isupper() else (k, j, i), name.islower())


_SEQUENCES = {name: _parse_sequence(name) for name in INTRINSIC + EXTRINSIC}


def find_sequence(name: str) -> Sequence:
    """Read the name of a sequence.

    Raises
    ------
    ModelError
        If there is no such sequence.
    """
    if isinstance(name, str) and name in _SEQUENCES:
        return _SEQUENCES[name]
    rule = "three letters, neighbours different"
    if isinstance(name, str) and name.upper() in INTRINSIC:
        rule = "either all upper case or all lower case"
    raise ModelError(
        f"there is no sequence of Euler angles {name!r}: it takes {rule}; upper case for turns about the moving axes "
        f"({', '.join(INTRINSIC)}), lower case for turns about the fixed ones"
    )


def singular_angles(sequence: str = "XYZ") -> tuple[float, float]:
    """Middle angles [rad] at which a sequence is singular: 0 and pi if its outer axes are the same, else -+ pi/2.

    There the first and the last turn happen about one line. Only their sum or difference is determined by the
    orientation, and no finite rates of the angles give an angular velocity along the line across all three axes.

    Raises
    ------
    ModelError
        If there is no such sequence.
    """
    return (0.0, np.pi) if find_sequence(sequence).proper else (-np.pi / 2, np.pi / 2)


SINGULAR = 1e-7  # distance [rad] from a singular orientation below which it counts as one
Pair = tuple[np.ndarray, np.ndarray]


def distance_to_singular(orientation: Any, sequence: str = "XYZ") -> np.ndarray:
    """How far [rad], in [0, pi/2], the middle Euler angle of orientations is from where the sequence is singular.

    Raises
    ------
    ModelError
        If it is not an orientation, or there is no such sequence.
    """
    s = find_sequence(sequence)
    e = orientations(orientation, "rotations.distance_to_singular")
    return middle_angle(*polar_pairs(e.real, s), s)[1]


def is_singular(orientation: Any, sequence: str = "XYZ", tolerance: float = SINGULAR) -> np.ndarray:
    """Whether the Euler angles of orientations are singular: their middle angle within ``tolerance`` [rad] of it.

    Raises
    ------
    ModelError
        If it is not an orientation, or there is no such sequence.
    """
    return distance_to_singular(orientation, sequence) < tolerance


def polar_pairs(e: np.ndarray, s: Sequence) -> tuple[Pair, Pair]:
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


def report_singular(e: np.ndarray, s: Sequence, middle: np.ndarray, distance: np.ndarray, action: str) -> None:
    """Warn of or refuse singular orientations."""
    close = distance < SINGULAR
    k = tuple(int(i) for i in np.argwhere(close)[0])
    count = f"{np.count_nonzero(close)} of {close.size} orientations are" if close.ndim else "the orientation is"
    where = f"the first{index_text(k)}: " if close.ndim else ""
    text = (
        f"Euler angles {s.name!r}: {count} within {SINGULAR:g} rad of a singular middle angle ({where}"
        f"{middle[k].real:.9g} rad, {distance[k]:.2g} rad from it), where only the sum or difference of the outer "
        f"angles is determined; {sequence_remedy(e[k], 'the quaternion')}"
    )
    if action == "raise":
        raise SingularOrientationError(text, s.name, float(middle[k].real), float(distance[k]))
    warnings.warn(text, SingularOrientationWarning, stacklevel=3)


def sequence_remedy(e: np.ndarray, instead: str) -> str:
    """What to use at an orientation: the sequence farthest from singular there, or something without singularities."""
    distances = [float(distance_to_singular(e, name)) for name in INTRINSIC]
    best = int(np.argmax(np.round(distances, 9)))
    return (
        f"use another sequence ({INTRINSIC[best]!r} is {distances[best]:.2g} rad away from singular there) or {instead}"
    )


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
    s = find_sequence(sequence)
    x = number_array(angles, (3,), "rotations.unwrap")
    if x.ndim < 2:
        raise ModelError("rotations.unwrap: give a series of angles (n, ..., 3), time along the first axis")
    if len(x) < 2:
        return x
    other = x * np.array([1.0, -1.0, 1.0]) + np.pi * np.array([1.0, 0.0 if s.proper else 1.0, 1.0])
    same, crossing = (wrap_angle((y[1:] - x[:-1]).real) for y in (x, other))
    changes = (crossing**2).sum(axis=-1) < (same**2).sum(axis=-1)
    odd = np.cumsum(changes, axis=0) % 2 == 1
    x = np.concatenate([x[:1], np.where(odd[..., None], other[1:], x[1:])])
    turns = np.cumsum(np.round(np.diff(x.real, axis=0) / TURN), axis=0)
    return np.concatenate([x[:1], x[1:] - TURN * turns])


def wrap_angle(angle: np.ndarray) -> np.ndarray:
    """Less the nearest whole number of turns."""
    return angle - TURN * np.round(angle.real / TURN)


def hold_undetermined(third: np.ndarray, undetermined: np.ndarray) -> np.ndarray:
    """The third angle of the time before wherever it is not determined, of the first determined one at the start."""
    n = len(third)
    times = np.arange(n).reshape(n, *(1,) * (third.ndim - 1))
    last = np.maximum.accumulate(np.where(undetermined, -1, times), axis=0)
    held = np.take_along_axis(third, np.where(last < 0, np.argmin(undetermined, axis=0)[None], last), axis=0)
    return np.where(np.all(undetermined, axis=0), 0.0, held)


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
    s = find_sequence(sequence)
    eta = s.ordered(number_array(angles, (3,), "rotations.from_euler"))
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
    s = find_sequence(sequence)
    if singular not in ("warn", "raise", "choose"):
        raise ModelError(f'rotations.euler: singular={singular!r}; give "warn", "raise" or "choose"')
    e = orientations(orientation, "rotations.euler")
    if continuous and e.ndim < 2:
        raise ModelError(
            "rotations.euler: continuous=True needs a series of orientations; give them along the first axis"
        )
    low, high = polar_pairs(e, s)
    middle, distance = middle_angle(low, high, s)
    if singular != "choose" and np.any(distance < SINGULAR):
        report_singular(e, s, middle, distance, singular)
    first, third = _outer_angles(low, high, s, distance < UNDETERMINED, continuous)
    angles = joined((wrap_angle(first), middle, wrap_angle(third)))
    return unwrap(angles, sequence) if continuous else angles


def _outer_angles(low: Pair, high: Pair, s: Sequence, undetermined: np.ndarray, continuous: bool) -> tuple:
    """First and third angle from the directions of their half sum and half difference.

    Where only one of these is determined (``undetermined``), the third angle is chosen.
    """
    total, difference = 2 * atan2(low[1], low[0]), 2 * atan2(high[1], high[0])  # of those about the first and last axis
    first, third = 0.5 * (total + difference), 0.5 * (total - difference)
    if s.extrinsic:
        first, third, difference = third, first, -difference
    if np.any(undetermined):
        third = np.where(undetermined, hold_undetermined(third, undetermined) if continuous else 0.0, third)
        squares = [x.real**2 + y.real**2 for x, y in (low, high)]
        first = np.where(undetermined, np.where(squares[0] > squares[1], total - third, difference + third), first)
    return first, third


def bryant(orientation: Any, *, continuous: bool = False, singular: str = "warn") -> np.ndarray:
    """Bryant angles (..., 3) [rad] of orientations: about x, then the new y, then the newer z; singular at -+ pi/2.

    The same as `euler` with "XYZ", which says the rest.
    """
    return euler(orientation, "XYZ", continuous=continuous, singular=singular)


def from_bryant(angles: Any) -> np.ndarray:
    """Unit quaternions of Bryant angles (..., 3) [rad]; `from_euler` with "XYZ"."""
    return from_euler(angles, "XYZ")


SERIES = 4.0  # squares of angles below this go by the series
TERMS = 13


def stumpff(s: np.ndarray) -> tuple[np.ndarray, ...]:
    """C0 to c5 of s = theta^2, where c_k(s) is the sum over n of (-s)^n / (k + 2 n)! (Stumpff 1959).

    c0 = cos(theta), c1 = sin(theta)/theta, c2 = (1 - cos(theta))/theta^2, c3 = (theta - sin(theta))/theta^3;
    c_{k+2} = (1/k! - c_k)/s, and dc_k/ds = (k c_{k+2} - c_{k+1})/2. Real or complex.
    """
    s = np.asarray(s)
    small = s.real < SERIES
    x = np.where(small, s, 0.0)
    c4, c5 = (_stumpff_series(x, k) for k in (4, 5))
    c2, c3 = 0.5 - x * c4, 1 / 6 - x * c5
    low = (1 - x * c2, 1 - x * c3, c2, c3, c4, c5)
    if np.all(small):
        return low
    y = np.where(small, SERIES, s)
    r = np.sqrt(y)
    c0, c1, c2 = np.cos(r), np.sin(r) / r, 2 * np.sin(r / 2) ** 2 / y
    c3 = (1 - c1) / y
    high = (c0, c1, c2, c3, (0.5 - c2) / y, (1 / 6 - c3) / y)
    return tuple(np.where(small, a, b) for a, b in zip(low, high))


def _stumpff_series(x: np.ndarray, k: int) -> np.ndarray:
    total = np.full_like(x, 1 / factorial(k + 2 * TERMS))
    for n in reversed(range(TERMS)):
        total = 1 / factorial(k + 2 * n) - x * total
    return total


def half_angle_factor(e: np.ndarray) -> np.ndarray:
    """(..., 1) factors theta / sin(theta/2) of unit quaternions with scalar part >= 0; smooth at no rotation."""
    w, v = e[..., :1], e[..., 1:]
    square = (v * v).sum(axis=-1, keepdims=True)
    small = square.real < 1e-3
    t = np.where(small, square / np.where(small, w, 1.0) ** 2, 0.0)  # tan^2(theta/2)
    series = np.zeros_like(t)
    for n in reversed(range(8)):
        series = 1 / (2 * n + 1) - t * series
    size = np.sqrt(np.where(small, 1.0, square))
    return np.where(small, 2 * series / np.where(small, w, 1.0), 2 * atan2(size, w) / size)


def _short_quaternion(orientation: Any, what: str) -> np.ndarray:
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
    e = _short_quaternion(orientation, "rotations.axis_angle")
    v = e[..., 1:]
    factor = half_angle_factor(e)
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
    half = 0.5 * number_array(angle, (), "rotations.from_axis_angle: angle")[..., None]
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
    e = _short_quaternion(orientation, "rotations.rotation_vector")
    return half_angle_factor(e) * e[..., 1:]


def from_rotation_vector(vector: Any) -> np.ndarray:
    """Unit quaternions of rotation vectors (..., 3) [rad] of any length: the exponential of the rotation.

    Raises
    ------
    ModelError
        If the vectors do not have three components.
    """
    phi = number_array(vector, (3,), "rotations.from_rotation_vector")
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
    e = _short_quaternion(orientation, "rotations.gibbs")
    distance = np.pi - 2 * np.arctan2(np.sqrt((e[..., 1:].real ** 2).sum(axis=-1)), e[..., 0].real)
    if np.any(distance < SINGULAR):
        k = np.unravel_index(int(np.argmin(distance)), distance.shape)
        raise SingularOrientationError(
            f"rotations.gibbs{index_text(tuple(map(int, k)))}: "
            f"the turn is {distance[k]:.2g} rad from half a turn (rule: "
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
    g = number_array(vector, (3,), "rotations.from_gibbs")
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
    S = number_array(matrix, (3, 3), "rotations.from_cayley")
    off = np.abs(S + np.swapaxes(S, -1, -2)).max(axis=(-1, -2), initial=0.0)
    bad = off > 1e-9 * np.abs(S).max(axis=(-1, -2), initial=0.0)
    if np.any(bad):
        k = tuple(int(i) for i in np.argwhere(bad)[0])
        raise ModelError(
            f"rotations.from_cayley{index_text(k)}: S + S^T has an entry {off[k]:.2g}; S must be skew-symmetric, as "
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
    e = _short_quaternion(orientation, "rotations.modified_rodrigues")
    return e[..., 1:] / (1 + e[..., :1])


def from_modified_rodrigues(vector: Any) -> np.ndarray:
    """Unit quaternions of modified Rodrigues parameters (..., 3) of any length.

    Raises
    ------
    ModelError
        If the vectors do not have three components.
    """
    m = number_array(vector, (3,), "rotations.from_modified_rodrigues")
    square = (m * m).sum(axis=-1, keepdims=True)
    return np.concatenate([1 - square, 2 * m], axis=-1) / (1 + square)


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
    A = number_array(matrix, (3, 3), "rotations.nearest")
    if np.iscomplexobj(A):
        raise ModelError("rotations.nearest: the matrix is complex; give a real one")
    U, s, Vt = np.linalg.svd(A)
    hand = np.sign(np.linalg.det(U @ Vt))
    unique = s[..., 1] + hand * s[..., 2] > 1e-9 * s[..., 0]
    if not np.all(unique):
        k = tuple(int(i) for i in np.argwhere(~unique)[0])
        raise ModelError(
            f"rotations.nearest{index_text(k)}: no single rotation is closest to a matrix with determinant "
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
    return joined(mv(R, split(number_array(vectors, (3,), "rotations.apply: vectors"))))


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
    phi = number_array(part, (), "rotations.slerp: part")[..., None] * (half_angle_factor(e) * e[..., 1:])
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
