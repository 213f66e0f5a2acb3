"""Angular velocity and acceleration against the rates of Euler angles, for every sequence.

w = H etadot and alpha = H etaddot + Hdot etadot, components along the turned frame ("body") or the one that stays
("base"). The columns of H are the axes of the three turns (Wittenburg, "Dynamics of Multibody Systems", 2008, chap. 2).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import ModelError, SingularOrientationError
from ..math.turns import axes_in_base, axes_in_base_rate, axes_in_body, axes_in_body_rate, reciprocal
from .arrays import columns, rows, split, times
from .checks import numbers, place
from .euler_angles import from_euler
from .sequences import Sequence, find, singular_angles
from .singular import SINGULAR, remedy


def in_body(axes: str, what: str) -> bool:
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
    s, body = find(sequence), in_body(axes, "rotations.euler_H")
    return s.ordered(columns(_turn_axes(numbers(angles, (3,), "rotations.euler_H"), s, body)))


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
    s, body = find(sequence), in_body(axes, "rotations.euler_H_inverse")
    eta = numbers(angles, (3,), "rotations.euler_H_inverse")
    _refuse_singular(eta, s, tolerance)
    inverse = rows(reciprocal(_turn_axes(eta, s, body)))
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
    s, body = find(sequence), in_body(axes, "rotations.euler_H_rate")
    eta = numbers(angles, (3,), "rotations.euler_H_rate: angles")
    speed = numbers(rates, (3,), "rotations.euler_H_rate: rates")
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
    w = numbers(angular_velocity, (3,), "rotations.euler_rates: angular velocity")
    return times(euler_H_inverse(angles, sequence, axes), w)


def euler_angular_velocity(angles: Any, rates: Any, sequence: str = "XYZ", axes: str = "body") -> np.ndarray:
    """Angular velocity (..., 3) [rad/s] along ``axes`` from the rates [rad/s] of Euler angles: w = H etadot.

    Raises
    ------
    ModelError
        As for `euler_H`.
    """
    return times(euler_H(angles, sequence, axes), numbers(rates, (3,), "rotations.euler_angular_velocity: rates"))


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
    alpha = numbers(angular_acceleration, (3,), "rotations.euler_accelerations: angular acceleration")
    speed = numbers(rates, (3,), "rotations.euler_accelerations: rates")
    bias = times(euler_H_rate(angles, speed, sequence, axes), speed)
    return times(euler_H_inverse(angles, sequence, axes), alpha - bias)


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
    speed, second = numbers(rates, (3,), f"{what}: rates"), numbers(accelerations, (3,), f"{what}: accelerations")
    bias = times(euler_H_rate(angles, speed, sequence, axes), speed)
    return times(euler_H(angles, sequence, axes), second) + bias


def _refuse_singular(angles: np.ndarray, s: Sequence, tolerance: float) -> None:
    """Raise where the middle angle, of any size, is too close to a singular one."""
    b = angles[..., 1].real
    distance = np.arcsin(np.abs(np.sin(b) if s.proper else np.cos(b)))
    if not np.any(distance < tolerance):
        return
    k = np.unravel_index(int(np.argmin(distance)), distance.shape)
    at = tuple(int(i) for i in k)
    near, cure = singular_angles(s.name), remedy(from_euler(angles[k].real, s.name), "quaternion_rates")
    raise SingularOrientationError(
        f"Euler angles {s.name!r}{place(at)}: the middle angle {b[k]:.9g} rad is {distance[k]:.2g} rad from a singular "
        f"one ({near[0]:.5g} or {near[1]:.5g}, and whole turns on; rule: at least {tolerance:g}), where an angular "
        f"velocity has no finite rates of these angles; {cure}",
        s.name,
        float(b[k]),
        float(distance[k]),
    )
