"""Angular velocity and acceleration against the rates of the quaternion; singular nowhere.

qdot = T w and w = 2 G qdot, T = G^T / 2, with w along the turned frame ("body") or the one that stays ("base"). G and T
are linear in q, so their time derivatives are G(qdot) and T(qdot) (Nikravesh, "Computer-Aided Analysis of Mechanical
Systems", 1988, chapter 6, where the body's G is called L).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import ModelError
from .arrays import rows, split, times
from .checks import numbers
from .euler_kinematics import in_body


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
    w, x, y, z = split(numbers(quaternion, (4,), "rotations.quaternion_G"))
    if in_body(axes, "rotations.quaternion_G"):
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
    q = _unit(quaternion, "rotations.quaternion_rates")
    return times(quaternion_T(q, axes), numbers(angular_velocity, (3,), "rotations.quaternion_rates: angular velocity"))


def quaternion_angular_velocity(quaternion: Any, rates: Any, axes: str = "body") -> np.ndarray:
    """Angular velocity (..., 3) [rad/s] along ``axes`` from the rates [1/s] of a unit quaternion: w = 2 G qdot.

    Raises
    ------
    ModelError
        As for `quaternion_rates`.
    """
    q = _unit(quaternion, "rotations.quaternion_angular_velocity")
    return 2 * times(quaternion_G(q, axes), numbers(rates, (4,), "rotations.quaternion_angular_velocity: rates"))


def quaternion_accelerations(
    quaternion: Any, angular_velocity: Any, angular_acceleration: Any, axes: str = "body"
) -> np.ndarray:
    """Second derivatives of unit quaternions (..., 4) [1/s^2]: qddot = T alpha - w^2 q / 4.

    Raises
    ------
    ModelError
        As for `quaternion_rates`.
    """
    q = _unit(quaternion, "rotations.quaternion_accelerations")
    w = numbers(angular_velocity, (3,), "rotations.quaternion_accelerations: angular velocity")
    alpha = numbers(angular_acceleration, (3,), "rotations.quaternion_accelerations: angular acceleration")
    return times(quaternion_T(q, axes), alpha) - 0.25 * (w * w).sum(axis=-1, keepdims=True) * q


def quaternion_angular_acceleration(quaternion: Any, accelerations: Any, axes: str = "body") -> np.ndarray:
    """Angular acceleration (..., 3) [rad/s^2] along ``axes`` from the second derivatives [1/s^2]: alpha = 2 G qddot.

    The rates have no part in it, because G(qdot) qdot = 0.

    Raises
    ------
    ModelError
        As for `quaternion_rates`.
    """
    what = "rotations.quaternion_angular_acceleration"
    return 2 * times(
        quaternion_G(_unit(quaternion, what), axes), numbers(accelerations, (4,), f"{what}: accelerations")
    )


def _unit(quaternion: Any, what: str) -> np.ndarray:
    """Quaternions as they are: w = 2 G qdot holds for unit length, and rates belong to the length given."""
    q = numbers(quaternion, (4,), what)
    off = np.abs((q * q).sum(axis=-1).real - 1)
    if np.any(off > 2e-6):
        worst = float(np.sqrt(1 + off.max())) if off.size else 1.0
        raise ModelError(
            f"{what}: a quaternion is as long as {worst:.7g} (rule: 1 to 1e-6); divide it by its length, "
            "rotations.quaternion does"
        )
    return q
