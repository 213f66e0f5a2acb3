"""Rotations: every usual description of an orientation, conversions between them, and their kinematics.

Unit quaternions (scalar first, Hamilton product) are the hub: every ``from_...`` gives one, and every function that is
named after a description takes quaternions (..., 4) or rotation matrices (..., 3, 3). All are vectorised over leading
axes, take radians, and take complex numbers where they are analytic, so that a complex step gives their derivatives.
An orientation of a frame B seen from A is R_AB: it takes components along B to components along A. Functions of rates
take ``axes="body"`` for components along B, ``axes="base"`` for components along A.
"""

from __future__ import annotations

from .continuous import unwrap
from .euler_angles import (
    bryant,
    euler,
    from_bryant,
    from_euler,
)
from .euler_kinematics import (
    euler_accelerations,
    euler_angular_acceleration,
    euler_angular_velocity,
    euler_H,
    euler_H_inverse,
    euler_H_rate,
    euler_rates,
)
from .quaternion_kinematics import (
    quaternion_accelerations,
    quaternion_angular_acceleration,
    quaternion_angular_velocity,
    quaternion_G,
    quaternion_rates,
    quaternion_T,
)
from .quaternions import (
    angular_distance,
    apply,
    compose,
    from_matrix,
    inverse,
    matrix,
    nearest,
    quaternion,
    random,
    relative,
    slerp,
)
from .sequences import EXTRINSIC, INTRINSIC, singular_angles
from .singular import distance_to_singular, is_singular
from .vector_kinematics import (
    left_jacobian,
    left_jacobian_inverse,
    left_jacobian_rate,
    right_jacobian,
    right_jacobian_inverse,
    right_jacobian_rate,
    rotation_vector_accelerations,
    rotation_vector_angular_acceleration,
    rotation_vector_angular_velocity,
    rotation_vector_rates,
)
from .vectors import (
    axis_angle,
    cayley,
    from_axis_angle,
    from_cayley,
    from_gibbs,
    from_modified_rodrigues,
    from_rotation_vector,
    gibbs,
    modified_rodrigues,
    rotation_vector,
)

__all__ = [
    "EXTRINSIC",
    "INTRINSIC",
    "angular_distance",
    "apply",
    "axis_angle",
    "bryant",
    "cayley",
    "compose",
    "distance_to_singular",
    "euler",
    "euler_H",
    "euler_H_inverse",
    "euler_H_rate",
    "euler_accelerations",
    "euler_angular_acceleration",
    "euler_angular_velocity",
    "euler_rates",
    "from_axis_angle",
    "from_bryant",
    "from_cayley",
    "from_euler",
    "from_gibbs",
    "from_matrix",
    "from_modified_rodrigues",
    "from_rotation_vector",
    "gibbs",
    "inverse",
    "is_singular",
    "left_jacobian",
    "left_jacobian_inverse",
    "left_jacobian_rate",
    "matrix",
    "modified_rodrigues",
    "nearest",
    "quaternion",
    "quaternion_G",
    "quaternion_T",
    "quaternion_accelerations",
    "quaternion_angular_acceleration",
    "quaternion_angular_velocity",
    "quaternion_rates",
    "random",
    "relative",
    "right_jacobian",
    "right_jacobian_inverse",
    "right_jacobian_rate",
    "rotation_vector",
    "rotation_vector_accelerations",
    "rotation_vector_angular_acceleration",
    "rotation_vector_angular_velocity",
    "rotation_vector_rates",
    "singular_angles",
    "slerp",
    "unwrap",
]
