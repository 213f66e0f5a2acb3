"""Spring, damper and actuator along the length of a path over points."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Annotated, ClassVar

from ..compiler.formulas import formula
from ..model.element import Damping, Law, LawOf, Length, Stiffness, element, nonnegative
from ..model.force import PathForce
from .coordinate_spring import energy, refuse_without_stiffness

KIND = 10


@formula
def effort(par, x, rate, laws, load):
    """Return the effort along the length x: minus the tension k (x - x_0) + c rate + law."""
    return -(par[0] * (x - par[2]) + par[1] * rate + laws[0])


@element
class PathSpring(PathForce):
    """Spring, damper and actuator along a path over two or more points: a spring in a sheath, a tendon, a muscle.

    The tension k (l - l0) + c ldot + F is the same everywhere; where it is negative, the path pushes its points apart.
    Intermediate points are frictionless eyes. An element that only pulls is a `Rope`.

    Parameters
    ----------
    name : str
    bodies : list of str
        Bodies or frames with the points, in order, two or more; ``"ground"`` is the world.
    at : list of points [m]
        The points, in world coordinates of the drawn configuration. Not given: the origins of the frames.
    stiffness : number [N/m]
    damping : number [N s/m]
    length : number [m]
        Unloaded length of the spring; that of the path in the reference configuration if not given.
    force : law [N]
        Added tension, an expression of ``t``, ``length``, ``rate``, sensors and parameters.

    Notes
    -----
    A result contains ``length``, its ``rate`` and the ``tension``.
    """

    stiffness: Stiffness = 0.0
    damping: Damping = 0.0
    length: Length | None = None
    force: Annotated[Law | None, LawOf("N", ("length", "rate"))] = None

    kind: ClassVar[int] = KIND
    effort: ClassVar = staticmethod(effort)
    energy: ClassVar = staticmethod(energy)

    def check(self, n: SimpleNamespace) -> None:
        """Require enough points, and constants that are not negative."""
        super().check(n)
        nonnegative(self, n, "stiffness", "damping", "length")
        refuse_without_stiffness(self, "length", None)

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Return the parameters of the formulas."""
        return (n.stiffness, n.damping, separation if n.length is None else n.length)

    def laws(self) -> tuple[Law | None, ...]:
        """Return the added tension."""
        return (self.force,)

    def conservative(self) -> bool:
        """Return whether it has no damping and no law, so that it only exchanges stored energy."""
        return self.force is None and self.damping == 0.0
