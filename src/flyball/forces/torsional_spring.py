"""Torsional spring and damper about a joint's axis."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Annotated, ClassVar

from .._jit import formula
from ..constraints.angle import row as angle_row
from ..constraints.angle import unwrapped
from ..math.vec import col, dot, scale, sub
from ..model.element import Angle, Number, Unit, element, nonnegative
from ..model.force import JointForce

KIND = 1


@formula
def inputs(par, F, M, turns):
    """Angle of the joint, whole turns counted, and its rate. par[7] is the angle in the drawn configuration."""
    theta = angle_row((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -par[7], 0.0), F, M)[0]
    return unwrapped(theta, turns), dot(col(F[1], 2), sub(M[2], F[2]))


@formula
def wrench(par, F, M, laws, values):
    """Torque on M about the joint's axis: -k (angle - free angle) - c rate."""
    o = 0.0 * par[0]
    return (o, o, o), scale(-(par[0] * (values[0] - par[2]) + par[1] * values[1]), col(F[1], 2))


@formula
def energy(par, F, M, turns):
    """Potential energy k (angle - free angle)^2 / 2 [J]."""
    x = inputs(par, F, M, turns)[0] - par[2]
    return 0.5 * par[0] * x * x


@element
class TorsionalSpringDamper(JointForce):
    """Spring and damper about the axis of a revolute or cylindrical joint.

    The torque -k (angle - angle_0) - c rate acts on ``body_j`` of the joint, its reverse on ``body_i``; whole turns
    count, so a spring may be wound up.

    Parameters
    ----------
    name : str
    joint : str
        Joint with a coordinate ``angle``.
    stiffness : number [N m/rad]
    damping : number [N m s/rad]
    angle : number [rad]
        Angle at which the spring carries nothing.
    """

    stiffness: Annotated[Number, Unit("N*m/rad")] = 0.0
    damping: Annotated[Number, Unit("N*m*s/rad")] = 0.0
    angle: Angle = 0.0

    kind: ClassVar[int] = KIND
    inputs: ClassVar = staticmethod(inputs)
    wrench: ClassVar = staticmethod(wrench)
    energy: ClassVar = staticmethod(energy)
    outputs: ClassVar[dict[str, str]] = {"angle": "rad", "rate": "rad/s", "torque": "N*m"}

    def check(self, n: SimpleNamespace) -> None:
        """Stiffness and damping must not be negative."""
        nonnegative(self, n, "stiffness", "damping")

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Numbers that the formulas see."""
        return (n.stiffness, n.damping, n.angle)

    def conservative(self) -> bool:
        """Whether its energy is all that it ever takes or gives."""
        return self.damping == 0.0
