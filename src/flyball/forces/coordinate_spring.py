"""Spring and damper along any coordinate."""

from __future__ import annotations

from dataclasses import field
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar

from ..compiler.formulas import formula
from ..errors import ModelError
from ..model.element import Coordinates, Law, LawOf, Number, Numbers, Unit, element, nonnegative
from ..model.force import CoordinateForce, WeightedSumForce

KIND = 1


@formula
def effort(par, x, rate, laws, load):
    """Return the effort along x: -k (x - x_0) - c rate + law."""
    return laws[0] - par[0] * (x - par[2]) - par[1] * rate


@formula
def energy(par, x):
    """Potential energy k (x - x_0)^2 / 2 [J]."""
    return 0.5 * par[0] * (x - par[2]) * (x - par[2])


@element
class CoordinateSpring(WeightedSumForce, CoordinateForce):
    """Spring and damper along a coordinate, for instance of a prismatic joint, or a point's height.

    The force (or torque) -k (x - rest) - c rate acts along the coordinate; full turns of angles are counted.

    Parameters
    ----------
    name : str
    coordinate : str or list of str
        ``"joint.coordinate"`` such as ``"slide.displacement"``, or a world coordinate of a body's or frame's origin
        such as ``"block.y"``.
        With ``weights`` a list: the element acts along their sum.
    weights : list of numbers
        One for each of several coordinates; the first without unit, so that the sum has the first coordinate's unit.
    stiffness : number [N/m] or [N m/rad]
    damping : number [N s/m] or [N m s/rad]
    rest : number [m] or [rad]
        Value of the coordinate at which the spring is unloaded.
    force : law [N] or [N m]
        Added force, an expression of ``t``, ``value``, ``rate``, sensors and parameters.
    """

    coordinate: Coordinates = field(kw_only=False)
    stiffness: Annotated[Number, Unit(None)] = 0.0
    damping: Annotated[Number, Unit(None)] = 0.0
    rest: Annotated[Number, Unit(None)] = 0.0
    force: Annotated[Law | None, LawOf(None, ("value", "rate"))] = None
    weights: Annotated[Numbers | None, Unit(None)] = None

    kind: ClassVar[int] = KIND
    effort: ClassVar = staticmethod(effort)
    energy: ClassVar = staticmethod(energy)
    outputs: ClassVar[dict[str, str]] = {"value": "", "rate": "/s", "force": "effort"}

    def check(self, n: SimpleNamespace) -> None:
        """Stiffness and damping must not be negative."""
        self.check_weights_given(n)
        nonnegative(self, n, "stiffness", "damping")
        refuse_without_stiffness(self, "rest", 0.0)

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Return the parameters of the formulas."""
        return (n.stiffness, n.damping, n.rest)

    def laws(self) -> tuple[Law | None, ...]:
        """Return the laws of the formulas."""
        return (self.force,)

    def conservative(self) -> bool:
        """Return whether it has no damping and no law, so that it only exchanges stored energy."""
        return self.force is None and self.damping == 0.0


def measuring_spring(e: Any) -> CoordinateSpring:
    """Return a spring of zero stiffness, whose only purpose is to measure the quantity along which an element acts."""
    return CoordinateSpring(e.name, e.coordinate, weights=e.weights)


def refuse_without_stiffness(e: Any, name: str, usual: float | None) -> None:
    """Refuse a field that has no effect on a spring without stiffness.

    Raises
    ------
    ModelError
        Naming the field.
    """
    if getattr(e, name) != usual and e.stiffness == 0.0:
        raise ModelError(f"{e.title}: {name} has no effect without stiffness; give stiffness, or leave {name} out")
