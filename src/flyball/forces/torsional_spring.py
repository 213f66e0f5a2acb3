"""Torsional spring and damper about a joint's axis."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Annotated, ClassVar

from ..model.element import Angle, Law, LawOf, Number, Unit, element, nonnegative
from ..model.force import JointForce
from .coordinate_spring import KIND, effort, energy, refuse_without_stiffness


@element
class TorsionalSpringDamper(JointForce):
    """Spring and damper about the axis of a revolute or cylindrical joint.

    The torque -k (angle - angle_0) - c rate + law acts on ``body_j`` of the joint, its reverse on ``body_i``; full
    turns are counted, so a spring may be wound up.

    Parameters
    ----------
    name : str
    joint : str
        Joint with a coordinate ``angle``.
    stiffness : number [N m/rad]
    damping : number [N m s/rad]
    angle : number [rad]
        Angle at which the spring is unloaded.
    torque : law [N m]
        Added torque, for a nonlinear spring: an expression of ``t``, ``angle``, ``rate``, sensors and parameters.
    """

    stiffness: Annotated[Number, Unit("N*m/rad")] = 0.0
    damping: Annotated[Number, Unit("N*m*s/rad")] = 0.0
    angle: Angle = 0.0
    torque: Annotated[Law | None, LawOf("N*m", ("angle", "rate"))] = None

    kind: ClassVar[int] = KIND
    odd: ClassVar[tuple[str, ...]] = ("angle", "torque")
    effort: ClassVar = staticmethod(effort)
    energy: ClassVar = staticmethod(energy)
    outputs: ClassVar[dict[str, str]] = {"angle": "rad", "rate": "rad/s", "torque": "N*m"}

    def check(self, n: SimpleNamespace) -> None:
        """Stiffness and damping must not be negative."""
        nonnegative(self, n, "stiffness", "damping")
        refuse_without_stiffness(self, "angle", 0.0)

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Return the parameters of the formulas."""
        return (n.stiffness, n.damping, n.angle)

    def laws(self) -> tuple[Law | None, ...]:
        """Return the laws of the formulas."""
        return (self.torque,)

    def conservative(self) -> bool:
        """Return whether it has no damping and no law, so that it only exchanges stored energy."""
        return self.torque is None and self.damping == 0.0
