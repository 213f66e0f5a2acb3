"""Angular velocity and acceleration against the rates of the rotation vector: the Jacobians of SO(3).

w = J phidot with the right Jacobian for w along the turned frame ("body"), the left one for w along the one that stays
("base"); alpha = J phiddot + Jdot phidot. In the functions c_k of the angle's square (see `stumpff`)

    J_left = c1 + c2 S + c3 phi phi^T,    J_left^-1 = c1/(2 c2) - S/2 + (c3 - 2 c4)/(2 c2) phi phi^T,    S b = phi x b,

and the right ones are their transposes (Sola, Deray and Atchuthan, "A micro Lie theory for state estimation in
robotics", 2018, with other functions of the angle). Smooth at phi = 0, singular at whole turns.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import SingularOrientationError
from .arrays import skew, times
from .checks import numbers, place
from .euler_kinematics import in_body
from .singular import SINGULAR
from .stumpff import stumpff


def _squared(phi: np.ndarray) -> tuple[np.ndarray, ...]:
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
    phi = numbers(vector, (3,), "rotations.left_jacobian")
    _, c1, c2, c3, *_ = _squared(phi)
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
    phi = numbers(vector, (3,), "rotations.left_jacobian_inverse")
    angle = np.sqrt((phi.real**2).sum(axis=-1))
    whole = 2 * np.pi * np.maximum(np.round(angle / (2 * np.pi)), 1)
    distance = np.abs(angle - whole)
    if np.any(distance < SINGULAR):
        k = np.unravel_index(int(np.argmin(distance)), distance.shape)
        raise SingularOrientationError(
            f"rotation vector{place(tuple(map(int, k)))}: the angle {angle[k]:.9g} rad is {distance[k]:.2g} rad from "
            f"whole turns (rule: at least {SINGULAR:g}), where an angular velocity has no finite rates of it; use the "
            "shorter vector of the same orientation, rotation_vector(from_rotation_vector(...)), or quaternion_rates",
            angle=float(angle[k]),
            distance=float(distance[k]),
        )
    _, c1, c2, c3, c4, _ = _squared(phi)
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
    phi = numbers(vector, (3,), "rotations.left_jacobian_rate: vector")
    speed = numbers(rates, (3,), "rotations.left_jacobian_rate: rates")
    _, _, c2, c3, c4, c5 = _squared(phi)
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


def _jacobian(vector: Any, body: bool) -> np.ndarray:
    return right_jacobian(vector) if body else left_jacobian(vector)


def _inverse(vector: Any, body: bool) -> np.ndarray:
    return right_jacobian_inverse(vector) if body else left_jacobian_inverse(vector)


def _bias(vector: Any, rates: np.ndarray, body: bool) -> np.ndarray:
    J = right_jacobian_rate(vector, rates) if body else left_jacobian_rate(vector, rates)
    return times(J, rates)


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
    return times(_inverse(vector, in_body(axes, what)), numbers(angular_velocity, (3,), f"{what}: angular velocity"))


def rotation_vector_angular_velocity(vector: Any, rates: Any, axes: str = "body") -> np.ndarray:
    """Angular velocity (..., 3) [rad/s] along ``axes`` from the rates [rad/s] of rotation vectors: J phidot.

    Raises
    ------
    ModelError
        If something does not have three components, or ``axes`` is neither "body" nor "base".
    """
    what = "rotations.rotation_vector_angular_velocity"
    return times(_jacobian(vector, in_body(axes, what)), numbers(rates, (3,), f"{what}: rates"))


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
    body, speed = in_body(axes, what), numbers(rates, (3,), f"{what}: rates")
    alpha = numbers(angular_acceleration, (3,), f"{what}: angular acceleration")
    return times(_inverse(vector, body), alpha - _bias(vector, speed, body))


def rotation_vector_angular_acceleration(vector: Any, rates: Any, accelerations: Any, axes: str = "body") -> np.ndarray:
    """Angular acceleration (..., 3) [rad/s^2] along ``axes``: J phiddot + Jdot phidot.

    Raises
    ------
    ModelError
        If something does not have three components, or ``axes`` is neither "body" nor "base".
    """
    what = "rotations.rotation_vector_angular_acceleration"
    body, speed = in_body(axes, what), numbers(rates, (3,), f"{what}: rates")
    second = numbers(accelerations, (3,), f"{what}: accelerations")
    return times(_jacobian(vector, body), second) + _bias(vector, speed, body)
