"""Bushing: springs and dampers against all six relative motions of two frames."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Annotated, Any, ClassVar

import numpy as np

from ..compiler.formulas import formula
from ..errors import ModelError
from ..math.rotation import log_gradient, rotation_vector
from ..math.scalar import choose
from ..math.vec import add, cross, mm, mtv, mv, neg, norm, sub, transpose
from ..model.body import Orientation
from ..model.element import Number, Numbers, Unit, element
from ..model.force import TwoFrameForce
from ..model.geometry import orientation_matrix, rotation_about, vector
from ..model.joint import WorldFrame

KIND = 5


@formula
def scaled_components(par, k, a):
    """Return three neighbouring parameters, each times its component of a."""
    return (par[k] * a[0], par[k + 1] * a[1], par[k + 2] * a[2])


@formula
def relative_rotation(par, F, M):
    """Return the rotation from F to M; the identity without torsional stiffness."""
    R = mm(transpose(F[1]), M[1])
    k = par[6] + par[7] + par[8]
    l = 0.0 * R[0] + 1.0
    o = 0.0 * l
    return (
        choose(k, R[0], l), choose(k, R[1], o), choose(k, R[2], o), choose(k, R[3], o), choose(k, R[4], l),
        choose(k, R[5], o), choose(k, R[6], o), choose(k, R[7], o), choose(k, R[8], l),
    )  # fmt: skip


@formula
def deflection(par, F, M):
    """Return the displacement and rotation vector of M relative to F, along F's axes."""
    return mtv(F[1], sub(M[0], F[0])), rotation_vector(relative_rotation(par, F, M))


@formula
def branch(par, F, M):
    """Return the rotation's quaternion times four times its first component, and the speed of rotation.

    The first component passes zero at half a turn. The results of two states within half a turn of each other have a
    positive product, unless half a turn lies between them.
    """
    R = relative_rotation(par, F, M)
    k = par[6] + par[7] + par[8]
    speed = choose(k, norm(sub(M[2], F[2])), 0.0 * k)
    return 1.0 + R[0] + R[4] + R[8], R[7] - R[5], R[2] - R[6], R[3] - R[1], speed


@formula
def wrench(par, F, M, laws, values):
    """Return the wrench on M, along F's axes: force -K d - C ddot, torque -J^T K_r theta - C_r omega.

    With theta the rotation vector, thetadot = J omega: the torque is the exact gradient of theta . K_r theta / 2, so a
    bushing without damping conserves energy also at large rotations with different stiffnesses.
    """
    d, theta = deflection(par, F, M)
    u = sub(sub(M[3], F[3]), cross(F[2], sub(M[0], F[0])))
    force = add(scaled_components(par, 0, d), scaled_components(par, 3, mtv(F[1], u)))
    torque = add(
        log_gradient(theta, scaled_components(par, 6, theta)), scaled_components(par, 9, mtv(F[1], sub(M[2], F[2])))
    )
    return neg(mv(F[1], force)), neg(mv(F[1], torque))


@formula
def energy(par, F, M):
    """Potential energy d . K d / 2 + theta . K_r theta / 2 [J]."""
    d, theta = deflection(par, F, M)
    a = scaled_components(par, 0, d)
    b = scaled_components(par, 6, theta)
    s = 0.5 * (d[0] * a[0] + d[1] * a[1] + d[2] * a[2])
    return s + 0.5 * (theta[0] * b[0] + theta[1] * b[1] + theta[2] * b[2])


PerAxis = Number | Numbers


