"""A torque on a body, from outside."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Annotated, ClassVar, Literal

from .._jit import formula
from ..model.element import Law, LawOf, Number, Numbers, element
from ..model.force import BodyForce
from .point_force import in_world, inputs

KIND = 4


@formula
def wrench(par, F, M, laws, values):
    """The torque."""
    o = 0.0 * par[0]
    return (o, o, o), in_world(par, F, M, laws)


@element
class PointTorque(BodyForce):
    """A given torque on a body.

    Parameters
    ----------
    name : str
    body : str
        Body it acts on.
    torque : law, or three laws [N m]
        One component about the normal in a planar mechanism, else three; numbers or expressions of ``t``.
    axes : ``"world"`` or ``"body"``
        Whose axes the components are along.
    """

    torque: Annotated[Number | Numbers, LawOf("N*m")]
    axes: Literal["world", "body"] = "world"

    kind: ClassVar[int] = KIND
    inputs: ClassVar = staticmethod(inputs)
    wrench: ClassVar = staticmethod(wrench)

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Numbers that the formulas see."""
        return (1.0 if self.axes == "body" else 0.0,)

    def laws(self) -> tuple[Law | None, ...]:
        """The components; a single one is about the normal."""
        return tuple(self.torque) if isinstance(self.torque, tuple) else (None, None, self.torque)
