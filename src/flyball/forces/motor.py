"""Motor: a torque about a joint's axis by a law."""

from __future__ import annotations

from typing import Annotated, ClassVar

from .._jit import formula
from ..math.vec import col, scale
from ..model.element import Law, LawOf, Number, element
from ..model.force import JointForce
from .torsional_spring import inputs

KIND = 2


@formula
def wrench(par, F, M, laws, values):
    """The law's torque on M about the joint's axis."""
    o = 0.0 * par[0]
    return (o, o, o), scale(laws[0], col(F[1], 2))


@element
class Motor(JointForce):
    """A torque about the axis of a revolute or cylindrical joint, positive on ``body_j``.

    Parameters
    ----------
    name : str
    joint : str
        Joint with a coordinate ``angle``.
    torque : law [N m]
        An expression of ``t``, ``angle``, ``rate`` and parameters: ``"stall*(1 - rate/no_load)"``.
    """

    torque: Annotated[Law, LawOf("N*m", ("angle", "rate"))]

    kind: ClassVar[int] = KIND
    inputs: ClassVar = staticmethod(inputs)
    wrench: ClassVar = staticmethod(wrench)
    outputs: ClassVar[dict[str, str]] = {"angle": "rad", "rate": "rad/s", "torque": "N*m"}

    def laws(self) -> tuple[Number | None, ...]:
        """The torque."""
        return (self.torque,)
