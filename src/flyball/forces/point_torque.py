"""A given external torque on a body."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Annotated, ClassVar, Literal

from ..compiler.formulas import formula
from ..errors import ModelError
from ..model.element import Law, LawOf, Laws, element
from ..model.force import BodyForce
from ..model.joint import WorldFrame
from .point_force import components, in_world

KIND = 4


@formula
def wrench(par, F, M, laws, values):
    """Return the torque on M."""
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
        One component about the normal in a planar mechanism, else three; numbers, expressions of ``t``,
        sensors and parameters, or Python functions of these.
    axes : ``"world"`` or ``"body"``
        Whose axes the components are along.
    """

    torque: Annotated[Law | Laws, LawOf("N*m")]
    axes: Literal["world", "body"] = "world"

    kind: ClassVar[int] = KIND
    wrench: ClassVar = staticmethod(wrench)

    def placed(self, n: SimpleNamespace, planar: bool) -> dict[str, WorldFrame] | None:
        """Check the number of components; the torque needs no frames of its own."""
        given = self.torque if isinstance(self.torque, tuple) else (self.torque,)
        if planar and len(given) != 1:
            raise ModelError(f"{self.title}: torque: in a planar mechanism it is one number or law, got {given}")
        if not planar:
            components(self, "torque", given, planar, "(0, 0, 2)")
        return None

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Return the parameters of the formulas."""
        return (1.0 if self.axes == "body" else 0.0,)

    def laws(self) -> tuple[Law | None, ...]:
        """Return the components; a single one is about the normal."""
        given = tuple(self.torque) if isinstance(self.torque, tuple) else (self.torque,)
        return given if len(given) == 3 else (None, None, *given)