@element
class Bushing(TwoFrameForce):
    """A rubber mount: springs and dampers in six components connect ``body_j`` to ``body_i`` at a point.

    It is unloaded in the reference configuration. Components are along axes fixed in ``body_i``. Rotations are measured
    by the rotation vector, which is regular up to half a turn; there the run stops, unless no torsional stiffness is
    given.

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Bodies, or frames fixed on bodies; ``"ground"`` is the world.
    at : point [m]
        The point, in world coordinates of the drawn configuration.
    orientation : quaternion, Bryant angles [rad] or matrix; in the plane one angle
        Axes of the components, in the world, in the reference configuration.
    stiffness : number, or one for each axis [N/m]
    damping : number, or one for each axis [N s/m]
    torsional_stiffness : number, or one for each axis [N m/rad]
    torsional_damping : number, or one for each axis [N m s/rad]
    """

    orientation: Orientation | None = None
    angle: Annotated[Number, Unit("rad")] = 0.0
    stiffness: Annotated[PerAxis, Unit("N/m")] = 0.0
    damping: Annotated[PerAxis, Unit("N*s/m")] = 0.0
    torsional_stiffness: Annotated[PerAxis, Unit("N*m/rad")] = 0.0
    torsional_damping: Annotated[PerAxis, Unit("N*m*s/rad")] = 0.0

    kind: ClassVar[int] = KIND
    wrench: ClassVar = staticmethod(wrench)
    branch: ClassVar = staticmethod(branch)
    energy: ClassVar = staticmethod(energy)
    symbol: ClassVar[str] = "bushing"
    fails: ClassVar[str] = (
        "It is turned by half a turn, where the axis of the rotation vector is undefined. End the motion before "
        "that, or use a joint with springs"
    )

    def placed(self, n: SimpleNamespace, planar: bool) -> dict[str, WorldFrame] | None:
        """Return both frames at the point."""
        self._fit(n, planar)
        if n.at is None:
            return None
        p = vector(n.at, planar, f"'at' of {self.title}")
        R = rotation_about(2, n.angle)
        if n.orientation is not None:
            R = orientation_matrix(n.orientation, f"orientation of {self.title}")
        return {"F": (p, R), "M": (p, R)}

    def _fit(self, n: SimpleNamespace, planar: bool) -> None:
        """Require as many numbers as there are axes, and a valid orientation."""
        for name in ("stiffness", "damping", "torsional_stiffness", "torsional_damping"):
            wanted = 3 if not planar else 1 if name.startswith("torsional") else 2
            value = getattr(n, name)
            if isinstance(value, tuple) and len(value) != wanted:
                raise ModelError(f"{self.title}: {name} is one number or {wanted} here, one for each axis; got {value}")
        if planar and n.orientation is not None:
            raise ModelError(f"{self.title}: in a planar mechanism give angle=, not orientation=")
        if not planar and n.angle != 0.0:
            raise ModelError(f"{self.title}: in a spatial mechanism give orientation=, not angle=")

    def check(self, n: SimpleNamespace) -> None:
        """Require constants that are one number, or one for each axis, and not negative."""
        for name in ("stiffness", "damping", "torsional_stiffness", "torsional_damping"):
            value = np.atleast_1d(getattr(n, name))
            if len(value) not in (1, 2, 3) or not all(x.real >= 0.0 for x in value):
                raise ModelError(f"{self.title}: {name} is one number or one for each axis, none negative; got {value}")

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Return the parameters of the formulas."""
        return (
            *_three_components(n.stiffness),
            *_three_components(n.damping),
            *_three_components(n.torsional_stiffness, turning=True),
            *_three_components(n.torsional_damping, turning=True),
        )

    def conservative(self) -> bool:
        """Return whether it has no damping, so that it only exchanges stored energy."""
        return not np.any(np.array(self.damping) != 0.0) and not np.any(np.array(self.torsional_damping) != 0.0)


def _three_components(value: Any, turning: bool = False) -> tuple[float, ...]:
    """Return one number for each axis; in the plane two for displacements, or one about the normal."""
    if not isinstance(value, tuple):
        return (value, value, value)
    if len(value) == 1 and turning:
        return (0.0, 0.0, value[0])
    return (*value, *(0.0,) * (3 - len(value)))
