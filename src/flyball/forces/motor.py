"""Motor: a torque about a joint's axis by a law."""

from __future__ import annotations

from typing import Annotated, ClassVar

from ..model.element import Law, LawOf, element
from ..model.force import JointForce
from .coordinate_spring import KIND, effort


@element
class Motor(JointForce):
    """A torque about the axis of a joint with an angle, positive on ``body_j``.

    Parameters
    ----------
    name : str
    joint : str
        Joint with a coordinate ``angle``.
    torque : law [N m]
        An expression of ``t``, ``angle``, ``rate``, sensors and parameters: ``"stall*(1 - rate/no_load)"``.
    """

    torque: Annotated[Law, LawOf("N*m", ("angle", "rate"))]

    kind: ClassVar[int] = KIND
    odd: ClassVar[tuple[str, ...]] = ("torque",)
    effort: ClassVar = staticmethod(effort)
    outputs: ClassVar[dict[str, str]] = {"angle": "rad", "rate": "rad/s", "torque": "N*m"}

    def laws(self) -> tuple[Law | None, ...]:
        """Return the torque law."""
        return (self.torque,)
