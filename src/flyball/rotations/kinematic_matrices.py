"""Kinematic matrices: angular velocity against the rates of Euler angles, quaternions, rotation vectors.

Components are along the turned frame ("body") or the one that stays ("base").

Euler angles: w = H etadot and alpha = H etaddot + Hdot etadot; the columns of H are the axes of the three turns
(Wittenburg, "Dynamics of Multibody Systems", 2008, chap. 2).

Quaternions: qdot = T w and w = 2 G qdot, T = G^T / 2, singular nowhere. G and T are linear in q, so their time
derivatives are G(qdot) and T(qdot) (Nikravesh, "Computer-Aided Analysis of Mechanical Systems", 1988, chapter 6).

Rotation vectors: w = J phidot with the right Jacobian of SO(3) for the body, the left one for the base; alpha = J
phiddot + Jdot phidot. In the functions c_k of the angle's square (see `stumpff`)

    J_left = c1 + c2 S + c3 phi phi^T,  J_left^-1 = c1/(2 c2) - S/2 + (c3 - 2 c4)/(2 c2) phi phi^T,  S b = phi x b,

and the right ones are their transposes (Sola, Deray and Atchuthan, "A micro Lie theory for state estimation in
robotics", 2018, with other functions of the angle). Smooth at phi = 0, singular at whole turns.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import ModelError, SingularOrientationError
from ..math.rotation import axes_in_base, axes_in_base_rate, axes_in_body, axes_in_body_rate, reciprocal_rows
from .arrays import columns, index_text, matrix_times_vector, number_array, rows, skew, split
from .conversions import SINGULAR, Sequence, find_sequence, from_euler, sequence_remedy, singular_angles, stumpff


def is_body_axes(axes: str, what: str) -> bool:
    """Whether components are asked for along the turned frame.

    Raises
    ------
    ModelError
        If ``axes`` is neither "body" nor "base".
    """
    if axes not in ("body", "base"):
        raise ModelError(f'{what}: axes={axes!r}; give "body" (the turned frame) or "base" (the frame that stays)')
    return axes == "body"


def _turn_axes(angles: np.ndarray, s: Sequence, body: bool) -> tuple:
    """Axes of the three turns in the order of the sequence, as tuples of components."""
    a, b, c = split(s.ordered(angles))
    return axes_in_body(*s.axes, b, c) if body else axes_in_base(*s.axes, a, b)


def euler_H(angles: Any, sequence: str = "XYZ", axes: str = "body") -> np.ndarray:
    """Kinematic matrices H (..., 3, 3) of Euler angles: angular velocity w = H etadot.

    Parameters
    ----------
    angles : (..., 3) array [rad]
    sequence : str
        As in `from_euler`.
    axes : "body" or "base"
        w along the turned frame (w_AB_B) or along the frame that stays (w_AB_A).

    Raises
    ------
    ModelError
        If there is no such sequence, or the angles are not three numbers each.
    """
    s, body = find_sequence(sequence), is_body_axes(axes, "rotations.euler_H")
    return s.ordered(columns(_turn_axes(number_array(angles, (3,), "rotations.euler_H"), s, body)))


def euler_H_inverse(
    angles: Any, sequence: str = "XYZ", axes: str = "body", *, tolerance: float = SINGULAR
) -> np.ndarray:
    """Inverses (..., 3, 3) of the kinematic matrices: etadot = H^-1 w. Arguments as for `euler_H`.

    Parameters
    ----------
    tolerance : float
        Distance [rad] of the middle angle from a singular one below which the inverse is refused. Its largest entry is
        about one by this distance.

    Raises
    ------
    SingularOrientationError
        If the middle angle is that close to a singular one.
    ModelError
        If there is no such sequence, or the angles are not three numbers each.
    """
    s, body = find_sequence(sequence), is_body_axes(axes, "rotations.euler_H_inverse")
    eta = number_array(angles, (3,), "rotations.euler_H_inverse")
    _refuse_singular(eta, s, tolerance)
    inverse = rows(reciprocal_rows(_turn_axes(eta, s, body)))
    return inverse[..., ::-1, :] if s.extrinsic else inverse


def euler_H_rate(angles: Any, rates: Any, sequence: str = "XYZ", axes: str = "body") -> np.ndarray:
    """Time derivatives Hdot (..., 3, 3) of the kinematic matrices: alpha = H etaddot + Hdot etadot.

    Parameters
    ----------
    angles, rates : (..., 3) arrays [rad], [rad/s]
    sequence, axes : as for `euler_H`

    Raises
    ------
    ModelError
        If there is no such sequence, or angles or rates are not three numbers each.
    """
    s, body = find_sequence(sequence), is_body_axes(axes, "rotations.euler_H_rate")
    eta = number_array(angles, (3,), "rotations.euler_H_rate: angles")
    speed = number_array(rates, (3,), "rotations.euler_H_rate: rates")
    derivative = axes_in_body_rate if body else axes_in_base_rate
    return s.ordered(columns(derivative(_turn_axes(eta, s, body), split(s.ordered(speed)))))


def euler_rates(angles: Any, angular_velocity: Any, sequence: str = "XYZ", axes: str = "body") -> np.ndarray:
    """Rates of Euler angles (..., 3) [rad/s] from an angular velocity [rad/s] along ``axes``: etadot = H^-1 w.

    Raises
    ------
    SingularOrientationError
        Within 1e-7 rad of a singular middle angle.
    ModelError
        As for `euler_H`.
    """
    w = number_array(angular_velocity, (3,), "rotations.euler_rates: angular velocity")
    return matrix_times_vector(euler_H_inverse(angles, sequence, axes), w)


def euler_angular_velocity(angles: Any, rates: Any, sequence: str = "XYZ", axes: str = "body") -> np.ndarray:
    """Angular velocity (..., 3) [rad/s] along ``axes`` from the rates [rad/s] of Euler angles: w = H etadot.

    Raises
    ------
    ModelError
        As for `euler_H`.
    """
    return matrix_times_vector(
        euler_H(angles, sequence, axes), number_array(rates, (3,), "rotations.euler_angular_velocity: rates")
    )


def euler_accelerations(
    angles: Any, rates: Any, angular_acceleration: Any, sequence: str = "XYZ", axes: str = "body"
) -> np.ndarray:
    """Second derivatives of Euler angles (..., 3) [rad/s^2]: etaddot = H^-1 (alpha - Hdot etadot).

    Parameters
    ----------
    angles, rates : (..., 3) arrays [rad], [rad/s]
    angular_acceleration : (..., 3) array [rad/s^2]
        Along ``axes``. (Its components are the derivatives of those of w, in the body's axes as well.)
    sequence, axes : as for `euler_H`

    Raises
    ------
    SingularOrientationError
        Within 1e-7 rad of a singular middle angle.
    ModelError
        As for `euler_H`.
    """
    alpha = number_array(angular_acceleration, (3,), "rotations.euler_accelerations: angular acceleration")
    speed = number_array(rates, (3,), "rotations.euler_accelerations: rates")
    bias = matrix_times_vector(euler_H_rate(angles, speed, sequence, axes), speed)
    return matrix_times_vector(euler_H_inverse(angles, sequence, axes), alpha - bias)


def euler_angular_acceleration(
    angles: Any, rates: Any, accelerations: Any, sequence: str = "XYZ", axes: str = "body"
) -> np.ndarray:
    """Angular acceleration (..., 3) [rad/s^2] along ``axes``: alpha = H etaddot + Hdot etadot.

    Parameters
    ----------
    angles, rates, accelerations : (..., 3) arrays [rad], [rad/s], [rad/s^2]
    sequence, axes : as for `euler_H`

    Raises
    ------
    ModelError
        As for `euler_H`.
    """
    what = "rotations.euler_angular_acceleration"
    speed, second = (
        number_array(rates, (3,), f"{what}: rates"),
        number_array(accelerations, (3,), f"{what}: accelerations"),
    )
    bias = matrix_times_vector(euler_H_rate(angles, speed, sequence, axes), speed)
    return matrix_times_vector(euler_H(angles, sequence, axes), second) + bias


def _refuse_singular(angles: np.ndarray, s: Sequence, tolerance: float) -> None:
    """Raise where the middle angle, of any size, is too close to a singular one."""
    b = angles[..., 1].real
    distance = np.arcsin(np.abs(np.sin(b) if s.proper else np.cos(b)))
    if not np.any(distance < tolerance):
        return
    k = np.unravel_index(int(np.argmin(distance)), distance.shape)
    at = tuple(int(i) for i in k)
    near, cure = singular_angles(s.name), sequence_remedy(from_euler(angles[k].real, s.name), "quaternion_rates")
    raise SingularOrientationError(
        f"Euler angles {s.name!r}{index_text(at)}: the middle angle {b[k]:.9g} rad is {distance[k]:.2g} rad "
        f"from a singular "
        f"one ({near[0]:.5g} or {near[1]:.5g}, and whole turns on; rule: at least {tolerance:g}), where an angular "
        f"velocity has no finite rates of these angles; {cure}",
        s.name,
        float(b[k]),
        float(distance[k]),
    )


def quaternion_G(quaternion: Any, axes: str = "body") -> np.ndarray:
    """Matrices G (..., 3, 4): w = 2 G qdot, G G^T = 1 and G q = 0 for a unit quaternion.

    Parameters
    ----------
    quaternion : (..., 4) array
        Scalar first. It is not brought to unit length, so that G(qdot) is the time derivative.
    axes : "body" or "base"
        w along the turned frame (w_AB_B) or along the frame that stays (w_AB_A).

    Raises
    ------
    ModelError
        If it has another shape.
    """
    w, x, y, z = split(number_array(quaternion, (4,), "rotations.quaternion_G"))
    if is_body_axes(axes, "rotations.quaternion_G"):
        return rows(((-x, w, z, -y), (-y, -z, w, x), (-z, y, -x, w)))
    return rows(((-x, w, -z, y), (-y, z, w, -x), (-z, -y, x, w)))


def quaternion_T(quaternion: Any, axes: str = "body") -> np.ndarray:
    """Matrices T = G^T / 2 (..., 4, 3): qdot = T w. Arguments as for `quaternion_G`.

    Raises
    ------
    ModelError
        If it has another shape.
    """
    return 0.5 * np.swapaxes(quaternion_G(quaternion, axes), -1, -2)


def quaternion_rates(quaternion: Any, angular_velocity: Any, axes: str = "body") -> np.ndarray:
    """Rates of unit quaternions (..., 4) [1/s] from an angular velocity [rad/s] along ``axes``: qdot = T w.

    Raises
    ------
    ModelError
        As for `quaternion_G`; if a quaternion has not unit length to 1e-6.
    """
    q = _unit_quaternion(quaternion, "rotations.quaternion_rates")
    return matrix_times_vector(
        quaternion_T(q, axes), number_array(angular_velocity, (3,), "rotations.quaternion_rates: angular velocity")
    )


def quaternion_angular_velocity(quaternion: Any, rates: Any, axes: str = "body") -> np.ndarray:
    """Angular velocity (..., 3) [rad/s] along ``axes`` from the rates [1/s] of a unit quaternion: w = 2 G qdot.

    Raises
    ------
    ModelError
        As for `quaternion_rates`.
    """
    q = _unit_quaternion(quaternion, "rotations.quaternion_angular_velocity")
    return 2 * matrix_times_vector(
        quaternion_G(q, axes), number_array(rates, (4,), "rotations.quaternion_angular_velocity: rates")
    )


def quaternion_accelerations(
    quaternion: Any, angular_velocity: Any, angular_acceleration: Any, axes: str = "body"
) -> np.ndarray:
    """Second derivatives of unit quaternions (..., 4) [1/s^2]: qddot = T alpha - w^2 q / 4.

    Raises
    ------
    ModelError
        As for `quaternion_rates`.
    """
    q = _unit_quaternion(quaternion, "rotations.quaternion_accelerations")
    w = number_array(angular_velocity, (3,), "rotations.quaternion_accelerations: angular velocity")
    alpha = number_array(angular_acceleration, (3,), "rotations.quaternion_accelerations: angular acceleration")
    return matrix_times_vector(quaternion_T(q, axes), alpha) - 0.25 * (w * w).sum(axis=-1, keepdims=True) * q


def quaternion_angular_acceleration(quaternion: Any, accelerations: Any, axes: str = "body") -> np.ndarray:
    """Angular acceleration (..., 3) [rad/s^2] along ``axes`` from the second derivatives [1/s^2]: alpha = 2 G qddot.

    The rates have no part in it, because G(qdot) qdot = 0.

    Raises
    ------
    ModelError
        As for `quaternion_rates`.
    """
    what = "rotations.quaternion_angular_acceleration"
    return 2 * matrix_times_vector(
        quaternion_G(_unit_quaternion(quaternion, what), axes),
        number_array(accelerations, (4,), f"{what}: accelerations"),
    )


def _unit_quaternion(quaternion: Any, what: str) -> np.ndarray:
    """Quaternions as they are: w = 2 G qdot holds for unit length, and rates belong to the length given."""
    q = number_array(quaternion, (4,), what)
    off = np.abs((q * q).sum(axis=-1).real - 1)
    if np.any(off > 2e-6):
        worst = float(np.sqrt(1 + off.max())) if off.size else 1.0
        raise ModelError(
            f"{what}: a quaternion is as long as {worst:.7g} (rule: 1 to 1e-6); divide it by its length, "
            "rotations.quaternion does"
        )
    return q


def _stumpff_matrices(phi: np.ndarray) -> tuple[np.ndarray, ...]:
    """C0 to c5 of the square of the angle, ready to multiply matrices with."""
    return tuple(c[..., None, None] for c in stumpff((phi * phi).sum(axis=-1)))


def _outer(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., :, None] * b[..., None, :]


def left_jacobian(vector: Any) -> np.ndarray:
    """Left Jacobians (..., 3, 3) of rotation vectors (..., 3) [rad]: w = J phidot along the frame that stays.

    Raises
    ------
    ModelError
        If the vectors do not have three components.
    """
    phi = number_array(vector, (3,), "rotations.left_jacobian")
    _, c1, c2, c3, *_ = _stumpff_matrices(phi)
    return c1 * np.eye(3) + c2 * skew(phi) + c3 * _outer(phi, phi)


def right_jacobian(vector: Any) -> np.ndarray:
    """Right Jacobians (..., 3, 3) of rotation vectors (..., 3) [rad]: w = J phidot along the turned frame.

    Raises
    ------
    ModelError
        If the vectors do not have three components.
    """
    return np.swapaxes(left_jacobian(vector), -1, -2)


def left_jacobian_inverse(vector: Any) -> np.ndarray:
    """Inverses (..., 3, 3) of the left Jacobians: phidot = J^-1 w, w along the frame that stays.

    Raises
    ------
    SingularOrientationError
        If the angle is within 1e-7 rad of one or more whole turns.
    ModelError
        If the vectors do not have three components.
    """
    phi = number_array(vector, (3,), "rotations.left_jacobian_inverse")
    angle = np.sqrt((phi.real**2).sum(axis=-1))
    whole = 2 * np.pi * np.maximum(np.round(angle / (2 * np.pi)), 1)
    distance = np.abs(angle - whole)
    if np.any(distance < SINGULAR):
        k = np.unravel_index(int(np.argmin(distance)), distance.shape)
        raise SingularOrientationError(
            f"rotation vector{index_text(tuple(map(int, k)))}: "
            f"the angle {angle[k]:.9g} rad is {distance[k]:.2g} rad from "
            f"whole turns (rule: at least {SINGULAR:g}), where an angular velocity has no finite rates of it; use the "
            "shorter vector of the same orientation, rotation_vector(from_rotation_vector(...)), or quaternion_rates",
            angle=float(angle[k]),
            distance=float(distance[k]),
        )
    _, c1, c2, c3, c4, _ = _stumpff_matrices(phi)
    return (c1 * np.eye(3) + (c3 - 2 * c4) * _outer(phi, phi)) / (2 * c2) - 0.5 * skew(phi)


def right_jacobian_inverse(vector: Any) -> np.ndarray:
    """Inverses (..., 3, 3) of the right Jacobians: phidot = J^-1 w, w along the turned frame.

    Raises
    ------
    SingularOrientationError
        If the angle is within 1e-7 rad of one or more whole turns.
    ModelError
        If the vectors do not have three components.
    """
    return np.swapaxes(left_jacobian_inverse(vector), -1, -2)


def left_jacobian_rate(vector: Any, rates: Any) -> np.ndarray:
    """Time derivatives (..., 3, 3) of the left Jacobians of rotation vectors [rad] with the rates [rad/s].

    Raises
    ------
    ModelError
        If the vectors or rates do not have three components.
    """
    phi = number_array(vector, (3,), "rotations.left_jacobian_rate: vector")
    speed = number_array(rates, (3,), "rotations.left_jacobian_rate: rates")
    _, _, c2, c3, c4, c5 = _stumpff_matrices(phi)
    grows = (2 * (phi * speed).sum(axis=-1))[..., None, None]  # the rate of the angle's square
    d1, d2, d3 = (0.5 * grows * d for d in (c3 - c2, 2 * c4 - c3, 3 * c5 - c4))
    turned = _outer(speed, phi)
    still = d1 * np.eye(3) + d2 * skew(phi) + d3 * _outer(phi, phi)
    return still + c2 * skew(speed) + c3 * (turned + np.swapaxes(turned, -1, -2))


def right_jacobian_rate(vector: Any, rates: Any) -> np.ndarray:
    """Time derivatives (..., 3, 3) of the right Jacobians of rotation vectors [rad] with the rates [rad/s].

    Raises
    ------
    ModelError
        If the vectors or rates do not have three components.
    """
    return np.swapaxes(left_jacobian_rate(vector, rates), -1, -2)


def _jacobian_along(vector: Any, body: bool) -> np.ndarray:
    return right_jacobian(vector) if body else left_jacobian(vector)


def _jacobian_inverse_along(vector: Any, body: bool) -> np.ndarray:
    return right_jacobian_inverse(vector) if body else left_jacobian_inverse(vector)


def _jacobian_bias(vector: Any, rates: np.ndarray, body: bool) -> np.ndarray:
    J = right_jacobian_rate(vector, rates) if body else left_jacobian_rate(vector, rates)
    return matrix_times_vector(J, rates)


def rotation_vector_rates(vector: Any, angular_velocity: Any, axes: str = "body") -> np.ndarray:
    """Rates of rotation vectors (..., 3) [rad/s] from an angular velocity [rad/s] along ``axes``: J^-1 w.

    Raises
    ------
    SingularOrientationError
        If the angle is within 1e-7 rad of one or more whole turns.
    ModelError
        If something does not have three components, or ``axes`` is neither "body" nor "base".
    """
    what = "rotations.rotation_vector_rates"
    return matrix_times_vector(
        _jacobian_inverse_along(vector, is_body_axes(axes, what)),
        number_array(angular_velocity, (3,), f"{what}: angular velocity"),
    )


def rotation_vector_angular_velocity(vector: Any, rates: Any, axes: str = "body") -> np.ndarray:
    """Angular velocity (..., 3) [rad/s] along ``axes`` from the rates [rad/s] of rotation vectors: J phidot.

    Raises
    ------
    ModelError
        If something does not have three components, or ``axes`` is neither "body" nor "base".
    """
    what = "rotations.rotation_vector_angular_velocity"
    return matrix_times_vector(
        _jacobian_along(vector, is_body_axes(axes, what)), number_array(rates, (3,), f"{what}: rates")
    )


def rotation_vector_accelerations(vector: Any, rates: Any, angular_acceleration: Any, axes: str = "body") -> np.ndarray:
    """Second derivatives of rotation vectors (..., 3) [rad/s^2]: J^-1 (alpha - Jdot phidot).

    Raises
    ------
    SingularOrientationError
        If the angle is within 1e-7 rad of one or more whole turns.
    ModelError
        If something does not have three components, or ``axes`` is neither "body" nor "base".
    """
    what = "rotations.rotation_vector_accelerations"
    body, speed = is_body_axes(axes, what), number_array(rates, (3,), f"{what}: rates")
    alpha = number_array(angular_acceleration, (3,), f"{what}: angular acceleration")
    return matrix_times_vector(_jacobian_inverse_along(vector, body), alpha - _jacobian_bias(vector, speed, body))


def rotation_vector_angular_acceleration(vector: Any, rates: Any, accelerations: Any, axes: str = "body") -> np.ndarray:
    """Angular acceleration (..., 3) [rad/s^2] along ``axes``: J phiddot + Jdot phidot.

    Raises
    ------
    ModelError
        If something does not have three components, or ``axes`` is neither "body" nor "base".
    """
    what = "rotations.rotation_vector_angular_acceleration"
    body, speed = is_body_axes(axes, what), number_array(rates, (3,), f"{what}: rates")
    second = number_array(accelerations, (3,), f"{what}: accelerations")
    return matrix_times_vector(_jacobian_along(vector, body), second) + _jacobian_bias(vector, speed, body)
