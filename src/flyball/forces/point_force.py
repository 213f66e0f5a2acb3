"""A given external force at a point of a body."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Annotated, ClassVar, Literal

from ..compiler.formulas import formula
from ..errors import ModelError
from ..math.vec import mv
from ..model.element import Element, Law, LawOf, Laws, Point, element
from ..model.force import BodyForce
from ..model.joint import WorldFrame

KIND = 3


@formula
def in_world(par, F, M, laws):
    """Return the laws as components along the world's axes, or along the body's if par[0] says so."""
    if par[0].real > 0.5:
        return mv(M[1], laws)
    return laws


@formula
def wrench(par, F, M, laws, values):
    """Return the force at M's origin."""
    o = 0.0 * par[0]
    return in_world(par, F, M, laws), (o, o, o)


def components(e: Element, field: str, given: tuple, planar: bool, example: str) -> None:
    """Refuse a vector of laws with too few or too many components."""
    wanted = 2 if planar else 3
    if len(given) != wanted:
        raise ModelError(f"{e.title}: {field} needs {wanted} components, such as {example}, got {given}")


@element
class PointForce(BodyForce):
    """A given force on a body.

    Parameters
    ----------
    name : str
    body : str
        Body it acts on, or a frame fixed on it; the force then acts at the frame's origin.
    force : two or three laws [N]
        Components, each a number, an expression of ``t``, sensors and parameters, or a Python
        function of these.
    at : point [m]
        Point of action, in world coordinates of the drawn configuration; the centre of mass if not given.
    axes : ``"world"`` or ``"body"``
        Axes of the components; in the body's axes the force turns with the body.
    """

    force: Annotated[Laws, LawOf("N")]
    at: Point | None = None
    axes: Literal["world", "body"] = "world"

    kind: ClassVar[int] = KIND
    wrench: ClassVar = staticmethod(wrench)
    symbol: ClassVar[str] = "arrow"

    def placed(self, n: SimpleNamespace, planar: bool) -> dict[str, WorldFrame] | None:
        """Check the number of components; the force needs no frames of its own."""
        components(self, "force", self.force, planar, "(0, -5)" if planar else "(0, 0, -5)")
        return None

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Return the parameters of the formulas."""
        return (1.0 if self.axes == "body" else 0.0,)

    def laws(self) -> tuple[Law | None, ...]:
        """Return the components."""
        return tuple(self.force)

    def on_points(self) -> bool:
        """Return whether the components are along the world's axes."""
        return self.axes == "world"
