"""Clutch and brake: friction with a capacity given by a law, between two coordinates or along one."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import field
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from ..compiler.formulas import formula
from ..constraints.switches.friction import FRICTION
from ..errors import ModelError
from ..math.scalar import choose
from ..model.element import Coordinates, Law, LawOf, Numbers, Ratio, Unit, element
from ..model.force import CoordinateForce, Switch, WeightedSumForce
from .joint_friction import SLIDING

if TYPE_CHECKING:
    from ..model.model import Model

KIND = 7


@formula
def effort(par, x, rate, laws, load):
    """Effort along the slip: -capacity times the sliding direction; ``static`` times that for static friction."""
    o = 0.0 * x
    capacity = choose(-laws[0], o + math.nan, laws[0])
    return -par[0] * capacity * choose(laws[2] - SLIDING, par[1] + o, laws[2] + o)


class CapacityFriction:
    """Base class of clutches and brakes: a capacity by law, and the ratio of static to sliding capacity."""

    title: str
    capacity: Law
    along: Callable[[], tuple[str, ...]]

    kind: ClassVar[int] = KIND
    effort: ClassVar = staticmethod(effort)
    single: ClassVar[str] = "friction"
    fails: ClassVar[str] = "Its capacity is negative there; a law such as 'max(0, ...)' never is"
    dimensions: ClassVar[dict[str, tuple[str, str]]] = {"capacity": ("N", "N*m")}
    not_negative: ClassVar[tuple[str, ...]] = ("capacity",)

    def switches(self) -> tuple[Switch, ...]:
        """Return one friction switch."""
        return (Switch(FRICTION, along=self.along(), slides=True, weighted=self.is_weighted()),)

    def is_weighted(self) -> bool:
        """Return False: it acts along one coordinate, or between two."""
        return False

    def check(self, n: SimpleNamespace) -> None:
        """Require a static ratio of at least 1."""
        if not n.static.real >= 1.0:
            raise ModelError(
                f"{self.title}: static is {n.static:g}; it must be 1 or greater: the ratio of the largest torque "
                "while it sticks to the torque while it slips"
            )

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Return the parameters of the formulas."""
        return (1.0, n.static)

    def laws(self) -> tuple[Law | None, ...]:
        """Return the capacity."""
        return (self.capacity,)


@element
class Brake(WeightedSumForce, CapacityFriction, CoordinateForce):
    """A brake along a coordinate: it locks the coordinate, or slips if the load exceeds its capacity.

    While slipping it acts with its capacity against the motion; at rest it can hold ``static`` times that. A locked
    coordinate does not move at all. For friction proportional to a joint's load use `JointFriction`.

    Parameters
    ----------
    name : str
    coordinate : str or list of str
        ``"joint.coordinate"``, or a world coordinate of a body's or frame's origin.
        With ``weights`` a list: the brake acts along their sum.
    weights : list of numbers
        One for each of several coordinates; the first without unit, so that the sum has the first coordinate's unit.
    capacity : law [N m] or [N]
        An expression of ``t``, ``value``, ``rate``, sensors and parameters; never negative.
    static : number [1]
        Ratio of the capacity at rest to that; 1 or greater.

    Raises
    ------
    ModelError
        If the capacity is a negative number.
    SimulationError
        If it becomes negative in a motion.
    """

    coordinate: Coordinates = field(kw_only=False)
    capacity: Annotated[Law, LawOf(None, ("value", "rate"))]
    static: Ratio = 1.0
    weights: Annotated[Numbers | None, Unit(None)] = None

    outputs: ClassVar[dict[str, str]] = {"value": "", "rate": "/s", "friction": "effort"}

    def check(self, n: SimpleNamespace) -> None:
        """Require weights for a sum of coordinates, and a static ratio of at least 1."""
        self.check_weights_given(n)
        super().check(n)


@element
class Clutch(CapacityFriction, CoordinateForce):
    """A clutch between two coordinates, such as the angles of two shafts: it locks them together, slips, or is open.

    Slip is the second coordinate minus the first one. While slipping it transmits its capacity, against the slip, as a
    torque on the second and its reverse on the first. It locks when the slip ends, and slips again if the load exceeds
    ``static`` times its capacity. With a capacity of zero it is open. The heat is minus its ``work``.

    Parameters
    ----------
    name : str
    coordinate_i, coordinate_j : str
        ``"joint.coordinate"``, or world coordinates of bodies or frames: both angles, or both displacements.
    capacity : law [N m] or [N]
        An expression of ``t``, ``slip``, ``rate``, sensors and parameters; never negative.
    static : number [1]
        Ratio of the capacity when locked to that; 1 or greater.

    Raises
    ------
    ModelError
        If the capacity is a negative number.
    SimulationError
        If it becomes negative in a motion.
    """

    coordinate_i: str = field(kw_only=False)
    coordinate_j: str = field(kw_only=False)
    capacity: Annotated[Law, LawOf(None, ("slip", "rate"))]
    static: Ratio = 1.0

    odd: ClassVar[tuple[str, ...]] = ()
    outputs: ClassVar[dict[str, str]] = {"slip": "", "rate": "/s", "friction": "effort"}

    def along(self) -> tuple[str, ...]:
        """Return the coordinates."""
        return (self.coordinate_i, self.coordinate_j)

    def switch_weights(self, n: SimpleNamespace, label: str) -> tuple[Any, ...]:
        """Return the weights: slip is the second coordinate minus the first."""
        return (-1.0, 1.0)

    def examine(self, model: Model) -> None:
        """Require two different coordinates of one kind."""
        if self.coordinate_i == self.coordinate_j:
            raise ModelError(f"{self.title}: both its coordinates are {self.coordinate_i!r}; name two")
        first, second = (model.unit(x, self) for x in self.along())
        if first != second:
            raise ModelError(
                f"{self.title}: {self.coordinate_i!r} is in {first} and {self.coordinate_j!r} in {second}; a clutch "
                f"needs two angles or two displacements"
            )
